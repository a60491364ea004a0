#include "experiments/membership.h"

#include <algorithm>

#include <Eigen/QR>

namespace forereach::experiments {
namespace {

constexpr int kRounds = 5000, kRoundsBetweenTests = 5;
constexpr double kClose = 1e-9;

}  // namespace

Membership Locate(const Zonotope& set, std::span<const double> x) {
  const Eigen::Map<const Eigen::VectorXd> point(x.data(), static_cast<Eigen::Index>(x.size()));
  Eigen::MatrixXd generators = set.GeneratorMatrix();
  Eigen::VectorXd rest = point - set.CenterVector();
  for (Eigen::Index k = 0; k < rest.size(); ++k) {
    const double half_width = generators.row(k).cwiseAbs().sum();
    if (std::abs(rest[k]) > half_width * (1 + kClose)) return Membership::kOutside;
    if (half_width == 0) continue;
    generators.row(k) /= half_width;
    rest[k] /= half_width;
  }
  if (generators.cols() == 0) return Membership::kInside;
  const Eigen::VectorXd target = rest, squares = generators.colwise().squaredNorm();
  Eigen::VectorXd b = generators.completeOrthogonalDecomposition().solve(target).cwiseMax(-1).cwiseMin(1);
  rest -= generators * b;
  for (int round = 0; round < kRounds; ++round) {
    if (round % kRoundsBetweenTests == 0) {
      if (rest.size() == 0 || rest.cwiseAbs().maxCoeff() <= kClose) return Membership::kInside;
      const double reach = (generators.transpose() * rest).cwiseAbs().sum();
      if (rest.dot(target) > reach * (1 + 1e-12)) return Membership::kOutside;
    }
    for (Eigen::Index j = 0; j < b.size(); ++j) {
      if (squares[j] == 0) continue;
      const double better = std::clamp(b[j] + generators.col(j).dot(rest) / squares[j], -1.0, 1.0);
      rest -= (better - b[j]) * generators.col(j);
      b[j] = better;
    }
  }
  return Membership::kUndecided;
}

}  // namespace forereach::experiments
