// Laws that hold for every set type, at empty dimension, point, flat, 1e-8 wide, huge and random sets. A new set type
// is one more entry of SetTypes, and an adapter of five lines where its interface differs.
#include "tests/test.h"

#include "forereach/sets/box.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::set_laws_test {

// A point of a set, exactly.
using Point = std::vector<Rational>;

struct ZonotopeLaws {
  using Set = Zonotope;
  static Set FromBox(const Eigen::VectorXd& center, const Eigen::VectorXd& half) {
    return Zonotope::FromBox(center, half);
  }
  static Interval Hull(const Set& set, int k) { return set.Hull(k); }
  static double SupportUpper(const Set& set, const Eigen::VectorXd& d) { return set.SupportUpper(View(d)); }
  static Rational Support(const Set& set, const Eigen::VectorXd& d) { return exact::Support(set, View(d)); }
  static Point Member(const Set& set, Random& random) {
    Point point;
    for (int k = 0; k < set.dim(); ++k) point.emplace_back(set.center(k));
    for (int j = 0; j < set.num_generators(); ++j) {
      const Rational weight(random.Coin() ? random.Sign() : random.Uniform(-1, 1));
      for (int k = 0; k < set.dim(); ++k) point[static_cast<std::size_t>(k)] += weight * Rational(set.generator(k, j));
    }
    return point;
  }
};

struct BoxLaws {
  using Set = Box;
  static Set FromBox(const Eigen::VectorXd& center, const Eigen::VectorXd& half) {
    return Box::FromCenter(center, half);
  }
  static Interval Hull(const Set& set, int k) { return {set.lower()[k], set.upper()[k]}; }
  static double SupportUpper(const Set& set, const Eigen::VectorXd& d) {
    return Zonotope::Enclose(set).SupportUpper(View(d));
  }
  static Rational Support(const Set& set, const Eigen::VectorXd& d) {
    Rational value = 0;
    for (int k = 0; k < set.dim(); ++k) {
      const double slope = d[k];
      value += Rational(slope) * Rational(slope > 0 ? set.upper()[k] : set.lower()[k]);
    }
    return value;
  }
  static Point Member(const Set& set, Random& random) {
    Point point;
    for (int k = 0; k < set.dim(); ++k) {
      const Rational weight(random.Coin() ? random.Below(2) : random.Uniform(0, 1));
      point.push_back(Rational(set.lower()[k]) + weight * (Rational(set.upper()[k]) - Rational(set.lower()[k])));
    }
    return point;
  }
};

using SetTypes = testing::Types<ZonotopeLaws, BoxLaws>;

template <class Laws>
class SetLaws : public testing::Test {};
TYPED_TEST_SUITE(SetLaws, SetTypes);

struct Example {
  std::string name;
  Eigen::VectorXd center, half_width;
};

std::vector<Example> Examples(Random& random) {
  std::vector<Example> examples{{"no dimensions", Eigen::VectorXd(0), Eigen::VectorXd(0)}};
  for (const int n : {1, 2, 3, 4, 6, 16}) {
    const Eigen::VectorXd center = random.Vector(n, 10), half = random.Vector(n).cwiseAbs();
    Eigen::VectorXd flat = half;
    flat[random.Below(n)] = 0;
    examples.push_back({"a point", center, Eigen::VectorXd::Zero(n)});
    examples.push_back({"flat", center, flat});
    examples.push_back({"1e-8 wide", center, half * 1e-8});
    examples.push_back({"narrower than its center's last bit", center, half * 1e-18});
    examples.push_back({"subnormal", center * 1e-310, half * 1e-312});
    examples.push_back({"huge", center * 1e290, half * 1e291});
    examples.push_back({"random", center, half});
  }
  return examples;
}

std::vector<Eigen::VectorXd> Directions(Random& random, int n) {
  std::vector<Eigen::VectorXd> directions{Eigen::VectorXd::Zero(n)};
  for (int k = 0; k < n; ++k) {
    directions.push_back(Eigen::VectorXd::Unit(n, k));
    directions.push_back(-Eigen::VectorXd::Unit(n, k));
  }
  for (int i = 0; i < 10; ++i) directions.push_back(random.Vector(n, std::ldexp(1, random.Integer(-60, 60))));
  return directions;
}

Rational Dot(const Eigen::VectorXd& d, const Point& point) {
  Rational value = 0;
  for (std::size_t k = 0; k < point.size(); ++k) value += Rational(d[static_cast<Eigen::Index>(k)]) * point[k];
  return value;
}

template <class Laws>
void ForEachExample(void (*check)(const typename Laws::Set&, const Example&, Random&)) {
  TracedRandom random(301);
  for (const Example& example : Examples(random)) {
    SCOPED_TRACE(example.name + ", dimension " + std::to_string(example.center.size()));
    check(Laws::FromBox(example.center, example.half_width), example, random);
  }
}

TYPED_TEST(SetLaws, KeepsItsDimension) {
  ForEachExample<TypeParam>(
      [](const auto& set, const Example& example, Random&) { EXPECT_EQ(set.dim(), example.center.size()); });
}

TYPED_TEST(SetLaws, HullContainsTheBoxItWasMadeFrom) {
  ForEachExample<TypeParam>([](const auto& set, const Example& example, Random&) {
    for (int k = 0; k < set.dim(); ++k) {
      const Rational center(example.center[k]), half(example.half_width[k]);
      EXPECT_TRUE(AtLeast(center - half, TypeParam::Hull(set, k).lower));
      EXPECT_TRUE(AtMost(center + half, TypeParam::Hull(set, k).upper));
    }
  });
}

TYPED_TEST(SetLaws, MembersLieInHullAndBelowSupport) {
  ForEachExample<TypeParam>([](const auto& set, const Example&, Random& random) {
    const auto directions = Directions(random, set.dim());
    for (int i = 0; i < 5; ++i) {
      const Point member = TypeParam::Member(set, random);
      for (int k = 0; k < set.dim(); ++k)
        EXPECT_TRUE(AtLeast(member[static_cast<std::size_t>(k)], TypeParam::Hull(set, k).lower) &&
                    AtMost(member[static_cast<std::size_t>(k)], TypeParam::Hull(set, k).upper));
      for (const Eigen::VectorXd& d : directions) EXPECT_TRUE(AtMost(Dot(d, member), TypeParam::SupportUpper(set, d)));
    }
  });
}

TYPED_TEST(SetLaws, SupportUpperIsExactFromAboveAndTight) {
  ForEachExample<TypeParam>([](const auto& set, const Example& example, Random& random) {
    for (const Eigen::VectorXd& d : Directions(random, set.dim())) {
      const Rational support = TypeParam::Support(set, d);
      const double upper = TypeParam::SupportUpper(set, d);
      ASSERT_TRUE(AtMost(support, upper));
      if (upper == kInfinity) continue;
      Rational magnitude = 0;
      for (int k = 0; k < set.dim(); ++k)
        magnitude += abs(Rational(d[k])) * (abs(Rational(example.center[k])) + abs(Rational(example.half_width[k])));
      const Rational underflow = Rational(0x1p-1060) * (1 + Rational(d.lpNorm<1>()));
      EXPECT_LE(Rational(upper) - support, magnitude * Rational(1e-13) + underflow);
    }
  });
}

TYPED_TEST(SetLaws, WidthsAreNotNegative) {
  ForEachExample<TypeParam>([](const auto& set, const Example&, Random& random) {
    for (const Eigen::VectorXd& d : Directions(random, set.dim()))
      EXPECT_GE(TypeParam::SupportUpper(set, d), -TypeParam::SupportUpper(set, -d));
  });
}

TYPED_TEST(SetLaws, HullEndsAreTheSupportAlongTheAxes) {
  ForEachExample<TypeParam>([](const auto& set, const Example&, Random&) {
    for (int k = 0; k < set.dim(); ++k) {
      const Eigen::VectorXd axis = Eigen::VectorXd::Unit(set.dim(), k);
      const Rational width =
          abs(Rational(TypeParam::Hull(set, k).upper)) + abs(Rational(TypeParam::Hull(set, k).lower));
      const Rational slack = width * Rational(1e-14) + Rational(0x1p-1060);
      EXPECT_LE(Rational(TypeParam::Hull(set, k).upper) - TypeParam::Support(set, axis), slack);
      EXPECT_LE(-TypeParam::Support(set, -axis) - Rational(TypeParam::Hull(set, k).lower), slack);
    }
  });
}

}  // namespace forereach::set_laws_test
