// The logger's files are deleted, moved, replaced or cut: it reports this, counts the losses, and continues.
#include <sys/resource.h>

#include "tests/logger/disk_fixture.h"

namespace forereach::gone_test {

namespace fs = std::filesystem;

struct GoneTest : DiskTest {
  GoneTest() {
    Start();
    Feed(50);
    node_->Tick(bus_.now_us += 10'000);  // flushed
  }
  [[nodiscard]] std::string log() const { return node_->recorder().log_path(); }
  [[nodiscard]] std::string directory() const { return scratch_ / "log"; }
  [[nodiscard]] std::string Message() const { return GetText(last().message); }

  // Feeds on: 50 events have gone, the rest are there, in a file of another name.
  void ExpectGoesOnWithout(std::int64_t gone, const std::string& why) {
    const std::string before = log();
    Feed(700);
    EXPECT_EQ(last().state, logger_status_t::OK) << Message();
    EXPECT_THAT(Message(), HasSubstr(why));
    EXPECT_EQ(last().events_lost, gone);
    EXPECT_NE(log(), before);
    Stop();
    EXPECT_EQ(std::ssize(Recorded()) + gone, fed_);
    EXPECT_EQ(LostTo("gone"), gone);
    EXPECT_EQ(LostTo("bus"), 0);
    EXPECT_THAT(out_.str(), HasSubstr(why));
  }
};

TEST_F(GoneTest, GoesOnInANewFileWhenItsLogIsDeleted) {
  fs::remove(log());
  ExpectGoesOnWithout(50, "was deleted or replaced, 50 confirmed events are gone");
  const std::vector<RunRow> runs = Runs();
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_THAT(runs[0].recovered, HasSubstr("was deleted"));
  EXPECT_TRUE(runs[0].end_utime.has_value());
  EXPECT_EQ(runs[1].continues, runs[0].log_file);
  const std::vector<LogCheck> checks = CheckLogs(directory());
  EXPECT_EQ(checks[0].log, LogCheck::Log::kMissing);
  EXPECT_TRUE(checks[1].whole_log());
}

TEST_F(GoneTest, KeepsEventsInMemoryWhenItsLogIsDeleted) {
  Feed(5);
  fs::remove(log());
  ExpectGoesOnWithout(50, "50 confirmed events are gone");
  EXPECT_EQ(Recorded().front(), 50);
}

TEST_F(GoneTest, GoesOnInANewFileWhenItsLogIsMoved) {
  fs::rename(log(), scratch_ / "elsewhere");
  ExpectGoesOnWithout(50, "was moved, 50 confirmed");
}

TEST_F(GoneTest, GoesOnInANewFileWhenItsLogIsReplaced) {
  fs::copy(log(), scratch_ / "copy");
  fs::rename(scratch_ / "copy", log());
  Feed(700);
  EXPECT_EQ(last().state, logger_status_t::OK);
  EXPECT_THAT(Message(), HasSubstr("was deleted or replaced"));
  EXPECT_EQ(last().events_lost, 50);
}

TEST_F(GoneTest, GoesOnInANewFileWhenItsLogIsCutAndKeepsTheRest) {
  fs::resize_file(log(), 20 * kRecord + 7);
  ExpectGoesOnWithout(30, "was cut short, 30 confirmed events are gone");
  EXPECT_EQ(Recorded().front(), 0);
}

TEST_F(GoneTest, NoticesALogThatWasCutEvenIfItHasItsOldSize) {
  const auto size = fs::file_size(log());
  fs::resize_file(log(), 0);
  fs::resize_file(log(), size);
  ExpectGoesOnWithout(50, "was cut short, 50 confirmed events are gone");
}

TEST_F(GoneTest, GoesOnInANewDirectoryWhenItsDirectoryIsDeleted) {
  fs::remove_all(directory());
  ExpectGoesOnWithout(50, "gone");
  for (const LogCheck& check : CheckLogs(directory()))
    EXPECT_TRUE(check.whole_log() || check.log == LogCheck::Log::kMissing) << check.log_file;
}

TEST_F(GoneTest, GoesOnInANewDirectoryWhenItsDirectoryIsRenamed) {
  fs::rename(directory(), scratch_ / "renamed");
  ExpectGoesOnWithout(50, "gone");
  Database renamed(scratch_ / "renamed/decisions.sqlite");
  EXPECT_EQ(renamed.Read().events.size(), 50u) << "what was there is whole there";
}

TEST_F(GoneTest, ADirectoryThatCannotBeMadeAgainIsAnErrorUntilItCan) {
  fs::remove_all(directory());
  scratch_.Write("log", "a file");
  Feed(1500);
  EXPECT_EQ(last().state, logger_status_t::ERROR);
  EXPECT_THAT(Message(), HasSubstr("the log is gone"));
  fs::remove(directory());
  Feed(2000);
  EXPECT_EQ(last().state, logger_status_t::OK) << Message();
  Stop();
  EXPECT_EQ(std::ssize(Recorded()) + LostTo("gone"), fed_);
  EXPECT_GT(LostTo("gone"), 1500);
}

// Files that ended before, too.
TEST_F(GoneTest, CountsTheLostEventsOfEarlierFilesOfTheRun) {
  node_.reset();
  bus_.Disconnect();
  fs::remove_all(directory());
  fed_ = 0;
  config_.logger.rotate_mb = 10 * kRecord * 1e-6;
  Start();
  Feed(35);
  node_->Tick(bus_.now_us += 10'000);
  fs::remove_all(directory());
  Feed(600);
  EXPECT_EQ(last().events_lost, 35);
  fs::remove(PathOf(Runs()[3]));
  Stop();
  EXPECT_EQ(LostTo("gone"), 45);
}

TEST_F(GoneTest, GoesOnAfterItsLogIsDeletedManyTimes) {
  for (int i = 0; i < 20; ++i) {
    fs::remove(log());
    Feed(50);
  }
  node_->Tick(bus_.now_us += 10'000);
  Stop();
  EXPECT_EQ(std::ssize(Recorded()) + LostTo("gone"), fed_);
  EXPECT_EQ(Runs().size(), 21u);
}

struct DatabaseGoneTest : GoneTest {
  // What is heard from now on has its rows; the next start makes those of before.
  void ExpectRowsAgain() {
    Feed(700);
    EXPECT_NE(last().state, logger_status_t::ERROR) << Message();
    EXPECT_EQ(last().events_lost, 0);
    Stop();
    EXPECT_EQ(std::ssize(Recorded()), fed_);
    EXPECT_GE(std::ssize(ReadRows().events), 690);
    { const LoggerNode recovery(config_, bus_, out_); }
    EXPECT_EQ(std::ssize(ReadRows().events), fed_);
    EXPECT_EQ(ReadRows().gaps.size(), 0u);
    for (const LogCheck& check : CheckLogs(directory())) EXPECT_TRUE(check.whole_log() && check.ended);
  }
  void RemoveDatabase() const {
    for (const char* ending : {"", "-wal", "-shm"})
      fs::remove(scratch_ / (std::string("log/decisions.sqlite") + ending));
  }
};

TEST_F(DatabaseGoneTest, ReportsADeletedDatabaseAndTheNextStartMakesItsRowsAgain) {
  RemoveDatabase();
  Feed(600);
  EXPECT_EQ(last().state, logger_status_t::STALE);
  EXPECT_THAT(Message(), HasSubstr("the next start makes them again"));
  ExpectRowsAgain();
  EXPECT_THAT(out_.str(), HasSubstr("decisions.sqlite was deleted or moved"));
}

TEST_F(DatabaseGoneTest, TheNextStartMakesTheRowsAgainWhenOnlyTheDatabaseFileIsDeleted) {
  fs::remove(scratch_ / "log/decisions.sqlite");
  ExpectRowsAgain();
}

TEST_F(DatabaseGoneTest, TheNextStartMakesTheRowsAgainWhenAnotherDatabaseTookItsPlace) {
  RemoveDatabase();
  { const Database other(scratch_ / "log/decisions.sqlite"); }
  ExpectRowsAgain();
}

TEST_F(DatabaseGoneTest, ADatabaseThatIsReplacedBySomethingElseWaitsUntilThatIsGone) {
  RemoveDatabase();
  scratch_.Write("log/decisions.sqlite",
                 "no database, but something of more than a few bytes " + std::string(500, 'x'));
  Feed(600);
  EXPECT_EQ(last().state, logger_status_t::STALE);
  EXPECT_THAT(Message(), HasSubstr("it is no database"));
  fs::remove(scratch_ / "log/decisions.sqlite");
  Feed(1200);
  ExpectRowsAgain();
}

TEST_F(DatabaseGoneTest, LosesNoRowWhenOnlyTheWriteAheadLogIsDeleted) {
  for (const char* ending : {"-wal", "-shm"}) {
    ASSERT_TRUE(fs::remove(scratch_ / (std::string("log/decisions.sqlite") + ending)));
    Feed(600);
    EXPECT_EQ(last().state, logger_status_t::OK) << Message();
    EXPECT_EQ(ReadRows().events.size() / 100, static_cast<std::size_t>(fed_) / 100) << "nothing is lost";
  }
  ExpectRowsAgain();
}

// A mount of its own over the directory: what is open can still be written, nothing new can be made.
TEST_F(GoneTest, ADirectoryThatBecomesReadOnlyIsSaidAtTheNextFile) {
  node_.reset();
  bus_.Disconnect();
  fs::remove_all(directory());
  fed_ = 0;
  const SmallDisk disk(directory(), "size=6m");
  if (!disk.mounted) GTEST_SKIP() << "no right to mount a small disk here";
  config_.logger.rotate_mb = 100 * kRecord * 1e-6;
  node_.emplace(config_, bus_, out_, [](const std::string&) { return std::int64_t{1} << 40; });
  Feed(50);
  const std::string held = directory();
  const char* path = held.c_str();
  ASSERT_EQ(::mount(path, path, nullptr, MS_BIND, nullptr), 0);
  ASSERT_EQ(::mount(nullptr, path, nullptr, MS_BIND | MS_REMOUNT | MS_RDONLY, nullptr), 0);
  Feed(700);
  EXPECT_NE(last().state, logger_status_t::OK);
  EXPECT_THAT(Message(), HasSubstr("Read-only"));
  ASSERT_EQ(::umount2(path, MNT_DETACH), 0);
  Feed(1700);
  EXPECT_EQ(last().state, logger_status_t::OK) << Message();
  Stop();
  EXPECT_EQ(std::ssize(Recorded()), fed_);
}

}  // namespace forereach::gone_test
