/** What one declaration is worth on the paper's groups: answers, half-widths and times of all plans, over the seeds.
For the studies of declarations that the paper does not have. */
#pragma once

#include <array>
#include <string>

#include <Eigen/Core>

#include "research/cell.h"

namespace forereach::research {

struct GroupSums {
  std::array<int, 3> plans{}, safe{}, certified{}, falsified{}, complete{};  ///< By group
  std::array<double, 3> side{};  ///< Half of that of a square as large as P X_T, m
  int false_certificates = 0;
  int outside = 0;  ///< Complete tubes that a rollout leaves
  double build_us = 0, call_us = 0;

  /** Of target-safe plans; "none" without any. */
  [[nodiscard]] std::string Recall(std::size_t group) const;
  /** Mean of the complete tubes; "none" without any. */
  [[nodiscard]] std::string HalfWidth(std::size_t group) const;
};

/** Data in the corridor, seeds from 0. @param noise s, as in MakeData. Cost: that of RunCell twice for each seed. */
[[nodiscard]] GroupSums SumOfSeeds(const System& system, const Method& method, const Eigen::MatrixXd& lipschitz,
                                   int observations, double noise, int seeds, const Effort& effort);

}  // namespace forereach::research
