#include "records/check.h"
#include "records/row_check.h"

#include <cctype>

#include "records/database.h"
#include "records/kept_tasks.h"
#include "tests/keys.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"
#include "tests/records/sql.h"

namespace forereach::check_test {

struct CheckTest : testing::Test {
  // A log of five execution events, every one with its row.
  CheckTest() : database_(scratch_ / "decisions.sqlite") {
    EventLogWriter writer(log_);
    for (std::int64_t i = 0; i < 5; ++i)
      writer.Append(i, "EXECUTION_EVENT", Encode(MakeEvent(i, execution_event_t::STARTED)));
    EXPECT_TRUE(writer.Flush());
    const Rows rows = RowsOf(log_, "a.lcmlog");
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
  EXPECT_FIELDS(check, (damage.places, 1), (cut_bytes, static_cast<std::int64_t>(kRecord) - 10));
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
  const Config task = LoadConfig(kCourseTask);
  KeptTasks(scratch_.path()).Keep(CopyTask(task));
  decision_t decision = MakeDecision(MakeCandidate(0, 1), 0, decision_t::CERTIFIED, decision_t::CAUSE_NONE);
  SetDigest(decision.config_digest, task.grounds.config);
  SetDigest(decision.observations_digest, task.grounds.observations);
  EventLogWriter writer(log_);
  writer.Append(9, "PLAN_DECISION", Encode(decision));
  ASSERT_TRUE(writer.Flush());
  Rows rows;
  Interpreter({}, "a.lcmlog").Observe(ReadLog(log_).events.back(), rows);
  ASSERT_EQ(database_.Write(rows, "a.lcmlog", 6), 1);
  EXPECT_TRUE(Check().whole_log()) << ToText({Check()});
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

// A log of candidates, decisions and execution events, each with its row, and with gaps.
struct RowsTest : testing::Test {
  RowsTest() {
    EventLogWriter writer(log_);
    std::int64_t utime = 1000;
    const auto append = [&](const char* channel, const auto& message) {
      writer.Append(utime += 10, channel, Encode(message));
    };
    for (std::int64_t i = 0; i < 4; ++i) {
      const candidate_plan_t candidate = MakeCandidate(i, 100 + i);
      append("PLAN_CANDIDATE", candidate);
      decision_t decision = MakeDecision(candidate, 2 * i, decision_t::ABSTAIN_SAFETY, decision_t::CAUSE_OBSTACLE);
      decision.margin = 0.5;
      append("PLAN_DECISION", decision);
      execution_event_t event = MakeEvent(3 * i, execution_event_t::STEP_INSIDE);
      event.num_states = 2;
      event.state[0] = std::numeric_limits<double>::infinity();
      event.state[1] = std::nan("");
      append("EXECUTION_EVENT", event);
    }
    EXPECT_TRUE(writer.Flush());
    Database database(path_);
    Rows rows = RowsOf(log_, "a.lcmlog");
    rows.gaps.push_back({{"a.lcmlog", -1, ""}, "CAMERA", "", -1, -1, 7, 1, "queue"});
    database.BeginRun("a.lcmlog", 1);
    EXPECT_EQ(database.Write(rows, "a.lcmlog", 12), 4 + 4 + 6 + 1);
    database.EndRun("a.lcmlog", 2);
    database.Checkpoint();
  }

  void TearDown() override { EXPECT_TRUE(Check({}).empty()) << "what was damaged was made whole again"; }

  auto Sql(const std::string& statement) const { return forereach::Sql(path_, statement); }

  // What is amiss in a copy of the database after the statement.
  [[nodiscard]] std::vector<std::string> Check(const std::string& statement) const {
    const std::string whole = scratch_ / "whole";
    std::filesystem::copy_file(path_, whole);
    if (!statement.empty()) Sql(statement);
    std::vector<std::string> amiss;
    for (const LogCheck& check : CheckLogs(scratch_.path()))
      if (!check.whole_log()) amiss.push_back(ToText({check}));
    for (const char* ending : {"-wal", "-shm"}) std::filesystem::remove(path_ + ending);
    std::filesystem::rename(whole, path_);
    return amiss;
  }

  const ScratchDirectory scratch_;
  const std::string log_ = scratch_ / "a.lcmlog", path_ = scratch_ / "decisions.sqlite";
};

TEST_F(RowsTest, AnyOtherValueInARowIsSeen) {
  int tried = 0;
  for (const std::string table : {"decisions", "execution_events"})
    for (const auto& column : Sql("SELECT name, type FROM pragma_table_info('" + table + "')"))
      for (const auto& row : Sql("SELECT rowid FROM " + table + " WHERE event_number IS NOT NULL")) {
        const std::string& name = column[0];
        const std::string other = name == "state"       ? "'[1]'"
                                  : column[1] == "TEXT" ? "'other'"
                                                        : "coalesce(" + name + ", 4) + 100";
        ++tried;
        EXPECT_EQ(Check("UPDATE " + table + " SET " + name + " = " + other + " WHERE rowid = " + row[0]).empty(), false)
            << table << "." << name << " of " << row[0];
      }
  EXPECT_GT(tried, 140);
}

TEST_F(RowsTest, ADeletedRowIsSeen) {
  for (const std::string table : {"decisions", "execution_events", "runs"})
    for (const auto& row : Sql("SELECT rowid FROM " + table))
      EXPECT_FALSE(Check("DELETE FROM " + table + " WHERE rowid = " + row[0]).empty()) << table << " " << row[0];
}

TEST_F(RowsTest, AnAddedRowIsSeen) {
  for (const std::string table : {"decisions", "execution_events"})
    for (const auto& row : Sql("SELECT log_file, event_number, event_digest FROM decisions UNION SELECT log_file, "
                               "event_number, event_digest FROM execution_events"))
      EXPECT_EQ(Check("CREATE TEMP TABLE added AS SELECT * FROM " + table +
                      " LIMIT 1; UPDATE added SET event_number = " + row[1] + ", event_digest = '" + row[2] +
                      "'; INSERT OR IGNORE INTO " + table + " SELECT * FROM added WHERE NOT EXISTS (SELECT 1 FROM " +
                      table + " WHERE event_number = " + row[1] + ")")
                    .empty(),
                !Sql("SELECT 1 FROM " + table + " WHERE event_number = " + row[1]).empty())
          << table << " " << row[1];
}

// Of a database that does not keep its rows unique, as one that was altered byte by byte.
TEST(RowComparison, ASecondRowOfAnEventIsSeen) {
  Rows rows;
  for (const std::int64_t event : {7, 8, 8, 9}) rows.decisions.push_back({.event = {"a.lcmlog", event, ""}});
  RowGrounds grounds;
  RowComparison comparison(grounds);
  comparison.Take({.decisions = {rows.decisions[0], rows.decisions[1], rows.decisions[3]}}, rows);
  comparison.TakeRecorded(rows);
  EXPECT_THAT(comparison.Finish(), ElementsAre("decisions, event 8: it has a second row"));
}

TEST_F(RowsTest, TheSentenceNamesTableEventAndColumn) {
  EXPECT_THAT(Check("UPDATE decisions SET outcome = 'certified', margin = NULL WHERE event_number = 4"),
              ElementsAre(AllOf(HasSubstr("  row: decisions, event 4: outcome certified, by its event abstain_safety; "
                                          "margin nothing, by its event 0.5\n"),
                                HasSubstr("1 rows other than their events say"))));
  EXPECT_THAT(Check("DELETE FROM execution_events WHERE event_number = 5"),
              ElementsAre(HasSubstr("row: execution_events, event 5: its row is missing")));
  EXPECT_THAT(Check("DELETE FROM decisions; DELETE FROM execution_events"),
              ElementsAre(HasSubstr("8 rows other than their events say")));
  EXPECT_THAT(Check("UPDATE decisions SET log_file = 'b.lcmlog' WHERE event_number = 4"),
              ElementsAre(HasSubstr("its row is missing"), HasSubstr("b.lcmlog: missing, 1 rows have no event")));
}

TEST_F(RowsTest, WhatALoggerThatIsStillRunningHasNotWrittenYetIsNotMissing) {
  const std::string unended = "UPDATE runs SET end_utime = NULL, events = 4; ";
  EXPECT_THAT(Check(unended + "DELETE FROM decisions WHERE event_number >= 4"), IsEmpty());
  EXPECT_THAT(Check(unended + "DELETE FROM decisions WHERE event_number >= 1"), SizeIs(1));
}

TEST_F(RowsTest, OfARunWithKeysOnlyAuthenticMessagesHaveRows) {
  const std::string keyed = "UPDATE runs SET robot = 'test'; ";
  EXPECT_THROW((void)Check(keyed), ConfigError);
  std::filesystem::rename(scratch_ / "whole", path_);
  Sql(keyed);
  EXPECT_TRUE(CheckLogs(scratch_.path(), "", {.none = true}).at(0).whole_log());
  const std::string keys = MakeTestKeys(scratch_ / "keys");
  EXPECT_EQ(CheckLogs(scratch_.path(), "", {.file = keys}).at(0).rows.size(), 8u) << "no message is signed";
  Sql("DELETE FROM decisions; DELETE FROM execution_events; DELETE FROM gaps");
  EXPECT_TRUE(CheckLogs(scratch_.path(), "", {.file = keys}).at(0).whole_log());
  EXPECT_EQ(CheckLogs(scratch_.path(), "", {.none = true}).at(0).rows.size(), 8u);
  Sql("UPDATE runs SET log_deleted_utime = 1");
  std::filesystem::remove(log_);
}

}  // namespace forereach::check_test
