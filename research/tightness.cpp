#include "research/tightness.h"

#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "forereach/certify/certifier.h"
#include "forereach/certify/extremal.h"
#include "forereach/certify/pieces.h"
#include "forereach/certify/tube.h"
#include "forereach/sets/zonogon.h"
#include "forereach/sets/zonotope.h"
#include "research/markdown.h"
#include "research/scenarios.h"
#include "research/truth.h"

namespace forereach::research {
namespace {

// Of speed and steering angle each: what decides how wide the residual is, and how the set turns.
constexpr int kSplit = 8;
constexpr int kSpeed = 3, kSteering = 5;

std::shared_ptr<const Problem> ProblemOf(const System& system, Transitions data, forereach::Method method) {
  auto made = std::make_shared<Problem>();
  Problem& problem = *made;
  problem.model = system.model;
  problem.domain = system.domain;
  problem.declaration = {system.deployed, Eigen::VectorXd::Zero(system.num_states())};
  problem.transitions = std::move(data);
  problem.projection = system.projection();
  problem.method = method;
  return made;
}

// Half the spread of the tube's end, X_0 cut into split * split parts; none if one of their tubes leaves the domain.
std::optional<double> HalfWidth(const Certifier& certifier, const Plan& plan, const Scenario& scenario,
                                const Eigen::VectorXd& half_width, int split) {
  std::vector<Eigen::Vector2d> corners;
  Tube tube;
  Eigen::VectorXd part = half_width;
  for (const int k : {kSpeed, kSteering}) part[k] /= split;
  for (int i = 0; i < split * split; ++i) {
    Eigen::VectorXd center = scenario.center;
    center[kSpeed] += part[kSpeed] * (2 * (i % split) + 1 - split);
    center[kSteering] += part[kSteering] * (2 * (i / split) + 1 - split);
    if (certifier.Certify(plan, Zonotope::FromBox(center, part), {}, tube).outcome != Outcome::kCertified) return {};
    const Zonotope& last = tube.slice(tube.length());
    const auto outline = Outline(Zonotope(last.CenterVector().head(2), last.GeneratorMatrix().topRows(2)));
    corners.insert(corners.end(), outline.begin(), outline.end());
  }
  Eigen::MatrixXd points(2, std::ssize(corners));
  for (Eigen::Index i = 0; i < points.cols(); ++i) points.col(i) = corners[static_cast<std::size_t>(i)];
  return HalfSpread(Eigen::Matrix2d::Identity(), points);
}

struct Tightness {
  int tubes = 0, safe = 0, by_paper = 0, certified = 0, in_pieces = 0, falsely = 0;
  double whole = 0, parts = 0;  // sums of half-widths over the inner bound
};

void Count(const System& system, int observations, int seed, int plans, Tightness& sum) {
  const Transitions data = MakeData(system, Layout::kCorridor, seed, observations, 0);
  const Certifier paper(ProblemOf(system, data, forereach::Method::kPaper)),
      certifier(ProblemOf(system, data, forereach::Method::kCentred));
  const ExtremalResiduals extremal(certifier.problem().declaration, Observe(*system.model, data));
  Tube tube;
  for (int i = 0; i < plans; ++i) {
    const Scenario scenario = MakeScenario(system, Group::kC, seed, i);
    const Plan plan{scenario.controls.data(), system.num_inputs(), system.horizon, system.num_inputs()};
    const Zonotope initial_set = Zonotope::FromBox(scenario.center, system.initial_half_width);
    const Obstacle circle = Obstacle::Circle(scenario.obstacle.center, scenario.obstacle.radius);
    const auto certifies = [&](const Certifier& with, int pieces) {
      return CertifyInPieces(with, plan, initial_set, {&circle, 1}, pieces, tube).outcome == Outcome::kCertified;
    };
    const bool in_pieces = certifies(certifier, Pieces::kMost);
    if (Rollouts(system, scenario, system.rollouts).StayClearOf(scenario.obstacle)) {
      ++sum.safe;
      sum.by_paper += certifies(paper, 1);
      sum.certified += certifies(certifier, 1);
      sum.in_pieces += in_pieces;
    } else {
      sum.falsely += in_pieces;
    }
    const auto from_all = HalfWidth(certifier, plan, scenario, system.initial_half_width, 1),
               from_parts = HalfWidth(certifier, plan, scenario, system.initial_half_width, kSplit);
    if (!from_all || !from_parts) continue;
    const double inner = HalfSpread(
        system.projection(),
        ExtremalRollouts(*system.model, extremal, plan, CornersOf(scenario.center, system.initial_half_width)).back());
    ++sum.tubes;
    sum.whole += *from_all / inner;
    sum.parts += *from_parts / inner;
  }
}

}  // namespace

void RunTightness(bool quick, std::ostream& out) {
  const System& system = BicycleSystem();
  const int seeds = quick ? 1 : 10, plans = quick ? 10 : 50;
  std::vector<Cells> rows;
  for (const int observations : {25, 50, 100}) {
    Tightness sum;
    for (int seed = 0; seed < seeds; ++seed) Count(system, observations, seed, plans, sum);
    rows.push_back({std::to_string(observations),
                    fmt::format("{:.3f} → {:.3f}", sum.whole / sum.tubes, sum.parts / sum.tubes),
                    std::to_string(sum.tubes),
                    fmt::format("{:.3f} → {:.3f} → {:.3f}", 1.0 * sum.by_paper / sum.safe,
                                1.0 * sum.certified / sum.safe, 1.0 * sum.in_pieces / sum.safe),
                    std::to_string(sum.safe), std::to_string(sum.falsely)});
  }
  out << fmt::format(
             "{} seeds, {} plans of group C of the bicycle, noiseless, deployed L. Half-width by method centred: from "
             "all of X_0 → from {} by {} parts of it, in speed and steering. Recall: method paper → centred → centred "
             "with up to {} pieces.\n\n",
             seeds, plans, kSplit, kSplit, Pieces::kMost)
      << Markdown({"N", "half-width over the inner bound", "tubes", "recall", "safe plans", "false certificates"}, rows)
      << std::flush;
}

}  // namespace forereach::research
