// States against intervals modulo whole turns, judged in 256 bits.
#include "lcmtypes/angle.h"

#include "tests/test.h"

#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::angle_oracle_test {

constexpr double kTurn = 2 * std::numbers::pi, kNaN = std::numeric_limits<double>::quiet_NaN();

Real Turned(double value, int turns) { return Real(value) + Real(2.0 * turns) * Real::Pi(); }

bool IsInside(double value, double lower, double upper) {
  for (int turns = -12; turns <= 12; ++turns)
    if (Real(lower) <= Turned(value, turns) && Turned(value, turns) <= Real(upper)) return true;
  return false;
}

bool LiesWithin(double value, double lower, double upper, bool is_angle) {
  return Conform(value, 0, lower, upper, is_angle) == Conformance::kInside;
}

TEST(Conform, FindsAnAngleInsideOnlyIfItIsAfterWholeTurns) {
  int inside = 0, left_out = 0;
  for (TracedRandom random(641); random.Again(40'000);) {
    const double value = random.Uniform(-20, 20), near = value + random.Integer(-3, 3) * kTurn;
    const double width = std::ldexp(random.Uniform(0, 1), -random.Integer(0, 54));
    double lower = near - width * random.Uniform(-0.1, 1);
    double upper = lower + width;
    for (int i = random.Integer(-4, 4); i != 0; i += i < 0 ? 1 : -1) lower = std::nextafter(lower, i < 0 ? -99 : 99);
    const bool found = LiesWithin(value, lower, upper, true), is_inside = IsInside(value, lower, upper);
    ASSERT_TRUE(is_inside || !found) << value << " in [" << lower << ", " << upper << "]";
    if (is_inside && upper - lower > 1e-13 && !found) {  // only next to an end
      Real least(1.0);
      for (int turns = -12; turns <= 12; ++turns)
        for (const double end : {lower, upper})
          if (const Real away = abs(Turned(value, turns) - Real(end)); away < least) least = away;
      ASSERT_LE(least, Real(3e-14));
    }
    inside += found;
    left_out += is_inside && !found;
  }
  EXPECT_GT(inside, 4'000);
  EXPECT_GT(left_out, 0) << "of those that are inside by less than the rounding";
}

TEST(Conform, ComparesExactlyWhereNoTurnIsNeeded) {
  for (const bool is_angle : {false, true}) {
    EXPECT_TRUE(LiesWithin(0.1, 0.1, 0.1, is_angle));
    EXPECT_TRUE(LiesWithin(0.1, -3, 0.1, is_angle));
    EXPECT_FALSE(LiesWithin(std::nextafter(0.1, 1), -3, 0.1, is_angle));
    EXPECT_FALSE(LiesWithin(kNaN, -100, 100, is_angle));
    EXPECT_FALSE(LiesWithin(HUGE_VAL, -1, 1, is_angle));
    EXPECT_FALSE(LiesWithin(1e300, -1, 1, is_angle));
    EXPECT_FALSE(LiesWithin(0, 1, -1, is_angle)) << "the empty interval";
  }
  EXPECT_TRUE(LiesWithin(-3.1, 3.1, 3.2, true));
  EXPECT_FALSE(LiesWithin(-3.1, 3.1, 3.2, false));
  EXPECT_FALSE(LiesWithin(-3.1, 3.19, 3.2, true));
}

// 0 after a turn is 2 pi, which is no double: it lies between two neighbours.
TEST(Conform, FindsATurnedNumberInsideOnlyIfItsRoundingIsToo) {
  const double above = std::nextafter(kTurn, 9), far_above = std::nextafter(above, 9), below = std::nextafter(kTurn, 0);
  ASSERT_LT(Real(kTurn), Turned(0, 1));
  ASSERT_LT(Turned(0, 1), Real(above));
  EXPECT_FALSE(LiesWithin(0, kTurn, kTurn, true));
  EXPECT_FALSE(LiesWithin(0, above, above, true));
  EXPECT_TRUE(LiesWithin(0, below, far_above, true));
  EXPECT_TRUE(LiesWithin(0, -far_above, -below, true));
  EXPECT_FALSE(LiesWithin(0, far_above, far_above + 1, true));
  EXPECT_FALSE(LiesWithin(0, below - 1, below, true));
}

// The nearest of the turned boxes decides.
Conformance ExactConformance(double value, double error, double lower, double upper, bool is_angle) {
  Conformance best = Conformance::kLeft;
  for (int turns = is_angle ? -12 : 0; turns <= (is_angle ? 12 : 0); ++turns) {
    const Real least = Turned(value, turns) - Real(error), most = Turned(value, turns) + Real(error);
    if (Real(lower) <= least && most <= Real(upper)) return Conformance::kInside;
    if (Real(lower) <= most && least <= Real(upper)) best = Conformance::kConsistent;
  }
  return best;
}

TEST(Conform, ComparesAStateWithItsErrorAsRealNumbers) {
  std::map<Conformance, int> found;
  for (TracedRandom random(1127); random.Again(20'000);) {
    const double lower = random.Uniform(-3, 3), upper = lower + random.Uniform(0, 1), error = random.Uniform(0, 1);
    double value = (random.Integer(0, 1) ? lower : upper) + random.Integer(-1, 1) * error;
    for (int i = random.Integer(-2, 2); i != 0; i += i < 0 ? 1 : -1) value = std::nextafter(value, i < 0 ? -99 : 99);
    const Conformance conformance = Conform(value, error, lower, upper, false);
    ASSERT_EQ(conformance, ExactConformance(value, error, lower, upper, false))
        << value << " +- " << error << " in [" << lower << ", " << upper << "]";
    ++found[conformance];
  }
  EXPECT_THAT(found, SizeIs(3));
  for (const auto& [conformance, count] : found) EXPECT_GT(count, 500);
}

TEST(Conform, GivesATurnedStateNoBetterAnswerThanItHas) {
  std::map<Conformance, int> found;
  int worse = 0;
  for (TracedRandom random(1128); random.Again(20'000);) {
    const double lower = random.Uniform(-3, 3), upper = lower + random.Uniform(0, 0.5), error = random.Uniform(0, 0.5);
    const double edge = (random.Integer(0, 1) ? lower : upper) + random.Integer(-1, 1) * error;
    double value = edge + random.Integer(-3, 3) * kTurn;
    for (int i = random.Integer(-3, 3); i != 0; i += i < 0 ? 1 : -1) value = std::nextafter(value, i < 0 ? -99 : 99);
    const Conformance conformance = Conform(value, error, lower, upper, true),
                      exact = ExactConformance(value, error, lower, upper, true);
    ASSERT_GE(conformance, exact) << value << " +- " << error << " in [" << lower << ", " << upper << "]";
    if (conformance != exact) {
      EXPECT_EQ(Conform(value, error, lower - 1e-13, upper + 1e-13, true), exact)
          << "it is missed by the rounding alone";
      ++worse;
    }
    ++found[conformance];
  }
  EXPECT_GT(worse, 100);
  for (const Conformance conformance : {Conformance::kInside, Conformance::kConsistent, Conformance::kLeft})
    EXPECT_GT(found[conformance], 500);
}

TEST(Conform, ErrsOnTheSideOfLeftWhereANumberIsNone) {
  for (const bool is_angle : {false, true}) {
    for (const double bad : {kNaN, HUGE_VAL, -HUGE_VAL})
      EXPECT_EQ(Conform(bad, 1, -100, 100, is_angle), Conformance::kLeft) << bad;
    for (const double bad : {kNaN, -1e-300, -HUGE_VAL})
      EXPECT_EQ(Conform(0, bad, -100, 100, is_angle), Conformance::kLeft) << bad;
    EXPECT_EQ(Conform(0, 1, kNaN, 100, is_angle), Conformance::kLeft);
    EXPECT_EQ(Conform(0, 1, -100, kNaN, is_angle), Conformance::kLeft);
  }
}

TEST(SumAtMost, ComparesAsRealNumbersAndFailsWhereASumIsTooLarge) {
  EXPECT_TRUE(SumAtMost(1, -1e-300, 1, 0));
  EXPECT_FALSE(SumAtMost(1, 1e-300, 1, 0));
  EXPECT_TRUE(SumAtMost(0.1, 0.2, 0.2, 0.1));
  EXPECT_TRUE(SumAtMost(1e-300, 1, 1, 2e-300));
  EXPECT_FALSE(SumAtMost(2e-300, 1, 1, 1e-300));
  const double most = std::numeric_limits<double>::max();
  EXPECT_FALSE(SumAtMost(most, most, most, most));
  EXPECT_FALSE(SumAtMost(kNaN, 0, 1, 1));
  EXPECT_FALSE(SumAtMost(0, 0, kNaN, 1));
}

TEST(TurnTowards, EnclosesTheTurnedNumber) {
  for (TracedRandom random(642); random.Again(100'000);) {
    const double value = random.Uniform(-1, 1) * std::ldexp(1, random.Integer(-60, 30));
    const int turns = random.Integer(-1000, 1000);
    const double goal = value + turns * kTurn;
    const Ends ends = TurnTowards(value, goal - 1, goal + 1);
    const int found = turns == 0 || (goal - 1 <= value && value <= goal + 1) ? 0 : turns;
    ASSERT_LE(Real(ends.lower), Turned(value, found));
    ASSERT_LE(Turned(value, found), Real(ends.upper));
    ASSERT_LE(ends.upper - ends.lower, std::abs(found) * 0x1p-50 + 4 * (NextUp(std::abs(goal)) - std::abs(goal)));
  }
}

TEST(AnglesOf, RefusesIndicesThatAreNoStates) {
  EXPECT_EQ(AnglesOf(std::array{2, 0}, 3), Angles(0b101));
  EXPECT_EQ(AnglesOf(std::span<const int>(), 3), Angles());
  for (const int wrong : {-1, 3, 16})
    EXPECT_THROW(static_cast<void>(AnglesOf(std::array{wrong}, 3)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(AnglesOf(std::array{16}, 17)), std::invalid_argument);
}

}  // namespace forereach::angle_oracle_test
