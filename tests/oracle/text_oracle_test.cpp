// Printed numbers against exact rationals: they lie on the side that keeps them true.
#include "tests/test.h"

#include "forereach/numerics/text.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::text_oracle_test {

Rational PowerOfTen(long exponent) {
  mpz_class power;
  mpz_ui_pow_ui(power.get_mpz_t(), 10, static_cast<unsigned long>(std::abs(exponent)));
  return exponent < 0 ? Rational(1, power) : Rational(power);
}

// The decimal as an exact number, and one unit of its last digit if it had `digits` of them.
struct Read {
  Rational value, unit;
};

Read Parse(const std::string& text, int digits) {
  const bool negative = text[0] == '-';
  const std::size_t e = text.find('e');
  std::string mantissa = text.substr(negative, e == std::string::npos ? e : e - negative);
  long exponent = e == std::string::npos ? 0 : std::stol(text.substr(e + 1));
  if (const std::size_t point = mantissa.find('.'); point != std::string::npos) {
    exponent -= static_cast<long>(mantissa.size() - point - 1);
    mantissa.erase(point, 1);
  }
  const mpz_class number(mantissa, 10);
  const long length = static_cast<long>(number.get_str().size());
  EXPECT_LE(mpz_class(number).get_str().find_last_not_of('0') + 1, static_cast<std::size_t>(digits)) << text;
  const Rational value = Rational(number) * PowerOfTen(exponent);
  return {negative ? Rational(-value) : value, PowerOfTen(exponent + length - digits)};
}

void ExpectOnBothSides(double x, int digits) {
  SCOPED_TRACE(testing::Message() << x << " to " << digits << " digits");
  const std::string down = RoundedDown(x, digits), up = RoundedUp(x, digits);
  const Read below = Parse(down, digits), above = Parse(up, digits);
  const Rational exact(x);
  ASSERT_LE(below.value, exact) << down;
  ASSERT_GE(above.value, exact) << up;
  ASSERT_LT(exact - below.value, std::max(below.unit, above.unit)) << down;
  ASSERT_LT(above.value - exact, std::max(below.unit, above.unit)) << up;
  if (below.value == exact) ASSERT_EQ(down, up);
}

TEST(RoundedText, IsOnTheSafeSideAndNextToTheNumber) {
  TracedRandom random(621);
  for (int trial = 0; trial < 20000 && !testing::Test::HasFatalFailure(); ++trial)
    ExpectOnBothSides(random.Double(), random.Coin(0.9) ? random.Integer(1, 17) : random.Integer(18, 30));
}

TEST(RoundedText, RoundsHardNumbersToTheExpectedText) {
  for (const double x : {0.1,
                         0.5,
                         0.25,
                         2.5,
                         0.9999999,
                         0.99999,
                         9.999995,
                         99999.95,
                         999999.5,
                         1e6,
                         999999.0,
                         1e-5,
                         9.9e-5,
                         1e-4,
                         0x1p-1074,
                         0x3p-1074,
                         0x1.fffffffffffffp-1023,
                         0x1p-1022,
                         kMaxDouble,
                         1e22,
                         1e23,
                         123456.5,
                         0.5 + 0x1p-53})
    for (const double sign : {1.0, -1.0})
      for (int digits = 1; digits <= 20; ++digits) ExpectOnBothSides(sign * x, digits);
}

TEST(RoundedText, ReadsAsPeopleWriteIt) {
  EXPECT_EQ(RoundedDown(0.99999999), "0.999999");
  EXPECT_EQ(RoundedUp(0.99999999), "1");
  EXPECT_EQ(RoundedUp(-0.99999999), "-0.999999");
  EXPECT_EQ(RoundedDown(-0.99999999), "-1");
  EXPECT_EQ(RoundedUp(999999.5), "1e+06");
  EXPECT_EQ(RoundedDown(999999.5), "999999");
  EXPECT_EQ(RoundedDown(1.05, 2), "1");  // the double is above 1.05, 1.1 would not be
  EXPECT_EQ(RoundedUp(1.05, 2), "1.1");
  EXPECT_EQ(RoundedDown(0.5), "0.5");
  EXPECT_EQ(RoundedUp(0.5), "0.5");
  EXPECT_EQ(RoundedUp(0.0001), "0.000100001");  // the double is above 1e-4
  EXPECT_EQ(RoundedDown(0.0001), "0.0001");
  EXPECT_EQ(RoundedUp(0x1p-1074), "4.94066e-324");
  EXPECT_EQ(RoundedDown(0x1p-1074, 1), "4e-324");
  EXPECT_EQ(RoundedUp(kMaxDouble, 3), "1.8e+308");
  EXPECT_EQ(RoundedDown(120000), "120000");
  EXPECT_EQ(RoundedDown(-0.0), "0");
  EXPECT_EQ(RoundedDown(kInfinity), "inf");
  EXPECT_EQ(RoundedUp(-kInfinity), "-inf");
  EXPECT_EQ(RoundedUp(std::nan("")), "nan");
}

}  // namespace forereach::text_oracle_test
