// `forereach keygen`, `status`, `reset` and `reload` against a certifier that runs, signs and checks.
#include <atomic>
#include <csignal>

#include "bus/process.h"
#include "task/files.h"
#include "tests/cli/program.h"
#include "tests/keys.h"
#include "tests/messages.h"
#include "tests/process/process_fixture.h"

namespace forereach::bus_commands_test {

struct BusCommands : testing::Test {
  BusCommands() {
    EXPECT_EQ(Forereach("keygen --robot test '" + key_ + "'").code, 0);
    scratch_.Write("task.yaml", Replaced(PatientTask(), "arming: none", "arming: robot_state, robot_timeout_ms: 2000"));
    config_ = LoadConfig(path_);
    config_.bus.url = PrivateBusUrl();
    config_.bus.key = key_;
    bus_ = OpenBusOfAllRoles(config_.bus);
    certifier_ = std::make_unique<ChildProcess>(
        std::vector<std::string>{FOREREACH_CERTIFIER, "--config", path_, "--lcm-url", config_.bus.url, "--key", key_});
    EXPECT_TRUE(certifier_->WaitForLog("ready on")) << certifier_->error();
  }

  Output Say(const std::string& command, bool with_key = true) const {
    return Forereach(command + " --config '" + path_ + "' --lcm-url '" + config_.bus.url + "'" +
                     (with_key ? " --key '" + key_ + "'" : "") + " 2>&1");
  }
  void SayState(const std::vector<double>& position = {0, 0, 0, 0}) {
    robot_state_t state{.utime = WallClockUs(), .sequence = sequence_++};
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
  EXPECT_THAT(status, Exits(1, "STALE, disarmed: waits for the robot's state"));
  SayState();
  EXPECT_THAT(Say("status").text, HasSubstr("it counts after 2000 ms alone")) << "a second one may be there";
  for (int i = 0; i < 12; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    SayState();
  }
  status = Say("status");
  EXPECT_THAT(status, Exits(0, "OK, armed"));

  std::this_thread::sleep_for(std::chrono::milliseconds(2300));
  EXPECT_THAT(Say("status").text, HasSubstr("ERROR, fault: robot_state_lost"));
  EXPECT_THAT(Say("reset", false), Exits(1, "--key"));
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
  EXPECT_THAT(Say("status").text, AllOf(HasSubstr("hovercraft"), HasSubstr("version 2")));
}

// Strangers' datagrams are refused all the time.
TEST_F(BusCommands, WhatAStrangerSaysMeanwhileAnswersNoCommand) {
  const auto open = OpenBus(config_.bus.url);
  std::atomic<bool> stop = false;
  std::thread stranger([&] {
    for (; !stop; std::this_thread::sleep_for(std::chrono::milliseconds(5)))
      open->Publish(config_.bus.command, command_t{.utime = WallClockUs(), .kind = command_t::RELOAD});
  });
  const Output reload = Say("reload"), reset = Say("reset"), without_key = Say("reload", false);
  stop = true;
  stranger.join();
  EXPECT_THAT(reload, Exits(0, "version 2", Not(HasSubstr("--key"))));
  EXPECT_EQ(reset.code, 0) << reset.text;
  EXPECT_THAT(without_key, Exits(1,
                                 "has not done the reload within 3 s: it refuses a command without the "
                                 "operator's key (--key)"));
  EXPECT_THAT(Say("status").text,
              AllOf(HasSubstr("version 2"), HasSubstr("messages refused: "), HasSubstr(" unsigned")));
}

// Others reload, too: only this very file in force is an answer.
TEST_F(BusCommands, AReloadOfAnotherFileOrAFailedOneOfOthersIsNoAnswer) {
  const std::string mine = scratch_.Write("mine.yaml", ReadWhole(path_, 1 << 20) + "\n# another\n");
  const auto reload_of = [&](const std::string& path) {
    return Forereach("reload --config '" + path + "' --lcm-url '" + config_.bus.url + "' --key '" + key_ + "' 2>&1");
  };
  EXPECT_THAT(reload_of(mine), Exits(1, "version 2", "it is not --config as it is here"));
  scratch_.Write("task.yaml", "model: {name: hovercraft}\n");
  EXPECT_THAT(reload_of(mine), Exits(1, "hovercraft", "a heartbeat does not say whose"));
  std::filesystem::copy_file(mine, path_, std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(reload_of(mine), Exits(0, "version 3"));
}

TEST_F(BusCommands, UnsignedCandidatesAndStatesDoNothing) {
  const auto open = OpenBus(config_.bus.url);
  robot_state_t state{.utime = WallClockUs(), .mode = robot_state_t::STANDING, .num_states = 4};
  open->Publish(config_.bus.robot_state, state);
  open->Publish(config_.bus.candidate, CandidateFor(config_, 1, Eigen::Vector2d(0, 0)));
  auto status = nlohmann::json::parse(Say("status --json").text);
  for (int i = 0; i < 10 && status["refused_unsigned"] != 2; ++i)
    status = nlohmann::json::parse(Say("status --json").text);
  EXPECT_THAT(status, Holds({{"state", "disarmed"}, {"candidates", 0}, {"refused_unsigned", 2}}));
}

// A stranger, or somebody with another role's key, says that all is well, once the certifier is dead.
TEST_F(BusCommands, AForgedHeartbeatIsNoSignOfLife) {
  Output alive{1, ""};  // it arms once it knows that no other certifier is there
  for (int i = 0; i < 20 && alive.code != 0; ++i) SayState(), alive = Say("status");
  EXPECT_EQ(alive.code, 0) << alive.text;
  EXPECT_EQ(certifier_->Terminate(), 0);
  const auto open = OpenBus(config_.bus.url);
  Signer forger(LoadAllKeys(key_), config_.bus.bus_name()), stranger(TestKeys("stranger"), config_.bus.bus_name());
  std::atomic<bool> stop = false;
  std::thread forging([&] {
    for (std::int64_t i = 0; !stop; ++i, std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
      certifier_status_t status{
          .utime = WallClockUs(), .sequence = i, .level = certifier_status_t::OK, .state = certifier_status_t::ARMED};
      const auto bytes = Encode(status);
      open->Publish("CERTIFIER_STATUS", Bytes(bytes));
      open->Publish("CERTIFIER_STATUS",
                    Bytes(stranger.Sign(Role::kCertifier, "CERTIFIER_STATUS", bytes, status.utime)));
      for (const Role role : kAllRoles)
        if (role != Role::kCertifier)
          open->Publish("CERTIFIER_STATUS", Bytes(forger.Sign(role, "CERTIFIER_STATUS", bytes, status.utime)));
    }
  });
  const Output status = Say("status"), reset = Say("reset"), reload = Say("reload");
  const Output believed = Say("status", false);
  stop = true;
  forging.join();
  for (const Output& output : {status, reset, reload}) {
    EXPECT_THAT(output, Exits(1, "no certifier answered"));
  }
  EXPECT_EQ(believed.code, 0) << "without a key everybody is believed";
  EXPECT_THAT(believed.text, HasSubstr("UNSIGNED: anyone on this network can move this robot"));
}

TEST_F(BusCommands, AProcessWithAnotherRolesKeyDoesNotStart) {
  ChildProcess process(
      {FOREREACH_CERTIFIER, "--config", path_, "--lcm-url", config_.bus.url, "--key", key_ + "/planner.key"});
  EXPECT_EQ(process.WaitForExit(), 2);
  EXPECT_THAT(process.error(), HasSubstr("planner.key: line 3: role: is planner, this program speaks as certifier"));
}

TEST_F(BusCommands, DoctorLooksAtTheKeys) {
  EXPECT_THAT(Forereach("doctor --key '" + key_ + "' --lcm-url '" + config_.bus.url + "' 2>&1").text,
              HasSubstr("of robot test, for bus " + config_.bus.bus_name() + "; secrets of certifier, planner"));
  std::filesystem::permissions(key_ + "/planner.key", std::filesystem::perms::others_read,
                               std::filesystem::perm_options::add);
  EXPECT_THAT(Forereach("doctor --key '" + key_ + "' --lcm-url '" + config_.bus.url + "' 2>&1"),
              Exits(1, "others can read it"));
}

// Whatever is sent on each of our channels, only what its speaker signed for this robot and this bus is handed out.
TEST_F(BusCommands, OnEachChannelOnlyItsSpeakerIsHeard) {
  const auto open = OpenBus(config_.bus.url);
  const KeyRing keys = LoadAllKeys(key_);
  const std::string bus_name = config_.bus.bus_name();
  Signer all(keys, bus_name), other_robot(TestKeys("other"), bus_name), other_bus(keys, "another bus");
  std::map<std::string, int> heard, wanted;
  const auto ear = OpenBus(config_.bus, Role::kLogger);
  EXPECT_EQ(certifier_->Terminate(), 0);  // it speaks here too
  for (const auto& [channel, speaker] : config_.bus.speakers())
    ear->Subscribe(channel, [&heard](const Received& r) {
      heard[r.channel] += std::ranges::equal(r.bytes, Bytes(DigestOf("good")));
    });
  int forged = 0;
  const Digest good = DigestOf("good");
  for (const auto& [channel, speaker] : config_.bus.speakers()) {
    const std::int64_t now = WallClockUs();
    const auto send = [&, on = channel](const std::vector<std::uint8_t>& bytes) { open->Publish(on, Bytes(bytes)); };
    open->Publish(channel, Bytes(good));
    const auto genuine = all.Sign(speaker, channel, good, now);
    auto altered = genuine;
    altered[0] ^= 1;
    send(altered), ++forged;
    send(genuine), ++wanted[channel];
    send(genuine);  // replayed
    for (const Role role : kAllRoles)
      if (role != speaker) send(all.Sign(role, channel, good, now)), ++forged;
    send(other_robot.Sign(speaker, channel, good, now)), ++forged;
    send(other_bus.Sign(speaker, channel, good, now));
  }
  const auto channels = static_cast<std::int64_t>(wanted.size());
  for (int i = 0; i < 200 && ear->refusals().foreign < channels; ++i) ear->Dispatch(10);
  ear->Dispatch(10);
  EXPECT_EQ(channels, 13);
  EXPECT_EQ(heard, wanted);
  const Refusals refusals = ear->refusals();
  EXPECT_FIELDS(refusals, (unsigned_ones, channels), (forged, forged), (replayed, channels), (foreign, channels));
}

TEST(BusCommandsTest, StatusSaysThatNoCertifierAnswered) {
  const ScratchDirectory scratch;
  const std::string path = scratch.Write("task.yaml", PatientTask());
  EXPECT_THAT(Forereach("status --config '" + path + "' --lcm-url '" + PrivateBusUrl() + "' 2>&1"),
              Exits(1, "no certifier answered"));
}

}  // namespace forereach::bus_commands_test
