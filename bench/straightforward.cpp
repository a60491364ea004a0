#include "bench/straightforward.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace forereach::bench {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInf = std::numeric_limits<double>::infinity();
// Plain residuals are off by a few units in the last place of what was added up: without this much observation error,
// true declarations would be falsified where a row of L is zero.
constexpr double kRounding = 1e-12;

// The largest |sin| over [lower, upper].
double LargestSine(double lower, double upper) {
  const double peak = std::ceil(lower / M_PI - 0.5);  // the first pi/2 + peak pi that is not below `lower`
  if ((peak + 0.5) * M_PI <= upper) return 1;
  return std::max(std::abs(std::sin(lower)), std::abs(std::sin(upper)));
}

double LargestCosine(double lower, double upper) { return LargestSine(lower + M_PI / 2, upper + M_PI / 2); }

double LargestMagnitude(double lower, double upper) { return std::max(std::abs(lower), std::abs(upper)); }

MatrixXd WithoutZeroColumns(const MatrixXd& matrix) {
  std::vector<int> kept;
  for (int j = 0; j < matrix.cols(); ++j)
    if (!matrix.col(j).isZero(0)) kept.push_back(j);
  return matrix(Eigen::all, kept);
}

MatrixXd ConcatenateColumns(const MatrixXd& a, const MatrixXd& b, const MatrixXd& c) {
  MatrixXd all(a.rows(), a.cols() + b.cols() + c.cols());
  all << a, b, c;
  return all;
}

// Girard's order reduction.
MatrixXd Reduce(const MatrixXd& generators, int order) {
  const auto n = static_cast<int>(generators.rows()), m = static_cast<int>(generators.cols());
  if (m <= order * n) return generators;
  const VectorXd scores =
      (generators.cwiseAbs().colwise().sum() - generators.cwiseAbs().colwise().maxCoeff()).transpose();
  std::vector<int> columns(static_cast<std::size_t>(m));
  std::iota(columns.begin(), columns.end(), 0);
  std::stable_sort(columns.begin(), columns.end(), [&](int a, int b) { return scores[a] > scores[b]; });
  const std::vector<int> kept(columns.begin(), columns.begin() + (order - 1) * n);
  const std::vector<int> boxed(columns.begin() + (order - 1) * n, columns.end());
  const VectorXd box = generators(Eigen::all, boxed).cwiseAbs().rowwise().sum();
  return ConcatenateColumns(generators(Eigen::all, kept), WithoutZeroColumns(box.asDiagonal()), MatrixXd(n, 0));
}

// The corners of a planar zonotope in order: its generators sorted by angle, walked once up and once down.
std::vector<Eigen::Vector2d> Corners(const VectorXd& center, const MatrixXd& generators) {
  struct Side {
    double angle;
    Eigen::Vector2d half;
  };
  std::vector<Side> sides;
  for (int j = 0; j < generators.cols(); ++j) {
    const Eigen::Vector2d g = generators.col(j), up = g.y() < 0 || (g.y() == 0 && g.x() < 0) ? Eigen::Vector2d(-g) : g;
    sides.push_back({std::atan2(up.y(), up.x()), up});
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.angle < b.angle; });
  if (sides.empty()) return {center};
  Eigen::Vector2d corner = center;
  for (const Side& side : sides) corner -= side.half;
  std::vector<Eigen::Vector2d> corners;
  for (const double direction : {2.0, -2.0}) {
    for (const Side& side : sides) {
      corners.push_back(corner);
      corner += direction * side.half;
    }
  }
  return corners;
}

// Of a point to the convex polygon with these corners, counter-clockwise; 0 inside.
double Distance(const std::vector<Eigen::Vector2d>& corners, const Eigen::Vector2d& point) {
  double distance = kInf;
  bool inside = corners.size() > 2;
  for (std::size_t j = 0; j < corners.size(); ++j) {
    const Eigen::Vector2d from = corners[j], side = corners[(j + 1) % corners.size()] - from, to = point - from;
    const double along = side.squaredNorm() > 0 ? std::clamp(to.dot(side) / side.squaredNorm(), 0.0, 1.0) : 0;
    distance = std::min(distance, (to - along * side).norm());
    inside = inside && side.x() * to.y() - side.y() * to.x() > 0;
  }
  return inside ? 0 : distance;
}

}  // namespace

PlainModel PlainBicycle(double dt, double wheelbase) {
  enum { kX, kY, kTheta, kV, kA, kDelta, kJerk, kSteerRate };
  PlainModel model;
  model.value = [=](const VectorXd& z) {
    VectorXd next(6);
    next << z[kX] + dt * z[kV] * std::cos(z[kTheta]), z[kY] + dt * z[kV] * std::sin(z[kTheta]),
        z[kTheta] + dt / wheelbase * z[kV] * std::tan(z[kDelta]), z[kV] + dt * z[kA], z[kA] + dt * z[kJerk],
        z[kDelta] + dt * z[kSteerRate];
    return next;
  };
  model.jacobian = [=](const VectorXd& z) {
    MatrixXd jacobian = MatrixXd::Identity(6, 8);
    const double tangent = std::tan(z[kDelta]);
    jacobian(kX, kTheta) = -dt * z[kV] * std::sin(z[kTheta]);
    jacobian(kX, kV) = dt * std::cos(z[kTheta]);
    jacobian(kY, kTheta) = dt * z[kV] * std::cos(z[kTheta]);
    jacobian(kY, kV) = dt * std::sin(z[kTheta]);
    jacobian(kTheta, kV) = dt / wheelbase * tangent;
    jacobian(kTheta, kDelta) = dt / wheelbase * z[kV] * (1 + tangent * tangent);
    jacobian(kV, kA) = jacobian(kA, kJerk) = jacobian(kDelta, kSteerRate) = dt;
    return jacobian;
  };
  model.curvature = [=](const VectorXd& lower, const VectorXd& upper) {
    std::vector<MatrixXd> bounds(6, MatrixXd::Zero(8, 8));
    const auto set = [&](int k, int i, int j, double bound) {
      MatrixXd& matrix = bounds[static_cast<std::size_t>(k)];
      matrix(i, j) = matrix(j, i) = bound;
    };
    const double speed = LargestMagnitude(lower[kV], upper[kV]);
    const double sine = LargestSine(lower[kTheta], upper[kTheta]), cosine = LargestCosine(lower[kTheta], upper[kTheta]);
    set(kX, kTheta, kTheta, dt * speed * cosine);
    set(kX, kTheta, kV, dt * sine);
    set(kY, kTheta, kTheta, dt * speed * sine);
    set(kY, kTheta, kV, dt * cosine);
    const double steering = LargestMagnitude(lower[kDelta], upper[kDelta]);
    const double tangent = steering < M_PI / 2 ? std::tan(steering) : kInf;
    set(kTheta, kV, kDelta, dt / wheelbase * (1 + tangent * tangent));
    set(kTheta, kDelta, kDelta, dt / wheelbase * speed * 2 * tangent * (1 + tangent * tangent));
    return bounds;
  };
  return model;
}

PlainModel PlainPointMass(double dt) {
  MatrixXd jacobian = MatrixXd::Identity(4, 6);
  for (int axis = 0; axis < 2; ++axis) {
    jacobian(axis, axis + 2) = jacobian(axis + 2, axis + 4) = dt;
    jacobian(axis, axis + 4) = dt * dt / 2;
  }
  PlainModel model;
  model.value = [=](const VectorXd& z) -> VectorXd { return jacobian * z; };
  model.jacobian = [=](const VectorXd&) { return jacobian; };
  model.curvature = [](const VectorXd&, const VectorXd&) { return std::vector<MatrixXd>(4, MatrixXd::Zero(6, 6)); };
  return model;
}

Straightforward::Straightforward(std::shared_ptr<const Problem> problem, PlainModel model, Spelling spelling)
    : problem_(std::move(problem)), model_(std::move(model)), spelling_(spelling) {
  const Transitions& data = problem_->transitions;
  const MatrixXd& lipschitz = problem_->declaration.lipschitz;
  const auto count = static_cast<Eigen::Index>(data.size());
  residuals_.resize(lipschitz.rows(), count);
  errors_ = problem_->declaration.noise_bound.array() + kRounding;
  for (Eigen::Index i = 0; i < count; ++i) {
    residuals_.col(i) = data.x_next.row(i).transpose() - model_.value(data.z.row(i));
  }
  for (Eigen::Index k = 0; k < lipschitz.rows(); ++k) {
    Row row;
    for (int l = 0; l < lipschitz.cols(); ++l)
      if (lipschitz(k, l) != 0) row.columns.push_back(l);
    const auto active = static_cast<Eigen::Index>(row.columns.size());
    row.locations = data.z(Eigen::all, row.columns).transpose();
    row.signs.resize(Eigen::Index{1} << active, active);
    for (Eigen::Index s = 0; s < row.signs.rows(); ++s)
      for (Eigen::Index l = 0; l < active; ++l)
        row.signs(s, l) = (s >> l & 1 ? -1 : 1) * lipschitz(k, row.columns[static_cast<std::size_t>(l)]);
    rows_.push_back(std::move(row));
  }
}

std::optional<std::pair<int, int>> Straightforward::FindViolation() const {
  const MatrixXd &lipschitz = problem_->declaration.lipschitz, &z = problem_->transitions.z;
  for (int i = 0; i < problem_->transitions.size(); ++i) {
    for (int j = i + 1; j < problem_->transitions.size(); ++j) {
      const VectorXd allowed = lipschitz * (z.row(i) - z.row(j)).cwiseAbs().transpose() + 2 * errors_;
      if (((residuals_.col(i) - residuals_.col(j)).cwiseAbs().array() > allowed.array()).any()) return std::pair(i, j);
    }
  }
  return std::nullopt;
}

void Straightforward::Envelope(const PlainZonotope& query, VectorXd& lower, VectorXd& upper) const {
  lower = VectorXd::Constant(residuals_.rows(), -kInf);
  upper = VectorXd::Constant(residuals_.rows(), kInf);
  for (Eigen::Index k = 0; k < residuals_.rows(); ++k) {
    const Row& row = rows_[static_cast<std::size_t>(k)];
    if (row.columns.empty()) {
      lower[k] = residuals_.row(k).maxCoeff() - errors_[k];
      upper[k] = residuals_.row(k).minCoeff() + errors_[k];
      continue;
    }
    const VectorXd center = query.center(row.columns);
    const MatrixXd generators = query.generators(row.columns, Eigen::all);
    const VectorXd spread = (row.signs * generators).cwiseAbs().rowwise().sum();
    for (Eigen::Index i = 0; i < residuals_.cols(); ++i) {
      const VectorXd offset = center - row.locations.col(i);
      double distance = 0;
      if (spelling_ == Spelling::kMatrices) {
        distance = (row.signs * offset + spread).maxCoeff();
      } else {
        for (Eigen::Index s = 0; s < spread.size(); ++s)
          distance = std::max(distance, row.signs.row(s).dot(offset) + spread[s]);
      }
      lower[k] = std::max(lower[k], residuals_(k, i) - errors_[k] - distance);
      upper[k] = std::min(upper[k], residuals_(k, i) + errors_[k] + distance);
    }
  }
}

bool Straightforward::InDomain(const VectorXd& lower, const VectorXd& upper) const {
  const Domain& domain = problem_->domain;
  const Eigen::Index n = domain.state.dim(), m = domain.input.dim();
  if ((lower.head(n).array() < domain.state.lower().array()).any() ||
      (upper.head(n).array() > domain.state.upper().array()).any() ||
      (lower.tail(m).array() < domain.input.lower().array()).any() ||
      (upper.tail(m).array() > domain.input.upper().array()).any())
    return false;
  for (const Domain::Inequality& inequality : domain.inequalities) {
    const VectorXd& a = inequality.coefficients;
    if (a.cwiseMax(0).dot(upper) + a.cwiseMin(0).dot(lower) > inequality.bound) return false;
  }
  for (const Domain::Ball& ball : domain.balls) {
    const VectorXd far =
        (lower(ball.coordinates) - ball.center).cwiseAbs().cwiseMax((upper(ball.coordinates) - ball.center).cwiseAbs());
    if (far.norm() > ball.radius) return false;
  }
  return true;
}

std::optional<PlainZonotope> Straightforward::Step(const PlainZonotope& slice, const VectorXd& input) const {
  const Eigen::Index n = slice.center.size(), m = input.size();
  PlainZonotope query;
  query.center.resize(n + m);
  query.center << slice.center, input;
  query.generators = MatrixXd::Zero(n + m, slice.generators.cols());
  query.generators.topRows(n) = slice.generators;

  const VectorXd radius = query.HalfWidth(), lower = query.center - radius, upper = query.center + radius;
  if (!InDomain(lower, upper)) return std::nullopt;

  VectorXd remainder(n);
  const std::vector<MatrixXd> curvature = model_.curvature(lower, upper);
  for (Eigen::Index k = 0; k < n; ++k) remainder[k] = 0.5 * radius.dot(curvature[static_cast<std::size_t>(k)] * radius);
  if (!remainder.allFinite()) return std::nullopt;

  VectorXd from_below, from_above;
  Envelope(query, from_below, from_above);
  const VectorXd middle = (from_above + from_below) / 2;
  VectorXd half_width = (from_above - from_below) / 2;
  for (double& h : half_width)
    if (h < 10 * kRounding) h = 0;  // exactly, but for the rounding of residuals
  const MatrixXd generators = ConcatenateColumns(model_.jacobian(query.center) * query.generators,
                                                 remainder.asDiagonal(), half_width.asDiagonal());
  return PlainZonotope{model_.value(query.center) + middle,
                       Reduce(WithoutZeroColumns(generators), problem_->zonotope_order)};
}

Straightforward::Answer Straightforward::Certify(const MatrixXd& controls, const PlainZonotope& initial_set,
                                                 const std::vector<Obstacle>& obstacles) const {
  Answer answer{Outcome::kCertified, {initial_set}};
  for (Eigen::Index t = 0; t < controls.cols(); ++t) {
    std::optional<PlainZonotope> next = Step(answer.tube.back(), controls.col(t));
    if (!next) {
      answer.outcome = Outcome::kDomain;
      return answer;
    }
    answer.tube.push_back(std::move(*next));
  }
  for (const PlainZonotope& slice : answer.tube) {
    const auto corners =
        Corners(problem_->projection * slice.center, WithoutZeroColumns(problem_->projection * slice.generators));
    for (const Obstacle& obstacle : obstacles) {
      if (obstacle.kind() != Obstacle::Kind::kCircle) throw std::invalid_argument("obstacle: not a circle");
      if (Distance(corners, obstacle.points().front()) <= obstacle.radius()) answer.outcome = Outcome::kSafety;
    }
  }
  return answer;
}

}  // namespace forereach::bench
