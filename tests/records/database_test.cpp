#include "records/database.h"

#include "tests/records/logs.h"
#include "tests/records/sql.h"

namespace forereach::database_test {

Rows SampleRows() {
  return {.decisions = {{.event = {"a.lcmlog", 7, "d7"},
                         .utime = 11,
                         .candidate_utime = 12,
                         .sequence = 13,
                         .plan_id = 14,
                         .source = "planner",
                         .outcome = "abstain_safety",
                         .cause = "obstacle",
                         .message = "it's \"near\"; DROP TABLE decisions",
                         .step = 3,
                         .coordinate = 4,
                         .obstacle = 5,
                         .first_observation = 6,
                         .second_observation = 8,
                         .margin = 0.1,
                         .threshold = -INFINITY,
                         .elapsed_us = 1.5,
                         .shadow = 0,
                         .plan_digest = "00ff"}},
          .events = {{.event = {"a.lcmlog", 8, "e8"}, .kind = "goal_reached", .state = {0.1, -2, 1e300}, .value = 0.7}},
          .gaps = {{{"a.lcmlog", 9, "f9"}, "C", "s", 4, 6, 2, 15, "bus"}},
          .transitions = {{.event = {"a.lcmlog", 7, "a7"},
                           .utime = 3,
                           .sequence = 4,
                           .duration_us = 100'000,
                           .state = {0.1, -2},
                           .input = {1e300},
                           .next_state = {5, 6}}}};
}

struct DatabaseTest : testing::Test {
  const ScratchDirectory scratch_;
  const std::string path_ = scratch_ / "d.sqlite";
  Database database_{path_};
};

TEST_F(DatabaseTest, RowsSurviveARoundTrip) {
  database_.BeginRun("a.lcmlog", 10);
  EXPECT_EQ(database_.Write(SampleRows(), "a.lcmlog", 10), 4);
  const Rows rows = database_.Read("a.lcmlog");
  const DecisionRow& decision = Only(rows.decisions);
  EXPECT_FIELDS(decision, (event.event_number, 7), (utime, 11), (candidate_utime, 12), (sequence, 13), (plan_id, 14),
                (source, "planner"), (outcome, "abstain_safety"), (cause, "obstacle"),
                (message, SampleRows().decisions[0].message), (step, 3), (coordinate, 4), (obstacle, 5),
                (first_observation, 6), (second_observation, 8), (margin, 0.1), (threshold, -INFINITY),
                (elapsed_us, 1.5), (shadow, 0));
  EXPECT_TRUE(std::isnan(decision.latency_us));
  EXPECT_FIELDS(decision, (plan_digest, "00ff"), (event.digest, "d7"));
  EXPECT_FIELDS(Only(rows.events), (kind, "goal_reached"), (state, (std::vector<double>{0.1, -2, 1e300})), (value, 0.7),
                (event.digest, "e8"));
  EXPECT_FIELDS(Only(rows.transitions), (utime, 3), (sequence, 4), (duration_us, 100'000),
                (state, (std::vector<double>{0.1, -2})), (input, std::vector<double>{1e300}),
                (next_state, (std::vector<double>{5, 6})), (event.digest, "a7"));
  EXPECT_FIELDS(Only(rows.gaps), (expected, 4), (got, 6), (lost, 2), (reason, "bus"), (event.digest, "f9"));
  EXPECT_TRUE(database_.Read("b.lcmlog").empty());
}

TEST_F(DatabaseTest, WhatDoesNotApplyIsNullInAQueryAndAsBeforeInARow) {
  Rows rows = SampleRows();
  DecisionRow& decision = rows.decisions[0];
  decision.step = decision.coordinate = decision.obstacle = decision.first_observation = decision.second_observation =
      -1;
  rows.events[0].step = rows.events[0].coordinate = -1;
  rows.events[0].plan_id = -1;
  decision.obstacle = -7;  // no row of ours has it, and it stays what it is
  database_.BeginRun("a.lcmlog", 10);
  ASSERT_EQ(database_.Write(rows, "a.lcmlog", 10), 4);
  const Rows read = database_.Read("a.lcmlog");
  EXPECT_FIELDS(read, (decisions[0].step, -1), (decisions[0].second_observation, -1), (decisions[0].obstacle, -7),
                (events[0].plan_id, -1), (events[0].coordinate, -1));
  Sql(path_, R"sql(CREATE TABLE one (n INTEGER CHECK (n = 1)); INSERT INTO one
    SELECT count(*) FROM decisions JOIN execution_events
    WHERE decisions.step IS NULL AND decisions.coordinate IS NULL AND first_observation IS NULL
    AND second_observation IS NULL AND obstacle = -7 AND execution_events.step IS NULL
    AND execution_events.plan_id IS NULL AND execution_events.coordinate IS NULL)sql");
}

TEST_F(DatabaseTest, WritesARowOnce) {
  EXPECT_EQ(database_.Write(SampleRows(), "a.lcmlog", 10), 4);
  EXPECT_EQ(database_.Write(SampleRows(), "a.lcmlog", 10), 0);
  EXPECT_EQ(database_.Read().decisions.size(), 1u);
}

TEST(Database, KeepsRunsOverReopening) {
  const ScratchDirectory scratch;
  {
    Database database(scratch / "d.sqlite");
    database.BeginRun("a.lcmlog", 10);
    database.BeginRun("b.lcmlog", 20);
    ASSERT_TRUE(database.Write({}, "a.lcmlog", 5));
    database.EndRun("a.lcmlog", 15, "mended");
  }
  Database database(scratch / "d.sqlite");
  const std::vector<RunRow> runs = database.Runs();
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_FIELDS(runs[0], (log_file, "a.lcmlog"), (end_utime, 15), (events, 5), (recovered, "mended"));
  EXPECT_EQ(runs[1].end_utime, std::nullopt);
}

TEST_F(DatabaseTest, MarksDeletedLogsAndWhatContinuesWhat) {
  database_.BeginRun("a.lcmlog", 10);
  database_.BeginRun("b.lcmlog", 20, "a.lcmlog");
  database_.MarkLogDeleted("a.lcmlog", 30);
  const std::vector<RunRow> runs = database_.Runs();
  EXPECT_FIELDS(runs[0], (continues, ""), (log_deleted_utime, 30));
  EXPECT_FIELDS(runs[1], (continues, "a.lcmlog"), (log_deleted_utime, std::nullopt));
}

TEST_F(DatabaseTest, ReadsTheRowsOfSomeEvents) {
  Rows rows = SampleRows();
  rows.gaps.push_back(rows.gaps[0]);
  rows.gaps[1].event = {"a.lcmlog", -1, ""};
  rows.decisions[0].event = {"a.lcmlog", 9, "f9"};  // the event of the gap
  ASSERT_TRUE(database_.Write(rows, "a.lcmlog", 10));
  EXPECT_EQ(database_.ReadRange("a.lcmlog", 0, 9).size(), 4u) << "a gap without event is of none";
  EXPECT_EQ(database_.ReadRange("a.lcmlog", 0, 8).events.size(), 1u);
  EXPECT_TRUE(database_.ReadRange("a.lcmlog", 0, 8).decisions.empty());
  EXPECT_TRUE(database_.ReadRange("b.lcmlog", 0, 9).empty());
  EXPECT_THAT(database_.EventBlocks("a.lcmlog", 9), ElementsAre(0, 1));
  EXPECT_THAT(database_.EventBlocks("b.lcmlog", 9), IsEmpty());
}

TEST(Database, RefusesAnotherSchema) {
  const ScratchDirectory scratch;
  { const Database database(scratch / "d.sqlite"); }
  for (const int version : {0, Database::kSchemaVersion - 1, Database::kSchemaVersion + 1}) {
    Sql(scratch / "d.sqlite", "PRAGMA user_version = " + std::to_string(version));
    EXPECT_THAT([&] { const Database database(scratch / "d.sqlite"); },
                ThrowsMessage<DatabaseError>(
                    AllOf(HasSubstr("schema version " + std::to_string(version)), HasSubstr("d.sqlite"))));
  }
}

TEST(Database, RefusesAnotherProgramsFile) {
  const ScratchDirectory scratch;
  Sql(scratch / "d.sqlite", "CREATE TABLE other (x)");
  EXPECT_THROW(Database(scratch / "d.sqlite"), DatabaseError);
  WriteBytes(scratch / "text", std::vector<std::uint8_t>(5000, 'x'));
  EXPECT_THROW(Database(scratch / "text"), DatabaseError);
  EXPECT_THROW(Database(scratch / "no/such/directory"), DatabaseError);
}

TEST_F(DatabaseTest, WritesAllOrNothing) {
  Sql(path_, "CREATE TRIGGER full BEFORE INSERT ON gaps BEGIN SELECT RAISE(ABORT, 'database or disk is full'); END");
  EXPECT_EQ(database_.Write(SampleRows(), "a.lcmlog", 10), std::nullopt);
  EXPECT_THAT(database_.problem(), HasSubstr("d.sqlite: it refuses a row"));
  EXPECT_TRUE(database_.Read().empty());
  Sql(path_, "DROP TRIGGER full");
  EXPECT_EQ(database_.Write(SampleRows(), "a.lcmlog", 10), 4);
}

}  // namespace forereach::database_test
