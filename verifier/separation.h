/** Lower bounds on the distance from a projected slice to an obstacle, from directions evaluated in high precision.

For every direction d:   min {d . w : w in core} - max {d . y : y in P X} <= |d|_2 * distance(core, P X).
The direction of the nearest point of {core - P X} maximises the left side. Wolfe's algorithm finds it with the bits of
Precision, so it separates every pair of sets that doubles can separate. */
#pragma once

#include <vector>

#include <Eigen/Core>

#include "certifier/safety/obstacle.h"
#include "verifier/answer.h"
#include "verifier/tube.h"

namespace forereach::verifier {

/** The projection P X of a slice, p = 1, 2 or 3. */
class ProjectedSlice final {
 public:
  ProjectedSlice(const Slice& slice, const Eigen::MatrixXd& projection);

  [[nodiscard]] int dim() const { return static_cast<int>(center_.size()); }
  [[nodiscard]] const std::vector<Real>& center() const { return center_; }
  [[nodiscard]] const std::vector<std::vector<Real>>& generators() const { return generators_; }

  /** max {d . y : y in P X}. */
  [[nodiscard]] Real Support(const std::vector<Real>& d) const;
  /** A lower bound on max {|y - P c|_2 : y in P X}; for p <= 2 it is the maximum. */
  [[nodiscard]] Real Radius() const;

 private:
  std::vector<Real> center_;
  std::vector<std::vector<Real>> generators_;
};

/** Whether the distance from slice to obstacle is positive and at least `clearance` (metres). kYes is a proof. kNo
means that the best direction gives no proof. @param best is set to the largest lower bound found. */
[[nodiscard]] Answer IsClear(const ProjectedSlice& slice, const Obstacle& obstacle, double clearance, Real& best);

}  // namespace forereach::verifier
