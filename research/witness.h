/** Declarations that are too small and that data from below the knee do not contradict: how much larger one would have
to be for the tubes to contain the target. */
#pragma once

#include <optional>

#include <Eigen/Core>

#include "research/evaluate.h"
#include "research/scenarios.h"
#include "research/truth.h"

namespace forereach::research {

/** A system with noiseless data from below the knee, the largest N, seed 0, and a declared L. Refers to the system. */
struct Undeclared {
  const System& system;
  Eigen::MatrixXd lipschitz;
  Transitions data = MakeData(system, Layout::kBelowKnee, 0, system.sample_sizes.back(), 0);

  /** ForeReach's answer under factor * L. */
  [[nodiscard]] Answer Certify(const Scenario& scenario, double factor = 1) const;
  /** The same under L, with uniform noise of at most sigma in every recorded state, declared. */
  [[nodiscard]] Answer CertifyUnderNoise(const Scenario& scenario, double sigma) const;
  /** Whether two observations contradict L. With sigma: as CertifyUnderNoise. */
  [[nodiscard]] bool IsContradicted(double sigma = 0) const;
  /** Whether the tube under factor * L, as far as it goes, contains every rollout of the plan. Not if F: the factor is
  so small that an envelope is empty. */
  [[nodiscard]] bool Contains(const Scenario& scenario, double factor) const;
  /** The largest |r_k(z) - r_k(z_i)| over sum_l L_kl |z_l - z_il| of observations and states of the plan's rollouts. */
  [[nodiscard]] double EmpiricalFactor(const Scenario& scenario) const;
};

struct ContainmentFactor {
  double factor;     ///< Contained
  double too_small;  ///< Not contained, and less by 2e-5 of the factor
  bool is_complete;  ///< Whether the tube reaches the horizon at the factor
};

/** By bisection, from 2^-6 to 2^10; none if it is outside. A larger factor never makes an envelope narrower, but a tube
that leaves the domain earlier has less to contain. */
[[nodiscard]] std::optional<ContainmentFactor> FactorForContainment(const Undeclared& task, const Scenario& scenario);

/** A member of the adversarial family, whose data from below the knee reach up to it. */
[[nodiscard]] System NextToTheKnee(double lambda);
/** A plan that starts below the knee and is driven through it along x; its obstacle is another plan's. */
[[nodiscard]] Scenario ThroughTheKnee(const System& system, int index);

/** A plan of group C with the obstacle in the target's way at a step. */
[[nodiscard]] Scenario InTheWay(const System& system, int index, int step);

}  // namespace forereach::research
