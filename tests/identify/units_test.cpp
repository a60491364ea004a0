// Units of logged columns.
#include "identify/units.h"

#include "tests/test.h"

namespace forereach::units_test {

TEST(Units, FactorsAreThoseOfTheirDefinitions) {
  EXPECT_DOUBLE_EQ(static_cast<double>(180 * FactorOf("deg", "rad")), std::numbers::pi);
  EXPECT_DOUBLE_EQ(static_cast<double>(60 * FactorOf("rpm", "rad/s")), 2 * std::numbers::pi);
  EXPECT_EQ(static_cast<double>(36 * FactorOf("km/h", "m/s")), 10);
  EXPECT_EQ(static_cast<double>(FactorOf("kn", "") * 3600), 1852);
  EXPECT_EQ(static_cast<double>(FactorOf("standard gravity", "")), 9.80665);
  EXPECT_EQ(static_cast<double>(FactorOf("ms", "s") * 1000), 1);
  EXPECT_EQ(FactorOf("0.25", "m"), 0.25L) << "a number is a factor";
  EXPECT_EQ(FactorOf("rad", "rad"), 1);
  EXPECT_EQ(FactorOf("furlong", "furlong"), 1) << "a unit of the model that is not in the table";
}

TEST(Units, EveryUnitConvertsToItsBaseAndToNoOther) {
  for (const Unit& unit : KnownUnits()) {
    EXPECT_EQ(FactorOf(unit.name, unit.base), unit.factor);
    EXPECT_THROW((void)FactorOf(unit.name, "kg"), std::invalid_argument) << unit.name;
  }
}

TEST(Units, WhatIsNoUnitIsRefused) {
  for (const char* text : {"degree", "", "0", "-1", "nan", "inf", "deg ", "1e400"})
    EXPECT_THROW((void)FactorOf(text, ""), std::invalid_argument) << text;
  EXPECT_THAT([&] { (void)FactorOf("dek", "rad"); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("did you mean deg?")));
}

}  // namespace forereach::units_test
