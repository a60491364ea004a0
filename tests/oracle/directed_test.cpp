// Directed rounding against exact rationals: never on the wrong side, and within a double
// of the closest bound, a root of a tiny number within two.
#include "forereach/numerics/directed.h"

#include "tests/test.h"

#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::directed_test {

constexpr int kTrials = 60000;
const double kNan = std::numeric_limits<double>::quiet_NaN();
const Rational kSmall = Rational(0x1p-960);

struct Operation {
  const char* name;
  friend void PrintTo(const Operation& operation, std::ostream* out) { *out << operation.name; }
  double (*up)(double, double);
  double (*down)(double, double);
  Rational (*exact)(const Rational&, const Rational&);
  bool divides = false;
};

const Operation kOperations[] = {
    {"+", AddUp, AddDown, [](const Rational& a, const Rational& b) { return Rational(a + b); }},
    {"-", SubUp, SubDown, [](const Rational& a, const Rational& b) { return Rational(a - b); }},
    {"*", MulUp, MulDown, [](const Rational& a, const Rational& b) { return Rational(a * b); }},
    {"/", DivUp, DivDown, [](const Rational& a, const Rational& b) { return Rational(a / b); }, true},
};

// Products and quotients may be one double wider where the error of the rounded result is no double, sums where its
// computation overflows.
bool MayBeOneWider(const Operation& operation, double a, double b, const Rational& result) {
  const bool scales = operation.up == MulUp || operation.divides;
  if (!scales) return std::abs(b) == kMaxDouble;
  return abs(result) <= kSmall || (operation.divides && abs(Rational(a)) < kSmall);
}

void ExpectBounds(const Operation& operation, double a, double b) {
  const Rational result = operation.exact(Rational(a), Rational(b));
  const double up = operation.up(a, b), down = operation.down(a, b);
  const double least = Ceiling(result), largest = Floor(result);
  ASSERT_TRUE(AtMost(result, up)) << a << " " << operation.name << " " << b << " <= " << up;
  ASSERT_TRUE(AtLeast(result, down)) << a << " " << operation.name << " " << b << " >= " << down;
  if (MayBeOneWider(operation, a, b, result)) {
    ASSERT_LE(up, NextUp(least)) << a << " " << operation.name << " " << b;
    ASSERT_GE(down, NextDown(largest)) << a << " " << operation.name << " " << b;
  } else {
    ASSERT_EQ(up, least) << a << " " << operation.name << " " << b;
    ASSERT_EQ(down, largest) << a << " " << operation.name << " " << b;
  }
}

class DirectedOperation : public testing::TestWithParam<Operation> {};

TEST_P(DirectedOperation, IsTheNeighbourOfTheExactResult) {
  for (TracedRandom random(101); random.Again(kTrials);) {
    const double a = random.Double(), b = random.Near(a);
    if (GetParam().divides && b == 0) continue;
    ExpectBounds(GetParam(), a, b);
    if (HasFatalFailure()) return;
  }
}

TEST_P(DirectedOperation, HoldsAtTheEndsOfTheDoubles) {
  std::vector<double> ends;
  for (const double x : {kMaxDouble, 0x1p1023, 0x1p970, 0x1p969, 0x1p-1022, 0x1p-1074, 0x1p-960, 0x1p-480, 1.0, 0.0})
    for (double y : {x, std::nextafter(x, 0.0), std::nextafter(x, kMaxDouble)})
      for (const double sign : {1.0, -1.0}) ends.push_back(sign * y);
  for (const double a : ends)
    for (const double b : ends) {
      if (GetParam().divides && b == 0) continue;
      ExpectBounds(GetParam(), a, b);
      if (HasFatalFailure()) return;
    }
}

// The textbook error of a sum overflows on its way where one operand is the largest double.
TEST_P(DirectedOperation, HoldsNextToTheLargestDouble) {
  for (TracedRandom random(107); random.Again(4000);) {
    const double large = random.Sign() * (random.Coin() ? kMaxDouble : NextDown(kMaxDouble));
    const double other = random.Sign() * std::ldexp(random.Uniform(1, 2), random.Integer(960, 1023));
    ExpectBounds(GetParam(), large, other);
    ExpectBounds(GetParam(), other, large);
    if (HasFatalFailure()) return;
  }
}

TEST_P(DirectedOperation, LeavesExactResultsAlone) {
  for (TracedRandom random(102); random.Again(2000);) {
    const double a = random.Integer(-(1 << 20), 1 << 20), b = std::ldexp(random.Sign(), random.Integer(-20, 20));
    const Rational result = GetParam().exact(Rational(a), Rational(b));
    ASSERT_EQ(Rational(GetParam().up(a, b)), result);
    ASSERT_EQ(Rational(GetParam().down(a, b)), result);
  }
}

TEST_P(DirectedOperation, PassesNanOn) {
  for (const double x : {0.0, 1.0, -1.0, kInfinity, -kInfinity, kNan, 0x1p-1074, kMaxDouble}) {
    EXPECT_TRUE(std::isnan(GetParam().up(kNan, x)));
    EXPECT_TRUE(std::isnan(GetParam().up(x, kNan)));
    EXPECT_TRUE(std::isnan(GetParam().down(kNan, x)));
    EXPECT_TRUE(std::isnan(GetParam().down(x, kNan)));
  }
}

INSTANTIATE_TEST_SUITE_P(All, DirectedOperation, testing::ValuesIn(kOperations));

TEST(Directed, InfiniteOperandsStayInfinite) {
  EXPECT_EQ(AddUp(kInfinity, -1), kInfinity);
  EXPECT_EQ(AddUp(-kInfinity, 1), -kInfinity);
  EXPECT_TRUE(std::isnan(AddUp(kInfinity, -kInfinity)));
  EXPECT_EQ(MulUp(-kInfinity, 2), -kInfinity);
  EXPECT_TRUE(std::isnan(MulUp(kInfinity, 0)));
  EXPECT_EQ(MulUp(kMaxDouble, -2), -kMaxDouble) << "an overflow bounds the finite product it stands for";
  EXPECT_EQ(MulDown(kMaxDouble, 2), kMaxDouble);
  EXPECT_EQ(DivUp(-1e300, 1e-300), -kMaxDouble);
}

TEST(Directed, NextDoublesAgreeWithTheLibrary) {
  for (TracedRandom random(103); random.Again(kTrials);) {
    const double x = random.Double();
    ASSERT_EQ(NextUp(x), std::nextafter(x, kInfinity)) << x;
    ASSERT_EQ(NextDown(x), std::nextafter(x, -kInfinity)) << x;
  }
  EXPECT_EQ(NextUp(kMaxDouble), kInfinity);
  EXPECT_EQ(NextUp(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(NextUp(kNan)));
  EXPECT_TRUE(std::isnan(NextDown(kNan)));
}

void ExpectRoot(double x) {
  const double up = SqrtUp(x), down = SqrtDown(x);
  ASSERT_GE(Rational(up) * Rational(up), Rational(x)) << x;
  ASSERT_LE(Rational(down) * Rational(down), Rational(x)) << x;
  ASSERT_GE(down, 0) << x;
  const double less = x < 0x1p-960 ? NextDown(NextDown(up)) : NextDown(up);
  if (x > 0) ASSERT_LT(Rational(less) * Rational(less), Rational(x)) << x;
  const double more = x < 0x1p-960 ? NextUp(NextUp(down)) : NextUp(down);
  ASSERT_GT(Rational(more) * Rational(more), Rational(x)) << x;
}

TEST(Directed, SquareRootsAreNeighbours) {
  for (TracedRandom random(104); random.Again(kTrials);) {
    const double x = std::abs(random.Double()), square = x * x;
    ExpectRoot(x);
    if (square < kInfinity) {
      ExpectRoot(square);
      ExpectRoot(NextUp(square));
    }
    if (HasFatalFailure()) return;
  }
}

TEST(Directed, SquareRootsOfSquaresAreExact) {
  for (int root = 0; root < 5000; ++root) {
    const double x = root;
    EXPECT_EQ(SqrtUp(x * x), x);
    EXPECT_EQ(SqrtDown(x * x), x);
  }
  EXPECT_TRUE(std::isnan(SqrtUp(-1)));
  EXPECT_EQ(SqrtUp(kInfinity), kInfinity);
}

// Terms of one size, of wildly different sizes, and so small that they are subnormal.
std::vector<double> Terms(Random& random, int count) {
  const int kind = random.Below(3);
  std::vector<double> terms;
  for (int i = 0; i < count; ++i)
    terms.push_back(std::ldexp(random.Uniform(0, 2), kind == 0   ? 0
                                                     : kind == 1 ? random.Integer(-60, 60)
                                                                 : random.Integer(-1074, -1060)));
  return terms;
}

TEST(Directed, SumUpperBoundsSumsInAnyOrder) {
  for (TracedRandom random(105); random.Again(20000);) {
    std::vector<double> terms = Terms(random, random.Integer(0, 112));
    if (random.Coin()) std::sort(terms.begin(), terms.end(), std::greater<>());  // the order that loses most
    double sum = 0;
    Rational exact_sum = 0;
    for (const double term : terms) sum += term, exact_sum += Rational(term);
    const double bound = SumUpper(sum, static_cast<int>(terms.size()));
    ASSERT_LE(exact_sum, Rational(bound));
    ASSERT_LE(Rational(bound), exact_sum * Rational(1 + 1e-13) + Rational(0x1p-1072));
  }
  EXPECT_EQ(SumUpper(0.1, 1), 0.1) << "nothing was rounded";
  EXPECT_EQ(SumUpper(kInfinity, 3), kInfinity);
  EXPECT_TRUE(std::isnan(SumUpper(kNan, 3)));
}

TEST(Directed, DotErrorUpperBoundsTheErrorOfDotProducts) {
  for (TracedRandom random(106); random.Again(20000);) {
    const int count = random.Integer(1, 24), exponent = random.Coin() ? -537 : 0;
    double dot = 0;
    Rational exact_dot = 0, magnitude = 0;
    double previous = 0;
    for (int i = 0; i < count; ++i) {
      const double a = std::ldexp(random.Uniform(-2, 2), exponent + random.Integer(-3, 3));
      const double b = i % 2 && previous != 0 ? -previous : std::ldexp(random.Uniform(-2, 2), exponent);
      previous = b;
      dot += a * b;
      exact_dot += Rational(a) * Rational(b);
      magnitude += abs(Rational(a) * Rational(b));
    }
    const double bound = DotErrorUpper(Ceiling(magnitude), count);
    ASSERT_LE(abs(Rational(dot) - exact_dot), Rational(bound));
    ASSERT_LE(Rational(bound), magnitude * Rational(1e-14) + Rational(count + 2) * Rational(0x1p-1074));
  }
  EXPECT_EQ(DotErrorUpper(0, 5), 0);
}

}  // namespace forereach::directed_test
