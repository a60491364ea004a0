#include "certifier/gate/charge.h"

#include "tests/test.h"

namespace forereach::charge_test {

using State = Charge::State;

constexpr Charge::Identity kSelf{100, 5}, kEarlier{99, 9}, kLater{101, 1}, kSameTimeSmaller{100, 4},
    kSameTimeLarger{100, 6};

// Runs for so long, in steps of a process that is not paused.
void Pass(Charge& charge, std::int64_t& now, std::int64_t us) {
  for (const std::int64_t end = now + us; now < end; now += 2000) charge.Advance(now);
}

Charge InState(State state, std::int64_t& now) {
  Charge charge(kSelf, Charge::kListenUs);
  Pass(charge, now, 2000);
  if (state == State::kInCharge) Pass(charge, now, Charge::kListenUs + 2000);
  if (state == State::kStandingBy) charge.Hear(kLater, State::kInCharge);
  EXPECT_EQ(charge.state(), state);
  return charge;
}

// In each state: each heartbeat that can be heard, and what follows from it.
TEST(ChargeTest, EveryHeartbeatInEveryStateHasTheSpecifiedEffect) {
  const std::vector<std::pair<Charge::Identity, bool>> others{
      {kEarlier, true}, {kLater, false}, {kSameTimeSmaller, true}, {kSameTimeLarger, false}};
  for (const State state : {State::kListening, State::kInCharge, State::kStandingBy}) {
    for (const auto& [other, is_earlier] : others) {
      for (const State its : {State::kListening, State::kInCharge, State::kStandingBy}) {
        std::int64_t now = 0;
        Charge charge = InState(state, now);
        charge.Hear(other, its);
        const bool yields = state == State::kListening
                                ? its == State::kInCharge || (its == State::kListening && is_earlier)
                            : state == State::kInCharge ? its == State::kInCharge && is_earlier
                                                        : true;
        EXPECT_EQ(charge.state(), yields ? State::kStandingBy : state)
            << static_cast<int>(state) << " hears " << static_cast<int>(its) << " of " << other.instance;
        EXPECT_EQ(charge.other(), other);
      }
    }
  }
}

TEST(ChargeTest, AShadowHoldsUpNoneThatCertifiesAndGivesWayToEach) {
  for (const State state : {State::kListening, State::kInCharge, State::kStandingBy})
    for (const State its : {State::kListening, State::kInCharge, State::kStandingBy})
      for (const Charge::Identity& other : {kEarlier, kLater}) {
        std::int64_t now = 0;
        Charge certifies = InState(state, now);
        certifies.Hear({other.started_utime, other.instance, true}, its);
        EXPECT_EQ(certifies.state(), state);
        Charge shadow = InState(state, now);
        shadow.Follow(true);
        shadow.Hear(other, its);
        const bool yields = its != State::kStandingBy || state == State::kStandingBy;
        EXPECT_EQ(shadow.state(), yields ? State::kStandingBy : state);
      }
  std::int64_t now = 0;
  Charge waits = InState(State::kStandingBy, now);
  for (int i = 0; i < 3; ++i) {
    waits.Hear({99, 9, true}, State::kInCharge);
    Pass(waits, now, Charge::kSilenceUs / 2);
  }
  EXPECT_EQ(waits.state(), State::kInCharge) << "a shadow in charge is no one in charge";
}

TEST(ChargeTest, IgnoresItsOwnHeartbeats) {
  for (const State state : {State::kListening, State::kInCharge, State::kStandingBy}) {
    std::int64_t now = 0;
    Charge charge = InState(state, now);
    const auto other = charge.other();
    for (const State its : {State::kListening, State::kInCharge, State::kStandingBy}) charge.Hear(kSelf, its);
    EXPECT_FIELDS(charge, (state(), state), (other(), other));
  }
}

TEST(ChargeTest, TakesChargeOnceItHasListenedLongEnough) {
  std::int64_t now = 0;
  Charge charge(kSelf, Charge::kListenUs);
  Pass(charge, now, Charge::kListenUs);
  EXPECT_EQ(charge.state(), State::kListening);
  Pass(charge, now, 2000);
  EXPECT_EQ(charge.state(), State::kInCharge);
}

TEST(ChargeTest, APauseDoesNotCountAsListening) {
  Charge charge(kSelf, Charge::kListenUs);
  charge.Advance(0);
  charge.Advance(Charge::kListenUs * 100);
  EXPECT_EQ(charge.state(), State::kListening);
  std::int64_t now = 0;
  Charge second = InState(State::kStandingBy, now);
  second.Advance(now + Charge::kSilenceUs * 100);
  EXPECT_EQ(second.state(), State::kStandingBy) << "nor heard that the other is silent";
}

TEST(ChargeTest, OneWithoutOthersIsInChargeAtOnceAndStays) {
  Charge charge(kSelf, 0);
  EXPECT_EQ(charge.state(), State::kInCharge);
  charge.Advance(0);
  charge.Advance(3'600'000'000);
  EXPECT_EQ(charge.state(), State::kInCharge);
  charge.Advance(0);
  EXPECT_EQ(charge.state(), State::kInCharge) << "a clock may go back";
}

TEST(ChargeTest, TheSecondTakesOverAfterTheSilenceItIsToldAndListensBefore) {
  std::int64_t now = 0;
  Charge charge = InState(State::kStandingBy, now);
  for (int i = 0; i < 10; ++i) {
    Pass(charge, now, 500'000);
    charge.Hear(kEarlier, State::kInCharge);
    EXPECT_EQ(charge.state(), State::kStandingBy);
  }
  Pass(charge, now, 500'000);
  charge.Hear({7, 7}, State::kStandingBy);  // a third that waits too is nobody to wait for
  Pass(charge, now, Charge::kSilenceUs - 510'000);
  EXPECT_EQ(charge.state(), State::kStandingBy);
  Pass(charge, now, 20'000);
  EXPECT_EQ(charge.state(), State::kListening);
  Pass(charge, now, Charge::kListenUs + 2000);
  EXPECT_EQ(charge.state(), State::kInCharge);
  Pass(charge, now, Charge::kSilenceUs);
  EXPECT_FALSE(charge.other()) << "the third has fallen silent too";
}

TEST(ChargeTest, OneInChargeThatWasPausedListensAnewBeforeItDecides) {
  for (const std::int64_t pause : {Charge::kLapseUs, Charge::kLapseUs + 1}) {
    std::int64_t now = 0;
    Charge charge = InState(State::kInCharge, now);
    charge.Advance(now);
    charge.Advance(now + pause);
    EXPECT_EQ(charge.state(), pause > Charge::kLapseUs ? State::kListening : State::kInCharge) << pause;
  }
}

// Three certifiers on a bus that loses heartbeats; they are paused, killed and started again at random. Whenever
// nothing has happened for a while exactly one is in charge, and two at once only where heartbeats were lost.
TEST(ChargeTest, ExactlyOneIsInChargeAfterAnyLossPauseOrRestart) {
  for (const double loss : {0.0, 0.2}) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed) + ", loss " + std::to_string(loss));
    std::mt19937 random(seed);
    const auto below = [&](std::int64_t bound) {
      return static_cast<std::int64_t>(random() % static_cast<unsigned>(bound));
    };
    struct Certifier {
      Charge charge;
      std::int64_t paused_until = 0, next_beat = 0;
      State last = State::kListening;
    };
    std::int64_t now = 1'000'000, instances = 1;
    const auto start = [&] {
      return Certifier{Charge({now, instances++}, Charge::kListenUs), 0, 0, State::kListening};
    };
    std::vector<Certifier> all{start(), start(), start()};
    std::int64_t together = 0;
    for (int round = 0; round < 60; ++round) {
      Certifier& victim = all[static_cast<std::size_t>(below(3))];
      if (below(2) == 0)
        victim = start();
      else
        victim.paused_until = now + below(5'000'000);
      std::int64_t settled = 0;
      for (const std::int64_t end = now + 9'000'000; now < end; now += 2000) {
        for (Certifier& one : all) {
          if (now < one.paused_until) continue;
          one.charge.Advance(now);
          const bool changed = one.charge.state() != one.last;
          one.last = one.charge.state();
          if (now < one.next_beat && !changed) continue;
          one.next_beat = now + (one.last == State::kListening ? 100'000 : 500'000);
          for (Certifier& other : all) {
            if (now < other.paused_until || std::uniform_real_distribution<double>(0, 1)(random) < loss) continue;
            const State before = other.charge.state();
            other.charge.Hear(one.charge.self(), one.last);
            if (other.charge.state() == State::kInCharge) other.next_beat = std::min(other.next_beat, now + 100'000);
            if (other.charge.state() != before) other.next_beat = now;
          }
        }
        int in_charge = 0;
        for (const Certifier& one : all) in_charge += now >= one.paused_until && one.charge.state() == State::kInCharge;
        if (in_charge > 1) together += 2000;
        settled = in_charge == 1 ? settled + 2000 : 0;
      }
      EXPECT_GT(settled, loss == 0 ? 500'000 : 0) << "round " << round;
    }
    if (loss == 0) EXPECT_EQ(together, 0) << "microseconds with two in charge";
  }
}

}  // namespace forereach::charge_test
