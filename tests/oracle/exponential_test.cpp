// exp, log1p and sqrt over intervals against MPFR: the range contains the exact values at its ends, and is no wider
// than a few units in the last place.
#include "certifier/numerics/exponential.h"

#include <mpfr.h>

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "certifier/dynamics/saturation.h"

namespace forereach {
namespace {

using Function = int (*)(mpfr_ptr, mpfr_srcptr, mpfr_rnd_t);

// Whether the exact value at a double lies inside.
bool Contains(const Interval& range, Function function, double x) {
  mpfr_t value;
  mpfr_init2(value, 256);
  mpfr_set_d(value, x, MPFR_RNDN);
  function(value, value, MPFR_RNDN);
  const bool inside = mpfr_cmp_d(value, range.lower) >= 0 && mpfr_cmp_d(value, range.upper) <= 0;
  mpfr_clear(value);
  return inside;
}

TEST(Exponential, RangesContainTheExactValues) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> exponent(-40, 9), sign(-1, 1), width(0, 1);
  for (int i = 0; i < 200'000; ++i) {
    const double size = std::ldexp(1 + width(random), static_cast<int>(exponent(random)));
    const double x = std::copysign(size, sign(random)), y = x + width(random) * size / 4;
    ASSERT_TRUE(Contains(exp(Interval(x, y)), mpfr_exp, x) && Contains(exp(Interval(x, y)), mpfr_exp, y)) << x;
    if (x > -1) {
      ASSERT_TRUE(Contains(log1p(Interval(x, y)), mpfr_log1p, x) && Contains(log1p(Interval(x, y)), mpfr_log1p, y))
          << x;
    }
    if (x > 0) {
      ASSERT_TRUE(Contains(sqrt(Interval(x, y)), mpfr_sqrt, x) && Contains(sqrt(Interval(x, y)), mpfr_sqrt, y)) << x;
    }
    if (std::abs(x) < 700) {
      const Interval point = exp(Interval(x));
      ASSERT_LE(point.upper - point.lower, 1e-15 * point.upper);
    }
  }
}

TEST(Exponential, AtTheEdges) {
  EXPECT_TRUE(Contains(exp(Interval(-800)), mpfr_exp, -800));
  EXPECT_EQ(exp(Interval(-800)).lower, 0);
  EXPECT_EQ(exp(Interval(800)).upper, kInfinity);
  EXPECT_EQ(log1p(Interval(-1, 1)), Interval::Entire());
  EXPECT_EQ(sqrt(Interval(-2, 4)), Interval(0, 2));
  EXPECT_EQ(sqrt(Interval(-2, -1)), Interval::Entire());
}

// exp(-1/e) and its derivatives, by MPFR at points of the interval.
TEST(SmoothGateRanges, ContainTheExactValues) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> uniform(0, 1);
  mpfr_t e, gate, first, second;
  for (auto* number : {&e, &gate, &first, &second}) mpfr_init2(*number, 256);
  for (int i = 0; i < 50'000; ++i) {
    const double lower = std::pow(10, 5 * uniform(random) - 4) - 0.01, upper = lower + uniform(random);
    const DerivativeRanges ranges = SmoothGateRanges({lower, upper});
    const double x = i % 3 == 0   ? lower
                     : i % 3 == 1 ? upper
                                  : std::min(upper, lower + (upper - lower) * uniform(random));
    if (!(x > 0)) continue;
    mpfr_set_d(e, x, MPFR_RNDN);
    mpfr_ui_div(gate, 1, e, MPFR_RNDN);
    mpfr_neg(gate, gate, MPFR_RNDN);
    mpfr_exp(gate, gate, MPFR_RNDN);
    mpfr_div(first, gate, e, MPFR_RNDN);
    mpfr_div(first, first, e, MPFR_RNDN);
    mpfr_mul_si(second, e, -2, MPFR_RNDN);
    mpfr_add_ui(second, second, 1, MPFR_RNDN);
    mpfr_mul(second, second, first, MPFR_RNDN);
    mpfr_div(second, second, e, MPFR_RNDN);
    mpfr_div(second, second, e, MPFR_RNDN);
    const auto inside = [](mpfr_t value, const Interval& range) {
      return mpfr_cmp_d(value, range.lower) >= 0 && mpfr_cmp_d(value, range.upper) <= 0;
    };
    ASSERT_TRUE(inside(gate, ranges.value) && inside(first, ranges.first) && inside(second, ranges.second)) << x;
  }
  for (auto* number : {&e, &gate, &first, &second}) mpfr_clear(*number);
}

}  // namespace
}  // namespace forereach
