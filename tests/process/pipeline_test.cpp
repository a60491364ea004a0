// All four processes together: what is proposed is decided on, what is certified is driven, and the robot never leaves
// its tube. How far it gets depends on the machine; these things do not.
#include "tests/test.h"

#include "tests/messages.h"
#include "tests/process/process_fixture.h"

namespace forereach::pipeline_test {

TEST(PipelineTest, FourProcessesDriveCertifiedPlansOnly) {
  const ScratchDirectory scratch;
  const std::string path = scratch.Write("task.yaml", PatientTask(6)), directory = scratch / "recorded";
  const std::string url = PrivateBusUrl();
  BusProbe probe(url, {"PLAN_CANDIDATE", "PLAN_DECISION", "PLAN_CERTIFIED", "EXECUTION_EVENT"});
  ChildProcess logger({FOREREACH_LOGGER, "--config", path, "--lcm-url", url, "--directory", directory});
  ChildProcess certifier({FOREREACH_CERTIFIER, "--config", path, "--lcm-url", url});
  ChildProcess planner({FOREREACH_PLANNER, "--config", path, "--lcm-url", url});
  for (ChildProcess* process : {&logger, &certifier, &planner})
    ASSERT_TRUE(process->WaitForLog("ready on")) << process->error();
  ChildProcess robot({FOREREACH_ROBOT_SIM, "--config", path, "--lcm-url", url});

  ASSERT_TRUE(probe.WaitUntil([&] { return robot.WaitForExit(std::chrono::milliseconds(0)).has_value(); }));
  EXPECT_EQ(robot.WaitForExit(), 0) << robot.error();
  EXPECT_EQ(planner.WaitForExit(), 0) << "it ends by itself: " << planner.error();
  probe.ListenFor(std::chrono::milliseconds(200));
  EXPECT_EQ(certifier.Terminate(), 0) << certifier.error();
  EXPECT_EQ(logger.Terminate(), 0) << logger.error();

  const auto driven = nlohmann::json::parse(robot.output());
  EXPECT_EQ(driven["contacts"], 0);
  EXPECT_GT(driven["steps_executed"], 0) << robot.output();
  EXPECT_EQ(driven["steps_inside_slice"], driven["steps_executed"]);

  std::map<std::int64_t, int> answers;
  std::set<std::int64_t> certificates;
  for (const decision_t& decision : probe.Heard<decision_t>("PLAN_DECISION")) {
    ++answers[decision.plan_id];
    if (decision.outcome == decision_t::CERTIFIED) certificates.insert(decision.plan_id);
  }
  EXPECT_EQ(answers.size(), probe.heard("PLAN_CANDIDATE").size());
  for (const auto& [plan_id, count] : answers) EXPECT_EQ(count, 1) << plan_id;
  for (const certified_plan_t& plan : probe.Heard<certified_plan_t>("PLAN_CERTIFIED"))
    EXPECT_TRUE(certificates.contains(plan.plan.plan_id)) << plan.plan.plan_id;
  for (const execution_event_t& event : probe.Heard<execution_event_t>("EXECUTION_EVENT")) {
    if (event.kind == execution_event_t::STARTED) EXPECT_TRUE(certificates.contains(event.plan_id)) << event.plan_id;
  }
}

}  // namespace forereach::pipeline_test
