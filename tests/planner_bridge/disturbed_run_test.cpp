// Planner, certifier and simulated robot on one bus and a simulated clock; every step of the robot is disturbed.
#include "tests/test.h"

#include "certifier/process/certifier_node.h"
#include "forereach/execution_event_t.hpp"
#include "planner_bridge/planner_node.h"
#include "simulator/sim_node.h"
#include "tests/planner_bridge/tasks.h"

namespace forereach::disturbed_run_test {

// X0 of a candidate leaves room for the two steps until it starts.
Config Task(const std::string& disturbance, int seed, bool grows = false) {
  Config config = Bicycle();
  Problem& problem = Own(config.problem);
  problem.declaration.disturbance = Vec({0.002, 0.002, 0.0005, 0.004, 0, 0});
  if (grows) {
    problem.declaration.disturbance.setZero();
    problem.declaration.growing =
        Growing(*problem.model, {"0.0004*v", "0.0004*v", "0.0005*abs(v*delta)", "0.002 + 0.001*abs(jerk)", "0", "0"});
  }
  config.robot.disturbance = disturbance;
  config.robot.disturbance_seed = seed;
  config.robot.step_period_ms = 100;  // model.dt: other steps are not learned
  config.robot.time_limit_s = 100;
  config.planner.initial_half_width = {0.06, 0.06, 0.012, 0.04, 0.01, 0.002};
  config.planner.candidates = 8;
  config.gate.obstacles = ObstaclesSource::kTask;
  problem.rest = {{3, 0.5}};
  const auto target = MakeTarget(config);
  Disturbance of_data(problem.declaration, config.robot);
  problem.transitions = MakeTransitions(*target, problem, 1, 400, {}, {}, &of_data);
  config.grounds = GroundsOf(DigestOf(std::string_view("disturbed run")), *config.problem, config.obstacles);
  return config;
}

struct Ending {
  nlohmann::json robot, planner;
  int faults = 0;
};

Ending Drive(const Config& config) {
  std::int64_t now = 1'700'000'000'000'000;
  const Clock clock = [&] { return now; };
  const std::unique_ptr<Bus> bus = OpenBus("memq://", clock);
  std::ostringstream out;
  Ending run;
  bus->Subscribe(config.bus.fault, [&](const Received&) { ++run.faults; });
  CertifierNode certifier(config, *bus, {clock, clock});
  PlannerNode planner(config, *bus, out);
  RobotSimNode robot(config, *bus, out);
  for (const std::int64_t end = now + 102'000'000; now < end && !robot.done(); now += 1000)
    for (Node* node : std::initializer_list<Node*>{&robot, &planner, &certifier}) {
      node->Tick(now);
      while (bus->Dispatch(0) > 0) {
      }
    }
  run.robot = nlohmann::json::parse(robot.Summary());
  run.planner = nlohmann::json::parse(planner.Summary());
  return run;
}

class DisturbedRun : public testing::TestWithParam<std::tuple<std::string, int, bool>> {};

TEST_P(DisturbedRun, StaysInItsSlicesAndClear) {
  const auto [disturbance, seed, grows] = GetParam();
  const Ending run = Drive(Task(disturbance, seed, grows));
  SCOPED_TRACE(run.robot.dump() + run.planner.dump());
  EXPECT_EQ(run.robot["contacts"], 0);
  EXPECT_GT(run.robot["steps_executed"], 60);
  EXPECT_FIELDS(run, (robot["steps_inside_slice"], run.robot["steps_executed"]), (robot["goal_reached"], true));
  EXPECT_EQ(run.faults, 0) << "learned transitions and measured states agree with the declaration";
}

INSTANTIATE_TEST_SUITE_P(Kinds, DisturbedRun,
                         testing::Values(std::tuple("random", 1, false), std::tuple("adversarial", 1, false),
                                         std::tuple("adversarial", 2, false), std::tuple("adversarial", 3, true)));

// The robot of the task without disturbances, whose sensors err.
Config MeasuredTask(const std::string& sensor_error, int seed) {
  Config config = Task("none", seed);
  Problem& problem = Own(config.problem);
  problem.declaration.disturbance.setZero();
  problem.declaration.state_error = Vec({0.02, 0.02, 0.004, 0.02, 0, 0.01});
  problem.declaration.given_are_exact = true;
  config.robot.sensor_error = sensor_error;
  config.planner.initial_half_width = {0.05, 0.06, 0.012, 0.045, 0.01, 0.022};
  config.gate.learns = false;  // its transitions are measured, too
  config.grounds = GroundsOf(DigestOf(std::string_view("measured run")), *config.problem, config.obstacles);
  return config;
}

class MeasuredRun : public testing::TestWithParam<std::pair<std::string, int>> {};

TEST_P(MeasuredRun, LeavesNoSliceAndStaysClear) {
  const auto [sensor_error, seed] = GetParam();
  const Ending run = Drive(MeasuredTask(sensor_error, seed));
  SCOPED_TRACE(run.robot.dump() + run.planner.dump());
  EXPECT_EQ(run.robot["contacts"], 0);
  EXPECT_GT(run.robot["steps_executed"], 60);
  const int inside = run.robot["steps_inside_slice"], consistent = run.robot["steps_consistent"];
  EXPECT_EQ(inside + consistent, run.robot["steps_executed"]);
  EXPECT_FIELDS(run, (robot["goal_reached"], true), (faults, 0));
}

INSTANTIATE_TEST_SUITE_P(Kinds, MeasuredRun,
                         testing::Values(std::pair("random", 1), std::pair("adversarial", 1),
                                         std::pair("adversarial", 2)));

// A car that stands before a post and cannot turn away from it.
Config DeadEnd() {
  Config config = Bicycle();
  Problem& problem = Own(config.problem);
  Eigen::VectorXd lower = problem.domain.state.lower();
  lower[3] = -2;
  problem.domain.state = Box(lower, problem.domain.state.upper());
  config.obstacles = {Obstacle::Circle(Vec({3, 0.5}), 1.5)};
  config.planner.goal = {30, 0};
  config.gate.obstacles = ObstaclesSource::kTask;
  config.planner.candidates = 4;
  config.robot.step_period_ms = 100;
  config.robot.time_limit_s = 100;
  config.grounds = GroundsOf(DigestOf(std::string_view("dead end")), *config.problem, config.obstacles);
  return config;
}

TEST(DeadEnd, ACarThatMayBackOffLeavesItAndReachesItsGoal) {
  Config config = DeadEnd();
  config.laws.back_off = {{"(min(max((-1.2 - v)/0.6, -1.5), 0.85) - a)/dt"}, {"-delta/dt"}};
  const Ending run = Drive(config);
  SCOPED_TRACE(run.robot.dump() + run.planner.dump());
  EXPECT_FIELDS(run, (robot["goal_reached"], true), (robot["contacts"], 0));
  EXPECT_GE(run.planner["back_off_rounds"], 1);
  EXPECT_EQ(run.faults, 0);
}

TEST(DeadEnd, ACarThatMayNotStaysInIt) {
  Config config = DeadEnd();
  config.robot.time_limit_s = 10;
  const Ending run = Drive(config);
  SCOPED_TRACE(run.robot.dump() + run.planner.dump());
  EXPECT_FIELDS(run, (robot["goal_reached"], false), (robot["contacts"], 0), (planner["back_off_rounds"], 0));
  EXPECT_GT(run.planner["rounds_without_certificate"], PlannerNode::kLostRounds);
}

// A certifier that knows nothing of the disturbance stops the robot: its data contradict each other.
TEST(UndeclaredDisturbance, StopsTheRobotBecauseItsDataContradictTheDeclaration) {
  Config config = Task("adversarial", 1);
  Problem told = *config.problem;
  told.declaration.disturbance.setZero();
  EXPECT_TRUE(Certifier(std::make_shared<const Problem>(told)).violation());
}

}  // namespace forereach::disturbed_run_test
