#include "robot/supervisor.h"

#include "tests/test.h"

#include "certifier/gate/plan_ledger.h"
#include "tests/keys.h"
#include "tests/messages.h"
#include "tests/robot/sealed_plan.h"

namespace forereach::supervisor_test {

constexpr std::int64_t kStart = kPlanStart, kStep = kPlanStepUs;

// A robot whose state the test sets, and its supervisor. Boundary j lies at kStart + j * kStep.
struct SupervisorTest : testing::Test, protected Supervisor::Robot {
  std::span<const double> state() const override {
    if (fails_) throw std::runtime_error("the sensor does not answer");
    return state_;
  }
  std::span<const double> state_error() const override { return state_error_; }
  void Hold() override { ++holds_; }
  void Reload() override { ++reloads_; }
  void Send(const std::string& channel, Bytes message) override {
    if (channel == "EXECUTION_EVENT") events_.push_back(*Decoded<execution_event_t>(message));
    if (channel == "ROBOT_STATE") states_.push_back(*Decoded<robot_state_t>(message));
    if (channel == "TRANSITION") transitions_.push_back(*Decoded<transition_t>(message));
    if (hears_) hears_(channel, message);
  }

  static std::int64_t At(int boundary) { return kStart + boundary * kStep; }
  void Accept(const certified_plan_t& plan, int boundary) {
    supervisor_.OnCertified(Sealed(plan), At(boundary) - 1000);
  }
  std::span<const double> Boundary(int j) { return supervisor_.Boundary(At(j), At(j)); }
  void Fault(std::int64_t utime, std::int64_t now_us, std::int16_t cause = fault_t::SLICE_LEFT) {
    supervisor_.OnFault(Encode(fault_t{.utime = utime, .cause = cause}), now_us);
  }
  std::string Command(std::int16_t kind, std::int64_t utime, std::int64_t now_us) {
    return supervisor_.OnCommand(Encode(command_t{.utime = utime, .kind = kind}), now_us);
  }
  std::string ResetAt(std::int64_t utime, std::int64_t now_us) { return Command(command_t::RESET, utime, now_us); }
  std::vector<std::int16_t> Events() const {
    std::vector<std::int16_t> kinds;
    for (const execution_event_t& event : events_) kinds.push_back(event.kind);
    return kinds;
  }

  std::vector<double> state_{1, -2}, state_error_;
  bool fails_ = false;
  int holds_ = 0, reloads_ = 0;
  std::function<void(const std::string&, Bytes)> hears_;
  std::vector<execution_event_t> events_;
  std::vector<robot_state_t> states_;
  std::vector<transition_t> transitions_;
  Supervisor supervisor_{SupervisorOptions{TwoStates()}, *this};
};

SupervisorOptions WithKeys() {
  SupervisorOptions options{TwoStates()};
  options.guard.keys = TestKeys();
  options.guard.bus_name = "memq";
  return options;
}

certified_plan_t Measuring(double error) {
  certified_plan_t certified = SmallPlan();
  certified.state_error[0] = error;
  return certified;
}

TEST_F(SupervisorTest, APlanIsExecutedToItsEndThenTheRobotHolds) {
  certified_plan_t plan = SmallPlan();
  for (int t = 0; t < 3; ++t) plan.plan.control[t][0] = 10 + t;
  EXPECT_TRUE(Boundary(-1).empty());
  Accept(plan, 0);
  for (int j = 0; j < 3; ++j) {
    state_[0] = 1 + j;
    EXPECT_THAT(Boundary(j), ElementsAre(10 + j));
  }
  EXPECT_EQ(holds_, 0);
  EXPECT_TRUE(Boundary(3).empty());
  EXPECT_EQ(holds_, 1);
  EXPECT_TRUE(Boundary(4).empty());
  EXPECT_THAT(Events(), ElementsAre(kAccepted, kStarted, kInside, kTailBegun, kInside, kInside, kStanding));
  ASSERT_EQ(states_.size(), 6u);
  EXPECT_EQ(states_[1].mode, robot_state_t::EXECUTING);
  EXPECT_EQ(states_[4].mode, robot_state_t::STANDING);
  ASSERT_EQ(transitions_.size(), 3u);
  EXPECT_FIELDS(transitions_[1], (utime, At(1)), (state[0], 2), (input[0], 11), (next_state[0], 3));
}

TEST_F(SupervisorTest, AStepThatIsTooLateEndsThePlanWithoutAReset) {
  Supervisor supervisor(SupervisorOptions{TwoStates()}, *this);
  const auto boundary = [&](int j, std::int64_t late) { return supervisor.Boundary(At(j), At(j) + late); };
  supervisor.OnCertified(Sealed(SmallPlan(7, 3000)), At(0) - 1000);
  EXPECT_FALSE(boundary(0, 3000).empty());
  EXPECT_FALSE(boundary(1, 3000).empty());
  state_[0] = 77;  // it has moved on
  EXPECT_TRUE(boundary(2, 3001).empty());
  state_[0] = 1;
  EXPECT_EQ(holds_, 1);
  EXPECT_FALSE(supervisor.halted());
  EXPECT_THAT(Events(), ElementsAre(kAccepted, kStarted, kInside, kTailBegun, kOffSchedule));
  EXPECT_FIELDS(events_.back(), (plan_id, 7), (step, 2), (value, 3001));
  EXPECT_THAT(GetText(events_.back().message), HasSubstr("emergency stop: plan 7: step 2 was due at"));
  EXPECT_EQ(transitions_.size(), 1u) << "the step that was too long is no observation of the model's step";

  certified_plan_t next = SmallPlan(8, 3000);
  next.plan.start_utime = At(4);
  next.expires_utime = At(9);
  supervisor.OnCertified(Sealed(next), At(3));
  EXPECT_FALSE(boundary(4, 0).empty()) << "a plan from rest on time";
  next.plan.plan_id = 9;
  next.plan.start_utime = At(6);
  supervisor.OnCertified(Sealed(next), At(5));
  EXPECT_FALSE(boundary(5, 0).empty());
  EXPECT_EQ(supervisor.counts().refused.count("off_schedule"), 0u);
  (void)boundary(6, 3001);
  EXPECT_EQ(supervisor.counts().refused.at("off_schedule"), 1) << "it starts too late";
}

TEST_F(SupervisorTest, AStepWhoseEndsAreOffScheduleIsNoTransition) {
  struct {
    std::int64_t jitter;
    std::int64_t begin_late, end_late;
    double x;
    std::size_t sent;
  } const cases[] = {{3000, 0, 3000, 1, 1},     {3000, 0, 3001, 1, 0},     {3000, 0, -3000, 1, 1},
                     {3000, 0, -3001, 1, 0},    {3000, 0, 3001, 77, 0},    {3000, 0, 3000, 77, 1},
                     {3000, -2000, 1000, 1, 1}, {3000, -2000, 1001, 1, 0}, {-1, 0, 30'000, 1, 1}};
  for (const auto& [jitter, begin_late, end_late, x, sent] : cases) {
    SCOPED_TRACE(std::to_string(begin_late) + " " + std::to_string(end_late));
    Supervisor supervisor(SupervisorOptions{TwoStates()}, *this);
    transitions_.clear();
    state_[0] = 1;
    supervisor.OnCertified(Sealed(SmallPlan(7, jitter)), At(0) - 5000);
    EXPECT_FALSE(supervisor.Boundary(At(0), At(0) + begin_late).empty());
    state_[0] = x;
    supervisor.FinishStep(At(1), At(1) + end_late);
    EXPECT_EQ(transitions_.size(), sent);
    EXPECT_EQ(supervisor.counts().steps, static_cast<std::int64_t>(sent));
    EXPECT_EQ(supervisor.halted(), x == 77 && sent == 1) << "it was on time, and left its slice";
  }
}

// Of a robot that moves, and whose next plan starts at the boundary after which the one before it would have gone on.
TEST_F(SupervisorTest, TheCertifierHearsOfAStopBeforeTheStateThatWouldLookLikeADeparture) {
  constexpr double kSpeed = 10;  // m/s
  const auto moving = [](std::int64_t plan_id, int from, double begin, double half_width) {
    certified_plan_t plan = SmallPlan(plan_id, 5000);
    plan.plan.start_utime = At(from);
    plan.expires_utime = At(from + 1);
    plan.plan.initial_center[0] = begin;
    plan.plan.initial_half_width[0] = half_width;
    for (int t = 0; t <= 3; ++t) {
      const double middle = begin + kSpeed * 0.04 * t, half = half_width + 0.051;
      plan.slice_lower[t][0] = middle - half, plan.slice_upper[t][0] = middle + half;
    }
    Seal(plan);
    return plan;
  };
  for (const bool throws : {false, true}) {
    Supervisor supervisor(SupervisorOptions{TwoStates()}, *this);
    PlanLedger ledger({}, 0);
    const certified_plan_t first = moving(7, 0, 0, 0.01), second = moving(8, 2, throws ? 0.5 : 0.8, 0.1);
    ledger.Add(first, 0);
    ledger.Add(second, 0);
    bool left = false;
    hears_ = [&](const std::string& channel, Bytes message) {
      if (channel == "EXECUTION_EVENT") ledger.SeeStop(*Decoded<execution_event_t>(message), {});
      if (channel == "TRANSITION") left |= ledger.FindDeparture(*Decoded<transition_t>(message)).has_value();
      if (channel == "ROBOT_STATE") left |= ledger.FindDeparture(*Decoded<robot_state_t>(message)).has_value();
    };
    const auto boundary = [&](int j, std::int64_t late, double x) {
      state_ = {x, -2};
      return !supervisor.Boundary(At(j), At(j) + late).empty();
    };
    supervisor.OnCertified(Encode(first), At(0) - 30'000);
    EXPECT_TRUE(boundary(0, -5000, 0));
    supervisor.OnCertified(Encode(second), At(0) + 1000);
    EXPECT_TRUE(boundary(1, -1000, 0.44));
    fails_ = throws;
    if (throws) supervisor.OnCertified({}, At(1) + 500);
    fails_ = false;
    EXPECT_TRUE(boundary(2, 4000, throws ? 0.5 : 0.89)) << "late by the first plan's first step, and by a stop";
    EXPECT_EQ(events_.back().kind, kStarted);
    EXPECT_FALSE(left) << throws;
  }
}

// The slices are +-11 and +-12 in state 0.
TEST_F(SupervisorTest, GoesOnWhereAStateIsConsistentAndStopsWhereItsSliceIsLeft) {
  Supervisor supervisor(SupervisorOptions{TwoStates()}, *this);
  supervisor.OnCertified(Sealed(Measuring(0.5)), At(0) - 1000);
  state_error_ = {0.1, 0};
  EXPECT_FALSE(supervisor.Boundary(At(0), At(0)).empty());
  state_error_.clear();
  state_[0] = 11.4;
  EXPECT_FALSE(supervisor.Boundary(At(1), At(1)).empty());
  EXPECT_FIELDS(events_[2], (kind, execution_event_t::STEP_CONSISTENT), (coordinate, 0), (value, 11.4), (step, 1));
  EXPECT_EQ(GetText(events_[2].message), "consistent with the certified slice, within the state error");
  EXPECT_FIELDS(supervisor.counts(), (steps_consistent, 1), (steps_inside, 0));
  state_[0] = 12.6;
  EXPECT_TRUE(supervisor.Boundary(At(2), At(2)).empty());
  EXPECT_EQ(events_.back().kind, kLeft);
  EXPECT_THAT(GetText(events_.back().message), HasSubstr("is 12.6 +- 0.5 at step 2, outside [-12, 12]"));
  EXPECT_TRUE(supervisor.halted());
  EXPECT_EQ(supervisor.counts().steps_consistent, 1);
  EXPECT_EQ(transitions_.size(), 2u);
}

TEST_F(SupervisorTest, StatesBringTheirOwnErrorsOrNone) {
  state_error_ = {0.25, 0.5};
  (void)Boundary(-2);
  state_error_.clear();
  (void)Boundary(-1);
  ASSERT_EQ(states_.size(), 2u);
  EXPECT_FIELDS(states_[0], (num_state_errors, 2), (state_error[0], 0.25), (state_error[1], 0.5));
  EXPECT_EQ(states_[1].num_state_errors, 0);
}

TEST_F(SupervisorTest, APlanDoesNotStartWithAnErrorThatIsTooLargeOrNone) {
  for (const std::vector<double>& bad :
       std::vector<std::vector<double>>{{0.51, 0}, {-0.1, 0}, {0, std::numeric_limits<double>::quiet_NaN()}, {0}}) {
    state_error_ = bad;
    Supervisor supervisor(SupervisorOptions{TwoStates()}, *this);
    supervisor.OnCertified(Sealed(SmallPlan()), At(0) - 1000);
    EXPECT_TRUE(supervisor.Boundary(At(0), At(0)).empty());
    EXPECT_EQ(events_.back().kind, kRefused);
  }
}

// Learned transitions are taken to be measured as the task declares.
TEST_F(SupervisorTest, AStepWithAnEndThatWasMeasuredWorseThanDeclaredIsNoTransition) {
  using Error = std::vector<double>;
  const Error none, as_declared{0.1, 0}, better{0.05, 0}, worse{std::nextafter(0.1, 1), 0};
  for (const auto& [begin, end, sent] : std::initializer_list<std::tuple<Error, Error, std::size_t>>{
           {none, none, 1}, {as_declared, none, 1}, {better, as_declared, 1}, {worse, none, 0}, {none, worse, 0}}) {
    Supervisor supervisor(SupervisorOptions{TwoStates()}, *this);
    transitions_.clear();
    supervisor.OnCertified(Sealed(Measuring(0.1)), At(0) - 1000);
    state_error_ = begin;
    EXPECT_FALSE(supervisor.Boundary(At(0), At(0)).empty());
    state_error_ = end;
    EXPECT_FALSE(supervisor.Boundary(At(1), At(1)).empty());
    EXPECT_EQ(transitions_.size(), sent);
  }
}

// The certifier may have read the task again before this robot, and may count on smaller errors.
TEST_F(SupervisorTest, AStepMeasuredWithErrorsOfItsOwnIsNoTransitionWhileAPlanOfAnotherTaskIsAwaited) {
  for (const bool awaits : {false, true})
    for (const bool has_its_own : {false, true}) {
      Supervisor supervisor(SupervisorOptions{TwoStates()}, *this);
      transitions_.clear();
      state_error_.clear();
      supervisor.OnCertified(Sealed(Measuring(0.1)), At(0) - 1000);
      if (has_its_own) state_error_ = {0.01, 0};
      EXPECT_FALSE(supervisor.Boundary(At(0), At(0)).empty());
      if (awaits) supervisor.Expect(DigestOf("second"), DigestOf("model"));
      EXPECT_FALSE(supervisor.Boundary(At(1), At(1)).empty());
      EXPECT_EQ(transitions_.size(), awaits && has_its_own ? 0u : 1u);
    }
}

TEST_F(SupervisorTest, HoldsAtRestUntilACertifiedPlanStarts) {
  for (int j = -3; j < 0; ++j) EXPECT_TRUE(Boundary(j).empty());
  EXPECT_THAT(Events(), IsEmpty());
  EXPECT_THAT(transitions_, IsEmpty());
  for (const robot_state_t& state : states_) EXPECT_EQ(state.mode, robot_state_t::STANDING);
}

TEST_F(SupervisorTest, ARunThatEndsStartsNothingAndReportsFinished) {
  Accept(SmallPlan(), 0);
  EXPECT_TRUE(supervisor_.Boundary(At(0), At(0), true).empty());
  EXPECT_EQ(states_[0].mode, robot_state_t::FINISHED);
  EXPECT_EQ(supervisor_.counts().started, 0);
}

TEST_F(SupervisorTest, AStepOutsideItsSliceStopsTheRobotUntilAReset) {
  Accept(SmallPlan(), 0);
  Boundary(0);
  state_[1] = 6;
  EXPECT_TRUE(Boundary(1).empty());
  EXPECT_EQ(holds_, 1);
  EXPECT_TRUE(supervisor_.halted());
  EXPECT_THAT(Events(), ElementsAre(kAccepted, kStarted, kLeft));
  EXPECT_THAT(ResetAt(At(1), At(1) + 10), HasSubstr("before the robot was halted"));
  EXPECT_EQ(ResetAt(At(1) + 1, At(1) + 10), "");
  EXPECT_FALSE(supervisor_.halted());
}

TEST_F(SupervisorTest, AFaultStopsAnExecutingRobotAtOnce) {
  Accept(SmallPlan(), 0);
  Boundary(0);
  Fault(At(0) + 5, At(0) + 10, fault_t::ROBOT_STATE_LOST);
  EXPECT_FALSE(supervisor_.control().empty()) << "that fault does not invalidate the certificate";
  Fault(At(0) + 5, At(0) + 10);
  EXPECT_EQ(holds_, 1);
  EXPECT_TRUE(supervisor_.control().empty());
  EXPECT_TRUE(Boundary(1).empty());
  EXPECT_THAT(transitions_, IsEmpty()) << "the step was not executed as planned";
  Accept(SmallPlan(8), 1);
  EXPECT_EQ(events_.back().kind, kRefused);
  EXPECT_EQ(supervisor_.counts().refused.at("halted"), 1);
}

TEST_F(SupervisorTest, ASecondFaultWhileHaltedNeedsAResetOfItsOwn) {
  Fault(At(0), At(0));
  Fault(At(2), At(2));
  EXPECT_THAT(Events(), ElementsAre(kHalted)) << "it is halted already";
  EXPECT_THAT(ResetAt(At(1), At(3)), HasSubstr("before the robot was halted")) << "nobody has seen the second fault";
  EXPECT_TRUE(supervisor_.halted());
  EXPECT_EQ(ResetAt(At(2) + 1, At(3)), "");
  EXPECT_THAT(Events(), ElementsAre(kHalted, kReset));
}

TEST_F(SupervisorTest, AFaultThatWasStampedEarlierDoesNotMakeAnEarlierResetEnough) {
  Fault(At(2), At(2));
  Fault(At(0), At(2), fault_t::DECLARATION_FALSIFIED);
  EXPECT_THAT(ResetAt(At(2), At(3)), HasSubstr("before the robot was halted"));
  EXPECT_TRUE(supervisor_.halted());
  EXPECT_EQ(ResetAt(At(2) + 1, At(3)), "");
  Fault(At(2) + 2, At(4));
  EXPECT_EQ(ResetAt(At(2) + 3, At(4)), "") << "what halted it before the reset does not count any more";
}

TEST_F(SupervisorTest, AResetOlderThanTheFaultIsRefusedAndARepeatedFaultIgnored) {
  Fault(At(1), At(1));
  EXPECT_NE(ResetAt(At(1) - 1, At(2)), "");
  EXPECT_NE(ResetAt(At(1), At(2)), "");
  EXPECT_EQ(ResetAt(At(1) + 1, At(2)), "");
  Fault(At(1), At(3));
  EXPECT_FALSE(supervisor_.halted()) << "the certifier had not heard the reset";
  Fault(At(1) + 2, At(3));
  EXPECT_TRUE(supervisor_.halted());
}

TEST_F(SupervisorTest, RefusesACommandThatIsTooOldOrFromTheFuture) {
  Fault(At(0), At(0));
  const std::int64_t now = At(100);
  EXPECT_EQ(ResetAt(now - 500'001, now), "stamped 500 ms ago, at most 500 ms allowed");
  EXPECT_EQ(ResetAt(now + 50'001, now), "stamped 50 ms ahead, at most 50 ms allowed");
  EXPECT_TRUE(supervisor_.halted());
  EXPECT_EQ(ResetAt(now - 500'000, now), "");
}

TEST_F(SupervisorTest, AResetFromAClockAheadClearsNoLaterFault) {
  EXPECT_EQ(ResetAt(At(0) + 50'000, At(0)), "");
  Fault(At(0) + 1, At(1));
  EXPECT_TRUE(supervisor_.halted());
}

TEST_F(SupervisorTest, AReloadWhileExecutingDoesNotDisturbThePlan) {
  Accept(SmallPlan(), 0);
  Boundary(0);
  EXPECT_EQ(Command(command_t::RELOAD, At(0), At(0)), "");
  EXPECT_EQ(reloads_, 1);
  supervisor_.Expect(DigestOf("another config"), DigestOf("model"));
  EXPECT_FALSE(Boundary(1).empty());
  EXPECT_EQ(holds_, 0);

  certified_plan_t next = SmallPlan(8);
  next.plan.start_utime = At(2);
  next.expires_utime = At(3);
  SetDigest(next.config_digest, DigestOf("another config"));
  Accept(next, 2);
  EXPECT_FALSE(Boundary(2).empty());
  EXPECT_EQ(states_.back().executing_plan_id, 8);
}

TEST_F(SupervisorTest, ExpectingANewTaskInvalidatesOlderOnesOnceItsFirstPlanCame) {
  supervisor_.Expect(DigestOf("second"), DigestOf("model"));
  supervisor_.Expect(DigestOf("third"), DigestOf("model"));
  const auto kind = [&](std::int64_t plan_id, const char* config) {
    certified_plan_t plan = SmallPlan(plan_id);
    SetDigest(plan.config_digest, DigestOf(config));
    Accept(plan, 0);
    return events_.back().kind;
  };
  EXPECT_EQ(kind(8, "config"), kAccepted);
  EXPECT_EQ(kind(9, "third"), kAccepted);
  EXPECT_EQ(kind(10, "second"), kRefused);
  EXPECT_EQ(kind(11, "config"), kRefused);
  EXPECT_EQ(kind(12, "third"), kAccepted);
}

TEST_F(SupervisorTest, APlanThatExpiresWhileTheRobotIsHeldUpIsRefused) {
  for (const bool expired : {false, true}) {
    certified_plan_t plan = SmallPlan(expired ? 9 : 8);
    plan.plan.start_utime = At(expired ? 10 : 0);
    plan.expires_utime = At(expired ? 11 : 1);
    Accept(plan, expired ? 10 : 0);
    const int j = expired ? 10 : 0;
    EXPECT_EQ(supervisor_.Boundary(At(j), plan.expires_utime + expired).empty(), expired);
    for (int more = 1; more <= 3; ++more) Boundary(j + more);
  }
  EXPECT_EQ(supervisor_.counts().refused.at("expired"), 1);
  EXPECT_EQ(supervisor_.counts().started, 1);
}

TEST_F(SupervisorTest, FinishesEachStepOnceWithAndWithoutFinishStep) {
  Accept(SmallPlan(), 0);
  Boundary(0);
  supervisor_.FinishStep(At(1), At(1));
  supervisor_.FinishStep(At(1), At(1));
  Boundary(1);
  EXPECT_FIELDS(supervisor_.counts(), (steps, 1), (steps_inside, 1));
}

TEST_F(SupervisorTest, BytesThatAreNoMessageDoNothing) {
  const std::vector<std::uint8_t> bytes{1, 2, 3};
  supervisor_.OnFault(bytes, At(0));
  EXPECT_EQ(supervisor_.OnCommand(bytes, At(0)), "");
  EXPECT_THAT(Events(), IsEmpty());
  supervisor_.OnCertified(bytes, At(0));
  EXPECT_THAT(Events(), ElementsAre(kRefused));
}

TEST_F(SupervisorTest, WithKeysFaultsAreTheCertifiersAndCommandsTheOperators) {
  Supervisor supervisor(WithKeys(), *this);
  Signer signer(TestKeys(), "memq");
  fault_t fault{.utime = At(1), .cause = fault_t::SLICE_LEFT};
  supervisor.OnFault(Encode(fault), At(1));
  supervisor.OnFault(signer.Sign(Role::kOperator, "FAULT", Encode(fault), At(1)), At(1));
  EXPECT_FALSE(supervisor.halted());
  supervisor.OnFault(signer.Sign(Role::kCertifier, "FAULT", Encode(fault), At(1)), At(1));
  EXPECT_TRUE(supervisor.halted());

  command_t reset{.utime = At(2), .kind = command_t::RESET};
  EXPECT_NE(supervisor.OnCommand(Encode(reset), At(2)), "");
  EXPECT_NE(supervisor.OnCommand(signer.Sign(Role::kCertifier, "COMMAND", Encode(reset), At(2)), At(2)), "");
  EXPECT_TRUE(supervisor.halted());
  EXPECT_EQ(supervisor.OnCommand(signer.Sign(Role::kOperator, "COMMAND", Encode(reset), At(2)), At(2)), "");
  EXPECT_FALSE(supervisor.halted());
}

// Somebody has recorded what was signed earlier, or while a clock was ahead.
TEST_F(SupervisorTest, WhatWasSignedBeforeItsStartOrAheadOfItsClockCountsForNothingAndIsReported) {
  constexpr std::int64_t kHour = 3'600'000'000;
  for (const auto& [off, cause] :
       {std::pair(-kHour, "signed_before_the_start"), std::pair(-kClockErrorUs, "signed_before_the_start"),
        std::pair(std::int64_t{60'000'001}, "signed_ahead"), std::pair(kHour, "signed_ahead")}) {
    SCOPED_TRACE(off);
    Supervisor supervisor(WithKeys(), *this);
    events_.clear();
    const std::int64_t start = At(0) - 1000;
    const auto signed_off = [&, off = off](Role role, const char* channel, Bytes message) {
      return Signer(TestKeys(), "memq").Sign(role, channel, message, start + off);
    };
    fault_t fault{.utime = start + off, .cause = fault_t::SLICE_LEFT};
    supervisor.OnFault(signed_off(Role::kCertifier, "FAULT", Encode(fault)), start);
    EXPECT_FALSE(supervisor.halted());
    supervisor.OnCertified(signed_off(Role::kCertifier, "PLAN_CERTIFIED", Sealed(SmallPlan())), start);
    withdrawal_t withdrawal{.plan_id = SmallPlan().plan.plan_id};
    supervisor.OnWithdrawn(signed_off(Role::kCertifier, "PLAN_WITHDRAWN", Encode(withdrawal)), start);
    EXPECT_THAT(Events(), ElementsAre(kRefused, kRefused, kRefused));
    for (const execution_event_t& event : events_)
      EXPECT_THAT(GetText(event.message), StartsWith(std::string(cause) + ": "));
    command_t reload{.utime = start, .kind = command_t::RELOAD};
    const auto stale = signed_off(Role::kOperator, "COMMAND", Encode(reload));
    EXPECT_THAT(supervisor.OnCommand(stale, start), HasSubstr("COMMAND was signed"));
    EXPECT_EQ(reloads_, 0);
    EXPECT_THAT(Events(), ElementsAre(kRefused, kRefused, kRefused, kRefused)) << "that one is reported, too";
    EXPECT_THAT(GetText(events_.back().message), StartsWith(std::string(cause) + ": COMMAND was signed"));
    EXPECT_EQ(supervisor.counts().refused.at(cause), 4);
  }
}

// A certifier whose clock is ahead stops the robot nevertheless. It starts nothing.
TEST_F(SupervisorTest, WhatOnlyStopsMayBeSignedAMinuteAhead) {
  constexpr std::int64_t kMinute = 60'000'000;
  for (const std::int64_t ahead : {kClockErrorUs, kClockErrorUs + 1, kMinute, kMinute + 1}) {
    SCOPED_TRACE(ahead);
    Supervisor supervisor(WithKeys(), *this);
    events_.clear();
    const bool plan_counts = ahead <= kClockErrorUs, stop_counts = ahead <= kMinute;
    const auto say = [&](std::int64_t off, const char* channel, Bytes message) {
      return Signer(TestKeys(), "memq").Sign(Role::kCertifier, channel, message, At(0) - 1000 + off);
    };
    supervisor.OnCertified(say(ahead, "PLAN_CERTIFIED", Sealed(SmallPlan())), At(0) - 1000);
    EXPECT_EQ(events_.back().kind, plan_counts ? kAccepted : kRefused);
    supervisor.OnCertified(say(0, "PLAN_CERTIFIED", Sealed(SmallPlan(8))), At(0) - 1000);
    EXPECT_EQ(events_.back().kind, kAccepted);
    withdrawal_t withdrawal{.plan_id = 8};
    supervisor.OnWithdrawn(say(ahead, "PLAN_WITHDRAWN", Encode(withdrawal)), At(0) - 1000);
    EXPECT_EQ(events_.back().kind, stop_counts ? +execution_event_t::WITHDRAWN : +kRefused);
    if (!stop_counts) {
      EXPECT_THAT(GetText(events_.back().message), HasSubstr("signed more than 60000 ms ahead"));
    }
    fault_t fault{.utime = At(0) + ahead, .cause = fault_t::SLICE_LEFT};
    supervisor.OnFault(say(ahead, "FAULT", Encode(fault)), At(0) - 1000);
    EXPECT_EQ(supervisor.halted(), stop_counts);
    if (!stop_counts) EXPECT_THAT(GetText(events_.back().message), HasSubstr("signed more than 60000 ms ahead"));
  }
}

// A certifier that was started again sends its latched fault with the stamp of then, and signs it now.
TEST_F(SupervisorTest, ALatchedFaultThatIsSentAgainHaltsARobotThatHasJustStarted) {
  Supervisor supervisor(WithKeys(), *this);
  fault_t fault{.utime = At(0) - 3'600'000'000, .cause = fault_t::SLICE_LEFT};
  supervisor.OnFault(Signer(TestKeys(), "memq").Sign(Role::kCertifier, "FAULT", Encode(fault), At(0)), At(0) + 100);
  EXPECT_TRUE(supervisor.halted());
  command_t reset{.utime = At(1), .kind = command_t::RESET};
  EXPECT_EQ(
      supervisor.OnCommand(Signer(TestKeys(), "memq").Sign(Role::kOperator, "COMMAND", Encode(reset), At(1)), At(1)),
      "");
  EXPECT_FALSE(supervisor.halted());
}

}  // namespace forereach::supervisor_test
