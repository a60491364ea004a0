#include "logger/logger_node.h"

#include <csignal>

#include <sys/wait.h>
#include <unistd.h>

#include "tests/file_size_limit.h"
#include "tests/keys.h"
#include "tests/logger/direct_bus.h"
#include "tests/messages.h"
#include "tests/records/logs.h"

namespace forereach::logger_node_test {

struct LoggerNodeTest : testing::Test {
  LoggerNodeTest() { config_.logger.directory = scratch_ / "log"; }
  void TearDown() override { ExpectRowsOfTheLogs(config_.logger.directory, {.file = config_.bus.key}); }

  Rows ReadRows() { return Database(scratch_ / "log/decisions.sqlite").Read(); }
  std::vector<RunRow> Runs() { return Database(scratch_ / "log/decisions.sqlite").Runs(); }

  ScratchDirectory scratch_;
  Config config_;
  DirectBus bus_;
  std::ostringstream out_;
};

TEST_F(LoggerNodeTest, RecordsEverythingAndSummarises) {
  std::string log_path;
  {
    LoggerNode node(config_, bus_, out_);
    EXPECT_TRUE(node.recorder().recovered().empty());
    node.Tick(bus_.now_us);
    log_path = node.recorder().log_path();
    EXPECT_THAT(log_path, EndsWith("/events-20231114-221320-000000.lcmlog"));
    const candidate_plan_t first = MakeCandidate(0, 100), second = MakeCandidate(1, 101);
    bus_.Publish("PLAN_CANDIDATE", first);
    bus_.now_us += 150;
    bus_.Publish("PLAN_DECISION", MakeDecision(first, 0, decision_t::CERTIFIED, decision_t::CAUSE_NONE));
    bus_.Publish("PLAN_CANDIDATE", second);
    bus_.now_us += 350;
    bus_.Publish("PLAN_DECISION", MakeDecision(second, 1, decision_t::ABSTAIN_DOMAIN, decision_t::CAUSE_DOMAIN_EXIT));
    bus_.Publish("EXECUTION_EVENT", MakeEvent(0, execution_event_t::STEP_INSIDE));
    const std::vector<std::uint8_t> junk{1, 2, 3};
    bus_.Publish("PLAN_DECISION", Bytes(junk));
    bus_.Publish("ANYTHING_ELSE", Bytes(junk));
    node.Tick(bus_.now_us);
    node.Stop();
  }
  const LogContents log = ReadLog(log_path);
  EXPECT_EQ(log.end, LogStatus::kEnd);
  ASSERT_EQ(log.events.size(), 7u);
  EXPECT_FIELDS(log, (events[0].utime, kStart), (events[6].channel, "ANYTHING_ELSE"));

  const Rows rows = ReadRows();
  ASSERT_EQ(rows.decisions.size(), 2u);
  EXPECT_FIELDS(rows, (decisions[0].event.log_file, "events-20231114-221320-000000.lcmlog"),
                (decisions[0].event.event_number, 1), (decisions[0].latency_us, 150),
                (decisions[0].outcome, "certified"), (decisions[1].latency_us, 350),
                (decisions[1].cause, "domain_exit"), (decisions[1].source, "test"));
  ASSERT_EQ(rows.events.size(), 1u);
  EXPECT_FIELDS(rows, (events[0].kind, "step_inside"), (gaps.empty(), true));
  EXPECT_EQ(Runs()[0].end_utime, bus_.now_us);
  EXPECT_THAT(out_.str(), AllOf(HasSubstr(log_path), HasSubstr("domain_exit 1"), HasSubstr("PLAN_CANDIDATE 2"),
                                HasSubstr("p50 150.0 us, p99 350.0 us")));
}

TEST_F(LoggerNodeTest, FlushesOnTimeOnly) {
  config_.logger.flush_ms = 100;
  LoggerNode node(config_, bus_, out_);
  node.Tick(kStart);
  bus_.Publish("PLAN_DECISION", MakeDecision({}, 0, 1, 0));
  node.Tick(kStart + 99'999);
  EXPECT_EQ(std::filesystem::file_size(node.recorder().log_path()), 0u);
  node.Tick(kStart + 100'000);
  EXPECT_EQ(ReadLog(node.recorder().log_path()).events.size(), 1u);
  EXPECT_EQ(ReadRows().decisions.size(), 1u);
}

TEST_F(LoggerNodeTest, ARunNeverWritesIntoAnOlderFile) {
  for (int run = 0; run < 3; ++run) {
    DirectBus bus;
    LoggerNode node(config_, bus, out_);
    node.Tick(kStart);
    bus.Publish("C", MakeEvent(0, 1));
    node.Stop();
    EXPECT_EQ(ReadLog(node.recorder().log_path()).events.size(), 1u);
  }
  EXPECT_EQ(Runs().size(), 3u);
  EXPECT_EQ(Runs()[2].log_file, "events-20231114-221320-000002.lcmlog");
}

TEST_F(LoggerNodeTest, RecordsSequenceGapsAndRestarts) {
  LoggerNode node(config_, bus_, out_);
  node.Tick(kStart);
  const auto candidate = [this](std::int64_t sequence, const std::string& source) {
    bus_.Publish("PLAN_CANDIDATE", MakeCandidate(sequence, sequence, source));
  };
  candidate(7, "a");  // joined midway: what came before is not known to be lost
  candidate(0, "b");
  candidate(8, "a");
  candidate(11, "a");
  candidate(1, "b");
  candidate(0, "a");
  candidate(1, "a");
  bus_.Publish("OBSTACLES", obstacles_t{.sequence = 5});
  bus_.Publish("OBSTACLES", obstacles_t{.sequence = 9});
  node.Tick(kStart);
  node.Stop();
  const Rows rows = ReadRows();
  ASSERT_EQ(rows.gaps.size(), 3u);
  EXPECT_FIELDS(rows, (gaps[2].channel, "OBSTACLES"), (gaps[2].lost, 3), (gaps[0].channel, "PLAN_CANDIDATE"),
                (gaps[0].source, "a"), (gaps[0].expected, 9), (gaps[0].got, 11), (gaps[0].lost, 2),
                (gaps[0].reason, "bus"), (gaps[0].event.event_number, 3), (gaps[1].reason, "restart"),
                (gaps[1].lost, 0));
}

struct SignedLoggerTest : LoggerNodeTest {
  SignedLoggerTest() {
    config_.bus.key = MakeTestKeys(scratch_ / "keys");
    planner_.emplace(LoadAllKeys(config_.bus.key), "the bus");
  }

  [[nodiscard]] std::vector<std::uint8_t> Candidate(Signer& signer, std::int64_t sequence) const {
    return signer.Sign(Role::kPlanner, "PLAN_CANDIDATE", Encode(MakeCandidate(sequence, sequence)), bus_.now_us);
  }
  /** Candidates 0, 1 and 4, between them a repeated one and two of somebody without the key. */
  std::vector<std::vector<std::uint8_t>> Candidates() {
    Signer other(TestKeys("other"), "the bus");
    const auto first = Candidate(*planner_, 0);
    return {first,
            Encode(MakeCandidate(std::int64_t{1} << 41, 1)),
            Candidate(other, std::int64_t{1} << 40),
            first,
            Candidate(*planner_, 1),
            Candidate(*planner_, 4)};
  }
  static void ExpectOneGap(const Rows& rows) {
    EXPECT_FIELDS(Only(rows.gaps), (expected, 2), (got, 4), (lost, 2), (event.event_number, 5));
  }

  std::optional<Signer> planner_;
};

TEST_F(SignedLoggerTest, RecordsEverythingAndMakesRowsOfAuthenticMessagesOnly) {
  LoggerNode node(config_, bus_, out_);
  node.Tick(kStart);
  EXPECT_EQ(GetText(bus_.heartbeats.back().message), "recording");
  for (const auto& candidate : Candidates()) bus_.Publish("PLAN_CANDIDATE", Bytes(candidate));
  const decision_t decision = MakeDecision(MakeCandidate(4, 4), 0, decision_t::CERTIFIED, 0);
  bus_.Publish("PLAN_DECISION",
               Bytes(planner_->Sign(Role::kCertifier, "PLAN_DECISION", Encode(decision), bus_.now_us)));
  node.Tick(bus_.now_us += 600'000);
  EXPECT_THAT(GetText(bus_.heartbeats.back().message), HasSubstr("3 (unsigned 1, forged 1, replayed 1)"));
  EXPECT_EQ(bus_.heartbeats.back().state, logger_status_t::OK);
  node.Stop();
  EXPECT_THAT(out_.str(), HasSubstr("not authentic             3 (unsigned 1, forged 1, replayed 1)"));
  EXPECT_EQ(ReadLog(node.recorder().log_path()).events.size(), 7u);
  const Rows rows = ReadRows();
  ExpectOneGap(rows);
  EXPECT_EQ(Only(rows.decisions).latency_us, 0);
}

TEST_F(SignedLoggerTest, MakesMissingRowsAgainOfAuthenticMessagesOnly) {
  std::filesystem::create_directories(config_.logger.directory);
  {
    Database(scratch_ / "log/decisions.sqlite").BeginRun("a.lcmlog", kStart);
    EventLogWriter writer(scratch_ / "log/a.lcmlog");
    for (const auto& candidate : Candidates()) writer.Append(kStart + 500, "PLAN_CANDIDATE", candidate);
    ASSERT_TRUE(writer.Flush());
  }
  { const LoggerNode recovery(config_, bus_, out_); }
  ExpectOneGap(ReadRows());
}

TEST_F(SignedLoggerTest, AMessageSignedLongBeforeMakesNoRow) {
  bus_.now_us -= 10'000'000;
  const auto recorded = Candidate(*planner_, std::int64_t{1} << 40);
  bus_.now_us = kStart;
  LoggerNode node(config_, bus_, out_);
  node.Tick(kStart);
  for (const auto& candidate : {recorded, Candidate(*planner_, 0), Candidate(*planner_, 1)})
    bus_.Publish("PLAN_CANDIDATE", Bytes(candidate));
  node.Tick(kStart);
  node.Stop();
  EXPECT_TRUE(ReadRows().gaps.empty());
  EXPECT_EQ(node.recorder().interpreter().refusals().old, 1);
}

// The logger has the group key, readers of its log have not: TearDown holds its rows against theirs.
TEST_F(SignedLoggerTest, WhateverBitIsFlippedItsRowsAreThoseThatReadersMake) {
  config_.bus.keys = LoadKeys(config_.bus.key, Role::kLogger);
  LoggerNode node(config_, bus_, out_);
  node.Tick(kStart);
  const auto decision = [&](int sequence) {
    return planner_->Sign(Role::kCertifier, "PLAN_DECISION",
                          Encode(MakeDecision(MakeCandidate(sequence, sequence), sequence, decision_t::CERTIFIED, 0)),
                          bus_.now_us);
  };
  const std::size_t size = decision(0).size();
  for (std::size_t i = 1; i <= size; ++i) {
    auto flipped = decision(static_cast<int>(i));
    flipped[size - i] ^= static_cast<std::uint8_t>(1U << i % 8);
    bus_.Publish("PLAN_DECISION", Bytes(flipped));
  }
  node.Tick(bus_.now_us += 600'000);
  node.Stop();
  EXPECT_EQ(ReadRows().decisions.size(), sizeof(GroupTag)) << "its signature covers all but the tag";
}

TEST_F(LoggerNodeTest, RecordsAnOverflowOfItsQueueOnce) {
  config_.logger.queue = 4;
  LoggerNode node(config_, bus_, out_);
  node.Tick(kStart);
  for (int i = 0; i < 10; ++i) bus_.Publish("EXECUTION_EVENT", MakeEvent(i, execution_event_t::STARTED));
  node.Tick(kStart);
  for (int i = 11; i < 13; ++i) bus_.Publish("EXECUTION_EVENT", MakeEvent(i, execution_event_t::STARTED));
  node.Tick(kStart);
  bus_.dropped_count = 5;
  node.Tick(kStart);
  node.Stop();
  const Rows rows = ReadRows();
  EXPECT_EQ(rows.events.size(), 6u);
  ASSERT_EQ(rows.gaps.size(), 3u);
  EXPECT_EQ(rows.gaps[0].reason, "bus");
  EXPECT_EQ(rows.gaps[0].lost, 1) << "the six dropped here must not be counted again";
  EXPECT_FIELDS(rows, (gaps[1].reason, "backlog"), (gaps[1].lost, 5), (gaps[2].reason, "queue"),
                (gaps[2].channel, "EXECUTION_EVENT"), (gaps[2].lost, 6));
  EXPECT_THAT(out_.str(), HasSubstr("7 (bus 1, queue 6)"));
}

TEST_F(LoggerNodeTest, GoesOnAfterAFullDisk) {
  LoggerNode node(config_, bus_, out_);
  node.Tick(kStart);
  bus_.Publish("EXECUTION_EVENT", MakeEvent(0, execution_event_t::STARTED));
  node.Tick(kStart + 1'000'000);
  const auto size = std::filesystem::file_size(node.recorder().log_path());

  {
    const FileSizeLimit full(size + 10);
    for (int i = 1; i < 4; ++i) bus_.Publish("EXECUTION_EVENT", MakeEvent(i, execution_event_t::STARTED));
    node.Tick(kStart + 2'000'000);
  }
  EXPECT_EQ(std::filesystem::file_size(node.recorder().log_path()), size) << "no torn record stays";

  bus_.Publish("EXECUTION_EVENT", MakeEvent(4, execution_event_t::STANDING));
  node.Tick(kStart + 3'000'000);
  node.Stop();
  const LogContents log = ReadLog(node.recorder().log_path());
  ASSERT_EQ(log.events.size(), 2u);
  EXPECT_FIELDS(log, (events[1].number, 4), (damage.places, 0));
  const Rows rows = ReadRows();
  EXPECT_EQ(rows.events.size(), 2u);
  EXPECT_FIELDS(Only(rows.gaps), (reason, "disk"), (channel, "EXECUTION_EVENT"), (lost, 3));
}

TEST_F(LoggerNodeTest, SaysSoIfItCannotWrite) {
  WriteBytes(scratch_ / "file", {1});
  config_.logger.directory = scratch_ / "file/below";
  EXPECT_THROW(LoggerNode(config_, bus_, out_), LogError);
}

TEST_F(LoggerNodeTest, MakesMissingRowsAgainFromTheLog) {
  std::filesystem::create_directories(config_.logger.directory);
  const std::string log = scratch_ / "log/a.lcmlog";
  {
    Database database(scratch_ / "log/decisions.sqlite");
    database.BeginRun("a.lcmlog", kStart);
    database.BeginRun("never-written.lcmlog", kStart);
    EventLogWriter writer(log);
    const candidate_plan_t candidate = MakeCandidate(0, 1);
    writer.Append(kStart, "PLAN_CANDIDATE", Encode(candidate));
    writer.Append(kStart + 70, "PLAN_DECISION", Encode(MakeDecision(candidate, 0, decision_t::CERTIFIED, 0)));
    writer.Append(kStart + 90, "PLAN_DECISION", Encode(MakeDecision({}, 3, decision_t::REJECTED, 11)));
    ASSERT_TRUE(writer.Flush());
  }
  std::vector<std::uint8_t> bytes = ReadBytes(log);
  const std::size_t size = bytes.size();
  bytes.insert(bytes.end(), bytes.begin(), bytes.begin() + 50);  // the beginning of one more record
  WriteBytes(log, bytes);
  for (int start = 0; start < 2; ++start) {
    DirectBus bus;
    const LoggerNode node(config_, bus, out_);
    ASSERT_EQ(node.recorder().recovered().size(), start == 0 ? 2u : 0u) << "a mended run is mended once";
    if (start > 0) break;
    EXPECT_THAT(node.recorder().recovered()[0],
                AllOf(HasSubstr("3 events kept"), HasSubstr("50 bytes"), HasSubstr("3 rows written")));
    EXPECT_THAT(node.recorder().recovered()[1], HasSubstr("no log file was written"));
  }
  EXPECT_EQ(std::filesystem::file_size(log), size);
  const Rows rows = ReadRows();
  ASSERT_EQ(rows.decisions.size(), 2u);
  EXPECT_FIELDS(rows, (decisions[0].latency_us, 70), (decisions[1].cause, "future"));
  EXPECT_EQ(Only(rows.gaps).lost, 2);
  EXPECT_EQ(Runs()[0].end_utime, kStart + 90);
  EXPECT_THAT(Runs()[0].recovered, HasSubstr("cut tail of 50 bytes"));
}

TEST_F(LoggerNodeTest, LeavesARunningLoggersFileAlone) {
  LoggerNode running(config_, bus_, out_);
  running.Tick(kStart);
  DirectBus other;
  const LoggerNode second(config_, other, out_);
  EXPECT_TRUE(second.recorder().recovered().empty());
  EXPECT_EQ(Runs()[0].end_utime, std::nullopt);
}

/** Runs a logger that is fed without end; reports to `report` how many events it says that the disk has. */
[[noreturn]] void RunUntilKilled(const Config& config, int report) {
  DirectBus bus;
  std::ostringstream out;
  LoggerNode node(config, bus, out);
  node.Tick(bus.now_us);
  for (std::int64_t fed = 0;; fed += 2) {
    const candidate_plan_t candidate = MakeCandidate(fed / 2, fed / 2);
    bus.Publish("PLAN_CANDIDATE", candidate);
    bus.Publish("PLAN_DECISION", MakeDecision(candidate, fed / 2, decision_t::CERTIFIED, 0));
    bus.now_us += 1000;
    const std::int64_t before = node.recorder().written();
    node.Tick(bus.now_us);
    const std::int64_t safe = node.recorder().written();
    if (safe > before && ::write(report, &safe, sizeof safe) != sizeof safe) std::_Exit(1);
  }
}

TEST_F(LoggerNodeTest, KeepsConfirmedEventsWhenItIsKilled) {
  config_.logger.flush_ms = 5;
  config_.logger.rotate_mb = 0.4;  // some 40 candidates and their decisions
  FreshRandom random;
  constexpr int kRounds = 8;
  std::vector<std::int64_t> reported;
  for (int round = 0; round < kRounds; ++round) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      close(ends[0]);
      RunUntilKilled(config_, ends[1]);
    }
    close(ends[1]);
    std::int64_t safe = 0;
    for (int flushes = std::uniform_int_distribution<int>(1, 40)(random); flushes > 0; --flushes)
      ASSERT_EQ(read(ends[0], &safe, sizeof safe), static_cast<ssize_t>(sizeof safe));
    usleep(std::uniform_int_distribution<useconds_t>(0, 3000)(random));
    ASSERT_EQ(kill(child, SIGKILL), 0);
    ASSERT_EQ(waitpid(child, nullptr, 0), child);
    while (read(ends[0], &safe, sizeof safe) == static_cast<ssize_t>(sizeof safe)) {
    }
    close(ends[0]);
    reported.push_back(safe);
  }
  { const LoggerNode recovery(config_, bus_, out_); }

  Database database(scratch_ / "log/decisions.sqlite");
  std::vector<std::vector<RunRow>> chains;  // the files of each run
  for (const RunRow& run : database.Runs()) {
    EXPECT_TRUE(run.end_utime.has_value());
    if (run.continues.empty()) chains.emplace_back();
    EXPECT_EQ(run.continues, chains.back().empty() ? "" : chains.back().back().log_file);
    chains.back().push_back(run);
  }
  ASSERT_EQ(chains.size(), static_cast<std::size_t>(kRounds));
  for (std::size_t i = 0; i < chains.size(); ++i) {
    std::int64_t events = 0, sequence = 0;
    for (const RunRow& run : chains[i]) {
      SCOPED_TRACE(run.log_file + ": " + run.recovered);
      const LogContents log = ReadLog(scratch_ / ("log/" + run.log_file));
      EXPECT_FIELDS(log, (end, LogStatus::kEnd), (damage.places, 0));
      events += std::ssize(log.events);
      std::vector<std::int64_t> decisions;
      for (std::size_t k = 0; k < log.events.size(); ++k) {
        EXPECT_EQ(log.events[k].number, static_cast<std::int64_t>(k));
        if (log.events[k].channel == "PLAN_DECISION") decisions.push_back(log.events[k].number);
      }
      const Rows rows = database.Read(run.log_file);
      ASSERT_EQ(rows.decisions.size(), decisions.size());
      for (std::size_t k = 0; k < decisions.size(); ++k) {
        EXPECT_FIELDS(rows.decisions[k], (event.event_number, decisions[k]),
                      (event.digest, ToHex(DigestOf(log.events[static_cast<std::size_t>(decisions[k])]))),
                      (sequence, sequence++), (latency_us, 0));
      }
      EXPECT_TRUE(rows.gaps.empty());
    }
    EXPECT_GE(events, reported[i]) << "flushed events must stay";
  }
}

TEST_F(LoggerNodeTest, TakesWhatTheMemoryBusCarries) {
  const auto bus = OpenBus("memq://", [] { return kStart + 5; });
  LoggerNode node(config_, *bus, out_);
  node.Tick(kStart);
  bus->Publish("EXECUTION_EVENT", MakeEvent(0, execution_event_t::CONTACT));
  bus->Dispatch(0);
  node.Tick(kStart + 10);
  node.Stop();
  const LogContents log = ReadLog(node.recorder().log_path());
  ASSERT_EQ(log.events.size(), 2u) << "the logger hears its own heartbeat";
  EXPECT_FIELDS(log, (events[0].channel, "LOGGER_STATUS"), (events[1].utime, kStart + 5));
  EXPECT_EQ(node.recorder().summary().contacts, 1);
}

}  // namespace forereach::logger_node_test
