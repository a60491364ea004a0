// forereach-certifier as a process that ends while the robot executes its plan, and starts again: the plan goes on
// exactly where nothing that it rests on has changed meanwhile.
#include <csignal>

#include "tests/test.h"

#include "tests/messages.h"
#include "tests/process/process_fixture.h"

namespace forereach::restart_process_test {

constexpr int kSteps = 14;  // 4.2 s

struct RestartProcessTest : testing::Test {
  RestartProcessTest() { EXPECT_TRUE(robot_.WaitForLog("ready on")) << robot_.error(); }

  static std::string Transitions() { return Read(FOREREACH_SOURCE_DIR "/config/data/point_mass_100.csv"); }
  // With the transitions beside the task file, and time for a restart within a plan.
  static std::string Task() {
    return Replaced(Replaced(PatientTask(), FOREREACH_SOURCE_DIR "/config/data/point_mass_100.csv", "transitions.csv"),
                    "step_period_ms: 100", "step_period_ms: 300");
  }
  std::unique_ptr<ChildProcess> Certifier() const {
    auto process = std::make_unique<ChildProcess>(
        std::vector<std::string>{FOREREACH_CERTIFIER, "--config", path_, "--lcm-url", PrivateBusUrl()});
    EXPECT_TRUE(process->WaitForLog("in charge")) << process->error();
    return process;
  }
  // Ends the certifier while the robot executes its plan, and starts it again after `change`. True once the robot has
  // answered the withdrawal of the plan.
  template <class Change>
  [[nodiscard]] bool Restart(Change change) {
    {
      const auto certifier = Certifier();
      const Config config = LoadConfig(path_);
      if (!probe_.WaitUntil([&] { return !probe_.heard("ROBOT_STATE").empty(); })) return false;
      candidate_plan_t candidate = CandidateFor(config, 1, Eigen::Vector2d(0.05, 0), kSteps);
      candidate.start_utime = probe_.Heard<robot_state_t>("ROBOT_STATE").back().utime + 3 * candidate.step_us;
      probe_.bus().Publish("PLAN_CANDIDATE", candidate);
      if (!probe_.WaitUntil([&] { return !probe_.heard("PLAN_DECISION").empty(); })) return false;
      const decision_t decision = probe_.Heard<decision_t>("PLAN_DECISION").front();
      EXPECT_EQ(decision.outcome, decision_t::CERTIFIED) << GetText(decision.message);
      if (decision.outcome != decision_t::CERTIFIED) return false;
      if (!probe_.WaitUntil([&] { return Count(execution_event_t::STARTED) > 0; })) return false;
      certifier->Signal(SIGKILL);
      if (!certifier->WaitForEnd(kEndsWithin)) return false;
    }
    change();
    certifier_ = Certifier();
    return probe_.WaitUntil([&] { return Count(execution_event_t::WITHDRAWN) > 0; });
  }
  std::ptrdiff_t Count(int kind) {
    return std::ranges::count(probe_.Heard<execution_event_t>("EXECUTION_EVENT"), kind, &execution_event_t::kind);
  }
  // The answer to the first withdrawal.
  execution_event_t Answer() {
    const auto events = probe_.Heard<execution_event_t>("EXECUTION_EVENT");
    return *std::ranges::find(events, execution_event_t::WITHDRAWN, &execution_event_t::kind);
  }
  void ExpectAStop() {
    EXPECT_EQ(probe_.Heard<withdrawal_t>("PLAN_WITHDRAWN").at(0).cause, withdrawal_t::UNKNOWN_PLAN);
    EXPECT_EQ(Answer().plan_id, 1);
    EXPECT_EQ(Answer().step, 0) << "no control of it stands";
    EXPECT_TRUE(probe_.WaitUntil([&] { return Count(execution_event_t::EMERGENCY_STOP) > 0; }));
    EXPECT_EQ(Count(execution_event_t::STANDING), 0) << "it did not come to its end";
  }

  const ScratchDirectory scratch_;
  const std::string path_ = scratch_.Write("task.yaml", Task());
  const std::string transitions_ = scratch_.Write("transitions.csv", Transitions());
  BusProbe probe_{PrivateBusUrl(), {"ROBOT_STATE", "EXECUTION_EVENT", "PLAN_DECISION", "PLAN_WITHDRAWN"}};
  ChildProcess robot_{{FOREREACH_ROBOT_SIM, "--config", path_, "--lcm-url", PrivateBusUrl()}};
  std::unique_ptr<ChildProcess> certifier_;
};

TEST_F(RestartProcessTest, WithTheSameTaskItLetsThePlanGoOnToItsEnd) {
  ASSERT_TRUE(Restart([] {}));
  EXPECT_EQ(Answer().step, kSteps) << "all controls stand";
  ASSERT_TRUE(probe_.WaitUntil([&] { return Count(execution_event_t::STANDING) > 0; }));
  EXPECT_EQ(Count(execution_event_t::EMERGENCY_STOP), 0);
}

TEST_F(RestartProcessTest, WithAnotherFileOfTransitionsItStopsTheRobot) {
  const Digest before = LoadConfig(path_).grounds.config;
  const std::string all = Transitions();
  ASSERT_TRUE(Restart([&] { scratch_.Write("transitions.csv", all.substr(0, all.rfind('\n', all.size() - 2) + 1)); }));
  EXPECT_EQ(LoadConfig(path_).grounds.config, before) << "the task file is the same";
  ExpectAStop();
}

TEST_F(RestartProcessTest, WithAnotherDeclarationItStopsTheRobot) {
  ASSERT_TRUE(Restart([&] { scratch_.Write("task.yaml", Replaced(Task(), "vx: 0.092186775", "vx: 0.092186776")); }));
  ExpectAStop();
}

TEST_F(RestartProcessTest, WithoutAnObstacleItStopsTheRobot) {
  ASSERT_TRUE(Restart(
      [&] { scratch_.Write("task.yaml", Replaced(Task(), "\n    - circle: {center: [0, 2], radius: 0.8}", " []")); }));
  ExpectAStop();
}

}  // namespace forereach::restart_process_test
