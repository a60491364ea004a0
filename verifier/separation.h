/** How far a projected slice is from an obstacle: lower bounds from directions, each evaluated in high precision.

For any direction d:   min {d . w : w in core} - max {d . y : y in P X} <= |d|_2 * distance(core, P X).
The largest value belongs to the direction of the nearest point of {core - P X}, found by Wolfe's algorithm with the
bits of Precision, so that nothing that a double can tell is lost. */
#pragma once

#include <vector>

#include <Eigen/Core>

#include "certifier/safety/obstacle.h"
#include "verifier/answer.h"
#include "verifier/tube.h"

namespace forereach::verifier {

/** P X, p = 1, 2 or 3. */
class ProjectedSlice final {
 public:
  ProjectedSlice(const Slice& slice, const Eigen::MatrixXd& projection);

  [[nodiscard]] int dim() const { return static_cast<int>(center_.size()); }
  [[nodiscard]] const std::vector<Real>& center() const { return center_; }
  [[nodiscard]] const std::vector<std::vector<Real>>& generators() const { return generators_; }

  /** max {d . y : y in P X}. */
  [[nodiscard]] Real Support(const std::vector<Real>& d) const;
  /** A lower bound on max {|y - P c| : y in P X}; in the plane and on the line the maximum itself. */
  [[nodiscard]] Real Radius() const;

 private:
  std::vector<Real> center_;
  std::vector<std::vector<Real>> generators_;
};

/** Whether the distance from slice to obstacle is above zero, and at least `clearance`. kYes is a proof; kNo says that
the best direction gives none. @param best the largest lower bound found. */
[[nodiscard]] Answer IsClear(const ProjectedSlice& slice, const Obstacle& obstacle, double clearance, Real& best);

}  // namespace forereach::verifier
