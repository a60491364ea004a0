// Elementary functions over intervals against values of 256 bits: the range contains the exact values, reaches little
// beyond them, and is infinite where the function is undefined.
#include "forereach/numerics/elementary.h"

#include "tests/test.h"

#include <climits>

#include "forereach/dynamics/saturation.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::elementary_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kTiny = std::numeric_limits<double>::denorm_min();

// A monotone function.
struct Function {
  const char* name;
  Interval (*enclose)(const Interval&);
  Real (*value)(const Real&);
  double (*library)(double);
  double lower, upper;  // the domain
  bool changes_sign = false;
  int allowed_ulps = 1;  // what is assumed of the C library
  int doubles = 2;       // by which an end is moved
  friend void PrintTo(const Function& f, std::ostream* out) { *out << f.name; }
};

#define FOREREACH_FUNCTION(name) \
#name, [](const Interval&      \
                x) { return name(x); }, [](const Real& x) { return name(x); }, [](double x) { return std::name(x); }

const std::array kFunctions{
    Function{FOREREACH_FUNCTION(exp), -kMaxDouble, kMaxDouble},
    Function{FOREREACH_FUNCTION(log), kTiny, kMaxDouble, true},
    Function{FOREREACH_FUNCTION(log1p), NextUp(-1), kMaxDouble},
    Function{FOREREACH_FUNCTION(sqrt), 0, kMaxDouble},
    Function{FOREREACH_FUNCTION(asin), -1, 1, true},
    Function{FOREREACH_FUNCTION(acos), -1, 1},
    Function{FOREREACH_FUNCTION(atan), -kMaxDouble, kMaxDouble, true},
    Function{FOREREACH_FUNCTION(tanh), -kMaxDouble, kMaxDouble, true, 3, 8},
};

struct Elementary : testing::TestWithParam<Function> {
  [[nodiscard]] static bool InDomain(double x) { return GetParam().lower <= x && x <= GetParam().upper; }

  // A number of the domain: anything, a moderate one, or one next to an end of the domain or to a special value.
  static double AnyArgument(Random& random) {
    static constexpr std::array special{0.0,        1.0,     -1.0,
                                        0.5,        -0.5,    0x1p-1022,
                                        -0x1p-1022, 0x1p-27, -0x1p-27,
                                        22.0,       709.0,   709.782712893384,
                                        -708.4,     -745.13, 0.70710678118654757};
    while (true) {
      const double center = random.Coin(0.2)   ? (random.Coin() ? GetParam().lower : GetParam().upper)
                            : random.Coin(0.2) ? special[random.Below(special.size())]
                            : random.Coin()    ? random.Uniform(-3, 3)
                                               : random.Double();
      const double x = random.Coin(0.3)   ? std::nextafter(center, random.Sign() * kInfinity)
                       : random.Coin(0.2) ? center * (1 + random.Uniform(-1, 1) * std::ldexp(1, -random.Integer(0, 50)))
                                          : center;
      if (InDomain(x)) return x;
    }
  }

  static Interval AnyInterval(Random& random) {
    const double x = AnyArgument(random), y = random.Coin(0.2) ? x : AnyArgument(random);
    return {std::min(x, y), std::max(x, y)};
  }
};

// The distance from a value to a bound beside it in doubles, at least 0.
int DoublesBetween(double from, double to, int most) {
  int doubles = 0;
  while (from != to && doubles <= most) from = std::nextafter(from, to), ++doubles;
  return doubles;
}

TEST_P(Elementary, ContainsTheRangeAndReachesFewDoublesBeyond) {
  const Function& f = GetParam();
  for (TracedRandom random(220); random.Again(12000);) {
    const Interval x = AnyInterval(random), range = f.enclose(x);
    SCOPED_TRACE(testing::Message() << std::hexfloat << f.name << "[" << x.lower << ", " << x.upper << "] = ["
                                    << range.lower << ", " << range.upper << "]");
    ASSERT_LE(range.lower, range.upper);
    for (const double t :
         {x.lower, x.upper, x.Middle(), std::clamp(random.Uniform(x.lower, x.upper), x.lower, x.upper)})
      ASSERT_TRUE(Inside(f.value(Real(t)), range)) << t;
    const Real at_lower = f.value(Real(x.lower)), at_upper = f.value(Real(x.upper));
    const double lowest = std::min(at_lower, at_upper).ToDouble(), highest = std::max(at_lower, at_upper).ToDouble();
    ASSERT_LE(DoublesBetween(lowest, range.lower, f.doubles + 9), f.doubles + f.allowed_ulps);
    ASSERT_LE(DoublesBetween(highest, range.upper, f.doubles + 9), f.doubles + f.allowed_ulps);
  }
}

TEST_P(Elementary, IsEverythingWhereTheArgumentLeavesTheDomain) {
  const Function& f = GetParam();
  for (const Interval& x :
       {Interval(kNan), Interval(kNan, 1), Interval(0.5, kNan), Interval::Entire(), Interval(0.5, kInfinity),
        Interval(-kInfinity, 0.5), Interval(kInfinity), Interval(-kInfinity)})
    EXPECT_EQ(f.enclose(x), Interval::Entire()) << x.lower << ", " << x.upper;
  for (const double outside : {NextDown(f.lower), NextUp(f.upper)}) {
    if (!std::isfinite(outside)) continue;
    for (const double inside : {f.lower, outside, std::max(f.lower, std::min(f.upper, 0.5))})
      EXPECT_EQ(f.enclose({std::min(inside, outside), std::max(inside, outside)}), Interval::Entire()) << inside;
  }
}

TEST_P(Elementary, KeepsTheSignOfTheFunction) {
  const Function& f = GetParam();
  if (f.name == std::string("log1p")) return;  // widened on both sides of 0 alike
  for (TracedRandom random(221); random.Again(10000);) {
    const Interval x = AnyInterval(random), range = f.enclose(x);
    const Real at_lower = f.value(Real(x.lower)), at_upper = f.value(Real(x.upper));
    const bool is_positive = at_lower >= Real(0) && at_upper >= Real(0),
               is_negative = f.changes_sign && at_lower <= Real(0) && at_upper <= Real(0);
    ASSERT_TRUE(!is_positive || range.lower >= 0) << x.lower << ": " << range.lower;
    ASSERT_TRUE(!is_negative || range.upper <= 0) << x.upper << ": " << range.upper;
  }
}

// What elementary.h assumes of the C library, measured.
TEST_P(Elementary, LibraryErrorIsWithinWhatIsAssumed) {
  const Function& f = GetParam();
  double worst = 0, worst_at = 0;
  for (TracedRandom random(222); random.Again(30000);) {
    const double x = AnyArgument(random), value = f.library(x);
    const Real exact_value = f.value(Real(x));
    const double size = std::abs(exact_value.ToDouble());
    if (!(size < kInfinity)) continue;
    const double below = NextUp(size) - size;
    const double error = (abs(Real(value) - exact_value) / Real(below)).ToDouble();
    if (error > worst) worst = error, worst_at = x;
  }
  RecordProperty("worst_ulps", std::to_string(worst));
  EXPECT_LE(worst, f.allowed_ulps) << "at " << worst_at;
  EXPECT_GT(worst, 0.4) << "a measurement that finds no error measures nothing";
}

INSTANTIATE_TEST_SUITE_P(All, Elementary, testing::ValuesIn(kFunctions),
                         [](const auto& f) { return std::string(f.param.name); });

TEST(Elementary, EnclosesAtOverflowAndUnderflow) {
  EXPECT_EQ(exp(Interval(-800)).lower, 0);
  EXPECT_EQ(exp(Interval(800)).upper, kInfinity);
  EXPECT_EQ(tanh(Interval(-kMaxDouble, kMaxDouble)), Interval(-1, 1));
  EXPECT_EQ(tanh(Interval(0)).lower, 0);
  EXPECT_EQ(sqrt(Interval(0, 4)), Interval(0, 2));
  EXPECT_EQ(sqrt(Interval(-0.0, 4)), Interval(0, 2));
}

// ---- The angle.

Real Angle(double y, double x) { return atan2(Real(y), Real(x)); }

void ExpectAngles(const Interval& y, const Interval& x, Random& random) {
  const Interval range = atan2(y, x);
  SCOPED_TRACE(testing::Message() << std::hexfloat << "y [" << y.lower << ", " << y.upper << "], x [" << x.lower << ", "
                                  << x.upper << "]: [" << range.lower << ", " << range.upper << "]");
  if (y.Contains(0) && x.lower <= 0) {
    ASSERT_EQ(range, Interval::Entire());
    return;
  }
  Real lowest = Angle(y.lower, x.lower), highest = lowest;
  for (const double t : {y.lower, y.upper})
    for (const double s : {x.lower, x.upper}) {
      const Real angle = Angle(t, s);
      ASSERT_TRUE(Inside(angle, range)) << t << ", " << s;
      lowest = std::min(lowest, angle);
      highest = std::max(highest, angle);
    }
  for (int sample = 0; sample < 4; ++sample) {
    const double t = std::clamp(random.Uniform(y.lower, y.upper), y.lower, y.upper),
                 s = std::clamp(random.Uniform(x.lower, x.upper), x.lower, x.upper);
    ASSERT_TRUE(Inside(Angle(t, s), range)) << t << ", " << s;
  }
  ASSERT_LE(DoublesBetween(lowest.ToDouble(), range.lower, 4), 3);
  ASSERT_LE(DoublesBetween(highest.ToDouble(), range.upper, 4), 3);
}

TEST(Atan2, IsTheRangeOfTheAngles) {
  TracedRandom random(223);
  const auto any = [&] {
    const double a = random.Coin(0.1) ? 0 : random.Coin() ? random.Uniform(-2, 2) : random.Double();
    const double b = random.Coin(0.2) ? a : random.Coin() ? random.Uniform(-2, 2) : random.Near(a);
    return Interval(std::min(a, b), std::max(a, b));
  };
  int angles = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const Interval y = any(), x = any();
    ExpectAngles(y, x, random);
    if (HasFatalFailure()) return;
    angles += atan2(y, x).IsFinite();
  }
  EXPECT_GT(angles, 8000);
}

TEST(Atan2, EnclosesAtTheAxesAndAtTheCut) {
  TracedRandom random(224);
  constexpr std::array ends{-kMaxDouble, -1.0, -0x1p-1022, -kTiny, -0.0, 0.0, kTiny, 0x1p-1022, 1.0, kMaxDouble};
  for (std::size_t a = 0; a < ends.size(); ++a)
    for (std::size_t b = a; b < ends.size(); ++b)
      for (std::size_t c = 0; c < ends.size(); ++c)
        for (std::size_t d = c; d < ends.size(); ++d) {
          ExpectAngles({ends[a], ends[b]}, {ends[c], ends[d]}, random);
          if (HasFatalFailure()) return;
        }
  for (const Interval& strange : {Interval(kNan), Interval(1, kNan), Interval(1, kInfinity), Interval::Entire()}) {
    EXPECT_EQ(atan2(strange, Interval(1)), Interval::Entire());
    EXPECT_EQ(atan2(Interval(1), strange), Interval::Entire());
  }
}

TEST(Atan2, LibraryErrorIsBelowOneUnit) {
  double worst = 0;
  for (TracedRandom random(225); random.Again(30000);) {
    const double y = random.Double(), x = random.Coin() ? random.Near(y) : random.Double();
    if (y == 0 && x <= 0) continue;
    const Real exact_value = Angle(y, x);
    const double size = std::abs(exact_value.ToDouble());
    worst = std::max(worst, (abs(Real(std::atan2(y, x)) - exact_value) / Real(NextUp(size) - size)).ToDouble());
  }
  RecordProperty("worst_ulps", std::to_string(worst));
  EXPECT_LE(worst, 1);
  EXPECT_GT(worst, 0.4);
}

// ---- Powers.

TEST(Power, IsTheRange) {
  for (TracedRandom random(226); random.Again(60000);) {
    const double a = random.Coin() ? random.Uniform(-3, 3) : random.Double(), b = random.Near(a);
    const Interval x(std::min(a, b), std::max(a, b));
    const int n = random.Coin() ? random.Integer(-4, 4) : random.Integer(-64, 64);
    const Interval range = pow(x, n);
    SCOPED_TRACE(testing::Message() << std::hexfloat << "[" << x.lower << ", " << x.upper << "]^" << n << " = ["
                                    << range.lower << ", " << range.upper << "]");
    ASSERT_LE(range.lower, range.upper);
    if (n < 0 && x.Contains(0)) {
      ASSERT_EQ(range, Interval::Entire());
      continue;
    }
    std::vector<Real> values;
    for (const double t : {x.lower, x.upper, std::clamp(random.Uniform(x.lower, x.upper), x.lower, x.upper)})
      values.push_back(pow(Real(t), n));
    if (x.Contains(0) && n > 0) values.emplace_back(0.0);
    for (const Real& value : values) ASSERT_TRUE(Inside(value, range) || !range.IsFinite());
    const double lowest = std::min_element(values.begin(), values.end())->ToDouble(),
                 highest = std::max_element(values.begin(), values.end())->ToDouble();
    if (!std::isfinite(lowest) || !std::isfinite(highest)) continue;
    const double relative = 2 * std::abs(n) * 0x1p-52, least = 0x1p-1000;
    if (range.IsFinite()) {
      ASSERT_GE(range.lower, lowest - std::max(relative * std::abs(lowest), least));
      ASSERT_LE(range.upper, highest + std::max(relative * std::abs(highest), least));
    } else {
      ASSERT_GT(std::max(std::abs(lowest), std::abs(highest)), 1e300);
    }
    ASSERT_TRUE(n % 2 != 0 || range.lower >= 0);
  }
}

TEST(Power, OfSmallNumbersIsExact) {
  EXPECT_EQ(pow(Interval(-2, 3), 2), Interval(0, 9));
  EXPECT_EQ(pow(Interval(-2, 3), 3), Interval(-8, 27));
  EXPECT_EQ(pow(Interval(-3, -2), 4), Interval(16, 81));
  EXPECT_EQ(pow(Interval(-3, 2), 0), Interval(1));
  EXPECT_EQ(pow(Interval(0), 0), Interval(1));
  EXPECT_EQ(pow(Interval(-3, 2), 1), Interval(-3, 2));
  EXPECT_EQ(pow(Interval(-4, -2), -1), Interval(-0.5, -0.25));
  EXPECT_EQ(pow(Interval(-4, -2), -2), Interval(0.0625, 0.25));
  EXPECT_EQ(pow(Interval(2), 64), Interval(0x1p64));
  EXPECT_EQ(pow(Interval(1), INT_MIN), Interval(1));
  EXPECT_EQ(pow(Interval(-1), INT_MAX), Interval(-1));
  EXPECT_EQ(pow(Interval(0.5), INT_MAX).lower, 0);
}

TEST(Power, OverflowsToInfinityAndUnderflowsToZero) {
  EXPECT_EQ(pow(Interval(-1e200, 2), 3), Interval(-kInfinity, 8));
  EXPECT_EQ(pow(Interval(1e200), 2).upper, kInfinity);
  const Interval tiny = pow(Interval(1e-200, 1e-180), 2);
  EXPECT_EQ(tiny.lower, 0);
  EXPECT_GT(tiny.upper, 0);
  for (const Interval& strange : {Interval(kNan), Interval(1, kNan), Interval(1, kInfinity), Interval::Entire()})
    for (const int n : {-2, -1, 0, 1, 2, 3}) EXPECT_EQ(pow(strange, n), Interval::Entire());
}

// ---- What is exact.

TEST(AbsMinMax, AreExact) {
  EXPECT_EQ(abs(Interval(-2, 1)), Interval(0, 2));
  EXPECT_EQ(abs(Interval(-2, 0)), Interval(0, 2));
  EXPECT_EQ(abs(Interval(-2, -1)), Interval(1, 2));
  EXPECT_EQ(abs(Interval(kTiny, 3)), Interval(kTiny, 3));
  EXPECT_EQ(max(Interval(-2, 1), Interval(-1, 0)), Interval(-1, 1));
  EXPECT_EQ(min(Interval(-2, 1), Interval(-1, 0)), Interval(-2, 0));
  for (const Interval& strange : {Interval(kNan), Interval(1, kNan), Interval(1, kInfinity), Interval::Entire()}) {
    EXPECT_EQ(abs(strange), Interval::Entire());
    for (const Interval& result :
         {min(strange, Interval(0)), min(Interval(0), strange), max(strange, Interval(9)), max(Interval(9), strange),
          step(strange), sign(strange), kink(strange), cut(strange, Interval(1)), cut(Interval(1), strange)})
      EXPECT_EQ(result, Interval::Entire());
  }
}

TEST(Kinks, AFunctionHasAKinkWhereItsIntervalMeetsZero) {
  struct Case {
    Interval x, step, sign, kink;
  };
  const Interval everything = Interval::Entire();
  for (const Case& c : {Case{{kTiny, 2}, 1, 1, 0}, Case{{-2, -kTiny}, 0, -1, 0},
                        Case{{0, 2}, {0, 1}, {-1, 1}, everything}, Case{{-2, -0.0}, {0, 1}, {-1, 1}, everything},
                        Case{0, {0, 1}, {-1, 1}, everything}, Case{{-1, 1}, {0, 1}, {-1, 1}, everything}}) {
    EXPECT_EQ(step(c.x), c.step) << c.x.lower;
    EXPECT_EQ(sign(c.x), c.sign) << c.x.lower;
    EXPECT_EQ(kink(c.x), c.kink) << c.x.lower;
  }
}

TEST(Cut, IsFoundOnTheNegativeHalfAxisAndAtTheOrigin) {
  const Interval nothing(0), everything = Interval::Entire();
  EXPECT_EQ(cut({-1, 1}, {kTiny, 2}), nothing);
  EXPECT_EQ(cut({-1, 1}, {0, 2}), everything);
  EXPECT_EQ(cut({kTiny, 1}, {-2, 2}), nothing);
  EXPECT_EQ(cut({0, 1}, {-2, 2}), everything);
  EXPECT_EQ(cut({-1, -kTiny}, {-2, -1}), nothing);
  EXPECT_EQ(cut({-1, -0.0}, {-2, -1}), everything);
}

// exp(-1/e) and its derivatives at points of the interval.
TEST(SmoothGateRanges, ContainTheExactValues) {
  for (TracedRandom random(12); random.Again(50'000);) {
    const double lower = std::pow(10, random.Uniform(-4, 1)) - 0.01, upper = lower + random.Uniform(0, 1);
    const DerivativeRanges ranges = SmoothGateRanges({lower, upper});
    const double x = random.trial() % 3 == 0   ? lower
                     : random.trial() % 3 == 1 ? upper
                                               : std::min(upper, random.Uniform(lower, upper));
    if (!(x > 0)) continue;
    const Real e(x), value = exp(Real(-1) / e), first = value / e / e, second = first * (Real(1) - Real(2) * e) / e / e;
    ASSERT_TRUE(Inside(value, ranges.value) && Inside(first, ranges.first) && Inside(second, ranges.second)) << x;
  }
  EXPECT_EQ(SmoothGateRanges(Interval::Entire()).value, Interval::Entire());
}

// t log(1 + exp(x / t)) and its first and second derivatives, at points of the box. With s = exp(-|u|), u = x / t, all
// are sums and products of numbers of one sign: nothing cancels.
TEST(SoftplusRanges, ContainTheExactValues) {
  TracedRandom random(13);
  const auto any_of = [&](const Interval& range) {
    const int which = random.Below(3);
    return which == 0   ? range.lower
           : which == 1 ? range.upper
                        : std::min(range.upper, random.Uniform(range.lower, range.upper));
  };
  const auto any_width = [&](double most) { return random.Below(3) == 0 ? 0 : random.Uniform(0, most); };
  const Real zero(0.0), one(1.0);
  for (int i = 0; i < 50'000; ++i) {
    const double least_x = random.Uniform(-5, 5), least_t = std::pow(10, random.Uniform(-3, 1));
    const Interval xs(least_x, least_x + any_width(3)), ts(least_t, least_t + any_width(least_t));
    const SoftplusRanges ranges(xs, ts);
    const double x = any_of(xs), t = any_of(ts);
    const Real u = Real(x) / Real(t), size = x > 0 ? u : zero - u, s = exp(zero - size), more = one + s;
    const Real slope = s / (more * more) / Real(t);
    ASSERT_TRUE(Inside(Real(t) * ((x > 0 ? u : zero) + log1p(s)), ranges.value)) << x << " " << t;
    ASSERT_TRUE(Inside((x > 0 ? one : s) / more, ranges.by_x)) << x << " " << t;
    ASSERT_TRUE(Inside(log1p(s) + size * s / more, ranges.by_temperature)) << x << " " << t;
    ASSERT_TRUE(Inside(slope, ranges.by_xx)) << x << " " << t;
    ASSERT_TRUE(Inside(zero - u * slope, ranges.by_xt)) << x << " " << t;
    ASSERT_TRUE(Inside(u * u * slope, ranges.by_tt)) << x << " " << t;
  }
}

TEST(SoftplusRanges, AreTightAtAPoint) {
  for (const double x : {-3.0, -0.1, 0.0, 0.1, 3.0}) {
    const SoftplusRanges ranges(x, 0.5);
    for (const Interval& range :
         {ranges.value, ranges.by_x, ranges.by_temperature, ranges.by_xx, ranges.by_xt, ranges.by_tt})
      EXPECT_LE(range.upper - range.lower, 1e-14 * range.Magnitude()) << x;
  }
}

TEST(SoftplusRanges, HaveNoBoundWhereTheTemperatureMayBeZero) {
  for (const Interval& temperature :
       {Interval(0), Interval(0, 1), Interval(-2, -1), Interval(kNan), Interval::Entire()}) {
    const SoftplusRanges ranges(Interval(0, 1), temperature);
    for (const Interval& range : {ranges.value, ranges.by_xx, ranges.by_xt, ranges.by_tt})
      EXPECT_EQ(range, Interval::Entire());
  }
}

}  // namespace forereach::elementary_test
