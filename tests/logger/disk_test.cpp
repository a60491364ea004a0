// Log files that follow one another, and disks that fill.

#include "tests/file_size_limit.h"
#include "tests/logger/disk_fixture.h"

namespace forereach::disk_test {

constexpr std::int64_t kMinuteUs = 60'000'000;

TEST_F(DiskTest, AFileEndsBeforeTheEventThatWouldExceedItsSize) {
  config_.logger.rotate_mb = 10 * kRecord * 1e-6;
  Start();
  Feed(35);
  Stop();
  const std::vector<RunRow> runs = Runs();
  ASSERT_EQ(runs.size(), 4u);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    EXPECT_FIELDS(runs[i], (continues, i == 0 ? "" : runs[i - 1].log_file), (end_utime.has_value(), true));
    EXPECT_EQ(std::filesystem::file_size(PathOf(runs[i])), static_cast<std::uintmax_t>((i < 3 ? 10 : 5) * kRecord));
    EXPECT_EQ(ReadLog(PathOf(runs[i])).events.front().number, 0);
  }
  EXPECT_EQ(Recorded(), UpTo(35));
  EXPECT_FIELDS(ReadRows(), (events.size(), 35u), (gaps.empty(), true));
  EXPECT_THAT(out_.str(), HasSubstr("the last of 4"));
}

TEST_F(DiskTest, AnEventLargerThanAFileGetsOneOfItsOwn) {
  config_.logger.rotate_mb = 1e-6;
  Start();
  Feed(3);
  Stop();
  EXPECT_EQ(Runs().size(), 3u);
  EXPECT_EQ(Recorded(), UpTo(3));
}

TEST_F(DiskTest, EndsAFileByTimeUnlessItIsEmpty) {
  config_.logger.rotate_minutes = 1;
  Start();
  Feed(5);
  node_->Tick(bus_.now_us += kMinuteUs);
  EXPECT_EQ(Runs().size(), 2u);
  for (int i = 0; i < 5; ++i) node_->Tick(bus_.now_us += kMinuteUs);
  EXPECT_EQ(Runs().size(), 2u) << "nothing was recorded since";
  Feed(5);
  Stop();
  EXPECT_EQ(Recorded(), UpTo(10));
}

TEST_F(DiskTest, AClockThatGoesBackStopsNothing) {
  Start();
  Feed(20);
  bus_.now_us -= 60 * kMinuteUs;
  Feed(20);
  EXPECT_GE(Recorded().size(), 30u) << "flushed";
  const std::size_t heartbeats = bus_.heartbeats.size();
  Feed(600);
  EXPECT_GT(bus_.heartbeats.size(), heartbeats);
  Stop();
}

// More than ten within a second, then some an hour before: a shell lists them as they were written.
TEST_F(DiskTest, NamesSortInTheOrderInWhichFilesWereMade) {
  config_.logger.rotate_mb = kRecord * 1e-6;
  Start();
  for (int i = 0; i < 12; ++i) bus_.Publish("EXECUTION_EVENT", MakeEvent(fed_++, execution_event_t::STARTED));
  node_->Tick(bus_.now_us);
  bus_.now_us -= 60 * kMinuteUs;
  Feed(3);
  Stop();
  std::vector<std::string> names;
  for (const RunRow& run : Runs()) names.push_back(run.log_file);
  EXPECT_EQ(names.size(), 15u);
  EXPECT_TRUE(std::ranges::is_sorted(names)) << testing::PrintToString(names);
}

TEST_F(DiskTest, CountsGoOnFromFileToFile) {
  config_.logger.rotate_mb = 4 * kRecord * 1e-6;
  Start();
  Feed(4);
  fed_ += 3;  // lost on the bus, at the very end of the first file
  const candidate_plan_t candidate = MakeCandidate(0, 1);
  Feed(1);
  bus_.Publish("PLAN_CANDIDATE", candidate);
  node_->Tick(bus_.now_us += 1000);
  bus_.now_us += 250;
  bus_.Publish("PLAN_DECISION", MakeDecision(candidate, 0, decision_t::CERTIFIED, 0));
  node_->Tick(bus_.now_us);
  Stop();
  EXPECT_GE(Runs().size(), 3u) << "candidate and decision lie in different files";
  const Rows rows = ReadRows();
  EXPECT_FIELDS(Only(rows.gaps), (lost, 3), (event.event_number, 0));
  EXPECT_EQ(Only(rows.decisions).latency_us, 1250);
}

/** Every row in words, so that sets of them can be compared. */
std::vector<std::string> RowTexts(const Rows& rows) {
  std::vector<std::string> words;
  const auto reference = [](const LogReference& event) {
    return event.log_file + " " + std::to_string(event.event_number) + " " + event.digest + " ";
  };
  for (const DecisionRow& row : rows.decisions)
    words.push_back(reference(row.event) + row.plan_digest + " " + std::to_string(row.latency_us));
  for (const EventRow& row : rows.events) words.push_back(reference(row.event) + std::to_string(row.sequence));
  for (const GapRow& row : rows.gaps) words.push_back(reference(row.event) + row.channel + std::to_string(row.lost));
  std::ranges::sort(words);
  return words;
}

// Rows made again from the files of a run are those made while it ran, also where a file knows only with the one
// before.
TEST_F(DiskTest, RowsMadeAgainAreTheSame) {
  config_.logger.rotate_mb = 0.02;
  Start();
  FreshRandom random;
  for (std::int64_t i = 0; i < 60; ++i) {
    const candidate_plan_t candidate = MakeCandidate(i, i);
    bus_.Publish("PLAN_CANDIDATE", candidate);
    fed_ += random() % 4 == 0;
    Feed(1);
    bus_.now_us += static_cast<std::int64_t>(random() % 100);
    bus_.Publish("PLAN_DECISION", MakeDecision(candidate, i, decision_t::CERTIFIED, 0));
  }
  Stop();
  const std::vector<std::string> live = RowTexts(ReadRows());
  EXPECT_GT(Runs().size(), 10u);
  EXPECT_EQ(live.size(), 120 + ReadRows().gaps.size());

  Sql("DELETE FROM decisions; DELETE FROM execution_events; DELETE FROM gaps;"
      "UPDATE runs SET end_utime = NULL, events = 0");
  { const LoggerNode recovery(config_, bus_, out_); }
  EXPECT_EQ(RowTexts(ReadRows()), live);
}

// As after a power cut that took the database's last words, or the database.
TEST_F(DiskTest, AdoptsALogWithoutARunAndMakesItsRows) {
  config_.logger.rotate_mb = 10 * kRecord * 1e-6;
  Start();
  Feed(25);
  Stop();
  const std::vector<RunRow> before = Runs();
  const std::vector<std::string> live = RowTexts(ReadRows());
  Sql("DELETE FROM execution_events; DELETE FROM runs");
  const std::string old_name = "events-20231114-221319.lcmlog";
  std::filesystem::copy(PathOf(before[0]), scratch_ / ("log/" + old_name));
  WriteBytes(scratch_ / "log/stray.lcmlog", {1, 2, 3});
  { const LoggerNode recovery(config_, bus_, out_); }
  std::vector<RunRow> runs = Runs();
  ASSERT_EQ(runs.size(), 4u);
  EXPECT_EQ(runs[0].log_file, old_name);
  runs.erase(runs.begin());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    EXPECT_FIELDS(runs[i], (log_file, before[i].log_file),
                  (start_utime, kStart + static_cast<std::int64_t>(10'000 * i)), (end_utime.has_value(), true));
  }
  EXPECT_EQ(ReadRows().events.size(), 35u);
  Sql("DELETE FROM execution_events WHERE log_file = '" + old_name + "'");
  EXPECT_EQ(RowTexts(ReadRows()), live);
  EXPECT_EQ(std::filesystem::file_size(scratch_ / "log/stray.lcmlog"), 3u);
  std::filesystem::remove(scratch_ / ("log/" + old_name));  // its rows were deleted above
}

// As after a SIGKILL between making the file and recording its run.
TEST_F(DiskTest, DeletesAnEmptyLogWithoutARun) {
  std::filesystem::create_directory(scratch_ / "log");
  const std::string empty = scratch_ / "log/events-20231114-221319-000000.lcmlog";
  { const EventLogWriter made(empty); }
  const std::string cut = scratch_ / "log/events-20231114-221319-000001.lcmlog";
  { const EventLogWriter made(cut); }
  std::vector<std::uint8_t> bytes = ReadBytes(cut);
  bytes.insert(bytes.end(), {0xED, 0xA1, 0xDA});
  WriteBytes(cut, bytes);
  { const LoggerNode recovery(config_, bus_, out_); }
  EXPECT_FALSE(std::filesystem::exists(empty));
  EXPECT_EQ(scratch_ / ("log/" + Only(Runs()).log_file), cut);
}

TEST_F(DiskTest, ALogThatAnotherLoggerWritesIsNotTaken) {
  std::filesystem::create_directories(scratch_ / "log");
  const EventLogWriter other(scratch_ / "log/events-20231114-221319-000000.lcmlog");
  { const LoggerNode recovery(config_, bus_, out_); }
  EXPECT_TRUE(Runs().empty());
}

TEST_F(DiskTest, TheQuotaTakesTheOldestEndedLogsAndKeepsTheirRows) {
  config_.logger.rotate_mb = 10 * kRecord * 1e-6;
  config_.logger.quota_mb = 35 * kRecord * 1e-6;
  Start();
  for (int i = 0; i < 95; ++i) {
    Feed(1);
    EXPECT_LE(LogDirectory(config_.logger.directory).LogBytes(), 35 * kRecord);
  }
  node_->Tick(bus_.now_us += 10'000);
  EXPECT_EQ(node_->recorder().log_bytes(), LogDirectory(config_.logger.directory).LogBytes());
  Stop();
  const std::vector<RunRow> runs = Runs();
  ASSERT_EQ(runs.size(), 10u);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    EXPECT_EQ(runs[i].log_deleted_utime.has_value(), i < 7) << i;
    EXPECT_EQ(std::filesystem::exists(PathOf(runs[i])), i >= 7) << i;
  }
  EXPECT_EQ(ReadRows().events.size(), 95u) << "rows stay";
  EXPECT_TRUE(ReadRows().gaps.empty());
}

// Files that no run knows count to the quota, but are not the logger's to delete.
TEST_F(DiskTest, NothingIsDeletedForTheQuotaWhereThatMakesNoRoom) {
  config_.logger.rotate_mb = 10 * kRecord * 1e-6;
  Start();
  Feed(25);
  Stop();
  WriteBytes(scratch_ / "log/stray.lcmlog", std::vector<std::uint8_t>(40 * kRecord));
  config_.logger.quota_mb = 30 * kRecord * 1e-6;
  Start();
  Feed(20);
  EXPECT_FALSE(node_->recorder().recording());
  EXPECT_THAT(node_->recorder().trouble(), HasSubstr("logger.quota_mb"));
  EXPECT_EQ(Recorded(), UpTo(25)) << "every log is still there";
  std::filesystem::remove(scratch_ / "log/stray.lcmlog");
  Feed(20);
  EXPECT_TRUE(node_->recorder().recording());
  Stop();
  EXPECT_GE(LostTo("quota"), 20);
}

// Else what the file holds itself would keep the pause going.
TEST_F(DiskTest, AFileThatFindsNoRoomWithinTheQuotaEnds) {
  config_.logger.rotate_mb = 20 * kRecord * 1e-6;
  config_.logger.quota_mb = 20 * kRecord * 1e-6;
  Start();
  WriteBytes(scratch_ / "log/stray.lcmlog", std::vector<std::uint8_t>(kRecord));
  Feed(70);
  EXPECT_TRUE(node_->recorder().recording());
  EXPECT_LE(LogDirectory(config_.logger.directory).LogBytes(), 20 * kRecord);
  Stop();
  EXPECT_THAT(LostTo("quota"), AllOf(Ge(1), Le(4))) << "what came before the next look at the disk";
  EXPECT_EQ(ReadRows().events.size() + static_cast<std::size_t>(LostTo("quota")), 70u);
}

TEST_F(DiskTest, BelowTheFloorRecordingPausesAndResumesByItself) {
  Start();
  Feed(10);
  free_bytes_ = 999'999;
  Feed(10);  // the tenth is flushed, and the flush sees the disk
  const std::int64_t kept = std::ssize(Recorded());
  Feed(500);
  EXPECT_EQ(last().state, logger_status_t::ERROR);
  EXPECT_GT(last().failed_flushes, 10);
  EXPECT_EQ(last().free_bytes, 999'999);
  EXPECT_THAT(GetText(last().message), HasSubstr("logger.min_free_mb"));
  EXPECT_EQ(std::ssize(Recorded()), kept);
  free_bytes_ = 1'000'000;
  Feed(500);
  EXPECT_EQ(last().state, logger_status_t::ERROR) << "an eighth more has to be free";
  free_bytes_ = 1'125'000;
  Feed(600);
  EXPECT_FIELDS(last(), (state, logger_status_t::OK), (failed_flushes, 0));
  Stop();
  EXPECT_EQ(std::ssize(Recorded()) + LostTo("disk"), fed_);
  EXPECT_EQ(LostTo("bus"), 0) << "what the pause cost is not counted again";
}

TEST_F(DiskTest, ALongPauseWritesFewGapsAndFindsThoseOfTheBus) {
  Start();
  Feed(10);
  free_bytes_ = 0;
  Feed(12'000);
  fed_ += 7;
  Feed(12'000);
  const Rows meanwhile = ReadRows();
  EXPECT_GE(meanwhile.gaps.size(), 2u) << "written before it ends";
  EXPECT_LE(meanwhile.gaps.size(), 4u);
  Stop();
  EXPECT_EQ(std::ssize(Recorded()) + LostTo("disk") + LostTo("bus"), fed_);
  EXPECT_EQ(LostTo("bus"), 7);
}

TEST_F(DiskTest, HeartbeatReportsCountsAndState) {
  Start();
  Feed(1200);
  ASSERT_EQ(bus_.heartbeats.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(bus_.heartbeats[i].sequence, static_cast<std::int64_t>(i));
  EXPECT_FIELDS(last(), (utime, kStart + 1'001'000), (state, logger_status_t::OK));
  EXPECT_EQ(GetText(last().message), "recording");
  EXPECT_EQ(last().events_lost, 0);
  EXPECT_GT(last().events_written, 980);
  EXPECT_LE(last().events_written, 1001);
  EXPECT_FIELDS(last(), (queue_depth, 1), (queue_high_water, 1), (file_bytes, 1001 * kRecord),
                (log_bytes, last().file_bytes), (free_bytes, free_bytes_));
  EXPECT_GT(last().flush_us, 0);
  EXPECT_GE(last().flush_worst_us, last().flush_us);

  node_->Tick(bus_.now_us += 1'900'000);
  EXPECT_EQ(last().state, logger_status_t::OK);
  node_->Tick(bus_.now_us += 600'000);
  EXPECT_EQ(last().state, logger_status_t::STALE);
  EXPECT_THAT(GetText(last().message), HasSubstr("nothing was heard for 2.5 s"));
  Feed(501);
  EXPECT_EQ(last().state, logger_status_t::OK);
}

TEST_F(DiskTest, ADatabaseThatLagsIsStale) {
  Start();
  Feed(1);
  Sql("CREATE TRIGGER full BEFORE INSERT ON execution_events BEGIN SELECT RAISE(ABORT, 'no more'); END");
  config_.logger.rotate_mb = 10 * kRecord * 1e-6;
  Feed(600);
  EXPECT_EQ(last().state, logger_status_t::STALE);
  EXPECT_THAT(GetText(last().message), HasSubstr("it refuses a row"));
  Sql("DROP TRIGGER full");
  Feed(600);
  EXPECT_EQ(last().state, logger_status_t::OK);
  Stop();
  EXPECT_EQ(std::ssize(ReadRows().events), fed_);
}

// A file is not ended while rows of it wait for the database: after a crash nobody would make them again.
TEST_F(DiskTest, AFileWhoseRowsWaitIsNotEndedSoThatACrashLosesNone) {
  config_.logger.rotate_minutes = 1;
  Start();
  Feed(600);
  Sql("CREATE TRIGGER full BEFORE INSERT ON execution_events BEGIN SELECT RAISE(ABORT, 'no more'); END");
  Feed(600);
  for (int i = 0; i < 3; ++i) node_->Tick(bus_.now_us += kMinuteUs);
  Feed(600);
  node_.reset();  // a crash: nothing is ended, and the rows in memory are gone
  bus_.Disconnect();
  Sql("DROP TRIGGER full");
  EXPECT_LT(std::ssize(ReadRows().events), fed_) << "otherwise nothing was at stake";
  { const LoggerNode recovery(config_, bus_, out_); }
  EXPECT_EQ(Recorded(), UpTo(fed_));
  EXPECT_EQ(std::ssize(ReadRows().events), fed_);
}

// Rows of events come back from the log; that of a loss which no event shows is the only word of it.
TEST_F(DiskTest, ADatabaseThatRefusesForLongCostsNoGapWithoutAnEvent) {
  config_.logger.flush_ms = 1000;
  Start();
  node_->Tick(bus_.now_us);
  const auto burst = [this](std::int64_t count) {
    for (; count > 0; --count) bus_.Publish("EXECUTION_EVENT", MakeEvent(fed_++, execution_event_t::STARTED));
    node_->Tick(bus_.now_us += 1'000'000);
  };
  burst(1);
  fed_ += 20;  // lost on the way: as many as the queue will lose
  burst(1);
  Sql("CREATE TRIGGER full BEFORE INSERT ON execution_events BEGIN SELECT RAISE(ABORT, 'no more'); END");
  const std::int64_t queue = config_.logger.queue;
  burst(queue + 10);
  burst(queue + 10);
  bus_.dropped_count = 7;
  while (node_->recorder().written() <= static_cast<std::int64_t>(Recorder::kMaxWaitingRows)) burst(queue);
  burst(queue);
  Sql("DROP TRIGGER full");
  burst(1);
  EXPECT_THAT(node_->recorder().trouble(), HasSubstr("the next start makes them again"));
  Stop();
  const Rows live = ReadRows();
  EXPECT_LT(std::ssize(live.events), fed_ / 2) << "rows were dropped";
  EXPECT_EQ(live.gaps.size(), 3u) << "one for each stream and reason";
  EXPECT_EQ(LostTo("bus", live), 20);
  EXPECT_EQ(LostTo("queue", live), 20);
  EXPECT_EQ(LostTo("backlog", live), 7);

  { const LoggerNode recovery(config_, bus_, out_); }
  const Rows mended = ReadRows();
  EXPECT_EQ(std::ssize(mended.events), fed_ - 40);
  EXPECT_EQ(mended.gaps.size(), 3u) << "the log shows the same losses, which are counted already";
  EXPECT_EQ(LostTo("bus", mended), 20);
  EXPECT_EQ(LostTo("queue", mended), 20);
  EXPECT_EQ(LostTo("backlog", mended), 7);
}

TEST_F(DiskTest, AFailingFlushIsAnError) {
  Start();
  Feed(20);
  std::optional<FileSizeLimit> full(std::in_place, std::filesystem::file_size(node_->recorder().log_path()) + 10);
  Feed(500);
  EXPECT_EQ(last().state, logger_status_t::ERROR);
  EXPECT_GT(last().failed_flushes, 10);
  EXPECT_THAT(GetText(last().message), HasSubstr("File too large"));
  full.reset();
  Feed(600);
  EXPECT_EQ(last().state, logger_status_t::OK);
  node_->Tick(bus_.now_us += 10'000);
  EXPECT_EQ(node_->recorder().written() + node_->recorder().lost(), fed_);
  Stop();
  EXPECT_EQ(std::ssize(Recorded()) + LostTo("disk"), fed_);
}

TEST_F(DiskTest, PausesOnAFullDiskAndResumesWhenThereIsRoom) {
  const SmallDisk disk(config_.logger.directory, "size=6m");
  if (!disk.mounted) GTEST_SKIP() << "no right to mount a small disk here";
  const auto use = [this](const std::string& name, std::size_t bytes) {
    WriteBytes(scratch_ / ("log/" + name), std::vector<std::uint8_t>(bytes));
  };
  config_.logger.min_free_mb = 2;
  node_.emplace(config_, bus_, out_);
  Feed(100);
  EXPECT_TRUE(node_->recorder().recording());
  use("something else", 3 << 20);  // below the floor
  Feed(500);
  EXPECT_FALSE(node_->recorder().recording());
  EXPECT_EQ(last().state, logger_status_t::ERROR);
  use("and more", 3 << 20);  // and nothing left at all
  Feed(11'000);
  EXPECT_FALSE(node_->recorder().recording());
  std::filesystem::remove(scratch_ / "log/something else");
  std::filesystem::remove(scratch_ / "log/and more");
  Feed(600);
  EXPECT_EQ(last().state, logger_status_t::OK);
  Stop();
  for (const RunRow& run : Runs()) EXPECT_EQ(ReadLog(PathOf(run)).end, LogStatus::kEnd);
  EXPECT_EQ(std::ssize(Recorded()) + LostTo("disk"), fed_);
  EXPECT_EQ(std::ssize(ReadRows().events), std::ssize(Recorded()));
}

}  // namespace forereach::disk_test
