// What the disk has confirmed, and when: fsync and fdatasync are ours here, and note the files they are called for.
#include <sys/syscall.h>
#include <unistd.h>

#include "logger/recorder.h"
#include "tests/records/logs.h"

namespace {

// Leaked, since files are also synced by what ends after main.
std::vector<std::string>& Confirmed() {
  static auto* const confirmed = new std::vector<std::string>;
  return *confirmed;
}

int Note(int file, long call) {
  std::error_code error;
  const auto path = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(file), error);
  Confirmed().push_back(path.filename().string());
  return static_cast<int>(::syscall(call, file));
}

}  // namespace

extern "C" int fsync(int file) { return Note(file, SYS_fsync); }
extern "C" int fdatasync(int file) { return Note(file, SYS_fdatasync); }

namespace forereach::power_cut_test {

constexpr const char* kJournal = "decisions.sqlite-wal";

struct PowerCutTest : testing::Test {
  PowerCutTest() { std::filesystem::create_directories(scratch_ / "log"); }

  const ScratchDirectory scratch_;
};

TEST_F(PowerCutTest, ALogAndItsRunAreThereBeforeItsFirstEvent) {
  Config config;
  config.logger.directory = scratch_ / "log";
  config.logger.flush_ms = 1;
  config.logger.rotate_mb = 1e-6;  // an event for each file
  std::int64_t now = 1'700'000'000'000'000;
  Recorder recorder(config, [](const std::string&) { return std::int64_t{1} << 40; });
  recorder.Begin(now);
  for (std::int64_t i = 0; i < 3; ++i) {
    Confirmed().clear();
    recorder.Take({-1, now, "EXECUTION_EVENT", Encode(MakeEvent(i, 1))}, now);
    const std::string log = std::filesystem::path(recorder.log_path()).filename().string();
    if (i > 0) {
      EXPECT_THAT(Confirmed(), Contains("log")) << "the directory";
      EXPECT_THAT(Confirmed(), Contains(kJournal)) << "the run";
    }
    EXPECT_THAT(Confirmed(), Not(Contains(log)));
    recorder.Tick(now += 2000);
    EXPECT_THAT(Confirmed(), Contains(log));
  }
  recorder.End(now);
}

TEST_F(PowerCutTest, RowsOfRunsAreSyncedToDiskAndRowsOfEventsAreNot) {
  Database database(scratch_ / "log/decisions.sqlite");
  const auto confirmed = [](const auto& act) {
    Confirmed().clear();
    act();
    return Confirmed();
  };
  EXPECT_THAT(confirmed([&] { database.BeginRun("a", 1); }), Contains(kJournal));
  EXPECT_THAT(confirmed([&] { EXPECT_TRUE(database.Write({}, "a", 1)); }), IsEmpty());
  EXPECT_THAT(confirmed([&] { database.EndRun("a", 2); }), ElementsAre(kJournal));
  EXPECT_THAT(confirmed([&] { database.MarkLogDeleted("a", 3); }), ElementsAre(kJournal));
  EXPECT_THROW(database.BeginRun("a", 4), DatabaseError);
  EXPECT_THAT(confirmed([&] { EXPECT_TRUE(database.Write({}, "a", 2)); }), IsEmpty()) << "after a failure too";
}

}  // namespace forereach::power_cut_test
