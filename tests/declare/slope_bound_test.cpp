// Suprema of slopes: known ones of made-up residuals, the paper's, over parameter boxes, over balls.
#include "certifier/declare/slope_bound.h"

#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/declare/families.h"

namespace forereach {
namespace {

// Two states, one input, one parameter.
struct TwoStates {
  static constexpr int kStates = 2, kInputs = 1;
};

// r_0 = c (z0^3 - 3 z0 z1^2): slopes 3 c (z0^2 - z1^2) and -6 c z0 z1. r_1 = max(z0, z1) + |z2| / 2.
struct Cubic {
  using Nominal = TwoStates;
  static constexpr const char* kName = "cubic";
  static constexpr std::array<const char*, 1> kParameterNames{"c"};

  template <class T>
  static void Evaluate(std::span<const T> parameters, std::span<const T> z, std::span<T> residual) {
    using std::abs, std::max;
    residual[0] = parameters[0] * (z[0] * z[0] * z[0] - T(3) * z[0] * (z[1] * z[1]));
    residual[1] = max(z[0], z[1]) + abs(z[2]) / T(2);
  }
};

// r_0 = sin(z0) cos(z1): slope cos(z0) cos(z1), largest in the middle. r_1 = z0^2 / 2 + z0 z1.
struct Wave {
  using Nominal = TwoStates;
  static constexpr const char* kName = "wave";
  static constexpr std::array<const char*, 1> kParameterNames{"unused"};

  template <class T>
  static void Evaluate(std::span<const T>, std::span<const T> z, std::span<T> residual) {
    using std::cos, std::sin;
    residual[0] = sin(z[0]) * cos(z[1]);
    residual[1] = z[0] * z[0] / T(2) + z[0] * z[1];
  }
};

Domain Square(double half_width) {
  Domain domain;
  domain.state = Box(Eigen::Vector2d::Constant(-half_width), Eigen::Vector2d::Constant(half_width));
  domain.input = Box(Eigen::VectorXd::Constant(1, -1), Eigen::VectorXd::Constant(1, 1));
  return domain;
}

template <class Residual>
SlopeBound Bound(const Domain& domain, int row, int column, const Interval& parameter = {1, 1}) {
  return BoundSlope(EquationsSlopes<Residual>(), domain, {&parameter, 1}, row, column);
}

void ExpectSupremum(const SlopeBound& bound, double supremum) {
  EXPECT_GE(bound.upper, supremum * (1 - 1e-15));
  EXPECT_LE(bound.lower, supremum * (1 + 1e-15));
  EXPECT_LE(bound.upper, supremum * (1 + 1e-6));
  EXPECT_GE(bound.lower, supremum * (1 - 1e-6));
  EXPECT_TRUE(bound.reached);
  EXPECT_LE(bound.gap(), 1e-7);
}

TEST(SlopeBound, OfAPolynomialInACorner) {
  ExpectSupremum(Bound<Cubic>(Square(2), 0, 0), 12);
  ExpectSupremum(Bound<Cubic>(Square(2), 0, 1), 24);
}

TEST(SlopeBound, OverAParameter) { ExpectSupremum(Bound<Cubic>(Square(2), 0, 1, {-3, 2}), 72); }

TEST(SlopeBound, OfAKinkIsTheGeneralisedGradients) {
  ExpectSupremum(Bound<Cubic>(Square(2), 1, 0), 1);
  ExpectSupremum(Bound<Cubic>(Square(2), 1, 2), 0.5);
}

TEST(SlopeBound, InsideAnInterval) { ExpectSupremum(Bound<Wave>(Square(2), 0, 0), 1); }

TEST(SlopeBound, OverABallItsBoundaryCounts) {
  Domain domain = Square(2);
  domain.balls.push_back({{0, 1}, Eigen::Vector2d::Zero(), 2});
  ExpectSupremum(Bound<Cubic>(domain, 0, 1), 12);                 // 6 z0 z1 on |z| <= 2
  ExpectSupremum(Bound<Wave>(domain, 1, 0), 2 * std::sqrt(2.0));  // z0 + z1
}

TEST(SlopeBound, OverAnInequality) {
  Domain domain = Square(2);
  Eigen::VectorXd coefficients(3);
  coefficients << 2, 1, 0;
  domain.inequalities.push_back({coefficients, 1});
  domain.inequalities.push_back({-coefficients, 1});
  ExpectSupremum(Bound<Wave>(domain, 1, 0), 1.5);  // |z0 + z1| where |2 z0 + z1| <= 1
}

TEST(SlopeBound, OfWhatDoesNotOccurIsZero) {
  const SlopeBound bound = Bound<Wave>(Square(2), 0, 2);
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

// r_0 = 1 / (z0 - c): no finite slope where the domain holds the pole.
struct Pole {
  using Nominal = TwoStates;
  static constexpr const char* kName = "pole";
  static constexpr std::array<const char*, 1> kParameterNames{"c"};

  template <class T>
  static void Evaluate(std::span<const T> parameters, std::span<const T> z, std::span<T> residual) {
    residual[0] = T(1) / (z[0] - parameters[0]);
    residual[1] = z[0] * z[1] * (z[2] * z[2]);
  }
};

// A pole is found at once, not after 2^d boxes around it, however many are allowed.
TEST(SlopeBound, OverAPoleNamesABoxAndEnds) {
  for (const double pole : {0.0, 0.3, 2.0, -2.0, 0x1p-1074}) {
    const Interval c(pole);
    const SlopeBound bound = BoundSlope(EquationsSlopes<Pole>(), Square(2), {&c, 1}, 0, 0, {1e-7, 100'000'000});
    EXPECT_EQ(bound.upper, kInfinity);
    EXPECT_FALSE(bound.reached);
    EXPECT_LT(bound.boxes, 10'000u) << pole;
    ASSERT_EQ(bound.unbounded.size(), 4u);
    EXPECT_LT(bound.unbounded[0].DistanceUpper(pole), 1e-12);  // beside it the slope is no double either
    EXPECT_LT(bound.unbounded[0].upper - bound.unbounded[0].lower, 1e-12);
  }
}

// r_0 = SmoothGate(z0 - 1) log(z0 + c): zero below 1, but for z0 <= -c it is undefined.
struct GatedLogarithm {
  using Nominal = TwoStates;
  static constexpr const char* kName = "gated_logarithm";
  static constexpr std::array<const char*, 1> kParameterNames{"c"};

  template <class T>
  static void Evaluate(std::span<const T> parameters, std::span<const T> z, std::span<T> residual) {
    using std::log;
    residual[0] = SmoothGate(z[0] - T(1)) * log(z[0] + parameters[0]);
    residual[1] = z[1];
  }
};

TEST(SlopeBound, OfWhatIsUndefinedIsInfiniteThoughItIsOff) {
  const SlopeBound undefined = Bound<GatedLogarithm>(Square(2), 0, 0, {0, 0});
  EXPECT_EQ(undefined.upper, kInfinity);
  ASSERT_FALSE(undefined.unbounded.empty());
  EXPECT_LE(undefined.unbounded[0].lower, 0);
  const SlopeBound defined = Bound<GatedLogarithm>(Square(2), 0, 0, {2.5, 2.5});
  EXPECT_TRUE(defined.reached);
  EXPECT_GT(defined.upper, 0.1);
}

TEST(SlopeBound, OfAPoleAmongTheParametersNamesABoxAndEnds) {
  const SlopeBound bound = Bound<Pole>(Square(2), 0, 0, {1, 5});
  EXPECT_EQ(bound.upper, kInfinity);
  EXPECT_FALSE(bound.unbounded.empty());
}

TEST(SlopeBound, BesideAPoleIsFinite) {
  ExpectSupremum(Bound<Pole>(Square(2), 0, 0, {2.5, 4}), 4);
  Domain domain = Square(2);  // the pole at 1 is in the box, not in the domain
  Eigen::VectorXd coefficients(3);
  coefficients << 1, 0, 0;
  domain.inequalities.push_back({coefficients, 0.5});
  const SlopeBound bound = Bound<Pole>(domain, 0, 0, {1, 1});
  ExpectSupremum(bound, 4);
  EXPECT_TRUE(bound.unbounded.empty());
}

// Widths that overflow, that are subnormal, that have no double between their ends: it ends, and what it says holds.
TEST(SlopeBound, EndsOnEveryScale) {
  const Interval one(1, 1);
  for (const double size : {kMaxDouble, 0x1p+1000, 0x1p+400, 1e-300, 0x1p-1022, 0x3p-1074, 0x1p-1074, 0.0}) {
    const Domain domain = Square(size);
    for (const auto& [row, column] : {std::pair{0, 0}, {0, 1}, {1, 0}, {1, 1}, {1, 2}}) {
      const SlopeBound wave = BoundSlope(EquationsSlopes<Wave>(), domain, {&one, 1}, row, column, {1e-7, 3000});
      const SlopeBound cubic = BoundSlope(EquationsSlopes<Cubic>(), domain, {&one, 1}, row, column, {1e-7, 3000});
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
        EXPECT_GE(wave.upper, std::min(2 * size, kMaxDouble));  // |z0 + z1|
      }
    }
  }
}

// Slopes that are finite up to the largest double, over ranges whose width overflows: none may come out as nothing.
TEST(SlopeBound, NextToOverflowNothingIsTakenForZero) {
  const Interval one(1, 1);
  for (const double size : {0x1p+341, 0x1p+511, 0x1p+512, 0x1p+600}) {
    const Domain domain = Square(size);
    for (int column = 0; column < 2; ++column) {
      const SlopeBound bound = BoundSlope(EquationsSlopes<Pole>(), domain, {&one, 1}, 1, column, {1e-7, 3000});
      EXPECT_GE(bound.upper, size);  // |z_other z2^2|, |z2| <= 1
    }
  }
}

TEST(SlopeBound, RefusesWhatDoesNotFit) {
  const Family family = Bicycle();
  EXPECT_THROW((void)family.Bound(6, 0), std::invalid_argument);
  EXPECT_THROW((void)family.Bound(0, 8), std::invalid_argument);
  EXPECT_THROW((void)family.Bound(2, 3, {0, 10}), std::invalid_argument);
  EXPECT_THROW((void)BoundSlope(*family.slopes, family.domain, {}, 2, 3), std::invalid_argument);
  ParametricResidual other = family.residual;
  other.parameters[3].lower = 2;
  EXPECT_THROW((void)ParameterRanges(*family.slopes, other), std::invalid_argument);
  EXPECT_THROW((void)MakeResidualSlopes("none"), std::invalid_argument);
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
      family.domain.Contains(std::span(bound.point).first(static_cast<std::size_t>(family.slopes->num_variables()))));
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
    for (int k = 0; k < 6; ++k) EXPECT_EQ(bicycle.slopes->Occurs(k, l), k == 2 && (l == 3 || l == 5)) << k << l;
  for (int l = 0; l < 6; ++l)
    for (int k = 0; k < 4; ++k) EXPECT_EQ(point_mass.slopes->Occurs(k, l), l == 2 || l == 3) << k << l;
}

// Slopes at random points and parameters, by a difference quotient in extended precision.
template <class Residual>
double SampledMaximum(const Family& family, int row, int column, int count) {
  std::mt19937_64 random(7);
  const auto uniform = [&](double lower, double upper) {
    return lower + (upper - lower) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  const auto variables = static_cast<std::size_t>(family.slopes->num_variables());
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
    std::vector<long double> p, w(z.begin(), z.end()), ahead(static_cast<std::size_t>(family.slopes->num_states())),
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
  for (const double widen : {0.0, 0.05, 0.1, 0.2}) {
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

}  // namespace
}  // namespace forereach
