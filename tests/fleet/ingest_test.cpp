#include "fleet/ingest.h"

#include <atomic>
#include <thread>

#include <sys/wait.h>

#include "logger/recorder.h"
#include "tests/cli/program.h"
#include "tests/fleet/postgres.h"
#include "tests/fleet/row_texts.h"
#include "tests/keys.h"
#include "tests/process/process_fixture.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"

namespace forereach::ingest_test {

namespace fs = std::filesystem;

constexpr std::int64_t kStart = 1'767'225'600'000'000;  // 2026-01-01
const std::string kName = "events-20260101-120000-000000.lcmlog";

class IngestTest : public PostgresTest {
 protected:
  void SetUp() override {
    PostgresTest::SetUp();
    if (server_) fs::create_directory(directory_);
    config_.logger.directory = directory_;
    config_.logger.flush_ms = 10;
  }

  // As the start of a logger does: makes the rows of the logs in the directory.
  void Recover() { Recorder(config_, FreeBytes); }
  Rows RowsOfDirectory() const { return Database(path_).Read(); }
  std::size_t DecisionsInLogs() const {
    std::size_t decisions = 0;
    for (const auto& file : fs::directory_iterator(directory_))
      if (file.path().extension() == ".lcmlog")
        for (const LogEvent& event : ReadLog(file.path().string()).events)
          decisions += event.channel == "PLAN_DECISION";
    return decisions;
  }
  // Until a query gives this.
  void WaitFor(const std::string& query, const std::string& wanted) {
    Store store(server_->Address());
    std::string got;
    for (const auto deadline = std::chrono::steady_clock::now() + kPatience;
         got != wanted && std::chrono::steady_clock::now() < deadline;) {
      got = store.Query(query).at(0).at(0).value_or("");
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    EXPECT_EQ(got, wanted) << query;
  }
  Rows RowsOfStore(const std::string& robot) {
    Rows rows;
    Store store(server_->Address());
    for (const RunRow& run : store.Runs(robot)) {
      Rows more = store.Read(robot, run.log_file);
      std::ranges::move(more.decisions, std::back_inserter(rows.decisions));
      std::ranges::move(more.events, std::back_inserter(rows.events));
      std::ranges::move(more.gaps, std::back_inserter(rows.gaps));
      std::ranges::move(more.transitions, std::back_inserter(rows.transitions));
    }
    return rows;
  }
  // `count` decisions and events in a row, one a millisecond, to a log that begins at `now_us`.
  void Record(int count, std::int64_t& now_us) {
    Recorder recorder(config_, FreeBytes);
    recorder.Begin(now_us);
    for (int i = 0; i < count; ++i, now_us += 1000) {
      for (const auto& [channel, data] :
           {std::pair{"PLAN_DECISION", Encode(MakeDecision(MakeCandidate(i, i), 2 * i, decision_t::CERTIFIED, 0))},
            std::pair{"EXECUTION_EVENT", Encode(MakeEvent(i, execution_event_t::STEP_INSIDE))}})
        recorder.Take({0, now_us, channel, data}, now_us);
      recorder.Tick(now_us);
    }
    recorder.End(now_us);
  }
  Output Ingest(const std::string& options) {
    return Forereach("ingest " + options + " --database '" + server_->Address() + "' 2>&1");
  }

  const ScratchDirectory scratch_;
  const std::string directory_ = scratch_ / "log", path_ = directory_ + "/decisions.sqlite";
  Config config_;
};

TEST_F(IngestTest, OfALogGivesTheRowsOfItsLogger) {
  fs::copy(kCourseLog, directory_ + "/" + kName);
  fs::copy(kCourseLog, scratch_ / kName);
  Recover();
  Store store(server_->Address());
  const Ingested of_directory =
      DatabaseIngest(path_, store, {.robot = "r1", .config = {}, .key = {}, .shard = {}}).Send();
  const Ingested of_log = IngestLogs({.robot = {}, .logs = {scratch_ / kName}, .database = {}, .missing = {}}, store,
                                     {.robot = "r2", .config = kCourseTask, .key = {}, .shard = {}});
  EXPECT_EQ(of_directory.decisions, kCourseDecisions);
  EXPECT_EQ(of_directory.added,
            of_directory.decisions + of_directory.events + of_directory.gaps + of_directory.transitions);
  EXPECT_EQ(of_log.added, of_directory.added);
  EXPECT_EQ(DifferenceOf(RowsOfStore("r1"), RowsOfDirectory()), "");
  EXPECT_EQ(DifferenceOf(RowsOfStore("r2"), RowsOfDirectory()), "");
}

TEST_F(IngestTest, ByTheProgramIsWholeOnceAndInShards) {
  fs::copy(kCourseLog, directory_ + "/" + kName);
  Recover();
  EXPECT_THAT(Ingest(directory_), Exits(2, "name the robot with --robot"));
  EXPECT_THAT(Ingest(directory_ + " --robot r1"),
              Exits(0, "ingest: 1 logs, 97 decisions, ", " of them are new in the store"));
  EXPECT_THAT(Ingest(directory_ + " --robot r1"), Exits(0, "ingest: 1 logs, 0 decisions", "; 0 of them are new"));
  for (const std::string& what : {directory_, kCourseLog + " --config " + kCourseTask})
    for (const int count : {1, 2, 7}) {
      const std::string robot = std::to_string(what.size()) + "-" + std::to_string(count);
      for (int number = count; number >= 1; --number)
        EXPECT_THAT(
            Ingest(what + " --robot " + robot + " --shard " + std::to_string(number) + "/" + std::to_string(count)),
            Exits(0));
      Rows rows = RowsOfStore(robot);
      EXPECT_EQ(rows.size(), RowsOfDirectory().size()) << robot;
    }
  EXPECT_THAT(Ingest(directory_ + " --robot r1 --shard 3/2"), Exits(2, "--shard: 3/2 is not I/N"));
  EXPECT_THAT(Forereach("ingest " + directory_ + " --database decisions.sqlite 2>&1"),
              Exits(2, "is no address of a PostgreSQL server"));
  EXPECT_THAT(
      Forereach("ingest " + directory_ + " --robot r1 --database 'postgresql:///x?host=" + scratch_.path() + "' 2>&1"),
      Exits(2, "no server answers there"));
}

TEST_F(IngestTest, NamesTheRobotOfTheLoggersKeys) {
  config_.bus.key = scratch_ / "keys";
  MakeKeys("of-keys", config_.bus.key);
  std::int64_t now = kStart;
  Record(3, now);
  Store store(server_->Address());
  static_cast<void>(DatabaseIngest(path_, store, {.robot = "other", .config = {}, .key = {}, .shard = {}}).Send());
  EXPECT_EQ(store.Runs("of-keys").size(), 1u);
  EXPECT_TRUE(store.Runs("other").empty());
}

// The server is killed again and again while a logger writes and its rows are sent.
TEST_F(IngestTest, LosesAndDoublesNoRowWhereTheServerIsKilled) {
  std::int64_t now = kStart;
  Record(10, now);
  Store store(server_->Address());
  DatabaseIngest ingest(path_, store, {.robot = "r1", .config = {}, .key = {}, .shard = {}});
  Ingested sum;
  int failed = 0;
  for (int round = 0; round < 6; ++round) {
    Record(500, now);
    std::thread killer;
    if (round % 2 == 0) killer = std::thread([&] { server_->Kill(); });
    for (bool is_sent = false; !is_sent;) try {
        sum += ingest.Send();
        is_sent = true;
      } catch (const StoreAway&) {
        ++failed;
        if (killer.joinable()) {
          killer.join();
          server_->Start();
        }
      }
    if (killer.joinable()) {
      killer.join();
      server_->Start();
    }
  }
  static_cast<void>(ingest.Send());
  EXPECT_GT(failed, 0) << "no kill came while rows were sent";
  EXPECT_EQ(RowsOfDirectory().decisions.size(), 3010u);
  EXPECT_EQ(DifferenceOf(RowsOfStore("r1"), RowsOfDirectory()), "");
}

// Logger and sender are killed again and again; each start goes on.
TEST_F(IngestTest, LosesAndDoublesNoRowWhereLoggerAndSenderAreKilled) {
  std::int64_t now = kStart;
  std::unique_ptr<ChildProcess> sender;
  for (int round = 0; round < 6; ++round) {
    sender = std::make_unique<ChildProcess>(std::vector<std::string>{
        FOREREACH_PROGRAM, "ingest", directory_, "--follow", "--robot", "r1", "--database", server_->Address()});
    const pid_t logger = fork();
    ASSERT_GE(logger, 0);
    if (logger == 0) {
      std::int64_t time = now;
      Record(1'000'000, time);
      _exit(0);
    }
    // Until the log is there and some rows of it are in the store, so that both are at work.
    WaitFor("SELECT count(DISTINCT log_file) FROM decisions", std::to_string(round + 1));
    if (round % 2 == 0) sender->Signal(SIGKILL);
    kill(logger, SIGKILL);
    waitpid(logger, nullptr, 0);
    if (round % 2 == 1) sender->Signal(SIGKILL);
    now += 3'600'000'000;
  }
  Recover();
  EXPECT_THAT(Ingest(directory_ + " --robot r1"), Exits(0));
  const Rows rows = RowsOfDirectory();
  EXPECT_GT(rows.decisions.size(), 100u);
  EXPECT_EQ(DifferenceOf(RowsOfStore("r1"), rows), "");
  EXPECT_EQ(rows.decisions.size(), DecisionsInLogs());
}

TEST_F(IngestTest, BesideTheLoggerSendsItsRowsToTheLast) {
  const std::string url = PrivateBusUrl();
  ChildProcess logger({FOREREACH_LOGGER, "--config", scratch_.Write("task.yaml", PatientTask()), "--lcm-url", url,
                       "--directory", directory_, "--database", server_->Address(), "--robot", "r1"});
  ASSERT_TRUE(logger.WaitForLog("recording to")) << logger.error();
  BusProbe probe(url, {"LOGGER_STATUS"});
  for (int i = 0; i < 20; ++i)
    probe.bus().Publish("PLAN_DECISION", MakeDecision(MakeCandidate(i, i), i, decision_t::CERTIFIED, 0));
  EXPECT_TRUE(probe.WaitUntil([&] { return RowsOfDirectory().decisions.size() == 20; }));
  EXPECT_EQ(logger.Terminate(), 0) << logger.error();
  WaitFor("SELECT count(*) FROM runs WHERE end_utime IS NOT NULL", "1");
  EXPECT_EQ(DifferenceOf(RowsOfStore("r1"), RowsOfDirectory()), "");
}

// Server and logger are killed at once while decisions come: in the middle of a transaction that waits for a lock, or
// whenever it happens. The logger starts again behind the server or before it.
TEST_F(IngestTest, LosesAndDoublesNoRowWhereServerAndLoggerAreKilledAtOnce) {
  const std::string url = PrivateBusUrl(), address = server_->Address();
  const std::string task = scratch_.Write("task.yaml", PatientTask() + "logger: {flush_ms: 10}\n");
  const auto start = [&] {
    return std::make_unique<ChildProcess>(std::vector<std::string>{FOREREACH_LOGGER, "--config", task, "--lcm-url", url,
                                                                   "--directory", directory_, "--database", address,
                                                                   "--robot", "r1"});
  };
  std::atomic<bool> is_over = false;
  std::thread gate([&] {
    BusProbe probe(url, {});
    for (int i = 0; !is_over; ++i) {
      probe.bus().Publish("PLAN_DECISION", MakeDecision(MakeCandidate(i, i), i, decision_t::CERTIFIED, 0));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  std::unique_ptr<ChildProcess> logger = start(), blocker;
  for (int round = 0; round < 4; ++round) {
    WaitFor("SELECT count(DISTINCT log_file) FROM decisions", std::to_string(round + 1));
    if (round % 2 == 0) {
      blocker = std::make_unique<ChildProcess>(std::vector<std::string>{
          Postgres::Programs() + "psql", "-X", address, "-c", "BEGIN; LOCK TABLE decisions; SELECT pg_sleep(60)"});
      WaitFor("SELECT count(*) FROM pg_locks WHERE NOT granted AND relation = 'decisions'::regclass", "1");
    }
    std::thread killer([&] { logger->Signal(SIGKILL); });
    server_->Kill();
    killer.join();
    EXPECT_TRUE(logger->WaitForEnd(kPatience));
    if (round < 2) logger = start();
    server_->Start();
    if (round >= 2) logger = start();
  }
  WaitFor("SELECT count(DISTINCT log_file) FROM decisions", "5");
  EXPECT_EQ(logger->Terminate(), 0) << logger->error();
  is_over = true;
  gate.join();
  WaitFor("SELECT count(*) FROM runs WHERE end_utime IS NOT NULL", "5");
  const Rows rows = RowsOfDirectory();
  EXPECT_GT(rows.decisions.size(), 100u);
  EXPECT_EQ(DifferenceOf(RowsOfStore("r1"), rows), "");
  EXPECT_EQ(rows.decisions.size(), DecisionsInLogs());
}

// It has hardly begun when it is told to end.
TEST_F(IngestTest, BesideALoggerThatEndsAtOnceSendsWhatTheDirectoryHas) {
  std::int64_t now = kStart;
  Record(20, now);
  ChildProcess logger({FOREREACH_LOGGER, "--config", scratch_.Write("task.yaml", PatientTask()), "--lcm-url",
                       PrivateBusUrl(), "--directory", directory_, "--database", server_->Address(), "--robot", "r1"});
  ASSERT_TRUE(logger.WaitForLog("recording to")) << logger.error();
  logger.Signal(SIGKILL);
  WaitFor("SELECT count(*) FROM decisions", "20");
}

TEST_F(IngestTest, KeepsTheRowsInTheDirectoryWhileTheServerIsAway) {
  std::int64_t now = kStart;
  Record(20, now);
  server_->Kill();
  ChildProcess sender(
      {FOREREACH_PROGRAM, "ingest", directory_, "--follow", "--robot", "r1", "--database", server_->Address()});
  ASSERT_TRUE(sender.WaitForLog("no server answers there; the rows wait in " + directory_)) << sender.error();
  server_->Start();
  ASSERT_TRUE(sender.WaitForLog("the store takes rows again")) << sender.error();
  Record(20, now);
  EXPECT_EQ(sender.Terminate(), 0);
  EXPECT_THAT(sender.output(), HasSubstr("ingest: 2 logs, 40 decisions, 40 execution events"));
  EXPECT_EQ(DifferenceOf(RowsOfStore("r1"), RowsOfDirectory()), "");
}

}  // namespace forereach::ingest_test
