#include "research/methods/alanwar.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/QR>

#include "forereach/numerics/size.h"
#include "forereach/sets/zonotope.h"
#include "research/methods/covering.h"
#include "research/methods/samples.h"

namespace forereach::research {
namespace {

// The slopes of the affine least-squares fit of y on the given columns of z; of least norm where there are several.
std::vector<double> FitSlopes(const Eigen::MatrixXd& z, const std::vector<int>& columns, const Eigen::VectorXd& y) {
  const auto count = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd regressors = Eigen::MatrixXd::Ones(z.rows(), count + 1);
  regressors.leftCols(count) = z(Eigen::all, columns);
  regressors.leftCols(count).rowwise() -= regressors.leftCols(count).colwise().mean().eval();
  const Eigen::VectorXd fit = regressors.completeOrthogonalDecomposition().solve(y);
  std::vector<double> slopes(ToSize(z.cols()), 0.0);
  for (std::size_t c = 0; c < columns.size(); ++c) slopes[ToSize(columns[c])] = fit[static_cast<Eigen::Index>(c)];
  return slopes;
}

}  // namespace

AlanwarEnclosure::AlanwarEnclosure(const Setting& setting) {
  const Observations observations = Observe(setting.model, setting.data);
  const Eigen::MatrixXd residuals = ObservedResiduals(observations);
  const Eigen::MatrixXd& lipschitz = setting.declaration.lipschitz;
  const std::vector<Interval> box = setting.domain.Ranges();

  for (int k = 0; k < observations.num_states(); ++k) {
    std::vector<int> columns;
    for (int l = 0; l < lipschitz.cols(); ++l)
      if (lipschitz(k, l) > 0) columns.push_back(l);
    Row row{FitSlopes(observations.z, columns, residuals.col(k)), {kInfinity, -kInfinity}, 0};
    const double sigma = setting.declaration.noise_bound[k];
    for (int i = 0; i < observations.size(); ++i) {
      Interval left = Interval(observations.lower(i, k), observations.upper(i, k)) + Interval(-sigma, sigma);
      for (const int l : columns) left = left - Interval(row.slopes[ToSize(l)]) * Interval(observations.z(i, l));
      row.leftover = {std::min(row.leftover.lower, left.lower), std::max(row.leftover.upper, left.upper)};
    }
    if (!columns.empty()) {
      Eigen::VectorXd weights = Eigen::VectorXd::Zero(lipschitz.cols());
      for (const int l : columns) weights[l] = AddUp(lipschitz(k, l), std::abs(row.slopes[ToSize(l)]));
      row.covering = CoveringRadiusUpper(box, observations.z, weights);
    }
    rows_.push_back(std::move(row));
  }
}

void AlanwarEnclosure::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  const auto n = ToSize(query.slice.dim());
  bounds.capped = false;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Row& row = rows_[k];
    std::array<double, kMaxStates> up, down;
    for (std::size_t l = 0; l < n; ++l) {
      up[l] = row.slopes[l];
      down[l] = -row.slopes[l];
    }
    Interval range = row.leftover + Interval(-row.covering, row.covering) +
                     Interval(-query.slice.SupportUpper({down.data(), n}), query.slice.SupportUpper({up.data(), n}));
    for (std::size_t j = 0; j < query.input.size(); ++j)
      range += Interval(row.slopes[n + j]) * Interval(query.input[j]);
    bounds.lower[k] = range.lower;
    bounds.upper[k] = range.upper;
  }
}

std::unique_ptr<ResidualEnclosure> MakeAlanwar(const Setting& setting) {
  return std::make_unique<AlanwarEnclosure>(setting);
}

}  // namespace forereach::research
