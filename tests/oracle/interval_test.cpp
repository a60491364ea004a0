// Interval arithmetic against exact ranges, and the trigonometric functions against 256-bit values.
#include "forereach/numerics/interval.h"

#include "tests/test.h"

#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::interval_test {

const double kNan = std::numeric_limits<double>::quiet_NaN();

double Up(double x, int doubles) {
  for (int i = 0; i < doubles; ++i) x = NextUp(x);
  return x;
}

// Contains [lowest, highest], and reaches at most two doubles beyond. An overflow may give up on both ends.
void ExpectRange(const Interval& range, const Rational& lowest, const Rational& highest) {
  ASSERT_LE(range.lower, range.upper);
  ASSERT_TRUE(AtLeast(lowest, range.lower)) << range.lower;
  ASSERT_TRUE(AtMost(highest, range.upper)) << range.upper;
  const double least = Ceiling(highest), largest = Floor(lowest);
  if (least == kInfinity || largest == -kInfinity) {
    ASSERT_FALSE(range.IsFinite());
    return;
  }
  ASSERT_LE(range.upper, Up(least, 2));
  ASSERT_GE(range.lower, -Up(-largest, 2));
}

Rational Result(const Rational& a, const Rational& b, char operation) {
  switch (operation) {
    case '+': return a + b;
    case '-': return a - b;
    case '*': return a * b;
    default: return a / b;
  }
}

Interval Result(const Interval& a, const Interval& b, char operation) {
  switch (operation) {
    case '+': return a + b;
    case '-': return a - b;
    case '*': return a * b;
    default: return a / b;
  }
}

class IntervalOperation : public testing::TestWithParam<char> {};

// All four operations are monotone in each operand, so the exact range is spanned by the ends.
TEST_P(IntervalOperation, IsTheRangeUpToTwoDoubles) {
  for (TracedRandom random(201); random.Again(20000);) {
    const Interval a = random.AnyInterval(), b = random.AnyInterval();
    if (GetParam() == '/' && b.Contains(0)) {
      ASSERT_EQ(a / b, Interval::Entire());
      continue;
    }
    std::vector<Rational> ends;
    for (const double x : {a.lower, a.upper})
      for (const double y : {b.lower, b.upper}) ends.push_back(Result(Rational(x), Rational(y), GetParam()));
    SCOPED_TRACE(testing::Message() << "[" << a.lower << ", " << a.upper << "] " << GetParam() << " [" << b.lower
                                    << ", " << b.upper << "]");
    ExpectRange(Result(a, b, GetParam()), *std::min_element(ends.begin(), ends.end()),
                *std::max_element(ends.begin(), ends.end()));
    if (HasFatalFailure()) return;
  }
}

TEST_P(IntervalOperation, OfNanOrInfinityHasNoFiniteBound) {
  for (const Interval& strange : {Interval(kNan), Interval(-kInfinity, 1), Interval(0, kInfinity), Interval::Entire()})
    for (const Interval& plain : {Interval(0), Interval(1, 2), Interval(-1, 1), strange}) {
      for (const Interval& result : {Result(strange, plain, GetParam()), Result(plain, strange, GetParam())}) {
        EXPECT_LE(result.lower, result.upper);
        EXPECT_FALSE(result.IsFinite());
      }
    }
}

INSTANTIATE_TEST_SUITE_P(All, IntervalOperation, testing::Values('+', '-', '*', '/'));

// Halving is not exact where an end is an odd subnormal, and a width may overflow.
TEST(Interval, HalfWidthAndMiddleHoldAtEveryScale) {
  TracedRandom random(203);
  const auto small = [&] { return random.Sign() * random.Integer(0, 9) * 0x1p-1074; };
  const auto huge = [&] { return random.Sign() * (kMaxDouble - random.Integer(0, 9) * 0x1p+970); };
  for (int trial = 0; trial < 60000; ++trial) {
    const auto end = [&] { return trial % 3 == 0 ? small() : trial % 3 == 1 ? huge() : random.Double(); };
    const double a = end(), b = random.Coin(0.1) ? a : random.Coin(0.1) ? random.Near(a) : end();
    const Interval x(std::min(a, b), std::max(a, b));
    const Rational half = (Rational(x.upper) - Rational(x.lower)) / 2;
    SCOPED_TRACE(testing::Message() << std::hexfloat << "[" << x.lower << ", " << x.upper << "]");
    ASSERT_TRUE(AtMost(half, x.HalfWidthUpper())) << x.HalfWidthUpper();
    ASSERT_LE(x.HalfWidthUpper(), Up(Ceiling(half), 2));
    ASSERT_TRUE(x.Contains(x.Middle()));
    for (const double y : {x.Middle(), x.lower, x.upper}) {
      const Rational reach =
          std::max(Rational(Rational(x.upper) - Rational(y)), Rational(Rational(y) - Rational(x.lower)));
      ASSERT_TRUE(AtMost(reach, x.DistanceUpper(y))) << x.DistanceUpper(y);
    }
  }
  EXPECT_EQ(Interval(0, 0x1p-1074).HalfWidthUpper(), 0x1p-1074);
  EXPECT_EQ(Interval(-0x1p-1074, 0).HalfWidthUpper(), 0x1p-1074);
  EXPECT_EQ(Interval(-kMaxDouble, kMaxDouble).HalfWidthUpper(), kMaxDouble);
  EXPECT_EQ(Interval(-1, 2).HalfWidthUpper(), 1.5);
}

TEST(Directed, HalfUpIsTheLeastDoubleThatIsNotBelowTheHalf) {
  for (TracedRandom random(204); random.Again(60000);) {
    const double x = random.trial() % 2 == 0 ? random.Double() : random.Sign() * random.Integer(0, 1000) * 0x1p-1074;
    ASSERT_EQ(HalfUp(x), Ceiling(Rational(x) / 2)) << std::hexfloat << x;
  }
  EXPECT_EQ(HalfUp(kInfinity), kInfinity);
  EXPECT_EQ(HalfUp(-kInfinity), -kInfinity);
  EXPECT_TRUE(std::isnan(HalfUp(kNan)));
}

TEST(Interval, SquareIsTheRangeUpToTwoDoubles) {
  for (TracedRandom random(202); random.Again(20000);) {
    const Interval x = random.AnyInterval();
    const Rational lower(x.lower), upper(x.upper), a = lower * lower, b = upper * upper;
    ExpectRange(sqr(x), x.Contains(0) ? Rational(0) : Rational(std::min(a, b)), std::max(a, b));
    if (HasFatalFailure()) return;
  }
  EXPECT_EQ(sqr(Interval(-2, 1)), Interval(0, 4));
  EXPECT_EQ(sqr(Interval(kNan)), Interval::Entire());
}

TEST(Interval, DivisionByAnIntervalThatTouchesZeroIsEntire) {
  for (const Interval& b :
       {Interval(0), Interval(-0.0), Interval(0, 1), Interval(-1, 0), Interval(-1, 1), Interval(-0.0, 1)})
    EXPECT_EQ(Interval(1, 2) / b, Interval::Entire());
  EXPECT_NE(Interval(1, 2) / Interval(0x1p-1074, 1), Interval::Entire());
}

TEST(Interval, ProductsWithZeroAreZero) {
  for (const double zero : {0.0, -0.0})
    for (const Interval& x : {Interval(-1, 2), Interval(0), Interval(-0.0, 0.0), Interval(-kMaxDouble, kMaxDouble)}) {
      EXPECT_EQ(Interval(zero) * x, Interval(0));
      EXPECT_EQ(x * Interval(zero), Interval(0));
    }
}

TEST(Interval, MiddleLiesInsideAndDistanceReachesTheEnds) {
  for (TracedRandom random(203); random.Again(20000);) {
    const Interval x = random.AnyInterval();
    const double middle = x.Middle(), y = random.Near(x.lower);
    ASSERT_TRUE(x.Contains(middle));
    for (const double end : {x.lower, x.upper}) {
      ASSERT_TRUE(AtMost(abs(Rational(end) - Rational(y)), x.DistanceUpper(y)));
      ASSERT_TRUE(AtMost(abs(Rational(end)), x.Magnitude()));
    }
  }
}

enum class Function { kSin, kCos, kTan };

Interval Enclose(Function f, const Interval& x) {
  return f == Function::kSin ? sin(x) : f == Function::kCos ? cos(x) : tan(x);
}

Real Value(Function f, double x) {
  return f == Function::kSin ? sin(Real(x)) : f == Function::kCos ? cos(Real(x)) : tan(Real(x));
}

// Whether (offset + period j) pi / 2 lies in x for an integer j; 256 bits decide it for every double.
bool Holds(const Interval& x, double offset, double period) {
  const Real half_pi = Real::Pi() / 2.0;
  const auto turns = [&](double end) { return (Real(end) / half_pi - offset) / period; };
  const double guess = std::ceil(turns(x.lower).ToDouble());
  for (const double j : {guess - 1, guess, guess + 1})
    if (turns(x.lower) <= Real(j) && Real(j) <= turns(x.upper)) return true;
  return false;
}

// The exact range; nothing where the tangent has none.
std::optional<std::pair<Real, Real>> Range(Function f, const Interval& x) {
  const Real a = Value(f, x.lower), b = Value(f, x.upper);
  if (f == Function::kTan) {
    if (Holds(x, 1, 2)) return std::nullopt;
    return std::pair(a, b);
  }
  const double maximum_at = f == Function::kSin ? 1 : 0;
  return std::pair(Holds(x, maximum_at + 2, 4) ? Real(-1)
                   : a < b                     ? a
                                               : b,
                   Holds(x, maximum_at, 4) ? Real(1)
                   : a < b                 ? b
                                           : a);
}

// A double x >= 0 with the unit in the last place of the function's value there.
double Ulp(double x) { return NextUp(std::abs(x)) - std::abs(x); }

void ExpectFunctionRange(Function f, const Interval& x) {
  const Interval range = Enclose(f, x);
  const auto exact_range = Range(f, x);
  SCOPED_TRACE(testing::Message() << "function " << static_cast<int>(f) << " on [" << x.lower << ", " << x.upper
                                  << "]");
  if (!exact_range) {
    ASSERT_EQ(range, Interval::Entire());
    return;
  }
  const auto& [lowest, highest] = *exact_range;
  ASSERT_LE(Real(range.lower), lowest);
  ASSERT_LE(highest, Real(range.upper));
  if (f == Function::kTan && !range.IsFinite()) {  // undecided this close to a pole
    ASSERT_GT(std::max(std::abs(lowest.ToDouble()), std::abs(highest.ToDouble())), 1e8);
    return;
  }
  ASSERT_GE(range.lower, lowest.ToDouble() - 4 * Ulp(lowest.ToDouble()));
  ASSERT_LE(range.upper, highest.ToDouble() + 4 * Ulp(highest.ToDouble()));
}

// Points and intervals of every width; many next to a multiple of pi / 2.
Interval Angle(Random& random) {
  const double size = std::ldexp(1, random.Integer(-40, 20));
  double start = random.Uniform(-size, size);
  if (random.Coin(0.4)) {
    const double multiple = random.Integer(-600000, 600000) >> random.Below(19);
    start = (Real::Pi() * multiple / 2.0).ToDouble();
    for (int i = random.Below(3); i > 0; --i) start = random.Coin() ? NextUp(start) : NextDown(start);
  }
  const double width = random.Coin(0.3) ? 0 : std::ldexp(random.Uniform(0, 1), random.Integer(-52, 4));
  const double end = random.Coin(0.1) ? NextUp(start) : start + width;
  return {std::max(std::min(start, end), -0x1p20), std::min(std::max(start, end), 0x1p20)};
}

class Trigonometric : public testing::TestWithParam<Function> {};

TEST_P(Trigonometric, IsTheTrueRange) {
  for (TracedRandom random(204); random.Again(30000);) {
    const Interval x = Angle(random);
    if (x.lower > x.upper) continue;
    ExpectFunctionRange(GetParam(), x);
    if (HasFatalFailure()) return;
  }
}

TEST_P(Trigonometric, HoldsAtEveryMultipleOfHalfPi) {
  for (int multiple = -3000; multiple <= 3000; ++multiple) {
    const double near = (Real::Pi() * static_cast<double>(multiple) / 2.0).ToDouble();
    const double below = NextDown(near), above = NextUp(near);
    for (const Interval& x : {Interval(near), Interval(below, near), Interval(near, above), Interval(below, above),
                              Interval(near, near + 1), Interval(near - 1, near), Interval(near, near + 3.2)})
      ExpectFunctionRange(GetParam(), x);
    if (HasFatalFailure()) return;
  }
}

TEST_P(Trigonometric, OfTinyArgumentsIsTight) {
  for (const double x : {0.0, -0.0, 0x1p-1074, -0x1p-1074, 0x1p-1022, 1e-300, 1e-20, -1e-8})
    ExpectFunctionRange(GetParam(), x);
}

TEST_P(Trigonometric, OfArgumentsTooLargeToReduceIsEverything) {
  const Interval everything = GetParam() == Function::kTan ? Interval::Entire() : Interval(-1, 1);
  const double worst = std::ldexp(6381956970095103.0, 797);  // the double closest to a multiple of pi / 2
  for (const Interval& x : {Interval(worst), Interval(NextUp(0x1p20)), Interval(-kMaxDouble, 0)})
    EXPECT_EQ(Enclose(GetParam(), x), everything);
  for (const Interval& x : {Interval(kNan), Interval(1, kNan), Interval::Entire(), Interval(0, kInfinity)})
    EXPECT_EQ(Enclose(GetParam(), x), Interval::Entire());
}

// What elementary.cpp assumes of the C library, two units in the last place, measured.
TEST_P(Trigonometric, LibraryErrorIsBelowOneUnit) {
  double worst = 0, worst_at = 0;
  for (TracedRandom random(205); random.Again(60000);) {
    const double x = Angle(random).lower;
    const double value = GetParam() == Function::kSin   ? std::sin(x)
                         : GetParam() == Function::kCos ? std::cos(x)
                                                        : std::tan(x);
    const Real true_value = Value(GetParam(), x);
    const double error = std::abs((Real(value) - true_value).ToDouble()) / Ulp(true_value.ToDouble());
    if (error > worst) worst = error, worst_at = x;
  }
  RecordProperty("worst_ulps", std::to_string(worst));
  EXPECT_LT(worst, 1) << "at " << worst_at;
  EXPECT_GT(worst, 0.4) << "a measurement that finds no error measures nothing";
}

INSTANTIATE_TEST_SUITE_P(All, Trigonometric, testing::Values(Function::kSin, Function::kCos, Function::kTan));

}  // namespace forereach::interval_test
