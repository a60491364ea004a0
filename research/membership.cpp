#include "research/membership.h"

#include <algorithm>
#include <vector>

#include <ClpSimplex.hpp>
#include <Eigen/QR>

namespace forereach::research {
namespace {

constexpr int kRounds = 200, kRoundsBetweenTests = 5;
constexpr double kClose = 1e-9;

bool IsNothing(const Eigen::VectorXd& rest) { return rest.size() == 0 || rest.cwiseAbs().maxCoeff() <= kClose; }

bool Separates(const Eigen::VectorXd& direction, const Eigen::MatrixXd& generators, const Eigen::VectorXd& target) {
  return direction.dot(target) > (generators.transpose() * direction).cwiseAbs().sum() * (1 + 1e-12);
}

// Maximises s over G b = s target, |b|_inf <= 1: the target is inside if s reaches one, and else the rows' prices
// separate.
Membership LocateByProgram(const Eigen::MatrixXd& generators, const Eigen::VectorXd& target) {
  const auto rows = static_cast<int>(target.size()), columns = static_cast<int>(generators.cols());
  std::vector<int> all(static_cast<std::size_t>(rows));
  for (int k = 0; k < rows; ++k) all[static_cast<std::size_t>(k)] = k;
  CoinPackedMatrix matrix;
  matrix.setDimensions(rows, 0);
  for (int j = 0; j < columns; ++j) matrix.appendCol(rows, all.data(), generators.col(j).data());
  const Eigen::VectorXd opposite = -target;
  matrix.appendCol(rows, all.data(), opposite.data());
  const auto last = static_cast<std::size_t>(columns);
  std::vector<double> below(last + 1, -1), above(last + 1, 1), cost(last + 1, 0);
  below[last] = 0, above[last] = 2, cost[last] = -1;
  const std::vector<double> zero(static_cast<std::size_t>(rows), 0);
  ClpSimplex program;
  program.setLogLevel(0);
  program.scaling(
      0);  // The rows are in units of the hull, and a slack's column of 1e-13 spoils what Clp makes of them.
  program.setPrimalTolerance(kClose / 10);
  program.loadProblem(matrix, below.data(), above.data(), cost.data(), zero.data(), zero.data());
  program.primal();
  const Eigen::Map<const Eigen::VectorXd> found(program.getColSolution(), columns), prices(program.getRowPrice(), rows);
  const Eigen::VectorXd b = (found / std::max(program.getColSolution()[columns], 1.0)).cwiseMax(-1).cwiseMin(1);
  if (IsNothing(target - generators * b)) return Membership::kInside;
  for (const double sign : {1.0, -1.0})
    if (Separates(sign * prices, generators, target)) return Membership::kOutside;
  return Membership::kUndecided;
}

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
      if (IsNothing(rest)) return Membership::kInside;
      if (Separates(rest, generators, target)) return Membership::kOutside;
    }
    for (Eigen::Index j = 0; j < b.size(); ++j) {
      if (squares[j] == 0) continue;
      const double better = std::clamp(b[j] + generators.col(j).dot(rest) / squares[j], -1.0, 1.0);
      rest -= (better - b[j]) * generators.col(j);
      b[j] = better;
    }
  }
  return LocateByProgram(generators, target);
}

}  // namespace forereach::research
