#include "certifier/residual/consistency.h"

#include <cmath>
#include <vector>

namespace forereach {
namespace {

// The test itself, rounded in favour of the declaration.
std::optional<Violation> Test(const Declaration& declaration, const Observations& o, int i, int j, int k) {
  const double difference = std::max(SubDown(o.lower(i, k), o.upper(j, k)), SubDown(o.lower(j, k), o.upper(i, k)));
  double bound = MulUp(2, declaration.noise_bound[k]);
  for (Eigen::Index l = 0; l < o.z.cols(); ++l) {
    const double slope = declaration.lipschitz(k, l);
    if (slope == 0) continue;
    const double distance = std::max(SubUp(o.z(i, l), o.z(j, l)), SubUp(o.z(j, l), o.z(i, l)));
    bound = AddUp(bound, MulUp(slope, distance));
  }
  if (difference > bound) return Violation{i, j, k, difference, bound};
  return std::nullopt;
}

// A constant coordinate: only the largest lower end against the smallest upper end can be the worst pair.
std::optional<Violation> TestConstant(const Declaration& declaration, const Observations& o, int k) {
  Eigen::Index highest = 0, lowest = 0;
  o.lower.col(k).maxCoeff(&highest);
  o.upper.col(k).minCoeff(&lowest);
  return Test(declaration, o, static_cast<int>(std::min(highest, lowest)), static_cast<int>(std::max(highest, lowest)), k);
}

// Finds suspects by plain arithmetic with a margin far above its rounding error; Test decides.
std::optional<Violation> TestPairs(const Declaration& declaration, const Observations& o, int k) {
  std::vector<Eigen::VectorXd> scaled;  // L_kl z_l of all observations, for each active column l
  double scale = 0;
  for (Eigen::Index l = 0; l < o.z.cols(); ++l) {
    if (declaration.lipschitz(k, l) == 0) continue;
    scaled.push_back(declaration.lipschitz(k, l) * o.z.col(l));
    scale += scaled.back().cwiseAbs().maxCoeff();
  }
  const Eigen::VectorXd lower = o.lower.col(k), upper = o.upper.col(k);
  scale += std::max(lower.cwiseAbs().maxCoeff(), upper.cwiseAbs().maxCoeff()) + declaration.noise_bound[k];
  const double slack = 2 * declaration.noise_bound[k] - 1e-13 * scale;
  const int count = o.size();
  Eigen::ArrayXd excess(count);
  for (int i = 0; i < count; ++i) {
    const int rest = count - i - 1;
    auto tail = excess.tail(rest);
    tail = (lower[i] - upper.tail(rest).array()).max(lower.tail(rest).array() - upper[i]);
    for (const Eigen::VectorXd& column : scaled) tail -= (column.tail(rest).array() - column[i]).abs();
    if (rest == 0 || tail.maxCoeff() <= slack) continue;
    for (int j = i + 1; j < count; ++j)
      if (excess[j] > slack)
        if (const auto violation = Test(declaration, o, i, j, k)) return violation;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Violation> FindViolation(const Declaration& declaration, const Observations& observations) {
  for (int k = 0; k < observations.num_states(); ++k) {
    const bool constant = (declaration.lipschitz.row(k).array() == 0).all();
    const auto violation =
        constant ? TestConstant(declaration, observations, k) : TestPairs(declaration, observations, k);
    if (violation) return violation;
  }
  return std::nullopt;
}

}  // namespace forereach
