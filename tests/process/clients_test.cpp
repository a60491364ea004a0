// A planner's and a robot's end of the bus, as their users have them: the programs of examples/ against the certifier's
// process, and what either end refuses.
#include "tests/test.h"

#include "clients/planner_client.h"
#include "clients/robot_client.h"
#include "tests/keys.h"
#include "tests/process/process_fixture.h"

namespace forereach::clients_test {

using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const std::string kMower = FOREREACH_SOURCE_DIR "/examples/mower/";

// The commands of its README.
TEST(Mower, ItsTransitionsAreThoseOfItsBag) {
  const ScratchDirectory scratch;
  const std::string out = scratch / "transitions.csv";
  ChildProcess import({FOREREACH_PROGRAM,
                       "import",
                       "--config",
                       kMower + "mower.yaml",
                       "--out",
                       out,
                       "--time",
                       "field.header.stamp",
                       "--time-unit",
                       "ns",
                       "--tolerance-ms",
                       "3",
                       "--state",
                       "x=field.pose.pose.position.x",
                       "--state",
                       "y=field.pose.pose.position.y",
                       "--state",
                       "theta=yaw_of(field.pose.pose.orientation.z,field.pose.pose.orientation.w)",
                       "--state",
                       "v=field.twist.twist.linear.x",
                       "--state",
                       "omega=field.twist.twist.angular.z",
                       "--inputs-from",
                       kMower + "cmd_vel.csv",
                       "--inputs-time",
                       "%time",
                       "--input",
                       "v_cmd=field.linear.x",
                       "--input",
                       "omega_cmd=field.angular.z",
                       kMower + "odom.csv"});
  ASSERT_EQ(import.WaitForExit(), 0) << import.error();
  const auto text = [](const std::string& path) {
    std::ifstream file(path);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  EXPECT_EQ(text(out), text(kMower + "transitions.csv"));
}

TEST(Mower, ItsPlannerTakesItsRobotToTheGoalInCertifiedPlans) {
  const ScratchDirectory scratch;
  const std::string task = kMower + "mower.yaml";
  const std::string keys = MakeTestKeys(scratch / "keys"), url = PrivateBusUrl();
  ChildProcess certifier(
      {FOREREACH_CERTIFIER, "--config", task, "--lcm-url", url, "--key", keys, "--state", scratch / "state"});
  ASSERT_TRUE(certifier.WaitForLog("ready on")) << certifier.error();
  ChildProcess robot({FOREREACH_OWN_ROBOT, task, keys, url});
  ChildProcess planner({FOREREACH_OWN_PLANNER, task, "0.8", "0.8", keys, url});
  ASSERT_EQ(planner.WaitForExit(std::chrono::minutes(2)), 0) << planner.output() << planner.error();
  EXPECT_THAT(planner.output(), testing::ContainsRegex("at the goal after [0-9]+ certified plans"));
  EXPECT_EQ(robot.Terminate(), 0) << robot.error();
  int boundaries = 0, steps = 0, inside = 0;
  ASSERT_EQ(std::sscanf(robot.output().c_str(), "%d boundaries, %d steps, %d inside", &boundaries, &steps, &inside), 3);
  EXPECT_GT(steps, 32) << "more than one plan";
  EXPECT_EQ(inside, steps);
}

// A client on a bus where the test speaks as everybody else.
class PlannerClientTest : public testing::Test {
 protected:
  const ScratchDirectory scratch_;
  const std::string path_ = scratch_.Write("task.yaml", PatientTask());
  BusProbe probe_{PrivateBusUrl(), {"PLAN_CANDIDATE"}};
  PlannerClient planner_{{path_, "", PrivateBusUrl()}, "tester"};
  const CandidateStart start_{WallClockUs(), Eigen::Vector4d::Zero(), Eigen::Vector4d::Constant(0.01)};
};

TEST_F(PlannerClientTest, SendsWhatTheTaskSaysWithPlanIdsThatGrow) {
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Random(2, 5);
  const std::int64_t first = planner_.Propose(controls, start_, {.progress_steps = 3, .repair = true});
  EXPECT_EQ(planner_.Propose(controls, start_), first + 1);
  EXPECT_NEAR(static_cast<double>(first), static_cast<double>(WallClockUs()), 60e6) << "ids grow over restarts";
  ASSERT_TRUE(probe_.WaitUntil([&] { return probe_.heard("PLAN_CANDIDATE").size() == 2; }));
  const auto heard = probe_.Heard<candidate_plan_t>("PLAN_CANDIDATE");
  EXPECT_EQ(ControlsOf(heard[0]), controls);
  EXPECT_EQ(heard[0].step_us, planner_.step_us());
  EXPECT_EQ(GetText(heard[0].source), "tester");
  EXPECT_EQ(std::tuple(heard[0].sequence, heard[0].progress_steps, heard[0].repair), std::tuple(0, 3, 1));
  EXPECT_EQ(std::tuple(heard[1].sequence, heard[1].progress_steps, heard[1].repair), std::tuple(1, 5, 0));
}

TEST_F(PlannerClientTest, RefusesWhatDoesNotFitAndSendsNothingOfIt) {
  const Eigen::MatrixXd fits = Eigen::MatrixXd::Zero(2, 5);
  const auto refusal = [&](const Eigen::MatrixXd& controls, CandidateStart start, CandidateRequest request = {}) {
    try {
      planner_.Propose(controls, start, request);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal(Eigen::MatrixXd::Zero(3, 5), start_), "plan: 3 inputs, the model has 2");
  EXPECT_THAT(refusal(Eigen::MatrixXd::Zero(2, kMaxSteps + 1), start_), HasSubstr("129 steps"));
  EXPECT_THAT(refusal(Eigen::MatrixXd(2, 0), start_), HasSubstr("0 steps"));
  EXPECT_THAT(refusal(Eigen::MatrixXd::Constant(2, 5, kNan), start_), HasSubstr("finite"));
  EXPECT_THAT(refusal(fits, start_, {.progress_steps = 6}), HasSubstr("progress_steps: 6"));
  EXPECT_THAT(refusal(fits, start_, {.progress_steps = -1}), HasSubstr("progress_steps: -1"));
  EXPECT_THAT(refusal(fits, {1, Eigen::VectorXd::Zero(17), start_.half_width}), HasSubstr("17 and 4 entries"));
  EXPECT_THAT(refusal(fits, {1, start_.center, Eigen::Vector4d::Constant(-1)}), HasSubstr("not negative"));
  EXPECT_THAT(refusal(fits, {1, Eigen::Vector4d::Constant(kNan), start_.half_width}), HasSubstr("finite"));
  const std::vector<Eigen::MatrixXd> many(31, Eigen::MatrixXd::Zero(2, 128));
  EXPECT_THROW(planner_.ProposeMany(many, start_), std::invalid_argument);
  EXPECT_THROW(planner_.ProposeMany({}, start_), std::invalid_argument);
  EXPECT_THROW((void)planner_.Decisions(kNan), std::invalid_argument);
  EXPECT_THROW(PlannerClient({path_, "", "memq://"}, std::string(32, 'x')), std::invalid_argument);
  EXPECT_THROW(PlannerClient({scratch_ / "nosuch.yaml"}, "tester"), BadInput);
  EXPECT_THROW(PlannerClient({path_, scratch_ / "nokey"}, "tester"), BadInput);
  probe_.ListenFor(std::chrono::milliseconds(50));
  EXPECT_TRUE(probe_.heard("PLAN_CANDIDATE").empty());
}

TEST_F(PlannerClientTest, HandsOutWhatAnswersThisPlannerAlone) {
  const auto say = [&]<class Message>(const char* channel, Message message, const char* source, std::int64_t plan_id) {
    SetText(message.source, source);
    message.plan_id = plan_id;
    ASSERT_TRUE(probe_.bus().Publish(channel, message));
  };
  say("PLAN_DECISION", decision_t{}, "stranger", 1);
  say("PLAN_DECISION", decision_t{}, "tester", 2);
  say("PLAN_WITHDRAWN", withdrawal_t{}, "stranger", 3);
  say("PLAN_WITHDRAWN", withdrawal_t{}, "tester", 4);
  advice_t repair{.changed = 1};
  say("PLAN_ADVICE", repair, "tester", 5);  // its proposal has no sizes
  repair.proposal = {.num_states = 4, .num_inputs = 2, .num_steps = 3, .progress_steps = 1};
  say("PLAN_ADVICE", repair, "tester", 6);
  say("PLAN_ADVICE", advice_t{.num_changes = 1}, "tester", 7);
  const auto only = [](const auto& messages) { return messages.size() == 1 ? messages.front().plan_id : -1; };
  EXPECT_EQ(only(planner_.Decisions(30)), 2);
  EXPECT_EQ(only(planner_.Withdrawals(30)), 4);
  EXPECT_EQ(only(planner_.Repairs(30)), 6);
  EXPECT_EQ(only(planner_.Advice(30)), 7);
  EXPECT_TRUE(planner_.Decisions().empty()) << "they were taken";
}

TEST(RobotClientTest, HoldsWithoutACertifiedPlanAndAcceptsATaskThatWasReadAgain) {
  class Robot final : public RobotClient::Robot {
   public:
    std::span<const double> state() const override { return x; }
    void Hold() override { ++holds; }
    double x[4] = {};
    int holds = 0;
  } robot;
  const ScratchDirectory scratch;
  const std::string path = scratch.Write("task.yaml", PatientTask());
  RobotClient client({path, "", "memq://"}, robot);
  EXPECT_EQ(client.step_us(), 100'000);
  client.Listen(0);
  EXPECT_TRUE(client.Boundary(WallClockUs()).empty());
  EXPECT_EQ(client.supervisor().counts().boundaries, 1);
  client.ReloadTask();
  scratch.Write("task.yaml", "no: task\n");
  EXPECT_THROW(client.ReloadTask(), BadInput);
  EXPECT_TRUE(client.Boundary(WallClockUs()).empty());
  std::thread([&] { EXPECT_THROW(client.Boundary(1), std::runtime_error); }).join();
}

}  // namespace forereach::clients_test
