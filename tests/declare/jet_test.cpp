// Jets: derivatives against difference quotients in extended precision, kinks, zeros that stay zero.
#include "forereach/dynamics/jet.h"

#include "tests/test.h"

#include "forereach/dynamics/saturation.h"

namespace forereach::jet_test {

// One expression with every smooth operation of two arguments.
template <class T>
T Expression(const T& x, const T& y) {
  using std::cos, std::exp, std::sin, std::sqrt, std::tan;
  return sin(x * y) / (T(2) + cos(y)) + exp(-x) * tan(y / T(2)) - sqrt(x * x + y * y) +
         SmoothGate(x + y) * Softplus(x - y, T(1) + x * x);
}

TEST(Jet, EnclosesWhatDifferencesShow) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1.2, 1.2);
  constexpr long double kStep = 1e-5L;
  for (int i = 0; i < 2000; ++i) {
    const double x = uniform(random), y = uniform(random), width = std::ldexp(1.0, -2 - i % 20);
    const Jet jet =
        Expression(Jet::Argument({x - width, x + width}, 0, true), Jet::Argument({y - width, y + width}, 1, false));
    const auto at = [&](long double a, long double b) { return Expression<long double>(x + a, y + b); };
    const auto inside = [](long double value, const Interval& range, double slack) {
      return range.lower - slack <= value && value <= range.upper + slack;
    };
    if (!jet.slope.IsFinite()) continue;  // where the root's argument meets zero
    EXPECT_TRUE(inside(at(0, 0), jet.value, 1e-15));
    EXPECT_TRUE(inside((at(kStep, 0) - at(-kStep, 0)) / (2 * kStep), jet.slope, 1e-6));
    EXPECT_TRUE(inside((at(0, kStep) - at(0, -kStep)) / (2 * kStep), jet.gradient[1], 1e-6));
    EXPECT_TRUE(inside((at(kStep, 0) - 2 * at(0, 0) + at(-kStep, 0)) / (kStep * kStep), jet.curvature[0], 1e-3));
    const long double mixed =
        (at(kStep, kStep) - at(kStep, -kStep) - at(-kStep, kStep) + at(-kStep, -kStep)) / (4 * kStep * kStep);
    EXPECT_TRUE(inside(mixed, jet.curvature[1], 1e-3)) << x << " " << y << " " << width;
  }
}

TEST(Jet, AcrossAKinkTheSlopeCoversBothSidesAndTheCurvatureIsUnbounded) {
  const Jet across = abs(Jet::Argument({-1, 2}, 0, true)), beside = abs(Jet::Argument({0, 2}, 0, true));
  EXPECT_EQ(across.slope, Interval(-1, 1));
  EXPECT_FALSE(across.curvature[0].IsFinite());
  EXPECT_FIELDS(beside, (slope, Interval(1, 1)), (curvature[0], Interval(0, 0)));
  EXPECT_FIELDS(max(Jet::Argument({0, 2}, 0, true), Jet(1.0)), (value, Interval(1, 2)), (slope, Interval(0, 1)));
}

TEST(Jet, ASmoothGateThatIsOffIsExactlyZero) {
  const Jet off = SmoothGate(Jet::Argument({-3, 0}, 0, true));
  EXPECT_FIELDS(off, (value, Interval(0, 0)), (slope, Interval(0, 0)));
  EXPECT_EQ((off * abs(Jet::Argument({-1, 1}, 0, true))).curvature[0], Interval(0, 0));
}

// What a program's derivatives consist of.
TEST(Jet, OfJumpsIsFlatBesideThemAndUnboundedAcross) {
  const Jet beside = Jet::Argument({0.5, 2}, 0, true), across = Jet::Argument({-1, 2}, 0, true);
  EXPECT_EQ(step(beside).value, Interval(1, 1));
  EXPECT_EQ(sign(-beside).value, Interval(-1, -1));
  for (const Jet& flat : {step(beside), sign(-beside), kink(beside), cut(across, beside), cut(beside, across)}) {
    EXPECT_FIELDS(flat, (slope, Interval(0, 0)), (curvature[0], Interval(0, 0)));
  }
  EXPECT_EQ(step(across).value, Interval(0, 1));
  EXPECT_EQ(sign(across).value, Interval(-1, 1));
  for (const Jet& jump : {step(across), sign(across), kink(across), cut(across, -beside)})
    EXPECT_FALSE(jump.slope.IsFinite());
}

TEST(Jet, CurvatureOfTheTangentHasItsDerivatives) {
  const Jet t = TanCurvature(Jet::Argument({1, 2}, 0, true));  // 2 t + 2 t^3
  EXPECT_FIELDS(t, (value, Interval(4, 20)), (slope, Interval(8, 26)), (curvature[0], Interval(12, 24)));
}

TEST(Jet, SquareIsNotNegative) {
  const Jet x = Jet::Argument({-2, 3}, 0, true);
  EXPECT_EQ((x * x).value, Interval(0, 9));
  EXPECT_EQ((x * x).slope, Interval(-4, 6));
}

}  // namespace forereach::jet_test
