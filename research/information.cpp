// What the data leave open: the two systems of Theorems 1 and 2, and the inner bound that every sound tube contains.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "forereach/certify/extremal.h"
#include "forereach/dynamics/models/residuals.h"
#include "forereach/residual/observations.h"
#include "forereach/sets/zonogon.h"
#include "research/evaluate.h"
#include "research/experiment.h"
#include "research/limits/width_bound.h"
#include "research/noise_floor.h"

namespace forereach::research {
namespace {

// A plan in the middle of the corridor among 400 observations, with the target's residual for r0.
struct Scene {
  const System& system = BicycleSystem();
  Eigen::MatrixXd controls = Eigen::Vector2d(0.2, 0.02).replicate(1, system.horizon);
  SmoothResidual residual = Describe(HeadingSaturation{0.1, 2.5}, system.domain.Ranges());
  Rollout rollout{*system.model,
                  residual,
                  {controls.data(), 2, system.horizon, 2},
                  (Eigen::VectorXd(6) << 0, 0, 0, 12, 0, 0.3).finished()};
  Eigen::MatrixXd data = MakeData(system, Layout::kCorridor, 0, 400, 0).z;

  // The class in which r0 has `slack` times what it uses to spare.
  [[nodiscard]] std::vector<WidthBound> Scan(double slack) const {
    const SmoothBounds& used = residual.bounds;
    const double times = 1 + slack;
    return ScanWidthBounds(
        {rollout, {times * used.value, times * used.slope, times * used.curvature}, data, system.projection()});
  }
};

const WidthBound& Widest(const std::vector<WidthBound>& bounds) {
  return *std::ranges::max_element(bounds, {}, &WidthBound::half_width);
}

Table PairTable(const Scene& scene) {
  Table table{
      "Information limits, Theorem 1",
      "Two systems that agree on all 400 observations, r0 +- a phi e_k with a bump at tau = 10 in x, simulated: half "
      "their distance at tau + 1 is a for every a, so no tube of finite width is sound for both."};
  const Eigen::MatrixXd projection = scene.system.projection();
  const WidthBound first =
      BoundWidth({scene.rollout, TwiceTheBounds(scene.residual.bounds), scene.data, projection}, 10, 0);
  const Bump bump{scene.rollout.Queries().col(10), first.bump_radius};
  for (const double amplitude : {0.1, 10.0, 1000.0}) {
    const Pair pair = RollOutPair(scene.rollout, bump, 0, amplitude);
    table.Add(fmt::format("a = {:g}: half-width, m", amplitude), pair.HalfSeparation(projection, 11), 3);
  }
  return table;
}

// The speed at tau + 1 from which the bound of a class with H_2 reaches `half_width`: gain^2 / (2 (h_0 + H_2)) with
// gain dt v.
double SpeedFor(double half_width, double twice_remainder) { return std::sqrt(2 * half_width * twice_remainder) / 0.1; }

Table WidthTable(const Scene& scene) {
  Table table{
      "Information limits, Theorem 2",
      "Bicycle, a plan in the middle of the corridor, v = 12 m/s, 400 observations, r0 the target's residual. The "
      "class (R_max, H_1, H_2) is not in the paper's text; ours is twice what r0 uses. Where a_lin is least, the bound "
      "is gain^2 / (2 (h_0 + H_2)): at tau = 10, k = 2 all of it is dt v and curvature. H_2 exceeds sup |D^2 r0|, "
      "which the domain's largest speed makes large; the last two rows say which speed of the plan the paper's figure "
      "takes then. So the paper's H_2 is of another r0 or a smaller domain, or its plan is faster than 14.75 m/s.",
      {}};
  const std::vector<WidthBound> bounds = scene.Scan(1);
  const WidthBound& widest = Widest(bounds);
  const auto positive = std::ranges::count_if(bounds, [](const WidthBound& b) { return b.half_width > 0; });
  const auto add = [&](const char* what, Mark mark, const char* key, double ours, int decimals) {
    table.Add(what, {mark, PaperOrNone(std::string("width.") + key)}, ours, decimals,
              "the paper's class, plan and r0 are not in its text");
  };
  const auto row = [&](const char* what, const char* key, double ours, int decimals) {
    add(what, Mark::kOurs, key, ours, decimals);
  };
  add("admissible pairs", Mark::kExact, "pairs", static_cast<double>(bounds.size()), 0);
  row("of these with a positive bound", "positive", static_cast<double>(positive), 0);
  row("tau of the largest", "tau", widest.tau, 0);
  row("k of the largest", "k", widest.k, 0);
  row("the largest, m", "largest", widest.half_width, 6);
  row("its gain |P G e_k|", "", widest.gain, 4);
  row("its remainder constant C", "", widest.remainder, 4);
  row("its a_class", "", widest.a_class, 4);
  row("its a_pass", "", widest.a_pass, 4);
  row("its a_lin", "", widest.a_lin, 4);
  for (const double slack : {0.5, 0.1})
    row(slack == 0.5 ? "the largest, class 1.5 times r0" : "the largest, class 1.1 times r0", "",
        Widest(scene.Scan(slack)).half_width, 6);
  const double curvature = scene.residual.bounds.curvature, nominal = 2 * widest.remainder - 2 * curvature;
  row("sup |D^2 r0|, proved bound", "", curvature, 3);
  const double paper = Paper("width.largest").value;
  row("speed for the paper's figure in our class, m/s", "", SpeedFor(paper, 2 * widest.remainder), 2);
  row("the same in the least class with r0, m/s", "", SpeedFor(paper, nominal + curvature), 2);
  return table;
}

Table ScanTable(const Scene& scene) {
  Table table{"Information limits, Theorem 2 by time", "The same: the largest bound over the coordinates."};
  const std::vector<WidthBound> bounds = scene.Scan(1);
  for (int tau = 0; tau <= scene.system.horizon - 2; ++tau) {
    const WidthBound* best = nullptr;
    for (const WidthBound& bound : bounds)
      if (bound.tau == tau && (!best || bound.half_width > best->half_width)) best = &bound;
    if (best)
      table.Add("tau = " + std::to_string(tau) + ", k = " + std::to_string(best->k) + ": half-width, m",
                best->half_width, 9);
  }
  return table;
}

// ---- inner bound

constexpr int kPlansOfInner = 10, kPlansOfQuickInner = 2;

struct Inner {
  double share_sum = 0;  // of the tube's half-width at the horizon
  int tubes = 0, escapes = 0;
};

// Outside is proven; a state on the very edge, as corners are, may stay undecided.
bool MissesOne(const Answer& answer, const std::vector<Eigen::MatrixXd>& states) {
  for (int t = 0; t <= answer.tube.length(); ++t) {
    const Eigen::MatrixXd& reached = states[static_cast<std::size_t>(t)];
    for (Eigen::Index i = 0; i < reached.cols(); ++i)
      if (Locate(answer.tube.slice(t), {reached.col(i).data(), static_cast<std::size_t>(reached.rows())}) ==
          Membership::kOutside)
        return true;
  }
  return false;
}

Inner InnerBounds(const System& system, int observations, int seed, int plans) {
  const Transitions data = MakeData(system, Layout::kCorridor, seed, observations, 0);
  const Declaration declaration{system.deployed, Eigen::VectorXd::Zero(system.num_states())};
  const auto envelope =
      Methods().front().make({*system.model, system.domain, declaration, data, static_cast<std::uint64_t>(seed)});
  const Evaluator evaluator(system, *envelope, 5);
  const ExtremalResiduals extremal(declaration, Observe(*system.model, data));
  Inner inner;
  Answer answer;
  for (int i = 0; i < plans; ++i) {
    const Scenario scenario = MakeScenario(system, Group::kC, seed, i);
    evaluator.Certify(scenario, answer);
    if (!answer.IsComplete()) continue;
    const Plan plan{scenario.controls.data(), system.num_inputs(), system.horizon, system.num_inputs()};
    const std::vector<Eigen::MatrixXd> states =
        ExtremalRollouts(*system.model, extremal, plan, CornersOf(scenario.center, system.initial_half_width));
    const Zonotope& last = answer.tube.slice(answer.tube.length());
    const Zonotope projected(last.CenterVector().head(2), last.GeneratorMatrix().topRows(2));
    inner.share_sum += HalfSpread(system.projection(), states.back()) / RadiusUpper(projected);
    inner.escapes += MissesOne(answer, states);
    ++inner.tubes;
  }
  return inner;
}

Table InnerTable(const Scope& scope) {
  Table table{"Inner bound",
              "C, noiseless, a few plans a seed, complete tubes. Rollouts of the lower, upper and mixed McShane "
              "extensions of the data from the center and corners of X0: systems that data and declaration allow, so "
              "every sound tube contains them. Share: half the spread of their positions at T over the half-width of "
              "our tube; 1 would mean that no sound tube is narrower.",
              {}};
  for (const System* system : Systems())
    for (const int observations : scope.SizesOf(*system)) {
      std::vector<std::optional<double>> shares;
      int escapes = 0, tubes = 0;
      for (int seed = 0; seed < scope.seeds; ++seed) {
        const Inner inner = InnerBounds(*system, observations, seed, scope.quick ? kPlansOfQuickInner : kPlansOfInner);
        shares.push_back(inner.tubes > 0 ? std::optional(inner.share_sum / inner.tubes) : std::nullopt);
        escapes += inner.escapes;
        tubes += inner.tubes;
      }
      const std::string where = system->name + ", N = " + std::to_string(observations) + ": ";
      table.Add(where + "share", EstimateOf(shares), 3);
      table.Add(where + "tubes that miss an extremal state, of " + std::to_string(tubes), escapes, 0);
    }
  return table;
}

std::vector<Table> LimitTables(const Results& results) {
  const Scene scene;
  return {PairTable(scene), WidthTable(scene), ScanTable(scene), InnerTable(results.scope), NoiseFloorTable()};
}

}  // namespace

Experiment InformationLimits() { return {"limits", "widths that the data force on every sound tube", {}, LimitTables}; }

}  // namespace forereach::research
