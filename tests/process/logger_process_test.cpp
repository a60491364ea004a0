// forereach-logger as a process: its files contain the messages of the bus when it ends.
#include "tests/test.h"

#include "tests/messages.h"
#include "tests/process/process_fixture.h"

namespace forereach::logger_process_test {

TEST(LoggerProcessTest, RecordsAndEndsWithASummary) {
  const ScratchDirectory scratch;
  const std::string path = scratch.Write("task.yaml", PatientTask()), directory = scratch / "recorded";
  const Config config = LoadConfig(path);
  BusProbe probe(PrivateBusUrl(), {"PLAN_CANDIDATE"});
  ChildProcess logger({FOREREACH_LOGGER, "--config", path, "--lcm-url", PrivateBusUrl(), "--directory", directory});
  ASSERT_TRUE(logger.WaitForLog("ready on")) << logger.error();

  constexpr int kCandidates = 20;
  for (int i = 0; i < kCandidates; ++i) {
    candidate_plan_t candidate = CandidateFor(config, i + 1, Eigen::Vector2d(0, 0));
    candidate.sequence = i;
    probe.bus().Publish("PLAN_CANDIDATE", candidate);
    // One after the other: all hear the same datagrams.
    ASSERT_TRUE(probe.WaitUntil([&] { return std::ssize(probe.heard("PLAN_CANDIDATE")) == i + 1; }));
  }
  probe.bus().Publish("SOMETHING_ELSE", decision_t{});
  probe.ListenFor(std::chrono::milliseconds(300));
  EXPECT_EQ(logger.Terminate(), 0) << logger.error();
  EXPECT_NE(logger.output(), "");

  std::uintmax_t log_bytes = 0;
  for (const auto& file : std::filesystem::directory_iterator(directory))
    if (file.path().extension() == ".lcmlog") log_bytes += file.file_size();
  EXPECT_GE(log_bytes, kCandidates * EncodedSize<candidate_plan_t>());
}

// Exit status 1 tells whoever started it that something which it had confirmed is gone.
TEST(LoggerProcessTest, ExitsWithOneIfItsLogWasDeleted) {
  const ScratchDirectory scratch;
  const std::string path = scratch.Write("task.yaml", PatientTask()), directory = scratch / "recorded";
  BusProbe probe(PrivateBusUrl(), {"LOGGER_STATUS"});
  ChildProcess logger({FOREREACH_LOGGER, "--config", path, "--lcm-url", PrivateBusUrl(), "--directory", directory});
  ASSERT_TRUE(logger.WaitForLog("ready on")) << logger.error();
  const auto confirms = [&](std::int64_t events) {
    return probe.WaitUntil([&] {
      const auto heard = probe.Heard<logger_status_t>("LOGGER_STATUS");
      return !heard.empty() && heard.back().events_written >= events;
    });
  };
  ASSERT_TRUE(confirms(1));
  for (const auto& file : std::filesystem::directory_iterator(directory))
    if (file.path().extension() == ".lcmlog") std::filesystem::remove(file.path());
  EXPECT_TRUE(probe.WaitUntil([&] { return probe.Heard<logger_status_t>("LOGGER_STATUS").back().events_lost > 0; }));
  EXPECT_EQ(logger.Terminate(), 1) << logger.error();
  EXPECT_NE(logger.output().find("confirmed events are gone"), std::string::npos) << logger.output();
}

}  // namespace forereach::logger_process_test
