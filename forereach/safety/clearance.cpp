#include "forereach/safety/clearance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "forereach/numerics/size.h"
#include "forereach/safety/occupancy_grid.h"

namespace forereach {
namespace {

using Vector = Eigen::Vector3d;  // unused coordinates are zero

// At most 4 points, affinely independent but for rounding.
struct Simplex {
  std::array<Vector, 4> points{};
  int count = 0;
};

// The face of a simplex that `members`, a set of bits, selects, and the point of its plane next to the origin. False if
// that point is not in the face, or the face is flat: then a smaller face has the nearest point.
bool NearestInside(const Simplex& simplex, int members, Simplex& face, Vector& nearest) {
  face.count = 0;
  for (int i = 0; i < simplex.count; ++i)
    if (members >> i & 1) face.points[ToSize(face.count++)] = simplex.points[ToSize(i)];
  const Vector& base = face.points[0];
  Eigen::Matrix3d edges = Eigen::Matrix3d::Zero(), gram = Eigen::Matrix3d::Identity();
  for (int i = 1; i < face.count; ++i) edges.col(i - 1) = face.points[ToSize(i)] - base;
  const int count = face.count - 1;
  gram.topLeftCorner(count, count) = (edges.transpose() * edges).topLeftCorner(count, count);
  // NaN is flat, too.
  if (!(gram.determinant() > 1e-14 * gram.diagonal().prod())) return false;
  const Vector weights = gram.inverse() * -(edges.transpose() * base);  // of the edges; 0 of those that are not there
  nearest = base + edges * weights;
  return weights.minCoeff() >= 0 && weights.sum() <= 1;
}

// Reduces a simplex, whose last point is new, to the face that has its point next to the origin.
Vector Reduce(Simplex& simplex) {
  Vector best = simplex.points[0];
  Simplex best_face{{simplex.points[0]}, 1};
  const int newest = 1 << (simplex.count - 1);
  for (int members = 1; members < 2 * newest; ++members) {
    Simplex face;
    Vector nearest;
    if (!NearestInside(simplex, members, face, nearest) || nearest.squaredNorm() > best.squaredNorm()) continue;
    best = nearest;
    best_face = face;
  }
  simplex = best_face;
  return best;
}

// The distance from the hull of {core - points} to the origin, by the algorithm of Gilbert, Johnson and Keerthi: the
// point found so far, the lowest point towards it, and the nearest point of the simplex of those kept.
double HullDistance(const std::vector<Vector>& core, std::span<const Vector> points) {
  constexpr int kMaxSteps = 40;
  constexpr double kTolerance = 1e-13;
  Simplex simplex{{core.front() - points.front()}, 1};
  Vector nearest = simplex.points[0];
  for (int step = 0; step < kMaxSteps && simplex.count < 4; ++step) {
    const auto along = [&](const Vector& a, const Vector& b) { return nearest.dot(a) < nearest.dot(b); };
    const Vector lowest = *std::ranges::min_element(core, along) - *std::ranges::max_element(points, along);
    const double square = nearest.squaredNorm();
    // No corner is lower than the point by more than rounding: the point is the nearest one.
    if (square - nearest.dot(lowest) <= kTolerance * std::max(square, lowest.squaredNorm())) break;
    simplex.points[ToSize(simplex.count++)] = lowest;
    nearest = Reduce(simplex);
  }
  return simplex.count == 4 ? 0 : nearest.norm();
}

// The distance from the hull of the points to the obstacle's core, by plain arithmetic: for planners, no proof.
double CoreDistance(const Obstacle& obstacle, std::span<const Vector> points) {
  if (obstacle.grid()) {
    Hull hull{};
    for (const int k : {0, 1}) {
      const auto [lower, upper] = std::ranges::minmax(points, {}, [k](const Vector& point) { return point[k]; });
      hull.center[ToSize(k)] = lower[k] / 2 + upper[k] / 2;
      hull.half_width[ToSize(k)] = upper[k] / 2 - lower[k] / 2;
    }
    return obstacle.grid()->LeastDistance(hull, [&](const Obstacle& block) { return CoreDistance(block, points); });
  }
  if (obstacle.kind() != Obstacle::Kind::kHalfSpace) return HullDistance(obstacle.hull(), points);
  double least = kInfinity;
  for (const Vector& point : points) least = std::min(least, ApproximateDistance(obstacle, point.head(obstacle.dim())));
  return least;
}

}  // namespace

bool HasFrame(const Body& body) {
  return std::ranges::any_of(body.parts, [](const BodyPart& part) { return part.places.empty(); });
}

BodyPlaces::BodyPlaces(const NominalModel& model, Eigen::MatrixXd projection, const Body& body)
    : projection_(std::move(projection)), body_(body) {
  for (const BodyPart& part : body.parts)
    unplaced_.push_back({std::vector<Vector>(ToSize(part.num_points()), Vector::Zero()), part.radius});
  if (body.HasPlaces()) coordinates_.emplace(NamesOf(model), body.Coordinates());
}

Eigen::VectorXd BodyPlaces::Position(std::span<const double> x) const {
  return projection_ * Eigen::Map<const Eigen::VectorXd>(x.data(), std::ssize(x));
}

double BodyPlaces::Heading(std::span<const double> x) const {
  return body_.heading >= 0 ? x[ToSize(body_.heading)] : 0;
}

void BodyPlaces::MoveFrame(const Eigen::VectorXd& position, double heading, std::vector<BodyPart>& parts) const {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (body_.heading >= 0)
    turn.topLeftCorner<2, 2>() << std::cos(heading), -std::sin(heading), std::sin(heading), std::cos(heading);
  Vector origin = Vector::Zero();
  origin.head(position.size()) = position;
  for (std::size_t i = 0; i < parts.size(); ++i)
    for (std::size_t j = 0; !IsAtExpressions(i) && j < parts[i].points.size(); ++j)
      parts[i].points[j] = origin + turn * body_.parts[i].points[j];
}

std::vector<BodyPart> BodyPlaces::At(std::span<const double> x) const {
  std::vector<BodyPart> parts = unplaced_;
  MoveFrame(Position(x), Heading(x), parts);
  if (!coordinates_) return parts;
  std::array<double, kMaxVariables> z{};  // no place uses an input
  std::ranges::copy(x, z.begin());
  std::array<long double, ToSize(kMaxBodyPoints * kMaxSafetyDim)> values;
  coordinates_->Evaluate({z.data(), ToSize(coordinates_->num_variables())},
                         {values.data(), ToSize(coordinates_->num_values())});
  const long double* value = values.data();
  for (std::size_t i = 0; i < parts.size(); ++i)
    for (std::size_t j = 0; IsAtExpressions(i) && j < parts[i].points.size(); ++j)
      for (Eigen::Index k = 0; k < projection_.rows(); ++k) parts[i].points[j][k] = static_cast<double>(*value++);
  return parts;
}

double Deviation(const Between& between, const BodyPart& part) {
  double reach = 0;
  for (const Vector& point : part.points) reach = std::max(reach, point.norm());
  const double turn = between.turn_rate * between.turn_rate + between.turn_acceleration;
  return (between.acceleration.norm() + reach * turn) * between.period * between.period / 8;
}

double ApproximateDistance(const Obstacle& obstacle, const BodyPart& part) {
  if (part.points.size() == 1) return ApproximateDistance(obstacle, part.points[0].head(obstacle.dim())) - part.radius;
  return CoreDistance(obstacle, part.points) - obstacle.radius() - part.radius;
}

double ApproximateDistance(const Obstacle& obstacle, const BodyPart& part, std::int64_t time_us) {
  if (!obstacle.motion()) return ApproximateDistance(obstacle, part);
  const ObstacleMotion& motion = *obstacle.motion();
  // Outside its window another piece of its track says where it is.
  if (time_us < motion.from_us || motion.until_us < time_us) return kInfinity;
  const double tau = static_cast<double>(time_us - motion.stamp_us) * 1e-6;
  BodyPart seen = part;  // from the obstacle
  for (Vector& point : seen.points) point -= motion.velocity * tau;
  return ApproximateDistance(obstacle, seen) - motion.uncertainty - motion.growth * std::abs(tau) -
         motion.growth_rate * tau * tau / 2;
}

double ApproximateDistance(const Obstacle& obstacle, const BodyPart& from, const BodyPart& to, const Schedule& schedule,
                           int first, int last) {
  if (first == last && !obstacle.motion()) return ApproximateDistance(obstacle, from);
  BodyPart seen = from;  // from the obstacle
  seen.points.insert(seen.points.end(), to.points.begin(), to.points.end());
  if (first == last) seen.points.resize(from.points.size());
  if (!obstacle.motion()) return ApproximateDistance(obstacle, seen);
  const Encounter encounter = Meet(*obstacle.motion(), schedule, first, last);
  if (!encounter.is_there) return kInfinity;
  for (std::size_t i = 0; i < seen.points.size(); ++i)
    for (std::size_t k = 0; k < kMaxSafetyDim; ++k)
      seen.points[i][static_cast<Eigen::Index>(k)] -= encounter.shift[i < from.points.size() ? 0 : 1][k].lower;
  return ApproximateDistance(obstacle, seen) - encounter.growth;
}

}  // namespace forereach
