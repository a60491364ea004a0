// The verifier's numbers: enclosures, comparisons that are certain or none, and precision that can be raised.
#include "tests/test.h"

#include "verifier/answer.h"
#include "verifier/real.h"

namespace forereach::verifier::real_test {

TEST(Real, AThirdIsEnclosedAndNotExact) {
  const Real third = Real(1.0) / Real(3.0);
  EXPECT_FALSE(CertainlyAtMost(third.upper(), third.lower()));
  EXPECT_EQ(IsAtMost(Real(3.0) * third, 1.0), Answer::kUnknown);
  EXPECT_EQ(IsBelow(third, 1.0 / 3), Answer::kNo);  // the double is below a third
}

TEST(Real, SumsOfDoublesAreExactWithEnoughBits) {
  const double tiny = std::numeric_limits<double>::denorm_min(), huge = std::numeric_limits<double>::max();
  EXPECT_EQ(IsBelow(Real(huge), Real(huge) + Real(tiny)), Answer::kUnknown);
  const Precision precision(6656);
  EXPECT_EQ(IsBelow(Real(huge), Real(huge) + Real(tiny)), Answer::kYes);
  EXPECT_TRUE((Real(huge) + Real(tiny) - Real(huge) - Real(tiny)).IsZero());
}

TEST(Real, ComparesEqualNumbersAndNan) {
  EXPECT_EQ(IsAtMost(1.0, 1.0), Answer::kYes);
  EXPECT_EQ(IsBelow(1.0, 1.0), Answer::kNo);
  EXPECT_EQ(IsAtMost(std::nan(""), 1.0), Answer::kUnknown);
  EXPECT_EQ(IsAtMost(1.0, std::numeric_limits<double>::infinity()), Answer::kYes);
}

TEST(Real, TangentIsUnboundedOverItsPole) {
  EXPECT_FALSE(tan(Real::FromTo(1.5, 1.6)).IsFinite());
  EXPECT_TRUE(tan(Real::FromTo(1.4, 1.5)).IsFinite());
}

// Without a bound on the work, each of these takes minutes and gigabytes.
TEST(Real, SineCosineAndTangentOfAnAstronomicalAngleAreNotComputed) {
  const auto two_to_the = [](double e) { return exp(Real(e) * log(Real(2.0))); };
  for (const auto& function : {+[](const Real& x) { return sin(x); }, +[](const Real& x) { return cos(x); },
                               +[](const Real& x) { return tan(x); }}) {
    for (const Real& angle : {two_to_the(1e15), -two_to_the(1e15), Real::FromTo(0.0, two_to_the(1e15)),
                              two_to_the(16384.5), Real::Everything(), Real(std::nan(""))}) {
      const Real value = function(angle);
      EXPECT_FALSE(value.IsFinite());
      EXPECT_EQ(IsAtMost(value, 1.0), Answer::kUnknown);
      EXPECT_THAT(value.text(), HasSubstr("no finite enclosure"));
    }
    EXPECT_TRUE(function(0x1p1023).IsFinite());
    EXPECT_TRUE(function(0.0).IsFinite());
  }
}

TEST(Real, AnIntervalHasItsEndsMiddleAndMagnitude) {
  EXPECT_FIELDS(Real::FromTo(-1.0, 3.0), (lower().ToDouble(), -1), (upper().ToDouble(), 3), (middle().ToDouble(), 1),
                (magnitude().ToDouble(), 3));
  EXPECT_EQ(Real(12.0).ToDouble(-2), 3);
  EXPECT_EQ(Real(12.0).exponent(), 4);
  EXPECT_EQ(Real(0.1).text(), "0.10000000000000001");
}

}  // namespace forereach::verifier::real_test
