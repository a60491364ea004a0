// Input files: regular files are read, others are refused at once; and reloads that never end.
#include "task/files.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <condition_variable>
#include <cstdio>
#include <mutex>

#include "bus/reloading.h"
#include "task/csv.h"
#include "tests/task/task_files.h"

namespace forereach::files_test {

using std::chrono::milliseconds;

struct FilesTest : testing::Test {
  [[nodiscard]] std::string Path(const std::string& name) const { return directory_ / name; }
  [[nodiscard]] std::string Write(const std::string& name, const std::string& text) const {
    return directory_.Write(name, text);
  }
  // Each is no regular file, and a plain open and read of it would wait for ever or never end.
  void ForEachStrangeFile(const std::function<void(const std::string&, const char*)>& look) const {
    ASSERT_EQ(::mkfifo(Path("fifo").c_str(), 0600), 0);
    look(Path("fifo"), "is a pipe");
    look("/dev/zero", "is a device");
    std::filesystem::create_symlink("/dev/zero", Path("zero"));
    look(Path("zero"), "is a device");
    std::filesystem::create_directory(Path("directory"));
    look(Path("directory"), "is a directory");
    const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::snprintf(address.sun_path, sizeof address.sun_path, "%s", Path("socket").c_str());
    ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    look(Path("socket"), "is not a regular file");
    ::close(socket);
    look(Path("none"), "cannot be read: No such file");
  }

  const ScratchDirectory directory_;
};

TEST_F(FilesTest, AreReadWholeUpToTheBound) {
  const std::string text("a\0b\n", 4), path = Write("file", text);
  EXPECT_EQ(ReadWhole(path, 4), text);
  EXPECT_EQ(ReadWhole(Write("empty", ""), 4), "");
  EXPECT_THAT([&] { (void)ReadWhole(path, 3); }, ThrowsMessage<ConfigError>(HasSubstr("file: is larger than 3 bytes")));
  EXPECT_THAT([&] { (void)ReadWhole(path, 3, "x.yaml:2: "); }, ThrowsMessage<ConfigError>(StartsWith("x.yaml:2: ")));
  EXPECT_EQ(ReadBeginning(path, 2), "a" + std::string(1, '\0'));
  EXPECT_EQ(ReadBeginning(path, 9), text);
  const std::string large(200'000, 'x');
  EXPECT_EQ(ReadWhole(Write("large", large), kMegabyte), large);
  EXPECT_EQ(ReadWhole("/proc/self/comm", 100).back(), '\n') << "a file that says its size is 0";
}

TEST_F(FilesTest, OtherThanRegularOnesAreRefusedAtOnce) {
  ForEachStrangeFile([](const std::string& path, const char* what) {
    for (const auto& read : std::initializer_list<std::function<void()>>{
             [&] { (void)ReadWhole(path, 100); }, [&] { (void)ReadBeginning(path, 4); },
             [&] { (void)LoadConfig(path); }, [&] { (void)ReadCsv(path, {"a"}); }})
      EXPECT_THAT(read, ThrowsMessage<ConfigError>(HasSubstr(path + ": " + what)));
  });
}

TEST_F(FilesTest, AsTransitionsAreRefusedWithTheLineThatNamesThem) {
  TaskFiles files;
  ForEachStrangeFile([&](const std::string& path, const char* what) {
    const std::string error = files.ErrorWith("transitions: steps.csv", "transitions: " + path);
    EXPECT_THAT(error, StartsWith("12: transitions: " + path + ": " + what));
  });
}

// A line without an end may not fill the memory, whatever the file's size.
TEST_F(FilesTest, ALineOfCsvIsBounded) {
  const std::string path = Write("t.csv", "a\n1\n");
  std::filesystem::resize_file(path, std::uintmax_t{1} << 33);  // zeros, which take no place on the disk
  EXPECT_THAT([&] { (void)ReadCsv(path, {"a"}); },
              ThrowsMessage<ConfigError>(HasSubstr("t.csv:3: longer than 1048576 bytes")));
  std::filesystem::resize_file(path, std::uintmax_t{1} << 35);
  EXPECT_THAT([&] { (void)ReadCsv(path, {"a"}); }, ThrowsMessage<ConfigError>(HasSubstr("is larger than 16384 MiB")));
}

TEST_F(FilesTest, ReadsCsvRowsThatCrossTheReadersChunks) {
  std::string text = "a,b\n";
  for (int i = 0; i < 40'000; ++i) text += std::to_string(i) + "," + std::to_string(-i) + "\n";
  for (const std::string& whole : {text, text.substr(0, text.size() - 1)}) {
    const Eigen::MatrixXd rows = ReadCsv(Write("t.csv", whole), {"a", "b"});
    ASSERT_EQ(rows.rows(), 40'000);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      ASSERT_EQ(rows(i, 0), i);
      ASSERT_EQ(rows(i, 1), -i);
    }
  }
}

// ---- Reloads.

// Reads what the test says, and waits where the test says so: a mount that stalls. Owned by the threads too.
struct Mount {
  std::mutex mutex;
  std::condition_variable changed;
  int value = 0, reading = 0, told = 0;
  bool stalls = false;

  int Read() {
    std::unique_lock lock(mutex);
    ++reading;
    changed.notify_all();
    const int read = value;
    const bool waits = stalls;
    const int told_before = told;  // another reader wakes it, too
    if (waits) changed.wait(lock, [&] { return !stalls && told != told_before; });
    return read;
  }
  void Set(int next, bool stall) {
    const std::lock_guard lock(mutex);
    value = next;
    stalls = stall;
    ++told;
    changed.notify_all();
  }
  void AwaitReaders(int count) {
    std::unique_lock lock(mutex);
    ASSERT_TRUE(changed.wait_for(lock, std::chrono::seconds(20), [&] { return reading >= count; }));
  }
};

struct ReloadingTest : testing::Test {
  ~ReloadingTest() override {
    mount_->Set(0, false);
    for (int i = 0; i < 20'000 && reloads_under_way > 0; ++i) std::this_thread::sleep_for(milliseconds(1));
  }
  Reloading<int> Reloads(milliseconds patience) const {
    return Reloading<int>([mount = mount_] { return mount->Read(); }, patience);
  }
  static std::optional<int> Await(Reloading<int>& reloads) {
    for (int i = 0; i < 20'000; ++i) {
      if (auto result = reloads.Take()) return result;
      std::this_thread::sleep_for(milliseconds(1));
    }
    return std::nullopt;
  }

  const std::shared_ptr<Mount> mount_ = std::make_shared<Mount>();
};

TEST_F(ReloadingTest, DoesNotWaitForAReadThatNeverEnds) {
  mount_->Set(1, true);
  {
    Reloading<int> reloads = Reloads(milliseconds(0));
    EXPECT_TRUE(reloads.Ask());
    mount_->AwaitReaders(1);
    EXPECT_EQ(reloads.Take(), std::nullopt);
  }  // the destructor would hang
  EXPECT_EQ(reloads_under_way, 1);
}

TEST_F(ReloadingTest, ReportsNoStallBeforeItsTime) {
  mount_->Set(1, true);
  Reloading<int> reloads = Reloads(std::chrono::hours(1));
  EXPECT_TRUE(reloads.Ask());
  mount_->AwaitReaders(1);
  EXPECT_FALSE(reloads.TakeStall());
  mount_->Set(1, false);
  EXPECT_EQ(Await(reloads), 1);
}

TEST_F(ReloadingTest, TakesAGoodFileAfterAReadThatStalled) {
  mount_->Set(1, true);
  Reloading<int> reloads = Reloads(milliseconds(20));
  EXPECT_TRUE(reloads.Ask());
  mount_->AwaitReaders(1);
  {
    const std::lock_guard lock(mount_->mutex);
    mount_->value = 2;
    mount_->stalls = false;  // nobody is told: the first goes on waiting
  }
  EXPECT_TRUE(reloads.Ask());
  EXPECT_EQ(Await(reloads), 2);
  mount_->Set(3, false);  // now the first ends, with what it read long ago
  for (int i = 0; i < 20'000 && reloads_under_way > 0; ++i) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(reloads.Take(), std::nullopt) << "older than what was taken";
}

TEST_F(ReloadingTest, RefusesAThirdReadWhileTwoStallAndReadsLater) {
  mount_->Set(1, true);
  Reloading<int> reloads = Reloads(milliseconds(20));
  const auto stalls = [&] {
    for (int i = 0; i < 20'000 && !reloads.TakeStall(); ++i) std::this_thread::sleep_for(milliseconds(1));
    return !reloads.TakeStall();  // said once
  };
  EXPECT_TRUE(reloads.Ask());
  EXPECT_TRUE(stalls());
  EXPECT_TRUE(reloads.Ask());
  EXPECT_TRUE(stalls());
  EXPECT_FALSE(reloads.Ask());
  EXPECT_EQ(reloads.Take(), std::nullopt);
  EXPECT_EQ(reloads_under_way, 2);
  mount_->Set(7, false);
  EXPECT_TRUE(Await(reloads));
  for (int i = 0; i < 20'000 && mount_->reading < 3; ++i) {
    (void)reloads.Take();
    std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_EQ(mount_->reading, 3) << "what was asked for meanwhile is read after all";
}

TEST_F(ReloadingTest, PassesOnTheExceptionOfTheReader) {
  Reloading<int> reloads([]() -> int { throw std::runtime_error("no"); });
  EXPECT_TRUE(reloads.Ask());
  EXPECT_THROW((void)Await(reloads), std::runtime_error);
  EXPECT_EQ(reloads.Take(), std::nullopt);
}

}  // namespace forereach::files_test
