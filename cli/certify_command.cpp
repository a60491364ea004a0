#include <algorithm>
#include <chrono>
#include <iostream>
#include <iterator>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/numerics/text.h"
#include "forereach/safety/obstacle_index.h"
#include "records/decision_json.h"
#include "records/outlines.h"
#include "records/picture.h"
#include "task/json_text.h"

namespace forereach {
namespace {

struct CertifyArguments {
  std::string config, plan, picture;
  bool json = false;
};

// What the limits' functions reach at the samples of the tube.
void PrintLimits(const Plan& plan, const Tube& tube, const Certifier& certifier) {
  const std::span<const Limit> limits = certifier.limits().limits();
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const auto& [name, that, at_least, at_most] = limits[i];
    const auto reach = certifier.limits().Reach(static_cast<int>(i), plan, tube);
    if (!reach) continue;
    std::cout << (i == 0 ? "\n  limits: " : ", ") << name;
    if (at_least > -kInfinity) std::cout << " from " << RoundedDown(reach->lower) << " (at least " << at_least << ")";
    if (at_most < kInfinity) std::cout << " to " << RoundedUp(reach->upper) << " (at most " << at_most << ")";
  }
}

void PrintForPeople(const CertifyResult& result, const Plan& plan, const Tube& tube, const Certifier& certifier,
                    const Config& config) {
  std::cout << Explain(result.decision, certifier, config.obstacles, plan, tube) << "\n";
  const auto& names = certifier.problem().model->state_names();
  if (result.decision.outcome == Outcome::kFalsified && result.decision.step < 0) {
    std::cout << "  no tube";
  } else {
    std::cout << "  tube: " << tube.length() << " steps; half-width of its last slice:";
    for (std::size_t k = 0; k < names.size(); ++k)
      std::cout << " " << names[k] << " " << RoundedUp(tube.slice(tube.length()).HalfWidthUpper(static_cast<int>(k)));
  }
  if (tube.length() > 0) PrintLimits(plan, tube, certifier);
  if (const Declaration& declaration = certifier.problem().declaration; declaration.IsDisturbed()) {
    std::cout << "\n  each step disturbed by up to:";
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      if (declaration.Grows(i) || declaration.DisturbanceBound(i) != 0)
        std::cout << " " << names[k] << " "
                  << (declaration.Grows(i) ? declaration.DisturbanceText(i)
                                           : RoundedDown(declaration.DisturbanceBound(i)));
    }
  }
  std::cout << "\n  took " << result.elapsed_us << " us" << std::endl;
}

// The tube as far as it was judged, among the obstacles.
Picture PictureOf(const Decision& decision, const Plan& plan, const Tube& tube, const Certifier& certifier,
                  const Config& config) {
  const Problem& problem = certifier.problem();
  Picture picture;
  picture.title = Explain(decision, certifier, config.obstacles, plan, tube);
  picture.obstacles = config.obstacles;
  const Eigen::VectorXd start = (config.initial_set.lower() + config.initial_set.upper()) / 2;
  picture.bodies = BodyAt(problem, start);
  picture.path = {Eigen::Vector2d(problem.projection * start)};
  if (config.planner.goal.size() == 2)
    picture.goal = {{config.planner.goal[0], config.planner.goal[1]}, config.planner.goal_radius};
  const int last = decision.cause == Cause::kObstacle ? decision.step : certifier.safety().NumUnits(tube) - 1;
  std::vector<Picture::Polygon> swept;
  if (last >= 0)
    for (std::vector<Picture::Polygon>& unit : Sweeps(certifier, tube, last))
      std::ranges::move(unit, std::back_inserter(swept));
  if (decision.outcome == Outcome::kSafety) {
    picture.abstained = {std::move(swept)};
  } else {
    picture.expected = std::move(swept);
    picture.expected_name = decision.outcome == Outcome::kCertified ? "certified" : "tube before the abstention";
  }
  return picture;
}

int Certify(const CertifyArguments& options) {
  const auto pictures = options.picture.empty() ? std::vector<std::string>{} : PictureFiles(options.picture);
  const Config config = LoadConfig(options.config);
  RequireForCertifying(config);
  if (!pictures.empty() && config.problem->projection.rows() != 2)
    throw PictureError("picture: the task's safety coordinates are not two, so there is no picture");
  const Certifier certifier(config.problem);
  const Eigen::MatrixXd controls = LoadPlan(options.plan, *config.problem->model);
  const auto inputs = static_cast<int>(controls.rows()), steps = static_cast<int>(controls.cols());
  const Plan plan{controls.data(), inputs, steps, inputs, ScheduleFromZero(config, steps)};
  const Zonotope initial_set = Zonotope::Enclose(config.initial_set);
  try {
    // What Certify takes for granted comes from files here: a wrong one is an error, not an abstention.
    certifier.Require(plan, initial_set, config.obstacles);
  } catch (const std::invalid_argument& error) {
    throw ConfigError("{}: {}", options.plan, error.what());
  }

  Tube tube;
  const ObstacleIndex index(config.obstacles);
  CertifyResult result;
  const auto begin = std::chrono::steady_clock::now();
  result.decision = certifier.Certify(plan, initial_set, {config.obstacles, index}, tube);
  result.elapsed_us = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
  result.schedule = plan.schedule;
  result.controls = controls;

  for (const std::string& file : pictures) DrawPicture(PictureOf(result.decision, plan, tube, certifier, config), file);
  if (options.json)
    std::cout << JsonText(ToJson(result, tube, certifier, config)) << std::endl;
  else
    PrintForPeople(result, plan, tube, certifier, config);
  return result.decision.outcome == Outcome::kCertified ? 0 : 1;
}

}  // namespace

Command CertifyCommand() {
  const auto options = std::make_shared<CertifyArguments>();
  return {
      .name = "certify",
      .footer = "Example:\n  forereach certify --config config/bicycle.yaml --plan config/plans/bicycle_certified.csv",
      .options = {ConfigOption(options->config),
                  Required(
                      {"--plan", &options->plan, "FILE.csv", "Controls, one row for each step (CSV with a header)"}),
                  {"--picture", &options->picture, "NAME",
                   "Draws obstacles, tube and goal into NAME.svg and NAME.png, or into one of them"},
                  JsonFlag(options->json, "Print one JSON document on standard output, and nothing else")},
      .run = [options] { return Certify(*options); }};
}

}  // namespace forereach
