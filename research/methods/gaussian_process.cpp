#include "research/methods/gaussian_process.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <map>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <string>

#include "research/methods/samples.h"

namespace forereach::research {
namespace {

constexpr std::size_t kMostCorners = 10;  // 2^10 points of a query

double ScaleOf(const Eigen::VectorXd& sample) {
  const double deviation = std::sqrt((sample.array() - sample.mean()).square().mean());
  return deviation > 0 ? deviation : 1;
}

GaussianProcess::Hyperparameters FromLogarithms(const Eigen::VectorXd& logarithms) {
  const Eigen::Index a = logarithms.size() - 2;
  return {logarithms.head(a).array().exp(), std::exp(logarithms[a]), std::exp(logarithms[a + 1])};
}

}  // namespace

GaussianProcess::GaussianProcess(Eigen::MatrixXd inputs, Eigen::VectorXd outputs, Hyperparameters hyperparameters)
    : scaled_(inputs * hyperparameters.length_scales.cwiseInverse().asDiagonal()),
      outputs_(std::move(outputs)),
      hyperparameters_(std::move(hyperparameters)),
      kernel_(inputs.rows(), inputs.rows()) {
  for (Eigen::Index j = 0; j < scaled_.rows(); ++j) kernel_.col(j) = Kernel(scaled_.row(j));
  Eigen::MatrixXd noisy = kernel_;
  noisy.diagonal().array() += hyperparameters_.noise * hyperparameters_.noise;
  factor_.compute(noisy);
  weights_ = factor_.solve(outputs_);
}

Eigen::VectorXd GaussianProcess::Kernel(const Eigen::VectorXd& scaled) const {
  Eigen::ArrayXd squares = Eigen::ArrayXd::Zero(scaled_.rows());
  for (Eigen::Index l = 0; l < scaled.size(); ++l) squares += (scaled_.col(l).array() - scaled[l]).square();
  return hyperparameters_.signal * hyperparameters_.signal * (-squares / 2).exp();
}

std::vector<GaussianProcess::Prediction> GaussianProcess::Predict(const Eigen::MatrixXd& points) const {
  Eigen::MatrixXd covariances(scaled_.rows(), points.cols());
  for (Eigen::Index p = 0; p < points.cols(); ++p)
    covariances.col(p) = Kernel(points.col(p).cwiseQuotient(hyperparameters_.length_scales));
  const Eigen::VectorXd means = covariances.transpose() * weights_;
  const double prior = hyperparameters_.signal * hyperparameters_.signal;
  factor_.matrixL().solveInPlace(covariances);
  std::vector<Prediction> predictions;
  for (Eigen::Index p = 0; p < points.cols(); ++p)
    predictions.push_back({means[p], std::sqrt(std::max(0.0, prior - covariances.col(p).squaredNorm()))});
  return predictions;
}

double GaussianProcess::LogMarginalLikelihood() const {
  if (factor_.info() != Eigen::Success) return -kInfinity;
  const double log_root_determinant = factor_.matrixLLT().diagonal().array().log().sum();
  const double count = static_cast<double>(outputs_.size());
  return -outputs_.dot(weights_) / 2 - log_root_determinant - count / 2 * std::log(2 * std::numbers::pi);
}

Eigen::VectorXd GaussianProcess::LikelihoodGradient() const {
  const Eigen::Index count = scaled_.rows(), a = scaled_.cols();
  const Eigen::MatrixXd difference =
      weights_ * weights_.transpose() - factor_.solve(Eigen::MatrixXd::Identity(count, count));
  const Eigen::MatrixXd weighted = difference.cwiseProduct(kernel_);
  Eigen::VectorXd gradient(a + 2);
  for (Eigen::Index l = 0; l < a; ++l) {
    const Eigen::VectorXd z = scaled_.col(l);
    // sum_ij W_ij (z_i - z_j)^2, W symmetric
    gradient[l] = weighted.rowwise().sum().dot(z.cwiseAbs2()) - z.dot(weighted * z);
  }
  gradient[a] = weighted.sum();
  gradient[a + 1] = hyperparameters_.noise * hyperparameters_.noise * difference.trace();
  return gradient;
}

namespace {

// Rprop's own constants; the logarithms stay within +-5, the noise above 1e-3.
GaussianProcess::Hyperparameters FindHyperparameters(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& outputs) {
  constexpr int kSteps = 100;
  constexpr double kFirst = 0.1, kSmallest = 1e-6, kLargest = 1, kGrow = 1.2, kShrink = 0.5, kReach = 5;
  const Eigen::Index a = inputs.cols();
  Eigen::VectorXd at = Eigen::VectorXd::Zero(a + 2), step = Eigen::VectorXd::Constant(a + 2, kFirst);
  at[a + 1] = std::log(0.1);
  Eigen::VectorXd before = Eigen::VectorXd::Zero(a + 2), best = at;
  double best_likelihood = -kInfinity;
  for (int s = 0; s < kSteps; ++s) {
    const GaussianProcess process(inputs, outputs, FromLogarithms(at));
    if (const double likelihood = process.LogMarginalLikelihood(); likelihood > best_likelihood) {
      best_likelihood = likelihood;
      best = at;
    }
    Eigen::VectorXd gradient = process.LikelihoodGradient();
    for (Eigen::Index i = 0; i < at.size(); ++i) {
      const double turn = gradient[i] * before[i];
      if (turn > 0) step[i] = std::min(step[i] * kGrow, kLargest);
      if (turn < 0) {
        step[i] = std::max(step[i] * kShrink, kSmallest);
        gradient[i] = 0;
      }
      const double sign = gradient[i] > 0 ? 1 : gradient[i] < 0 ? -1 : 0;
      at[i] = std::clamp(at[i] + sign * step[i], i == a + 1 ? std::log(1e-3) : -kReach, kReach);
    }
    before = gradient;
  }
  return FromLogarithms(best);
}

}  // namespace

GaussianProcess FitGaussianProcess(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& outputs) {
  using Found = std::shared_future<GaussianProcess::Hyperparameters>;
  static std::mutex mutex;
  static std::map<std::vector<double>, Found> known;
  std::vector<double> key(inputs.data(), inputs.data() + inputs.size());
  key.insert(key.end(), outputs.begin(), outputs.end());
  std::promise<GaussianProcess::Hyperparameters> promise;
  std::unique_lock lock(mutex);
  const auto [entry, is_new] = known.try_emplace(std::move(key));
  if (is_new) entry->second = promise.get_future().share();
  const Found found = entry->second;
  lock.unlock();
  if (is_new) promise.set_value(FindHyperparameters(inputs, outputs));
  return {inputs, outputs, found.get()};
}

GaussianProcessBand::GaussianProcessBand(const Setting& setting, double deviations, bool corners)
    : deviations_(deviations), corners_(corners), active_(ActiveCoordinates(setting.declaration)) {
  if (active_.size() > kMostCorners)
    throw std::invalid_argument("Gaussian process: " + std::to_string(active_.size()) +
                                " coordinates, must be at most " + std::to_string(kMostCorners));
  const Observations observations = Observe(setting.model, setting.data);
  const Eigen::MatrixXd residuals = ObservedResiduals(observations);
  const Eigen::VectorXd recording = RecordingError(observations);
  Eigen::MatrixXd inputs = observations.z(Eigen::all, active_);
  input_mean_ = inputs.colwise().mean().transpose();
  input_scale_.resize(inputs.cols());
  for (Eigen::Index l = 0; l < inputs.cols(); ++l) {
    input_scale_[l] = ScaleOf(inputs.col(l));
    inputs.col(l) = (inputs.col(l).array() - input_mean_[l]) / input_scale_[l];
  }
  for (Eigen::Index k = 0; k < residuals.cols(); ++k) {
    if (!(setting.declaration.lipschitz.row(k).maxCoeff() > 0)) {
      rows_.push_back({observations.lower.col(k).minCoeff(), observations.upper.col(k).maxCoeff(), 0, 0});
      continue;
    }
    Row& row = rows_.emplace_back(Row{-recording[k], recording[k], residuals.col(k).mean(), ScaleOf(residuals.col(k))});
    const Eigen::VectorXd outputs = (residuals.col(k).array() - row.mean) / row.scale;
    row.process = std::make_unique<const GaussianProcess>(FitGaussianProcess(inputs, outputs));
  }
}

void GaussianProcessBand::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  const auto a = static_cast<Eigen::Index>(active_.size());
  const unsigned corners = corners_ ? 1U << a : 0;
  Eigen::MatrixXd points(a, corners + 1);  // the center last
  for (Eigen::Index l = 0; l < a; ++l) {
    const Interval hull = HullOf(query, active_[static_cast<std::size_t>(l)]);
    for (unsigned corner = 0; corner < corners; ++corner) points(l, corner) = corner >> l & 1 ? hull.upper : hull.lower;
    points(l, corners) = (hull.lower + hull.upper) / 2;
    points.row(l) = (points.row(l).array() - input_mean_[l]) / input_scale_[l];
  }
  bounds.capped = false;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Row& row = rows_[k];
    bounds.lower[k] = row.lower;
    bounds.upper[k] = row.upper;
    if (!row.process) continue;
    double lowest = kInfinity, highest = -kInfinity;
    for (const auto& [mean, deviation] : row.process->Predict(points)) {
      lowest = std::min(lowest, mean - deviations_ * deviation);
      highest = std::max(highest, mean + deviations_ * deviation);
    }
    bounds.lower[k] += row.mean + row.scale * lowest;
    bounds.upper[k] += row.mean + row.scale * highest;
  }
}

std::unique_ptr<ResidualEnclosure> MakeGaussianProcess2(const Setting& setting) {
  return std::make_unique<GaussianProcessBand>(setting, 2, true);
}

std::unique_ptr<ResidualEnclosure> MakeGaussianProcess3(const Setting& setting) {
  return std::make_unique<GaussianProcessBand>(setting, 3, true);
}

}  // namespace forereach::research
