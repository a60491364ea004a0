#include "certifier/safety/separation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "certifier/numerics/size.h"

namespace forereach {
namespace {

using Vector = Eigen::Vector3d;  // unused coordinates are zero

// The dual bound along a direction of unit length up to rounding, in plain arithmetic less a margin above its rounding.
double PlainDistanceLower(const Zonotope& slice, const Obstacle& obstacle, const Vector& d) noexcept {
  constexpr double kMargin = 0x1p-45, kTiny = 0x1p-1000;
  double core = kInfinity, size = kTiny;
  for (const Vector& point : obstacle.hull()) core = std::min(core, d.dot(point));
  alignas(32) std::array<double, kMaxGenerators> along;
  std::fill_n(along.begin(), slice.padded_size(), 0.0);
  double spread = 0, center = 0;
  for (int i = 0; i < slice.dim(); ++i) {
    const double* row = slice.padded_row(i).data();
    Lanes sum = AllLanes(0);
    for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount) {
      const Lanes part = AllLanes(d[i]) * LoadLanes(row + j);
      StoreLanes(LoadLanes(&along[j]) + part, &along[j]);
      sum += Abs(part);
    }
    center += d[i] * slice.center(i);
    spread += std::abs(d[i]) * slice.slack(i);
    size +=
        std::abs(d[i]) * (std::abs(slice.center(i)) + std::abs(obstacle.lower()[i]) + std::abs(obstacle.upper()[i])) +
        Sum(sum);
  }
  Lanes sum = AllLanes(0);
  for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount) sum += Abs(LoadLanes(&along[j]));
  spread += Sum(sum);
  const double gap = core - center - spread - RoundingError(kMargin, size);
  return gap > 0 && gap < kInfinity ? gap * (1 - kMargin) : -kInfinity;
}

// The dual bound along d, rounded against us.
[[gnu::noinline]] double DistanceLower(const Zonotope& slice, const Obstacle& obstacle, const Vector& d) noexcept {
  double core = kInfinity;
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace) {
    core = obstacle.offset();
  } else {
    for (const Vector& point : obstacle.hull()) {
      double along = 0;
      for (int k = 0; k < slice.dim(); ++k) along = AddDown(along, MulDown(d[k], point[k]));
      core = std::min(core, along);
    }
  }
  Interval square(0);
  for (int k = 0; k < slice.dim(); ++k) square += sqr(Interval(d[k]));
  const double gap = SubDown(core, slice.SupportUpper({d.data(), ToSize(slice.dim())}));
  const double distance = DivDown(gap, gap > 0 ? SqrtUp(square.upper) : SqrtDown(square.lower));
  return square.lower > 0 && distance < kInfinity ? distance : -kInfinity;  // NaN fails
}

// Shorter vectors have squares that underflow, and no direction that could be trusted.
bool IsSafeLength(double length) { return length > 0x1p-400 && length < kInfinity; }

// Directions are compared by plain arithmetic on unit vectors.
class Search {
 public:
  Search(const Zonotope& slice, const Obstacle& obstacle) noexcept : slice_(slice), hull_(obstacle.hull()) {
    center_.setZero();
    for (int k = 0; k < slice.dim(); ++k) center_[k] = slice.center(k);
  }

  [[nodiscard]] Vector generator(int j) const {
    Vector g = Vector::Zero();
    for (int k = 0; k < slice_.dim(); ++k) g[k] = slice_.generator(k, j);
    return g;
  }

  // A point of {core - slice}.
  [[nodiscard]] Vector Offset() const { return hull_.front() - center_; }

  void Consider(const Vector& direction) noexcept {
    const double length = direction.norm();
    if (!IsSafeLength(length)) return;
    ConsiderUnit(direction / length);
    ConsiderUnit(-direction / length);
  }

  [[nodiscard]] const Vector& best() const { return best_; }
  [[nodiscard]] double value() const { return value_; }

  // The first point of {core - slice} that a unit direction d meets, from below; considers d.
  [[nodiscard]] Vector Lowest(const Vector& d) noexcept {
    Vector lowest = hull_.front() - center_;
    for (const Vector& point : hull_)
      if (const Vector other = point - center_; d.dot(other) < d.dot(lowest)) lowest = other;
    const double *x = slice_.padded_row(0).data(), *y = slice_.padded_row(1).data();
    Lanes far_x = AllLanes(0), far_y = AllLanes(0), spread = AllLanes(0);
    for (std::size_t j = 0; j < slice_.padded_size(); j += kLaneCount) {
      const Lanes g_x = LoadLanes(x + j), g_y = LoadLanes(y + j);
      const Lanes along = AllLanes(d.x()) * g_x + AllLanes(d.y()) * g_y;
      far_x += along < AllLanes(0) ? -g_x : g_x;
      far_y += along < AllLanes(0) ? -g_y : g_y;
      spread += Abs(along);
    }
    Keep(d, d.dot(lowest) - Sum(spread));
    return lowest - Vector(Sum(far_x), Sum(far_y), 0);
  }

  // The corner of {core - slice} that direction d + tilt (tilt infinitely small) supports, seen from the origin.
  [[nodiscard]] Vector Corner(const Vector& d, const Vector& tilt) const noexcept {
    const auto side = [&](const Vector& x) {
      const double along = d.dot(x);
      return std::abs(along) > 1e-9 * x.norm() ? along : tilt.dot(x);
    };
    Vector corner = hull_.front() - center_;
    for (std::size_t i = 1; i < hull_.size(); ++i) {
      const Vector other = hull_[i] - center_;
      if (side(other - corner) < 0) corner = other;
    }
    for (int j = 0; j < slice_.num_generators(); ++j) {
      const Vector g = generator(j);
      corner -= side(g) > 0 ? g : Vector(-g);
    }
    return corner;
  }

 private:
  void ConsiderUnit(const Vector& d) noexcept {
    double value = kInfinity;
    for (const Vector& point : hull_) value = std::min(value, d.dot(point - center_));
    std::array<double, kMaxGenerators> along{};
    for (int k = 0; k < slice_.dim(); ++k) {
      const std::span<const double> row = slice_.row(k);
      for (std::size_t j = 0; j < row.size(); ++j) along[j] += d[k] * row[j];
    }
    for (std::size_t j = 0; j < ToSize(slice_.num_generators()); ++j) value -= std::abs(along[j]);
    Keep(d, value);
  }

  void Keep(const Vector& d, double value) noexcept {
    if (!(value > value_)) return;
    value_ = value;
    best_ = d;
  }

  const Zonotope& slice_;
  const std::vector<Vector>& hull_;
  Vector center_;
  Vector best_ = Vector::UnitX();
  double value_ = -kInfinity;
};

Vector Turned(const Vector& edge) { return {-edge.y(), edge.x(), 0}; }

// The point of the segment [a, b] next to the origin.
Vector NearestOnSegment(const Vector& a, const Vector& b) {
  const Vector edge = b - a;
  const double length_square = edge.squaredNorm();
  if (!(length_square > 0)) return a;
  return a + edge * std::clamp(-a.dot(edge) / length_square, 0.0, 1.0);
}

// Gilbert, Johnson and Keerthi's search for the point of {core - slice} next to the origin: from one point found
// towards it, the lowest point in that direction, and the nearest point of the segments between those kept. A few steps
// do.
void Descend(Search& search, Vector nearest) noexcept {
  constexpr int kMaxSteps = 12;
  Vector kept[2] = {nearest, nearest};
  for (int step = 0; step < kMaxSteps; ++step) {
    const double length = nearest.norm();
    if (!IsSafeLength(length)) return;
    const Vector lowest = search.Lowest(nearest / length);
    if (search.value() >= length * (1 - 1e-15)) return;
    const Vector first = NearestOnSegment(lowest, kept[0]), second = NearestOnSegment(lowest, kept[1]);
    const bool with_first = first.squaredNorm() < second.squaredNorm();
    nearest = with_first ? first : second;
    kept[with_first ? 1 : 0] = lowest;
  }
}

// In the plane the distance is attained along the normal of an edge of {core - slice}, or towards a corner next to the
// best such edge: the dual bound is concave in d, so it rises to its maximum and falls after it.
[[gnu::noinline]] void TryAllNormals(Search& search, const Zonotope& slice, const std::vector<Vector>& hull) noexcept {
  for (int j = 0; j < slice.num_generators(); ++j) search.Consider(Turned(search.generator(j)));
  for (std::size_t a = 0; a < hull.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) search.Consider(Turned(hull[a] - hull[b]));
  const Vector normal = search.best();
  search.Consider(search.Corner(normal, Turned(normal)));
  search.Consider(search.Corner(normal, -Turned(normal)));
}

Vector BestPlanar(const Zonotope& slice, const Obstacle& obstacle) noexcept {
  Search search(slice, obstacle);
  Descend(search, search.Offset());
  if (!(search.value() > obstacle.radius())) TryAllNormals(search, slice, obstacle.hull());
  return search.best();
}

// In space disjoint polytopes are separated by a face normal of one, or the cross product of an edge of each. The edges
// of a box are the axes; the faces of a zonotope lie along pairs of generators.
[[gnu::noinline]] Vector BestSpatial(const Zonotope& slice, const Obstacle& obstacle) noexcept {
  Search search(slice, obstacle);
  for (int k = 0; k < 3; ++k) search.Consider(Vector::Unit(k));
  for (int j = 0; j < slice.num_generators(); ++j) {
    const Vector g = search.generator(j);
    for (int k = 0; k < 3; ++k) search.Consider(g.cross(Vector::Unit(k)));
    for (int i = 0; i < j; ++i) search.Consider(g.cross(search.generator(i)));
  }
  return search.best();
}

Vector BestDirection(const Zonotope& slice, const Obstacle& obstacle) noexcept {
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace) {
    Vector normal = Vector::Zero();
    normal.head(obstacle.dim()) = obstacle.points()[0];
    return normal;
  }
  switch (obstacle.dim()) {
    case 1: {
      Search search(slice, obstacle);
      search.Consider(Vector::UnitX());
      return search.best();
    }
    case 2: return BestPlanar(slice, obstacle);
    case 3: return BestSpatial(slice, obstacle);
    default: return Vector::Zero();  // proves nothing
  }
}

}  // namespace

Separation SeparateHulls(const Hull& slice, const Obstacle& obstacle) noexcept {
  constexpr double kMargin = 0x1p-47;  // larger than the rounding error of these operations, relative to their operands
  const int p = obstacle.dim();
  double square = 0;
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace) {
    const Eigen::VectorXd& normal = obstacle.points()[0];
    double gap = obstacle.offset(), size = std::abs(gap) + 0x1p-900;
    for (int i = 0; i < p; ++i) {
      const auto k = ToSize(i);
      const double d = normal[i], part = std::abs(d) * slice.half_width[k];
      gap -= d * slice.center[k] + part;
      size += std::abs(d * slice.center[k]) + part;
      square += d * d;
    }
    const double distance = (gap - RoundingError(kMargin, size)) / std::sqrt(square) * (1 - kMargin);
    return {distance > 0x1p-400 && distance < kInfinity && square > 0x1p-400 ? distance : -kInfinity, 0};
  }
  for (int i = 0; i < p; ++i) {
    const auto k = ToSize(i);
    const double below = obstacle.lower()[i] - slice.center[k], above = slice.center[k] - obstacle.upper()[i];
    const double size =
        std::abs(obstacle.lower()[i]) + std::abs(obstacle.upper()[i]) + std::abs(slice.center[k]) + slice.half_width[k];
    const double gap = std::max(below, above) - slice.half_width[k] - RoundingError(kMargin, size);
    square += gap > 0 ? gap * gap : 0;
  }
  const double distance = std::sqrt(square) * (1 - kMargin);
  return {distance > 0x1p-400 && distance < kInfinity ? distance : -kInfinity, obstacle.radius()};
}

namespace {

FOREREACH_INLINE Separation SeparateInline(const Zonotope& slice, const Obstacle& obstacle) noexcept {
  const Vector direction = BestDirection(slice, obstacle);
  if (obstacle.kind() != Obstacle::Kind::kHalfSpace && std::abs(direction.squaredNorm() - 1) < 0x1p-46)
    if (const Separation plain{PlainDistanceLower(slice, obstacle, direction), obstacle.radius()}; plain.IsProven())
      return plain;
  return {DistanceLower(slice, obstacle, direction), obstacle.radius()};
}

}  // namespace

Separation Separate(const Zonotope& slice, const Obstacle& obstacle, InstructionSet instructions) noexcept {
  return Dispatch<&SeparateInline>(instructions, slice, obstacle);
}

}  // namespace forereach
