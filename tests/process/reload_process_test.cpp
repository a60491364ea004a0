// Reloads of a process whose task file stopped being a file, or whose mount stalls: it stays, says so, and ends in
// time.
#include <csignal>

#include <sys/stat.h>

#include "tests/test.h"

#include "tests/process/process_fixture.h"

namespace forereach::reload_process_test {

struct ReloadProcessTest : testing::TestWithParam<const char*> {
  void SetUp() override { ASSERT_TRUE(process_.WaitForLog("ready on")) << process_.error(); }
  [[nodiscard]] const char* taken() const {
    return std::string(GetParam()) == FOREREACH_CERTIFIER ? "version 2 of" : "as it is now are accepted";
  }
  void Restore() const {
    std::filesystem::remove_all(path_);
    scratch_.Write("task.yaml", PatientTask());
  }

  const ScratchDirectory scratch_;
  const std::string path_ = scratch_.Write("task.yaml", PatientTask()), marker_ = scratch_ / "stalled";
  ChildProcess process_{{"/usr/bin/env", std::string("LD_PRELOAD=") + FOREREACH_STALLED_MOUNT_LIBRARY,
                         "FOREREACH_STALLED_MOUNT=" + marker_, SanitizerAfterPreload(), GetParam(), "--config", path_,
                         "--lcm-url", PrivateBusUrl()}};
};

TEST_P(ReloadProcessTest, RefusesAFileThatIsNotRegularAndTakesTheNext) {
  std::filesystem::remove(path_);
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
  process_.Signal(SIGHUP);
  EXPECT_TRUE(process_.WaitForLog("task.yaml: is a pipe, not a regular file")) << process_.error();
  Restore();
  std::filesystem::remove(path_);
  std::filesystem::create_symlink("/dev/zero", path_);
  process_.Signal(SIGHUP);
  EXPECT_TRUE(process_.WaitForLog("task.yaml: is a device, not a regular file")) << process_.error();
  Restore();
  process_.Signal(SIGHUP);
  EXPECT_TRUE(process_.WaitForLog(taken())) << process_.error();
  EXPECT_EQ(process_.Terminate(), 0) << process_.error();
}

TEST_P(ReloadProcessTest, EndsDuringAReadThatNeverEnds) {
  std::ofstream(marker_) << "";
  process_.Signal(SIGHUP);
  EXPECT_TRUE(process_.WaitForLog("does not answer")) << process_.error();
  EXPECT_EQ(process_.Terminate(), 0) << process_.error();
}

TEST_P(ReloadProcessTest, ReloadsAgainDuringAReadThatNeverEnds) {
  std::ofstream(marker_) << "";
  process_.Signal(SIGHUP);
  EXPECT_TRUE(process_.WaitForLog("does not answer")) << process_.error();
  std::filesystem::remove(marker_);
  process_.Signal(SIGHUP);
  EXPECT_TRUE(process_.WaitForLog(taken())) << process_.error();
  EXPECT_EQ(process_.Terminate(), 0) << process_.error();
}

INSTANTIATE_TEST_SUITE_P(All, ReloadProcessTest, testing::Values(FOREREACH_CERTIFIER, FOREREACH_ROBOT_SIM),
                         [](const auto& info) { return info.index == 0 ? "Certifier" : "Robot"; });

}  // namespace forereach::reload_process_test
