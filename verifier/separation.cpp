#include "verifier/separation.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "forereach/numerics/size.h"
#include "forereach/safety/grid_map.h"

namespace forereach::verifier {
namespace {

using RealVector = std::vector<Real>;

constexpr int kMostRounds = 1000;  // Wolfe's algorithm ends by itself, but for rounding

Real Dot(const RealVector& a, const RealVector& b) {
  Real sum;
  for (std::size_t k = 0; k < a.size(); ++k)
    if (!a[k].IsZero() && !b[k].IsZero()) sum += a[k] * b[k];
  return sum;
}

RealVector Minus(const RealVector& a, const RealVector& b) {
  RealVector difference;
  for (std::size_t k = 0; k < a.size(); ++k) difference.push_back(a[k] - b[k]);
  return difference;
}

// One vector between the ends: the search needs no rigour.
RealVector Middle(RealVector vector) {
  for (Real& entry : vector) entry = entry.middle();
  return vector;
}

bool IsPositive(const Real& x) { return CertainlyBelow(Real(), x); }

// {y : |y - w| <= radius, w in the hull of the points}; without points, {y : normal . y >= offset}.
struct Core {
  std::vector<RealVector> points;
  RealVector normal;
  Real offset, radius;
};

Core CoreOf(const Obstacle& obstacle) {
  Core core;
  core.radius = Real(obstacle.radius());
  const auto& given = obstacle.points();
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace) {
    core.normal = RealVector(given[0].begin(), given[0].end());
    core.offset = Real(obstacle.offset());
  } else if (obstacle.kind() != Obstacle::Kind::kBox) {
    for (const Eigen::VectorXd& point : given) core.points.emplace_back(point.begin(), point.end());
  } else {
    for (int corner = 0; corner < 1 << obstacle.dim(); ++corner) {
      RealVector& point = core.points.emplace_back();
      for (int k = 0; k < obstacle.dim(); ++k) point.emplace_back(given[corner >> k & 1 ? 1 : 0][k]);
    }
  }
  return core;
}

// Weights w, sum 1, that minimise |sum w_i p_i|, by Gauss's elimination; empty where the points are dependent.
RealVector AffineMinimum(const std::vector<RealVector>& points) {
  std::vector<RealVector> edges, rows;
  for (std::size_t i = 1; i < points.size(); ++i) edges.push_back(Minus(points[i], points[0]));
  for (const RealVector& a : edges) {
    RealVector& row = rows.emplace_back();
    for (const RealVector& b : edges) row.push_back(Dot(a, b));
    row.push_back(-Dot(a, points[0]));
    row = Middle(row);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!IsPositive(rows[i][i])) return {};
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (r == i) continue;
      const Real factor = rows[r][i] / rows[i][i];
      for (std::size_t c = i; c < rows[r].size(); ++c) rows[r][c] -= factor * rows[i][c];
      rows[r] = Middle(rows[r]);
    }
  }
  RealVector weights{Real(1.0)};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    weights.push_back((rows[i].back() / rows[i][i]).middle());
    weights[0] = (weights[0] - weights.back()).middle();
  }
  return weights;
}

// A lower bound on the distance from a box around the sweep, along the best axis, less the distances to be kept. Most
// obstacles are far away, and this is enough for them.
Real DistanceAlongAnAxis(const Sweep& sweep, const Core& core, const Passage& passage) {
  Real largest(-std::numeric_limits<double>::infinity());
  if (core.points.empty()) return largest;
  for (int k = 0; k < sweep.dim(); ++k) {
    Real low = core.points.front()[ToSize(k)], high = low;
    for (const RealVector& point : core.points) low = min(low, point[ToSize(k)]), high = max(high, point[ToSize(k)]);
    std::optional<Real> below, above;  // of the places, seen from the obstacle
    for (std::size_t sample = 0; sample < 2; ++sample) {
      if (sweep.boxes()[sample].empty()) continue;
      Bounds box = sweep.boxes()[sample][ToSize(k)];
      if (const RealVector& shift = passage.shift[sample]; !shift.empty())
        box = {box.lower - shift[ToSize(k)], box.upper - shift[ToSize(k)]};
      below = below ? max(*below, box.upper) : box.upper;
      above = above ? min(*above, box.lower) : box.lower;
    }
    largest = max(largest, max(low - *below, *above - high));
  }
  return (largest - core.radius - passage.growth - sweep.radius()).lower();
}

// The dual bound along directions, the best of which leads to the point of {core - sweep} nearest to the origin. The
// sweep is taken without its radius and without the smallest of its balls: these are distances to be kept.
class SeparationSearch {
 public:
  SeparationSearch(const Sweep& sweep, const Core& core, double clearance, const Passage& passage)
      : sweep_(sweep), obstacle_(core), clearance_(clearance), kept_(core.radius + passage.growth + sweep.radius()) {
    const std::vector<Place>& places = sweep.places();
    Real least = places.front().ball;
    for (const Place& place : places) least = min(least, place.ball);
    kept_ += least;
    const auto center = [&](const Place& place) {
      const RealVector& shift = passage.shift[ToSize(place.sample)];
      return shift.empty() ? place.center : Minus(place.center, shift);
    };
    const RealVector reference = IsHalfSpace() ? RealVector(places.front().center.size()) : center(places.front());
    for (const Place& place : places) {
      offsets_.push_back(Minus(center(place), reference));
      balls_.push_back(place.ball - least);
    }
    if (IsHalfSpace()) return;
    for (const RealVector& point : core.points) core_.push_back(Minus(point, reference));
  }

  /** True once a direction proves the clearance. */
  bool Run() {
    if (IsHalfSpace()) return Try(obstacle_.normal);
    const auto nearest = std::ranges::min_element(
        core_, [](const RealVector& a, const RealVector& b) { return CertainlyBelow(Dot(a, a), Dot(b, b)); });
    if (Try(*nearest)) return true;
    const Face face = NearestFace(*nearest);
    if (face.is_proof || Try(face.nearest) || TryExactly(face)) return true;
    if (Touches(face.nearest))
      undecided_ = false;
    else
      undecided_ |= !face.is_best;
    return false;
  }

  [[nodiscard]] const std::optional<Real>& best() const { return best_; }
  [[nodiscard]] bool undecided() const { return undecided_; }

 private:
  /** Corners of {core - sweep}, and the point of their simplex that is nearest to the origin. */
  struct Face {
    std::vector<RealVector> corners;
    RealVector nearest;
    bool is_best;           ///< No corner lies below the nearest point; false: more bits are needed to go on.
    bool is_proof = false;  ///< The nearest point is a direction that proves the clearance.
  };

  [[nodiscard]] bool IsHalfSpace() const { return obstacle_.points.empty(); }
  [[nodiscard]] Real Needed() const { return Real(clearance_) + kept_; }

  // max {d . y : y in place i}, |d| = length.
  [[nodiscard]] Real Support(std::size_t i, const RealVector& d, const Real& length) const {
    const Place& place = sweep_.places()[i];
    Real value = Dot(d, offsets_[i]);
    for (const RealVector& g : place.generators) value += abs(Dot(d, g));
    if (!place.bend.IsZero()) value += place.bend.Farthest(d).value;
    if (!balls_[i].IsZero()) value += balls_[i] * length;
    return value;
  }

  // Whether d proves the clearance: gap >= (clearance + radius) |d|.
  bool Try(const RealVector& d) {
    const Real square = Dot(d, d);
    if (!IsPositive(square)) return false;
    const Real length = sqrt(square);
    Real reach = Support(0, d, length);
    for (std::size_t i = 1; i < offsets_.size(); ++i) reach = max(reach, Support(i, d, length));
    Real gap;
    if (IsHalfSpace()) {
      gap = obstacle_.offset - reach;
    } else {
      gap = Dot(d, core_.front());
      for (const RealVector& point : core_) gap = min(gap, Dot(d, point));
      gap -= reach;
    }
    const Real bound = (gap / length - kept_).lower();
    best_ = best_ ? max(*best_, bound) : bound;
    // Times the length instead of divided by it: no quotient has to be decided.
    const Real needed = Needed() * length;
    // A clearance that is claimed may be met exactly; without one, touching is not being clear.
    const Answer answer = clearance_ > 0 ? IsAtMost(needed, gap) : IsBelow(needed, gap);
    undecided_ |= answer == Answer::kUnknown;
    return answer == Answer::kYes;
  }

  // The nearest point is one of {core - sweep}: the distance is at most its length. With many bits, one that is nothing
  // beside the corners is zero: distances of sets of doubles have no such size.
  [[nodiscard]] bool Touches(const RealVector& nearest) const {
    const Real length = sqrt(Dot(nearest, nearest));
    if (CertainlyBelow(length + Tolerance() * length, Needed())) return true;
    Real size;
    for (const RealVector& point : core_) size = max(size, Dot(point, point));
    for (const RealVector& offset : offsets_) size = max(size, Dot(offset, offset));
    for (const Place& place : sweep_.places())
      for (const RealVector& g : place.generators) size = max(size, Dot(g, g));
    return Precision::bits() > 4 * 1074 && CertainlyAtMost(length, Tolerance() * sqrt(size));
  }

  // Where the distance is a double, a direction that is off by its last bit cannot tell. A face's normal needs no
  // division, and what is next to nothing along an axis may be nothing.
  bool TryExactly(const Face& face) {
    const auto& corners = face.corners;
    RealVector normal;
    if (corners.size() == 2 && sweep_.dim() == 2) {
      const RealVector edge = Minus(corners[1], corners[0]);
      normal = {-edge[1], edge[0]};
    } else if (corners.size() == 3 && sweep_.dim() == 3) {
      const RealVector a = Minus(corners[1], corners[0]), b = Minus(corners[2], corners[0]);
      normal = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    }
    if (!normal.empty() && IsPositive(-Dot(normal, face.nearest))) normal = Minus(RealVector(normal.size()), normal);
    if (!normal.empty() && Try(normal)) return true;
    RealVector straight = face.nearest;
    const Real little = Tolerance() * Dot(straight, straight);
    for (Real& entry : straight)
      if (CertainlyBelow(sqr(entry), little)) entry = Real();
    return Try(straight);
  }

  // The corner of {core - sweep} with the smallest d . y. A ball and a bend have points instead of corners.
  [[nodiscard]] RealVector Lowest(const RealVector& d) const {
    const Real length = sqrt(Dot(d, d));
    std::size_t farthest = 0;
    if (offsets_.size() > 1) {
      Real reach = Support(0, d, length).middle();
      for (std::size_t i = 1; i < offsets_.size(); ++i)
        if (const Real further = Support(i, d, length).middle(); CertainlyBelow(reach, further))
          reach = further, farthest = i;
    }
    const Place& place = sweep_.places()[farthest];
    RealVector corner = Minus(*std::ranges::min_element(core_,
                                                        [&](const RealVector& a, const RealVector& b) {
                                                          return CertainlyBelow(Dot(d, a).middle(), Dot(d, b).middle());
                                                        }),
                              offsets_[farthest]);
    for (const RealVector& g : place.generators) {
      const bool plus = IsPositive(Dot(d, g).middle());
      for (std::size_t k = 0; k < corner.size(); ++k)
        if (!g[k].IsZero()) corner[k] = plus ? corner[k] - g[k] : corner[k] + g[k];
    }
    if (!place.bend.IsZero()) {
      const std::array<Real, 2> point = place.bend.Farthest(d).point;
      for (std::size_t k = 0; k < point.size(); ++k) corner[k] -= point[k];
    }
    if (const Real& ball = balls_[farthest]; !ball.IsZero() && IsPositive(length))
      for (std::size_t k = 0; k < corner.size(); ++k) corner[k] -= ball * d[k] / length;
    return Middle(corner);
  }

  // By Wolfe's algorithm: the nearest point of a simplex of corners, until no corner lies below it, or the way to it is
  // a proof: on a round set the algorithm only comes closer and closer.
  [[nodiscard]] Face NearestFace(const RealVector& start) {
    std::vector<RealVector> corners{Lowest(start)};
    RealVector weights{Real(1.0)}, nearest = corners.front();
    const Real tolerance = Tolerance(), needed = Needed().middle();
    bool is_best = false;
    for (int round = 0; round < kMostRounds; ++round) {
      const RealVector corner = Lowest(nearest);
      const Real square = Dot(nearest, nearest).middle(), gap = Dot(nearest, corner).middle();
      const bool may_prove = IsPositive(square) && CertainlyAtMost((needed * sqrt(square)).middle(), gap);
      if (may_prove && Try(nearest)) return {std::move(corners), std::move(nearest), true, true};
      const Real progress = (square - gap).middle();
      is_best = !CertainlyBelow(tolerance * square, progress);
      if (is_best) break;
      corners.push_back(corner);
      weights.push_back(Real());
      if (!Shrink(corners, weights)) break;
      RealVector point(nearest.size());
      for (std::size_t i = 0; i < corners.size(); ++i)
        for (std::size_t k = 0; k < point.size(); ++k) point[k] += weights[i] * corners[i][k];
      point = Middle(point);
      // By middles, which prove nothing: the search may go wrong, only Try says yes.
      if (!CertainlyBelow(Dot(point, point).middle(), square)) break;
      nearest = std::move(point);
    }
    return {std::move(corners), std::move(nearest), is_best};
  }

  // Where no progress of a corner counts as none: most of the bits.
  [[nodiscard]] static Real Tolerance() {
    Real tolerance(1.0);
    for (int bit = 0; bit < Precision::bits() * 3 / 4; ++bit) tolerance = tolerance * Real(0.5);
    return tolerance;
  }

  // Moves the weights to the affine minimum and drops every corner whose weight becomes zero on the way. False if the
  // corners are dependent.
  static bool Shrink(std::vector<RealVector>& corners, RealVector& weights) {
    while (corners.size() > 1) {
      const RealVector target = AffineMinimum(corners);
      if (target.empty()) return false;
      Real step(1.0);
      std::size_t leaves = corners.size();
      for (std::size_t i = 0; i < corners.size(); ++i) {
        if (IsPositive(target[i])) continue;
        const Real way = weights[i] - target[i];
        const Real fraction = IsPositive(way) ? (weights[i] / way).middle() : Real();
        if (leaves == corners.size() || CertainlyBelow(fraction, step)) step = fraction, leaves = i;
      }
      for (std::size_t i = 0; i < corners.size(); ++i)
        weights[i] = (weights[i] + step * (target[i] - weights[i])).middle();
      if (leaves == corners.size()) return true;
      corners.erase(corners.begin() + static_cast<std::ptrdiff_t>(leaves));
      weights.erase(weights.begin() + static_cast<std::ptrdiff_t>(leaves));
    }
    weights = {Real(1.0)};
    return true;
  }

  const Sweep& sweep_;
  const Core& obstacle_;
  const double clearance_;
  Real kept_;                        // the radii and the smallest ball: the distance to be kept besides the clearance
  std::vector<RealVector> offsets_;  // the centers of the places, relative to the first's, seen from the obstacle
  RealVector balls_;                 // of the places, less the smallest
  std::vector<RealVector> core_;     // relative to the first place's center
  std::optional<Real> best_;
  bool undecided_ = false;
};

using Rings = std::vector<std::vector<Eigen::Vector2d>>;

// Whether rings go an odd number of times around a point: so many sides are met by the ray to its right.
Answer IsAround(const Rings& rings, const RealVector& p) {
  bool is_odd = false;
  for (const auto& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
      const Answer below_a = IsBelow(p[1], a.y()), below_b = IsBelow(p[1], b.y());
      if (below_a == Answer::kUnknown || below_b == Answer::kUnknown) return Answer::kUnknown;
      if (below_a == below_b) continue;
      const Real turn = (Real(b.x()) - a.x()) * (p[1] - a.y()) - (Real(b.y()) - a.y()) * (p[0] - a.x());
      const Answer is_left = IsBelow(0.0, turn), is_right = IsBelow(turn, 0.0);
      if (is_left == Answer::kUnknown || is_right == Answer::kUnknown) return Answer::kUnknown;
      if (is_left == is_right) return Answer::kNo;  // on the side
      if (is_left == below_b) is_odd = !is_odd;
    }
  return is_odd ? Answer::kYes : Answer::kNo;
}

Answer IsClearOf(const Core& core, const Sweep& sweep, double clearance, Real& best, const Passage& passage) {
  best = DistanceAlongAnAxis(sweep, core, passage);
  // Most obstacles are far away; this needs no search, and proves as much.
  if (CertainlyBelow(clearance, best)) return Answer::kYes;
  SeparationSearch search(sweep, core, clearance, passage);
  const bool proven = search.Run();
  best = search.best() ? *search.best() : Real(-std::numeric_limits<double>::infinity());
  if (proven) return Answer::kYes;
  return search.undecided() ? Answer::kUnknown : Answer::kNo;
}

Answer IsClearOf(const Core& core, std::span<const Sweep> sweeps, double clearance, Real& best,
                 const Passage& passage) {
  Answer answer = sweeps.empty() ? Answer::kUnknown : Answer::kNo;
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    Real found;
    const Answer of_this = IsClearOf(core, sweeps[i], clearance, found, passage);
    best = i == 0 ? found : max(best, found);
    if (of_this == Answer::kYes) return of_this;
    if (of_this == Answer::kUnknown) answer = of_this;
  }
  return answer;
}

// Cell by cell: halves of the map, of the halves and so on, until a half is clear along an axis, or has no cell that is
// occupied. It reads the map alone, not what the certifier made of it.
class GridSearch {
 public:
  GridSearch(const GridMap& map, std::span<const Sweep> sweeps, double clearance)
      : map_(map), sweeps_(sweeps), clearance_(clearance) {
    const Real cosine = cos(Real(map.yaw)), sine = sin(Real(map.yaw));
    axes_ = {RealVector{cosine, sine}, RealVector{-sine, cosine}};
  }

  Answer Run(Real& best) {
    LookAt({0, 0, map_.width, map_.height});
    for (std::size_t k = 0; k < 2 && !map_.outside_is_free; ++k) {
      const RealVector &axis = axes_[k], opposite = Minus(RealVector(2), axis);
      const Real begin = Dot(axis, {map_.origin[0], map_.origin[1]});
      const Real end = begin + Real(map_.resolution) * Real(k == 0 ? map_.width : map_.height);
      Consider({{}, axis, end, Real()});
      Consider({{}, opposite, -begin, Real()});
    }
    best = best_;
    return answer_;
  }

 private:
  struct Cells {
    int column, row, width, height;
  };

  [[nodiscard]] Core CoreOf(const Cells& cells) const {
    Core core;
    for (const int right : {0, cells.width})
      for (const int high : {0, cells.height}) {
        const Real u = Real(map_.resolution) * Real(cells.column + right),
                   v = Real(map_.resolution) * Real(cells.row + high);
        RealVector& point = core.points.emplace_back();
        for (std::size_t k = 0; k < 2; ++k) point.push_back(Real(map_.origin[k]) + axes_[0][k] * u + axes_[1][k] * v);
      }
    return core;
  }

  void LookAt(const Cells& cells) {
    if (answer_ == Answer::kNo) return;
    const auto& [column, row, width, height] = cells;
    const bool is_cell = width == 1 && height == 1;
    const Core core = CoreOf(cells);
    if (!is_cell)
      for (const Sweep& sweep : sweeps_)
        if (const Real found = DistanceAlongAnAxis(sweep, core, {}); CertainlyBelow(clearance_, found)) {
          best_ = min(best_, found);
          return;
        }
    bool is_free = true;
    for (int j = row; j < row + height && is_free; ++j)
      for (int i = column; i < column + width && is_free; ++i) is_free = !map_.IsOccupied(i, j);
    if (is_free) return;
    if (is_cell) return Consider(core);
    if (width > height) {
      LookAt({column, row, width / 2, height});
      LookAt({column + width / 2, row, width - width / 2, height});
    } else {
      LookAt({column, row, width, height / 2});
      LookAt({column, row + height / 2, width, height - height / 2});
    }
  }

  void Consider(const Core& core) {
    Real found;
    const Answer answer = IsClearOf(core, sweeps_, clearance_, found, {});
    best_ = min(best_, found);
    // No outweighs unknown, and unknown yes.
    if (answer == Answer::kNo || answer_ == Answer::kYes) answer_ = answer;
  }

  const GridMap& map_;
  const std::span<const Sweep> sweeps_;
  const double clearance_;
  std::array<RealVector, 2> axes_;  // of the map
  Real best_{std::numeric_limits<double>::infinity()};
  Answer answer_ = Answer::kYes;
};

}  // namespace

Answer IsClear(std::span<const Sweep> sweeps, const Obstacle& obstacle, double clearance, Real& best,
               const Passage& passage) {
  if (obstacle.grid()) return GridSearch(MapOf(obstacle), sweeps, clearance).Run(best);
  return IsClearOf(CoreOf(obstacle), sweeps, clearance, best, passage);
}

Answer IsWithin(std::span<const Sweep> sweeps, const Rings& rings, Real& margin) {
  margin = 0.0;
  if (sweeps.empty()) return Answer::kUnknown;
  // Taylor's series starts at the slice's center, which it maps to place.center: the part sweeps that point.
  const Place& place = sweeps[sweeps.size() / 2].places().front();
  // One point inside, and no contact with a side: what is connected cannot be on both sides of a closed ring.
  if (const Answer inside = IsAround(rings, place.center); inside != Answer::kYes) return inside;
  margin = std::numeric_limits<double>::infinity();
  for (const auto& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
      Real best;
      const Answer clear = IsClear(sweeps, Obstacle::Polygon({a, b, b}), 0, best);
      margin = min(margin, best);
      if (clear != Answer::kYes) return clear;
    }
  return Answer::kYes;
}

}  // namespace forereach::verifier
