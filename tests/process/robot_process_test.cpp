// forereach-robot-sim as a process: it moves only for a certified plan.
#include "tests/test.h"

#include "certifier/gate/gate.h"
#include "lcmtypes/seal.h"
#include "tests/messages.h"
#include "tests/process/process_fixture.h"

namespace forereach::robot_process_test {

constexpr int kSteps = 5;

struct RobotProcessTest : testing::Test {
  void SetUp() override {
    ASSERT_TRUE(robot_.WaitForLog("ready on")) << robot_.error();
    ASSERT_TRUE(probe_.WaitUntil([&] { return !probe_.heard("ROBOT_STATE").empty(); }));
  }

  // Certified by a gate with the robot's own task, to start at one of the robot's boundaries.
  certified_plan_t Certified(std::int64_t plan_id, int boundaries_ahead) {
    candidate_plan_t candidate = CandidateFor(config_, plan_id, Eigen::Vector2d(0.5, 0), kSteps);
    candidate.start_utime = Last().utime + boundaries_ahead * candidate.step_us;
    const GateAnswer answer = gate_.Decide(Encode(candidate), WallClockUs());
    EXPECT_TRUE(answer.certified) << GetText(answer.decision.message);
    return answer.certified.value();
  }
  robot_state_t Last() { return probe_.Heard<robot_state_t>("ROBOT_STATE").back(); }

  std::ptrdiff_t Count(int kind) {
    return std::ranges::count(probe_.Heard<execution_event_t>("EXECUTION_EVENT"), kind, &execution_event_t::kind);
  }
  [[nodiscard]] bool WaitForEvents(int kind, int count = 1) {
    return probe_.WaitUntil([&] { return Count(kind) >= count; });
  }

  const ScratchDirectory scratch_;
  const std::string path_ = scratch_.Write("task.yaml", PatientTask());
  const Config config_ = LoadConfig(path_);
  Gate gate_{config_};
  BusProbe probe_{PrivateBusUrl(), {"ROBOT_STATE", "TRANSITION", "EXECUTION_EVENT"}};
  ChildProcess robot_{{FOREREACH_ROBOT_SIM, "--config", path_, "--lcm-url", PrivateBusUrl()}};
};

TEST_F(RobotProcessTest, AReloadMakesItTakePlansOfTheTaskAsItIsNow) {
  scratch_.Write("task.yaml", "# changed\n" + PatientTask());
  Gate changed(LoadConfig(path_));
  candidate_plan_t candidate = CandidateFor(config_, 1, Eigen::Vector2d(0.5, 0), kSteps);
  const GateAnswer answer = changed.Decide(Encode(candidate), WallClockUs());
  ASSERT_TRUE(answer.certified);
  probe_.bus().Publish("PLAN_CERTIFIED", *answer.certified);
  ASSERT_TRUE(WaitForEvents(execution_event_t::REFUSED));
  probe_.bus().Publish("COMMAND", command_t{.utime = WallClockUs(), .kind = command_t::RELOAD});
  ASSERT_TRUE(robot_.WaitForLog("as it is now are accepted")) << robot_.error();
  probe_.bus().Publish("PLAN_CERTIFIED", *answer.certified);
  ASSERT_TRUE(WaitForEvents(execution_event_t::ACCEPTED));
  EXPECT_EQ(Count(execution_event_t::REFUSED), 1);
}

TEST_F(RobotProcessTest, StandsUntilACertifiedPlanComesThenDrivesItToItsEnd) {
  EXPECT_FIELDS(Last(), (mode, robot_state_t::STANDING), (executing_plan_id, -1));
  probe_.bus().Publish("PLAN_CERTIFIED", Certified(1, 20));
  ASSERT_TRUE(WaitForEvents(execution_event_t::STANDING));
  ASSERT_TRUE(probe_.WaitUntil([&] { return Last().mode == robot_state_t::STANDING; }));
  EXPECT_EQ(Count(execution_event_t::ACCEPTED), 1);
  EXPECT_EQ(Count(execution_event_t::STARTED), 1);
  EXPECT_EQ(Count(execution_event_t::STEP_INSIDE), kSteps);
  EXPECT_EQ(Count(execution_event_t::STEP_OUTSIDE), 0);
  EXPECT_EQ(probe_.heard("TRANSITION").size(), static_cast<std::size_t>(kSteps));
  EXPECT_GT(Last().state[0], 0.1) << "it has moved";
  EXPECT_EQ(robot_.Terminate(), 0) << robot_.error();
  const auto summary = nlohmann::json::parse(robot_.output());
  EXPECT_THAT(summary, Holds({{"steps_executed", kSteps}, {"steps_inside_slice", kSteps}}));
}

TEST_F(RobotProcessTest, DoesNotMoveForAnythingElse) {
  const certified_plan_t good = Certified(1, 20);
  probe_.bus().Publish("PLAN_CANDIDATE", good.plan);
  probe_.bus().Publish("PLAN_CERTIFIED", good.plan);  // a candidate where only certified plans belong

  certified_plan_t tampered = good;
  tampered.plan.control[0][0] = 2.9;
  probe_.bus().Publish("PLAN_CERTIFIED", tampered);  // another plan under an old certificate
  SetDigest(tampered.plan_digest, PlanDigest(tampered.plan));
  probe_.bus().Publish("PLAN_CERTIFIED", tampered);  // and with its own plan digest
  tampered = good;
  tampered.slice_upper[3][0] += 1;
  probe_.bus().Publish("PLAN_CERTIFIED", tampered);  // a wider slice
  tampered = good;
  tampered.expires_utime = WallClockUs() - 1;
  SetDigest(tampered.certificate_digest, CertificateDigest(tampered));
  probe_.bus().Publish("PLAN_CERTIFIED", tampered);  // expired
  std::vector<std::uint8_t> bytes = Encode(good);
  bytes.pop_back();
  probe_.bus().Publish("PLAN_CERTIFIED", Bytes(bytes));

  ASSERT_TRUE(WaitForEvents(execution_event_t::REFUSED, 6));
  ASSERT_TRUE(probe_.WaitUntil([&] { return Last().utime > good.plan.start_utime + 2 * good.plan.step_us; }));
  EXPECT_EQ(Count(execution_event_t::ACCEPTED), 0);
  EXPECT_EQ(Count(execution_event_t::STARTED), 0);
  EXPECT_TRUE(probe_.heard("TRANSITION").empty());
  for (const robot_state_t& state : probe_.Heard<robot_state_t>("ROBOT_STATE"))
    EXPECT_EQ(state.mode, robot_state_t::STANDING);

  probe_.bus().Publish("PLAN_CERTIFIED", Certified(2, 20));
  EXPECT_TRUE(WaitForEvents(execution_event_t::STARTED)) << "good again";
  EXPECT_EQ(robot_.Terminate(), 0) << robot_.error();
}

}  // namespace forereach::robot_process_test
