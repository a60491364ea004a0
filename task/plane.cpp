#include "task/plane.h"

#include <gmpxx.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

int ExactTurn(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
  const mpq_class ax(a.x), ay(a.y);
  const mpq_class left = (mpq_class(b.x) - ax) * (mpq_class(c.y) - ay);
  const mpq_class right = (mpq_class(b.y) - ay) * (mpq_class(c.x) - ax);
  return cmp(left, right) > 0 ? 1 : cmp(left, right) < 0 ? -1 : 0;
}

// Whether c, on the line through a and b, lies on the segment.
bool IsBetween(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
  return std::min(a.x, b.x) <= c.x && c.x <= std::max(a.x, b.x) && std::min(a.y, b.y) <= c.y &&
         c.y <= std::max(a.y, b.y);
}

// Where c, on the line through a and b, lies on it: 0 at a, 1 at b.
mpq_class ShareOf(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
  if (a.x != b.x) return (mpq_class(c.x) - mpq_class(a.x)) / (mpq_class(b.x) - mpq_class(a.x));
  return (mpq_class(c.y) - mpq_class(a.y)) / (mpq_class(b.y) - mpq_class(a.y));
}

// The same of the point where the line through c and d, which is not parallel, crosses it.
mpq_class ShareAt(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c, const PlanePoint& d) {
  const mpq_class ax(a.x), ay(a.y), x = mpq_class(d.x) - mpq_class(c.x), y = mpq_class(d.y) - mpq_class(c.y);
  return ((mpq_class(c.x) - ax) * y - (mpq_class(c.y) - ay) * x) /
         ((mpq_class(b.x) - ax) * y - (mpq_class(b.y) - ay) * x);
}

// Whether the point at this share of the segment from a to b is strictly inside the ring.
bool IsInside(const PlanePoint& a, const PlanePoint& b, const mpq_class& share, const Ring& ring) {
  const mpq_class ax(a.x), ay(a.y), x = ax + share * (mpq_class(b.x) - ax), y = ay + share * (mpq_class(b.y) - ay);
  bool is_inside = false;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const PlanePoint &c = ring[i], &d = ring[(i + 1) % ring.size()];
    if (std::min(c.y, d.y) > y || std::max(c.y, d.y) < y) continue;
    const mpq_class cx(c.x), cy(c.y), dx(d.x), dy(d.y);
    const mpq_class turn = (dx - cx) * (y - cy) - (dy - cy) * (x - cx);
    if (turn == 0 && std::min(c.x, d.x) <= x && std::max(c.x, d.x) >= x) return false;
    // A ray from the point to the right.
    if ((cy > y) != (dy > y) && (turn > 0) == (dy > cy)) is_inside = !is_inside;
  }
  return is_inside;
}

[[noreturn]] void Refuse(const std::string& what) { throw NoPolygon(what); }

// ---- Whether rings are an area

Ring WithoutRepetitions(const Ring& ring) {
  Ring corners;
  for (const PlanePoint& corner : ring)
    if (corners.empty() || !(corner == corners.back())) corners.push_back(corner);
  while (corners.size() > 1 && corners.front() == corners.back()) corners.pop_back();
  if (corners.size() < 3) Refuse(fmt::format("a ring with {} different corners has no area", corners.size()));
  return corners;
}

struct Side {
  PlanePoint a, b;
  std::size_t ring, place;  // it begins at this corner of this ring
};

std::vector<Side> SidesOf(const std::vector<Ring>& rings) {
  std::vector<Side> sides;
  for (std::size_t r = 0; r < rings.size(); ++r)
    for (std::size_t i = 0; i < rings[r].size(); ++i)
      sides.push_back({rings[r][i], rings[r][(i + 1) % rings[r].size()], r, i});
  return sides;
}

// Sides that follow each other share a corner; otherwise no two may have a point in common.
bool MayMeet(const Side& s, const Side& t, const std::vector<Ring>& rings) {
  if (s.ring != t.ring) return !Meet(s.a, s.b, t.a, t.b);
  const std::size_t n = rings[s.ring].size();
  const bool s_first = (s.place + 1) % n == t.place, t_first = (t.place + 1) % n == s.place;
  if (!s_first && !t_first) return !Meet(s.a, s.b, t.a, t.b);
  const Side &first = s_first ? s : t, &second = s_first ? t : s;
  return Turn(first.a, first.b, second.b) != 0 ||
         !(IsBetween(first.a, first.b, second.b) || IsBetween(second.a, second.b, first.a));
}

// A sweep along x.
void RequireApart(const std::vector<Ring>& rings) {
  std::vector<Side> sides = SidesOf(rings);
  const auto left = [](const Side& side) { return std::min(side.a.x, side.b.x); };
  const auto right = [](const Side& side) { return std::max(side.a.x, side.b.x); };
  std::ranges::sort(sides, {}, left);
  for (std::size_t i = 0; i < sides.size(); ++i)
    for (std::size_t j = i + 1; j < sides.size() && left(sides[j]) <= right(sides[i]); ++j)
      if (!MayMeet(sides[i], sides[j], rings))
        Refuse(fmt::format("the side from {} to {} meets the side from {} to {}", ToText(sides[i].a),
                           ToText(sides[i].b), ToText(sides[j].a), ToText(sides[j].b)));
}

// Of a ring whose sides do not meet, by its lowest corner.
bool IsCounterClockwise(const Ring& ring) {
  const auto lowest = std::ranges::min_element(ring, [](const auto& a, const auto& b) { return a < b; });
  const auto i = static_cast<std::size_t>(lowest - ring.begin());
  return Turn(ring[(i + ring.size() - 1) % ring.size()], *lowest, ring[(i + 1) % ring.size()]) > 0;
}

// ---- Holes are joined with the outer ring by a bridge that is walked twice

struct Bridge {
  PlanePoint from, to;

  // Whether a side stands in its way. Sides may begin at its ends.
  [[nodiscard]] bool IsBlockedBy(const Side& side) const {
    const auto is_end = [&](const PlanePoint& p) { return p == from || p == to; };
    if (!is_end(side.a) && !is_end(side.b)) return Meet(from, to, side.a, side.b);
    const PlanePoint& shared = is_end(side.a) ? side.a : side.b;
    const PlanePoint& other = is_end(side.a) ? side.b : side.a;
    if (is_end(other)) return true;
    const PlanePoint& far = shared == from ? to : from;
    return Turn(from, to, other) == 0 && (IsBetween(from, to, other) || IsBetween(shared, other, far));
  }
};

// Whether the way from corner i of a counter-clockwise ring to a point begins inside.
bool BeginsInside(const Ring& ring, std::size_t i, const PlanePoint& to) {
  const PlanePoint &at = ring[i], &before = ring[(i + ring.size() - 1) % ring.size()],
                   &next = ring[(i + 1) % ring.size()];
  const bool left_of_first = Turn(before, at, to) > 0, left_of_second = Turn(at, next, to) > 0;
  return Turn(before, at, next) > 0 ? left_of_first && left_of_second : left_of_first || left_of_second;
}

double SquaredDistance(const PlanePoint& a, const PlanePoint& b) {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

// The nearest corner of the ring that sees the point.
std::optional<std::size_t> Seen(const Ring& ring, const PlanePoint& from, const std::vector<Side>& sides) {
  std::vector<std::size_t> order(ring.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return SquaredDistance(ring[i], from); });
  const auto sees = [&](std::size_t i) {
    const Bridge bridge{from, ring[i]};
    return BeginsInside(ring, i, from) &&
           std::ranges::none_of(sides, [&](const Side& side) { return bridge.IsBlockedBy(side); });
  };
  const auto found = std::ranges::find_if(order, sees);
  return found == order.end() ? std::nullopt : std::optional(*found);
}

// The hole that reaches furthest to the right sees the outer ring from there, so holes are joined from the right.
Ring Bridged(std::vector<Ring> rings) {
  std::vector<Side> sides = SidesOf(rings);
  const auto rightmost = [](const Ring& ring) {
    return std::ranges::max_element(ring, [](const auto& a, const auto& b) { return a < b; });
  };
  Ring joined = std::move(rings.front());
  rings.erase(rings.begin());
  std::ranges::sort(rings, [&](const Ring& a, const Ring& b) { return *rightmost(b) < *rightmost(a); });
  for (Ring& hole : rings) {
    std::rotate(hole.begin(), hole.begin() + (rightmost(hole) - hole.cbegin()), hole.end());
    const auto at = Seen(joined, hole.front(), sides);
    if (!at) Refuse(fmt::format("the hole at {} is not inside", ToText(hole.front())));
    hole.push_back(hole.front());
    hole.push_back(joined[*at]);
    sides.push_back({hole.front(), joined[*at], 0, 0});
    joined.insert(joined.begin() + static_cast<std::ptrdiff_t>(*at) + 1, hole.begin(), hole.end());
  }
  return joined;
}

// ---- Ears

// Whether the corners i - 1, i, i + 1 are a triangle with nothing of the ring in it.
bool IsEar(const Ring& ring, std::size_t i) {
  const PlanePoint &a = ring[(i + ring.size() - 1) % ring.size()], &b = ring[i], &c = ring[(i + 1) % ring.size()];
  if (Turn(a, b, c) <= 0) return false;
  const double left = std::min({a.x, b.x, c.x}), right = std::max({a.x, b.x, c.x});
  const double low = std::min({a.y, b.y, c.y}), high = std::max({a.y, b.y, c.y});
  return std::ranges::none_of(ring, [&](const PlanePoint& p) {
    return left <= p.x && p.x <= right && low <= p.y && p.y <= high && !(p == a) && !(p == b) && !(p == c) &&
           Turn(a, b, p) >= 0 && Turn(b, c, p) >= 0 && Turn(c, a, p) >= 0;
  });
}

// A corner whose removal takes nothing away.
bool IsFlat(const Ring& ring, std::size_t i) {
  return Turn(ring[(i + ring.size() - 1) % ring.size()], ring[i], ring[(i + 1) % ring.size()]) == 0;
}

std::vector<Ring> Triangles(Ring ring) {
  std::vector<Ring> triangles;
  for (std::size_t i = 0, tried = 0; ring.size() >= 3;) {
    i %= ring.size();
    const bool is_ear = IsEar(ring, i);
    if (is_ear) triangles.push_back({ring[(i + ring.size() - 1) % ring.size()], ring[i], ring[(i + 1) % ring.size()]});
    // A ring has an ear, unless flat corners are in the way: after a turn without one, these go. A turn more, and it is
    // no area.
    if (is_ear || (tried >= ring.size() && IsFlat(ring, i))) {
      ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(i));
      tried = 0;
      ++i;  // not always at the same corner, from which a fan of slivers would come
    } else {
      if (++tried > 2 * ring.size()) Refuse(fmt::format("its rings do not bound an area, near {}", ToText(ring[i])));
      ++i;
    }
  }
  return triangles;
}

// ---- Convex pieces

using Ends = std::pair<PlanePoint, PlanePoint>;

// Joins pieces over the sides that they share.
class Joiner {
 public:
  Joiner(std::vector<Ring> pieces, int most_corners) : pieces_(std::move(pieces)), most_(ToSize(most_corners)) {
    for (std::size_t i = 0; i < pieces_.size(); ++i) Own(i);
  }

  std::vector<Ring> Join() {
    std::vector<Ends> sides;
    for (const auto& [side, owner] : owners_)
      if (side.first < side.second) sides.push_back(side);
    for (const Ends& side : sides) JoinOver(side);
    std::erase_if(pieces_, [](const Ring& piece) { return piece.empty(); });
    for (Ring& piece : pieces_) piece = ConvexHull(std::move(piece));
    return std::move(pieces_);
  }

 private:
  void Own(std::size_t i) {
    const Ring& piece = pieces_[i];
    for (std::size_t k = 0; k < piece.size(); ++k) owners_[{piece[k], piece[(k + 1) % piece.size()]}] = i;
  }

  void JoinOver(const Ends& side) {
    const auto one = owners_.find(side), two = owners_.find({side.second, side.first});
    if (one == owners_.end() || two == owners_.end() || one->second == two->second) return;
    const std::size_t i = one->second, j = two->second;
    if (pieces_[i].size() + pieces_[j].size() - 2 > most_) return;
    // From the end of the side around each piece to its beginning.
    Ring a = pieces_[i], b = pieces_[j];
    std::rotate(a.begin(), std::ranges::find(a, side.second), a.end());
    std::rotate(b.begin(), std::ranges::find(b, side.first), b.end());
    if (Turn(a[a.size() - 2], a.back(), b[1]) < 0 || Turn(b[b.size() - 2], b.back(), a[1]) < 0) return;
    a.insert(a.end(), b.begin() + 1, b.end() - 1);
    owners_.erase(one);
    owners_.erase(two);
    pieces_[i] = std::move(a);
    pieces_[j].clear();
    Own(i);
  }

  std::vector<Ring> pieces_;
  const std::size_t most_;
  std::map<Ends, std::size_t> owners_;
};

}  // namespace

int Turn(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
  // A bound on the rounding errors, from J. R. Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust
  // Geometric Predicates", 1997. The last term is for products that underflow.
  constexpr double kRelative = (3 + 16 * kUnitRoundoff) * kUnitRoundoff, kUnderflow = 0x1p-1000;
  const double left = (b.x - a.x) * (c.y - a.y), right = (b.y - a.y) * (c.x - a.x), determinant = left - right;
  const double error = kRelative * (std::abs(left) + std::abs(right)) + kUnderflow;
  if (determinant > error) return 1;
  if (determinant < -error) return -1;
  return ExactTurn(a, b, c);
}

Ring ConvexHull(std::vector<PlanePoint> points) {
  std::ranges::sort(points, [](const auto& a, const auto& b) { return a < b; });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  Ring hull;
  const auto walk = [&hull](auto begin, auto end) {
    const std::size_t base = hull.size();
    for (auto p = begin; p != end; ++p) {
      while (hull.size() >= base + 2 && Turn(hull[hull.size() - 2], hull.back(), *p) <= 0) hull.pop_back();
      hull.push_back(*p);
    }
    hull.pop_back();  // where the other half begins
  };
  walk(points.begin(), points.end());
  walk(points.rbegin(), points.rend());
  return hull;
}

Ring Grown(const std::vector<PlanePoint>& points, double margin) {
  if (margin == 0) return ConvexHull(points);
  std::vector<PlanePoint> corners;
  for (const auto& [x, y] : points)
    for (const double to_x : {SubDown(x, margin), AddUp(x, margin)})
      for (const double to_y : {SubDown(y, margin), AddUp(y, margin)}) corners.push_back({to_x, to_y});
  return ConvexHull(std::move(corners));
}

std::vector<Ring> ConvexPieces(const Area& area, int most_corners) {
  std::size_t corners = area.outer.size();
  for (const Ring& hole : area.holes) corners += hole.size();
  if (corners > kMaxAreaCorners) Refuse(fmt::format("{} corners, at most {} are taken", corners, kMaxAreaCorners));
  std::vector<Ring> rings{WithoutRepetitions(area.outer)};
  for (const Ring& hole : area.holes) rings.push_back(WithoutRepetitions(hole));
  RequireApart(rings);
  for (std::size_t r = 0; r < rings.size(); ++r)
    if (IsCounterClockwise(rings[r]) != (r == 0)) std::ranges::reverse(rings[r]);
  return Joiner(Triangles(Bridged(std::move(rings))), most_corners).Join();
}

bool Meet(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c, const PlanePoint& d) {
  if (std::max(a.x, b.x) < std::min(c.x, d.x) || std::max(c.x, d.x) < std::min(a.x, b.x) ||
      std::max(a.y, b.y) < std::min(c.y, d.y) || std::max(c.y, d.y) < std::min(a.y, b.y))
    return false;
  const int at_c = Turn(a, b, c), at_d = Turn(a, b, d), at_a = Turn(c, d, a), at_b = Turn(c, d, b);
  if (at_c * at_d < 0 && at_a * at_b < 0) return true;
  return (at_c == 0 && IsBetween(a, b, c)) || (at_d == 0 && IsBetween(a, b, d)) || (at_a == 0 && IsBetween(c, d, a)) ||
         (at_b == 0 && IsBetween(c, d, b));
}

std::vector<std::pair<double, double>> SharesOutside(const PlanePoint& a, const PlanePoint& b,
                                                     const std::vector<const Ring*>& rings) {
  std::vector<std::pair<mpq_class, mpq_class>> inside;
  for (const Ring* const ring : rings) {
    // Between two cuts the segment does not meet the ring, or it lies along a side: its middle tells for all of it.
    std::vector<mpq_class> cuts{0, 1};
    for (std::size_t i = 0; i < ring->size() && cuts.size() <= kMostCuts; ++i) {
      const PlanePoint &c = (*ring)[i], &d = (*ring)[(i + 1) % ring->size()];
      const int at_c = Turn(a, b, c);
      if (at_c != 0 && at_c * Turn(a, b, d) >= 0) continue;
      mpq_class share = at_c == 0 ? ShareOf(a, b, c) : ShareAt(a, b, c, d);
      if (share > 0 && share < 1) cuts.push_back(std::move(share));
    }
    if (cuts.size() > kMostCuts) continue;
    std::sort(cuts.begin(), cuts.end());
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i)
      if (cuts[i] < cuts[i + 1] && IsInside(a, b, (cuts[i] + cuts[i + 1]) / 2, *ring))
        inside.emplace_back(cuts[i], cuts[i + 1]);
  }
  std::sort(inside.begin(), inside.end(), [](const auto& p, const auto& q) { return p.first < q.first; });
  std::vector<std::pair<double, double>> outside;
  mpq_class end = 0;
  inside.emplace_back(1, 1);
  for (const auto& [from, until] : inside) {
    // get_d rounds towards zero.
    if (end < from) outside.emplace_back(end.get_d(), from == from.get_d() ? from.get_d() : NextUp(from.get_d()));
    if (end < until) end = until;
  }
  return outside;
}

std::string ToText(const PlanePoint& point) { return fmt::format("({}, {})", ToText(point.x), ToText(point.y)); }

}  // namespace forereach
