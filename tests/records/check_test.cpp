#include "records/check.h"

#include <cctype>

#include "tests/test.h"

#include "records/database.h"
#include "records/interpreter.h"
#include "records/kept_tasks.h"
#include "tests/paths.h"
#include "tests/records/logs.h"

namespace forereach::check_test {

class CheckTest : public testing::Test {
 protected:
  // A log of five execution events, every one with its row.
  CheckTest() : database_(scratch_ / "decisions.sqlite") {
    EventLogWriter writer(log_);
    for (std::int64_t i = 0; i < 5; ++i)
      writer.Append(i, "EXECUTION_EVENT", Encode(MakeEvent(i, execution_event_t::STARTED)));
    EXPECT_TRUE(writer.Flush());
    Interpreter interpreter({}, "a.lcmlog");
    Rows rows;
    for (const LogEvent& event : ReadLog(log_).events) interpreter.Observe(event, rows);
    database_.BeginRun("a.lcmlog", 1);
    EXPECT_EQ(database_.Write(rows, "a.lcmlog", 5), 5);
    database_.EndRun("a.lcmlog", 2);
  }

  [[nodiscard]] LogCheck Check() const { return CheckLogs(scratch_.path()).at(0); }

  const ScratchDirectory scratch_;
  const std::string log_ = scratch_ / "a.lcmlog";
  static constexpr std::size_t kRecord = 28 + 15 + 336;
  Database database_;
};

TEST_F(CheckTest, AnUndamagedLogIsReportedWhole) {
  const LogCheck check = Check();
  EXPECT_TRUE(check.whole_log());
  EXPECT_EQ(check.whole, 5);
  EXPECT_THAT(ToText({check}), HasSubstr("a.lcmlog: 5 events of rows whole\n1 logs, 0 not as recorded"));
}

TEST_F(CheckTest, EveryChangedByteIsSeen) {
  const std::vector<std::uint8_t> whole = ReadBytes(log_);
  for (std::size_t at = 2 * kRecord; at < 3 * kRecord; ++at) {
    std::vector<std::uint8_t> bytes = whole;
    bytes[at] ^= 4;
    WriteBytes(log_, bytes);
    const LogCheck check = Check();
    ASSERT_FALSE(check.whole_log()) << at;
    ASSERT_EQ(check.whole, 4) << at;
    ASSERT_EQ(check.changed.size() + check.missing.size(), 1u) << at;
    ASSERT_EQ((check.changed.empty() ? check.missing : check.changed)[0], 2) << at;
  }
}

TEST_F(CheckTest, ACutTailAndDamageAreSaid) {
  std::vector<std::uint8_t> bytes = ReadBytes(log_);
  bytes[kRecord] ^= 1;
  bytes.resize(bytes.size() - 10);
  WriteBytes(log_, bytes);
  const LogCheck check = Check();
  EXPECT_THAT(check.missing, ElementsAre(1, 4));
  EXPECT_EQ(check.damage.places, 1);
  EXPECT_EQ(check.cut_bytes, static_cast<std::int64_t>(kRecord) - 10);
  EXPECT_THAT(ToText({check}), HasSubstr("  missing: event 1, 4\n"));
  EXPECT_EQ(ToJson({check})[0]["missing"], (std::vector<int>{1, 4}));
}

TEST_F(CheckTest, ALogThatNoRunKnowsIsListed) {
  std::filesystem::copy(log_, scratch_ / "events-20260101-120000-000000.lcmlog");
  const std::vector<LogCheck> checks = CheckLogs(scratch_.path());
  ASSERT_EQ(checks.size(), 2u);
  EXPECT_EQ(checks[1].log, LogCheck::Log::kUnknown);
  EXPECT_FALSE(checks[1].whole_log());
  EXPECT_THAT(ToText(checks), HasSubstr("2 logs, 1 not as recorded"));
  EXPECT_EQ(ToJson(checks)[1]["state"], "unknown");
}

TEST_F(CheckTest, AMissingLogIsAFaultUnlessItWasDeletedForTheQuota) {
  std::filesystem::remove(log_);
  EXPECT_EQ(Check().log, LogCheck::Log::kMissing);
  EXPECT_FALSE(Check().whole_log());
  database_.MarkLogDeleted("a.lcmlog", 9);
  EXPECT_EQ(Check().log, LogCheck::Log::kDeleted);
  EXPECT_TRUE(Check().whole_log());
  EXPECT_EQ(Check().missing.size(), 5u);
  EXPECT_THAT(ToText({Check()}), HasSubstr("deleted for the quota"));
}

TEST_F(CheckTest, AnEventWithoutItsDigestIsAnotherEvent) {
  Rows rows;
  rows.gaps.resize(1);
  rows.gaps[0].event = {"a.lcmlog", 3, ""};
  ASSERT_EQ(database_.Write(rows, "a.lcmlog", 5), 1);
  EXPECT_THAT(Check().changed, ElementsAre(3));
  EXPECT_FALSE(Check().whole_log());
}

TEST_F(CheckTest, WithoutADatabaseItSaysSoAndMakesNone) {
  const ScratchDirectory empty;
  EXPECT_THROW((void)CheckLogs(empty.path()), BadInput);
  EXPECT_THROW((void)CheckLogs(empty / "none"), BadInput);
  EXPECT_FALSE(std::filesystem::exists(empty / "none"));
}

TEST_F(CheckTest, ADamagedKeptTaskIsSeen) {
  const Config task = LoadConfig(FOREREACH_SOURCE_DIR "/tests/data/course.yaml");
  KeptTasks(scratch_.path()).Keep(CopyTask(task));
  Rows rows;
  DecisionRow& row = rows.decisions.emplace_back();
  row.event = {"a.lcmlog", 0, ToHex(DigestOf(ReadLog(log_).events.front()))};
  row.grounds[0] = ToHex(task.grounds.config);
  ASSERT_EQ(database_.Write(rows, "a.lcmlog", 5), 1);
  EXPECT_TRUE(Check().whole_log());
  const std::string transitions = KeptTasks(scratch_.path()).PathOf(task.grounds.config) + "/transitions-" +
                                  ToHex(task.grounds.observations) + ".csv";
  std::vector<std::uint8_t> bytes = ReadBytes(transitions);
  const auto header_end = std::ranges::find(bytes, '\n');
  const auto digit = std::find_if(header_end, bytes.end(), [](std::uint8_t byte) { return std::isdigit(byte); });
  ASSERT_NE(digit, bytes.end());
  *digit = *digit == '1' ? '2' : '1';
  WriteBytes(transitions, bytes);
  const LogCheck check = Check();
  EXPECT_FALSE(check.whole_log());
  ASSERT_EQ(check.damaged_tasks.size(), 1u);
  EXPECT_THAT(ToText({check}), HasSubstr("  task: "));
  EXPECT_EQ(ToJson({check})[0]["damaged_tasks"].size(), 1u);
}

}  // namespace forereach::check_test
