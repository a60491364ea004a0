#include "fleet/store.h"

#include "tests/fleet/postgres.h"
#include "tests/fleet/row_texts.h"
#include "tests/library_texts.h"

namespace forereach::store_test {

constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max(),
                       kLeast = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kDay = 1'767'225'600'000'000;  // 2026-01-01

// Rows of one log with what a database could choke on.
Rows ExtremeRows(const std::string& log = "a.lcmlog") {
  constexpr char kHostile[] = "a\0b\\x00\xff\xfe\xc3( \xf0\x9f\x9a\x97\t\n\r'\"; DROP TABLE decisions; \\. \\N";
  const std::string hostile(kHostile, sizeof kHostile - 1);
  Rows rows;
  const double numbers[] = {NAN, INFINITY, -INFINITY, 3, 5e-324, 1.7976931348623157e308, 0.1};
  for (int i = 0; i < 7; ++i) {
    DecisionRow& row = rows.decisions.emplace_back();
    row.event = {log, i, "digest" + std::to_string(i), i == 5 ? kMost : i == 6 ? kLeast : kDay + i};
    row.utime = i % 2 ? kMost : kLeast;
    row.sequence = kLeast;
    row.plan_id = kMost;
    row.source = row.message = row.cause = hostile;
    row.outcome = "certified";
    row.step = i == 1 ? std::numeric_limits<int>::max() : i == 2 ? std::numeric_limits<int>::min() : -1;
    row.margin = numbers[i];
    row.threshold = -numbers[i];
    row.grounds[2] = std::string("\0\0", 2);
    EventRow& event = rows.events.emplace_back();
    event.event = row.event;
    event.event.event_number = kMost - i;
    event.kind = hostile;
    event.state = {NAN, 5e-324, 1.7976931348623157e308, 0.1};
    event.value = numbers[i];
    TransitionRow& transition = rows.transitions.emplace_back();
    transition.event = row.event;
    transition.duration_us = kLeast;
    transition.state = transition.next_state = event.state;
    transition.input = {numbers[3]};
    GapRow& gap = rows.gaps.emplace_back();
    gap.event = {log, i < 3 ? -1 : i, "", kDay + i};
    gap.channel = gap.source = gap.reason = hostile;
    gap.lost = i < 2 ? kMost : i;
    gap.utime = kDay + i;
  }
  return rows;
}

TEST(Store, TextOfAnyBytesIsPlainAndComesBack) {
  std::string all;
  for (int i = 0; i < 256; ++i) all += static_cast<char>(i);
  const std::string stored = ToStoredText(all + all);
  EXPECT_TRUE(std::ranges::all_of(stored, [](char c) { return c >= 0x20 && c < 0x7F; }));
  EXPECT_EQ(FromStoredText(stored), all + all);
  EXPECT_EQ(ToStoredText("the robot may touch obstacle 0 (by 0.04 m)"), "the robot may touch obstacle 0 (by 0.04 m)");
  for (const std::string plain : {"\\x00", "\\", "\\x5c", "\\x", "\\xg0", ""})
    EXPECT_EQ(FromStoredText(ToStoredText(plain)), plain);
}

TEST(Store, TakesNoOtherAddressThanAServers) {
  for (const std::string address : {"", "decisions.sqlite", "host=localhost", "postgresql://[::1", "http://a/b",
                                    "postgresql:///a?secret=hunter2", "postgresql://%zz/"})
    EXPECT_THAT(Thrown<StoreError>([&] { Store store(address); }),
                AllOf(HasSubstr("--database: no address of a PostgreSQL server"), Not(HasSubstr("hunter2"))))
        << address;
}

TEST(Store, TakesNoPasswordThatACommandLineShows) {
  for (const std::string address : {"postgresql://user:hunter2@/fleet", "postgresql:///fleet?password=hunter2",
                                    "postgresql:///a?sslpassword=hunter2"})
    EXPECT_THAT(Thrown<StoreError>([&] { Store store(address); }),
                AllOf(HasSubstr("~/.pgpass"), Not(HasSubstr("hunter2"))))
        << address;
}

TEST(Store, SaysThatNoServerIsThere) {
  const ScratchDirectory scratch;
  Store store("postgresql://user@/fleet?host=" + scratch.path());
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(Thrown<StoreAway>([&] { static_cast<void>(store.Runs("r1")); }), "the store: no server answers there");
}

class StoreTest : public PostgresTest {};

TEST_F(StoreTest, KeepsEachRowAsSqliteDoes) {
  const ScratchDirectory scratch;
  Database database(scratch / "d.sqlite");
  Store store(server_->Address());
  Rows rows = ExtremeRows();
  rows.decisions[0].margin = -0.0;
  rows.events[0].state = {-0.0, INFINITY, -INFINITY, 1};  // in a list there is no infinity
  ASSERT_EQ(database.Write(rows, "a.lcmlog", 0), static_cast<int>(rows.size()));
  EXPECT_EQ(store.Write("r1", rows), rows.size());
  const Rows read = store.Read("r1", "a.lcmlog");
  EXPECT_EQ(read.size(), rows.size());
  EXPECT_EQ(DifferenceOf(read, database.Read()), "");
}

TEST_F(StoreTest, HasEachRowOnceHoweverOftenItIsSent) {
  Store store(server_->Address()), other(server_->Address());
  Rows rows = ExtremeRows(), first = rows;
  first.decisions.resize(2), first.events.resize(3), first.gaps.resize(4), first.transitions.resize(5);
  EXPECT_EQ(store.Write("r1", first), 14);
  EXPECT_EQ(other.Write("r1", rows), rows.size() - 14);
  EXPECT_EQ(store.Write("r1", rows), 0);
  EXPECT_EQ(store.Count("r1", "a.lcmlog"), (RowCounts{7, 7, 7, 7}));
  EXPECT_EQ(store.Write("r2", rows), rows.size()) << "another robot's log of the same name";
  EXPECT_EQ(store.Write("r1", ExtremeRows("b.lcmlog")), rows.size()) << "another log";
}

TEST_F(StoreTest, RefusesAnotherEventOfTheSameNumber) {
  Store store(server_->Address());
  Rows rows = ExtremeRows();
  static_cast<void>(store.Write("r1", rows));
  Rows other = rows;
  other.decisions[3].event.digest = "of another log";
  other.events[0].event.event_number = 77;  // and this one is new
  EXPECT_THAT(Thrown<StoreError>([&] { static_cast<void>(store.Write("r1", other)); }),
              HasSubstr("a.lcmlog, event 3: it has another event of this number and time"));
  EXPECT_EQ(DifferenceOf(store.Read("r1", "a.lcmlog"), rows), "") << "something was written nevertheless";
}

TEST_F(StoreTest, ShowsTheLastStateOfARun) {
  Store store(server_->Address());
  RunRow run{.log_file = "a.lcmlog", .start_utime = 5, .robot = "ignored"};
  static_cast<void>(store.Write("r1", {}, {run}));
  run.end_utime = 9, run.events = 70, run.recovered = "a cut tail";
  static_cast<void>(store.Write("r1", {}, {run}));
  run.log_deleted_utime = 11;
  static_cast<void>(store.Write("r1", {}, {run, run}));
  run.log_deleted_utime.reset(), run.end_utime.reset(), run.events = 3;  // an old one arrives late
  static_cast<void>(store.Write("r1", {}, {run, {.log_file = "b.lcmlog", .start_utime = 1}}));
  const std::vector<RunRow> runs = store.Runs("r1");
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[0].log_file, "b.lcmlog");
  EXPECT_EQ(runs[1].end_utime, 9);
  EXPECT_EQ(runs[1].log_deleted_utime, 11);
  EXPECT_EQ(runs[1].robot, "r1");
  EXPECT_EQ(server_->Sql("SELECT count(*) FROM run_states").text, "5\n");
}

TEST_F(StoreTest, PutsEachMonthIntoAPartOfItsOwn) {
  Store store(server_->Address());
  static_cast<void>(store.Write("r1", ExtremeRows()));
  EXPECT_EQ(server_->Sql("SELECT count(*) FROM decisions_2026_01").text, "5\n");
  EXPECT_EQ(server_->Sql("SELECT count(*) FROM decisions_other").text, "2\n");
  // A row that is already where all others are keeps its month from a part, and nobody from writing.
  EXPECT_EQ(server_
                ->Sql("INSERT INTO decisions SELECT robot, log_file, event_number, event_utime + 86400000000 * 40, "
                      "utime, candidate_utime, sequence, source, plan_id, outcome, cause, step, coordinate, obstacle, "
                      "first_observation, second_observation, margin, threshold, elapsed_us, latency_us, shadow, "
                      "message, plan_digest, config_digest, model_digest, declaration_digest, observations_digest, "
                      "obstacles_digest, event_digest FROM decisions_2026_01")
                .code,
            0);
  Rows later = ExtremeRows();
  for (DecisionRow& row : later.decisions) row.event.utime = kDay + 86'400'000'000 * 41;
  EXPECT_GT(store.Write("r1", later), 0);
  EXPECT_EQ(server_->Sql("SELECT count(*) FROM decisions_other").text, "14\n");
}

TEST_F(StoreTest, ARobotAddsItsOwnRowsAndChangesNone) {
  Store owner(server_->Address());
  const Rows rows = ExtremeRows();
  static_cast<void>(owner.Write("r2", rows, {{.log_file = "a.lcmlog", .start_utime = 1}}));
  ASSERT_EQ(server_
                ->Sql("CREATE ROLE r1 LOGIN IN ROLE forereach_robot; CREATE ROLE analyst LOGIN IN ROLE "
                      "forereach_reader; CREATE ROLE stranger LOGIN")
                .code,
            0);
  Store robot(server_->Address("r1")), reader(server_->Address("analyst")), stranger(server_->Address("stranger"));
  const std::string refused =
      "the store: this user may not do that; the owner of the database makes the tables, see "
      "docs/fleet.md";
  EXPECT_EQ(robot.Write("r1", rows, {{.log_file = "a.lcmlog", .start_utime = 1}}), rows.size());
  EXPECT_EQ(robot.Write("r1", rows), 0);
  EXPECT_EQ(DifferenceOf(robot.Read("r1", "a.lcmlog"), rows), "");
  EXPECT_TRUE(robot.Read("r2", "a.lcmlog").empty()) << "another's";
  EXPECT_TRUE(robot.Runs("r2").empty());
  EXPECT_EQ(Thrown<StoreError>([&] { static_cast<void>(robot.Write("r2", ExtremeRows("b.lcmlog"))); }), refused);
  EXPECT_EQ(reader.Read("r1", "a.lcmlog").size(), rows.size());
  EXPECT_EQ(reader.Read("r2", "a.lcmlog").size(), rows.size());
  EXPECT_EQ(Thrown<StoreError>([&] { static_cast<void>(reader.Write("analyst", rows)); }), refused);
  EXPECT_EQ(Thrown<StoreError>([&] { static_cast<void>(stranger.Read("r1", "a.lcmlog")); }), refused);
  for (const std::string table : {"decisions", "execution_events", "gaps", "transitions", "run_states",
                                  "decisions_2026_01", "decisions_other", "forereach_schema"})
    for (const std::string user : {"r1", "analyst", "stranger"})
      for (const std::string& statement :
           {"UPDATE " + table + " SET " + (table == "forereach_schema" ? "version = 0" : "robot = 'r1'"),
            "DELETE FROM " + table, "TRUNCATE " + table, "DROP TABLE " + table,
            "ALTER TABLE " + table + " DISABLE ROW LEVEL SECURITY"})
        EXPECT_NE(server_->Sql(statement, user).code, 0) << user << ": " << statement;
  EXPECT_NE(server_->Sql("INSERT INTO decisions_2026_01 SELECT * FROM decisions", "r1").code, 0);
  EXPECT_NE(server_->Sql("INSERT INTO run_states (log_file, start_utime, robot) VALUES ('x', 1, 'r2')", "r1").code, 0);
  EXPECT_EQ(DifferenceOf(owner.Read("r2", "a.lcmlog"), rows), "");
}

TEST_F(StoreTest, SaysInItsOwnWordsWhyItRefuses) {
  Store store(server_->Address());
  static_cast<void>(store.Runs("r1"));
  const auto why = [&](const std::string& sql) {
    const std::string text = Thrown<StoreError>([&] { static_cast<void>(store.Query(sql)); });
    ExpectNoTextOfALibrary(text);
    EXPECT_THAT(text, AllOf(StartsWith("the store: "), Not(HasSubstr("ERROR")), Not(HasSubstr("hunter2"))));
    return text;
  };
  EXPECT_THAT(why("SELECT hunter2"), HasSubstr("tables are not those"));
  EXPECT_THAT(why("DO $$ BEGIN RAISE EXCEPTION 'hunter2\n\x1b[31m'; END $$"), HasSubstr("its error P0001"));
  EXPECT_THAT(why("DO $$ BEGIN RAISE EXCEPTION 'hunter2' USING ERRCODE = '57P01'; END $$"),
              HasSubstr("ends or restarts"));
  EXPECT_THAT(why("CREATE TABLE hunter2 (n INTEGER)"), HasSubstr("read-only"));
  EXPECT_THAT(why("SELECT 1/0"), HasSubstr("refuses a value"));
  EXPECT_THAT(Thrown<StoreAway>([&] { static_cast<void>(Store(server_->Address("nobody_here")).Runs("r1")); }),
              HasSubstr("refuses this user, password or database"));
  server_->Sql("UPDATE forereach_schema SET version = 9");
  EXPECT_THAT(Thrown<StoreError>([&] { static_cast<void>(Store(server_->Address()).Runs("r1")); }),
              HasSubstr("schema version 9, this program knows version 7"));
}

TEST_F(StoreTest, GoesOnAfterTheServerWasKilled) {
  Store store(server_->Address());
  static_cast<void>(store.Write("r1", ExtremeRows()));
  server_->Kill();
  EXPECT_THROW(static_cast<void>(store.Write("r1", ExtremeRows("b.lcmlog"))), StoreAway);
  EXPECT_THROW(static_cast<void>(store.Write("r1", ExtremeRows("b.lcmlog"))), StoreAway);
  server_->Start();
  EXPECT_EQ(store.Write("r1", ExtremeRows("b.lcmlog")), 28);
  EXPECT_EQ(store.Read("r1", "a.lcmlog").size(), 28u) << "what was confirmed is lost";
}

}  // namespace forereach::store_test
