/** An axis-aligned box {x : lower <= x <= upper}, closed, not empty. */
#pragma once

#include "certifier/sets/eigen.h"

namespace forereach {

class Box final {
 public:
  /** The point of dimension 0. */
  Box() = default;

  /** @throws std::invalid_argument naming the coordinate unless both have one size and lower <= upper, both finite. */
  Box(Eigen::VectorXd lower, Eigen::VectorXd upper);

  /** A box that contains {x : |x - center| <= half_width}, rounded outward. Same errors. */
  [[nodiscard]] static Box FromCenter(const Eigen::VectorXd& center, const Eigen::VectorXd& half_width);

  [[nodiscard]] int dim() const { return static_cast<int>(lower_.size()); }
  [[nodiscard]] const Eigen::VectorXd& lower() const { return lower_; }
  [[nodiscard]] const Eigen::VectorXd& upper() const { return upper_; }
  [[nodiscard]] bool Contains(const Eigen::VectorXd& x) const;

 private:
  Eigen::VectorXd lower_, upper_;
};

}  // namespace forereach
