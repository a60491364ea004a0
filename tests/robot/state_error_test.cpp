// The guard where the measured state is not the true one.
#include <gmpxx.h>

#include "tests/test.h"

#include "tests/robot/sealed_plan.h"

namespace forereach::state_error_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
constexpr std::int64_t kStart = kPlanStart, kNow = kStart - 3 * kPlanStepUs;
using State = std::array<double, 2>;

double Above(double x) { return std::nextafter(x, kInf); }
double Below(double x) { return std::nextafter(x, -kInf); }

certified_plan_t Measuring(const State& state_error, certified_plan_t certified = SmallPlan()) {
  std::ranges::copy(state_error, certified.state_error);
  return certified;
}

Guard Pending(const certified_plan_t& certified, const GuardOptions& options = TwoStates()) {
  Guard guard(options);
  EXPECT_TRUE(guard.Accept(Sealed(certified), kNow).ok());
  return guard;
}

Guard Executing(const certified_plan_t& certified) {
  Guard guard = Pending(certified);
  EXPECT_TRUE(guard.TryStart(kStart, kStart, State{1, -2}, State{0, 0}).ok());
  return guard;
}

// X0 is 0 +- 0.05 in state 0. The true state may be at 0.059, if 0.049 is measured.
TEST(GuardStateError, APlanStartsOnlyIfTheTrueStateIsInX0ForSure) {
  certified_plan_t certified = SmallPlan();
  certified.plan.initial_center[0] = 0;
  certified.plan.initial_half_width[0] = 0.05;
  const auto start = [&](double x) {
    return Pending(Measuring({0.01, 0}, certified)).TryStart(kStart, kStart, State{x, -2});
  };
  EXPECT_EQ(Pending(certified).TryStart(kStart, kStart, State{0.049, -2}).cause, GuardCause::kNone);
  const GuardVerdict verdict = start(0.049);
  EXPECT_FIELDS(verdict, (cause, GuardCause::kOutsideInitialSet), (coordinate, 0), (value, 0.049), (bound, 0.05));
  EXPECT_THAT(verdict.message, HasSubstr("is 0.049000000000000002 +- 0.01, not inside X0 = 0 +- 0.05"));
  for (const double sign : {1, -1}) {
    // 0.04 + 0.01 is 0.05 in doubles, and above it in real numbers.
    EXPECT_EQ(0.04 + 0.01, 0.05);
    EXPECT_EQ(start(sign * 0.04).ok(), mpq_class(0.04) + mpq_class(0.01) <= mpq_class(0.05));
    EXPECT_EQ(start(sign * Above(0.04)).cause, GuardCause::kOutsideInitialSet);
    EXPECT_TRUE(start(sign * Below(Below(0.04))).ok());
  }
}

TEST(GuardStateError, X0IsComparedExactlyWithTheError) {
  const std::uint64_t seed = 20261127;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  const auto draw = [&random] {
    const double mantissa = static_cast<double>(random() >> 11) * 0x1p-52 - 1;
    return std::ldexp(mantissa, static_cast<int>(random() % 12) - 6);
  };
  int near_misses = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    certified_plan_t certified = SmallPlan();
    const double center = certified.plan.initial_center[0] = draw();
    const double half_width = certified.plan.initial_half_width[0] = std::abs(draw());
    const double error = std::abs(draw()) / 8;
    certified.slice_lower[0][0] = -1000;
    certified.slice_upper[0][0] = 1000;
    const double edge = trial % 2 == 0 ? center + half_width - error : center - half_width + error;
    for (const double x : {Below(edge), edge, Above(edge)}) {
      const mpq_class off = abs(mpq_class(x) - mpq_class(center)) + mpq_class(error);
      const bool inside = off <= mpq_class(half_width);
      Guard guard = Pending(Measuring({error, 0}, certified));
      EXPECT_EQ(guard.TryStart(kStart, kStart, State{x, -2}).ok(), inside) << x << " +- " << error;
      near_misses += !inside && std::abs(x - center) + error <= half_width;
    }
  }
  EXPECT_GT(near_misses, 30) << "some rounded sums lie inside, or the exact comparison is not tested";
}

// The yaw rate's slice shrinks to +-0.008 in a braking tail, and the sensor has +-0.01.
certified_plan_t NarrowTail() {
  certified_plan_t certified = SmallPlan();
  certified.slice_lower[1][1] = -0.008;
  certified.slice_upper[1][1] = 0.008;
  return certified;
}

TEST(GuardStateError, ASliceIsLeftOnlyIfTheTrueStateIsOutsideForSure) {
  const auto check = [&](double y) {
    Guard guard = Executing(Measuring({0, 0.01}, NarrowTail()));
    const GuardVerdict verdict = guard.Check(1, State{0, y}, kNow);
    EXPECT_EQ(guard.halted(), !verdict.ok());
    EXPECT_EQ(guard.executing() != nullptr, verdict.ok());
    EXPECT_FALSE(verdict.is_inside());
    return verdict;
  };
  for (const double sign : {1, -1}) {
    const GuardVerdict consistent = check(sign * 0.012);
    EXPECT_TRUE(consistent.ok()) << consistent.message;
    EXPECT_FIELDS(consistent, (coordinate, 1), (value, sign * 0.012), (bound, sign * 0.008), (message, ""));
    EXPECT_TRUE(check(sign * 0.017999).ok());
    EXPECT_EQ(check(sign * 0.018001).cause, GuardCause::kOutsideSlice);
  }
  EXPECT_TRUE(check(0).ok()) << "the slice is narrower than the error, so no measurement is inside";
  const GuardVerdict left = check(0.02);
  EXPECT_FIELDS(left, (cause, GuardCause::kOutsideSlice), (value, 0.02), (bound, 0.008));
  EXPECT_THAT(left.message, HasSubstr("is 0.02 +- 0.01 at step 1, outside [-0.0080000000000000002, "));
  Guard exact = Executing(NarrowTail());
  EXPECT_EQ(exact.Check(1, State{0, 0.012}, kNow).cause, GuardCause::kOutsideSlice);
}

TEST(GuardStateError, SlicesAreComparedExactlyWithTheError) {
  for (const double error : {0.1, 0.3, 1e-17}) {
    const double edge = 11 + error;
    for (const double x : {Below(edge), edge, Above(edge), -Below(edge), -edge, -Above(edge)}) {
      Guard guard = Executing(Measuring({error, 0}));
      const bool meets = abs(mpq_class(x)) - mpq_class(error) <= 11;
      EXPECT_EQ(guard.Check(1, State{x, 0}, kNow).ok(), meets) << x << " +- " << error;
    }
    const double within = 11 - error;
    for (const double x : {Below(within), within, Above(within)}) {
      Guard guard = Executing(Measuring({error, 0}));
      const bool inside = abs(mpq_class(x)) + mpq_class(error) <= 11;
      EXPECT_EQ(guard.Check(1, State{x, 0}, kNow).is_inside(), inside) << x << " +- " << error;
    }
  }
}

TEST(GuardStateError, TheFirstStateThatIsNotInsideIsNamedUnlessALaterOneHasLeft) {
  Guard guard = Executing(Measuring({0.5, 0.5}));
  const GuardVerdict consistent = guard.Check(1, State{11.2, 5.2}, kNow);
  EXPECT_TRUE(consistent.ok());
  EXPECT_EQ(consistent.coordinate, 0);
  EXPECT_FIELDS(guard.Check(2, State{12.2, 5.6}, kNow), (cause, GuardCause::kOutsideSlice), (coordinate, 1));
}

TEST(GuardStateError, AgainItAsksTheSameOfX0AndOfTheSlice) {
  const auto again = [](int steps, State state) {
    Guard guard = Executing(Measuring({0.1, 0}));
    for (int t = 1; t <= steps; ++t) EXPECT_TRUE(guard.Check(t, State{0, 0}, kNow).ok());
    return guard.CheckAgain(state, kNow).cause;
  };
  EXPECT_EQ(again(0, {1.375, -2}), GuardCause::kNone);
  EXPECT_EQ(again(0, {1.45, -2}), GuardCause::kOutsideInitialSet);
  EXPECT_EQ(again(1, {11.05, 0}), GuardCause::kNone);
  EXPECT_EQ(again(1, {11.15, 0}), GuardCause::kOutsideSlice);
}

TEST(GuardStateError, AMeasurementMayBringItsOwnError) {
  for (const double declared : {0.0, 0.2}) {
    const certified_plan_t certified = Measuring({declared, 0});
    const auto start = [&](double error) {
      return Pending(certified).TryStart(kStart, kStart, State{1.375, -2}, State{error, 0}).cause;
    };
    EXPECT_EQ(start(0.125), GuardCause::kNone);
    EXPECT_EQ(start(Above(0.125)), GuardCause::kOutsideInitialSet);
    const auto check = [&](double error) {
      return Executing(certified).Check(1, State{11.125, 0}, kNow, State{error, 0}).cause;
    };
    EXPECT_EQ(check(0.125), GuardCause::kNone);
    EXPECT_EQ(check(Below(0.125)), GuardCause::kOutsideSlice);
  }
}

// The plan does not start, and one that executes ends. That is no proof that an assumption is false: it does not halt.
TEST(GuardStateError, RefusesErrorsThatAreNoneOrNotOneForEachState) {
  for (const std::vector<double>& bad :
       std::vector<std::vector<double>>{{kNaN, 0}, {0, kNaN}, {-1e-300, 0}, {0, kInf}, {0, -kInf}, {0.1}, {0, 0, 0}}) {
    Guard guard = Pending(SmallPlan());
    EXPECT_EQ(guard.TryStart(kStart, kStart, State{1, -2}, bad).cause, GuardCause::kWrongStateError);
    EXPECT_FIELDS(guard, (executing(), nullptr), (pending(), nullptr));
    for (const bool again : {false, true}) {
      Guard executing = Executing(SmallPlan());
      const GuardVerdict verdict =
          again ? executing.CheckAgain(State{1, -2}, kNow, bad) : executing.Check(1, State{0, 0}, kNow, bad);
      EXPECT_EQ(verdict.cause, GuardCause::kWrongStateError);
      EXPECT_EQ(GuardCauseName(verdict.cause), "wrong_state_error");
      EXPECT_NE(verdict.message, "");
      EXPECT_EQ(executing.executing(), nullptr);
      EXPECT_FALSE(executing.halted());
    }
  }
}

TEST(GuardStateError, RefusesAPlanWhoseErrorsAreNone) {
  for (const State& bad : {State{kNaN, 0}, {0, kNaN}, {-1e-300, 0}, {0, kInf}, {0, -kInf}}) {
    Guard guard(TwoStates());
    const GuardVerdict verdict = guard.Accept(Sealed(Measuring(bad)), kNow);
    EXPECT_FIELDS(verdict, (cause, GuardCause::kNonFinite), (coordinate, bad[0] == 0 ? 1 : 0));
  }
  EXPECT_TRUE(Guard(TwoStates()).Accept(Sealed(Measuring({0, 1e300})), kNow).ok());
}

TEST(GuardStateError, AStateThatIsNoNumberHasLeftWhateverItsError) {
  for (const double bad : {kNaN, kInf, -kInf}) {
    Guard guard = Executing(Measuring({1e300, 1}));
    EXPECT_EQ(guard.Check(1, State{bad, 0}, kNow).cause, GuardCause::kOutsideSlice);
    EXPECT_TRUE(guard.halted());
  }
}

TEST(GuardStateError, AnAngleWrapsWithItsError) {
  GuardOptions options = TwoStates();
  options.angles = {0};
  certified_plan_t certified = Measuring({0.01, 0});
  certified.plan.initial_center[0] = std::numbers::pi;
  certified.plan.initial_half_width[0] = 0.05;
  for (int t = 0; t <= 3; ++t) {
    certified.slice_lower[t][0] = 3.1;
    certified.slice_upper[t][0] = 3.2;
  }
  const auto start = [&](double x) { return Pending(certified, options).TryStart(kStart, kStart, State{x, -2}).cause; };
  EXPECT_EQ(start(-std::numbers::pi + 0.0399), GuardCause::kNone);
  EXPECT_EQ(start(-std::numbers::pi + 0.0401), GuardCause::kOutsideInitialSet);
  EXPECT_EQ(start(-std::numbers::pi - 0.0401), GuardCause::kOutsideInitialSet);
  const auto check = [&](double x) {
    Guard guard = Pending(certified, options);
    EXPECT_TRUE(guard.TryStart(kStart, kStart, State{std::numbers::pi, -2}).ok());
    return guard.Check(1, State{x, 0}, kNow).cause;
  };
  const double turn = 2 * std::numbers::pi;
  EXPECT_EQ(check(3.2 - turn + 0.0099), GuardCause::kNone);
  EXPECT_EQ(check(3.2 - turn + 0.0101), GuardCause::kOutsideSlice);
  EXPECT_EQ(check(3.1 + 2 * turn - 0.0099), GuardCause::kNone);
  EXPECT_EQ(check(3.1 + 2 * turn - 0.0101), GuardCause::kOutsideSlice);
}

TEST(GuardStateError, EachPlanBringsItsOwn) {
  Guard guard(TwoStates());
  const auto start = [&](std::int64_t plan_id, double error, double x) {
    EXPECT_TRUE(guard.Accept(Sealed(Measuring({error, 0}, SmallPlan(plan_id))), kNow).ok());
    return guard.TryStart(kStart, kStart, State{x, -2}).cause;
  };
  EXPECT_EQ(start(10, 0, 1.375), GuardCause::kNone);
  EXPECT_EQ(start(11, 0.25, 1.375), GuardCause::kOutsideInitialSet);
  EXPECT_EQ(start(12, 0.25, 1.25), GuardCause::kNone);
  EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(13)), kNow).ok());
  EXPECT_TRUE(guard.Check(1, State{11.25, 0}, kNow).ok()) << "the pending plan's does not count yet";
}

TEST(GuardStateError, IsDeclaredIfThePlansSaySoAndNoOtherTaskIsAwaited) {
  Guard guard = Executing(Measuring({0.25, 0}));
  EXPECT_TRUE(guard.IsDeclared(State{0.25, 0}));
  EXPECT_FALSE(guard.IsDeclared(State{Above(0.25), 0}));
  EXPECT_TRUE(guard.Accept(Sealed(Measuring({0.125, 0}, SmallPlan(8))), kNow).ok());
  EXPECT_TRUE(guard.IsDeclared(State{0.125, 0}));
  EXPECT_FALSE(guard.IsDeclared(State{0.25, 0}));
  guard.Expect(DigestOf("second"), DigestOf("model"));
  EXPECT_FALSE(guard.IsDeclared(State{0, 0}));
  EXPECT_TRUE(guard.IsDeclared({})) << "as the task that the certifier has declares";
  certified_plan_t next = Measuring({0.5, 0}, SmallPlan(9));
  SetDigest(next.config_digest, DigestOf("second"));
  EXPECT_TRUE(guard.Accept(Sealed(next), kNow).ok());
  EXPECT_TRUE(guard.IsDeclared(State{0.25, 0}));
  EXPECT_FALSE(guard.IsDeclared(State{0.5, 0})) << "the executing plan's is smaller";
}

TEST(GuardStateError, OfAnotherSizeIsNotTheDeclaredOne) {
  const Guard guard(TwoStates());
  EXPECT_TRUE(guard.IsDeclared({}));
  for (const std::size_t size : {1, 2, 3, 16, 17, 40})
    EXPECT_EQ(guard.IsDeclared(std::vector<double>(size)), size == 2) << size;
}

}  // namespace forereach::state_error_test
