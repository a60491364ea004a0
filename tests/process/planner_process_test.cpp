// forereach-planner as a process: it proposes when it hears of a robot that stands, and takes no for an answer.
#include "tests/test.h"

#include "certifier/gate/gate.h"
#include "forereach/robot_state_t.hpp"
#include "tests/process/process_fixture.h"

namespace forereach::planner_process_test {

struct PlannerProcessTest : testing::Test {
  void SetUp() override { ASSERT_TRUE(planner_.WaitForLog("ready on")) << planner_.error(); }

  void SendState(std::int16_t mode) {
    robot_state_t state{.utime = WallClockUs(),
                        .sequence = states_++,
                        .executing_plan_id = -1,
                        .executing_step = -1,
                        .mode = mode,
                        .num_states = 4};
    probe_.bus().Publish("ROBOT_STATE", state);
  }
  // Reports a standing robot at every boundary until `count` candidates have come.
  [[nodiscard]] bool WaitForCandidates(std::size_t count) {
    std::int64_t next_us = 0;
    return probe_.WaitUntil([&] {
      if (WallClockUs() >= next_us) {
        next_us = WallClockUs() + 100'000;
        SendState(robot_state_t::STANDING);
      }
      return probe_.heard("PLAN_CANDIDATE").size() >= count;
    });
  }

  const ScratchDirectory scratch_;
  const std::string path_ = scratch_.Write("task.yaml", PatientTask());
  const Config config_ = LoadConfig(path_);
  BusProbe probe_{PrivateBusUrl(), {"PLAN_CANDIDATE"}};
  ChildProcess planner_{{FOREREACH_PLANNER, "--config", path_, "--lcm-url", PrivateBusUrl()}};
  std::int64_t states_ = 0;
};

TEST_F(PlannerProcessTest, ProposesOnceItHearsOfTheRobot) {
  probe_.ListenFor(std::chrono::milliseconds(300));
  EXPECT_TRUE(probe_.heard("PLAN_CANDIDATE").empty()) << "nothing is known of the robot yet";
  ASSERT_TRUE(WaitForCandidates(2)) << planner_.error();

  Gate gate(config_);
  std::int64_t last_plan_id = 0;
  for (const candidate_plan_t& candidate : probe_.Heard<candidate_plan_t>("PLAN_CANDIDATE")) {
    EXPECT_GT(candidate.plan_id, last_plan_id);
    last_plan_id = candidate.plan_id;
    EXPECT_EQ(candidate.step_us, 100'000);
    EXPECT_GT(candidate.start_utime, candidate.utime);
    EXPECT_LE(candidate.progress_steps, 6);
    const GateAnswer answer = gate.Decide(Encode(candidate), candidate.utime);
    EXPECT_NE(answer.decision.outcome, decision_t::REJECTED) << GetText(answer.decision.message);
  }
  EXPECT_EQ(planner_.Terminate(), 0) << planner_.error();
}

TEST_F(PlannerProcessTest, BadMessagesDoNotStopIt) {
  const std::vector<std::uint8_t> junk = {1, 2, 3};
  for (const char* channel : {"ROBOT_STATE", "PLAN_DECISION", "OBSTACLES"}) {
    probe_.bus().Publish(channel, Bytes(junk));
    probe_.bus().Publish(channel, Bytes());
    probe_.bus().Publish(channel, candidate_plan_t{});
  }
  robot_state_t state{.utime = WallClockUs(), .mode = robot_state_t::STANDING};
  for (const std::int16_t states : std::initializer_list<std::int16_t>{-1, 0, 5, 32767}) {
    state.num_states = states;
    probe_.bus().Publish("ROBOT_STATE", state);
  }
  state.num_states = 4;
  state.state[2] = std::numeric_limits<double>::quiet_NaN();
  probe_.bus().Publish("ROBOT_STATE", state);
  EXPECT_TRUE(WaitForCandidates(1)) << planner_.error();
  EXPECT_EQ(planner_.Terminate(), 0) << planner_.error();
  EXPECT_TRUE(nlohmann::json::accept(planner_.output())) << planner_.output();
}

TEST_F(PlannerProcessTest, EndsWhenTheRobotHasFinished) {
  SendState(robot_state_t::FINISHED);
  EXPECT_EQ(planner_.WaitForExit(), 0) << planner_.error();
}

}  // namespace forereach::planner_process_test
