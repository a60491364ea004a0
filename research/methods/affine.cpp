#include "research/methods/affine.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include <ClpSimplex.hpp>
#include <CoinPackedMatrix.hpp>

#include "research/methods/samples.h"

namespace forereach::research {
namespace {

constexpr std::size_t kMostCorners = 10;  // 2^10 points of a query
// Clp's own feasibility tolerance; rows are in units of kUnit, so that it is small beside a noise bound.
constexpr double kTolerance = 1e-7, kUnit = 1e-3;

}  // namespace

// Variables: the slopes by the active coordinates, then the value at the middle of the data.
class AffineEnclosure::Row {
 public:
  Row(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
    const auto count = static_cast<int>(inputs.rows()), slopes = static_cast<int>(inputs.cols());
    Eigen::MatrixXd regressors(count, slopes + 1);
    regressors << inputs, Eigen::VectorXd::Ones(count);
    std::vector<int> rows(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) rows[static_cast<std::size_t>(i)] = i;
    CoinPackedMatrix matrix;
    matrix.setDimensions(count, 0);
    for (int j = 0; j <= slopes; ++j) matrix.appendCol(count, rows.data(), regressors.col(j).data());
    const std::vector<double> free_below(static_cast<std::size_t>(slopes) + 1, -COIN_DBL_MAX),
        free_above(free_below.size(), COIN_DBL_MAX), zero(free_below.size(), 0.0);
    const Eigen::VectorXd below = lower / kUnit, above = upper / kUnit;
    program_.setLogLevel(0);
    program_.loadProblem(matrix, free_below.data(), free_above.data(), zero.data(), below.data(), above.data());
    program_.primal();
    is_consistent_ = !program_.isProvenPrimalInfeasible();
  }

  [[nodiscard]] bool is_consistent() const { return is_consistent_; }

  /** sup of sign (M z + b), infinite where it is not found to be bounded. */
  [[nodiscard]] double Support(const Eigen::VectorXd& z, double sign) {
    for (Eigen::Index l = 0; l < z.size(); ++l) program_.setObjectiveCoefficient(static_cast<int>(l), -sign * z[l]);
    program_.setObjectiveCoefficient(static_cast<int>(z.size()), -sign);
    program_.primal();
    return program_.isProvenOptimal() ? kUnit * (-program_.objectiveValue() + kTolerance) : kInfinity;
  }

 private:
  ClpSimplex program_;
  bool is_consistent_ = false;
};

AffineEnclosure::AffineEnclosure(const Setting& setting) : active_(ActiveCoordinates(setting.declaration)) {
  if (active_.size() > kMostCorners)
    throw std::invalid_argument("affine: " + std::to_string(active_.size()) + " coordinates, must be at most " +
                                std::to_string(kMostCorners));
  const Observations observations = Observe(setting.model, setting.data);
  const Eigen::MatrixXd inputs = observations.z(Eigen::all, active_);
  for (int k = 0; k < observations.num_states(); ++k) {
    const double sigma = setting.declaration.noise_bound[k];
    rows_.push_back(std::make_unique<Row>(inputs, observations.lower.col(k).array() - sigma,
                                          observations.upper.col(k).array() + sigma));
  }
}

AffineEnclosure::~AffineEnclosure() = default;

bool AffineEnclosure::IsConsistent() const {
  return std::ranges::all_of(rows_, [](const auto& row) { return row->is_consistent(); });
}

void AffineEnclosure::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  const auto a = static_cast<Eigen::Index>(active_.size());
  Eigen::VectorXd corner(a);
  bounds.capped = false;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    bounds.lower[k] = kInfinity;
    bounds.upper[k] = -kInfinity;
    if (!rows_[k]->is_consistent()) continue;
    for (unsigned at = 0; at < 1U << a; ++at) {
      for (Eigen::Index l = 0; l < a; ++l) {
        const Interval hull = HullOf(query, active_[static_cast<std::size_t>(l)]);
        corner[l] = at >> l & 1 ? hull.upper : hull.lower;
      }
      bounds.upper[k] = std::max(bounds.upper[k], rows_[k]->Support(corner, 1));
      bounds.lower[k] = std::min(bounds.lower[k], -rows_[k]->Support(corner, -1));
    }
  }
}

std::unique_ptr<ResidualEnclosure> MakeAffine(const Setting& setting) {
  return std::make_unique<AffineEnclosure>(setting);
}

}  // namespace forereach::research
