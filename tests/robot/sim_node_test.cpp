#include "simulator/sim_node.h"

#include <regex>

#include "tests/test.h"

#include "bus/authentic_bus.h"
#include "bus/log.h"
#include "certifier/gate/upheld.h"
#include "forereach/dynamics/models/named_residuals.h"
#include "forereach/dynamics/text_model.h"
#include "forereach/residual/observations.h"
#include "tests/keys.h"
#include "tests/messages.h"
#include "tests/paths.h"
#include "tests/robot/sealed_plan.h"
#include "tests/worlds.h"

namespace forereach::sim_node_test {

constexpr std::int64_t kT0 = 1'700'000'000'000'000, kPeriod = 40'000;

std::int64_t BoundaryTime(int j) { return kT0 + j * kPeriod; }

// A point mass with dt = 0.15 s at the origin, safety in its position, a goal far away.
Config PointMassTask() {
  Config config;
  config.path = "task.yaml";
  config.problem =
      std::make_shared<const Problem>(WorldOf(MakePointMass(0.15), Within({1e3, 1e3, 1e3, 1e3}), Within({1e3, 1e3})));
  config.grounds.config = DigestOf("config");
  config.grounds.model = DigestOf("model");
  config.planner.goal = {100, 0};
  config.robot.start = {0, 0, 0, 0};
  config.robot.step_period_ms = 40;
  return config;
}

Problem LargeBicycle(std::shared_ptr<const NominalModel> model) {
  return WorldOf(std::move(model), Within({1e3, 1e3, 1e3, 1e3, 1e3, 1e3}), Within({1e3, 1e3}));
}

// Forward for half of the steps, then back to rest: the second half is the tail. X0 = `state` +- 0.1, slices anything.
certified_plan_t Plan(const Config& config, std::int64_t id, int start, const std::vector<double>& state,
                      int steps = 4) {
  certified_plan_t certified{};
  certified.utime = certified.plan.utime = BoundaryTime(0);
  certified.expires_utime = BoundaryTime(start) + kPeriod;
  SetUpheld(certified, UpheldUnder(*config.problem, config.gate));
  candidate_plan_t& plan = certified.plan;
  plan.plan_id = id;
  plan.start_utime = BoundaryTime(start);
  plan.step_us = kPeriod;
  plan.num_states = static_cast<std::int16_t>(state.size());
  plan.num_inputs = 2;
  plan.num_steps = static_cast<std::int16_t>(steps);
  plan.progress_steps = static_cast<std::int16_t>(steps / 2);
  for (std::size_t k = 0; k < state.size(); ++k) {
    plan.initial_center[k] = state[k];
    plan.initial_half_width[k] = 0.1;
  }
  for (int t = 0; t < steps; ++t) plan.control[t][0] = t < steps / 2 ? 1 : -1;
  for (int t = 0; t <= steps; ++t) {
    for (std::size_t k = 0; k < state.size(); ++k) {
      certified.slice_lower[t][k] = -1e3;
      certified.slice_upper[t][k] = 1e3;
    }
  }
  SetDigest(certified.config_digest, config.grounds.config);
  SetDigest(certified.model_digest, config.grounds.model);
  for (auto* digest : {&certified.declaration_digest, &certified.observations_digest, &certified.obstacles_digest,
                       &certified.transitions_digest})
    SetDigest(*digest, DigestOf("something"));
  return certified;
}

// The node on a bus and a clock of its own, and everything it says.
class Rig {
 public:
  explicit Rig(Config config, Plant plant = {})
      : config_(std::move(config)), node_(config_, *bus_, summary_, std::move(plant)) {
    Record(config_.bus.robot_state, states);
    Record(config_.bus.event, events);
    Record(config_.bus.transition, transitions);
  }

  void Send(const certified_plan_t& certified) { bus_->Publish(config_.bus.certified, Bytes(Sealed(certified))); }
  void SendRaw(const std::string& channel, Bytes bytes) { bus_->Publish(channel, bytes); }
  template <class Message>
  void Publish(const std::string& channel, const Message& message) {
    bus_->Publish(channel, message);
  }

  /** Runs the process's loop until boundary j has been handled. */
  void RunTo(int j, std::int64_t tick = 2000) {
    for (; now_ <= BoundaryTime(j); now_ += tick) {
      bus_->Dispatch(0);
      node_.Tick(now_);
    }
    bus_->Dispatch(0);
  }
  /** Handles boundary j late, at once with those before it. */
  void TickLate(int j, std::int64_t late_us) {
    now_ = BoundaryTime(j) + late_us;
    bus_->Dispatch(0);
    node_.Tick(now_);
    bus_->Dispatch(0);
    now_ += 2000;
  }

  [[nodiscard]] std::vector<double> StateAt(int j) const {
    const robot_state_t& message = states.at(static_cast<std::size_t>(j));
    return {message.state, message.state + message.num_states};
  }
  [[nodiscard]] std::vector<std::int16_t> EventKinds() const {
    std::vector<std::int16_t> kinds;
    for (const auto& event : events) kinds.push_back(event.kind);
    return kinds;
  }
  [[nodiscard]] std::ptrdiff_t Count(std::int16_t kind) const {
    return std::ranges::count(events, kind, &execution_event_t::kind);
  }
  [[nodiscard]] const execution_event_t& First(std::int16_t kind) const {
    const auto first = std::ranges::find(events, kind, &execution_event_t::kind);
    if (first == events.end()) throw std::runtime_error("no event of kind " + std::to_string(kind));
    return *first;
  }
  [[nodiscard]] nlohmann::json Summary() const { return nlohmann::json::parse(node_.Summary()); }
  RobotSimNode& node() { return node_; }
  [[nodiscard]] std::string printed() const { return summary_.str(); }

  std::vector<robot_state_t> states;
  std::vector<execution_event_t> events;
  std::vector<transition_t> transitions;

 private:
  template <class Message>
  void Record(const std::string& channel, std::vector<Message>& into) {
    Hear(*bus_, channel, into);
    bus_->Subscribe(channel, [&into](const Received&) { EXPECT_EQ(into.back().sequence, std::ssize(into) - 1); });
  }

  std::int64_t now_ = kT0;
  const Config config_;
  std::ostringstream summary_;
  std::unique_ptr<Bus> bus_ = OpenBus("memq://", [this] { return now_; });
  RobotSimNode node_;
};

// Boundary 0 has been handled.
struct RunningRig : Rig {
  explicit RunningRig(Config config, Plant plant = {}) : Rig(std::move(config), std::move(plant)) { RunTo(0); }
};

// It has been sent a plan since, and has been run until boundary j.
struct DrivingRig : RunningRig {
  DrivingRig(int j, const certified_plan_t& plan, const Config& config = PointMassTask()) : RunningRig(config) {
    Send(plan);
    RunTo(j);
  }
  explicit DrivingRig(int j, const Config& config = PointMassTask())
      : DrivingRig(j, Plan(config, 1, 1, config.robot.start), config) {}
};

const std::vector<double> kOrigin{0, 0, 0, 0};

// Its speed is 0.3 at the second step, and may be 0.2.
certified_plan_t PlanThatIsLeft(const Config& config) {
  certified_plan_t certified = Plan(config, 1, 1, kOrigin);
  certified.slice_upper[2][2] = 0.2;
  return certified;
}

TEST(RobotSim, StandsAndReportsAtEveryBoundary) {
  Rig rig(PointMassTask());
  rig.RunTo(5);
  ASSERT_EQ(rig.states.size(), 6u);
  for (int j = 0; j <= 5; ++j) {
    const robot_state_t& state = rig.states[static_cast<std::size_t>(j)];
    EXPECT_FIELDS(state, (utime, BoundaryTime(j)), (mode, robot_state_t::STANDING), (executing_plan_id, -1),
                  (executing_step, -1));
    EXPECT_EQ(rig.StateAt(j), kOrigin);
  }
  EXPECT_THAT(rig.events, IsEmpty());
  EXPECT_THAT(rig.transitions, IsEmpty());
}

TEST(RobotSim, ObeysNothingButACertifiedPlan) {
  const Config config = PointMassTask();
  RunningRig rig(config);
  const certified_plan_t good = Plan(config, 1, 3, kOrigin);

  decision_t decision{.plan_id = 1, .outcome = decision_t::CERTIFIED};
  rig.Publish(config.bus.candidate, good.plan);
  rig.Publish(config.bus.decision, decision);
  rig.RunTo(1);
  EXPECT_THAT(rig.events, IsEmpty());

  rig.Publish(config.bus.certified, good.plan);
  rig.Publish(config.bus.certified, decision);
  certified_plan_t tampered = good;
  Seal(tampered);
  tampered.plan.control[0][0] = 2;
  rig.Publish(config.bus.certified, tampered);
  certified_plan_t elsewhere = good;
  SetDigest(elsewhere.model_digest, DigestOf("another model"));
  rig.Send(elsewhere);
  rig.RunTo(8);
  EXPECT_THAT(rig.EventKinds(), ElementsAre(kRefused, kRefused, kRefused, kRefused));
  EXPECT_EQ(GetText(rig.events[2].message).substr(0, 13), "plan_digest: ");
  EXPECT_FIELDS(rig, (events[2].plan_id, 1), (events[0].plan_id, -1));
  for (int j = 0; j <= 8; ++j) EXPECT_EQ(rig.StateAt(j), kOrigin);
  EXPECT_THAT(rig.transitions, IsEmpty());
  const auto refused = rig.Summary()["plans_refused"];
  EXPECT_THAT(refused, Holds({{"unknown_fingerprint", 2}, {"plan_digest", 1}, {"model_digest", 1}}));

  rig.Send(Plan(config, 1, 10, kOrigin));
  rig.RunTo(10);
  EXPECT_EQ(rig.Count(kStarted), 1) << "what was refused does not stand in the way of the real one";
}

TEST(RobotSim, StartsAtTheBoundaryThePlanNamesAndExecutesItsControls) {
  const Config config = PointMassTask();
  DrivingRig rig(6, Plan(config, 5, 3, {0.05, 0, 0, 0}), config);

  EXPECT_EQ(rig.First(kAccepted).utime, kT0 + 2000) << "when it arrived";
  EXPECT_FIELDS(rig.First(kStarted), (utime, BoundaryTime(3)), (plan_id, 5));
  EXPECT_EQ(rig.states[2].mode, robot_state_t::STANDING);
  std::vector<double> x = kOrigin;
  for (int j = 3; j <= 6; ++j) {
    const robot_state_t& state = rig.states[static_cast<std::size_t>(j)];
    EXPECT_FIELDS(state, (mode, robot_state_t::EXECUTING), (executing_plan_id, 5), (executing_step, j - 3));
    EXPECT_EQ(rig.StateAt(j), x);
    std::vector<double> z = x;
    z.insert(z.end(), {j - 3 < 2 ? 1.0 : -1.0, 0.0});
    config.problem->model->Evaluate(z, x);
  }
  ASSERT_EQ(rig.transitions.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    const transition_t& transition = rig.transitions[static_cast<std::size_t>(i)];
    EXPECT_EQ(transition.utime, BoundaryTime(3 + i)) << "when the step began";
    EXPECT_EQ(std::vector<double>(transition.state, transition.state + 4), rig.StateAt(3 + i));
    EXPECT_EQ(std::vector<double>(transition.next_state, transition.next_state + 4), rig.StateAt(4 + i));
    EXPECT_EQ(transition.input[0], i < 2 ? 1 : -1);
  }
}

// A model as text has names of its own, so the task says what is zero while the robot stands.
TEST(RobotSim, AGivenPlantReplacesTheTarget) {
  const Config config = PointMassTask();
  std::vector<std::vector<double>> from;
  double hidden = 0;
  Rig rig(config, [&](std::span<const double> x, std::span<const double> u, std::span<double> next, double) {
    from.emplace_back(x.begin(), x.end());
    hidden += u[0];
    std::copy(x.begin(), x.end(), next.begin());
    next[0] += 0.01;
    next[2] = hidden;
  });
  rig.Send(Plan(config, 5, 1, kOrigin));
  rig.RunTo(3);
  EXPECT_THAT(from, ElementsAre(kOrigin, ElementsAre(0.01, 0, 1, 0)));
  EXPECT_EQ(rig.StateAt(3), (std::vector<double>{0.02, 0, 2, 0}));
}

TEST(RobotSim, ATextModelStandsWithTheStatesOfRobotHoldAtZero) {
  Config config = PointMassTask();
  ModelText text;
  text.name = "text";
  for (const char* state : {"px", "py", "vx", "vy"}) text.states.push_back({state, ""});
  for (const char* input : {"ax", "ay"}) text.inputs.push_back({input, ""});
  text.parameters = {{"dt", 0.25, 0.25}};
  text.equations = {{"px + dt*vx + dt^2/2*ax"}, {"py + dt*vy + dt^2/2*ay"}, {"vx + dt*ax"}, {"vy + dt*ay"}};
  Own(config.problem).model = MakeTextModel(text);
  EXPECT_THAT([&] { Rig rig(config); }, ThrowsMessage<ConfigError>(HasSubstr("task.yaml: robot.hold: missing")));
  config.robot.hold = std::vector<std::string>{"vx"};
  certified_plan_t first = Plan(config, 1, 1, kOrigin);
  first.plan.control[3][0] = -0.75;
  first.plan.control[3][1] = 0.1;
  DrivingRig rig(8, first, config);
  EXPECT_NE(rig.First(kStanding).state[2], 0) << "measured, before the hold mode";
  EXPECT_EQ(rig.StateAt(5)[2], 0);
  EXPECT_EQ(rig.StateAt(5)[3], rig.First(kStanding).state[3]) << "not named";
}

TEST(RobotSim, WithoutANewerPlanItRunsTheTailStandsAndGoesOnFromThere) {
  const Config config = PointMassTask();
  certified_plan_t first = Plan(config, 1, 1, kOrigin);
  first.plan.control[3][0] = -0.75;  // it ends near rest, not at it
  DrivingRig rig(8, first, config);
  EXPECT_THAT(rig.EventKinds(),
              ElementsAre(kAccepted, kStarted, kInside, kInside, kTailBegun, kInside, kInside, kStanding));
  EXPECT_EQ(rig.First(kTailBegun).utime, BoundaryTime(3));
  EXPECT_EQ(rig.First(kStanding).utime, BoundaryTime(5));
  EXPECT_NEAR(rig.First(kStanding).state[2], 0.15 * 0.25, 1e-12) << "measured, before the hold mode";
  EXPECT_EQ(rig.StateAt(5)[2], 0) << "the hold mode";
  EXPECT_FIELDS(rig, (StateAt(5)[0], rig.First(kStanding).state[0]), (StateAt(8), rig.StateAt(5)),
                (states[5].mode, robot_state_t::STANDING));

  rig.Send(Plan(config, 2, 10, rig.StateAt(8)));
  rig.RunTo(14);
  EXPECT_FIELDS(rig, (states[9].mode, robot_state_t::STANDING), (states[10].executing_plan_id, 2));
  EXPECT_EQ(rig.Count(kStanding), 2);
  EXPECT_EQ(rig.Summary()["stops"], 2);
  EXPECT_GT(rig.StateAt(14)[0], rig.StateAt(8)[0]);
}

TEST(RobotSim, AFaultHaltsItUntilAFreshResetAndItsRepetitionDoesNotHaltItAgain) {
  const Config config = PointMassTask();
  Rig rig(config);
  rig.RunTo(0);
  rig.Send(Plan(config, 1, 1, kOrigin, 40));
  rig.RunTo(2);
  fault_t fault{.utime = BoundaryTime(2), .cause = fault_t::ROBOT_STATE_LOST};
  rig.Publish("FAULT", fault);
  rig.RunTo(3);
  EXPECT_EQ(rig.states[3].mode, robot_state_t::EXECUTING) << "that is the certifier's own affair";
  fault.cause = fault_t::DECLARATION_FALSIFIED;
  rig.Publish("FAULT", fault);
  rig.Publish("FAULT", fault);
  rig.RunTo(20);
  EXPECT_EQ(rig.states[4].mode, robot_state_t::STANDING);
  EXPECT_EQ(rig.Count(execution_event_t::HALTED), 1);
  rig.Send(Plan(config, 2, 22, rig.StateAt(20)));
  rig.RunTo(22);
  EXPECT_EQ(rig.Count(kRefused), 1);
  EXPECT_EQ(rig.states[22].mode, robot_state_t::STANDING);

  command_t reset = ResetAt(BoundaryTime(22) - 500'000);  // gate.max_age_ms is 500
  rig.Publish("COMMAND", reset);
  rig.RunTo(23);
  EXPECT_EQ(rig.Count(execution_event_t::RESET), 0);
  reset.utime = BoundaryTime(23);
  rig.Publish("COMMAND", reset);
  rig.Publish("FAULT", fault);
  rig.RunTo(24);
  EXPECT_EQ(rig.Count(execution_event_t::RESET), 1);
  EXPECT_EQ(rig.Count(execution_event_t::HALTED), 1);
  rig.Send(Plan(config, 3, 25, rig.StateAt(24)));
  rig.RunTo(25);
  EXPECT_EQ(rig.states[25].mode, robot_state_t::EXECUTING);
  ++fault.sequence;
  fault.utime = BoundaryTime(25);
  fault.cause = fault_t::SLICE_LEFT;
  rig.Publish("FAULT", fault);
  rig.RunTo(26);
  EXPECT_EQ(rig.Count(execution_event_t::HALTED), 2) << "another fault";
  rig.Publish("COMMAND", reset);
  rig.RunTo(27);
  EXPECT_EQ(rig.Count(execution_event_t::RESET), 1) << "it was sent before that one, and is fresh all the same";
  reset.utime = BoundaryTime(27);
  rig.Publish("COMMAND", reset);
  rig.RunTo(28);
  EXPECT_EQ(rig.Count(execution_event_t::RESET), 2);
}

// It begins while the certifier has a fault latched, and hears of the reset first.
TEST(RobotSim, IgnoresAFaultFromBeforeTheLastReset) {
  const Config config = PointMassTask();
  Rig rig(config);
  rig.RunTo(1);
  const command_t reset = ResetAt(BoundaryTime(1));
  rig.Publish("COMMAND", reset);
  fault_t fault{.cause = fault_t::SLICE_LEFT};
  for (const std::int64_t after : {-1, 0, 1}) {
    fault.utime = reset.utime + after;
    rig.Publish("FAULT", fault);
    rig.RunTo(static_cast<int>(3 + after));
    EXPECT_EQ(rig.Count(execution_event_t::HALTED), after > 0) << after;
  }
}

TEST(RobotSim, AResetFromAClockThatGoesAheadClearsNoFaultToCome) {
  Rig rig(PointMassTask());
  rig.RunTo(1);
  const command_t reset = ResetAt(BoundaryTime(1) + 50'000);  // gate.max_ahead_ms is 50
  rig.Publish("COMMAND", reset);
  rig.RunTo(2);
  fault_t fault{.utime = BoundaryTime(2), .cause = fault_t::SLICE_LEFT};
  ASSERT_LT(fault.utime, reset.utime);
  rig.Publish("FAULT", fault);
  rig.RunTo(3);
  EXPECT_EQ(rig.Count(execution_event_t::HALTED), 1);
}

TEST(RobotSim, AHaltThatComesLateNeedsAResetAfterIt) {
  const Config config = PointMassTask();
  DrivingRig rig(1, PlanThatIsLeft(config), config);
  rig.RunTo(6, 49 * kPeriod / 10);  // held up: boundary 3 is handled shortly before the sixth
  ASSERT_EQ(rig.Count(kLeft), 1);
  for (const int at : {4, 11}) {
    rig.Publish("COMMAND", ResetAt(BoundaryTime(at)));
    rig.RunTo(at + 8);
    EXPECT_EQ(rig.Count(execution_event_t::RESET), at == 4 ? 0 : 1) << at;
  }
}

TEST(RobotSim, ANewPlanTakesOverAtItsBoundaryInTheMiddleOfTheOld) {
  const Config config = PointMassTask();
  DrivingRig rig(2, config);
  const std::vector<double> at_two = rig.StateAt(2);
  std::vector<double> at_three(4);
  std::vector<double> z = at_two;
  z.insert(z.end(), {1.0, 0.0});
  config.problem->model->Evaluate(z, at_three);
  rig.Send(Plan(config, 2, 3, at_three));
  rig.RunTo(4);
  EXPECT_THAT(rig.EventKinds(), ElementsAre(kAccepted, kStarted, kInside, kAccepted, kInside, kStarted, kInside))
      << "the last step of the old plan is checked before the new one starts, and no tail has begun";
  EXPECT_FIELDS(rig, (events[4].plan_id, 1), (events[4].step, 2), (events[5].plan_id, 2),
                (states[3].executing_plan_id, 2), (states[3].executing_step, 0), (events[6].step, 1));
}

TEST(RobotSim, APlanForAnotherStateIsRefusedAndTheOldOneGoesOn) {
  const Config config = PointMassTask();
  DrivingRig rig(2, config);
  rig.Send(Plan(config, 2, 3, {5, 0, 0, 0}));
  rig.RunTo(3);
  EXPECT_FIELDS(rig.First(kRefused), (plan_id, 2), (coordinate, 0), (utime, BoundaryTime(3)));
  EXPECT_FIELDS(rig.states[3], (executing_plan_id, 1), (executing_step, 2));
  EXPECT_EQ(rig.Count(kTailBegun), 1);
  EXPECT_EQ(rig.Summary()["plans_refused"]["outside_initial_set"], 1);
}

// Nothing steers the robot to where its plans begin.
TEST(RobotSim, SaysOnceAndWithTheKeyThatManyPlansAreRefusedAtTheirStart) {
  const Config config = PointMassTask();
  RunningRig rig(config);
  const auto said = [&](int first, int last) {
    testing::internal::CaptureStderr();
    for (int k = first; k <= last; ++k) rig.Send(Plan(config, k, k, {5, 0, 0, 0})), rig.RunTo(k);
    logging::Flush();
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_THAT(said(1, 9), Not(HasSubstr("refused at their start"))) << "a few may be";
  EXPECT_THAT(said(10, 10), AllOf(HasSubstr("10 plans were refused at their start and 0 began"),
                                  HasSubstr("planner.initial_half_width"), HasSubstr("not inside X0 = 5 +- ")));
  EXPECT_THAT(said(11, 40), Not(HasSubstr("refused at their start"))) << "it has been said";
}

TEST(RobotSim, AFewRefusedStartsAmongManyAreNoNews) {
  const Config config = PointMassTask();
  RunningRig rig(config);
  testing::internal::CaptureStderr();
  for (int k = 1; k <= 60; ++k) {
    std::vector<double> z = rig.StateAt(k - 1), next = z;
    z.insert(z.end(), {1.0, 0.0});
    if (k > 1) config.problem->model->Evaluate(z, next);
    if (k % 5 == 0) next[0] += 5;
    rig.Send(Plan(config, k, k, next));
    rig.RunTo(k);
  }
  logging::Flush();
  EXPECT_THAT(testing::internal::GetCapturedStderr(), Not(HasSubstr("refused at their start")));
  EXPECT_EQ(rig.Summary()["plans_refused"]["outside_initial_set"], 12);
  EXPECT_EQ(rig.Summary()["plans_started"], 48);
}

TEST(RobotSim, APlanThatArrivesAfterItsStartIsNotStarted) {
  const Config config = PointMassTask();
  Rig rig(config);
  rig.RunTo(5);
  rig.Send(Plan(config, 1, 5, kOrigin));
  rig.RunTo(6);
  EXPECT_EQ(rig.Count(kStarted), 0);
  EXPECT_EQ(rig.Summary()["plans_refused"]["too_late"], 1);
}

TEST(RobotSim, LeavingTheSliceStopsItAtOnce) {
  const Config config = PointMassTask();
  DrivingRig rig(6, PlanThatIsLeft(config), config);
  EXPECT_THAT(rig.EventKinds(), ElementsAre(kAccepted, kStarted, kInside, kLeft));
  const execution_event_t& outside = rig.First(kLeft);
  EXPECT_FIELDS(outside, (step, 2), (coordinate, 2), (value, outside.state[2]));
  EXPECT_NEAR(outside.value, 0.3, 1e-12);
  EXPECT_EQ(GetText(outside.message).substr(0, 16), "emergency stop: ");
  EXPECT_FIELDS(rig, (states[3].mode, robot_state_t::STANDING), (StateAt(3)[2], 0), (StateAt(6), rig.StateAt(3)));
  EXPECT_THAT(rig.Summary(), Holds({{"steps_executed", 2}, {"steps_inside_slice", 1}, {"stops", 1}}));
}

// vx falls by 0.15 in each step; vy is not named, so it is zero at once.
Config TaskWithBrake() {
  Config config = PointMassTask();
  config.period = 0.15;
  config.robot.emergency_stop = {{"vx", 1}};
  return config;
}

TEST(RobotSim, ComesToRestAsItsEmergencyStopSays) {
  Config config = TaskWithBrake();
  DrivingRig rig(8, PlanThatIsLeft(config), config);
  EXPECT_EQ(rig.First(kLeft).utime, BoundaryTime(3));
  const double place = rig.StateAt(3)[0];
  EXPECT_NEAR(rig.StateAt(3)[2], 0.3, 1e-12);
  EXPECT_NEAR(rig.StateAt(4)[2], 0.15, 1e-12);
  EXPECT_NEAR(rig.StateAt(4)[0], place + 0.15 * 0.3, 1e-12) << "it moves on";
  EXPECT_EQ(rig.StateAt(5)[2], 0);
  EXPECT_NEAR(rig.StateAt(5)[0], place + 0.15 * (0.3 + 0.15), 1e-12);
  EXPECT_EQ(rig.StateAt(8), rig.StateAt(5)) << "at rest";
  EXPECT_EQ(rig.Summary()["steps_executed"], 2) << "no step of the stop is one of a plan";
}

TEST(RobotSim, WhatItsEmergencyStopDoesNotNameIsZeroAtOnce) {
  Config config = TaskWithBrake();
  config.robot.start = {0, 0, 1, 0.5};
  certified_plan_t plan = Plan(config, 1, 1, config.robot.start);
  plan.slice_upper[1][0] = 0;
  DrivingRig rig(10, plan, config);
  EXPECT_FIELDS(rig, (StateAt(2)[3], 0), (StateAt(9)[1], rig.StateAt(2)[1]));
  EXPECT_GT(rig.StateAt(9)[2], 0) << "it takes eight steps";
  EXPECT_EQ(rig.StateAt(10)[2], 0);
}

TEST(RobotSim, AnEmergencyStopInTheMiddleOfAStepBrakesForTheRestOfIt) {
  Config config = TaskWithBrake();
  config.robot.start = {0, 0, 1, 0};
  RunningRig rig(config);
  certified_plan_t plan = Plan(config, 1, 1, config.robot.start);
  Seal(plan);
  rig.Send(plan);
  rig.RunTo(2);
  withdrawal_t message{.utime = BoundaryTime(2), .plan_id = 1, .cause = withdrawal_t::OBSTACLE};
  SetGrounds(message, GroundsOf(plan));
  SetDigest(message.certificate_digest, GetDigest(plan.certificate_digest));
  rig.Publish("PLAN_WITHDRAWN", message);  // 2 ms after boundary 2
  rig.RunTo(12);
  const double speed = 1 + 0.15;
  EXPECT_NEAR(rig.StateAt(2)[2], speed, 1e-12);
  EXPECT_NEAR(rig.StateAt(3)[2], speed - 0.95 * 0.15, 1e-12);
  EXPECT_NEAR(rig.StateAt(3)[0], rig.StateAt(2)[0] + 0.15 * speed, 1e-12) << "without the plan's control";
  EXPECT_NEAR(rig.StateAt(4)[2], speed - 1.95 * 0.15, 1e-12);
  EXPECT_EQ(rig.StateAt(10)[2], 0);
  EXPECT_EQ(rig.First(execution_event_t::EMERGENCY_STOP).value, 8) << "1.15 by 0.15";
}

TEST(RobotSim, WhatItMeetsWhileItStopsIsAContact) {
  Config config = TaskWithBrake();
  config.robot.start = {0, 0, 1, 0};
  config.obstacles = {Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 0.4)};
  certified_plan_t plan = Plan(config, 1, 1, config.robot.start);
  plan.slice_upper[1][0] = 0;
  DrivingRig rig(2, plan, config);
  EXPECT_LT(rig.StateAt(2)[0], 0.4);
  EXPECT_EQ(rig.Count(kContact), 0);
  rig.RunTo(9);
  EXPECT_GT(rig.Count(kContact), 0);
  EXPECT_GT(rig.StateAt(9)[0], 0.4);
}

TEST(RobotSim, ANewPlanMayTakeOverWhileItStops) {
  Config config = TaskWithBrake();
  config.robot.start = {0, 0, 1, 0};
  DrivingRig rig(2, Plan(config, 1, 1, config.robot.start, 1), config);
  EXPECT_EQ(rig.Count(kStanding), 1) << "the plan ends in motion";
  const std::vector<double> then{rig.StateAt(2)[0] + 0.15 * rig.StateAt(2)[2], 0, rig.StateAt(2)[2] - 0.15, 0};
  rig.Send(Plan(config, 2, 3, then, 2));
  rig.RunTo(4);
  EXPECT_EQ(rig.Count(kStarted), 2);
  EXPECT_NEAR(rig.StateAt(4)[2], then[2] + 0.15, 1e-12) << "its control, and no brake";
}

TEST(RobotSim, AtTheGoalItFinishesItsTailAndStartsNothingMore) {
  Config config = PointMassTask();
  config.planner.goal = {0.1, 0};
  config.planner.goal_radius = 0.09;
  DrivingRig rig(3, config);
  rig.Send(Plan(config, 2, 4, kOrigin));
  rig.RunTo(30);
  EXPECT_EQ(rig.Count(kGoalReached), 1);
  const execution_event_t& reached = rig.First(kGoalReached);
  EXPECT_EQ(reached.utime, BoundaryTime(2)) << "the position is 0.01125 after a step";
  EXPECT_NEAR(reached.value, 0.1 - 0.01125, 1e-12);
  EXPECT_EQ(reached.plan_id, 1);
  EXPECT_EQ(rig.Count(kStarted), 1);
  EXPECT_EQ(rig.First(kStanding).utime, BoundaryTime(5));
  ASSERT_EQ(rig.states.size(), 5u + RobotSimNode::kFinishedBoundaries);
  for (std::size_t j = 0; j < rig.states.size(); ++j)
    EXPECT_EQ(rig.states[j].mode == robot_state_t::FINISHED, j >= 5) << j;
  EXPECT_TRUE(rig.node().done());
  const auto summary = rig.Summary();
  EXPECT_THAT(summary, Holds({{"goal_reached", true}, {"stops", 0}}));
  EXPECT_NEAR(summary["distance_to_goal"].get<double>(), 0.01, 1e-9);
}

TEST(RobotSim, TakesADistanceEqualToTheGoalRadiusAsReached) {
  for (const bool inside : {true, false}) {
    Config config = PointMassTask();
    config.planner.goal = {3, 4};
    config.planner.goal_radius = inside ? 5 : std::nextafter(5, 0);
    Rig rig(config);
    rig.RunTo(20);
    EXPECT_EQ(rig.Count(kGoalReached), inside ? 1 : 0);
    EXPECT_EQ(rig.node().done(), inside);
  }
}

TEST(RobotSim, AfterTheTimeLimitItStandsAndIsDone) {
  Config config = PointMassTask();
  config.robot.time_limit_s = 0.12;  // boundary 3
  DrivingRig rig(2, Plan(config, 1, 2, kOrigin), config);
  EXPECT_FALSE(rig.node().done());
  rig.RunTo(40);
  EXPECT_EQ(rig.First(kStanding).utime, BoundaryTime(6)) << "the certified tail is run to its end";
  EXPECT_FIELDS(rig, (states.size(), 6u + RobotSimNode::kFinishedBoundaries),
                (states[5].mode, robot_state_t::EXECUTING), (states[6].mode, robot_state_t::FINISHED));
  EXPECT_TRUE(rig.node().done());
  EXPECT_EQ(rig.Summary()["goal_reached"], false);
}

TEST(RobotSim, ReportsContactAtEveryBoundaryInsideAnObstacle) {
  Config config = PointMassTask();
  config.obstacles = {Obstacle::Circle(Eigen::Vector2d(50, 0), 1), Obstacle::Circle(Eigen::Vector2d(1, 0), 0.96)};
  DrivingRig rig(4, config);
  ASSERT_EQ(rig.Count(kContact), 2) << "positions 0, 0, 0.011, 0.045, 0.079";
  EXPECT_EQ(rig.First(kContact).utime, BoundaryTime(3));
  EXPECT_NEAR(rig.First(kContact).value, 1 - 0.045 - 0.96, 1e-12);
  EXPECT_EQ(GetText(rig.First(kContact).message), "inside obstacle 1");
  EXPECT_EQ(rig.Summary()["contacts"], 2);
}

// The plan goes forward for two steps and back for two: vx is 0, 0.15, 0.3, 0.15, 0 from boundary 1 on.
TEST(RobotSim, ReportsLimitsThatDoNotHoldAtABoundaryOrWithItsControl) {
  Config config = PointMassTask();
  Own(config.problem).limits = {{.name = "speed", .that = {"vx", 1, 1}, .at_most = 0.2},
                                {.name = "braking", .that = {"ax", 1, 1}, .at_least = -0.75},
                                {.name = "force", .that = {"ax", 1, 1}, .at_least = -1, .at_most = 1}};
  DrivingRig rig(8, config);
  std::vector<std::string> reported;
  std::vector<std::int64_t> times;
  for (const execution_event_t& event : rig.events)
    if (event.kind == execution_event_t::LIMIT_EXCEEDED) {
      reported.emplace_back(GetText(event.message));
      times.push_back(event.utime);
      EXPECT_NEAR(event.value, reported.size() == 1 ? 0.1 : 0.25, 1e-12);
    }
  ASSERT_EQ(reported.size(), 3u);
  EXPECT_THAT(reported[0], AllOf(StartsWith("speed is 0.0999"), EndsWith(" beyond its bound")));
  EXPECT_EQ(reported[1], "braking is 0.25 beyond its bound");
  EXPECT_THAT(times, ElementsAre(BoundaryTime(3), BoundaryTime(4), BoundaryTime(5)));
  EXPECT_FIELDS(rig, (Summary()["limits_exceeded"], 3), (Summary()["contacts"], 0));
}

TEST(RobotSim, ReportsContactOfPartsAtExpressions) {
  Config config = PointMassTask();
  Own(config.problem).body.parts = {BodyPart{{}, 0.25, {{{"px + 1"}, {"py"}}}}};
  config.obstacles = {Obstacle::Circle(Eigen::Vector2d(1, 0.5), 0.125), Obstacle::Circle(Eigen::Vector2d(1, 0.3), 0.1),
                      Obstacle::Circle(Eigen::Vector2d(0, 0), 0.1)};
  Rig rig(config);
  rig.RunTo(1);
  EXPECT_EQ(rig.Summary()["contacts"], 2);
  EXPECT_EQ(GetText(rig.First(kContact).message), "part 0 meets obstacle 1");
}

TEST(RobotSim, ReportsContactWithAnObstacleOfTheBusThatAppearsOnTheWay) {
  Config config = PointMassTask();
  config.gate.obstacles = ObstaclesSource::kBus;
  DrivingRig rig(2, config);
  rig.Publish("OBSTACLES", ToMessage({Obstacle::Circle(Eigen::Vector2d(1, 0), 0.96)}, BoundaryTime(2)));
  rig.RunTo(4);
  EXPECT_EQ(rig.Count(kContact), 2) << "as with one of the file";
  EXPECT_EQ(rig.First(kContact).utime, BoundaryTime(3));
}

TEST(RobotSim, BulgesBetweenItsSamplesWhileItMoves) {
  Config config = PointMassTask();
  Own(config.problem).between = Between{Eigen::Vector2d(0, 4), 0, 0, 0.15};
  const double bulge = 4 * 0.15 * 0.15 / 8;  // at 0, 0.011 and 0.045 the middles of steps are at 0.0055 and 0.028
  config.obstacles = {Obstacle::Circle(Eigen::Vector2d((0.01125 + 0.045) / 2, 1 + bulge - 1e-9), 1)};
  DrivingRig rig(9, config);
  ASSERT_EQ(rig.Count(kContact), 1);
  EXPECT_EQ(rig.First(kContact).utime, BoundaryTime(3));
  EXPECT_NEAR(rig.First(kContact).value, -1e-9, 1e-12);
  EXPECT_EQ(GetText(rig.First(kContact).message), "inside obstacle 0, 0.5 of a step after the last sample");
}

TEST(RobotSim, ALateTickGivesTheSameRun) {
  const Config config = PointMassTask();
  Rig prompt(config), late(config);
  certified_plan_t certified = Plan(config, 1, 1, kOrigin);
  certified.expires_utime = BoundaryTime(4);
  for (Rig* rig : {&prompt, &late}) {
    rig->RunTo(0);
    rig->Send(certified);
    rig->RunTo(12, rig == &prompt ? 500 : 13 * kPeriod / 4);
  }
  ASSERT_EQ(late.states.size(), 10u) << "the fourth late tick is at boundary 9.8";
  for (int j = 0; j < 10; ++j) {
    EXPECT_EQ(prompt.StateAt(j), late.StateAt(j)) << j;
    EXPECT_EQ(late.states[static_cast<std::size_t>(j)].utime, BoundaryTime(j));
  }
}

TEST(RobotSim, DoesNotStartAPlanThatExpiredWhileItWasHeldUp) {
  const Config config = PointMassTask();
  RunningRig rig(config);
  rig.Send(Plan(config, 1, 1, kOrigin));
  rig.RunTo(12, 13 * kPeriod / 4);
  EXPECT_EQ(rig.Count(kStarted), 0);
  EXPECT_EQ(rig.Summary()["plans_refused"]["expired"], 1);
}

TEST(RobotSim, ExecutesOnTheTargetNotOnTheNominalModel) {
  Config config = PointMassTask();
  const Problem problem = LargeBicycle(MakeKinematicBicycle(0.1, 2.5));
  config.problem = std::make_shared<const Problem>(problem);
  config.robot.start = {0, 0, 0, 20, 1, 0.3};
  config.robot_residual = ResidualOf(*problem.model, ResidualNamed("heading_saturation"));
  DrivingRig rig(4, Plan(config, 1, 1, config.robot.start, 2), config);
  std::vector<double> expected = config.robot.start;
  const std::unique_ptr<Target> target = MakeTarget(config);
  for (const double jerk : {1.0, -1.0}) target->Step(expected, std::array{jerk, 0.0}, expected);
  const execution_event_t& standing = rig.First(kStanding);
  EXPECT_EQ(std::vector<double>(standing.state, standing.state + 6), expected);
  expected[3] = expected[4] = 0;
  EXPECT_EQ(rig.StateAt(4), expected) << "at rest: v = a = 0, heading and steering kept";
}

TEST(RobotSim, APlanThatLeavesItsDomainIsRefused) {
  const Config config = PointMassTask();
  certified_plan_t certified = Plan(config, 1, 1, kOrigin);
  certified.slice_upper[1][0] = 1e9;
  DrivingRig rig(3, certified, config);
  EXPECT_EQ(rig.Summary()["plans_refused"]["outside_domain"], 1);
  EXPECT_EQ(rig.Count(kStarted), 0);
}

// With keys, over the same bus as everybody: only the certifier's word counts.
TEST(RobotSim, APlanThatAnotherRoleSignedIsNotExecuted) {
  Config config = PointMassTask();
  config.bus.url = "memq://";
  config.bus.keys = TestKeys();
  std::int64_t now = kT0;
  const auto bus = OpenSignedBus("memq://", TestKeys(), config.bus.bus_name(), {{config.bus.certified, Role::kPlanner}},
                                 [&] { return now; });  // the thief's
  std::ostringstream out;
  RobotSimNode node(config, *bus, out);
  for (int j = 0; j < 4; ++j, now += kPeriod) {
    if (j == 1) bus->Publish(config.bus.certified, Bytes(Sealed(Plan(config, 1, 2, kOrigin))));
    bus->Dispatch(0);
    node.Tick(now);
  }
  const auto summary = nlohmann::json::parse(node.Summary());
  EXPECT_EQ(summary["plans_refused"]["forged"], 1) << "the guard looks by itself";
  EXPECT_EQ(summary["plans_started"], 0);
}

// The plant is told the true states. The goal is out of the true position's reach, and not of the measured one's.
TEST(RobotSim, MeasuresWithItsSensorErrorAndDrivesByTheTruth) {
  for (const std::string kind : {"none", "random", "adversarial"}) {
    SCOPED_TRACE(kind);
    Config config = PointMassTask();
    Problem& problem = Own(config.problem);
    problem.declaration.state_error = Eigen::Vector4d(0.02, 0.02, 0.01, 0);
    config.robot.sensor_error = kind;
    config.planner.goal = {0.021, 0};
    config.planner.goal_radius = 0.0205;
    std::vector<std::vector<double>> truth;
    const std::unique_ptr<Target> target = MakeTarget(config);
    Rig rig(config, [&](auto x, auto u, auto next, double) {
      target->Step(x, u, next);
      truth.emplace_back(next.begin(), next.end());
    });
    rig.RunTo(40);
    EXPECT_EQ(rig.Count(kGoalReached), 0);
    rig.Send(Plan(config, 1, 42, {0, 0, 0, 0}));
    rig.RunTo(45);
    ASSERT_EQ(rig.Count(kStarted), 1);
    ASSERT_EQ(truth.size(), 3u);
    double largest = 0;
    for (int j = 0; j <= 45; ++j) {
      const std::vector<double> measured = rig.StateAt(j), at_rest(4, 0.0);
      const std::vector<double>& is = j > 42 ? truth[static_cast<std::size_t>(j - 43)] : at_rest;
      for (std::size_t k = 0; k < 4; ++k)
        EXPECT_LE(std::abs(measured[k] - is[k]), problem.declaration.state_error[static_cast<int>(k)]) << j;
      largest = std::max(largest, std::abs(measured[0] - is[0]));
    }
    EXPECT_FIELDS(rig.transitions[0], (state[0], rig.StateAt(42)[0]), (next_state[0], rig.StateAt(43)[0]));
    EXPECT_EQ(rig.Count(kInside), 3);
    if (kind == "none")
      EXPECT_EQ(largest, 0);
    else
      EXPECT_GT(largest, 0.019);
  }
}

// The plant is told the inputs that act, all others those of the plan.
TEST(RobotSim, ActsWithItsInputErrorAndReportsThePlansInputs) {
  for (const std::string kind : {"none", "random", "adversarial"}) {
    SCOPED_TRACE(kind);
    Config config = PointMassTask();
    Own(config.problem).declaration.input_error = Eigen::Vector2d(0.25, 0);
    config.robot.input_error = kind;
    std::vector<std::vector<double>> acted;
    Rig rig(config, [&](auto x, auto u, auto next, double) {
      acted.emplace_back(u.begin(), u.end());
      std::ranges::copy(x, next.begin());
    });
    rig.RunTo(40);
    rig.Send(Plan(config, 1, 42, {0, 0, 0, 0}));
    rig.RunTo(45);
    ASSERT_EQ(acted.size(), rig.transitions.size());
    ASSERT_GE(acted.size(), 1u);
    double largest = 0;
    for (std::size_t i = 0; i < acted.size(); ++i) {
      EXPECT_FIELDS(rig.transitions[i], (input[0], i < 2 ? 1 : -1), (input[1], acted[i][1]));
      largest = std::max(largest, std::abs(acted[i][0] - rig.transitions[i].input[0]));
    }
    EXPECT_LE(largest, 0.25);
    if (kind == "none")
      EXPECT_EQ(largest, 0);
    else
      EXPECT_GT(largest, kind == "random" ? 0.01 : 0.2499);
  }
}

TEST(RobotSim, StopPrintsOneLineOfJson) {
  Rig rig(PointMassTask());
  rig.RunTo(2);
  rig.node().Stop();
  const std::string text = rig.printed();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
  const auto summary = nlohmann::json::parse(text);
  for (const char* key : {"boundaries", "steps_executed", "steps_inside_slice", "steps_consistent", "contacts",
                          "limits_exceeded", "goal_reached", "distance_to_goal", "stops", "plans_accepted",
                          "plans_started", "plans_refused", "messages_not_sent"})
    EXPECT_TRUE(summary.contains(key)) << key;
  EXPECT_THAT(summary, Holds({{"boundaries", 3}, {"distance_to_goal", 100}}));
}

TEST(RobotSim, AConfigThatDoesNotFitTheModelIsAnError) {
  const std::unique_ptr<Bus> bus = OpenBus("memq://");
  Config config = PointMassTask();
  config.robot.start.pop_back();
  EXPECT_THROW(RobotSimNode(config, *bus), ConfigError);
  config = PointMassTask();
  config.planner.goal.push_back(0);
  EXPECT_THROW(RobotSimNode(config, *bus), ConfigError);
  config = PointMassTask();
  config.robot_residual = ResidualOf(*MakeKinematicBicycle(0.1, 2.5), ResidualNamed("heading_saturation"));
  EXPECT_THROW(RobotSimNode(config, *bus), ConfigError);
}

// A bicycle that turns left from a heading just below pi.
Config TurningTask() {
  Config config = PointMassTask();
  Problem problem = LargeBicycle(MakeKinematicBicycle(0.1, 2, {2}));
  problem.body.heading = 2;
  problem.between = Between{Eigen::Vector2d(1, 1), 0.7, 1, 0.1};
  config.problem = std::make_shared<const Problem>(problem);
  config.robot.start = {0, 0, 3.1, 2, 0, 0.5};
  return config;
}

// Slices of +- 1e-6 around the motion, in which the heading goes on beyond pi.
certified_plan_t TurningPlan(const Config& config, int steps) {
  certified_plan_t certified = Plan(config, 1, 1, config.robot.start, steps);
  certified.plan.progress_steps = static_cast<std::int16_t>(steps);
  std::array<double, 8> z{};
  std::ranges::copy(config.robot.start, z.begin());
  for (int t = 0; t <= steps; ++t) {
    for (std::size_t k = 0; k < 6; ++k) {
      certified.slice_lower[t][k] = z[k] - 1e-6;
      certified.slice_upper[t][k] = z[k] + 1e-6;
    }
    if (t < steps) certified.plan.control[t][0] = 0;
    std::array<double, 6> next;
    config.problem->model->Evaluate(z, next);
    std::ranges::copy(next, z.begin());
  }
  return certified;
}

TEST(RobotSim, WrapsItsAnglesAndStaysInItsSlices) {
  constexpr int kSteps = 30;
  const Config config = TurningTask();
  const certified_plan_t certified = TurningPlan(config, kSteps);
  ASSERT_GT(certified.slice_lower[kSteps][2], 4.5) << "it turns far beyond pi";
  Rig rig(config);
  rig.Send(certified);
  rig.RunTo(kSteps + 2);
  EXPECT_EQ(rig.Count(kInside), kSteps);
  EXPECT_EQ(rig.Count(kLeft), 0);
  EXPECT_EQ(rig.Count(kContact), 0);
  bool is_wrapped = false;
  for (const robot_state_t& state : rig.states) {
    EXPECT_LE(std::abs(state.state[2]), 3.2);
    is_wrapped |= state.state[2] < 0;
  }
  EXPECT_TRUE(is_wrapped);

  // What it reports are observations of no residual.
  ASSERT_EQ(rig.transitions.size(), static_cast<std::size_t>(kSteps));
  Transitions data{Eigen::MatrixXd(kSteps, 8), Eigen::MatrixXd(kSteps, 6)};
  for (int i = 0; i < kSteps; ++i) {
    const transition_t& step = rig.transitions[static_cast<std::size_t>(i)];
    for (int k = 0; k < 6; ++k) data.z(i, k) = step.state[k], data.x_next(i, k) = step.next_state[k];
    for (int k = 0; k < 2; ++k) data.z(i, 6 + k) = step.input[k];
  }
  const Observations observations = Observe(*config.problem->model, data);
  for (int i = 0; i < kSteps; ++i) {
    EXPECT_LE(observations.lower(i, 2), 0);
    EXPECT_GE(observations.upper(i, 2), 0) << "within the unit of an angle";
  }
}

TEST(RobotSim, WithoutAnglesTheSameRobotLeavesItsSlices) {
  Config config = TurningTask();
  const certified_plan_t certified = TurningPlan(config, 30);
  certified_plan_t wrapped = certified;
  for (int t = 0; t <= 30; ++t)
    for (double* const end : {&wrapped.slice_lower[t][2], &wrapped.slice_upper[t][2]}) *end -= 2 * std::numbers::pi;
  wrapped.plan.initial_center[2] -= 2 * std::numbers::pi;
  for (const bool has_angles : {true, false}) {
    Problem& problem = Own(config.problem);
    if (!has_angles) problem.model = MakeKinematicBicycle(0.1, 2);
    Rig rig(config);
    rig.Send(wrapped);
    rig.RunTo(5);
    EXPECT_EQ(rig.Count(kStarted), has_angles ? 1 : 0);
    EXPECT_EQ(rig.Count(kRefused), has_angles ? 0 : 1);
  }
}

// Otherwise what it reports of a step would contradict a true declaration.
TEST(RobotSim, AStepLastsAsLongAsTheClockSays) {
  for (const bool looks_at_time : {true, false}) {
    Config config = PointMassTask();
    config.gate.step_error_ms = looks_at_time ? 5.0 : kAnyTime;
    std::vector<double> longer;
    Rig rig(config, [&](auto x, auto, auto next, double by) {
      std::ranges::copy(x, next.begin());
      longer.push_back(by);
    });
    rig.RunTo(0);
    rig.Send(Plan(config, 1, 1, kOrigin));
    for (const auto& [j, late_us] : {std::pair(1, 300), {2, 1700}, {3, 500}}) rig.TickLate(j, late_us);
    ASSERT_EQ(rig.transitions.size(), 2u);
    EXPECT_FIELDS(rig, (transitions[0].duration_us, kPeriod + 1400), (transitions[1].duration_us, kPeriod - 1200));
    EXPECT_THAT(longer, looks_at_time ? ElementsAre(1400 * 1e-6, -1200 * 1e-6) : ElementsAre(0.0, 0.0));
  }
}

TEST(RobotSim, HoldsEachPlanToTheStepErrorOfItsTask) {
  const ScratchDirectory scratch;
  const std::string path = scratch / "task.yaml";
  const auto write = [&](const std::string& step_error_ms) {
    std::string text = Read(FOREREACH_SOURCE_DIR "/config/point_mass.yaml");
    text = std::regex_replace(text, std::regex("data/"), FOREREACH_SOURCE_DIR "/config/data/");
    text = std::regex_replace(text, std::regex("step_error_ms: any"),
                              "start: [0, 0, 0, 0]\n  step_error_ms: " + step_error_ms);
    std::ofstream(path) << text;
    Config config = LoadConfig(path);
    config.robot.step_period_ms = 40;
    return config;
  };
  Rig rig(write("10"));
  int at = 0;
  const auto reload = [&] {
    rig.Publish("COMMAND", command_t{.utime = BoundaryTime(at), .kind = command_t::RELOAD});
    rig.RunTo(++at);
    while (reloads_under_way > 0) std::this_thread::yield();
    rig.RunTo(++at);
  };
  std::int64_t id = 0;
  for (const auto& [step_error_ms, late_us, kind] :
       {std::tuple("12", 12'000, kStarted), {"12", 12'001, kRefused}, {"10", 10'001, kRefused}}) {
    const Config config = write(step_error_ms);
    reload();
    certified_plan_t plan = Plan(config, ++id, ++at, config.robot.start, 2);
    for (int t = 0; t <= plan.plan.num_steps; ++t)
      for (int k = 0; k < plan.plan.num_states; ++k) {
        plan.slice_lower[t][k] = config.problem->domain.state.lower()[k];
        plan.slice_upper[t][k] = config.problem->domain.state.upper()[k];
      }
    rig.Send(plan);
    rig.TickLate(at, late_us);
    ASSERT_FALSE(rig.events.empty());
    EXPECT_EQ(rig.events.back().kind, kind) << late_us << ": " << GetText(rig.events.back().message);
    rig.RunTo(at += 3);
  }
}

}  // namespace forereach::sim_node_test
