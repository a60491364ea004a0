#include <iostream>
#include <stdexcept>

#include <CLI/CLI.hpp>

#include "certifier/task/config.h"
#include "cli/commands.h"
#include "planner_bridge/proposal.h"

namespace forereach {
namespace {

struct Options {
  std::string config, out;
  std::uint32_t seed = 1;
};

// A task that certifies need not be one that plans: no goal, or a model that nobody has taught to brake.
Planner PlannerOf(const Config& config) {
  try {
    return {config.problem, config.planner, config.obstacles};
  } catch (const std::invalid_argument& error) {
    throw ConfigError(config.path + ": " + error.what());
  }
}

int MakePlan(const Options& options) {
  const Config config = LoadConfig(options.config);
  Planner planner = PlannerOf(config);
  PlanRequest request;
  request.state = (config.initial_set.lower() + config.initial_set.upper()) / 2;
  request.clearance = config.planner.clearance;
  request.seed = options.seed;
  const auto proposal = planner.ProposeToGoal(request);
  if (!proposal) {
    std::cerr << "forereach plan: no plan found from the initial set with seed " << options.seed
              << "; try another --seed, a smaller planner.clearance or a larger planner.time_limit_ms" << std::endl;
    return 1;
  }
  SavePlan(options.out, *config.problem->model, proposal->controls);
  const Eigen::VectorXd end = config.problem->projection * proposal->states.rightCols<1>();
  std::cout << options.out << ": " << proposal->controls.cols() << " steps, the last "
            << proposal->controls.cols() - proposal->progress_steps << " brake to a stand at " << end.transpose()
            << "\n  now: forereach certify --config " << options.config << " --plan " << options.out << std::endl;
  return 0;
}

}  // namespace

void AddPlanCommand(CLI::App& app, Action& action) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("plan", "Let OMPL plan from the initial set towards planner.goal: a CSV file");
  command->add_option("--config", options->config, "Task file (YAML)")->required()->type_name("FILE");
  command->add_option("--out", options->out, "Where to write the controls")->required()->type_name("FILE.csv");
  command->add_option("--seed", options->seed, "The same seed gives the same plan")->capture_default_str();
  command->footer("Example:\n  forereach plan --config config/demo.yaml --out plan.csv");
  command->callback([options, &action] { action = [options] { return MakePlan(*options); }; });
}

}  // namespace forereach
