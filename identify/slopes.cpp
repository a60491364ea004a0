#include "identify/slopes.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace forereach {
namespace {

constexpr double kReliability = 1.5;
constexpr int kBatches = 50, kPairs = 100;

class PairSlopes {
 public:
  PairSlopes(const Declaration& declaration, const Observations& observations, int k)
      : weights_(declaration.lipschitz.row(k)),
        z_(observations.z),
        residual_((observations.lower.col(k) + observations.upper.col(k)) / 2) {}

  [[nodiscard]] int size() const { return static_cast<int>(residual_.size()); }

  /** (|r~_i - r~_j| - noise) / d(z_i, z_j), at least 0. */
  [[nodiscard]] double operator()(int i, int j, double noise) const {
    const double distance = (z_.row(i) - z_.row(j)).cwiseAbs().dot(weights_);
    return distance > 0 ? std::max(0.0, std::abs(residual_[i] - residual_[j]) - noise) / distance : 0;
  }

  [[nodiscard]] double Largest(double noise) const {
    double largest = 0;
    for (int i = 0; i < size(); ++i)
      for (int j = 0; j < i; ++j) largest = std::max(largest, (*this)(i, j, noise));
    return largest;
  }

 private:
  Eigen::RowVectorXd weights_;
  Eigen::MatrixXd z_;
  Eigen::VectorXd residual_;
};

double KnuthChou(const PairSlopes& slopes, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto any = [&] { return static_cast<int>(random() % static_cast<std::uint64_t>(slopes.size())); };
  std::vector<double> maxima(kBatches, 0.0);
  for (double& largest : maxima)
    for (int p = 0; p < kPairs; ++p) {
      const int i = any(), j = any();
      largest = std::max(largest, slopes(i, j, 0));
    }
  return ExtremeValueEnd(std::move(maxima));
}

}  // namespace

// Hosking's estimates: c = (2 b1 - b0) / (3 b2 - b0) - log 2 / log 3, shape = 7.8590 c + 2.9554 c^2,
// scale = (2 b1 - b0) shape / (Gamma(1 + shape) (1 - 2^-shape)), location = b0 + scale (Gamma(1 + shape) - 1) / shape.
// A positive shape has the right end location + scale / shape.
double ExtremeValueEnd(std::vector<double> maxima) {
  std::ranges::sort(maxima);
  const double n = static_cast<double>(maxima.size()), largest = maxima.back();
  double b0 = 0, b1 = 0, b2 = 0;
  for (std::size_t i = 0; i < maxima.size(); ++i) {
    const double j = static_cast<double>(i);
    b0 += maxima[i] / n;
    b1 += maxima[i] / n * j / (n - 1);
    b2 += maxima[i] / n * j * (j - 1) / ((n - 1) * (n - 2));
  }
  // Equal maxima have no spread to extrapolate.
  if (!(largest > maxima.front())) return largest;
  const double c = (2 * b1 - b0) / (3 * b2 - b0) - std::log(2.0) / std::log(3.0);
  const double shape = 7.8590 * c + 2.9554 * c * c;
  if (shape > 0) {
    const double gamma = std::tgamma(1 + shape);
    const double scale = (2 * b1 - b0) * shape / (gamma * (1 - std::exp2(-shape)));
    return std::max(largest, b0 + scale * (gamma - 1) / shape + scale / shape);
  }
  double squares = 0;
  for (const double x : maxima) squares += (x - b0) * (x - b0);
  return largest + 3 * std::sqrt(squares / (n - 1));
}

std::vector<double> EstimateSlopes(SlopeEstimator estimator, const Declaration& declaration,
                                   const Observations& observations, std::uint64_t seed) {
  std::vector<double> factors;
  for (int k = 0; k < observations.num_states(); ++k) {
    factors.push_back(0);
    if (!(declaration.lipschitz.row(k).maxCoeff() > 0)) continue;
    const PairSlopes slopes(declaration, observations, k);
    switch (estimator) {
      case SlopeEstimator::kLacki: factors.back() = slopes.Largest(2 * declaration.noise_bound[k]); break;
      case SlopeEstimator::kStrongin: factors.back() = kReliability * slopes.Largest(0); break;
      case SlopeEstimator::kKnuthChou: factors.back() = KnuthChou(slopes, seed + static_cast<std::uint64_t>(k)); break;
    }
  }
  return factors;
}

Declaration EstimatedDeclaration(SlopeEstimator estimator, const Declaration& declaration,
                                 const Observations& observations, std::uint64_t seed) {
  Declaration estimated = declaration;
  const std::vector<double> factors = EstimateSlopes(estimator, declaration, observations, seed);
  for (std::size_t k = 0; k < factors.size(); ++k) estimated.lipschitz.row(static_cast<Eigen::Index>(k)) *= factors[k];
  return estimated;
}

}  // namespace forereach
