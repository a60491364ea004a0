// What `forereach torture` finds: nothing at this product's gate and guard, and everything at ones that believe all.
#include "tests/test.h"

#include <atomic>

#include "bus/process.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/seal.h"
#include "tests/keys.h"
#include "tests/process/process_fixture.h"
#include "torture/hostile_messages.h"
#include "torture/torture.h"

namespace forereach::torture_test {

using testing::HasSubstr;

constexpr const char* kMower = FOREREACH_SOURCE_DIR "/examples/mower/mower.yaml";

TEST(Torture, NothingGetsThroughToThisGateAndGuard) {
  for (const bool is_signed : {true, false}) {
    const ScratchDirectory scratch;
    const std::string keys = is_signed ? MakeTestKeys(scratch / "keys") : "", url = PrivateBusUrl();
    std::vector<std::string> certifier_command{FOREREACH_CERTIFIER, "--config",       kMower, "--lcm-url", url,
                                               "--state",           scratch / "state"};
    if (is_signed) certifier_command.insert(certifier_command.end(), {"--key", keys});
    ChildProcess certifier(certifier_command);
    ASSERT_TRUE(certifier.WaitForLog("ready on")) << certifier.error();
    ChildProcess robot({FOREREACH_OWN_ROBOT, kMower, keys, url});
    // The gate hears the robot for three seconds before it is armed.
    BusProbe probe(url, {"CERTIFIER_STATUS"});
    ASSERT_TRUE(probe.WaitUntil([&] {
      const auto& all = probe.heard("CERTIFIER_STATUS");
      const auto status = all.empty() ? std::nullopt : Decoded<certifier_status_t>(WithoutSignature(all.back()));
      return status && status->level == certifier_status_t::OK;
    })) << certifier.error();

    Config config = LoadConfig(kMower);
    config.bus.url = url;
    config.bus.key = keys;
    config.bus = WithKeys(std::move(config.bus), Role::kPlanner);
    std::size_t steps = 0;
    const TortureReport report = Torture(config, {.flood = 300}, [&] { ++steps; });
    EXPECT_EQ(report.through(), 0) << ToText(report);
    EXPECT_TRUE(report.alive && report.gate_heard && report.robot_heard && report.honest_is_judged) << ToText(report);
    EXPECT_EQ(report.is_signed, is_signed);
    EXPECT_EQ(steps, TortureSteps(config));
    EXPECT_EQ(report.rows.size(), steps);
    for (const TortureRow& row : report.rows) EXPECT_GT(row.sent, 0) << row.attack;
    for (const TortureRow& row : report.rows) {
      if (row.attack.starts_with("to the gate: counts")) EXPECT_EQ(row.refused, row.sent);
      if (row.attack.starts_with("to the guard") && !is_signed) EXPECT_GT(row.refused, 0) << row.attack;
    }
    EXPECT_EQ(robot.Terminate(), 0);
    EXPECT_THAT(robot.output(), HasSubstr(" 0 steps")) << "it moved no robot";
  }
}

// A gate and a guard that believe everything, in a thread: each message on their channels has the effect it asks for.
class Believer final {
 public:
  explicit Believer(const std::string& url) : bus_(OpenBus(url)), thread_([this] { Run(); }) {}
  ~Believer() {
    ends_ = true;
    thread_.join();
  }

 private:
  void Run() {
    bus_->Subscribe("PLAN_CANDIDATE", [this](const Received& received) {
      decision_t decision{.outcome = decision_t::CERTIFIED};
      SetDigest(decision.plan_digest, PlanDigest(WithoutSignature(received.bytes)));
      bus_->Publish("PLAN_DECISION", decision);
    });
    bus_->Subscribe("PLAN_CERTIFIED", [this](const Received& received) {
      const auto certified = Decoded<certified_plan_t>(WithoutSignature(received.bytes));
      if (!certified) return;
      execution_event_t event{.plan_id = certified->plan.plan_id, .kind = execution_event_t::ACCEPTED};
      bus_->Publish("EXECUTION_EVENT", event);
    });
    bus_->Subscribe("FAULT", [this](const Received&) {
      bus_->Publish("EXECUTION_EVENT", execution_event_t{.plan_id = -1, .kind = execution_event_t::HALTED});
    });
    for (std::int64_t next = 0; !ends_; bus_->Dispatch(5)) {
      if (WallClockUs() < next) continue;
      next = WallClockUs() + 50'000;
      bus_->Publish("CERTIFIER_STATUS", certifier_status_t{.instance = 1, .obstacles_in_force = 3});
      bus_->Publish("ROBOT_STATE",
                    robot_state_t{.utime = WallClockUs(), .mode = robot_state_t::STANDING, .num_states = 5});
    }
  }

  const std::unique_ptr<Bus> bus_;
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

TEST(Torture, EverythingGetsThroughToAGateAndAGuardThatBelieveAll) {
  const ScratchDirectory scratch;
  Config config = LoadConfig(kMower);
  config.bus.url = PrivateBusUrl();
  config.bus.keys = LoadKeys(MakeTestKeys(scratch / "keys"), Role::kPlanner);  // which it does not look at
  const Believer believer(config.bus.url);
  const TortureReport report = Torture(config, {.flood = 20, .patience_s = 1});
  for (const TortureRow& row : report.rows)
    if (!row.attack.ends_with("flood of candidates")) EXPECT_GT(row.through, 0) << row.attack;
  EXPECT_TRUE(report.alive);
  EXPECT_THAT(ToText(report), HasSubstr("judged: certified"));
  EXPECT_EQ(ToJson(report)["through"], report.through());
}

TEST(Torture, LeavesThisMachineOnlyByNameAndNeedsSomebodyToTorture) {
  Config config = LoadConfig(kMower);
  config.bus.url = "udpm://239.255.76.67:7667?ttl=1";
  for (const char* name : {"", "239.255.76.67", "yes"})
    EXPECT_THAT([&] { static_cast<void>(Torture(config, {.beyond_loopback = name})); },
                ThrowsMessage<ConfigError>(HasSubstr("--beyond-loopback 239.255.76.67:7667")));
  config.bus.url = PrivateBusUrl();
  EXPECT_THAT([&] { static_cast<void>(Torture(config, {.patience_s = 0.1})); },
              ThrowsMessage<ConfigError>(HasSubstr("neither a gate's heartbeat nor a robot's state is heard")));
}

// The makers, without a bus: each flaw is there, and no two messages of a flaw are the same.
TEST(HostileMessages, HaveTheirFlawsAndDiffer) {
  candidate_plan_t honest{
      .utime = 1'000'000'000'000, .start_utime = 1'000'000'100'000, .num_states = 4, .num_inputs = 2, .num_steps = 4};
  for (const CandidateFlaw& flaw : CandidateFlaws()) {
    std::set<RawMessage> all;
    for (const RawMessage& message : flaw.make(honest, honest.utime)) {
      EXPECT_NE(message, Encode(honest)) << flaw.name;
      EXPECT_TRUE(all.insert(message).second) << flaw.name;
    }
    EXPECT_FALSE(all.empty()) << flaw.name;
  }
}

}  // namespace forereach::torture_test
