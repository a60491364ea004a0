#include "forereach/safety/separation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "forereach/numerics/size.h"
#include "forereach/sets/zonotope.h"

namespace forereach {
namespace {

using Vector = Eigen::Vector3d;  // unused coordinates are zero

// The dual bound for a piece along a direction of unit length up to rounding, in plain arithmetic less a margin above
// its rounding: docs/soundness.md, 3.9, bound 3.
double PlainDistanceLower(const Piece& piece, const Obstacle& obstacle, const Vector& d) noexcept {
  const Zonotope& slice = *piece.set;
  constexpr double kMargin = 0x1p-45, kTiny = 0x1p-1000;
  double core = kInfinity, size = kTiny;
  for (const Vector& point : obstacle.hull()) core = std::min(core, d.dot(point));
  alignas(32) std::array<double, kMaxGenerators> along;
  std::fill_n(along.begin(), slice.padded_size(), 0.0);
  double spread = 0, center = 0, shifted = 0;
  for (int i = 0; i < slice.dim(); ++i) {
    const Interval& shift = piece.shift[ToSize(i)];
    const double* row = slice.padded_row(i).data();
    Lanes sum = AllLanes(0);
    for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount) {
      const Lanes part = AllLanes(d[i]) * LoadLanes(row + j);
      StoreLanes(LoadLanes(&along[j]) + part, &along[j]);
      sum += Abs(part);
    }
    center += d[i] * slice.center(i);
    shifted += std::min(d[i] * shift.lower, d[i] * shift.upper);
    spread += std::abs(d[i]) * slice.slack(i);
    size += std::abs(d[i]) * (std::abs(slice.center(i)) + shift.Magnitude() + std::abs(obstacle.lower()[i]) +
                              std::abs(obstacle.upper()[i])) +
            Sum(sum);
  }
  Lanes sum = AllLanes(0);
  for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount) sum += Abs(LoadLanes(&along[j]));
  spread += Sum(sum);
  const double gap = core - center - spread + shifted - RoundingError(kMargin, size);
  return gap > 0 && gap < kInfinity ? SubDown(gap * (1 - kMargin), piece.ball) : -kInfinity;
}

// The dual bound for a piece along d, each operation rounded to the safe side: docs/soundness.md, 3.9, bound 4.
[[gnu::noinline]] double DistanceLower(const Piece& piece, const Obstacle& obstacle, const Vector& d) noexcept {
  const Zonotope& slice = *piece.set;
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
  Interval square(0), shifted(0);
  for (int k = 0; k < slice.dim(); ++k) {
    square += sqr(Interval(d[k]));
    shifted += Interval(d[k]) * piece.shift[ToSize(k)];
  }
  const double gap = AddDown(SubDown(core, slice.SupportUpper({d.data(), ToSize(slice.dim())})), shifted.lower);
  const double distance = DivDown(gap, gap > 0 ? SqrtUp(square.upper) : SqrtDown(square.lower));
  return square.lower > 0 && distance < kInfinity ? SubDown(distance, piece.ball) : -kInfinity;  // NaN fails
}

// Shorter vectors have squares that underflow, and no direction that could be trusted.
bool IsSafeLength(double length) { return length > 0x1p-400 && length < kInfinity; }

// Searches for a direction with a large bound, by plain arithmetic on unit vectors. Its values prove nothing: the bound
// along the direction that it finds is computed again, so a poor choice costs tightness only.
class DirectionSearch {
 public:
  DirectionSearch(std::span<const Piece> pieces, const Obstacle& obstacle) noexcept
      : pieces_(pieces), hull_(obstacle.hull()) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      centers_[i].setZero();
      for (int k = 0; k < dim(); ++k) centers_[i][k] = pieces[i].set->center(k) - pieces[i].shift[ToSize(k)].Middle();
    }
    if (pieces.size() > 1 && !hull_.empty()) Measure(obstacle);
  }

  // The piece of the best value, among several.
  [[nodiscard]] std::size_t nearest() const { return nearest_; }
  // Whether the dual bound of a piece along d, of length 1, exceeds `value` by more than all rounding: that of the box
  // around it does. Numbers that are none are sure of nothing.
  [[nodiscard]] bool IsFarther(std::size_t i, const Vector& d, double value) const noexcept {
    double core = kInfinity;
    for (const Vector& point : hull_) core = std::min(core, d.dot(point));
    return IsBoxAbove(i, d, core - d.dot(centers_[i]) - pieces_[i].ball, value);
  }

  [[nodiscard]] int dim() const { return pieces_.front().set->dim(); }
  /** The only piece's: see TryAllNormals and BestSpatial. */
  [[nodiscard]] int num_generators() const { return pieces_.front().set->num_generators(); }
  [[nodiscard]] Vector generator(int j) const {
    Vector g = Vector::Zero();
    for (int k = 0; k < dim(); ++k) g[k] = pieces_.front().set->generator(k, j);
    return g;
  }

  // A point of {core - hull of the pieces}.
  [[nodiscard]] Vector Offset() const { return hull_.front() - centers_.front(); }

  void Consider(const Vector& direction) noexcept {
    const double length = direction.norm();
    if (!IsSafeLength(length)) return;
    ConsiderUnit(direction / length);
    ConsiderUnit(-direction / length);
  }

  [[nodiscard]] const Vector& best() const { return best_; }
  [[nodiscard]] double value() const { return value_; }

  // The first point of {core - hull of the pieces} that a unit direction d meets, from below; considers d.
  [[nodiscard]] Vector Lowest(const Vector& d) noexcept {
    Vector lowest = hull_.front();
    for (const Vector& point : hull_)
      if (d.dot(point) < d.dot(lowest)) lowest = point;
    Vector first = Vector::Zero();
    double value = kInfinity, most = kInfinity;  // the value is not above that of a piece's center
    std::size_t number = 0;
    std::array<double, kMaxPieces> of_center;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      of_center[i] = d.dot(lowest - centers_[i]) - pieces_[i].ball;
      most = std::min(most, of_center[i]);
    }
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (pieces_.size() > 1 && IsBoxAbove(i, d, of_center[i], std::min(value, most))) continue;
      const auto [offset, spread] = Farthest(*pieces_[i].set, d);
      const Vector towards = lowest - centers_[i];
      if (const double its_value = d.dot(towards) - spread - pieces_[i].ball; its_value < value) {
        value = its_value;
        first = towards - offset - pieces_[i].ball * d;
        number = i;
      }
    }
    if (Keep(d, value)) nearest_ = number;
    return first;
  }

  // The corner of {core - the only piece} that direction d + tilt (tilt infinitely small) supports, seen from the
  // origin.
  [[nodiscard]] Vector Corner(const Vector& d, const Vector& tilt) const noexcept {
    const auto side = [&](const Vector& x) {
      const double along = d.dot(x);
      return std::abs(along) > 1e-9 * x.norm() ? along : tilt.dot(x);
    };
    Vector corner = hull_.front() - centers_.front();
    for (std::size_t i = 1; i < hull_.size(); ++i) {
      const Vector other = hull_[i] - centers_.front();
      if (side(other - corner) < 0) corner = other;
    }
    for (int j = 0; j < num_generators(); ++j) {
      const Vector g = generator(j);
      corner -= side(g) > 0 ? g : Vector(-g);
    }
    return corner;
  }

 private:
  struct Reach {
    Vector offset;  // from the center to the farthest point along d
    double spread;  // d . offset
  };
  [[nodiscard]] FOREREACH_INLINE static Reach Farthest(const Zonotope& set, const Vector& d) noexcept {
    return set.dim() == 2 ? FarthestIn<2>(set, d) : set.dim() == 3 ? FarthestIn<3>(set, d) : FarthestIn<1>(set, d);
  }
  // The dimension is known, so the loops over it are unrolled.
  template <std::size_t kDim>
  [[nodiscard]] FOREREACH_INLINE static Reach FarthestIn(const Zonotope& set, const Vector& d) noexcept {
    std::array<Lanes, kMaxSafetyDim> far{};
    std::array<const double*, kDim> rows;
    for (std::size_t k = 0; k < kDim; ++k) rows[k] = set.padded_row(static_cast<int>(k)).data();
    Lanes spread = AllLanes(0);
    for (std::size_t j = 0, size = set.padded_size(); j < size; j += kLaneCount) {
      Lanes along = AllLanes(d[0]) * LoadLanes(rows[0] + j);
      for (std::size_t k = 1; k < kDim; ++k)
        along = along + AllLanes(d[static_cast<Eigen::Index>(k)]) * LoadLanes(rows[k] + j);
      for (std::size_t k = 0; k < kDim; ++k) {
        const Lanes g = LoadLanes(rows[k] + j);
        far[k] += along < AllLanes(0) ? -g : g;
      }
      spread += Abs(along);
    }
    return {Vector(Sum(far[0]), Sum(far[1]), Sum(far[2])), Sum(spread)};
  }

  void ConsiderUnit(const Vector& d) noexcept {
    double value = kInfinity;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const Zonotope& set = *pieces_[i].set;
      double its_value = kInfinity;
      for (const Vector& point : hull_) its_value = std::min(its_value, d.dot(point - centers_[i]));
      std::array<double, kMaxGenerators> along{};
      for (int k = 0; k < set.dim(); ++k) {
        const std::span<const double> row = set.row(k);
        for (std::size_t j = 0; j < row.size(); ++j) along[j] += d[k] * row[j];
      }
      for (std::size_t j = 0; j < ToSize(set.num_generators()); ++j) its_value -= std::abs(along[j]);
      value = std::min(value, its_value - pieces_[i].ball);
    }
    Keep(d, value);
  }

  bool Keep(const Vector& d, double value) noexcept {
    if (!(value > value_)) return false;
    value_ = value;
    best_ = d;
    return true;
  }

  // The half-widths of the boxes around the pieces, and a margin that is far above all rounding here and in
  // PlainDistanceLower: docs/soundness.md, 3.9, bound 3.
  void Measure(const Obstacle& obstacle) noexcept {
    double size = obstacle.lower().cwiseAbs().sum() + obstacle.upper().cwiseAbs().sum();
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const Zonotope& set = *pieces_[i].set;
      widths_[i].setZero();
      for (int k = 0; k < dim(); ++k) {
        const Interval& shift = pieces_[i].shift[ToSize(k)];
        const double* row = set.padded_row(k).data();
        Lanes sum = AllLanes(0);
        for (std::size_t j = 0, end = set.padded_size(); j < end; j += kLaneCount) sum += Abs(LoadLanes(row + j));
        widths_[i][k] = Sum(sum) + set.slack(k) + (shift.upper - shift.lower);
        size += std::abs(set.center(k)) + shift.Magnitude() + widths_[i][k];
      }
      size += pieces_[i].ball;
    }
    margin_ = 0x1p-40 * size;
  }
  [[nodiscard]] bool IsBoxAbove(std::size_t i, const Vector& d, double of_center, double value) const noexcept {
    return of_center - d.cwiseAbs().dot(widths_[i]) > value + margin_;
  }

  std::span<const Piece> pieces_;
  const std::vector<Vector>& hull_;
  std::array<Vector, kMaxPieces> centers_, widths_;  // the latter of several
  Vector best_ = Vector::UnitX();
  double value_ = -kInfinity, margin_ = 0;
  std::size_t nearest_ = 0;
};

Vector Turned(const Vector& edge) { return {-edge.y(), edge.x(), 0}; }

// The point of the segment [a, b] next to the origin.
Vector NearestOnSegment(const Vector& a, const Vector& b) {
  const Vector edge = b - a;
  const double length_square = edge.squaredNorm();
  if (!(length_square > 0)) return a;
  return a + edge * std::clamp(-a.dot(edge) / length_square, 0.0, 1.0);
}

// When a search ends. Of several pieces the nearest face may join two of them, so the normals of one are not all there
// are, and their balls have no faces: such a search takes more steps and ends near its best.
struct Effort {
  int steps;
  double tolerance, threshold, enough;

  static Effort For(std::span<const Piece> pieces, double threshold, double enough) {
    return pieces.size() == 1 && pieces.front().ball == 0 ? Effort{12, 1e-15, threshold, enough}
                                                          : Effort{50, 1e-7, threshold, enough};
  }
  // A point of the set has been found at `length`, and a proof for `value`.
  [[nodiscard]] bool Suffices(double value, double length) const {
    return value > enough || value >= length * (1 - (value > threshold ? tolerance : 1e-15));
  }
};

// The point of the triangle a, b, c next to the origin.
Vector NearestOnTriangle(const Vector& a, const Vector& b, const Vector& c) {
  const Vector normal = (b - a).cross(c - a);
  const double square = normal.squaredNorm();
  if (square > 0) {
    const auto is_inside = [&](const Vector& from, const Vector& to) {
      return normal.dot((to - from).cross(-from)) >= 0;
    };
    if (is_inside(a, b) && is_inside(b, c) && is_inside(c, a)) return normal * (normal.dot(a) / square);
  }
  Vector nearest = NearestOnSegment(a, b);
  for (const Vector& other : {NearestOnSegment(b, c), NearestOnSegment(c, a)})
    if (other.squaredNorm() < nearest.squaredNorm()) nearest = other;
  return nearest;
}

// Gilbert, Johnson and Keerthi's search for the point of {core - set} next to the origin: from one point found towards
// it, the lowest point in that direction, and the nearest point of the simplices between it and those kept. A few steps
// do for one zonotope.
void DescendInPlane(DirectionSearch& search, const Effort& effort) noexcept {
  Vector nearest = search.Offset(), kept[2] = {nearest, nearest};
  for (int step = 0; step < effort.steps; ++step) {
    const double length = nearest.norm();
    if (!IsSafeLength(length)) return;
    const Vector lowest = search.Lowest(nearest / length);
    if (effort.Suffices(search.value(), length)) return;
    const Vector first = NearestOnSegment(lowest, kept[0]), second = NearestOnSegment(lowest, kept[1]);
    const bool with_first = first.squaredNorm() < second.squaredNorm();
    nearest = with_first ? first : second;
    kept[with_first ? 1 : 0] = lowest;
  }
}

// DescendInPlane in three dimensions: the simplices are triangles.
void DescendInSpace(DirectionSearch& search, const Effort& effort) noexcept {
  Vector nearest = search.Offset(), kept[3] = {nearest, nearest, nearest};
  for (int step = 0; step < effort.steps; ++step) {
    const double length = nearest.norm();
    if (!IsSafeLength(length)) return;
    const Vector lowest = search.Lowest(nearest / length);
    if (effort.Suffices(search.value(), length)) return;
    int left_out = 0;
    for (int i = 0; i < 3; ++i) {
      const Vector other = NearestOnTriangle(lowest, kept[(i + 1) % 3], kept[(i + 2) % 3]);
      if (i == 0 || other.squaredNorm() < nearest.squaredNorm()) nearest = other, left_out = i;
    }
    kept[left_out] = lowest;
  }
}

// In the plane the distance is attained along the normal of an edge of {core - slice}, or towards a corner next to the
// best such edge: the dual bound is concave in d, so it rises to its maximum and falls after it.
[[gnu::noinline]] void TryAllNormals(DirectionSearch& search, const std::vector<Vector>& hull) noexcept {
  for (int j = 0; j < search.num_generators(); ++j) search.Consider(Turned(search.generator(j)));
  for (std::size_t a = 0; a < hull.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) search.Consider(Turned(hull[a] - hull[b]));
  const Vector normal = search.best();
  search.Consider(search.Corner(normal, Turned(normal)));
  search.Consider(search.Corner(normal, -Turned(normal)));
}

Vector BestPlanar(DirectionSearch& search, std::span<const Piece> pieces, const Obstacle& obstacle, double threshold,
                  double enough) noexcept {
  DescendInPlane(search, Effort::For(pieces, threshold, enough));
  if (pieces.size() == 1 && !(search.value() > threshold)) TryAllNormals(search, obstacle.hull());
  return search.best();
}

// In space disjoint polytopes are separated by a face normal of one, or the cross product of an edge of each. The edges
// of a box are the axes; the faces of a zonotope lie along pairs of generators.
[[gnu::noinline]] Vector BestSpatial(DirectionSearch& search, std::span<const Piece> pieces, double threshold,
                                     double enough) noexcept {
  for (int k = 0; k < 3; ++k) search.Consider(Vector::Unit(k));
  DescendInSpace(search, {50, 1e-7, threshold, enough});
  if (pieces.size() > 1 || search.value() > threshold) return search.best();
  for (int j = 0; j < search.num_generators(); ++j) {
    const Vector g = search.generator(j);
    for (int k = 0; k < 3; ++k) search.Consider(g.cross(Vector::Unit(k)));
    for (int i = 0; i < j; ++i) search.Consider(g.cross(search.generator(i)));
  }
  return search.best();
}

Vector BestDirection(DirectionSearch& search, std::span<const Piece> pieces, const Obstacle& obstacle, double threshold,
                     double enough) noexcept {
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace) {
    Vector normal = Vector::Zero();
    normal.head(obstacle.dim()) = obstacle.points()[0];
    return normal;
  }
  if (obstacle.hull().empty()) return Vector::Zero();  // of a grid: proves nothing
  switch (obstacle.dim()) {
    case 1: {
      search.Consider(Vector::UnitX());
      return search.best();
    }
    case 2: return BestPlanar(search, pieces, obstacle, threshold, enough);
    case 3: return BestSpatial(search, pieces, threshold, enough);
    default: return Vector::Zero();  // proves nothing
  }
}

}  // namespace

Hull Join(const Hull& a, const Hull& b, int dim) noexcept {
  Hull joined{};
  for (std::size_t k = 0; k < ToSize(dim); ++k) {
    const auto range = [k](const Hull& hull) {
      return Interval(SubDown(hull.center[k], hull.half_width[k]), AddUp(hull.center[k], hull.half_width[k]));
    };
    const Interval of_a = range(a), of_b = range(b);
    bool is_finite = true;  // a minimum may drop NaN
    for (const double end : {of_a.lower, of_a.upper, of_b.lower, of_b.upper}) is_finite &= std::isfinite(end);
    const Interval both = is_finite ? forereach::Join(of_a, of_b) : Interval::Entire();
    joined.center[k] = is_finite ? both.Middle() : 0;
    joined.half_width[k] = is_finite ? both.DistanceUpper(joined.center[k]) : kInfinity;
  }
  return joined;
}

// docs/soundness.md, 3.9, bound 2. Lengths whose squares may underflow or overflow prove nothing.
double DistanceLower(const Obstacle& obstacle, const Vector& d, double support) noexcept {
  constexpr double kMargin = 0x1p-47;  // larger than the rounding error of these operations, relative to their operands
  double core = kInfinity, size = std::abs(support) + 0x1p-900;
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace) {
    core = obstacle.offset();
    size += std::abs(core);
  } else {
    for (const Vector& point : obstacle.hull()) {
      core = std::min(core, d.dot(point));
      size += d.cwiseAbs().dot(point.cwiseAbs());
    }
  }
  const double square = d.squaredNorm(),
               distance = (core - support - RoundingError(kMargin, size)) / std::sqrt(square) * (1 - kMargin);
  return distance > 0x1p-400 && distance < kInfinity && square > 0x1p-801 && square < 0x1p801 ? distance : -kInfinity;
}

// docs/soundness.md, 3.9, bound 1.
Separation SeparateHulls(const Hull& slice, const Obstacle& obstacle, double added) noexcept {
  constexpr double kMargin = 0x1p-47;  // larger than the rounding error of these operations, relative to their operands
  const int p = obstacle.dim();
  const double threshold = AddUp(obstacle.radius(), added);
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
    return {distance > 0x1p-400 && distance < kInfinity && square > 0x1p-400 ? distance : -kInfinity, threshold};
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
  return {distance > 0x1p-400 && distance < kInfinity ? distance : -kInfinity, threshold};
}

namespace {

// The least of a bound over all pieces.
template <class Bound>
FOREREACH_INLINE double LeastOf(std::span<const Piece> pieces, Bound bound) noexcept {
  double least = kInfinity;
  for (const Piece& piece : pieces) {
    const double found = bound(piece);
    least = found >= least ? least : found < least ? found : -kInfinity;  // NaN proves nothing
  }
  return least;
}

FOREREACH_INLINE Separation SeparateInline(std::span<const Piece> pieces, const Obstacle& obstacle, double threshold,
                                           double enough) noexcept {
  DirectionSearch search(pieces, obstacle);
  const Vector direction = BestDirection(search, pieces, obstacle, threshold, enough);
  if (obstacle.kind() != Obstacle::Kind::kHalfSpace && std::abs(direction.squaredNorm() - 1) < 0x1p-46) {
    const double nearest = PlainDistanceLower(pieces[search.nearest()], obstacle, direction);
    const auto plain = [&](const Piece& piece) {
      const auto i = ToSize(&piece - pieces.data());
      return i == search.nearest() || search.IsFarther(i, direction, nearest)
                 ? nearest
                 : PlainDistanceLower(piece, obstacle, direction);
    };
    if (const Separation found{LeastOf(pieces, plain), threshold}; found.IsProven()) return found;
  }
  return {LeastOf(pieces, [&](const Piece& piece) { return DistanceLower(piece, obstacle, direction); }), threshold};
}

}  // namespace

Separation Separate(std::span<const Piece> pieces, const Obstacle& obstacle, double added, InstructionSet instructions,
                    double enough) noexcept {
  const double threshold = AddUp(obstacle.radius(), added);
  return Dispatch<&SeparateInline>(instructions, pieces, obstacle, threshold, threshold + enough);
}

Separation Separate(const Zonotope& slice, const Obstacle& obstacle, InstructionSet instructions) noexcept {
  const Piece piece{&slice};
  return Separate({&piece, 1}, obstacle, 0, instructions);
}

}  // namespace forereach
