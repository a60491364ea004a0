// Suprema of slopes: known ones of made-up residuals, the paper's, over parameter boxes, over balls.
#include "forereach/declare/slope_bound.h"

#include "tests/test.h"

#include "forereach/dynamics/models/residuals.h"
#include "research/equations_slopes.h"
#include "tests/declare/families.h"

namespace forereach::slope_bound_test {

// Slopes 3 c (x^2 - y^2) and -6 c x y; the second has kinks.
Family Cubic(const Domain& domain, const Interval& c = {1, 1}) {
  return Made(domain, "c*(x*x*x - 3*x*y^2)", "max(x, y) + abs(u)/2", c);
}

// The first slope is largest in the middle.
Family Wave(const Domain& domain) { return Made(domain, "sin(x)*cos(y)", "x^2/2 + x*y"); }

// No finite slope of the first where the domain has x = c.
Family Pole(const Domain& domain, const Interval& c = {1, 1}) { return Made(domain, "1/(x - c)", "x*y*u^2", c); }

void ExpectSupremum(const SlopeBound& bound, double supremum) {
  EXPECT_GE(bound.upper, supremum * (1 - 1e-15));
  EXPECT_LE(bound.lower, supremum * (1 + 1e-15));
  EXPECT_LE(bound.upper, supremum * (1 + 1e-6));
  EXPECT_GE(bound.lower, supremum * (1 - 1e-6));
  EXPECT_TRUE(bound.reached);
  EXPECT_LE(bound.gap(), 1e-7);
}

TEST(SlopeBound, FindsTheSupremumOfAPolynomialInACorner) {
  ExpectSupremum(Cubic(Square(2)).Bound(0, 0), 12);
  ExpectSupremum(Cubic(Square(2)).Bound(0, 1), 24);
}

TEST(SlopeBound, FindsTheSupremumOverAParameter) { ExpectSupremum(Cubic(Square(2), {-3, 2}).Bound(0, 1), 72); }

TEST(SlopeBound, OfAKinkIsTheGeneralisedGradients) {
  ExpectSupremum(Cubic(Square(2)).Bound(1, 0), 1);
  ExpectSupremum(Cubic(Square(2)).Bound(1, 2), 0.5);
}

TEST(SlopeBound, FindsASupremumInTheMiddleOfTheDomain) { ExpectSupremum(Wave(Square(2)).Bound(0, 0), 1); }

TEST(SlopeBound, OverABallItsBoundaryCounts) {
  Domain domain = Square(2);
  domain.balls.push_back({{0, 1}, Eigen::Vector2d::Zero(), 2});
  ExpectSupremum(Cubic(domain).Bound(0, 1), 12);                 // 6 x y on |z| <= 2
  ExpectSupremum(Wave(domain).Bound(1, 0), 2 * std::sqrt(2.0));  // x + y
}

TEST(SlopeBound, FindsTheSupremumUnderAnInequality) {
  Domain domain = Square(2);
  Eigen::VectorXd coefficients(3);
  coefficients << 2, 1, 0;
  domain.inequalities.push_back({coefficients, 1});
  domain.inequalities.push_back({-coefficients, 1});
  ExpectSupremum(Wave(domain).Bound(1, 0), 1.5);  // |x + y| where |2 x + y| <= 1
}

TEST(SlopeBound, OfWhatDoesNotOccurIsZero) {
  const SlopeBound bound = Wave(Square(2)).Bound(0, 2);
  EXPECT_EQ(bound.upper, 0);
  EXPECT_TRUE(bound.reached);
}

TEST(SlopeBound, AtTheWorkLimitHoldsAndSaysSo) {
  const Family family = PointMassInBall();
  const SlopeBound bound = family.Bound(2, 2, {1e-7, 500});
  EXPECT_FALSE(bound.reached);
  EXPECT_GT(bound.upper, 0.06145786);
  EXPECT_LE(bound.lower, 0.06145787);
  EXPECT_LE(bound.boxes, 502u);
}

// A pole is found at once, not after 2^d boxes around it, however many are allowed.
TEST(SlopeBound, OverAPoleNamesABoxAndEnds) {
  for (const double pole : {0.0, 0.3, 2.0, -2.0, 0x1p-1074}) {
    const SlopeBound bound = Pole(Square(2), pole).Bound(0, 0, {1e-7, 100'000'000});
    EXPECT_EQ(bound.upper, kInfinity);
    EXPECT_FALSE(bound.reached);
    EXPECT_LT(bound.boxes, 10'000u) << pole;
    ASSERT_EQ(bound.unbounded.size(), 4u);
    EXPECT_LT(bound.unbounded[0].DistanceUpper(pole), 1e-12);  // beside it the slope is no double either
    EXPECT_LT(bound.unbounded[0].upper - bound.unbounded[0].lower, 1e-12);
  }
}

// Zero for x below 1, but for x <= -c it is undefined.
TEST(SlopeBound, IsInfiniteWhereAnUndefinedTermIsMultipliedByZero) {
  const auto bound = [](double c) { return Made(Square(2), "smooth_gate(x - 1)*log(x + c)", "y", c).Bound(0, 0); };
  const SlopeBound undefined = bound(0);
  EXPECT_EQ(undefined.upper, kInfinity);
  ASSERT_FALSE(undefined.unbounded.empty());
  EXPECT_LE(undefined.unbounded[0].lower, 0);
  const SlopeBound defined = bound(2.5);
  EXPECT_TRUE(defined.reached);
  EXPECT_GT(defined.upper, 0.1);
}

TEST(SlopeBound, OfAPoleAmongTheParametersNamesABoxAndEnds) {
  EXPECT_FIELDS(Pole(Square(2), {1, 5}).Bound(0, 0), (upper, kInfinity), (unbounded.empty(), false));
}

TEST(SlopeBound, BesideAPoleIsFinite) {
  ExpectSupremum(Pole(Square(2), {2.5, 4}).Bound(0, 0), 4);
  Domain domain = Square(2);  // the pole at 1 is in the box, not in the domain
  Eigen::VectorXd coefficients(3);
  coefficients << 1, 0, 0;
  domain.inequalities.push_back({coefficients, 0.5});
  const SlopeBound bound = Pole(domain, {1, 1}).Bound(0, 0);
  ExpectSupremum(bound, 4);
  EXPECT_TRUE(bound.unbounded.empty());
}

// Widths that overflow, that are subnormal, that have no double between their ends: it ends, and what it says holds.
TEST(SlopeBound, HoldsAndEndsForDomainsOfEveryScale) {
  for (const double size : {kMaxDouble, 0x1p+1000, 0x1p+400, 1e-300, 0x1p-1022, 0x3p-1074, 0x1p-1074, 0.0}) {
    const Domain domain = Square(size);
    for (const auto& [row, column] : {std::pair{0, 0}, {0, 1}, {1, 0}, {1, 1}, {1, 2}}) {
      const SlopeBound wave = Wave(domain).Bound(row, column, {1e-7, 3000});
      const SlopeBound cubic = Cubic(domain).Bound(row, column, {1e-7, 3000});
      for (const SlopeBound& bound : {wave, cubic}) {
        EXPECT_LE(bound.boxes, 3002u);
        EXPECT_GE(bound.upper, bound.lower) << size;
        EXPECT_EQ(bound.unbounded.empty(), bound.upper < kInfinity);
      }
      if (row == 0 && column == 0) {
        EXPECT_GE(wave.upper, std::cos(size) * std::cos(size) * (1 - 1e-15));  // at a corner
        EXPECT_GE(cubic.upper, 3 * (size * size) * (1 - 1e-15));
      }
      if (row == 1 && column == 0) {
        EXPECT_GE(cubic.upper, 1);
        EXPECT_GE(wave.upper, std::min(2 * size, kMaxDouble));  // |x + y|
      }
    }
  }
}

// Slopes that are finite up to the largest double, over ranges whose width overflows: none may come out as nothing.
TEST(SlopeBound, NextToOverflowNothingIsTakenForZero) {
  for (const double size : {0x1p+341, 0x1p+511, 0x1p+512, 0x1p+600}) {
    const Domain domain = Square(size);
    for (int column = 0; column < 2; ++column) {
      EXPECT_GE(Pole(domain).Bound(1, column, {1e-7, 3000}).upper, size);  // |x| or |y| times u^2, |u| <= 1
    }
  }
}

TEST(SlopeBound, RefusesWhatDoesNotFit) {
  const Family family = Bicycle();
  EXPECT_THROW((void)family.Bound(6, 0), std::invalid_argument);
  EXPECT_THROW((void)family.Bound(0, 8), std::invalid_argument);
  EXPECT_THROW((void)family.Bound(2, 3, {0, 10}), std::invalid_argument);
  EXPECT_THROW((void)BoundSlope(family.slopes, family.domain, {}, 2, 3), std::invalid_argument);
  ParametricResidual other = family.residual;
  other.names.parameters[3].lower = 2;
  EXPECT_THROW(TextSlopes{other}, std::invalid_argument);
  other = family.residual;
  other.values.pop_back();
  EXPECT_THROW(TextSlopes{other}, std::invalid_argument);
}

// ---- The paper's.

struct Entry {
  int row, column;
  double supremum, digit, grid;  // to within half of `digit`
};

void ExpectBetterThanTheGrid(const Family& family, const Entry& entry) {
  const SlopeBound bound = family.Bound(entry.row, entry.column);
  EXPECT_TRUE(bound.reached);
  EXPECT_LE(bound.lower, bound.upper);
  EXPECT_LE(bound.gap(), 1e-6);
  EXPECT_NEAR(bound.upper, entry.supremum, entry.digit);
  EXPECT_LT(bound.upper, entry.grid);
  EXPECT_TRUE(
      family.domain.Contains(std::span(bound.point).first(static_cast<std::size_t>(family.slopes.num_variables()))));
}

TEST(SlopeBound, BicycleIsBelowThePapersGrid) {
  for (const Entry& entry : {Entry{2, 3, 0.01195760, 1e-8, 0.011965171}, Entry{2, 5, 0.40767005, 1e-8, 0.407688551}})
    ExpectBetterThanTheGrid(Bicycle(), entry);
}

TEST(SlopeBound, PointMassIsBelowThePapersGrid) {
  for (const Entry& entry :
       {Entry{2, 2, 0.06145786, 1e-8, 0.061460184}, Entry{3, 2, 0.05057370, 1e-8, 0.050577964},
        Entry{0, 2, 0.06145786 * 0.075, 1e-9, 0.004609514}, Entry{1, 2, 0.05057370 * 0.075, 1e-9, 0.003793347}})
    ExpectBetterThanTheGrid(PointMassInBall(), entry);
}

TEST(SlopeBound, OnlyTheSaturatingEntriesOccur) {
  const Family bicycle = Bicycle(), point_mass = PointMassInBall();
  for (int l = 0; l < 8; ++l)
    for (int k = 0; k < 6; ++k) EXPECT_EQ(bicycle.slopes.Occurs(k, l), k == 2 && (l == 3 || l == 5)) << k << l;
  for (int l = 0; l < 6; ++l)
    for (int k = 0; k < 4; ++k) EXPECT_EQ(point_mass.slopes.Occurs(k, l), l == 2 || l == 3) << k << l;
}

// As text they have the bounds of the compiled equations, box for box.
template <class Residual>
void ExpectTheSameBounds(const Family& family) {
  const EquationsSlopes<Residual> compiled;
  for (int row = 0; row < family.slopes.num_states(); ++row)
    for (int column = 0; column < family.slopes.num_variables(); ++column) {
      ASSERT_EQ(family.slopes.Occurs(row, column), compiled.Occurs(row, column));
      if (!compiled.Occurs(row, column)) continue;
      const SlopeBoundOptions options{1e-3, 500};
      const SlopeBound text = family.Bound(row, column, options),
                       same = BoundSlope(compiled, family.domain, family.parameters, row, column, options);
      EXPECT_FIELDS(text, (upper, same.upper), (lower, same.lower), (boxes, same.boxes));
    }
}

TEST(SlopeBound, OfATextIsThatOfTheCompiledEquations) {
  for (const double widen : {0.0, 0.1}) {
    ExpectTheSameBounds<HeadingSaturation>(Bicycle(widen));
    ExpectTheSameBounds<VelocityKnee>(PointMassInBall(widen));
  }
}

TEST(SlopeBound, OfMoreArgumentsThanFitIsRefused) {
  ParametricResidual many{"many", {{"s"}, {"u"}, {}, {}}, {{"s"}}};
  for (int i = 0; i < Jet::kMaxArguments; ++i) {
    many.names.parameters.push_back({"c" + std::to_string(i), 0, 1});
    many.values[0].text += " + c" + std::to_string(i) + "*s";
  }
  Domain domain;
  domain.state = domain.input = Box(Eigen::VectorXd::Constant(1, -1), Eigen::VectorXd::Constant(1, 1));
  const auto bound = [&] { return BoundSlope(TextSlopes(many), domain, ParameterRanges(many), 0, 0); };
  EXPECT_THROW((void)bound(), std::invalid_argument);
  many.names.parameters[0].upper = 0;  // a point does not vary
  EXPECT_NEAR(bound().upper, Jet::kMaxArguments, 1e-9);
}

// Slopes at random points and parameters, by a difference quotient in extended precision.
template <class Residual>
double SampledMaximum(const Family& family, int row, int column, int count) {
  std::mt19937_64 random(7);
  const auto uniform = [&](double lower, double upper) {
    return lower + (upper - lower) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  const auto variables = static_cast<std::size_t>(family.slopes.num_variables());
  double largest = 0;
  for (int i = 0; i < count; ++i) {
    std::vector<double> z(variables);
    for (std::size_t l = 0; l < z.size(); ++l) {
      const auto n = static_cast<std::size_t>(family.domain.state.dim());
      const Box& box = l < n ? family.domain.state : family.domain.input;
      const auto k = static_cast<Eigen::Index>(l < n ? l : l - n);
      z[l] = uniform(box.lower()[k], box.upper()[k]);
    }
    if (!family.domain.Contains(z)) continue;
    std::vector<long double> p, w(z.begin(), z.end()), ahead(static_cast<std::size_t>(family.slopes.num_states())),
        behind = ahead;
    for (const Interval& range : family.parameters) p.push_back(uniform(range.lower, range.upper));
    constexpr long double kStep = 1e-6L;
    const auto at = [&](long double shift, std::vector<long double>& out) {
      std::vector<long double> moved = w;
      moved[static_cast<std::size_t>(column)] += shift;
      Residual::template Evaluate<long double>(p, moved, out);
    };
    at(kStep, ahead);
    at(-kStep, behind);
    const auto k = static_cast<std::size_t>(row);
    largest = std::max(largest, static_cast<double>(std::abs(ahead[k] - behind[k]) / (2 * kStep)));
  }
  return largest;
}

TEST(SlopeBound, OverParameterBoxesGrowsAndContainsSamples) {
  double before_bicycle = 0, before_point_mass = 0;
  for (const double widen : {0.0, 0.05, 0.2}) {
    const Family bicycle = Bicycle(widen), point_mass = PointMassInBall(widen);
    const SlopeBound steering = bicycle.Bound(2, 5), along = point_mass.Bound(2, 2, {1e-6});
    EXPECT_TRUE(steering.reached && along.reached) << widen;
    EXPECT_GT(steering.lower, before_bicycle);
    EXPECT_GT(along.lower, before_point_mass);
    before_bicycle = steering.upper;
    before_point_mass = along.upper;
    const double sampled_steering = SampledMaximum<HeadingSaturation>(bicycle, 2, 5, 200'000),
                 sampled_along = SampledMaximum<VelocityKnee>(point_mass, 2, 2, 100'000);
    EXPECT_LE(sampled_steering, steering.upper * (1 + 1e-9));
    EXPECT_LE(sampled_along, along.upper * (1 + 1e-9));
    EXPECT_GT(sampled_steering, 0.85 * steering.upper);
    EXPECT_GT(sampled_along, 0.9 * along.upper);
  }
}

}  // namespace forereach::slope_bound_test
