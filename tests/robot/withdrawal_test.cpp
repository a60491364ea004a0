// Withdrawals at the guard and the supervisor: no withdrawn control is ever applied, and each message is answered.
#include "tests/test.h"

#include "forereach/robot_state_t.hpp"
#include "robot/brake.h"
#include "robot/supervisor.h"
#include "tests/keys.h"
#include "tests/robot/sealed_plan.h"

namespace forereach::withdrawal_test {

using State = std::array<double, 2>;

constexpr std::int64_t kStart = kPlanStart, kStep = kPlanStepUs, kNow = kStart - 3 * kStep;
constexpr State kInSlice{1, -2};
constexpr double kFarthest = 11;  // of the first state in slice 1 of SmallPlan

// Of a plan of SmallPlan's kind.
withdrawal_t Withdrawal(const certified_plan_t& plan, int valid_steps, std::int16_t cause = withdrawal_t::OBSTACLE) {
  certified_plan_t sealed = plan;
  Seal(sealed);
  withdrawal_t message{.utime = kNow,
                       .plan_id = plan.plan.plan_id,
                       .expires_utime = plan.expires_utime,
                       .cause = cause,
                       .valid_steps = static_cast<std::int16_t>(valid_steps)};
  SetGrounds(message, GroundsOf(plan));
  if (cause == withdrawal_t::UNKNOWN_PLAN)
    SetDigest(message.observations_digest, GetDigest(plan.transitions_digest));
  else
    SetDigest(message.certificate_digest, GetDigest(sealed.certificate_digest));
  return message;
}

struct GuardWithdrawTest : testing::Test {
  void Accept(std::int64_t plan_id = 7) { EXPECT_TRUE(guard_.Accept(Sealed(SmallPlan(plan_id)), kNow).ok()); }
  void Start(std::int64_t plan_id = 7) {
    Accept(plan_id);
    EXPECT_TRUE(guard_.TryStart(kStart, kStart, kInSlice).ok());
  }
  int Withdraw(int valid_steps, std::int64_t plan_id = 7) {
    const GuardWithdrawal answer = guard_.Withdraw(Encode(Withdrawal(SmallPlan(plan_id), valid_steps)), kNow);
    EXPECT_TRUE(answer.verdict.ok()) << answer.verdict.message;
    return answer.standing_steps;
  }

  Guard guard_{TwoStates()};
};

TEST_F(GuardWithdrawTest, TheFirstWithdrawnControlIsNotGivenAndTheOneBeforeIs) {
  Start();
  EXPECT_EQ(guard_.standing_steps(), std::nullopt);
  EXPECT_EQ(Withdraw(1), 1);
  EXPECT_EQ(guard_.standing_steps(), 1);
  EXPECT_EQ(guard_.control().size(), 1u) << "control 0 stands";
  EXPECT_TRUE(guard_.Check(1, kInSlice, kStart + kStep).ok()) << "it was applied";
  EXPECT_TRUE(guard_.control().empty());
  EXPECT_EQ(guard_.Check(2, kInSlice, kStart + 2 * kStep).cause, GuardCause::kWithdrawn)
      << "somebody has applied control 1";
  EXPECT_EQ(guard_.executing(), nullptr);
}

TEST_F(GuardWithdrawTest, WithoutAWithdrawalEachControlIsGiven) {
  Start();
  for (int t = 0; t < 3; ++t) {
    EXPECT_EQ(guard_.control().size(), 1u);
    EXPECT_TRUE(guard_.Check(t + 1, kInSlice, kStart + (t + 1) * kStep).ok());
  }
  EXPECT_TRUE(guard_.control().empty());
}

TEST_F(GuardWithdrawTest, ALaterWithdrawalNeverRestoresSteps) {
  Start();
  EXPECT_EQ(Withdraw(2), 2);
  EXPECT_EQ(Withdraw(3), 2);
  EXPECT_EQ(Withdraw(1), 1);
  EXPECT_EQ(Withdraw(2), 1);
  EXPECT_EQ(Withdraw(-32768), 0);
  EXPECT_TRUE(guard_.control().empty());
}

TEST_F(GuardWithdrawTest, AWithdrawalOfMoreStepsThanThePlanHasLeavesAllOfThem) {
  Start();
  EXPECT_EQ(Withdraw(32767), 3);
  EXPECT_EQ(guard_.standing_steps(), 3);
}

TEST_F(GuardWithdrawTest, APendingPlanIsDroppedHoweverManyStepsStand) {
  for (const int valid : {0, 2, 3}) {
    Accept(7 + valid);
    EXPECT_EQ(Withdraw(valid, 7 + valid), 0);
    EXPECT_EQ(guard_.pending(), nullptr);
  }
}

TEST_F(GuardWithdrawTest, AWithdrawalLeavesOtherPlansAlone) {
  Start(7);
  certified_plan_t next = SmallPlan(8);
  next.plan.start_utime += 2 * kStep;
  EXPECT_TRUE(guard_.Accept(Sealed(next), kNow).ok());
  EXPECT_EQ(Withdraw(0, 6), 0);
  EXPECT_EQ(guard_.standing_steps(), std::nullopt);
  EXPECT_NE(guard_.pending(), nullptr);
  certified_plan_t namesake = SmallPlan(7);  // of another source
  namesake.plan.control[0][0] = 1;
  EXPECT_TRUE(guard_.Withdraw(Encode(Withdrawal(namesake, 0)), kNow).verdict.ok());
  EXPECT_EQ(guard_.standing_steps(), std::nullopt);
}

TEST_F(GuardWithdrawTest, AWithdrawalThatOvertakesItsPlanKeepsItOut) {
  EXPECT_EQ(Withdraw(2), 0);
  EXPECT_EQ(guard_.Accept(Sealed(SmallPlan(7)), kNow).cause, GuardCause::kReplayed);
  EXPECT_EQ(guard_.Accept(Sealed(SmallPlan(6)), kNow).cause, GuardCause::kReplayed) << "ids count upwards";
  Accept(8);
}

TEST_F(GuardWithdrawTest, AWithdrawalWhileHaltedKeepsItsPlanOut) {
  guard_.Halt();
  EXPECT_EQ(Withdraw(2), 0);
  guard_.Reset();
  EXPECT_EQ(guard_.Accept(Sealed(SmallPlan(7)), kNow).cause, GuardCause::kReplayed);
}

TEST_F(GuardWithdrawTest, ThePlanAfterAWithdrawnOneHasAllItsSteps) {
  Start(7);
  EXPECT_EQ(Withdraw(1), 1);
  Start(8);
  EXPECT_FIELDS(guard_, (standing_steps(), std::nullopt), (control().size(), 1u));
}

TEST_F(GuardWithdrawTest, AnUnknownPlanStandsOnlyUnderTheGroundsOfItsCertificate) {
  Start();
  withdrawal_t unknown = Withdrawal(SmallPlan(), 0, withdrawal_t::UNKNOWN_PLAN);
  EXPECT_EQ(guard_.Withdraw(Encode(unknown), kNow).standing_steps, 3);
  EXPECT_EQ(guard_.standing_steps(), std::nullopt);
  const auto standing_after = [&](std::uint8_t(withdrawal_t::*digest)[32]) {
    Guard guard(TwoStates());
    EXPECT_TRUE(guard.Accept(Sealed(SmallPlan()), kNow).ok() && guard.TryStart(kStart, kStart, kInSlice).ok());
    withdrawal_t changed = unknown;
    SetDigest(changed.*digest, DigestOf("another"));
    return guard.Withdraw(Encode(changed), kNow).standing_steps;
  };
  EXPECT_EQ(standing_after(&withdrawal_t::config_digest), 0);
  EXPECT_EQ(standing_after(&withdrawal_t::model_digest), 0);
  EXPECT_EQ(standing_after(&withdrawal_t::declaration_digest), 0);
  EXPECT_EQ(standing_after(&withdrawal_t::observations_digest), 0) << "other ones may have been taken back";
  EXPECT_EQ(standing_after(&withdrawal_t::obstacles_digest), 0);
  unknown.cause = withdrawal_t::FALSIFIED;
  EXPECT_EQ(guard_.Withdraw(Encode(unknown), kNow).standing_steps, 0) << "only an unknown plan may stand";
}

// Of the observations of its certificate the guard asks which file they began with, and nothing else.
TEST_F(GuardWithdrawTest, AnUnknownPlanStandsWhateverWasLearnedAfterTheFile) {
  const auto standing_steps = [](const Digest& observations, const Digest& named) {
    certified_plan_t plan = SmallPlan();
    SetDigest(plan.observations_digest, observations);
    Guard guard(TwoStates());
    EXPECT_TRUE(guard.Accept(Sealed(plan), kNow).ok() && guard.TryStart(kStart, kStart, kInSlice).ok());
    withdrawal_t unknown = Withdrawal(plan, 0, withdrawal_t::UNKNOWN_PLAN);
    SetDigest(unknown.observations_digest, named);
    return guard.Withdraw(Encode(unknown), kNow).standing_steps;
  };
  const Digest file = DigestOf("transitions");  // of SmallPlan
  const std::vector<std::uint8_t> row{1, 2, 3};
  const Digest learned = ChainedDigest(file, row);
  EXPECT_EQ(standing_steps(file, file), 3);
  EXPECT_EQ(standing_steps(learned, file), 3);
  EXPECT_EQ(standing_steps(learned, DigestOf("another file")), 0);
  EXPECT_EQ(standing_steps(ChainedDigest(DigestOf("another file"), row), DigestOf("another file")), 0)
      << "its observations are those of the other file, what it was certified under says that it is not";
  EXPECT_EQ(standing_steps(learned, learned), 0) << "as a certifier names that has learned a contradiction";
  EXPECT_EQ(standing_steps(file, ChainedDigest(file, row)), 0);
  EXPECT_EQ(standing_steps(file, Digest{}), 0) << "as one names that knows of a contradiction and has not learned it";
}

TEST_F(GuardWithdrawTest, AWithdrawalByACertifierOfAnotherTaskLeavesNoStep) {
  Start();
  withdrawal_t unknown = Withdrawal(SmallPlan(), 0, withdrawal_t::UNKNOWN_PLAN);
  EXPECT_EQ(guard_.Withdraw(Encode(unknown), kNow).standing_steps, 3);
  withdrawal_t of_another = unknown;
  SetDigest(of_another.config_digest, DigestOf("another task"));
  EXPECT_EQ(guard_.Withdraw(Encode(of_another), kNow).standing_steps, 0);
  EXPECT_EQ(guard_.Withdraw(Encode(unknown), kNow).standing_steps, 0) << "the first task's is back";
  EXPECT_TRUE(guard_.control().empty());
}

TEST_F(GuardWithdrawTest, BytesThatAreNoWithdrawalChangeNothing) {
  Start();
  std::vector<std::uint8_t> bytes = Encode(Withdrawal(SmallPlan(), 0));
  bytes.push_back(0);
  EXPECT_EQ(guard_.Withdraw(bytes, kNow).verdict.cause, GuardCause::kTrailingBytes);
  bytes.resize(bytes.size() - 2);
  EXPECT_EQ(guard_.Withdraw(bytes, kNow).verdict.cause, GuardCause::kWrongLength);
  bytes[0] ^= 1;
  EXPECT_EQ(guard_.Withdraw(bytes, kNow).verdict.cause, GuardCause::kUnknownFingerprint);
  EXPECT_EQ(guard_.standing_steps(), std::nullopt);
}

TEST(GuardWithdrawKeys, OnlyTheCertifierWithdraws) {
  GuardOptions options = TwoStates();
  options.keys = TestKeys();
  options.bus_name = "the bus";
  Guard guard(options);
  Signer signer(TestKeys(), "the bus"), stranger(TestKeys("stranger"), "the bus"), elsewhere(TestKeys(), "another bus");
  ASSERT_TRUE(guard.Accept(signer.Sign(Role::kCertifier, "PLAN_CERTIFIED", Sealed(SmallPlan()), kNow), kNow).ok());
  const auto message = Encode(Withdrawal(SmallPlan(), 0));
  const auto cause = [&](Signer& who, Role role, const char* channel = "PLAN_WITHDRAWN") {
    return guard.Withdraw(who.Sign(role, channel, message, kNow), kNow).verdict.cause;
  };
  EXPECT_EQ(guard.Withdraw(message, kNow).verdict.cause, GuardCause::kUnsigned);
  for (const Role role : kAllRoles)
    if (role != Role::kCertifier) EXPECT_EQ(cause(signer, role), GuardCause::kForged) << RoleName(role);
  EXPECT_EQ(cause(stranger, Role::kCertifier), GuardCause::kForged);
  EXPECT_EQ(cause(signer, Role::kCertifier, "PLAN_CERTIFIED"), GuardCause::kForged);
  EXPECT_EQ(cause(elsewhere, Role::kCertifier), GuardCause::kForeign);
  ASSERT_NE(guard.pending(), nullptr) << "none of these counted";
  const auto good = signer.Sign(Role::kCertifier, "PLAN_WITHDRAWN", message, kNow);
  EXPECT_TRUE(guard.Withdraw(good, kNow).verdict.ok());
  EXPECT_EQ(guard.pending(), nullptr);
  EXPECT_EQ(guard.Withdraw(good, kNow).verdict.cause, GuardCause::kSignatureReplayed);
}

// A robot whose state is always inside. Boundary j lies at kStart + j * kStep.
struct SupervisorWithdrawTest : testing::Test, protected Supervisor::Robot {
  std::span<const double> state() const override { return kInSlice; }
  void Hold() override { ++holds_; }
  void Reload() override {}
  void Send(const std::string& channel, Bytes message) override {
    if (channel == "EXECUTION_EVENT") events_.push_back(*Decoded<execution_event_t>(message));
    if (channel == "ROBOT_STATE") last_state_ = *Decoded<robot_state_t>(message);
  }

  int StepsToRest(std::span<const double> lower, std::span<const double> upper) const override {
    return brake_ ? brake_->StepsToRest(lower, upper) : Supervisor::Robot::StepsToRest(lower, upper);
  }

  // The first state falls by `decline` in each step; it is at most 10 in each slice.
  void Make(double decline = std::numeric_limits<double>::infinity()) {
    brake_.emplace(std::vector<double>{decline, 0});
    Remake();
  }
  void Remake() {
    SupervisorOptions options;
    options.guard = TwoStates();
    Supervisor::Robot& robot = *this;
    supervisor_.emplace(options, robot);
  }
  static std::int64_t At(int boundary) { return kStart + boundary * kStep; }
  static certified_plan_t PlanFrom(int boundary, std::int64_t plan_id) {
    certified_plan_t plan = SmallPlan(plan_id);
    plan.plan.start_utime = At(boundary);
    plan.expires_utime = At(boundary + 1);
    return plan;
  }
  void Accept(const certified_plan_t& plan) { supervisor_->OnCertified(Sealed(plan), kNow); }
  void Withdraw(const certified_plan_t& plan, int valid_steps, std::int64_t sequence = 4) {
    withdrawal_t message = Withdrawal(plan, valid_steps);
    message.sequence = sequence;
    SetText(message.message, "a wall");
    supervisor_->OnWithdrawn(Encode(message), kNow);
  }
  // Whether a control is applied.
  bool Boundary(int j) { return !supervisor_->Boundary(At(j), At(j)).empty(); }
  std::vector<std::int16_t> Events() const {
    std::vector<std::int16_t> kinds;
    for (const execution_event_t& event : events_) kinds.push_back(event.kind);
    return kinds;
  }

  std::optional<Brake> brake_;  // nothing: it is not known
  int holds_ = 0;
  std::vector<execution_event_t> events_;
  robot_state_t last_state_{};
  std::optional<Supervisor> supervisor_;
};

TEST_F(SupervisorWithdrawTest, GoesOnWithinWhatStandsThenStopsWithoutACertificate) {
  Make();
  Accept(PlanFrom(0, 7));
  EXPECT_TRUE(Boundary(0));
  Withdraw(PlanFrom(0, 7), 2);
  EXPECT_EQ(holds_, 0) << "control 0 stands, and control 1";
  EXPECT_TRUE(Boundary(1));
  EXPECT_FALSE(Boundary(2));
  EXPECT_EQ(holds_, 1);
  EXPECT_THAT(Events(), ElementsAre(kAccepted, kStarted, kWithdrawn, kInside, kTailBegun, kInside, kStop));
  EXPECT_FIELDS(events_[2], (plan_id, 7), (step, 2));
  EXPECT_EQ(events_[2].value, 4) << "the withdrawal's sequence";
  EXPECT_EQ(GetText(events_[2].message), "a wall");
  EXPECT_EQ(events_[6].step, 2);
  EXPECT_THAT(GetText(events_[6].message), HasSubstr("not certified"));
  EXPECT_EQ(last_state_.mode, robot_state_t::STANDING);
  EXPECT_EQ(supervisor_->counts().emergency_stops, 1);
  EXPECT_FALSE(supervisor_->halted()) << "no assumption was false";
  Accept(PlanFrom(4, 8));
  EXPECT_TRUE(Boundary(4));
}

TEST_F(SupervisorWithdrawTest, AControlThatIsBeingAppliedIsStoppedAtOnce) {
  for (const int valid : {1, 0}) {
    Make();
    const int holds_before = holds_;
    Accept(PlanFrom(0, 7));
    EXPECT_TRUE(Boundary(0));
    Withdraw(PlanFrom(0, 7), valid);
    EXPECT_EQ(holds_ - holds_before, valid == 0) << valid;
    EXPECT_EQ(supervisor_->control().empty(), valid == 0);
    EXPECT_FALSE(Boundary(1));
    EXPECT_EQ(holds_ - holds_before, 1);
  }
}

TEST_F(SupervisorWithdrawTest, EachWithdrawalIsAnswered) {
  Make();
  Accept(PlanFrom(0, 7));
  Withdraw(PlanFrom(0, 7), 2, 11);
  Withdraw(PlanFrom(0, 7), 2, 12);
  Withdraw(PlanFrom(0, 99), 1, 13);
  EXPECT_THAT(Events(), ElementsAre(kAccepted, kWithdrawn, kWithdrawn, kWithdrawn));
  EXPECT_EQ(events_[2].value, 12);
  EXPECT_EQ(events_[2].step, 0) << "it had not begun, so it is dropped";
  EXPECT_EQ(events_[3].plan_id, 99);
  EXPECT_FALSE(Boundary(0));
  EXPECT_EQ(holds_, 0);
}

TEST_F(SupervisorWithdrawTest, ANewerPlanTakesOverAtTheLastBoundaryThatStands) {
  Make();
  Accept(PlanFrom(0, 7));
  Boundary(0);
  Withdraw(PlanFrom(0, 7), 2);
  Accept(PlanFrom(2, 8));
  for (int j = 1; j <= 4; ++j) EXPECT_TRUE(Boundary(j)) << j;
  EXPECT_EQ(last_state_.executing_plan_id, 8);
  EXPECT_EQ(supervisor_->counts().emergency_stops, 0);
}

TEST_F(SupervisorWithdrawTest, ANewerPlanThatStartsLaterComesTooLate) {
  Make();
  Accept(PlanFrom(0, 7));
  Boundary(0);
  Withdraw(PlanFrom(0, 7), 2);
  Accept(PlanFrom(3, 8));
  EXPECT_TRUE(Boundary(1));
  EXPECT_FALSE(Boundary(2));
  EXPECT_EQ(supervisor_->counts().emergency_stops, 1);
}

// The guard will not start a plan that is further from every boundary than the jitter, so nothing is to be hoped of it.
TEST_F(SupervisorWithdrawTest, APlanThatStartsBetweenTheBoundariesDoesNotTakeOver) {
  constexpr std::int64_t kJitter = 3000;
  for (const std::int64_t off : {-kJitter - 1, -kJitter, kJitter, kJitter + 1}) {
    brake_.emplace(std::vector<double>{kFarthest, 0});
    SupervisorOptions options;
    options.guard = TwoStates();
    Supervisor::Robot& robot = *this;
    supervisor_.emplace(options, robot);
    holds_ = 0;
    Accept(PlanFrom(0, 7));
    EXPECT_TRUE(Boundary(0));
    certified_plan_t next = PlanFrom(2, 8);
    next.plan.start_utime += off;
    next.step_error_us = kJitter;
    Accept(next);
    Withdraw(PlanFrom(0, 7), 2);
    EXPECT_EQ(Boundary(1), std::abs(off) == kJitter) << off << ": else the stop begins while it fits";
    EXPECT_EQ(Boundary(2), std::abs(off) == kJitter) << off;
  }
}

// A brake of last resort that takes a step begins a step earlier, unless a plan takes over in time.
TEST_F(SupervisorWithdrawTest, ABrakeThatTakesTimeBeginsBeforeTheEnd) {
  for (const int start_of_next : {2, 3}) {
    Make(kFarthest);
    Accept(PlanFrom(0, 7));
    EXPECT_TRUE(Boundary(0));
    Withdraw(PlanFrom(0, 7), 2);
    Accept(PlanFrom(start_of_next, 8));
    EXPECT_EQ(Boundary(1), start_of_next == 2);
    EXPECT_EQ(Boundary(2), start_of_next == 2);
    EXPECT_EQ(supervisor_->counts().emergency_stops, start_of_next != 2);
  }
}

TEST_F(SupervisorWithdrawTest, StopsWhereTheStepsThatStandDoNotEndAtRest) {
  Make();
  Accept(PlanFrom(0, 7));
  Boundary(0);
  Withdraw(PlanFrom(0, 7), 3);
  EXPECT_TRUE(Boundary(1));
  EXPECT_TRUE(Boundary(2));
  EXPECT_FALSE(Boundary(3));
  EXPECT_EQ(events_.back().kind, kStop);
}

// What counts is where the next slice allows the state to be, not the state.
TEST_F(SupervisorWithdrawTest, AStopThatJustFitsMayWaitForABoundaryAndOneThatDoesNotMayNot) {
  for (const bool fits : {true, false}) {
    Make(fits ? kFarthest : std::nextafter(kFarthest, 0));  // a step, or two
    Accept(PlanFrom(0, 7));
    EXPECT_TRUE(Boundary(0));
    events_.clear();
    Withdraw(PlanFrom(0, 7), 2);
    EXPECT_EQ(holds_, fits ? 0 : 1) << "two steps have to begin before the next boundary";
    EXPECT_FALSE(Boundary(1));
    const std::vector<std::int16_t> waits{kWithdrawn, kInside, kStop}, stops{kWithdrawn, kStop};
    ASSERT_EQ(Events(), fits ? waits : stops);
    EXPECT_EQ(events_.back().step, fits ? 1 : 0);
    EXPECT_EQ(events_.back().value, 1) << "from the state that it has";
    EXPECT_THAT(GetText(events_.back().message), HasSubstr(fits ? "; 1 stand, the stop takes 1 s" : "; 2 stand"));
    holds_ = 0;
  }
}

// What is declared of it is needed: nothing refutes it.
TEST_F(SupervisorWithdrawTest, ABrakeWeakerThanDeclaredIsNotAtRestWhereWhatStandsEnds) {
  Make(kFarthest);
  Accept(PlanFrom(0, 7));
  EXPECT_TRUE(Boundary(0));
  Withdraw(PlanFrom(0, 7), 2);
  EXPECT_FALSE(Boundary(1)) << "a step of what stands is left";
  for (const double real : {kFarthest, kFarthest * (1 - 1e-8)}) {
    State x{kFarthest, -2};
    Brake({real, 0}).Apply(x, 1, x);
    EXPECT_EQ(x[0] == 0, real == kFarthest);
  }
}

TEST_F(SupervisorWithdrawTest, AStopOfWhichNothingIsKnownBeginsAtOnceUnlessAPlanTakesOver) {
  for (const bool takes_over : {true, false}) {
    Remake();
    holds_ = 0;
    events_.clear();
    Accept(PlanFrom(0, 7));
    EXPECT_TRUE(Boundary(0));
    if (takes_over) Accept(PlanFrom(2, 8));
    Withdraw(PlanFrom(0, 7), 3);
    EXPECT_EQ(holds_, !takes_over);
    EXPECT_EQ(Boundary(1), takes_over);
    if (takes_over) continue;
    EXPECT_EQ(events_.back().value, -1);
    EXPECT_THAT(GetText(events_.back().message), HasSubstr("3 stand, the stop takes an unknown number of steps"));
  }
}

// It waited for a plan that then does not start, or is withdrawn, too: what is left is used from there on.
TEST_F(SupervisorWithdrawTest, AStopThatWaitedForAPlanBeginsOnceThatPlanIsGone) {
  Make(kFarthest);
  Accept(PlanFrom(0, 7));
  EXPECT_TRUE(Boundary(0));
  Accept(PlanFrom(2, 8));
  Withdraw(PlanFrom(0, 7), 2);
  EXPECT_TRUE(Boundary(1));
  Withdraw(PlanFrom(2, 8), 1);
  EXPECT_EQ(holds_, 1) << "in the middle of a step, because it is late";
  EXPECT_FALSE(Boundary(2));
  EXPECT_EQ(holds_, 1);
}

TEST(BrakeTest, StopsInTheNumberOfStepsThatItReports) {
  std::mt19937_64 random(20261123);
  std::uniform_real_distribution<double> exponent(-3, 3), sign(-1, 1);
  for (int i = 0; i < 20'000; ++i) {
    const double decline = std::pow(10, exponent(random));
    const int whole = 1 + static_cast<int>(random() % 100);
    // Just below, at and just above a whole number of steps.
    for (double speed : {std::nextafter(whole * decline, 0), whole * decline, std::nextafter(whole * decline, 1e9),
                         whole * decline * std::abs(sign(random))}) {
      speed = std::copysign(speed, sign(random));
      const Brake brake({0, decline});
      std::array<double, 2> x{7, speed};
      const std::array<double, 2> lower{-9, std::min(speed, 0.0)}, upper{9, std::max(speed, 0.0)};
      const int steps = brake.StepsToRest(lower, upper);
      ASSERT_LE(std::abs(speed), steps * decline * (1 + 1e-15));
      for (int t = 0; t < steps; ++t) {
        if (t < steps - 1) ASSERT_NE(x[1], 0) << "of " << steps << " steps";
        brake.Apply(x, 1, x);
      }
      ASSERT_EQ(x[1], 0) << speed << " by " << decline;
      ASSERT_EQ(x[0], 7);
    }
  }
}

TEST(BrakeTest, TheFarthestStateOfTheBoxCounts) {
  const Brake brake({1, 0.5});
  const auto steps = [&](State lower, State upper) { return brake.StepsToRest(lower, upper); };
  EXPECT_EQ(steps({0, 0}, {0, 0}), 0);
  EXPECT_EQ(steps({-2, 0}, {1, 0}), 2);
  EXPECT_EQ(steps({-2, 0}, {1, 1.5}), 3);
  EXPECT_EQ(steps({-2.25, 0}, {1, 1}), 3);
  const double infinity = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(steps({0, 0}, {infinity, 0}), Brake::kNoEnd);
  EXPECT_EQ(steps({nan, 0}, {1, 0}), Brake::kNoEnd);
  EXPECT_EQ(steps({0, 0}, {1, nan}), Brake::kNoEnd);
  EXPECT_EQ(steps({0, 0}, {Brake::kMostSteps, 0}), Brake::kMostSteps);
  EXPECT_EQ(steps({0, 0}, {Brake::kMostSteps + 1, 0}), Brake::kNoEnd);
  const Brake at_once({infinity, 0});
  EXPECT_EQ(at_once.StepsToRest(State{-1e300, 5}, State{1e300, 5}), 0);
  State x{3, 5};
  at_once.Apply(x, 0, x);
  EXPECT_EQ(x, (State{0, 5}));
  EXPECT_EQ(Brake().StepsToRest(x, x), 0);
}

TEST(BrakeTest, AppliesTheDeclineInProportionToThePartOfAStep) {
  const Brake brake({2, 0});
  const State before{-3, 1};
  State x{-5, 4};
  brake.Apply(before, 0.25, x);
  EXPECT_EQ(x, (State{-2.5, 4}));
  brake.Apply(before, 0, x);
  EXPECT_EQ(x, (State{-3, 4}));
}

TEST(BrakeTest, RefusesWhatIsNoDecline) {
  EXPECT_THROW(Brake({1, -1e-300}), std::invalid_argument);
  EXPECT_THROW(Brake({std::numeric_limits<double>::quiet_NaN()}), std::invalid_argument);
}

}  // namespace forereach::withdrawal_test
