/** An axis-aligned box {x in R^n : lower <= x <= upper}. It is closed and not empty; n = 0 is allowed. */
#pragma once

#include "forereach/sets/eigen.h"

namespace forereach {

class Box final {
 public:
  /** The point of dimension 0. */
  Box() = default;

  /** @param lower, upper n entries each, in the units of the coordinates.
  @throws std::invalid_argument if the sizes differ, an entry is not finite, or lower > upper; it names the
  coordinate. */
  Box(Eigen::VectorXd lower, Eigen::VectorXd upper);

  /** A box that contains {x : |x - center| <= half_width}, rounded outward.
  @param center, half_width n entries each; half_width >= 0. @throws the same. */
  [[nodiscard]] static Box FromCenter(const Eigen::VectorXd& center, const Eigen::VectorXd& half_width);

  [[nodiscard]] int dim() const { return static_cast<int>(lower_.size()); }
  [[nodiscard]] const Eigen::VectorXd& lower() const { return lower_; }
  [[nodiscard]] const Eigen::VectorXd& upper() const { return upper_; }
  /** Whether lower <= x <= upper, exactly. False if the sizes differ or an entry is NaN. Cost O(n). */
  [[nodiscard]] bool Contains(const Eigen::VectorXd& x) const;

 private:
  Eigen::VectorXd lower_, upper_;
};

}  // namespace forereach
