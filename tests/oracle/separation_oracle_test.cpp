// Separation against exact geometry: never proven where slice and obstacle touch, always where they are apart.
#include "forereach/safety/separation.h"

#include "tests/test.h"

#include "forereach/safety/projection.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::separation_oracle_test {

Separation SeparateByHulls(const Zonotope& slice, const Obstacle& obstacle) {
  Hull hull{};
  for (int k = 0; k < slice.dim(); ++k) {
    hull.center[static_cast<std::size_t>(k)] = slice.center(k);
    hull.half_width[static_cast<std::size_t>(k)] = slice.HalfWidthUpper(k);
  }
  return SeparateHulls(hull, obstacle);
}

struct Point {
  Rational x, y;
};

Rational Cross(const Point& o, const Point& a, const Point& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

// Andrew's monotone chain: corners only, counter-clockwise.
std::vector<Point> Hull(std::vector<Point> points) {
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  const auto chain = [](auto first, auto last) {
    std::vector<Point> half;
    for (; first != last; ++first) {
      while (half.size() >= 2 && Cross(half[half.size() - 2], half.back(), *first) <= 0) half.pop_back();
      half.push_back(*first);
    }
    half.pop_back();
    return half;
  };
  const Point only = points.front();
  std::vector<Point> hull = chain(points.begin(), points.end()), back = chain(points.rbegin(), points.rend());
  hull.insert(hull.end(), back.begin(), back.end());
  return hull.empty() ? std::vector<Point>{only} : hull;
}

Rational SquaredDistanceToSegment(const Point& a, const Point& b) {
  const Rational dx = b.x - a.x, dy = b.y - a.y, length = dx * dx + dy * dy;
  Rational t = length == 0 ? Rational(0) : Rational(-(a.x * dx + a.y * dy) / length);
  t = std::min(std::max(t, Rational(0)), Rational(1));
  const Rational x = a.x + t * dx, y = a.y + t * dy;
  return x * x + y * y;
}

// The squared distance between slice and core, 0 where they meet: that of the origin from {core - slice}.
Rational SquaredDistance(const Zonotope& slice, const Obstacle& obstacle) {
  std::vector<Point> corners;
  for (const Eigen::Vector3d& w : obstacle.hull())
    corners.push_back({Rational(w.x()) - Rational(slice.center(0)), Rational(w.y()) - Rational(slice.center(1))});
  corners = Hull(corners);
  for (int j = 0; j < slice.num_generators(); ++j) {
    const Rational gx(slice.generator(0, j)), gy(slice.generator(1, j));
    std::vector<Point> moved;
    for (const Point& corner : corners) {
      moved.push_back({corner.x + gx, corner.y + gy});
      moved.push_back({corner.x - gx, corner.y - gy});
    }
    corners = Hull(moved);
  }
  bool inside = corners.size() >= 3;
  Rational nearest = corners[0].x * corners[0].x + corners[0].y * corners[0].y;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Point &a = corners[i], &b = corners[(i + 1) % corners.size()];
    inside = inside && Cross(a, b, {0, 0}) >= 0;
    nearest = std::min(nearest, SquaredDistanceToSegment(a, b));
  }
  return inside ? Rational(0) : nearest;
}

void ExpectSoundAndExact(const Zonotope& slice, const Obstacle& obstacle) {
  const Rational square = SquaredDistance(slice, obstacle), radius(obstacle.radius());
  const Separation best = Separate(slice, obstacle), quick = SeparateByHulls(slice, obstacle);
  ASSERT_EQ(best.threshold, obstacle.radius());
  for (const Separation& s : {best, quick}) {
    if (s.distance > 0) ASSERT_LE(Rational(s.distance) * Rational(s.distance), square);
    if (s.IsProven()) {
      ASSERT_GT(square, radius * radius);
      ASSERT_LE(s.clearance(), s.distance - s.threshold);
    }
  }
  ASSERT_LE(quick.distance, best.distance + 1e-12 * (1 + std::abs(best.distance)));
  if (square > Rational(1e-20)) {
    const Rational at_least = Rational(best.distance) * Rational(1 + 1e-9) + Rational(1e-12);
    ASSERT_GE(at_least * at_least, square) << "distance " << best.distance << ", exact " << std::sqrt(square.get_d());
  }
}

Zonotope AnySlice(Random& random) {
  const int m = random.Integer(0, 8);
  Eigen::MatrixXd generators = random.Matrix(2, m, 0.5);
  for (int j = 0; j < m; ++j) {
    switch (random.Below(7)) {
      case 0: generators.col(j) *= 1e-17; break;
      case 1: generators.col(j) *= 1e-300; break;
      case 2:
        if (j > 0) generators.col(j) = generators.col(j - 1) * random.Uniform(-2, 2);
        break;
      case 3: generators(random.Below(2), j) = 0; break;
      case 4:
        if (j > 0) generators.col(j) = generators.col(j - 1) + 1e-16 * random.Vector(2);
        break;
      default: break;
    }
  }
  return Zonotope(random.Vector(2, 3), generators);
}

Obstacle AnyPlanarObstacle(Random& random) {
  const Eigen::VectorXd center = random.Vector(2, 4);
  switch (random.Below(4)) {
    case 0: return Obstacle::Circle(center, random.Coin(0.2) ? 0 : random.Uniform(0, 2));
    case 1: return Obstacle::AxisBox(center, center + random.Vector(2, 2).cwiseAbs() * (random.Coin(0.1) ? 0 : 1));
    case 2: {  // with edges of rounding length, and repeated corners
      std::vector<Eigen::VectorXd> corners;
      for (int i = random.Integer(3, 8); i > 0; --i)
        corners.push_back(!corners.empty() && random.Coin(0.3)
                              ? Eigen::VectorXd(corners.back() + random.Vector(2, 1e-16))
                              : Eigen::VectorXd(center + random.Vector(2)));
      return Obstacle::Polygon(corners);
    }
    default: {  // a segment
      return Obstacle::Polygon({center, center + random.Vector(2), center});
    }
  }
}

TEST(PlanarSeparation, IsTheExactDistanceFromBelow) {
  for (TracedRandom random(701); random.Again(3000);) {
    ExpectSoundAndExact(AnySlice(random), AnyPlanarObstacle(random));
    ASSERT_FALSE(HasFatalFailure()) << "trial " << random.trial();
  }
}

// A slice's slack is as much a part of it as its generators, whichever way its distance is found.
TEST(PlanarSeparation, CountsTheSlack) {
  int proven = 0;
  for (TracedRandom random(709); random.Again(2000);) {
    Zonotope slice = AnySlice(random);
    for (int k = 0; k < 2; ++k)
      if (random.Coin(0.8)) ArraysOf(slice).mutable_slack(k) = std::ldexp(random.Uniform(1, 2), -random.Integer(1, 30));
    const Zonotope same(slice.CenterVector(), slice.GeneratorMatrix());
    const Obstacle obstacle = AnyPlanarObstacle(random);
    const Rational square = SquaredDistance(same, obstacle);
    for (const Separation& s : {Separate(slice, obstacle), SeparateByHulls(slice, obstacle)}) {
      if (!(s.distance > 0)) continue;
      ASSERT_LE(Rational(s.distance) * Rational(s.distance), square) << "trial " << random.trial();
      ++proven;
    }
  }
  EXPECT_GT(proven, 1000);
}

TEST(PlanarSeparation, HoldsFarFromTheOriginAndAtEveryScale) {
  int proven = 0;
  for (TracedRandom random(702); random.Again(1500);) {
    const double scale = std::ldexp(1, random.Integer(-460, 460)), away = random.Coin() ? scale : scale * 1e8;
    const Zonotope slice(random.Vector(2, away), random.Matrix(2, random.Integer(0, 6), scale));
    const Eigen::VectorXd center = slice.CenterVector() + random.Vector(2, 8 * scale);
    const Obstacle obstacle = random.Coin() ? Obstacle::Circle(center, random.Uniform(0, scale))
                                            : Obstacle::AxisBox(center, center + random.Vector(2, scale).cwiseAbs());
    const Rational square = SquaredDistance(slice, obstacle), radius(obstacle.radius());
    for (const Separation& s : {Separate(slice, obstacle), SeparateByHulls(slice, obstacle)}) {
      if (s.distance > 0) ASSERT_LE(Rational(s.distance) * Rational(s.distance), square);
      if (s.IsProven()) ASSERT_GT(square, radius * radius);
      proven += s.IsProven();
    }
  }
  EXPECT_GT(proven, 500);
}

TEST(PlanarSeparation, AnyDoublesAreNeverWronglyProven) {
  for (TracedRandom random(703); random.Again(1500);) {
    const auto any = [&] { return random.Double(); };
    const Zonotope slice(Eigen::VectorXd::NullaryExpr(2, any),
                         Eigen::MatrixXd::NullaryExpr(2, random.Integer(0, 3), any));
    const Eigen::VectorXd point = Eigen::VectorXd::NullaryExpr(2, any);
    const Obstacle obstacle =
        random.Coin() ? Obstacle::Circle(point, std::abs(random.Double())) : Obstacle::AxisBox(point, point);
    for (const Separation& s : {Separate(slice, obstacle), SeparateByHulls(slice, obstacle)}) {
      if (!s.IsProven()) continue;
      ASSERT_LE(Rational(s.distance) * Rational(s.distance), SquaredDistance(slice, obstacle));
    }
  }
}

// Whole numbers, so that touching is exact: the slice's support along d meets the obstacle there.
TEST(PlanarSeparation, TouchingIsNeverProvenAndAGapAlwaysIs) {
  constexpr std::array<std::array<int, 3>, 4> triples{{{3, 4, 5}, {5, 12, 13}, {8, 15, 17}, {1, 0, 1}}};
  for (TracedRandom random(704); random.Again(2000);) {
    const int m = random.Integer(0, 6);
    const Eigen::MatrixXd generators = Eigen::MatrixXd::NullaryExpr(2, m, [&] { return random.Integer(-5, 5); });
    const Zonotope slice(Eigen::Vector2d(random.Integer(-20, 20), random.Integer(-20, 20)), generators);
    const auto& [a, b, length] = triples[static_cast<std::size_t>(random.Below(4))];
    const Eigen::Vector2d d(random.Sign() * a, random.Sign() * b);
    // The corner that d supports; beyond it, along d, an obstacle at a distance of whole lengths.
    Eigen::Vector2d corner = slice.CenterVector();
    for (int j = 0; j < m; ++j) corner += (d.dot(generators.col(j)) < 0 ? -1 : 1) * generators.col(j);
    const int steps = random.Integer(1, 3);
    const double radius = steps * length;
    const auto circle = [&](double r) { return Separate(slice, Obstacle::Circle(corner + steps * d, r)); };
    ASSERT_FALSE(circle(radius).IsProven()) << "touching";
    ASSERT_FALSE(circle(NextUp(radius)).IsProven());
    ASSERT_TRUE(circle(radius - 1e-12 * (1 + 40)).IsProven());

    const Eigen::Vector2d along(-d.y(), d.x());
    const auto triangle = [&](double gap) {
      const Eigen::Vector2d start = corner + gap * d;
      return Separate(slice, Obstacle::Polygon({start + along, start - 2 * along, start + d}));
    };
    ASSERT_FALSE(triangle(0).IsProven());
    ASSERT_TRUE(triangle(1e-11).IsProven());
  }
}

TEST(PlanarSeparation, PointsOneDoubleApartAreProven) {
  const Zonotope point(Eigen::Vector2d(1, 2), Eigen::MatrixXd(2, 0));
  const auto box = [](double left) { return Obstacle::AxisBox(Eigen::Vector2d(left, 0), Eigen::Vector2d(3, 3)); };
  EXPECT_FALSE(Separate(point, box(1)).IsProven());
  EXPECT_TRUE(Separate(point, box(NextUp(1))).IsProven());
  EXPECT_FALSE(Separate(point, Obstacle::Circle(Eigen::Vector2d(1, 2), 0)).IsProven());
  EXPECT_TRUE(Separate(point, Obstacle::Circle(Eigen::Vector2d(1, 3), NextDown(1))).IsProven());
  EXPECT_FALSE(Separate(point, Obstacle::Circle(Eigen::Vector2d(1, 3), 1)).IsProven());
}

// A corner seen along a segment has no edge whose normal points at it.
TEST(PlanarSeparation, FindsTheEndOfASegmentSeenHeadOn) {
  Eigen::MatrixXd generator(2, 1);
  for (const Eigen::Vector2d& direction :
       {Eigen::Vector2d(1, 0), Eigen::Vector2d(0.6, 0.8), Eigen::Vector2d(-1e-3, 1)}) {
    generator.col(0) = direction;
    const Zonotope slice(5 * direction, generator);
    EXPECT_NEAR(Separate(slice, Obstacle::Circle(Eigen::Vector2d::Zero(), 1)).distance, 4 * direction.norm(), 1e-12);
  }
}

// The gap between slice and box in p dimensions along the axis d, times |d|, exactly.
Rational Gap(const Zonotope& slice, const Obstacle& box, const std::array<Rational, 3>& d) {
  Rational support = 0, core_lower = 0;
  bool first = true;
  for (int k = 0; k < slice.dim(); ++k) support += d[static_cast<std::size_t>(k)] * Rational(slice.center(k));
  for (int j = 0; j < slice.num_generators(); ++j) {
    Rational along = 0;
    for (int k = 0; k < slice.dim(); ++k) along += d[static_cast<std::size_t>(k)] * Rational(slice.generator(k, j));
    support += abs(along);
  }
  for (const Eigen::Vector3d& corner : box.hull()) {
    Rational along = 0;
    for (int k = 0; k < slice.dim(); ++k) along += d[static_cast<std::size_t>(k)] * Rational(corner[k]);
    if (first || along < core_lower) core_lower = along;
    first = false;
  }
  return core_lower - support;
}

// The widest gap over all directions that can separate a zonotope from a box in space, exactly; positive iff disjoint.
double WidestSpatialGap(const Zonotope& slice, const Obstacle& box) {
  std::vector<std::array<Rational, 3>> edges;
  for (std::size_t k = 0; k < 3; ++k) {
    edges.push_back({0, 0, 0});
    edges.back()[k] = 1;
  }
  for (int j = 0; j < slice.num_generators(); ++j)
    edges.push_back(
        {Rational(slice.generator(0, j)), Rational(slice.generator(1, j)), Rational(slice.generator(2, j))});
  double widest = -kInfinity;
  for (std::size_t a = 0; a < edges.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      const auto &u = edges[a], &v = edges[b];
      std::array<Rational, 3> d{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
      const Rational square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
      if (square == 0) continue;
      for (int sign = 0; sign < 2; ++sign) {
        widest = std::max(widest, Gap(slice, box, d).get_d() / std::sqrt(square.get_d()));
        for (Rational& entry : d) entry = -entry;
      }
    }
  return widest;
}

TEST(SpatialSeparation, OfBoxesIsDecidedExactly) {
  int proven = 0, met = 0;
  for (TracedRandom random(705); random.Again(800);) {
    const int m = random.Integer(0, 6);
    const bool whole = random.Coin();
    const auto entry = [&] { return whole ? random.Integer(-3, 3) : random.Uniform(-3, 3); };
    const Zonotope slice(Eigen::VectorXd::NullaryExpr(3, entry), Eigen::MatrixXd::NullaryExpr(3, m, entry) / 2);
    const Eigen::VectorXd lower = Eigen::VectorXd::NullaryExpr(3, entry) * 2;
    const Eigen::VectorXd size = Eigen::VectorXd::NullaryExpr(3, entry).cwiseAbs();
    const Obstacle box = Obstacle::AxisBox(lower, lower + size);
    const double gap = WidestSpatialGap(slice, box);
    for (const Separation& s : {Separate(slice, box), SeparateByHulls(slice, box)}) {
      if (s.IsProven()) ASSERT_GT(gap, 0) << "proven, though they meet or touch";
    }
    if (gap > 1e-11) ASSERT_TRUE(Separate(slice, box).IsProven()) << "gap " << gap;
    proven += gap > 0;
    met += gap <= 0;
  }
  EXPECT_GT(proven, 50);
  EXPECT_GT(met, 50);
}

TEST(LineSeparation, IsDecidedAtTheLastBit) {
  for (TracedRandom random(706); random.Again(2000);) {
    const Zonotope slice(random.Vector(1), random.Matrix(1, random.Integer(0, 5)));
    const Eigen::VectorXd lower = random.Vector(1, 4), upper = lower + random.Vector(1).cwiseAbs();
    const Separation s = Separate(slice, Obstacle::AxisBox(lower, upper));
    const Rational right = Rational(slice.center(0)) + exact::HalfWidth(slice, 0),
                   left = Rational(slice.center(0)) - exact::HalfWidth(slice, 0);
    const Rational gap = std::max(Rational(Rational(lower[0]) - right), Rational(left - Rational(upper[0])));
    if (s.distance > 0) ASSERT_LE(Rational(s.distance), gap);
    if (gap > Rational(1e-12)) ASSERT_NEAR(s.distance, gap.get_d(), 1e-12);
  }
  const Zonotope point(Eigen::VectorXd::Constant(1, 2), Eigen::MatrixXd(1, 0));
  const auto from = [](double lower) {
    return Obstacle::AxisBox(Eigen::VectorXd::Constant(1, lower), Eigen::VectorXd::Constant(1, 9));
  };
  EXPECT_FALSE(Separate(point, from(2)).IsProven());
  EXPECT_TRUE(Separate(point, from(NextUp(2))).IsProven());
}

TEST(HalfSpaceSeparation, IsTheExactDistanceInEveryDimension) {
  for (TracedRandom random(707); random.Again(3000);) {
    const int p = random.Integer(1, 3);
    const double scale = std::ldexp(1, random.Integer(-30, 30));
    const Zonotope slice = random.AnyZonotope(p, random.Integer(0, 8));
    const Eigen::VectorXd normal = random.Vector(p, scale);
    const double offset = random.Uniform(-3, 6) * scale;
    const Rational gap = Rational(offset) - exact::Support(slice, View(normal));
    Rational square = 0;
    for (const double entry : normal) square += Rational(entry) * Rational(entry);
    for (const Separation& s : {Separate(slice, Obstacle::HalfSpace(normal, offset)),
                                SeparateByHulls(slice, Obstacle::HalfSpace(normal, offset))}) {
      ASSERT_EQ(s.threshold, 0);
      if (s.IsProven()) {
        ASSERT_LE(Rational(s.distance) * Rational(s.distance) * square, gap * gap);
        ASSERT_GT(gap, 0);
      }
    }
    const double distance = gap.get_d() / std::sqrt(square.get_d());
    ASSERT_NEAR(Separate(slice, Obstacle::HalfSpace(normal, offset)).distance, distance,
                1e-11 * (1 + std::abs(distance) + std::abs(offset) / scale));
  }
}

// Hulls that reach to the boundary up to a few roundings.
TEST(HalfSpaceSeparation, OfHullsNextToItIsNeverWronglyProven) {
  TracedRandom random(711);
  int proven = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const int p = random.Integer(1, 3);
    const Eigen::VectorXd normal = random.Vector(p, std::ldexp(1, random.Integer(-10, 10)));
    forereach::Hull hull{};
    Rational reach = 0, square = 0;
    for (int k = 0; k < p; ++k) {
      const auto i = static_cast<std::size_t>(k);
      hull.center[i] = random.Uniform(-1, 1) * std::ldexp(1, random.Integer(-10, 30));
      hull.half_width[i] = random.Coin() ? 0 : random.Uniform(0, 1);
      reach += Rational(normal[k]) * Rational(hull.center[i]) + abs(Rational(normal[k])) * Rational(hull.half_width[i]);
      square += Rational(normal[k]) * Rational(normal[k]);
    }
    double offset = Floor(reach);
    for (int ulps = random.Integer(-1, 20); ulps != 0; ulps -= ulps > 0 ? 1 : -1)
      offset = ulps > 0 ? NextUp(offset) : NextDown(offset);
    if (random.Coin(0.2)) offset += std::abs(offset) * 1e-12;
    const Separation s = SeparateHulls(hull, Obstacle::HalfSpace(normal, offset));
    if (!s.IsProven()) continue;
    const Rational gap = Rational(offset) - reach;
    ASSERT_GT(gap, 0) << "trial " << trial;
    ASSERT_LE(Rational(s.distance) * Rational(s.distance) * square, gap * gap) << "trial " << trial;
    ++proven;
  }
  EXPECT_GT(proven, 500);
}

// Boxes and circles a few roundings away from a hull, in one coordinate or several.
TEST(HullSeparation, NextToAnObstacleIsNeverWronglyProven) {
  TracedRandom random(712);
  const auto few = [&](double x, double sign) {  // roundings in the direction of sign
    for (int i = random.Integer(0, 20); i > 0; --i) x = sign > 0 ? NextUp(x) : NextDown(x);
    return random.Coin(0.3) ? x + sign * std::abs(x) * 1e-12 : x;
  };
  int proven = 0;
  for (int trial = 0; trial < 10000; ++trial) {
    const int p = random.Integer(1, 3);
    forereach::Hull hull{};
    Eigen::VectorXd lower(p), upper(p);
    for (int k = 0; k < p; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double center = hull.center[i] = random.Uniform(-1, 1) * std::ldexp(1, random.Integer(-10, 30));
      const double half_width = hull.half_width[i] = random.Coin() ? 0 : random.Uniform(0, 1), sign = random.Sign();
      const double side = random.Coin(0.3) ? center : few(center + sign * half_width, sign);
      const double other = side + sign * (random.Coin() ? 0 : random.Uniform(0, 1));
      lower[k] = std::min(side, other), upper[k] = std::max(side, other);
    }
    Rational square = 0;
    const bool is_circle = p == 2 && random.Coin();
    if (is_circle) upper = lower;
    for (int k = 0; k < p; ++k) {
      const Rational center(hull.center[static_cast<std::size_t>(k)]),
          half_width(hull.half_width[static_cast<std::size_t>(k)]);
      const Rational below = Rational(lower[k]) - center - half_width, above = center - half_width - Rational(upper[k]);
      const Rational gap = std::max(Rational(0), std::max(below, above));
      square += gap * gap;
    }
    const double radius = std::max(0.0, few(std::sqrt(square.get_d()), -1));
    const Separation s =
        SeparateHulls(hull, is_circle ? Obstacle::Circle(lower, radius) : Obstacle::AxisBox(lower, upper));
    if (s.distance > 0) ASSERT_LE(Rational(s.distance) * Rational(s.distance), square) << "trial " << trial;
    if (s.IsProven()) ASSERT_GT(square, Rational(s.threshold) * Rational(s.threshold)) << "trial " << trial;
    proven += s.IsProven();
  }
  EXPECT_GT(proven, 500);
}

// The normal of a generator whose squares underflow is no unit vector.
TEST(PlanarSeparation, TinyGeneratorsProveNothingWrong) {
  for (const double tiny : {1.22 * 0x1p-537, 0x1p-538, 0x1p-600, 0x1p-1074}) {
    const Zonotope slice(Eigen::Vector2d::Zero(), Eigen::Vector2d(tiny, 0));
    EXPECT_FALSE(Separate(slice, Obstacle::Circle(Eigen::Vector2d(0, 0.9), 1)).IsProven()) << tiny;
    EXPECT_TRUE(Separate(slice, Obstacle::Circle(Eigen::Vector2d(0, 1.1), 1)).IsProven()) << tiny;
  }
}

TEST(HalfSpaceSeparation, TouchingIsNotProven) {
  const Zonotope point(Eigen::Vector2d(1, 1), Eigen::MatrixXd(2, 0));
  const auto side = [](double offset) { return Obstacle::HalfSpace(Eigen::Vector2d(3, 4), offset); };
  EXPECT_FALSE(Separate(point, side(7)).IsProven());
  EXPECT_FALSE(Separate(point, side(NextDown(7))).IsProven());
  EXPECT_TRUE(Separate(point, side(NextUp(7))).IsProven());
}

// What the sums cancel their rounding does not: the hull's margin is of their terms' size.
TEST(ProjectionOracle, HullsContainTheExactProjectionWhereItCancels) {
  TracedRandom random(710);
  for (int trial = 0; trial < 5000; ++trial) {
    const int n = random.Integer(2, 6), p = random.Integer(1, 3);
    const Eigen::MatrixXd matrix = random.Matrix(p, n);
    Eigen::VectorXd center = random.Vector(n, std::ldexp(1, random.Integer(-20, 40)));
    double rest = 0;
    for (int l = 0; l + 1 < n; ++l) rest += matrix(0, l) * center[l];
    if (random.Coin(0.8) && matrix(0, n - 1) != 0) center[n - 1] = -rest / matrix(0, n - 1);
    const Zonotope slice(center, random.Coin() ? Eigen::MatrixXd(n, 0)
                                               : random.Matrix(n, random.Integer(1, 12), random.Coin() ? 1e-17 : 1));
    const std::vector<double> half_width = HalfWidths(slice);
    forereach::Hull hull;
    Projection(matrix, n).EncloseHull(slice, half_width, hull);
    for (int k = 0; k < p; ++k) {
      Rational middle = 0, reach = 0;
      for (int l = 0; l < n; ++l) {
        middle += Rational(matrix(k, l)) * Rational(center[l]);
        reach += abs(Rational(matrix(k, l))) * Rational(half_width[static_cast<std::size_t>(l)]);
      }
      const Rational found(hull.center[static_cast<std::size_t>(k)]),
          width(hull.half_width[static_cast<std::size_t>(k)]);
      ASSERT_LE(middle + reach, found + width) << "trial " << trial;
      ASSERT_GE(middle - reach, found - width) << "trial " << trial;
    }
  }
}

TEST(ProjectionOracle, ContainsTheExactProjection) {
  for (TracedRandom random(708); random.Again(300);) {
    const int n = random.Integer(2, 6), p = random.Integer(1, 3);
    Eigen::MatrixXd matrix = random.Matrix(p, n);
    if (random.trial() % 3 == 1) matrix = (matrix.array() > 0.2).cast<double>();
    if (random.trial() % 3 == 2)  // copies coordinates
      for (int k = 0; k < p; ++k) matrix.row(k) = Eigen::RowVectorXd::Unit(n, random.Integer(0, n - 1));
    Zonotope slice = random.AnyZonotope(n, random.Integer(0, 12), std::ldexp(1, random.Integer(-300, 300)));
    for (int k = 0; k < n; ++k)
      ArraysOf(slice).mutable_slack(k) = random.Coin() ? 0 : random.Uniform(0, 1) * slice.HalfWidthUpper(k);
    Zonotope projected;
    Projection(matrix, n).Enclose(slice, HalfWidths(slice), projected);
    for (int i = 0; i < 6; ++i) {
      const Eigen::VectorXd d = random.Vector(p);
      Rational support = 0;  // of the exact image: d . P c + sum |d . P g| + |d . P| s
      const auto along = [&](auto entry) -> Rational {
        Rational sum = 0;
        for (int k = 0; k < p; ++k)
          for (int l = 0; l < n; ++l) sum += Rational(d[k]) * Rational(matrix(k, l)) * Rational(entry(l));
        return sum;
      };
      support += along([&](int l) { return slice.center(l); });
      for (int j = 0; j < slice.num_generators(); ++j)
        support += abs(along([&](int l) { return slice.generator(l, j); }));
      for (int k = 0; k < n; ++k) support += abs(along([&](int l) { return l == k ? slice.slack(k) : 0.0; }));
      ASSERT_LE(support, exact::Support(projected, View(d)));
    }
  }
}

}  // namespace forereach::separation_oracle_test
