#include "research/limits/width_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include <Eigen/SVD>

namespace forereach::research {
namespace {

constexpr double kRadiusShare = 0.9;
constexpr std::array kRegions{0.01, 0.02, 0.05, 0.1, 0.2, 0.4};

double SpectralNorm(const Eigen::MatrixXd& matrix) { return matrix.jacobiSvd().singularValues().maxCoeff(); }

std::span<const double> View(const Eigen::VectorXd& z) { return {z.data(), static_cast<std::size_t>(z.size())}; }

// D_x f0(z).
Eigen::MatrixXd NominalSlope(const NominalModel& model, const Eigen::VectorXd& z) {
  Linearization nominal;
  model.Linearize(View(z), nominal);
  Eigen::MatrixXd slope = Eigen::MatrixXd::Zero(model.num_states(), model.num_states());
  for (const MatrixEntry& entry : nominal.jacobian())
    if (entry.column < model.num_states()) slope(entry.row, entry.column) = entry.value.Middle();
  return slope;
}

// h_0: sup |D_x^2 f0| over states within `region` of z's, at most sqrt(sum_k |B_k|^2).
double NominalCurvature(const NominalModel& model, const Eigen::VectorXd& z, double region) {
  const int n = model.num_states();
  std::vector<Interval> box;
  for (int l = 0; l < z.size(); ++l)
    box.push_back(l < n ? Interval(SubDown(z[l], region), AddUp(z[l], region)) : Interval(z[l]));
  HessianEnclosure hessian;
  model.EncloseHessian(box, hessian);
  std::vector<Eigen::MatrixXd> sizes(static_cast<std::size_t>(n), Eigen::MatrixXd::Zero(n, n));
  for (int e = 0; e < hessian.count; ++e) {
    const HessianEnclosure::Entry& entry = hessian.entries[static_cast<std::size_t>(e)];
    if (entry.row >= n || entry.column >= n) continue;
    const double size = entry.second_derivative.Magnitude();
    if (!std::isfinite(size)) return kInfinity;
    Eigen::MatrixXd& matrix = sizes[static_cast<std::size_t>(entry.output)];
    matrix(entry.row, entry.column) = matrix(entry.column, entry.row) = size;
  }
  double squares = 0;
  for (const Eigen::MatrixXd& matrix : sizes) squares += std::pow(SpectralNorm(matrix), 2);
  return std::sqrt(squares);
}

// Everything of a baseline that does not depend on the pair.
struct Baseline {
  Eigen::MatrixXd queries;               // a column a step
  std::vector<Eigen::MatrixXd> nominal;  // D_x f0(z_s)
  std::vector<Eigen::MatrixXd> slopes;   // A_s
};

Baseline MakeBaseline(const Rollout& rollout) {
  Baseline baseline{rollout.Queries(), {}, {}};
  const Eigen::Index n = rollout.start.size();
  for (Eigen::Index s = 0; s < baseline.queries.cols(); ++s) {
    const Eigen::VectorXd z = baseline.queries.col(s);
    baseline.nominal.push_back(NominalSlope(rollout.model, z));
    baseline.slopes.push_back(baseline.nominal.back() + rollout.residual.jacobian(View(z)).leftCols(n));
  }
  return baseline;
}

// G_{T,s}, s >= 1: A_{T-1} ... A_s, the identity for s = T.
Eigen::MatrixXd Gain(const Baseline& baseline, int s) {
  Eigen::MatrixXd gain = Eigen::MatrixXd::Identity(baseline.slopes[0].rows(), baseline.slopes[0].rows());
  for (std::size_t i = static_cast<std::size_t>(s); i < baseline.slopes.size(); ++i) gain = baseline.slopes[i] * gain;
  return gain;
}

// C and a_pass with regions of one radius, then the rest of the bound.
void ApplyRegion(const WidthQuestion& question, const Baseline& baseline, double region, WidthBound& bound) {
  const auto steps = static_cast<int>(baseline.slopes.size());
  bound.region = region;
  bound.remainder = 0;
  bound.a_pass = kInfinity;
  double growth = 1;  // M_s
  for (int s = bound.tau + 1; s < steps; ++s) {
    const Eigen::VectorXd z = baseline.queries.col(s);
    const double clearance = (z - baseline.queries.col(bound.tau)).norm() - bound.bump_radius;  // d_s
    const double curvature = NominalCurvature(question.rollout.model, z, region);
    const double slope = SpectralNorm(baseline.nominal[static_cast<std::size_t>(s)]) + curvature * region;
    bound.a_pass = std::min(bound.a_pass, std::min(clearance, region) / growth / 2);
    bound.remainder += SpectralNorm(question.projection * Gain(baseline, s + 1)) *
                       (curvature + question.limits.curvature) * growth * growth / 2;
    growth *= slope + question.limits.slope;
  }
  bound.a_lin = bound.remainder > 0 ? bound.gain / (2 * bound.remainder) : kInfinity;
  bound.a_star = std::min({bound.a_class, bound.a_pass, bound.a_lin});
  bound.half_width = bound.a_star * bound.gain - bound.remainder * bound.a_star * bound.a_star;
}

WidthBound BoundWidth(const WidthQuestion& question, const Baseline& baseline, int tau, int k) {
  WidthBound bound{};
  bound.tau = tau;
  bound.k = k;
  const Eigen::VectorXd center = baseline.queries.col(tau);
  bound.data_gap = question.data.rows() == 0
                       ? kInfinity
                       : (question.data.rowwise() - center.transpose()).rowwise().norm().minCoeff();
  bound.query_gap = kInfinity;
  for (Eigen::Index s = 0; s < baseline.queries.cols(); ++s)
    if (s != tau) bound.query_gap = std::min(bound.query_gap, (baseline.queries.col(s) - center).norm());
  bound.gain = (question.projection * Gain(baseline, tau + 1).col(k)).norm();
  if (!bound.IsAdmissible()) return bound;

  // Without data and other queries any radius will do.
  bound.bump_radius = kRadiusShare * std::min({bound.data_gap, bound.query_gap / 2, 1e6});
  const SmoothBounds& used = question.rollout.residual.bounds;
  const double slack[] = {question.limits.value - used.value, question.limits.slope - used.slope,
                          question.limits.curvature - used.curvature};
  bound.a_class = kInfinity;
  for (int j = 0; j < 3; ++j) {
    if (!(slack[j] > 0))
      throw std::invalid_argument("smooth class: derivative " + std::to_string(j) + " leaves a slack of " +
                                  std::to_string(slack[j]) + ", must be positive");
    bound.a_class = std::min(bound.a_class, slack[j] * std::pow(bound.bump_radius, j) / Bump::kDerivatives[j]);
  }
  WidthBound best = bound;
  for (const double region : kRegions) {
    ApplyRegion(question, baseline, region, bound);
    if (region == kRegions.front() || bound.half_width > best.half_width) best = bound;
  }
  return best;
}

}  // namespace

WidthBound BoundWidth(const WidthQuestion& question, int tau, int k) {
  const int steps = question.rollout.plan.num_steps;
  const auto n = static_cast<int>(question.rollout.start.size());
  if (!(0 <= tau && tau < steps && 0 <= k && k < n))
    throw std::invalid_argument("width bound: tau " + std::to_string(tau) + " and k " + std::to_string(k) +
                                " must be in [0, " + std::to_string(steps) + ") and [0, " + std::to_string(n) + ")");
  return BoundWidth(question, MakeBaseline(question.rollout), tau, k);
}

std::vector<WidthBound> ScanWidthBounds(const WidthQuestion& question) {
  const Baseline baseline = MakeBaseline(question.rollout);
  std::vector<WidthBound> bounds;
  for (int tau = 0; tau <= question.rollout.plan.num_steps - 2; ++tau)
    for (int k = 0; k < question.rollout.start.size(); ++k)
      if (const WidthBound bound = BoundWidth(question, baseline, tau, k); bound.IsAdmissible())
        bounds.push_back(bound);
  return bounds;
}

}  // namespace forereach::research
