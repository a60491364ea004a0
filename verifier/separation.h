/** How far a projected slice is from an obstacle: lower bounds from directions, each evaluated in high precision.

For any direction d:   min {d . w : w in core} - max {d . y : y in P X} <= |d|_2 * distance(core, P X).
Doubles choose directions, by the generators, edges and corners that they come from; these are then taken in full. */
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

/** Whether the distance from slice to obstacle exceeds `clearance` (is at least that, if it is positive): kYes is a
proof, kNo says that no direction of the search gives one. @param best the largest lower bound found. */
[[nodiscard]] Answer IsClear(const ProjectedSlice& slice, const Obstacle& obstacle, double clearance, Real& best);

}  // namespace forereach::verifier
