// Polygons cut into convex pieces, judged by exact rationals.
#include "task/plane.h"

#include "tests/test.h"
#include "tests/worlds/in_pieces.h"

namespace forereach::plane_test {

Rational TwiceArea(const Ring& ring) {
  Rational area = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const ExactPoint a = ToExact(ring[i]), b = ToExact(ring[(i + 1) % ring.size()]);
    area += a.first * b.second - a.second * b.first;
  }
  return area;
}

// The pieces are convex and small, and points are in one of them exactly if they are in the area.
void ExpectExact(const Area& area, int most_corners, std::mt19937& random) {
  const std::vector<Ring> pieces = ConvexPieces(area, most_corners);
  Rational sum = 0;
  for (const Ring& piece : pieces) {
    EXPECT_LE(std::ssize(piece), most_corners);
    EXPECT_EQ(ConvexHull(piece).size(), piece.size());
    EXPECT_GT(TwiceArea(piece), 0);
    sum += TwiceArea(piece);
  }
  Rational whole = abs(TwiceArea(area.outer));
  for (const Ring& hole : area.holes) whole -= abs(TwiceArea(hole));
  EXPECT_EQ(sum, whole);
  std::uniform_real_distribution<double> place(-1, 11);
  for (int i = 0; i < 40; ++i) {
    const ExactPoint p = ToExact({place(random), place(random)});
    const bool is_inside = IsEnclosed(area.outer, p) &&
                           std::ranges::none_of(area.holes, [&](const Ring& hole) { return IsEnclosed(hole, p); });
    EXPECT_EQ(std::ranges::any_of(pieces, [&](const Ring& piece) { return Has(piece, p); }), is_inside);
  }
}

TEST(Turn, IsExactWhereRoundingIsNot) {
  const PlanePoint a{0.5, 0.5}, b{12, 12}, c{24, 24};
  EXPECT_EQ(Turn(a, b, c), 0);
  for (int i = -8; i <= 8; ++i)
    for (int j = -8; j <= 8; ++j) {
      const PlanePoint moved{0.5 + i * 0x1p-53, 0.5 + j * 0x1p-53};
      EXPECT_EQ(Turn(moved, b, c), sgn(Cross(ToExact(moved), ToExact(b), ToExact(c)))) << i << ", " << j;
    }
  EXPECT_EQ(Turn({0, 0}, {5e-324, 0}, {0, 5e-324}), 1) << "the product underflows";
  EXPECT_EQ(Turn({0, 0}, {1e308, 1e308}, {-1e308, 1e308}), 1) << "the product overflows";
}

TEST(ConvexPieces, OfARandomStarAreExact) {
  FreshRandom random;
  std::uniform_real_distribution<double> radius(0.2, 5);
  for (int n = 3; n < 60; ++n) {
    Area area;
    for (int i = 0; i < n; ++i) {
      const double r = radius(random), angle = 2 * std::numbers::pi * i / n;
      area.outer.push_back({5 + r * std::cos(angle), 5 + r * std::sin(angle)});
    }
    if (n % 2 == 0) std::ranges::reverse(area.outer);
    ExpectExact(area, 3 + n % 14, random);
  }
}

// Corners on a grid: many on one line, and holes side by side.
TEST(ConvexPieces, OfAGridWithHolesAreExact) {
  FreshRandom random;
  for (int round = 0; round < 60; ++round) {
    Area area{{{0, 0}, {5, 0}, {10, 0}, {10, 10}, {5, 9}, {0, 10}, {0, 0}}, {}};  // its first corner again
    for (int x = 1; x < 9; x += 2)
      for (int y = 1; y < 8; y += 2) {
        if (random() % 3 == 0) continue;
        const double left = x, low = y, right = x + 1.5, high = y + 1.5;
        Ring hole{{left, low}, {right, low}, {right, high}, {left, high}};
        if (random() % 2 == 0) hole = {{left, low}, {right, low}, {(left + right) / 2, (low + high) / 2}, {left, high}};
        if (random() % 2 == 0) std::ranges::reverse(hole);
        std::rotate(hole.begin(), hole.begin() + random() % 4, hole.end());
        area.holes.push_back(hole);
      }
    ExpectExact(area, 16, random);
  }
}

TEST(ConvexPieces, OfAConvexPolygonAreOne) {
  EXPECT_EQ(ConvexPieces({{{0, 0}, {2, 0}, {3, 1}, {2, 3}, {0, 2}}, {}}, 16).size(), 1u);
  EXPECT_EQ(ConvexPieces({{{0, 0}, {2, 0}, {3, 1}, {2, 3}, {0, 2}}, {}}, 3).size(), 3u);
}

TEST(ConvexPieces, WhatIsNoAreaIsRefusedWithThePlace) {
  const auto why = [](const Area& area) {
    return Thrown<NoPolygon>([&] { static_cast<void>(ConvexPieces(area, 16)); });
  };
  const Ring square{{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  EXPECT_THAT(why({{{0, 0}, {4, 4}, {4, 0}, {0, 4}}, {}}),
              HasSubstr("the side from (0, 0) to (4, 4) meets the side from (4, 0) to (0, 4)"));
  EXPECT_THAT(why({{{0, 0}, {1, 0}, {1, 0}, {0, 0}}, {}}), HasSubstr("2 different corners"));
  EXPECT_THAT(why({{{0, 0}, {4, 0}, {2, 0}}, {}}), HasSubstr("meets the side")) << "flat";
  EXPECT_THAT(why({{{0, 0}, {4, 0}, {4, 4}, {2, 0}, {0, 4}}, {}}), HasSubstr("meets the side")) << "touches itself";
  EXPECT_THAT(why({square, {{{5, 5}, {6, 5}, {6, 6}}}}), HasSubstr("the hole at (6, 6) is not inside"));
  EXPECT_THAT(why({square, {{{1, 1}, {3, 1}, {3, 3}, {1, 3}}, {{1.5, 1.5}, {2, 1.5}, {2, 2}}}}), Not(IsEmpty()))
      << "a hole in a hole";
  EXPECT_THAT(why({square, {{{3, 1}, {5, 1}, {5, 2}}}}), HasSubstr("meets the side"));
  EXPECT_THAT(why({Ring(5000, {0, 0}), {}}), HasSubstr("5000 corners, at most 4096"));
}

TEST(Grown, ContainsAllWithinTheMargin) {
  FreshRandom random;
  std::normal_distribution<double> any;
  for (int round = 0; round < 60; ++round) {
    const std::vector<PlanePoint> points{
        {any(random), any(random)}, {any(random), any(random)}, {any(random), any(random)}};
    const double margin = std::abs(any(random)) * (round % 2 == 0 ? 1e-14 : 1);
    const Ring grown = Grown(points, margin);
    EXPECT_LE(grown.size(), 7u);
    for (const PlanePoint& p : points)
      for (const int x : {-1, 1})
        for (const int y : {-1, 1})
          EXPECT_TRUE(Has(grown, {Rational(p.x) + x * Rational(margin), Rational(p.y) + y * Rational(margin)}));
  }
}

TEST(SharesOutside, AreCutWhereRingsBegin) {
  const Ring l{{0, 0}, {4, 0}, {4, 2}, {2, 2}, {2, 4}, {0, 4}}, beside{{4, 0}, {8, 0}, {8, 2}, {4, 2}};
  using Shares = std::vector<std::pair<double, double>>;
  const auto outside = [&](const PlanePoint& a, const PlanePoint& b) { return SharesOutside(a, b, {&l}); };
  const Shares none, all{{0, 1}};
  EXPECT_EQ(outside({1, 1}, {3, 1}), none);
  EXPECT_EQ(outside({0, 0}, {2, 2}), none) << "from corner to corner";
  EXPECT_EQ(outside({0, 1}, {4, 1}), none) << "from side to side";
  EXPECT_EQ(outside({1, 3}, {3, 1}), none) << "through a corner, which is one point";
  EXPECT_EQ(outside({0, 0}, {4, 0}), all) << "along a side";
  EXPECT_EQ(outside({1, 0}, {3, 0}), all) << "along a part of a side";
  EXPECT_EQ(outside({2, 0}, {2, 4}), (Shares{{0.5, 1}})) << "inside, then along a side";
  EXPECT_EQ(outside({1, 3}, {5, 3}), (Shares{{0.25, 1}})) << "out by a side";
  EXPECT_EQ(outside({3, 3}, {1, 1}), (Shares{{0, 0.5}})) << "in by a corner";
  const Shares across = outside({-1, 1}, {5, 1});
  ASSERT_EQ(across.size(), 2u);
  EXPECT_TRUE(Rational(across[0].second) >= Rational(1) / 6 && Rational(across[1].first) <= Rational(5) / 6);
  EXPECT_NEAR(across[0].second + across[1].first, 1, 1e-15);
  EXPECT_EQ(outside({5, 1}, {6, 1}), all);
  EXPECT_EQ(SharesOutside({1, 1}, {7, 1}, {&l, &beside}), none) << "a side that two rings share is one point";
  EXPECT_EQ(SharesOutside({4, 0}, {4, 2}, {&l, &beside}), all) << "along it, no ring is on both sides";
}

// At points that no cut can be: with corners on a grid its denominator is at most 128.
TEST(SharesOutside, AreWhatIsStrictlyInsideNoRing) {
  FreshRandom random;
  std::uniform_real_distribution<double> place(-4, 4);
  for (int round = 0; round < 60; ++round) {
    const auto point = [&] {
      const double x = place(random), y = place(random);
      return round % 2 == 0 ? PlanePoint{std::round(x), std::round(y)} : PlanePoint{x, y};
    };
    std::vector<Ring> rings;
    for (int k = 0; k < 3; ++k) {
      std::vector<PlanePoint> corners;
      for (int i = 0; i < 4; ++i) corners.push_back(point());
      if (Ring hull = ConvexHull(corners); hull.size() > 2) rings.push_back(std::move(hull));
    }
    std::vector<const Ring*> all;
    for (const Ring& ring : rings) all.push_back(&ring);
    const PlanePoint a = point(), b = point();
    if (a == b) continue;
    const auto outside = SharesOutside(a, b, all);
    const auto [ax, ay] = ToExact(a);
    const auto [bx, by] = ToExact(b);
    for (int i = 1; i < 131; ++i) {
      const Rational share = Rational(i) / 131;
      const ExactPoint p{ax + share * (bx - ax), ay + share * (by - ay)};
      bool is_inside = false;
      for (const Ring& ring : rings) {
        bool is_left = true;
        for (std::size_t k = 0; k < ring.size(); ++k)
          is_left &= Cross(ToExact(ring[k]), ToExact(ring[(k + 1) % ring.size()]), p) > 0;
        is_inside |= is_left;
      }
      const bool is_kept = std::ranges::any_of(
          outside, [&](const auto& part) { return Rational(part.first) <= share && share <= Rational(part.second); });
      EXPECT_EQ(is_kept, !is_inside) << "round " << round << ", point " << i;
    }
  }
}

TEST(World, CutsLongHullsExactly) {
  std::vector<PlanePoint> points;
  for (int i = 0; i < 50; ++i) points.push_back({1.0 * i, i * i / 8.0});
  World world;
  world.Add("arc", points);
  EXPECT_EQ(world.pieces.back().obstacle.name(), "arc");
  EXPECT_EQ(world.pieces.size(), 4u);
  Rational sum = 0;
  for (const World::Piece& piece : world.pieces) sum += TwiceArea(CornersOf(piece.obstacle));
  EXPECT_EQ(sum, TwiceArea(ConvexHull(points)));
}

TEST(World, WhatIsCutAwayIsBehindHalfPlanes) {
  FreshRandom random;
  std::uniform_real_distribution<double> place(-4, 4);
  const Box region(Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, 2));
  for (int round = 0; round < 50; ++round) {
    World world;
    for (int i = 0; i < 5; ++i) {
      const PlanePoint p{place(random), place(random)};
      world.Add("any", {p, {p.x + 0.5, p.y}, {p.x, p.y + 0.5}});
    }
    if (round % 2 == 0) world.AddBeyond(round / 2 % 2, 1, place(random), "beyond");
    const World cropped = Cropped(world, region);
    EXPECT_LE(cropped.pieces.size(), world.pieces.size() + 4);
    for (int i = 0; i < 200; ++i) {
      const ExactPoint p = ToExact({place(random), place(random)});
      const bool is_in_region = abs(p.first) < 1 && p.second > -1 && p.second < 2;
      EXPECT_TRUE(!Contains(world, p) || Contains(cropped, p));
      EXPECT_TRUE(!is_in_region || Contains(cropped, p) == Contains(world, p));
    }
  }
}

}  // namespace forereach::plane_test
