#include "task/number.h"

#include "tests/test.h"

namespace forereach::number_test {

TEST(ParseNumber, ReadsDecimals) {
  const std::pair<const char*, double> cases[] = {{"0", 0},
                                                  {"-1", -1},
                                                  {"+2.5", 2.5},
                                                  {".5", 0.5},
                                                  {"3.", 3},
                                                  {"1e-3", 1e-3},
                                                  {"-0.1", -0.1},
                                                  {"1E+2", 100},
                                                  {"0.609638820", 0.609638820},
                                                  {"4.9e-324", 4.9e-324},
                                                  {"1.7976931348623157e308", 1.7976931348623157e308}};
  for (const auto& [token, value] : cases) {
    const Parsed<double> parsed = ParseNumber(token);
    EXPECT_EQ(parsed.problem, "") << token;
    EXPECT_EQ(parsed.value, value) << token;
  }
  EXPECT_TRUE(std::signbit(ParseNumber("-0").value));
}

TEST(ParseNumber, RefusesNonFinite) {
  for (const char* token : {"nan", "NaN", ".nan", "-nan", "inf", "-inf", ".inf", "+Infinity", "-.INF"})
    EXPECT_EQ(ParseNumber(token).problem, "is not a finite number") << token;
}

TEST(ParseNumber, RefusesWhatIsNotWhole) {
  for (const char* token : {"",    "+",     "-",   ".",   "1,5", "1 ", " 1", "1e",     "1.0.0", "0x10", "0b1",
                            "0o7", "1_000", "--1", "+-1", "abc", "1f", "e5", "nan(1)", "12:30", "1/2"})
    EXPECT_EQ(ParseNumber(token).problem, "is not a number") << token;
}

TEST(ParseNumber, RefusesWhatCouldBeOctal) {
  for (const char* token : {"010", "-007", "00", "+01.5"})
    EXPECT_EQ(ParseNumber(token).problem, "has a leading zero") << token;
  EXPECT_EQ(ParseNumber("0.5").problem, "");
}

TEST(ParseNumber, RefusesWhatNoDoubleIsNear) {
  for (const char* token : {"1e309", "-1e400", "1e-400"})
    EXPECT_EQ(ParseNumber(token).problem, "is too large or too small to represent") << token;
}

TEST(ParseInteger, ReadsIntegersOnly) {
  EXPECT_EQ(ParseInteger("128").value, 128);
  EXPECT_EQ(ParseInteger("-3").value, -3);
  for (const char* token : {"1.0", "1e3", "", "0x1", "five"})
    EXPECT_EQ(ParseInteger(token).problem, "is not an integer") << token;
  EXPECT_EQ(ParseInteger("99999999999999999999").problem, "is too large or too small to represent");
  EXPECT_EQ(ParseInteger("017").problem, "has a leading zero");
}

}  // namespace forereach::number_test
