#include "planner_bridge/residual_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/QR>

#include "forereach/numerics/limits.h"

namespace forereach {
namespace {

constexpr int kNearest = 4;
constexpr double kTurn = 2 * std::numbers::pi;

struct Neighbour {
  double distance = std::numeric_limits<double>::infinity();
  double residual = 0;
};

// Keeps the nearest ones in order.
void Insert(Neighbour candidate, std::array<Neighbour, kNearest>& nearest) {
  for (Neighbour& entry : nearest)
    if (candidate.distance < entry.distance) std::swap(candidate, entry);
}

double WeightedMean(const std::array<Neighbour, kNearest>& nearest) {
  if (nearest[0].distance == 0) return nearest[0].residual;
  double sum = 0, weights = 0;
  for (const Neighbour& entry : nearest) {
    const double weight = 1 / (entry.distance * entry.distance);  // 0 for an entry that was never filled
    sum += weight * entry.residual;
    weights += weight;
  }
  return weights > 0 ? sum / weights : nearest[0].residual;
}

}  // namespace

ResidualEstimate::ResidualEstimate(std::shared_ptr<const Problem> problem)
    : problem_(std::move(problem)), residuals_(problem_->transitions.x_next) {
  const Transitions& data = problem_->transitions;
  std::array<double, kMaxVariables> z{};
  std::array<double, kMaxStates> nominal{};
  const auto n = static_cast<std::size_t>(residuals_.cols());
  for (int i = 0; i < data.size(); ++i) {
    for (int l = 0; l < data.z.cols(); ++l) z[static_cast<std::size_t>(l)] = data.z(i, l);
    problem_->model->Evaluate({z.data(), static_cast<std::size_t>(data.z.cols())}, {nominal.data(), n});
    residuals_.row(i) -= Eigen::Map<const Eigen::RowVectorXd>(nominal.data(), residuals_.cols());
    for (const int k : problem_->model->angles()) residuals_(i, k) = std::remainder(residuals_(i, k), kTurn);
  }
  const auto& [rows, columns, rest] = problem_->declaration.affine;
  if (rows.empty() || data.size() == 0) return;
  Eigen::MatrixXd regressors(data.size(), std::ssize(columns) + 1);
  regressors << data.z(Eigen::all, columns), Eigen::VectorXd::Ones(data.size());
  fits_ = regressors.completeOrthogonalDecomposition().solve(residuals_(Eigen::all, rows));
}

void ResidualEstimate::Predict(std::span<const double> z, std::span<double> next) const {
  problem_->model->Evaluate(z, next);
  for (int k = 0; k < residuals_.cols(); ++k) next[static_cast<std::size_t>(k)] += Estimate(k, z);
}

double ResidualEstimate::Estimate(int k, std::span<const double> z) const {
  const auto& [rows, columns, rest] = problem_->declaration.affine;
  if (const auto row = std::ranges::find(rows, k); row != rows.end() && fits_.cols() > 0) {
    const auto fit = fits_.col(row - rows.begin());
    double sum = fit[fit.size() - 1];
    for (std::size_t j = 0; j < columns.size(); ++j)
      sum += fit[static_cast<Eigen::Index>(j)] * z[static_cast<std::size_t>(columns[j])];
    return sum;
  }
  const auto slopes = problem_->declaration.lipschitz.row(k);
  // Declared to be the same everywhere.
  if ((slopes.array() == 0).all()) return residuals_.col(k).mean();
  const Eigen::MatrixXd& points = problem_->transitions.z;
  std::array<Neighbour, kNearest> nearest;
  for (int i = 0; i < points.rows(); ++i) {
    double distance = 0;
    for (int l = 0; l < points.cols(); ++l)
      // By what the residual may change over that way: the declaration's own distance.
      if (slopes(l) != 0) distance += slopes(l) * std::abs(z[static_cast<std::size_t>(l)] - points(i, l));
    Insert({distance, residuals_(i, k)}, nearest);
  }
  return WeightedMean(nearest);
}

}  // namespace forereach
