// `forereach keygen`, `status`, `reset` and `reload` against a certifier that runs, signs and checks.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "certifier/task/process.h"
#include "forereach/decision_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "tests/cli/program.h"
#include "tests/process/process_fixture.h"

namespace forereach {
namespace {

using testing::HasSubstr;

class BusCommands : public testing::Test {
 protected:
  BusCommands() {
    EXPECT_EQ(Forereach("keygen --robot test '" + key_ + "'").code, 0);
    std::string task = PatientTask();
    task.replace(task.find("arming: none"), 12, "arming: robot_state, robot_timeout_ms: 2000");
    scratch_.Write("task.yaml", task);
    config_ = LoadConfig(path_);
    config_.bus.url = PrivateBusUrl();
    config_.bus.key = key_;
    bus_ = OpenBusOfAllRoles(config_.bus);
    certifier_ = std::make_unique<ChildProcess>(std::vector<std::string>{
        FOREREACH_CERTIFIER, "--config", path_, "--lcm-url", config_.bus.url, "--key", key_});
    EXPECT_TRUE(certifier_->WaitForLog("ready on")) << certifier_->error();
  }

  Output Say(const std::string& command, bool with_key = true) const {
    return Forereach(command + " --config '" + path_ + "' --lcm-url '" + config_.bus.url + "'" +
                     (with_key ? " --key '" + key_ + "'" : "") + " 2>&1");
  }
  void SayState(const std::vector<double>& position = {0, 0, 0, 0}) {
    robot_state_t state{};
    state.utime = WallClockUs();
    state.sequence = sequence_++;
    state.executing_plan_id = state.executing_step = -1;
    state.mode = robot_state_t::STANDING;
    state.num_states = 4;
    std::ranges::copy(position, state.state);
    bus_->Publish(config_.bus.robot_state, state);
  }

  const ScratchDirectory scratch_;
  const std::string path_ = scratch_ / "task.yaml", key_ = scratch_ / "keys";
  Config config_;
  std::unique_ptr<Bus> bus_;
  std::unique_ptr<ChildProcess> certifier_;
  std::int64_t sequence_ = 0;
};

TEST_F(BusCommands, AFaultIsSeenAndClearedByAPersonWithTheKey) {
  Output status = Say("status");
  EXPECT_EQ(status.code, 1);
  EXPECT_THAT(status.text, HasSubstr("STALE, disarmed: waits for the robot's state"));
  SayState();
  status = Say("status");
  EXPECT_EQ(status.code, 0) << status.text;
  EXPECT_THAT(status.text, HasSubstr("OK, armed"));

  std::this_thread::sleep_for(std::chrono::milliseconds(2300));
  EXPECT_THAT(Say("status").text, HasSubstr("ERROR, fault: robot_state_lost"));
  const Output refused = Say("reset", false);
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.text, HasSubstr("--key"));
  EXPECT_THAT(Say("status").text, HasSubstr("fault")) << "without the key nothing is cleared";
  EXPECT_EQ(Say("reset").code, 0);
  EXPECT_THAT(Say("status").text, HasSubstr("disarmed"));
  EXPECT_EQ(certifier_->Terminate(), 0);
}

TEST_F(BusCommands, AReloadIsTakenOrItsErrorIsShown) {
  EXPECT_EQ(Say("reload").code, 0);
  EXPECT_THAT(Say("status").text, HasSubstr("version 2"));
  std::filesystem::rename(path_, path_ + ".away");
  scratch_.Write("task.yaml", "model: {name: hovercraft}\n");
  certifier_->Signal(SIGHUP);
  EXPECT_TRUE(certifier_->WaitForLog("version 2 stays in force")) << certifier_->error();
  std::filesystem::rename(path_ + ".away", path_);
  const Output status = Say("status");
  EXPECT_THAT(status.text, HasSubstr("hovercraft"));
  EXPECT_THAT(status.text, HasSubstr("version 2"));
}

TEST_F(BusCommands, UnsignedCandidatesAndStatesDoNothing) {
  const auto open = OpenBus(config_.bus.url);
  robot_state_t state{};
  state.utime = WallClockUs();
  state.mode = robot_state_t::STANDING;
  state.num_states = 4;
  open->Publish(config_.bus.robot_state, state);
  open->Publish(config_.bus.candidate, CandidateFor(config_, 1, Eigen::Vector2d(0, 0)));
  auto status = nlohmann::json::parse(Say("status --json").text);
  for (int i = 0; i < 10 && status["refused_unsigned"] != 2; ++i) status = nlohmann::json::parse(Say("status --json").text);
  EXPECT_EQ(status["state"], "disarmed");
  EXPECT_EQ(status["candidates"], 0);
  EXPECT_EQ(status["refused_unsigned"], 2);
}

TEST(BusCommandsTest, NobodyThereIsSaid) {
  const ScratchDirectory scratch;
  const std::string path = scratch.Write("task.yaml", PatientTask());
  const Output status = Forereach("status --config '" + path + "' --lcm-url '" + PrivateBusUrl() + "' 2>&1");
  EXPECT_EQ(status.code, 1);
  EXPECT_THAT(status.text, HasSubstr("no certifier answered"));
}

}  // namespace
}  // namespace forereach
