// The tasks of a logger's runs are kept next to its logs, including those of reloads, as long as a log needs them.
#include "records/kept_tasks.h"

#include "forereach/certifier_status_t.hpp"
#include "tests/logger/disk_fixture.h"
#include "tests/paths.h"
#include "tests/task/task_files.h"

namespace forereach::kept_tasks_test {

namespace fs = std::filesystem;

struct KeptTest : DiskTest {
  KeptTest() {
    fs::copy(FOREREACH_SOURCE_DIR "/tests/data/course_transitions.csv", scratch_ / "course_transitions.csv");
    Write("");
    StartWithTask();
  }
  void Write(const std::string& more) { scratch_.Write("task.yaml", text_ + more); }
  [[nodiscard]] Config Task() const { return LoadConfig(scratch_ / "task.yaml"); }
  void StartWithTask() {
    const LoggerOptions options = config_.logger;
    config_ = Task();
    config_.logger = options;
    Start();
    node_->Tick(bus_.now_us += 1000);
  }
  void Heartbeat(const Digest& config, std::int64_t version) {
    certifier_status_t status{.sequence = heartbeats_++, .version = version};
    SetDigest(status.config_digest, config);
    bus_.Publish("CERTIFIER_STATUS", status);
    node_->Tick(bus_.now_us += 2'000'000);
  }
  void Decide(const Digest& config) {
    const candidate_plan_t candidate = MakeCandidate(fed_, fed_);
    decision_t decision = MakeDecision(candidate, fed_++, decision_t::CERTIFIED, 0);
    SetDigest(decision.config_digest, config);
    bus_.Publish("PLAN_CANDIDATE", candidate);
    bus_.Publish("PLAN_DECISION", decision);
    node_->Tick(bus_.now_us += 20'000);
  }
  [[nodiscard]] bool IsKept(const Digest& digest) const {
    return KeptTasks(scratch_ / "log").Find(digest, {}).has_value();
  }

  const std::string text_ = Read(FOREREACH_SOURCE_DIR "/tests/data/course.yaml");
  std::int64_t heartbeats_ = 0;
};

TEST_F(KeptTest, AReloadedTaskIsKeptIfItIsTheOneThatTheHeartbeatNames) {
  const Digest first = Task().grounds.config;
  EXPECT_TRUE(IsKept(first));
  Heartbeat(first, 1);
  Write("# more\n");
  const Digest second = Task().grounds.config;
  Digest unknown = second;
  unknown[0] ^= 1;
  Heartbeat(unknown, 2);
  EXPECT_FALSE(IsKept(second)) << "somebody else's";
  Heartbeat(second, 3);
  EXPECT_TRUE(IsKept(second));
  EXPECT_FALSE(IsKept(unknown));
  Stop();
}

TEST(KeptTasks, AModelFileIsKeptWithItsTask) {
  const ScratchDirectory scratch;
  const std::string model =
      "model: {states: {x: m}, inputs: {u: m/s}, parameters: {dt: 0.1, gain: 2}, next: {x: x + dt*gain*u}}\n";
  scratch.Write("model.yaml", "no model");  // the name of the copy
  scratch.Write("gain.yaml", model);
  scratch.Write("steps.csv", "x,u,x_next\n0,1,0.2\n");
  const Config config =
      LoadConfig(scratch.Write("task.yaml", TaskFor("model: {file: gain.yaml, parameters: {dt: 0.2}}\n", 1, 1, "x")));
  const KeptTasks kept(scratch / "log");
  kept.Keep(CopyTask(config));
  scratch.Write("gain.yaml", "model: {}\n");
  EXPECT_THROW((void)CopyTask(config), ConfigError) << "the task is another one now";
  fs::remove(scratch / "gain.yaml");

  const std::optional<Config> found = kept.Find(config.grounds.config, {});
  ASSERT_TRUE(found.has_value());
  EXPECT_FIELDS(*found, (grounds.model, config.grounds.model),
                (problem->model->text()->equations, config.problem->model->text()->equations), (period, 0.2));
  const std::string hex = ToHex(config.grounds.config), copy = kept.PathOf(config.grounds.config) + "/model.yaml";
  EXPECT_TRUE(kept.FindDamage(hex).empty());
  std::ofstream(copy, std::ios::app) << "# more\n";
  EXPECT_FALSE(kept.FindDamage(hex).empty());
  fs::remove(copy);
  EXPECT_FALSE(kept.FindDamage(hex).empty());
  kept.Remove(hex);
  EXPECT_FALSE(fs::exists(kept.PathOf(config.grounds.config)));
}

// The grounds name all rows of the file, also the last, which within its error lies outside the domain.
TEST(KeptTasks, TransitionsThatAreLeftOutAreKeptToo) {
  const ScratchDirectory scratch;
  const std::string task =
      TaskFor("model: {states: {x: m}, inputs: {u: m/s}, parameters: {dt: 0.1}, next: {x: x}}\n", 1, 1, "x");
  scratch.Write("steps.csv", "x,u,x_next\n0,1,0\n0.9,0,0.9\n");
  const Config config = LoadConfig(
      scratch.Write("task.yaml", Replaced(task, "noise_bound: [0]}", "noise_bound: [0], state_error: {x: 0.2}}")));
  ASSERT_EQ(config.left_out, 1);
  const KeptTasks kept(scratch / "log");
  kept.Keep(CopyTask(config));
  const std::optional<Config> found = kept.Find(config.grounds.config, {});
  ASSERT_TRUE(found.has_value());
  EXPECT_FIELDS(*found, (grounds, config.grounds), (problem->transitions.z, config.problem->transitions.z));
  EXPECT_TRUE(kept.FindDamage(ToHex(config.grounds.config)).empty());
}

TEST_F(KeptTest, ADeletedDirectoryGetsItsTasksAgain) {
  fs::remove_all(scratch_ / "log");
  fs::remove(scratch_ / "task.yaml");
  Feed(20);
  EXPECT_TRUE(IsKept(config_.grounds.config));
  Stop();
}

TEST_F(KeptTest, TheQuotaTakesATaskWithTheLastLogThatNeedsIt) {
  const Digest first = config_.grounds.config;
  Decide(first);
  Stop();
  Write("# more\n");
  config_.logger.rotate_mb = 0.02;
  config_.logger.quota_mb = 0.06;
  StartWithTask();
  const Digest second = config_.grounds.config;
  Decide(first);  // as of a certifier that has not reloaded yet
  EXPECT_TRUE(IsKept(first));
  const std::string needs = node_->recorder().log_path();
  while (fs::exists(needs)) {
    EXPECT_TRUE(IsKept(first));
    Decide(second);
  }
  EXPECT_FALSE(IsKept(first));
  EXPECT_TRUE(IsKept(second));
  Stop();
}

}  // namespace forereach::kept_tasks_test
