// A certifier that reads its task again.
#include "certifier/process/certifier_node.h"

#include <regex>

#include "tests/test.h"

#include "tests/certifier/small_task.h"
#include "tests/keys.h"
#include "tests/paths.h"

namespace forereach::reload_test {

struct ReloadTest : testing::Test {
  ~ReloadTest() override {
    while (reloads_under_way > 0) std::this_thread::yield();
  }
  void Write(const std::string& text) const { std::ofstream(path_) << text; }
  void Copy(const std::function<std::string(std::string)>& edit, const std::string& shipped = "point_mass") const {
    const std::string text = Read(FOREREACH_SOURCE_DIR "/config/" + shipped + ".yaml");
    Write(edit(std::regex_replace(text, std::regex("data/"), FOREREACH_SOURCE_DIR "/config/data/")));
  }
  // Reads the file again and waits for what comes of it.
  void Reload(CertifierNode& node) {
    const std::int64_t version = status_.version, failed = status_.failed_reloads;
    node.Reload();
    TickUntil(node, [&] { return status_.version != version || status_.failed_reloads != failed; });
  }
  template <class Done>
  void TickUntil(CertifierNode& node, Done done) {
    for (int i = 0; i < 5000 && !done(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      node.Tick(kNow);
      bus_->Dispatch(0);
    }
  }
  // Of the shipped task, and heard.
  std::unique_ptr<CertifierNode> Begin() {
    Copy([](const std::string& text) { return text; });
    return BeginWith(LoadConfig(path_));
  }
  std::unique_ptr<CertifierNode> BeginWith(const Config& config) {
    auto node = std::make_unique<CertifierNode>(config, *bus_, Clocks{clock_, clock_});
    Hear(*bus_, "CERTIFIER_STATUS", status_);
    node->Tick(kNow);
    bus_->Dispatch(0);
    return node;
  }
  void ExpectRefused(CertifierNode& node, const std::string& why) {
    const std::int64_t failed = status_.failed_reloads, version = status_.version;
    Reload(node);
    EXPECT_EQ(status_.failed_reloads, failed + 1) << why;
    EXPECT_EQ(status_.version, version) << why;
    EXPECT_THAT(GetText(status_.message), HasSubstr(why));
  }

  const ScratchDirectory scratch_;
  const std::string path_ = scratch_ / "task.yaml";
  const Clock clock_ = [] { return kNow; };
  std::unique_ptr<Bus> bus_ = OpenBus("memq://", clock_);
  certifier_status_t status_{};
};

TEST_F(ReloadTest, TakesANewTaskWholeOrNotAtAll) {
  const auto node = Begin();
  const Config before = LoadConfig(path_);
  ASSERT_EQ(status_.version, 1);

  Copy([](const std::string& text) { return text + "\nnonsense: 3\n"; });
  ExpectRefused(*node, "nonsense");
  EXPECT_EQ(GetDigest(status_.config_digest), before.grounds.config);

  for (const auto& [change, what] :
       {std::pair{"bus: {channels: {decision: ELSEWHERE}}", "bus.channels"},
        std::pair{"realtime: {lock_memory: no}", "realtime"}, std::pair{"realtime: {fifo_priority: 3}", "realtime"}}) {
    Copy([changed = std::string(change)](const std::string& text) { return text + "\n" + changed + "\n"; });
    ExpectRefused(*node, what + std::string(" cannot change while"));
  }

  for (const auto& [gate, what] :
       {std::pair{"gate: {obstacles: bus, obstacles_lost_ms: never}", "gate.obstacles cannot change while"},
        std::pair{"gate: {obstacles: task, max_clock_error_ms: 5}", "gate.max_clock_error_ms cannot change while"},
        std::pair{"gate: {obstacles: bus}", "gate.obstacles_lost_ms: missing"},
        std::pair{"gate: {obstacles: task}\nbus: {delay_ms: 11}", "bus.delay_ms cannot change while"},
        std::pair{"gate: {}", "gate.obstacles: missing"}}) {
    Copy([changed = std::string(gate)](const std::string& text) {
      const bool has_clock = changed.find("clock") != std::string::npos;
      const std::string steps = std::regex_replace(text, std::regex("step_error_ms: any"),
                                                   has_clock ? "step_error_ms: 5" : "step_error_ms: any");
      return std::regex_replace(steps, std::regex("gate: \\{obstacles: task\\}"), changed);
    });
    ExpectRefused(*node, what);
  }

  Copy([](const std::string& text) {
    return std::regex_replace(text, std::regex("gate: \\{"), "gate: {state: elsewhere, ");
  });
  ExpectRefused(*node, "gate.state cannot change while");

  // The guard takes how far steps may be off their times from each plan.
  Copy([](const std::string& text) {
    return "# another\n" + std::regex_replace(text, std::regex("step_error_ms: any"), "step_error_ms: 5");
  });
  Reload(*node);
  EXPECT_EQ(status_.version, 2);
  EXPECT_EQ(GetDigest(status_.config_digest), LoadConfig(path_).grounds.config);
  EXPECT_EQ(GetText(status_.message), "waits for the robot's state");
}

TEST_F(ReloadTest, ANewExpressionOfTheDisturbanceIsANewDeclaration) {
  const auto node = Begin();
  std::set<Digest> declarations;
  for (const char* const bound : {"0.001*abs(vx*(ax - vy))", "0.002*abs(vx*(ax - vy))"}) {
    Copy([&](const std::string& text) {
      return std::regex_replace(text, std::regex("  state_error"),
                                "  disturbance: {vx: \"" + std::string(bound) + "\"}\n  state_error");
    });
    Reload(*node);
    EXPECT_EQ(GetDigest(status_.config_digest), LoadConfig(path_).grounds.config);
    declarations.insert(LoadConfig(path_).grounds.declaration);
  }
  EXPECT_EQ(status_.version, 3);
  EXPECT_EQ(declarations.size(), 2u);
}

TEST_F(ReloadTest, TheSizesOfTheModelCannotChange) {
  const auto node = Begin();
  Copy([](const std::string& text) { return text; }, "bicycle");
  ExpectRefused(*node, "the number of states cannot change while");
  Copy([](const std::string& text) {
    const std::string without_obstacles = std::regex_replace(text, std::regex("obstacles:\n.*\n"), "obstacles: []\n");
    return std::regex_replace(without_obstacles, std::regex("projection: \\[px, py\\]"), "projection: [px]");
  });
  ExpectRefused(*node, "the number of safety coordinates cannot change while");
  EXPECT_EQ(status_.version, 1);
}

TEST_F(ReloadTest, RefusesATaskWithAnotherKey) {
  const std::string keys = MakeTestKeys(scratch_ / "keys"), others = MakeTestKeys(scratch_ / "others");
  const auto with_key = [&](const std::string& key) {
    Copy([&](const std::string& text) { return text + (key.empty() ? "" : "\nbus: {key: " + key + "}\n"); });
  };
  with_key(keys);
  const auto node = BeginWith(LoadConfig(path_));
  with_key("");
  ExpectRefused(*node, "bus.key is missing, it was");
  with_key(others);
  ExpectRefused(*node, "bus.key is ");
  with_key(keys);
  Reload(*node);
  EXPECT_EQ(status_.version, 2) << "the same key is taken";
  std::filesystem::rename(keys, scratch_ / "old");
  ExpectRefused(*node, "cannot be read");
  std::filesystem::rename(others, keys);
  ExpectRefused(*node, "holds other keys than at the start");
}

TEST_F(ReloadTest, AKeyThatTheCommandLineGaveStays) {
  Copy([](const std::string& text) { return text; });
  Config config = LoadConfig(path_);
  config.bus.key = MakeTestKeys(scratch_ / "keys");
  config.bus.key_is_given = true;
  const auto node = BeginWith(config);
  Reload(*node);
  EXPECT_EQ(status_.version, 2) << GetText(status_.message);
}

TEST_F(ReloadTest, ArmingAndQueueAreTheNewFilesToo) {
  const auto node = Begin();
  EXPECT_EQ(node->watch().state(), Watch::State::kDisarmed);
  Copy([](const std::string& text) {
    return std::regex_replace(text, std::regex("gate: \\{"), "gate: {arming: none, queue: 1, ");
  });
  Reload(*node);
  EXPECT_EQ(node->watch().state(), Watch::State::kArmed);
  std::map<int, int> causes;
  bus_->Subscribe("PLAN_DECISION", [&](const Received& r) { ++causes[Decoded<decision_t>(r.bytes).value().cause]; });
  for (int id = 1; id <= CertifierNode::kAtOnce + 3; ++id) bus_->Publish("PLAN_CANDIDATE", Candidate(id));
  bus_->Dispatch(0);
  node->Tick(kNow);
  bus_->Dispatch(0);
  EXPECT_EQ(causes[decision_t::CAUSE_QUEUE_FULL], 2);
  Copy([](const std::string& text) { return text; });
  Reload(*node);
  EXPECT_EQ(node->watch().state(), Watch::State::kDisarmed);
}

TEST_F(ReloadTest, NoDeclarationComesBackThatATransitionContradicts) {
  const auto node = Begin();
  bus_->Publish("TRANSITION", Executed(*node->gate().certifier().problem().model, Vec({0, 0, 2, 0.1, 0, 0}), 1));
  bus_->Dispatch(0);
  ASSERT_TRUE(node->gate().certifier().violation());
  const auto reload_with = [&](const std::string& noise) {
    Copy([&](const std::string& text) {
      return std::regex_replace(text, std::regex("noise_bound: \\[.*\\]"), "noise_bound: [2, 2, " + noise + ", 2]");
    });
    Reload(*node);
  };
  for (const std::string noise : {"0", "0.1"}) {
    reload_with(noise);
    EXPECT_TRUE(node->gate().certifier().violation()) << noise;
  }
  EXPECT_EQ(status_.failed_reloads, 2);
  reload_with("2");
  EXPECT_EQ(status_.version, 2);
  EXPECT_FALSE(node->gate().certifier().violation());
  reload_with("0.1");
  EXPECT_EQ(status_.failed_reloads, 3) << "nor after another";
}

TEST_F(ReloadTest, ReloadsOnceMoreForRequestsDuringAReload) {
  const auto node = Begin();
  for (int i = 0; i < 3; ++i) node->Reload();
  TickUntil(*node, [&] { return status_.version >= 3; });
  EXPECT_EQ(status_.version, 3) << "the first, and one for those asked for while it was under way";
}

}  // namespace forereach::reload_test
