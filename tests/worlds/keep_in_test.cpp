// What is outside of areas to stay in, judged by exact rationals.
#include "task/keep_in.h"

#include "tests/test.h"
#include "tests/worlds/in_pieces.h"

namespace forereach::keep_in_test {

bool IsCovered(const std::vector<Obstacle>& outside, const ExactPoint& p) {
  return std::ranges::any_of(outside, [&](const Obstacle& each) { return Contains(each, p); });
}

// Points between, around and on the corners: those inside alone are free. @param scale of the area, which is about
// within [0, 10]^2 times it.
void ExpectExact(const Area& area, std::mt19937& random, double scale = 1) {
  const std::vector<Obstacle> outside = OutsideOf({area});
  std::vector<Ring> rings = area.holes;
  rings.push_back(area.outer);
  for (const Ring& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const ExactPoint a = ToExact(ring[i]), b = ToExact(ring[(i + 1) % ring.size()]);
      EXPECT_TRUE(IsCovered(outside, a)) << "a corner";
      EXPECT_TRUE(IsCovered(outside, {(a.first + b.first) / 2, (a.second + b.second) / 2})) << "on a side";
    }
  std::uniform_real_distribution<double> place(-2 * scale, 12 * scale);
  for (int i = 0; i < 60; ++i) {
    const ExactPoint p = ToExact({place(random), place(random)});
    const bool is_inside = IsEnclosed(area.outer, p) &&
                           std::ranges::none_of(area.holes, [&](const Ring& hole) { return IsEnclosed(hole, p); });
    EXPECT_NE(IsCovered(outside, p), is_inside);
  }
}

TEST(OutsideOf, ARandomStarIsExact) {
  FreshRandom random;
  std::uniform_real_distribution<double> radius(0.2, 5);
  for (int n = 3; n < 50; ++n) {
    const double scale = n % 3 == 0 ? 1e-12 : n % 3 == 1 ? 1 : 1e7;
    Area area;
    for (int i = 0; i < n; ++i) {
      const double r = scale * radius(random), angle = 2 * std::numbers::pi * i / n;
      area.outer.push_back({5 * scale + r * std::cos(angle), 5 * scale + r * std::sin(angle)});
    }
    if (n % 2 == 0) std::ranges::reverse(area.outer);
    if (n % 5 == 0) area.outer.push_back(area.outer.front());
    ExpectExact(area, random, scale);
  }
}

// Corners on a grid: many on one line, some twice, holes side by side.
TEST(OutsideOf, ACombWithHolesIsExact) {
  FreshRandom random;
  for (int round = 0; round < 20; ++round) {
    Area area{{{0, 0}, {5, 0}, {5, 0}, {10, 0}}, {}};
    for (int x = 10; x > 0; x -= 2) {
      const double depth = static_cast<double>(random() % 8);
      for (const PlanePoint& p : Ring{{1.0 * x, 10}, {x - 1.0, 10}, {x - 1.0, 9 - depth}, {x - 2.0, 9 - depth}})
        area.outer.push_back(p);
    }
    for (int x = 0; x < 10; x += 2)
      if (random() % 2 == 0) area.holes.push_back({{x + .25, .25}, {x + .75, .5}, {x + .25, .75}});
    ExpectExact(area, random);
  }
}

TEST(OutsideOf, AnLIsFewPieces) {
  const std::vector<Obstacle> outside = OutsideOf({{{{0, 0}, {4, 0}, {4, 2}, {2, 2}, {2, 4}, {0, 4}}, {}}});
  EXPECT_LE(outside.size(), 4u + 2u) << "four half-planes, and the notch";
  for (const Obstacle& piece : outside)
    if (piece.kind() != Obstacle::Kind::kHalfSpace) {
      EXPECT_GE(piece.lower().minCoeff(), 0);
      EXPECT_LE(piece.upper().maxCoeff(), 4.01) << "drawings and the index see no more than the box";
    }
}

TEST(OutsideOf, IsGrownByTheMargin) {
  FreshRandom random;
  std::uniform_real_distribution<double> place(-1, 5);
  const Area area{{{0, 0}, {4, 0.5}, {4, 4}, {2, 1}, {0, 4}}, {{{0.5, 0.5}, {1, 0.5}, {1, 1}}}};
  const auto exact = OutsideOf({area}), grown = OutsideOf({area}, 0.1);
  for (int i = 0; i < 300; ++i) {
    const PlanePoint p{place(random), place(random)};
    if (!IsCovered(exact, ToExact(p))) continue;
    for (const double x : {-0.1, 0.1})
      for (const double y : {-0.1, 0.1})
        EXPECT_TRUE(IsCovered(grown, {Rational(p.x) + Rational(x), Rational(p.y) + Rational(y)}));
  }
  EXPECT_FALSE(IsCovered(grown, ToExact({1.5, 0.5})));
}

TEST(OutsideOf, OfSeveralIsOutsideOfAll) {
  const auto outside = OutsideOf({{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, {}}, {{{2, 0}, {3, 0}, {3, 1}, {2, 1}}, {}}});
  EXPECT_FALSE(IsCovered(outside, ToExact({0.5, 0.5})));
  EXPECT_FALSE(IsCovered(outside, ToExact({2.5, 0.5})));
  EXPECT_TRUE(IsCovered(outside, ToExact({1.5, 0.5})));
  EXPECT_TRUE(IsCovered(outside, ToExact({1, 0.5})));
}

// The largest one that is taken, in a shape that costs much: a spiral.
TEST(OutsideOf, ASpiralOfTheMostCornersIsTaken) {
  Area area;
  const int half = kMaxKeepInCorners / 2;
  for (int i = 0; i < half; ++i)
    area.outer.push_back({(1 + i * 0.01) * std::cos(0.1 * i), (1 + i * 0.01) * std::sin(0.1 * i)});
  for (int i = half; i-- > 0;)
    area.outer.push_back({(1.2 + i * 0.01) * std::cos(0.1 * i), (1.2 + i * 0.01) * std::sin(0.1 * i)});
  EXPECT_LE(OutsideOf({area}).size(), 4096u + 8);
  area.outer.insert(area.outer.begin(), 9, area.outer.front());
  EXPECT_THAT(Thrown<NoPolygon>([&] { static_cast<void>(OutsideOf({area})); }), HasSubstr("at most 4096"));
}

}  // namespace forereach::keep_in_test
