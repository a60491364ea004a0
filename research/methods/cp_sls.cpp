#include "research/methods/cp_sls.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include <Eigen/Cholesky>

#include "forereach/sets/zonotope.h"
#include "research/methods/samples.h"

namespace forereach::research {
namespace {

constexpr double kRidge = 1e-6;

// Half the distance of the histograms of two samples, over bins that hold equal shares of both together.
double TotalVariation(std::vector<double> a, std::vector<double> b) {
  std::vector<double> both = a;
  both.insert(both.end(), b.begin(), b.end());
  std::ranges::sort(a);
  std::ranges::sort(b);
  std::ranges::sort(both);
  const auto bins = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(both.size()) / 2)));
  const auto below = [](const std::vector<double>& sample, double edge) {
    return static_cast<double>(std::ranges::upper_bound(sample, edge) - sample.begin()) /
           static_cast<double>(sample.size());
  };
  double sum = 0, last_a = 0, last_b = 0;
  for (std::size_t bin = 1; bin <= bins; ++bin) {
    const double edge = both[(both.size() * bin - 1) / bins];
    const double share_a = below(a, edge), share_b = below(b, edge);
    sum += std::abs((share_a - last_a) - (share_b - last_b));
    last_a = share_a;
    last_b = share_b;
  }
  return sum / 2;
}

Method MethodOf(const std::string& name, const CpSlsOptions& options) {
  return {name, [options](const Setting& setting) { return std::make_unique<CpSls>(setting, options); }};
}

}  // namespace

CpSls::CpSls(const Setting& setting, const CpSlsOptions& options) : options_(options) {
  if (!(0 < options.miscoverage && options.miscoverage < 1) || options.horizon < 1)
    throw std::invalid_argument("CP-SLS-MPC: miscoverage " + std::to_string(options.miscoverage) + " and horizon " +
                                std::to_string(options.horizon) + " must be in (0, 1) and at least 1");
  const Observations observations = Observe(setting.model, setting.data);
  residuals_ = ObservedResiduals(observations);
  recording_ = RecordingError(observations);
  const std::vector<Interval> ranges = setting.domain.Ranges();
  if (options.active_only) measured_ = ActiveCoordinates(setting.declaration);
  if (!options.active_only || measured_.empty()) {
    measured_.resize(ranges.size());
    std::iota(measured_.begin(), measured_.end(), 0);
  }
  reach_.resize(static_cast<Eigen::Index>(measured_.size()));
  for (Eigen::Index a = 0; a < reach_.size(); ++a) {
    const Interval& range = ranges[static_cast<std::size_t>(measured_[static_cast<std::size_t>(a)])];
    reach_[a] = range.upper > range.lower ? (range.upper - range.lower) / 2 : 1;
  }
  locations_ = observations.z(Eigen::all, measured_) * reach_.cwiseInverse().asDiagonal();
  scores_.resize(residuals_.rows());
  for (Eigen::Index i = 0; i < scores_.size(); ++i) {
    const Eigen::VectorXd residual = residuals_.row(i);
    const Eigen::LLT<Eigen::MatrixXd> factor(CovarianceAt(Weights(locations_.row(i).transpose())));
    scores_[i] = factor.matrixL().solve(residual).norm();
  }
  drift_rate_ = EstimateDriftRate();
}

Eigen::VectorXd CpSls::Weights(const Eigen::VectorXd& scaled) const {
  const Eigen::VectorXd squares = (locations_.rowwise() - scaled.transpose()).rowwise().squaredNorm();
  return (-squares.array() / (2.0 * static_cast<double>(scaled.size()))).exp();
}

Eigen::MatrixXd CpSls::CovarianceAt(const Eigen::VectorXd& weights) const {
  const bool local = options_.covariance == Covariance::kLocal || options_.covariance == Covariance::kLocalDiagonal;
  const bool full = options_.covariance == Covariance::kLocal || options_.covariance == Covariance::kGlobal;
  const Eigen::VectorXd share =
      local ? Eigen::VectorXd(weights / weights.sum())
            : Eigen::VectorXd::Constant(residuals_.rows(), 1 / static_cast<double>(residuals_.rows()));
  Eigen::MatrixXd covariance = residuals_.transpose() * share.asDiagonal() * residuals_;
  if (!full) covariance = Eigen::MatrixXd(covariance.diagonal().asDiagonal());
  const double mean_variance = covariance.trace() / static_cast<double>(covariance.rows());
  // If all residuals are zero, the smallest normal number is used.
  covariance.diagonal().array() += kRidge * mean_variance + std::numeric_limits<double>::min();
  return covariance;
}

double CpSls::EstimateDriftRate() const {
  double rate = 0;
  const Eigen::Index count = locations_.rows(), half = count / 2;
  if (half == 0) return rate;
  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  for (Eigen::Index l = 0; l < locations_.cols(); ++l) {
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    std::ranges::stable_sort(order, {}, [&](Eigen::Index i) { return locations_(i, l); });
    const std::vector<Eigen::Index> low(order.begin(), order.begin() + half), high(order.begin() + half, order.end());
    const double distance =
        (locations_(low, Eigen::all).colwise().mean() - locations_(high, Eigen::all).colwise().mean()).norm();
    const Eigen::VectorXd below = scores_(low), above = scores_(high);
    if (!(distance > 0)) continue;
    const double ratio = TotalVariation({below.begin(), below.end()}, {above.begin(), above.end()}) / distance;
    if (!options_.least_rate || rate == 0)
      rate = std::max(rate, ratio);
    else if (ratio > 0)
      rate = std::min(rate, ratio);
  }
  return rate;
}

double CpSls::Mass(const Eigen::VectorXd& z) const { return Weights(Scaled(z)).sum(); }

double CpSls::Radius(const Eigen::VectorXd& z) const {
  const Eigen::VectorXd weights = Weights(Scaled(z));
  const double mass = weights.sum();
  if (mass < StarvationFloor(options_.miscoverage, options_.horizon)) return std::numeric_limits<double>::infinity();
  const double wanted = (1 - options_.miscoverage / options_.horizon) * (1 + mass);
  std::vector<Eigen::Index> order(static_cast<std::size_t>(scores_.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::ranges::sort(order, {}, [&](Eigen::Index i) { return scores_[i]; });
  double reached = 0;
  for (const Eigen::Index i : order) {
    reached += weights[i];
    if (reached >= wanted) return scores_[i];
  }
  return scores_[order.back()];  // at the floor itself, where the sum falls short by its rounding
}

void CpSls::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  const Eigen::VectorXd z = CenterOf(query);
  const double radius = Radius(z);
  const Eigen::MatrixXd covariance = CovarianceAt(Weights(Scaled(z)));
  for (Eigen::Index k = 0; k < covariance.rows(); ++k) {
    const double half_width = radius * std::sqrt(covariance(k, k)) + recording_[k];
    bounds.lower[static_cast<std::size_t>(k)] = -half_width;
    bounds.upper[static_cast<std::size_t>(k)] = half_width;
  }
  bounds.capped = false;
}

CpSlsBudget CpSls::Budget(const QuerySet& query) const {
  const Eigen::VectorXd scaled = Scaled(CenterOf(query)), weights = Weights(scaled);
  const double mass = weights.sum();
  CpSlsBudget budget;
  budget.mass = mass;
  budget.alpha = options_.miscoverage / options_.horizon;
  budget.starved = mass < StarvationFloor(options_.miscoverage, options_.horizon);
  const Eigen::VectorXd distances = (locations_.rowwise() - scaled.transpose()).rowwise().norm();
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    const double variation = drift_rate_ * distances[i];
    budget.drift += 2 * weights[i] / (1 + mass) * std::min(1.0, variation);
    if (variation >= 1) budget.at_cap += weights[i] / mass;
  }
  double longest = 0;
  for (std::size_t a = 0; a < measured_.size(); ++a) {
    const int l = measured_[a];
    if (l < query.slice.dim())
      longest =
          std::max(longest, 2 * query.half_width[static_cast<std::size_t>(l)] / reach_[static_cast<Eigen::Index>(a)]);
  }
  budget.tube = 2 * drift_rate_ * longest;
  return budget;
}

std::span<const Method> CpSlsMethods() {
  static const std::array methods{MethodOf("CP-SLS-MPC equations", {}),
                                  MethodOf("CP-SLS-MPC, local diagonal", {.covariance = Covariance::kLocalDiagonal}),
                                  MethodOf("CP-SLS-MPC, global", {.covariance = Covariance::kGlobal}),
                                  MethodOf("CP-SLS-MPC, global diagonal", {.covariance = Covariance::kGlobalDiagonal})};
  return methods;
}

std::span<const Method> CpSlsVariants() {
  static const std::array methods{MethodOf("CP-SLS-MPC, least rate", {.least_rate = true}),
                                  MethodOf("CP-SLS-MPC, active coordinates", {.active_only = true})};
  return methods;
}

}  // namespace forereach::research
