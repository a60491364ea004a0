#include "robot/guard.h"

#include <gmpxx.h>

#include "tests/test.h"

#include "tests/keys.h"
#include "tests/robot/sealed_plan.h"

namespace forereach::guard_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr std::int64_t kStart = kPlanStart, kStep = kPlanStepUs, kNow = kStart - 3 * kStep;
using State = std::array<double, 2>;

double Above(double x) { return std::nextafter(x, kInf); }
double Below(double x) { return std::nextafter(x, -kInf); }

GuardCause AcceptedBy(const certified_plan_t& certified, std::int64_t now = kNow) {
  Guard guard(TwoStates());
  return guard.Accept(Sealed(certified), now).cause;
}

// What a fresh guard says to starting `certified` at `boundary` in `state`.
GuardVerdict Start(const certified_plan_t& certified, const State& state, std::int64_t boundary = kStart) {
  Guard guard(TwoStates());
  EXPECT_EQ(guard.Accept(Sealed(certified), kNow).cause, GuardCause::kNone);
  return guard.TryStart(boundary, boundary, state);
}

Guard Executing(const certified_plan_t& certified = SmallPlan()) {
  Guard guard(TwoStates());
  EXPECT_TRUE(guard.Accept(Sealed(certified), kNow).ok());
  EXPECT_TRUE(guard.TryStart(kStart, kStart, State{1, -2}).ok());
  return guard;
}

TEST(GuardAccept, APlanThatPassesIsPendingAndNotYetExecuting) {
  Guard guard(TwoStates());
  const GuardVerdict verdict = guard.Accept(Sealed(SmallPlan()), kNow);
  EXPECT_EQ(verdict.cause, GuardCause::kNone) << verdict.message;
  EXPECT_EQ(verdict.plan_id, 7);
  ASSERT_NE(guard.pending(), nullptr);
  EXPECT_FIELDS(guard, (pending()->plan.plan_id, 7), (executing(), nullptr));
}

// With these digests.
GuardCause CauseOf(Guard& guard, std::int64_t plan_id, const char* config, const char* model = "model") {
  certified_plan_t certified = SmallPlan(plan_id);
  SetDigest(certified.config_digest, DigestOf(config));
  SetDigest(certified.model_digest, DigestOf(model));
  return guard.Accept(Sealed(certified), kNow).cause;
}

TEST(GuardAccept, TakesPlansOfTheTaskThatItIsToldToExpect) {
  Guard guard(TwoStates());
  EXPECT_EQ(CauseOf(guard, 10, "another config", "model"), GuardCause::kConfigDigest);
  guard.Expect(DigestOf("another config"), DigestOf("another model"));
  EXPECT_EQ(CauseOf(guard, 11, "another config", "model"), GuardCause::kConfigDigest);
  EXPECT_EQ(CauseOf(guard, 12, "config", "another model"), GuardCause::kModelDigest);
  EXPECT_EQ(CauseOf(guard, 13, "config", "model"), GuardCause::kNone) << "the certifier may have refused the new one";
  EXPECT_EQ(CauseOf(guard, 14, "another config", "another model"), GuardCause::kNone);
  EXPECT_EQ(CauseOf(guard, 15, "config", "model"), GuardCause::kConfigDigest) << "it has not";
  EXPECT_EQ(CauseOf(guard, 16, "another config", "another model"), GuardCause::kNone);
}

TEST(GuardAccept, EachTaskThatWasReadAgainMayBeTheOneInForce) {
  Guard guard(TwoStates());
  guard.Expect(DigestOf("second"), DigestOf("model"));
  guard.Expect(DigestOf("third"), DigestOf("model"));
  EXPECT_EQ(CauseOf(guard, 10, "second"), GuardCause::kNone)
      << "the certifier has refused the third, or not taken it yet";
  EXPECT_EQ(CauseOf(guard, 11, "config"), GuardCause::kConfigDigest);
  EXPECT_EQ(CauseOf(guard, 12, "third"), GuardCause::kNone);
  EXPECT_EQ(CauseOf(guard, 13, "second"), GuardCause::kConfigDigest);
}

TEST(GuardAccept, APlanOfTheNewestTaskInvalidatesAllOlderOnesAtOnce) {
  Guard guard(TwoStates());
  guard.Expect(DigestOf("second"), DigestOf("model"));
  guard.Expect(DigestOf("third"), DigestOf("model"));
  EXPECT_EQ(CauseOf(guard, 10, "third"), GuardCause::kNone);
  EXPECT_EQ(CauseOf(guard, 11, "second"), GuardCause::kConfigDigest) << "no plan of it has come, and none may any more";
  EXPECT_EQ(CauseOf(guard, 12, "config"), GuardCause::kConfigDigest);
  EXPECT_EQ(CauseOf(guard, 13, "third"), GuardCause::kNone);
}

TEST(GuardAccept, RefusesAFlippedBitAnywhere) {
  const std::vector<std::uint8_t> good = Sealed(SmallPlan());
  Guard guard(TwoStates());
  for (std::size_t i = 0; i < good.size(); i += i < 1024 || i + 512 > good.size() ? 1 : 37) {
    std::vector<std::uint8_t> bad = good;
    bad[i] ^= static_cast<std::uint8_t>(1u << i % 8);
    const GuardVerdict verdict = guard.Accept(bad, kNow);
    ASSERT_FALSE(verdict.ok()) << "byte " << i;
    ASSERT_FALSE(verdict.message.empty()) << "byte " << i;
    ASSERT_EQ(guard.pending(), nullptr);
  }
  EXPECT_TRUE(guard.Accept(good, kNow).ok());
}

TEST(GuardAccept, RefusesEveryWrongLengthAndEveryOtherType) {
  const std::vector<std::uint8_t> good = Sealed(SmallPlan());
  Guard guard(TwoStates());
  for (std::size_t size : {0ul, 7ul, 8ul, 9ul, good.size() / 2, good.size() - 1})
    EXPECT_EQ(guard.Accept(Bytes(good).first(size), kNow).cause, GuardCause::kWrongLength) << size;
  std::vector<std::uint8_t> longer = good;
  longer.push_back(0);
  EXPECT_EQ(guard.Accept(longer, kNow).cause, GuardCause::kTrailingBytes);
  EXPECT_EQ(guard.Accept(Encode(SmallPlan().plan), kNow).cause, GuardCause::kUnknownFingerprint);
}

TEST(GuardAccept, RefusesAPlanForAnotherRobot) {
  const auto with = [](auto change) {
    certified_plan_t certified = SmallPlan();
    change(certified.plan);
    return AcceptedBy(certified);
  };
  EXPECT_EQ(with([](auto& plan) { plan.num_states = 1; }), GuardCause::kWrongDimension);
  EXPECT_EQ(with([](auto& plan) { plan.num_states = -1; }), GuardCause::kWrongDimension);
  EXPECT_EQ(with([](auto& plan) { plan.num_inputs = 2; }), GuardCause::kWrongDimension);
  EXPECT_EQ(with([](auto& plan) { plan.num_steps = 0; }), GuardCause::kWrongDimension);
  EXPECT_EQ(with([](auto& plan) { plan.num_steps = 129; }), GuardCause::kWrongDimension);
  EXPECT_EQ(with([](auto& plan) { plan.num_steps = 128; }), GuardCause::kNone);
  EXPECT_EQ(with([](auto& plan) { plan.progress_steps = 3; }), GuardCause::kNone);
  EXPECT_EQ(with([](auto& plan) { plan.progress_steps = 4; }), GuardCause::kWrongDimension);
  EXPECT_EQ(with([](auto& plan) { plan.progress_steps = -1; }), GuardCause::kWrongDimension);
  EXPECT_EQ(with([](auto& plan) { plan.step_us = kStep + 1; }), GuardCause::kWrongStepPeriod);
}

TEST(GuardAccept, RefusesWrongDigests) {
  certified_plan_t certified = SmallPlan();
  Seal(certified);
  certified.plan_digest[31] ^= 1;
  SetDigest(certified.certificate_digest, CertificateDigest(certified));
  Guard guard(TwoStates());
  EXPECT_EQ(guard.Accept(Encode(certified), kNow).cause, GuardCause::kPlanDigest);

  Seal(certified);
  certified.slice_upper[2][0] += 1;
  EXPECT_EQ(guard.Accept(Encode(certified), kNow).cause, GuardCause::kCertificateDigest);

  // Resealing what was changed does not help where an expected digest is known.
  certified = SmallPlan();
  SetDigest(certified.config_digest, DigestOf("another config"));
  EXPECT_EQ(guard.Accept(Sealed(certified), kNow).cause, GuardCause::kConfigDigest);
  certified = SmallPlan();
  SetDigest(certified.model_digest, DigestOf("another model"));
  EXPECT_EQ(guard.Accept(Sealed(certified), kNow).cause, GuardCause::kModelDigest);

  GuardOptions anything = TwoStates();
  anything.config_digest.reset();
  anything.model_digest.reset();
  SetDigest(certified.config_digest, DigestOf("another config"));
  EXPECT_TRUE(Guard(anything).Accept(Sealed(certified), kNow).ok());
}

TEST(GuardAccept, RefusesWhatTheSealDoesNotAllow) {
  const auto altered = [](auto change) {
    certified_plan_t certified = SmallPlan();
    Seal(certified);
    change(certified);
    return Guard(TwoStates()).Accept(Encode(certified), kNow);
  };
  EXPECT_EQ(altered([](auto& c) { c.slice_upper[3][1] = Below(5); }).cause, GuardCause::kCertificateDigest);
  EXPECT_EQ(altered([](auto& c) { c.plan.control[2][0] = Above(0); }).cause, GuardCause::kPlanDigest);
  EXPECT_EQ(altered([](auto& c) { c.plan.control[90][5] = 1; }).cause, GuardCause::kPlanDigest) << "not in use";
  EXPECT_EQ(altered([](auto& c) { ++c.expires_utime; }).cause, GuardCause::kCertificateDigest);

  const GuardVerdict verdict = altered([](auto& c) { c.slice_upper[4][1] = 5; });
  EXPECT_EQ(verdict.cause, GuardCause::kUnusedEntry);
  EXPECT_EQ(GuardCauseName(verdict.cause), "unused_entry");
  EXPECT_FIELDS(verdict, (step, 4), (coordinate, 1), (value, 5),
                (message, "slice_upper[4][1] is 5, it has to be 0, because it is not in use"));
  EXPECT_EQ(altered([](auto& c) { c.slice_lower[0][2] = -0.0; }).cause, GuardCause::kUnusedEntry);
  EXPECT_EQ(altered([](auto& c) { c.slice_lower[128][15] = kNaN; }).cause, GuardCause::kUnusedEntry);
}

TEST(GuardAccept, RefusesNumbersThatAreNotFiniteAndEmptyBounds) {
  for (const double bad : {kNaN, kInf, -kInf}) {
    for (const auto change : {+[](certified_plan_t&c, double x) { c.plan.initial_center[1] = x; },
                              +[](certified_plan_t&c, double x) { c.plan.initial_half_width[0] = x; },
                              +[](certified_plan_t&c, double x) { c.plan.control[2][0] = x; },
                              +[](certified_plan_t&c, double x) { c.slice_lower[3][1] = x; },
                              +[](certified_plan_t&c, double x) { c.slice_upper[0][0] = x; }}) {
      certified_plan_t certified = SmallPlan();
      change(certified, bad);
      EXPECT_EQ(AcceptedBy(certified), GuardCause::kNonFinite) << bad;
    }
  }
  certified_plan_t certified = SmallPlan();
  certified.plan.initial_half_width[1] = -1e-300;
  EXPECT_EQ(AcceptedBy(certified), GuardCause::kNonFinite);
  certified.plan.initial_half_width[1] = 0;
  EXPECT_EQ(AcceptedBy(certified), GuardCause::kNone);
}

TEST(GuardAccept, RefusesAnEmptySliceWithItsWitness) {
  certified_plan_t certified = SmallPlan();
  certified.slice_lower[3][1] = certified.slice_upper[3][1] = 0.5;
  EXPECT_EQ(AcceptedBy(certified), GuardCause::kNone);
  certified.slice_lower[3][1] = Above(0.5);
  Guard guard(TwoStates());
  const GuardVerdict verdict = guard.Accept(Sealed(certified), kNow);
  EXPECT_FIELDS(verdict, (cause, GuardCause::kEmptySlice), (step, 3), (coordinate, 1), (value, Above(0.5)),
                (bound, 0.5), (plan_id, 7));
}

TEST(GuardAccept, ExpiryItselfIsStillInTime) {
  const std::int64_t expires = SmallPlan().expires_utime;
  EXPECT_EQ(AcceptedBy(SmallPlan(), expires), GuardCause::kNone);
  EXPECT_EQ(AcceptedBy(SmallPlan(), expires + 1), GuardCause::kExpired);
}

TEST(GuardAccept, APlanIdIsAcceptedOnceAndOnlyUpwards) {
  Guard guard(TwoStates());
  EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(7)), kNow).ok());
  EXPECT_EQ(guard.Accept(Sealed(SmallPlan(7)), kNow).cause, GuardCause::kReplayed);
  EXPECT_EQ(guard.Accept(Sealed(SmallPlan(6)), kNow).cause, GuardCause::kReplayed);
  EXPECT_EQ(guard.pending()->plan.plan_id, 7);
  EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(8)), kNow).ok());
  EXPECT_EQ(guard.pending()->plan.plan_id, 8) << "the newest wins";
  EXPECT_TRUE(guard.TryStart(kStart, kStart, State{1, -2}).ok());
  EXPECT_EQ(guard.Accept(Sealed(SmallPlan(8)), kNow).cause, GuardCause::kReplayed) << "also once it has started";
}

TEST(GuardAccept, NoPlanIdKeepsLaterOnesOutForGood) {
  Guard guard(TwoStates());
  const auto accept = [&](std::int64_t plan_id, std::int64_t expires, std::int64_t now) {
    certified_plan_t certified = SmallPlan(plan_id);
    certified.expires_utime = expires;
    return guard.Accept(Sealed(certified), now).cause;
  };
  EXPECT_EQ(accept(5, kNow + 100, kNow), GuardCause::kNone);
  EXPECT_EQ(accept(INT64_MAX, kNow + 50, kNow), GuardCause::kNone);
  EXPECT_EQ(accept(6, kNow + 200, kNow + 100), GuardCause::kReplayed) << "plan 5 could come again";
  EXPECT_EQ(accept(5, kNow + 100, kNow + 101), GuardCause::kExpired);
  EXPECT_EQ(accept(6, kNow + 200, kNow + 101), GuardCause::kNone);

  Guard executing = Executing(SmallPlan(7));
  const std::int64_t expiry = SmallPlan().expires_utime;
  for (const std::int64_t plan_id : {7, 6}) {
    certified_plan_t certified = SmallPlan(plan_id);
    certified.expires_utime = expiry + 100;
    EXPECT_EQ(executing.Accept(Sealed(certified), expiry + 1).cause,
              plan_id == 7 ? GuardCause::kReplayed : GuardCause::kNone);
  }
}

TEST(GuardAccept, ARefusedPlanLeavesPendingAndLastIdAlone) {
  Guard guard(TwoStates());
  EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(7)), kNow).ok());
  certified_plan_t expired = SmallPlan(100);
  expired.expires_utime = kNow - 1;
  EXPECT_EQ(guard.Accept(Sealed(expired), kNow).cause, GuardCause::kExpired);
  EXPECT_EQ(guard.pending()->plan.plan_id, 7);
  EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(8)), kNow).ok());
}

TEST(GuardStart, TakesTheBoundsOfX0AsInside) {
  for (const double x : {0.5, 1.5}) EXPECT_TRUE(Start(SmallPlan(), {x, -2}).ok()) << x;
  for (const double y : {-2.25, -1.75}) EXPECT_TRUE(Start(SmallPlan(), {1, y}).ok()) << y;
  for (const State outside : {State{Below(0.5), -2}, {Above(1.5), -2}, {1, Below(-2.25)}, {1, Above(-1.75)}})
    EXPECT_EQ(Start(SmallPlan(), outside).cause, GuardCause::kOutsideInitialSet) << outside[0] << ' ' << outside[1];

  const GuardVerdict verdict = Start(SmallPlan(), {1, Above(-1.75)});
  EXPECT_FIELDS(verdict, (coordinate, 1), (value, Above(-1.75)), (bound, -1.75), (plan_id, 7));
}

// center +- half_width is rarely a double: the comparison has to be that of real numbers.
TEST(GuardStart, X0IsComparedExactly) {
  const std::uint64_t seed = 20240611;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  const auto draw = [&random](int exponents) {
    const double mantissa = static_cast<double>(random() >> 11) * 0x1p-52 - 1;
    return std::ldexp(mantissa, static_cast<int>(random() % static_cast<unsigned>(exponents)) - exponents / 2);
  };
  int on_the_edge = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    certified_plan_t certified = SmallPlan();
    const double center = certified.plan.initial_center[0] = draw(60);
    const double half_width = certified.plan.initial_half_width[0] = std::abs(draw(60));
    for (int t = 0; t <= 3; ++t) {
      certified.slice_lower[t][0] = -1e30;
      certified.slice_upper[t][0] = 1e30;
    }
    for (const double edge : {center + half_width, center - half_width}) {
      for (const double x : {Below(edge), edge, Above(edge)}) {
        const bool inside = abs(mpq_class(x) - mpq_class(center)) <= mpq_class(half_width);
        EXPECT_EQ(Start(certified, {x, -2}).ok(), inside) << x << ": " << center << " +- " << half_width;
        on_the_edge += x == edge && !inside;
      }
    }
  }
  EXPECT_GT(on_the_edge, 100) << "some rounded sums lie outside, or the exact comparison is not tested";
}

TEST(GuardStart, AFlatX0AdmitsOneStateOnly) {
  certified_plan_t certified = SmallPlan();
  certified.plan.initial_half_width[0] = certified.plan.initial_half_width[1] = 0;
  EXPECT_TRUE(Start(certified, {1, -2}).ok());
  EXPECT_EQ(Start(certified, {Above(1), -2}).cause, GuardCause::kOutsideInitialSet);
}

TEST(GuardStart, RefusesStatesThatAreNoNumbersOrTooFew) {
  for (const double bad : {kNaN, kInf, -kInf}) {
    EXPECT_EQ(Start(SmallPlan(), {bad, -2}).cause, GuardCause::kOutsideInitialSet) << bad;
    EXPECT_EQ(Start(SmallPlan(), {1, bad}).cause, GuardCause::kOutsideInitialSet) << bad;
  }
  Guard guard(TwoStates());
  EXPECT_TRUE(guard.Accept(Sealed(SmallPlan()), kNow).ok());
  EXPECT_EQ(guard.TryStart(kStart, kStart, std::array{1.0}).cause, GuardCause::kWrongStateSize);
}

TEST(GuardStart, TheStateHasToLieInSliceZeroToo) {
  certified_plan_t certified = SmallPlan();
  certified.slice_upper[0][0] = 1.25;
  EXPECT_TRUE(Start(certified, {1.25, -2}).ok());
  EXPECT_FIELDS(Start(certified, {Above(1.25), -2}), (cause, GuardCause::kOutsideSlice), (step, 0), (bound, 1.25));
}

TEST(GuardStart, HalfAStepOffIsOnTime) {
  EXPECT_TRUE(Start(SmallPlan(), {1, -2}, kStart - kStep / 2).ok());
  EXPECT_TRUE(Start(SmallPlan(), {1, -2}, kStart + kStep / 2).ok());
  EXPECT_EQ(Start(SmallPlan(), {1, -2}, kStart - kStep / 2 - 1).cause, GuardCause::kTooEarly);
  EXPECT_EQ(Start(SmallPlan(), {1, -2}, kStart + kStep / 2 + 1).cause, GuardCause::kTooLate);
  certified_plan_t certified = SmallPlan();
  certified.plan.start_utime = std::numeric_limits<std::int64_t>::min();
  EXPECT_EQ(Start(certified, {1, -2}).cause, GuardCause::kTooLate);
  certified.plan.start_utime = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(Start(certified, {1, -2}).cause, GuardCause::kTooEarly);
}

TEST(GuardStart, ExpiryCountsAtTheBoundary) {
  certified_plan_t certified = SmallPlan();
  certified.expires_utime = kStart;
  EXPECT_TRUE(Start(certified, {1, -2}, kStart).ok());
  EXPECT_EQ(Start(certified, {1, -2}, kStart + 1).cause, GuardCause::kExpired);
}

TEST(GuardStart, ARobotThatWasHeldUpDoesNotStartWhatHasExpiredMeanwhile) {
  certified_plan_t certified = SmallPlan();
  certified.expires_utime = kStart + 10 * kStep;
  for (const std::int64_t late : {0, 1}) {
    Guard guard(TwoStates());
    ASSERT_TRUE(guard.Accept(Sealed(certified), kNow).ok());
    EXPECT_EQ(guard.TryStart(kStart, certified.expires_utime + late, State{1, -2}).cause,
              late ? GuardCause::kExpired : GuardCause::kNone);
  }
}

TEST(GuardStart, KeepsAPendingPlanOnlyIfItIsEarly) {
  Guard guard(TwoStates());
  EXPECT_EQ(guard.TryStart(kStart, kStart, State{1, -2}).cause, GuardCause::kNothingPending);
  EXPECT_TRUE(guard.Accept(Sealed(SmallPlan()), kNow).ok());
  EXPECT_EQ(guard.TryStart(kStart - kStep, kStart - kStep, State{1, -2}).cause, GuardCause::kTooEarly);
  EXPECT_EQ(guard.TryStart(kStart, kStart, State{2, -2}).cause, GuardCause::kOutsideInitialSet);
  EXPECT_EQ(guard.TryStart(kStart, kStart, State{1, -2}).cause, GuardCause::kNothingPending);
}

TEST(GuardStart, ANewPlanTakesOverAndARefusedOneDoesNot) {
  Guard guard = Executing(SmallPlan(7));
  EXPECT_TRUE(guard.Check(1, State{1, -2}, kNow).ok());
  EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(8)), kNow).ok());
  EXPECT_FALSE(guard.TryStart(kStart, kStart, State{9, -2}).ok());
  ASSERT_NE(guard.executing(), nullptr);
  EXPECT_EQ(guard.executing()->plan.plan_id, 7);
  EXPECT_TRUE(guard.Check(2, State{1, -2}, kNow).ok()) << "the plan before goes on";

  EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(9)), kNow).ok());
  EXPECT_TRUE(guard.TryStart(kStart, kStart, State{1, -2}).ok());
  EXPECT_EQ(guard.executing()->plan.plan_id, 9);
  EXPECT_TRUE(guard.Check(1, State{1, -2}, kNow).ok()) << "the new plan begins at its own step 1";
}

TEST(GuardCheck, BoundsAreInsideAndTheNextNumberIsNot) {
  for (int step = 1; step <= 3; ++step) {
    for (const State inside : {State{-10.0 - step, -5}, {10.0 + step, 5}}) {
      Guard guard = Executing();
      for (int t = 1; t < step; ++t) ASSERT_TRUE(guard.Check(t, State{0, 0}, kNow).ok());
      EXPECT_TRUE(guard.Check(step, inside, kNow).ok()) << step;
    }
    const double reach = 10.0 + step;
    for (const State outside : {State{Below(-reach), 0}, {Above(reach), 0}, {0, Below(-5)}, {0, Above(5)}}) {
      Guard guard = Executing();
      for (int t = 1; t < step; ++t) ASSERT_TRUE(guard.Check(t, State{0, 0}, kNow).ok());
      const GuardVerdict verdict = guard.Check(step, outside, kNow);
      const int k = outside[0] != 0 ? 0 : 1;
      EXPECT_FIELDS(verdict, (cause, GuardCause::kOutsideSlice), (step, step), (coordinate, k),
                    (value, outside[static_cast<std::size_t>(k)]));
      EXPECT_EQ(std::abs(verdict.bound), k == 0 ? reach : 5);
      EXPECT_EQ(verdict.plan_id, 7);
    }
  }
}

TEST(GuardCheck, AfterARefusalNothingIsExecuting) {
  for (const State bad : {State{kNaN, 0}, {0, kNaN}, {kInf, 0}, {0, -kInf}, {11.5, 0}}) {
    Guard guard = Executing();
    EXPECT_EQ(guard.Check(1, bad, kNow).cause, GuardCause::kOutsideSlice);
    EXPECT_EQ(guard.executing(), nullptr);
    EXPECT_EQ(guard.Check(2, State{0, 0}, kNow).cause, GuardCause::kNotExecuting);
  }
}

TEST(GuardCheck, AgainItLooksAtTheSameSliceAndAtTheTime) {
  const auto after = [&](int steps, const State& state, std::int64_t late_us) {
    Guard guard(TwoStates());
    EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(7, 3000)), kNow).ok());
    EXPECT_TRUE(guard.TryStart(kStart, kStart, State{1, -2}).ok());
    for (int t = 1; t <= steps; ++t) EXPECT_TRUE(guard.Check(t, State{0, 0}, kStart + t * kStep).ok());
    const GuardVerdict verdict = guard.CheckAgain(state, kStart + steps * kStep + late_us);
    EXPECT_EQ(guard.executing() != nullptr, verdict.ok());
    EXPECT_EQ(guard.halted(), verdict.cause == GuardCause::kOutsideSlice);
    return verdict.cause;
  };
  EXPECT_EQ(after(0, {1.5, -2}, 3000), GuardCause::kNone);
  EXPECT_EQ(after(0, {1.51, -2}, 0), GuardCause::kOutsideInitialSet);
  EXPECT_EQ(after(0, {1, -2}, 3001), GuardCause::kOffSchedule);
  EXPECT_EQ(after(1, {11, 0}, 3000), GuardCause::kNone);
  EXPECT_EQ(after(1, {11.1, 0}, 0), GuardCause::kOutsideSlice) << "of step 1, not of step 2";
  EXPECT_EQ(after(1, {0, 0}, 3001), GuardCause::kOffSchedule);
  EXPECT_EQ(after(1, {0, 0}, -3001), GuardCause::kOffSchedule);
  EXPECT_EQ(after(3, {0, 0}, 0), GuardCause::kNone);
  Guard idle(TwoStates());
  EXPECT_EQ(idle.CheckAgain(State{0, 0}, kNow).cause, GuardCause::kNotExecuting);
}

// A step that began early and ends late is too long, though both are on time.
TEST(GuardCheck, AgainItLooksAtHowLongTheStepBeforeHasLasted) {
  for (const bool too_long : {false, true}) {
    Guard guard(TwoStates());
    EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(7, 3000)), kNow).ok());
    EXPECT_TRUE(guard.TryStart(kStart, kStart - 1000, State{1, -2}).ok());
    EXPECT_TRUE(guard.Check(1, State{0, 0}, kStart + kStep).ok());
    EXPECT_EQ(guard.CheckAgain(State{0, 0}, kStart + kStep + 2000 + too_long).ok(), !too_long);
    if (!too_long)
      EXPECT_TRUE(guard.Check(2, State{0, 0}, kStart + 2 * kStep + 2000).ok()) << "its control is applied from then on";
  }
}

// Each is within 3 ms of the plan's schedule, and within 3 ms longer than a step.
TEST(GuardCheck, StepsAreOnTimeByTheFirstStepToo) {
  for (const std::int64_t first : {-2000, 0, 2000})
    for (const std::int64_t off : {-3000, 3000})
      for (const bool too_far : {false, true}) {
        Guard guard(TwoStates());
        EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(7, 3000)), kNow).ok());
        EXPECT_TRUE(guard.TryStart(kStart, kStart + first, State{1, -2}).ok());
        EXPECT_TRUE(guard.Check(1, State{0, 0}, kStart + kStep + first).ok());
        const std::int64_t at = first + off + (off < 0 ? -1 : 1) * too_far;
        const bool is_on_schedule = std::abs(at) <= 3000;
        EXPECT_EQ(guard.Check(2, State{0, 0}, kStart + 2 * kStep + at).ok(), is_on_schedule && !too_far)
            << first << " " << off << " " << too_far;
      }
}

// With CheckAgain the plan begins when its first control is applied.
TEST(GuardCheck, AgainAtTheFirstStepItBeginsThen) {
  for (const bool too_early : {false, true}) {
    Guard guard(TwoStates());
    EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(7, 3000)), kNow).ok());
    EXPECT_TRUE(guard.TryStart(kStart, kStart, State{1, -2}).ok());
    EXPECT_TRUE(guard.CheckAgain(State{1, -2}, kStart + 2500).ok());
    const GuardVerdict verdict = guard.Check(1, State{0, 0}, kStart + kStep - 500 - too_early);
    EXPECT_EQ(verdict.ok(), !too_early);
    if (too_early) EXPECT_THAT(verdict.message, HasSubstr("us by the first step, it is 3001 us too early"));
  }
}

TEST(GuardCheck, StepsComeInOrderAndEndAtTheHorizon) {
  Guard guard = Executing();
  EXPECT_EQ(guard.Check(2, State{0, 0}, kNow).cause, GuardCause::kStepOutOfOrder) << "step 1 was not checked";
  guard = Executing();
  for (int t = 1; t <= 3; ++t) EXPECT_TRUE(guard.Check(t, State{0, 0}, kNow).ok());
  EXPECT_EQ(guard.Check(4, State{0, 0}, kNow).cause, GuardCause::kStepOutOfOrder);
  guard = Executing();
  EXPECT_TRUE(guard.Check(1, State{0, 0}, kNow).ok());
  EXPECT_EQ(guard.Check(1, State{0, 0}, kNow).cause, GuardCause::kStepOutOfOrder);
  guard = Executing();
  EXPECT_EQ(guard.Check(1, std::array{0.0, 0.0, 0.0}, kNow).cause, GuardCause::kWrongStateSize);
  guard = Executing();
  guard.Finish();
  EXPECT_EQ(guard.executing(), nullptr);
  EXPECT_EQ(guard.Check(1, State{0, 0}, kNow).cause, GuardCause::kNotExecuting);
}

// ---- The schedule.

constexpr std::int64_t kJitter = 3000, kMost = std::numeric_limits<std::int64_t>::max();

Guard OnTime(std::int64_t jitter_us = kJitter) {
  Guard guard(TwoStates());
  EXPECT_TRUE(guard.Accept(Sealed(SmallPlan(7, jitter_us)), kNow).ok());
  return guard;
}

Guard ExecutingOnTime() {
  Guard guard = OnTime();
  EXPECT_TRUE(guard.TryStart(kStart, kStart, State{1, -2}).ok());
  return guard;
}

TEST(GuardSchedule, AStepWithinTheJitterPassesAndOneOutsideEndsThePlan) {
  for (const int step : {1, 2, 3}) {
    for (const std::int64_t off : {-kJitter, std::int64_t{0}, kJitter}) {
      Guard guard = ExecutingOnTime();
      for (int t = 1; t < step; ++t) ASSERT_TRUE(guard.Check(t, State{0, 0}, kStart + t * kStep).ok());
      EXPECT_TRUE(guard.Check(step, State{0, 0}, kStart + step * kStep + off).ok()) << off;
    }
    for (const std::int64_t off : {-kJitter - 1, kJitter + 1}) {
      Guard guard = ExecutingOnTime();
      for (int t = 1; t < step; ++t) ASSERT_TRUE(guard.Check(t, State{0, 0}, kStart + t * kStep).ok());
      const GuardVerdict verdict = guard.Check(step, State{0, 0}, kStart + step * kStep + off);
      EXPECT_FIELDS(verdict, (cause, GuardCause::kOffSchedule), (plan_id, 7), (step, step),
                    (value, static_cast<double>(off)), (bound, static_cast<double>(kJitter)));
      EXPECT_THAT(verdict.message,
                  HasSubstr("was due at " + std::to_string(kStart + step * kStep) + " us, it is 3001 us too " +
                            (off > 0 ? "late" : "early") + ", at most 3000 us are allowed"));
      EXPECT_EQ(guard.executing(), nullptr);
      EXPECT_FALSE(guard.halted()) << "the next plan is looked at by its own time";
      EXPECT_EQ(guard.Check(step + 1, State{0, 0}, kStart + (step + 1) * kStep).cause, GuardCause::kNotExecuting);
    }
  }
}

// Early by a part of the jitter and then late by another part: each on time, and too long between them.
TEST(GuardSchedule, AStepLastsNoLongerThanTheJitterAllows) {
  for (const std::int64_t too_long : {0, 1}) {
    Guard guard = OnTime();
    ASSERT_TRUE(guard.TryStart(kStart, kStart - 1000, State{1, -2}).ok());
    const GuardVerdict first = guard.Check(1, State{0, 0}, kStart + kStep + kJitter - 1000 + too_long);
    EXPECT_EQ(first.cause, too_long ? GuardCause::kOffSchedule : GuardCause::kNone) << first.message;
  }
  for (const std::int64_t too_long : {0, 1}) {
    Guard guard = ExecutingOnTime();
    ASSERT_TRUE(guard.Check(1, State{0, 0}, kStart + kStep - kJitter).ok());
    const GuardVerdict second = guard.Check(2, State{0, 0}, kStart + 2 * kStep + too_long);
    EXPECT_EQ(second.cause, too_long ? GuardCause::kOffSchedule : GuardCause::kNone);
    if (!too_long) continue;
    EXPECT_FIELDS(second, (step, 2), (value, static_cast<double>(kJitter + 1)), (bound, static_cast<double>(kJitter)));
    EXPECT_THAT(second.message, HasSubstr("the step before step 2 lasted " + std::to_string(kStep + kJitter + 1) +
                                          " us, at most " + std::to_string(kStep + kJitter) + " us are allowed"));
    EXPECT_EQ(guard.executing(), nullptr);
    EXPECT_FALSE(guard.halted());
  }
}

// A robot that moves has gone on meanwhile, and no certificate says where to.
TEST(GuardSchedule, AStepOffItsTimeEndsThePlanAloneWhereverTheRobotIs) {
  for (const bool again : {false, true}) {
    for (const auto& [late, cause] :
         {std::pair(kJitter, GuardCause::kOutsideSlice), std::pair(kJitter + 1, GuardCause::kOffSchedule)}) {
      Guard guard = ExecutingOnTime();
      if (again) ASSERT_TRUE(guard.Check(1, State{0, 0}, kStart + kStep).ok());
      const std::int64_t now = kStart + kStep + late;
      EXPECT_EQ((again ? guard.CheckAgain(State{100, 0}, now) : guard.Check(1, State{100, 0}, now)).cause, cause);
      EXPECT_EQ(guard.halted(), cause == GuardCause::kOutsideSlice) << late;
      EXPECT_EQ(guard.executing(), nullptr);
    }
  }
}

TEST(GuardSchedule, AStartIsWithinTheJitterToo) {
  for (const std::int64_t off : {-kJitter, std::int64_t{0}, kJitter}) {
    Guard guard = OnTime();
    EXPECT_TRUE(guard.TryStart(kStart + off, kStart + off, State{1, -2}).ok()) << off;
  }
  for (const std::int64_t off : {-kJitter - 1, kJitter + 1}) {
    Guard guard = OnTime();
    EXPECT_EQ(guard.TryStart(kStart, kStart + off, State{1, -2}).cause, GuardCause::kOffSchedule);
    EXPECT_FIELDS(guard, (pending(), nullptr), (executing(), nullptr));
  }
  Guard early = OnTime(), late = OnTime();
  EXPECT_EQ(early.TryStart(kStart - kJitter - 1, kStart - kJitter - 1, State{1, -2}).cause, GuardCause::kTooEarly);
  EXPECT_TRUE(early.TryStart(kStart, kStart, State{1, -2}).ok());
  EXPECT_EQ(late.TryStart(kStart + kJitter + 1, kStart + kJitter + 1, State{1, -2}).cause, GuardCause::kTooLate);
}

// In the middle of a plan, and not back again.
TEST(GuardSchedule, AClockThatIsSetByMoreThanTheJitterEndsThePlan) {
  for (const std::int64_t set : {-kJitter - 1, -kJitter, kJitter, kJitter + 1}) {
    Guard guard = ExecutingOnTime();
    ASSERT_TRUE(guard.Check(1, State{0, 0}, kStart + kStep).ok());
    const bool is_seen = std::abs(set) > kJitter;
    EXPECT_EQ(guard.Check(2, State{0, 0}, kStart + 2 * kStep + set).ok(), !is_seen) << set;
    EXPECT_EQ(guard.executing() == nullptr, is_seen);
  }
}

// Half a step stays the bound where the jitter is larger.
TEST(GuardSchedule, ALargeJitterAllowsNoOtherBoundary) {
  Guard guard = OnTime(kMost);
  EXPECT_EQ(guard.TryStart(kStart - kStep / 2 - 1, kStart, State{1, -2}).cause, GuardCause::kTooEarly);
  EXPECT_TRUE(guard.TryStart(kStart + kStep / 2, kStart, State{1, -2}).ok());
}

TEST(GuardSchedule, TimesThatNoIntegerHoldsAreOffTheSchedule) {
  for (const std::int64_t now : {kMost, -kMost - 1, std::int64_t{0}}) {
    Guard guard = ExecutingOnTime();
    EXPECT_EQ(guard.Check(1, State{0, 0}, now).cause, GuardCause::kOffSchedule) << now;
  }
  certified_plan_t last = SmallPlan(7, kJitter);
  last.plan.start_utime = last.expires_utime = kMost - kStep;  // its second step is due after the last time of all
  Guard guard(TwoStates());
  ASSERT_TRUE(guard.Accept(Sealed(last), kNow).ok());
  ASSERT_TRUE(guard.TryStart(kMost - kStep, kMost - kStep, State{1, -2}).ok());
  EXPECT_TRUE(guard.Check(1, State{0, 0}, kMost).ok());
  EXPECT_TRUE(guard.Check(2, State{0, 0}, kMost).ok()) << "it cannot be later";
  EXPECT_EQ(guard.Check(3, State{0, 0}, -kMost - 1).cause, GuardCause::kOffSchedule);
}

TEST(GuardSchedule, EachPlanIsHeldToItsOwn) {
  for (const std::int64_t late : {1000, 1001}) {
    Guard guard = ExecutingOnTime();
    certified_plan_t next = SmallPlan(8, 1000);
    next.plan.start_utime += kStep;
    next.expires_utime += kStep;
    ASSERT_TRUE(guard.Accept(Sealed(next), kNow).ok());
    EXPECT_TRUE(guard.Check(1, State{1, -2}, kStart + kStep + kJitter).ok()) << "the pending plan's does not count yet";
    EXPECT_EQ(guard.TryStart(kStart + kStep, kStart + kStep + late, State{1, -2}).ok(), late == 1000);
  }
}

TEST(GuardSchedule, RefusesAStepErrorThatIsNone) {
  for (const std::int64_t none : {std::int64_t{-2}, -kMost - 1}) {
    Guard guard(TwoStates());
    const GuardVerdict verdict = guard.Accept(Sealed(SmallPlan(7, none)), kNow);
    EXPECT_FIELDS(verdict, (cause, GuardCause::kNonFinite), (message, "step_error_us is " + std::to_string(none)));
  }
}

TEST(GuardSchedule, ChecksNoTimesWithoutAJitter) {
  Guard guard = Executing();
  EXPECT_TRUE(guard.Check(1, State{0, 0}, kMost).ok());
  EXPECT_TRUE(guard.Check(2, State{0, 0}, -kMost - 1).ok());
}

TEST(GuardHalt, AStateOutsideItsSliceHaltsUntilAReset) {
  Guard guard = Executing();
  EXPECT_EQ(guard.Check(1, State{100, 0}, kNow).cause, GuardCause::kOutsideSlice);
  EXPECT_TRUE(guard.halted());
  const auto next = Sealed(SmallPlan(8));
  EXPECT_EQ(guard.Accept(next, kNow).cause, GuardCause::kHalted);
  EXPECT_EQ(guard.TryStart(kNow, kNow, State{0, 0}).cause, GuardCause::kHalted);
  guard.Reset();
  EXPECT_TRUE(guard.Accept(next, kNow).ok());
}

GuardOptions WithKeys(const KeyRing& keys = TestKeys()) {
  GuardOptions options = TwoStates();
  options.keys = keys;
  options.bus_name = "the bus";
  return options;
}

TEST(GuardKey, TakesPlansThatTheCertifierSignedOnly) {
  Guard guard(WithKeys());
  const auto plan = Sealed(SmallPlan());
  EXPECT_EQ(guard.Accept(plan, kNow).cause, GuardCause::kUnsigned);
  Signer signer(TestKeys(), "the bus"), stranger(TestKeys("stranger"), "the bus"), elsewhere(TestKeys(), "another bus");
  const auto by = [&](Signer& who, Role role, const char* channel = "PLAN_CERTIFIED") {
    return who.Sign(role, channel, plan, kNow);
  };
  for (const Role role : kAllRoles)
    if (role != Role::kCertifier)
      EXPECT_EQ(guard.Accept(by(signer, role), kNow).cause, GuardCause::kForged) << RoleName(role);
  EXPECT_EQ(guard.Accept(by(stranger, Role::kCertifier), kNow).cause, GuardCause::kForged);
  EXPECT_EQ(guard.Accept(by(signer, Role::kCertifier, "PLAN_DECISION"), kNow).cause, GuardCause::kForged);
  EXPECT_EQ(guard.Accept(by(elsewhere, Role::kCertifier), kNow).cause, GuardCause::kForeign);
  EXPECT_EQ(guard.pending(), nullptr);
  const auto good = by(signer, Role::kCertifier);
  EXPECT_TRUE(guard.Accept(good, kNow).ok());
  EXPECT_EQ(guard.Accept(good, kNow).cause, GuardCause::kSignatureReplayed);
}

TEST(GuardKey, TheKeyFileOfTheRobotIsEnough) {
  const ScratchDirectory scratch;
  const std::string keys = MakeTestKeys(scratch / "keys");
  Guard guard(WithKeys(LoadKeys(keys + "/robot.key", Role::kRobot)));
  Signer certifier(LoadKeys(keys, Role::kCertifier), "the bus");
  EXPECT_TRUE(guard.Accept(certifier.Sign(Role::kCertifier, "PLAN_CERTIFIED", Sealed(SmallPlan()), kNow), kNow).ok());
}

TEST(GuardAccept, TheTransitionsAreUnderTheSeal) {
  certified_plan_t certified = SmallPlan();
  Seal(certified);
  SetDigest(certified.transitions_digest, DigestOf("another file"));
  Guard guard(TwoStates());
  EXPECT_EQ(guard.Accept(Encode(certified), kNow).cause, GuardCause::kCertificateDigest);
}

TEST(GuardAccept, ADigestOfZeroIsRefused) {
  const auto cause = [](auto zero) {
    certified_plan_t certified = SmallPlan();
    Seal(certified);
    zero(certified);
    Guard guard(TwoStates());
    return guard.Accept(Encode(certified), kNow);
  };
  const auto zeroed = [&](std::uint8_t(certified_plan_t::*digest)[32], const char* name, bool reseal) {
    const GuardVerdict verdict = cause([&](certified_plan_t& certified) {
      SetDigest(certified.*digest, {});
      if (reseal) SetDigest(certified.certificate_digest, CertificateDigest(certified));
    });
    EXPECT_EQ(verdict.cause, GuardCause::kZeroDigest) << name;
    EXPECT_EQ(verdict.message, std::string(name) + " is zero");
  };
  zeroed(&certified_plan_t::plan_digest, "plan_digest", true);
  zeroed(&certified_plan_t::config_digest, "config_digest", true);
  zeroed(&certified_plan_t::model_digest, "model_digest", true);
  zeroed(&certified_plan_t::declaration_digest, "declaration_digest", true);
  zeroed(&certified_plan_t::observations_digest, "observations_digest", true);
  zeroed(&certified_plan_t::obstacles_digest, "obstacles_digest", true);
  zeroed(&certified_plan_t::transitions_digest, "transitions_digest", true);
  zeroed(&certified_plan_t::certificate_digest, "certificate_digest", false);
}

// SmallPlan's slices 0..2 and its X_0 fit into it exactly; slice 3, the last, does not.
GuardDomain Around() { return {{-12, -5}, {12, 5}, {0}, {0}}; }

TEST(GuardDomainTest, APlanThatLeavesItIsRefusedWithTheWitness) {
  GuardOptions options = TwoStates();
  options.domain = Around();
  const auto judge = [&](auto alter) {
    certified_plan_t certified = SmallPlan();
    alter(certified);
    Guard guard(options);
    return guard.Accept(Sealed(certified), kNow);
  };
  EXPECT_TRUE(judge([](auto&) {}).ok()) << "what it reaches exactly is inside, and its last slice is not looked at";
  const auto refused = [&](auto alter, int step, int coordinate, double value, double bound) {
    const GuardVerdict verdict = judge(alter);
    EXPECT_EQ(verdict.cause, GuardCause::kOutsideDomain) << verdict.message;
    EXPECT_FIELDS(verdict, (step, step), (coordinate, coordinate), (value, value), (bound, bound));
  };
  refused([](auto& c) { c.slice_upper[2][0] = Above(12); }, 2, 0, Above(12), 12);
  refused([](auto& c) { c.slice_lower[2][0] = Below(-12); }, 2, 0, Below(-12), -12);
  refused([](auto& c) { c.slice_upper[0][1] = 1e9; }, 0, 1, 1e9, 5);
  refused([](auto& c) { c.plan.control[1][0] = Above(0); }, 1, 2, Above(0), 0);
  refused([](auto& c) { c.plan.control[0][0] = Below(0); }, 0, 2, Below(0), 0);
  refused([](auto& c) { c.plan.initial_half_width[0] = 11.5; }, 0, 0, 12.5, 12);
  EXPECT_TRUE(judge([](auto& c) { c.slice_upper[3][0] = 1e9; }).ok()) << "where the plan leads to is not in the domain";
  certified_plan_t wide = SmallPlan();
  for (int t = 0; t <= 3; ++t)
    for (int k = 0; k < 2; ++k) wide.slice_lower[t][k] = -1e9, wide.slice_upper[t][k] = 1e9;
  Guard guard(options);
  EXPECT_EQ(guard.Accept(Sealed(wide), kNow).cause, GuardCause::kOutsideDomain);
}

// center + half_width above 12 by less than a rounding error of the sum.
TEST(GuardDomainTest, TheInitialSetIsComparedExactly) {
  GuardOptions options = TwoStates();
  options.domain = Around();
  certified_plan_t certified = SmallPlan();
  certified.plan.initial_center[0] = 12;
  certified.plan.initial_half_width[0] = 0;
  EXPECT_TRUE(Guard(options).Accept(Sealed(certified), kNow).ok());
  certified.plan.initial_half_width[0] = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(Guard(options).Accept(Sealed(certified), kNow).cause, GuardCause::kOutsideDomain);
}

TEST(GuardDomainTest, TheDomainChangesWithATaskThatIsReadAgain) {
  GuardOptions options = TwoStates();
  options.domain = Around();
  Guard guard(options);
  GuardDomain wider = Around();
  wider.state_upper[0] = 100;
  guard.Expect(DigestOf("another config"), DigestOf("another model"), wider);
  certified_plan_t certified = SmallPlan(8);
  certified.slice_upper[1][0] = 100;
  EXPECT_EQ(guard.Accept(Sealed(certified), kNow).cause, GuardCause::kOutsideDomain) << "of the task before";
  SetDigest(certified.config_digest, DigestOf("another config"));
  SetDigest(certified.model_digest, DigestOf("another model"));
  EXPECT_TRUE(guard.Accept(Sealed(certified), kNow).ok());
  certified.plan.plan_id = 9;
  EXPECT_TRUE(guard.Accept(Sealed(certified), kNow).ok()) << "from then on";
  EXPECT_THROW(guard.Expect(DigestOf("c"), DigestOf("m"), GuardDomain{{1}, {0}, {}, {}}), std::invalid_argument);
}

// Coordinate 0 is an angle: X0 is 3 +- 0.5, slice t is [3, 3 + t / 8], which are across pi.
certified_plan_t TurningPlan(std::int64_t plan_id = 7) {
  certified_plan_t certified = SmallPlan(plan_id);
  certified.plan.initial_center[0] = 3;
  for (int t = 0; t <= 3; ++t) certified.slice_lower[t][0] = 2.5, certified.slice_upper[t][0] = 3.5 + t / 8.0;
  return certified;
}

GuardOptions WithAnAngle() {
  GuardOptions options = TwoStates();
  options.angles = {0};
  return options;
}

constexpr double kTurn = 2 * std::numbers::pi;

TEST(GuardAngle, AnAngleIsInsideAfterWholeTurns) {
  for (const double turns : {-2, -1, 0, 1, 3}) {
    for (const double heading : {2.6, 3.0, 3.4}) {
      Guard guard(WithAnAngle());
      EXPECT_TRUE(guard.Accept(Sealed(TurningPlan()), kNow).ok());
      const GuardVerdict verdict = guard.TryStart(kStart, kStart, State{heading + turns * kTurn, -2});
      EXPECT_TRUE(verdict.ok()) << verdict.message;
      // From one sample to the next it may be wrapped.
      EXPECT_TRUE(guard.Check(1, State{3.55, 0}, kNow).ok());
      EXPECT_TRUE(guard.Check(2, State{3.55 - kTurn, 0}, kNow).ok());
      EXPECT_EQ(guard.Check(3, State{3.9 - kTurn, 0}, kNow).cause, GuardCause::kOutsideSlice);
      EXPECT_TRUE(guard.halted());
    }
    for (const double heading : {2.4, 3.6}) {
      Guard guard(WithAnAngle());
      EXPECT_TRUE(guard.Accept(Sealed(TurningPlan()), kNow).ok());
      EXPECT_EQ(guard.TryStart(kStart, kStart, State{heading + turns * kTurn, -2}).cause,
                GuardCause::kOutsideInitialSet);
    }
  }
}

TEST(GuardAngle, NoOtherStateIsTurned) {
  Guard guard(WithAnAngle());
  EXPECT_TRUE(guard.Accept(Sealed(TurningPlan()), kNow).ok());
  EXPECT_EQ(guard.TryStart(kStart, kStart, State{3, -2 + kTurn}).cause, GuardCause::kOutsideInitialSet);
  Guard plain(TwoStates());
  EXPECT_TRUE(plain.Accept(Sealed(TurningPlan()), kNow).ok());
  EXPECT_EQ(plain.TryStart(kStart, kStart, State{3 - kTurn, -2}).cause, GuardCause::kOutsideInitialSet);
}

// A state counts as inside only if it certainly is, and without a turn the bounds themselves are.
TEST(GuardAngle, AnAngleAtItsBoundIsRefusedWhereTurnsAreRounded) {
  const auto start = [](double heading) {
    Guard guard(WithAnAngle());
    EXPECT_TRUE(guard.Accept(Sealed(TurningPlan()), kNow).ok());
    return guard.TryStart(kStart, kStart, State{heading, -2}).ok();
  };
  EXPECT_TRUE(start(2.5));
  EXPECT_TRUE(start(3.5));
  EXPECT_FALSE(start(Below(2.5)));
  EXPECT_FALSE(start(Above(3.5)));
  for (const double edge : {2.5, 3.5})
    for (const double turns : {-1, 1, 2}) {
      const double inward = edge == 2.5 ? 1 : -1;
      EXPECT_TRUE(start(edge + turns * kTurn + inward * 1e-14));
      EXPECT_FALSE(start(edge + turns * kTurn)) << "it cannot be told";
      EXPECT_FALSE(start(edge + turns * kTurn - inward * 1e-14));
    }
}

TEST(GuardAngle, TheAnglesChangeWithATaskThatIsReadAgain) {
  Guard guard(TwoStates());
  guard.Expect(DigestOf("second"), DigestOf("model"), {}, std::vector{0});
  guard.Expect(DigestOf("third"), DigestOf("model"));
  guard.Expect(DigestOf("fourth"), DigestOf("model"), {}, std::vector<int>{});
  EXPECT_THROW(guard.Expect(DigestOf("fifth"), DigestOf("model"), {}, std::vector{2}), std::invalid_argument);
  std::int64_t plan_id = 7;
  const auto starts = [&](const char* config) {
    certified_plan_t certified = TurningPlan(plan_id++);
    SetDigest(certified.config_digest, DigestOf(config));
    EXPECT_TRUE(guard.Accept(Sealed(certified), kNow).ok());
    return guard.TryStart(kStart, kStart, State{3 - kTurn, -2}).ok();
  };
  EXPECT_FALSE(starts("config"));
  EXPECT_TRUE(starts("second"));
  certified_plan_t next = TurningPlan(plan_id++);
  SetDigest(next.config_digest, DigestOf("third"));
  EXPECT_TRUE(guard.Accept(Sealed(next), kNow).ok());
  EXPECT_TRUE(guard.TryStart(kStart, kStart, State{3 - kTurn, -2}).ok()) << "nothing said: as before";
  next.plan.plan_id = plan_id++;
  SetDigest(next.config_digest, DigestOf("fourth"));
  EXPECT_TRUE(guard.Accept(Sealed(next), kNow).ok());
  EXPECT_TRUE(guard.Check(1, State{3 - kTurn, 0}, kNow).ok()) << "the plan that executes was certified with the angle";
  EXPECT_FALSE(guard.TryStart(kStart, kStart, State{3 - kTurn, -2}).ok());
}

TEST(GuardHalt, ForgetsThePendingAndTheExecutingPlan) {
  Guard guard = Executing();
  ASSERT_TRUE(guard.Accept(Sealed(SmallPlan(8)), kNow).ok());
  guard.Halt();
  EXPECT_FIELDS(guard, (executing(), nullptr), (pending(), nullptr));
}

TEST(GuardOptionsTest, ImpossibleOptionsThrow) {
  EXPECT_THROW(Guard({0, 1, kStep, {}, {}}), std::invalid_argument);
  EXPECT_THROW(Guard({17, 1, kStep, {}, {}}), std::invalid_argument);
  EXPECT_THROW(Guard({1, 0, kStep, {}, {}}), std::invalid_argument);
  EXPECT_THROW(Guard({1, 9, kStep, {}, {}}), std::invalid_argument);
  EXPECT_THROW(Guard({1, 1, 0, {}, {}}), std::invalid_argument);
  EXPECT_NO_THROW(Guard({16, 8, 1, {}, {}}));
  GuardOptions nameless = WithKeys();
  nameless.bus_name.clear();
  EXPECT_THROW(Guard{nameless}, std::invalid_argument);
  for (const GuardDomain& bad :
       {GuardDomain{{0}, {1}, {0}, {1}}, GuardDomain{{0, 0}, {1, -1}, {0}, {1}},
        GuardDomain{{0, kNaN}, {1, 1}, {0}, {1}}, GuardDomain{{0, 0}, {1, 1}, {0, 0}, {1, 1}}}) {
    GuardOptions options = TwoStates();
    options.domain = bad;
    EXPECT_THROW(Guard{options}, std::invalid_argument);
  }
  for (const int bad : {-1, 2}) {
    GuardOptions options = TwoStates();
    options.angles = {bad};
    EXPECT_THROW(Guard{options}, std::invalid_argument);
  }
}

}  // namespace forereach::guard_test
