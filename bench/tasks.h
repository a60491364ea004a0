/** The tasks that speed is measured on: made in code from fixed seeds, the same on every machine. */
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "forereach/certify/certifier.h"
#include "forereach/sets/zonotope.h"

namespace forereach::bench {

/** A problem and one question to it. */
struct Task {
  std::shared_ptr<const Problem> problem;
  Eigen::VectorXd center, half_width;  ///< X0
  Eigen::MatrixXd controls;            ///< m-by-T, a column a step
  std::vector<Obstacle> obstacles;
  Schedule schedule{};

  [[nodiscard]] Zonotope initial_set() const { return Zonotope::FromBox(center, half_width); }
  [[nodiscard]] Plan plan() const {
    Plan plan = PlanOf(controls);
    plan.schedule = schedule;
    return plan;
  }
  [[nodiscard]] static Plan PlanOf(const Eigen::MatrixXd& controls) {
    return {controls.data(),
            static_cast<int>(controls.rows()),
            static_cast<int>(controls.cols()),
            static_cast<int>(controls.rows()),
            {}};
  }
};

enum class Scenario {
  kBicycle,    ///< Two nonzero entries of L, in the row of the heading: the paper's bicycle, group C.
  kPointMass,  ///< Two nonzero entries in each of the four rows: the paper's point mass, group C.
  kDense       ///< The bicycle with every one of the 6 x 8 entries of L nonzero, and a residual that depends on all.
};

[[nodiscard]] std::string NameOf(Scenario scenario);
/** "bicycle/400". */
[[nodiscard]] std::string NameOf(Scenario scenario, int observations);

/** One plan of 12 steps and one circle beside its path, far enough for a certificate at every N >= 25, so that no
abstention cuts the work short. The N observations are drawn uniformly around the plan from a residual that satisfies
the declaration; those of a smaller N are the first ones of a larger. Method kPaper, as the straightforward version. */
[[nodiscard]] Task MakeTask(Scenario scenario, int observations);

/** The same with a circle on the path: the whole tube is computed, and the answer is S. */
[[nodiscard]] Task MakeBlockedTask(Scenario scenario, int observations);

/** A chunk of a learned policy: the bicycle of N = 400, 20 steps in a slight bend, among 11 circles to both sides. */
[[nodiscard]] Task MakeChunkTask();

/** The nominal tube alone: the bicycle without a residual (L = 0), 12 steps of jerk 0.5 and steering rate 0.1 from the
box (0.1, 0.1, 0.02, 0.2, 0.02, 0.005) around (0, 0, 0, 10, 0, 0.05), no obstacle. */
[[nodiscard]] Task MakeNominalTube(Method method = Method::kPaper);

/** The task's plan and `count - 1` variations of it by a few per cent. */
[[nodiscard]] std::vector<Eigen::MatrixXd> MakePlans(const Task& task, int count);

/** Made once for each scenario and N, then kept. */
[[nodiscard]] const Task& CachedTask(Scenario scenario, int observations);
[[nodiscard]] const Certifier& CachedCertifier(Scenario scenario, int observations);

}  // namespace forereach::bench
