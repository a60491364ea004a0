#include "records/database.h"

#include <sqlite3.h>

#include "tests/test.h"

#include "tests/records/logs.h"

namespace forereach::database_test {

void Sql(const std::string& path, const char* sql) {
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(handle, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(handle);
  sqlite3_close(handle);
}

Rows SampleRows() {
  Rows rows;
  DecisionRow& decision = rows.decisions.emplace_back();
  decision.event = {"a.lcmlog", 7, "d7"};
  decision.utime = 11;
  decision.candidate_utime = 12;
  decision.sequence = 13;
  decision.plan_id = 14;
  decision.source = "planner";
  decision.outcome = "abstain_safety";
  decision.cause = "obstacle";
  decision.message = "it's \"near\"; DROP TABLE decisions";
  decision.step = 3;
  decision.coordinate = 4;
  decision.obstacle = 5;
  decision.first_observation = 6;
  decision.second_observation = 8;
  decision.margin = 0.1;
  decision.threshold = -INFINITY;
  decision.elapsed_us = 1.5;
  decision.plan_digest = "00ff";
  EventRow& event = rows.events.emplace_back();
  event.event = {"a.lcmlog", 8, "e8"};
  event.kind = "goal_reached";
  event.state = {0.1, -2, 1e300};
  event.value = 0.7;
  GapRow& gap = rows.gaps.emplace_back();
  gap.event = {"a.lcmlog", 9, "f9"};
  gap.channel = "C";
  gap.source = "s";
  gap.expected = 4;
  gap.got = 6;
  gap.lost = 2;
  gap.utime = 15;
  gap.reason = "bus";
  return rows;
}

TEST(Database, RowsSurviveARoundTrip) {
  const ScratchDirectory scratch;
  Database database(scratch / "d.sqlite");
  database.BeginRun("a.lcmlog", 10);
  EXPECT_EQ(database.Write(SampleRows(), "a.lcmlog", 10), 3);
  const Rows rows = database.Read("a.lcmlog");
  ASSERT_EQ(rows.decisions.size(), 1u);
  const DecisionRow& decision = rows.decisions[0];
  EXPECT_EQ(decision.event.event_number, 7);
  EXPECT_EQ(decision.utime, 11);
  EXPECT_EQ(decision.candidate_utime, 12);
  EXPECT_EQ(decision.sequence, 13);
  EXPECT_EQ(decision.plan_id, 14);
  EXPECT_EQ(decision.source, "planner");
  EXPECT_EQ(decision.outcome, "abstain_safety");
  EXPECT_EQ(decision.cause, "obstacle");
  EXPECT_EQ(decision.message, SampleRows().decisions[0].message);
  EXPECT_EQ(decision.step, 3);
  EXPECT_EQ(decision.coordinate, 4);
  EXPECT_EQ(decision.obstacle, 5);
  EXPECT_EQ(decision.first_observation, 6);
  EXPECT_EQ(decision.second_observation, 8);
  EXPECT_EQ(decision.margin, 0.1);
  EXPECT_EQ(decision.threshold, -INFINITY);
  EXPECT_EQ(decision.elapsed_us, 1.5);
  EXPECT_TRUE(std::isnan(decision.latency_us));
  EXPECT_EQ(decision.plan_digest, "00ff");
  EXPECT_EQ(decision.event.digest, "d7");
  ASSERT_EQ(rows.events.size(), 1u);
  EXPECT_EQ(rows.events[0].kind, "goal_reached");
  EXPECT_EQ(rows.events[0].state, (std::vector<double>{0.1, -2, 1e300}));
  EXPECT_EQ(rows.events[0].value, 0.7);
  EXPECT_EQ(rows.events[0].event.digest, "e8");
  ASSERT_EQ(rows.gaps.size(), 1u);
  EXPECT_EQ(rows.gaps[0].expected, 4);
  EXPECT_EQ(rows.gaps[0].got, 6);
  EXPECT_EQ(rows.gaps[0].lost, 2);
  EXPECT_EQ(rows.gaps[0].reason, "bus");
  EXPECT_EQ(rows.gaps[0].event.digest, "f9");
  EXPECT_TRUE(database.Read("b.lcmlog").empty());
}

TEST(Database, WhatDoesNotApplyIsNullInAQueryAndAsBeforeInARow) {
  const ScratchDirectory scratch;
  const std::string path = scratch / "d.sqlite";
  Rows rows = SampleRows();
  DecisionRow& decision = rows.decisions[0];
  decision.step = decision.coordinate = decision.obstacle = decision.first_observation = decision.second_observation =
      -1;
  rows.events[0].step = rows.events[0].coordinate = -1;
  rows.events[0].plan_id = -1;
  decision.obstacle = -7;  // no row of ours has it, and it stays what it is
  Database database(path);
  database.BeginRun("a.lcmlog", 10);
  ASSERT_EQ(database.Write(rows, "a.lcmlog", 10), 3);
  const Rows read = database.Read("a.lcmlog");
  EXPECT_EQ(read.decisions[0].step, -1);
  EXPECT_EQ(read.decisions[0].second_observation, -1);
  EXPECT_EQ(read.decisions[0].obstacle, -7);
  EXPECT_EQ(read.events[0].plan_id, -1);
  EXPECT_EQ(read.events[0].coordinate, -1);
  Sql(path, R"sql(CREATE TABLE one (n INTEGER CHECK (n = 1)); INSERT INTO one
    SELECT count(*) FROM decisions JOIN execution_events
    WHERE decisions.step IS NULL AND decisions.coordinate IS NULL AND first_observation IS NULL
    AND second_observation IS NULL AND obstacle = -7 AND execution_events.step IS NULL
    AND execution_events.plan_id IS NULL AND execution_events.coordinate IS NULL)sql");
}

TEST(Database, WritesARowOnce) {
  const ScratchDirectory scratch;
  Database database(scratch / "d.sqlite");
  EXPECT_EQ(database.Write(SampleRows(), "a.lcmlog", 10), 3);
  EXPECT_EQ(database.Write(SampleRows(), "a.lcmlog", 10), 0);
  EXPECT_EQ(database.Read().decisions.size(), 1u);
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
  EXPECT_EQ(runs[0].log_file, "a.lcmlog");
  EXPECT_EQ(runs[0].end_utime, 15);
  EXPECT_EQ(runs[0].events, 5);
  EXPECT_EQ(runs[0].recovered, "mended");
  EXPECT_EQ(runs[1].end_utime, std::nullopt);
}

TEST(Database, MarksDeletedLogsAndWhatContinuesWhat) {
  const ScratchDirectory scratch;
  Database database(scratch / "d.sqlite");
  database.BeginRun("a.lcmlog", 10);
  database.BeginRun("b.lcmlog", 20, "a.lcmlog");
  database.MarkLogDeleted("a.lcmlog", 30);
  const std::vector<RunRow> runs = database.Runs();
  EXPECT_EQ(runs[0].continues, "");
  EXPECT_EQ(runs[0].log_deleted_utime, 30);
  EXPECT_EQ(runs[1].continues, "a.lcmlog");
  EXPECT_EQ(runs[1].log_deleted_utime, std::nullopt);
}

TEST(Database, ReferencesAreThoseOfAllTables) {
  const ScratchDirectory scratch;
  Database database(scratch / "d.sqlite");
  Rows rows = SampleRows();
  rows.gaps.push_back(rows.gaps[0]);
  rows.gaps[1].event = {"a.lcmlog", -1, ""};
  rows.decisions[0].event = {"a.lcmlog", 9, "f9"};  // the event of the gap
  ASSERT_TRUE(database.Write(rows, "a.lcmlog", 10));
  const std::vector<LogReference> references = database.References("a.lcmlog");
  ASSERT_EQ(references.size(), 2u) << "an event once, a gap without event not at all";
  EXPECT_EQ(references[0].event_number, 8);
  EXPECT_EQ(references[0].digest, "e8");
  EXPECT_EQ(references[1].event_number, 9);
  EXPECT_EQ(references[1].digest, "f9");
  EXPECT_TRUE(database.References("b.lcmlog").empty());
}

TEST(Database, RefusesAnotherSchema) {
  const ScratchDirectory scratch;
  { const Database database(scratch / "d.sqlite"); }
  for (const int version : {0, Database::kSchemaVersion - 1, Database::kSchemaVersion + 1}) {
    Sql(scratch / "d.sqlite", ("PRAGMA user_version = " + std::to_string(version)).c_str());
    EXPECT_THAT([&] { const Database database(scratch / "d.sqlite"); },
                ThrowsMessage<DatabaseError>(testing::AllOf(
                    testing::HasSubstr("schema version " + std::to_string(version)), testing::HasSubstr("d.sqlite"))));
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

TEST(Database, WritesAllOrNothing) {
  const ScratchDirectory scratch;
  Database database(scratch / "d.sqlite");
  Sql(scratch / "d.sqlite",
      "CREATE TRIGGER full BEFORE INSERT ON gaps BEGIN SELECT RAISE(ABORT, 'database or disk is full'); END");
  EXPECT_EQ(database.Write(SampleRows(), "a.lcmlog", 10), std::nullopt);
  EXPECT_THAT(database.problem(), testing::HasSubstr("d.sqlite: it refuses a row"));
  EXPECT_TRUE(database.Read().empty());
  Sql(scratch / "d.sqlite", "DROP TRIGGER full");
  EXPECT_EQ(database.Write(SampleRows(), "a.lcmlog", 10), 3);
}

}  // namespace forereach::database_test
