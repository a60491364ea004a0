#include "forereach/sets/box.h"

#include <stdexcept>
#include <string>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/text.h"

namespace forereach {

Box::Box(Eigen::VectorXd lower, Eigen::VectorXd upper) : lower_(std::move(lower)), upper_(std::move(upper)) {
  if (lower_.size() != upper_.size())
    throw std::invalid_argument("box: lower has " + std::to_string(lower_.size()) + " entries, upper " +
                                std::to_string(upper_.size()));
  for (Eigen::Index k = 0; k < lower_.size(); ++k)
    if (!(-kInfinity < lower_[k] && lower_[k] <= upper_[k] && upper_[k] < kInfinity))
      throw std::invalid_argument("box: entry " + std::to_string(k) + ": [" + ToText(lower_[k]) + ", " +
                                  ToText(upper_[k]) + "] is not a finite interval");
}

Box Box::FromCenter(const Eigen::VectorXd& center, const Eigen::VectorXd& half_width) {
  if (center.size() != half_width.size())
    throw std::invalid_argument("box: center has " + std::to_string(center.size()) + " entries, half_width " +
                                std::to_string(half_width.size()));
  return {center.binaryExpr(half_width, &SubDown), center.binaryExpr(half_width, &AddUp)};
}

bool Box::Contains(const Eigen::VectorXd& x) const {
  return x.size() == lower_.size() && (lower_.array() <= x.array()).all() && (x.array() <= upper_.array()).all();
}

}  // namespace forereach
