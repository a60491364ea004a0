// Which logs belong together, and whose they are.
#include "records/run_logs.h"

#include "forereach/logger_status_t.hpp"
#include "records/log_survey.h"
#include "records/output_file.h"
#include "tests/records/logs.h"

namespace forereach::run_logs_test {

struct RunLogsTest : testing::Test {
  // A log with the logger's heartbeats [first, last], a second apart.
  std::string Log(const std::string& name, std::int64_t first, std::int64_t last) const {
    const std::string path = scratch_ / name;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    EventLogWriter writer(path);
    for (std::int64_t sequence = first; sequence <= last; ++sequence) {
      writer.Append(1'000'000 * sequence, "LOGGER_STATUS", Encode(logger_status_t{.sequence = sequence}));
    }
    EXPECT_TRUE(writer.Flush());
    return path;
  }
  static std::vector<std::vector<std::string>> LogsOf(const NamedRuns& named) {
    std::vector<std::vector<std::string>> logs;
    for (const RunLogs& run : named.runs) logs.push_back(run.logs);
    return logs;
  }

  const ScratchDirectory scratch_;
};

TEST_F(RunLogsTest, LogsThatGoOnAreOneRun) {
  const std::string a = Log("a", 0, 3), b = Log("b", 4, 6), c = Log("c", 2, 9);
  const NamedRuns one = RunsNamedBy({a, b}, 2);
  EXPECT_THAT(LogsOf(one), ElementsAre(ElementsAre(a, b)));
  EXPECT_FALSE(one.is_many);
  const NamedRuns two = RunsNamedBy({a, b, c}, 2);
  EXPECT_THAT(LogsOf(two), ElementsAre(ElementsAre(a, b), ElementsAre(c)));
  EXPECT_TRUE(two.is_many);
  EXPECT_THAT([&] { static_cast<void>(RunsNamedBy({b, a}, 1)); }, ThrowsMessage<BadInput>(HasSubstr("go on from it")));
}

TEST_F(RunLogsTest, ALongLogGoesOnByItsEnds) {
  const auto log = [&](const std::string& name, std::int64_t first, std::int64_t last) {
    EventLogWriter writer(scratch_ / name);
    const auto beat = [&](std::int64_t sequence) {
      writer.Append(1'000'000 * sequence, "LOGGER_STATUS", Encode(logger_status_t{.sequence = sequence}));
    };
    beat(first);
    for (int i = 0; i < 100; ++i) writer.Append(1'000'000 * first, "CAMERA", std::vector<std::uint8_t>(100'000));
    beat(last);
    for (int i = 0; i < 10; ++i) writer.Append(1'000'000 * last, "CAMERA", std::vector<std::uint8_t>(100'000));
    EXPECT_TRUE(writer.Flush());
    return scratch_ / name;
  };
  const std::string a = log("a", 0, 5), b = log("b", 6, 9);
  EXPECT_FIELDS(EndsOf(a), (logger.first, 0), (logger.last, 5), (utime.first, 0), (utime.last, 5'000'000));
  EXPECT_THAT(LogsOf(RunsNamedBy({a, b}, 1)), ElementsAre(ElementsAre(a, b)));
}

TEST_F(RunLogsTest, LogsNamedByLcmLoggerAreLogs) {
  const std::string a = Log("night/1.lcmlog", 0, 3), b = Log("night/lcmlog-2026-01-01.00", 0, 2);
  EXPECT_THAT(LogsOf(RunsNamedBy({scratch_ / "night"}, 1)), ElementsAre(ElementsAre(a), ElementsAre(b)));
}

TEST_F(RunLogsTest, ADirectoryIsReadWithItsSubdirectories) {
  const std::string a = Log("night/a/1.lcmlog", 0, 3), b = Log("night/a/2.lcmlog", 4, 6),
                    c = Log("night/b/log/1.lcmlog", 7, 9), unknown = Log("night/b/log/2.lcmlog", 5, 4);
  scratch_.Write("night/a/notes.txt", "no log");
  std::filesystem::create_symlink(a, scratch_ / "night/b/log/0.lcmlog");
  std::filesystem::create_directory_symlink(scratch_.path(), scratch_ / "night/loop");
  std::filesystem::create_symlink("/dev/zero", scratch_ / "night/zero.lcmlog");
  const NamedRuns named = RunsNamedBy({scratch_ / "night"}, 2);
  EXPECT_THAT(named.missing, IsEmpty());
  EXPECT_THAT(LogsOf(named), ElementsAre(ElementsAre(a, b), ElementsAre(c), ElementsAre(unknown)))
      << "a log without heartbeats continues none, and that of another directory neither";
  EXPECT_FIELDS(named, (runs[0].robot, scratch_ / "night/a"), (runs[1].robot, scratch_ / "night/b/log"));
  EXPECT_TRUE(named.is_many);
}

TEST_F(RunLogsTest, ADatabaseKnowsItsRunsAndItsRobot) {
  const std::string one = Log("log/events-1.lcmlog", 0, 3), two = Log("log/events-2.lcmlog", 0, 3),
                    other = Log("log/other.lcmlog", 4, 6), database = scratch_ / "log/decisions.sqlite";
  {
    Database rows(database);
    rows.BeginRun("events-0.lcmlog", 1, "", "rover");
    rows.MarkLogDeleted("events-0.lcmlog", 2);
    rows.BeginRun("events-1.lcmlog", 3, "events-0.lcmlog", "rover");
    rows.BeginRun("events-2.lcmlog", 4);
  }
  for (const std::string& input : {database, scratch_ / "log"}) {
    const NamedRuns named = RunsNamedBy({input}, 1);
    ASSERT_EQ(named.runs.size(), input == database ? 2u : 3u);
    EXPECT_FIELDS(named.runs[0], (robot, "rover"), (missing.at(0).log_file, "events-0.lcmlog"));
    EXPECT_THAT(named.runs[0].logs, ElementsAre(one));
    EXPECT_EQ(named.runs[1].robot, scratch_ / "log");
    EXPECT_THAT(named.missing, ElementsAre("events-0.lcmlog: the log was deleted for the quota"));
    if (input != database) EXPECT_THAT(named.runs[2].logs, ElementsAre(other)) << "no database lists it";
  }
}

TEST_F(RunLogsTest, WhatIsNamedTwiceIsAnError) {
  const std::string a = Log("log/a.lcmlog", 0, 3);
  std::filesystem::create_symlink(a, scratch_ / "link");
  std::filesystem::create_hard_link(a, scratch_ / "hard");
  const std::string log = scratch_ / "log";
  const std::vector<std::vector<std::string>> wrong{
      {a, a}, {a, scratch_ / "link"}, {a, scratch_ / "hard"}, {log, a}, {a, log}, {log, log}, {log, log + "/../log"}};
  for (const std::vector<std::string>& inputs : wrong) try {
      static_cast<void>(RunsNamedBy(inputs, 1));
      FAIL() << inputs[1];
    } catch (const BadInput& error) {
      EXPECT_THAT(error.what(), HasSubstr("named twice"));
    }
  std::filesystem::create_directory(scratch_ / "empty");
  EXPECT_THROW(static_cast<void>(RunsNamedBy({scratch_ / "empty"}, 1)), BadInput);
  EXPECT_THROW(static_cast<void>(RunsNamedBy({scratch_ / "none"}, 1)), BadInput);
}

TEST(OutputFile, HasItsNameOnlyOnceItIsWhole) {
  const ScratchDirectory scratch;
  const auto files = [&] {
    return std::distance(std::filesystem::directory_iterator(scratch.path()), std::filesystem::directory_iterator());
  };
  {
    OutputFile file(scratch / "a");
    file.Write("text");
    EXPECT_FALSE(std::filesystem::exists(scratch / "a"));
  }
  EXPECT_EQ(files(), 0) << "it was not closed";
  OutputFile file(scratch / "a"), rival(scratch / "a"), replaces(scratch / "a", OutputFile::Existing::kReplaced);
  file.Write("text");
  file.Close();
  EXPECT_THROW(rival.Close(), OutputError) << "another appeared meanwhile";
  EXPECT_EQ(Read(scratch / "a"), "text");
  replaces.Write("new");
  replaces.Close();
  EXPECT_EQ(Read(scratch / "a"), "new");
  EXPECT_THROW(OutputFile(scratch / "a"), OutputError);
  EXPECT_THROW(OutputFile(scratch / "none/a"), OutputError);
  GiveName(scratch / "a", scratch / "b");
  EXPECT_EQ(Read(scratch / "b"), "new");
  EXPECT_THROW(GiveName(scratch / "a", scratch / "b"), OutputError);
  EXPECT_EQ(std::filesystem::status(scratch / "a").permissions() & std::filesystem::perms::group_read,
            std::filesystem::perms::group_read);
}

}  // namespace forereach::run_logs_test
