// One role gets a new key: what then counts, what stays, and what a failure or the end of the process leaves on the
// disk.
#include <cerrno>

#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/test.h"

#include "bus/authentic.h"
#include "tests/file_size_limit.h"
#include "tests/keys.h"

namespace {

// Of the calls below, one fails or ends the process.
int calls = 0, last_call = -1;
bool dies = false;

bool IsLast() {
  if (calls++ != last_call) return false;
  if (dies) ::_exit(9);
  errno = EIO;
  return true;
}

}  // namespace

extern "C" int fsync(int file) { return IsLast() ? -1 : static_cast<int>(::syscall(SYS_fsync, file)); }
extern "C" int mkdirat(int at, const char* path, mode_t mode) noexcept {
  return IsLast() ? -1 : static_cast<int>(::syscall(SYS_mkdirat, at, path, mode));
}
extern "C" int unlinkat(int at, const char* path, int flags) noexcept {
  return IsLast() ? -1 : static_cast<int>(::syscall(SYS_unlinkat, at, path, flags));
}
extern "C" int renameat2(int from_at, const char* from, int to_at, const char* to, unsigned flags) noexcept {
  return IsLast() ? -1 : static_cast<int>(::syscall(SYS_renameat2, from_at, from, to_at, to, flags));
}

namespace forereach::key_replacement_test {

namespace fs = std::filesystem;

constexpr const char* kBus = "the bus";
constexpr std::int64_t kBegun = 1'000'000;
const std::vector<std::uint8_t> kSaid{1, 2, 3};

std::string WhyRefused(const std::function<void()>& replace) { return Thrown<KeyError>(replace); }

struct KeyReplacement : testing::Test {
  ~KeyReplacement() override { last_call = -1; }
  [[nodiscard]] std::string File(const std::string& name) const { return keys_ + "/" + name; }
  [[nodiscard]] std::string Replace(Role role = Role::kPlanner, const std::string& robot = "test") const {
    return WhyRefused([&] { ReplaceKey(robot, keys_, role); });
  }
  // Every file below the scratch directory.
  [[nodiscard]] std::map<std::string, std::string> Files() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(scratch_.path()))
      if (entry.is_regular_file()) files[entry.path()] = Read(entry.path());
    return files;
  }

  const ScratchDirectory scratch_;
  const std::string keys_ = MakeTestKeys(scratch_ / "keys");
};

std::string SecretOf(const std::string& file) {
  const std::size_t at = file.find("secret ");
  return file.substr(at, file.find('\n', at) - at);
}

TEST_F(KeyReplacement, ChangesOneKeyAndNoOther) {
  for (const Role replaced : kAllRoles) {
    const KeyRing before = LoadAllKeys(keys_);
    const std::string secret = SecretOf(Read(File(std::string(RoleName(replaced)) + ".key")));
    ASSERT_EQ(Replace(replaced), "");
    const KeyRing after = LoadAllKeys(keys_), open = LoadPublicKeys(File("verify.pub"));
    EXPECT_TRUE(before.Tag(kSaid) == after.Tag(kSaid)) << "the group key stays";
    for (const Role role : kAllRoles) {
      EXPECT_EQ(before.public_key(role) == after.public_key(role), role != replaced) << RoleName(role);
      EXPECT_EQ(before.Sign(role, kSaid) == after.Sign(role, kSaid), role != replaced) << RoleName(role);
      EXPECT_EQ(open.public_key(role), after.public_key(role));
      EXPECT_EQ(LoadKeys(keys_, role).public_key(replaced), after.public_key(replaced)) << "each file has it";
    }
    const auto files = Files();
    EXPECT_EQ(files.size(), kAllRoles.size() + 1);
    for (const auto& [path, content] : files) {
      EXPECT_THAT(content, Not(HasSubstr(secret))) << path;
      struct stat status {};
      ASSERT_EQ(::stat(path.c_str(), &status), 0);
      EXPECT_EQ(status.st_mode & 07777, path.ends_with("verify.pub") ? 0644u : 0600u) << path;
    }
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(scratch_.path()), {}), 1) << "nothing beside it";
}

// What each side makes of a message by each side's keys, live and in a log.
TEST_F(KeyReplacement, TheOldKeyCountsOnlyWhereTheOldFilesAre) {
  const std::string old = scratch_ / "old";
  fs::copy(keys_, old);
  ASSERT_EQ(Replace(), "");
  const Speakers speakers{{"planner", Role::kPlanner}, {"certifier", Role::kCertifier}};
  const auto heard = [&](const std::string& reader, const std::string& sender, Role role) {
    const auto bytes = Signer(LoadKeys(sender, role), kBus).Sign(role, std::string(RoleName(role)), kSaid, kBegun + 1);
    const auto of = [&](const KeyRing& ring) {
      return Authenticator(ring, kBus, speakers, kBegun).Check(std::string(RoleName(role)), bytes, kBegun + 1).first;
    };
    const Authenticity live = of(LoadKeys(reader, Role::kLogger));
    EXPECT_EQ(live, of(LoadPublicKeys(reader + "/verify.pub")));
    return live;
  };
  EXPECT_EQ(heard(keys_, old, Role::kPlanner), Authenticity::kForged) << "the lost laptop speaks to nobody";
  EXPECT_EQ(heard(keys_, keys_, Role::kPlanner), Authenticity::kAuthentic);
  EXPECT_EQ(heard(old, keys_, Role::kPlanner), Authenticity::kForged) << "a machine that was not reached: fail closed";
  EXPECT_EQ(heard(old, old, Role::kPlanner), Authenticity::kAuthentic) << "as long as it has its old file";
  for (const std::string& reader : {keys_, old})
    for (const std::string& sender : {keys_, old})
      EXPECT_EQ(heard(reader, sender, Role::kCertifier), Authenticity::kAuthentic) << "the others are not concerned";
}

TEST_F(KeyReplacement, TheLostFileNeedNotBeThere) {
  fs::remove(File("planner.key"));
  EXPECT_THAT(Replace(Role::kRobot), HasSubstr("planner.key: cannot be read: No such file"));
  EXPECT_EQ(Replace(), "");
  EXPECT_TRUE(LoadAllKeys(keys_).Holds(Role::kPlanner));
}

TEST_F(KeyReplacement, RefusesWhatIsNotTheWholeSetOfThisRobotAndChangesNothing) {
  const std::string others = MakeTestKeys(scratch_ / "others", "test");
  const auto good = Files();
  const auto refused = [&](const std::function<void()>& spoil) {
    spoil();
    const auto spoiled = Files();
    const std::string why = Replace();
    EXPECT_TRUE(Files() == spoiled) << why;
    fs::remove_all(keys_);
    fs::create_directory(keys_);
    for (const auto& [path, content] : good) {
      std::ofstream(path, std::ios::trunc) << content;
      ::chmod(path.c_str(), path.ends_with("verify.pub") ? 0644 : 0600);
    }
    return why;
  };
  const auto overwrite = [&](const char* from, const char* to) {
    fs::copy_file(others + "/" + from, File(to), fs::copy_options::overwrite_existing);
  };
  EXPECT_THAT(refused([&] { overwrite("robot.key", "robot.key"); }),
              HasSubstr("/keys/robot.key: belongs to other keys than verify.pub in the same directory"));
  EXPECT_THAT(refused([&] { overwrite("planner.key", "planner.key"); }),
              HasSubstr("/keys/planner.key: belongs to other"))
      << "also the one that is replaced";
  EXPECT_THAT(refused([&] { overwrite("verify.pub", "verify.pub"); }),
              HasSubstr("/keys/certifier.key: belongs to other"));
  EXPECT_THAT(
      refused([&] { fs::copy_file(File("robot.key"), File("logger.key"), fs::copy_options::overwrite_existing); }),
      HasSubstr("/keys/logger.key: line 3: role: has to be logger"));
  EXPECT_THAT(refused([&] {
                std::string text = Read(File("robot.key"));
                const std::size_t group = text.find("group ") + 6;
                text[group] = text[group] == '0' ? '1' : '0';
                std::ofstream(File("robot.key"), std::ios::trunc) << text;
              }),
              HasSubstr("/keys/robot.key: line 5: group: is not that of the other files"));
  EXPECT_THAT(refused([&] { fs::remove(File("verify.pub")); }), HasSubstr("/keys/verify.pub: cannot be read: No such"));
  EXPECT_THAT(refused([&] { fs::remove(File("logger.key")); }), HasSubstr("/keys/logger.key: cannot be read: No such"));
  EXPECT_THAT(refused([&] { std::ofstream(File("notes.txt")) << "my notes"; }),
              HasSubstr("/keys/notes.txt: is no key file"));
  EXPECT_THAT(refused([&] { ::chmod(File("logger.key").c_str(), 0640); }),
              HasSubstr("/keys/logger.key: others can read"));
  EXPECT_THAT(refused([&] {
                for (const auto& entry : fs::directory_iterator(keys_)) fs::remove(entry);
              }),
              HasSubstr("/keys: there are no keys in it"));
  EXPECT_THAT(Replace(Role::kPlanner, "alpha"), HasSubstr("the keys are of robot test, not of alpha"));
  EXPECT_THAT(WhyRefused([&] { ReplaceKey("test", scratch_ / "none", Role::kPlanner); }),
              HasSubstr("/none: cannot be read: No such file"));
  EXPECT_THAT(WhyRefused([&] { ReplaceKey("test", File("planner.key"), Role::kPlanner); }),
              HasSubstr("planner.key: is no directory"));
  EXPECT_TRUE(Files() == good);
  EXPECT_EQ(Replace(), "") << "then good again";
}

TEST_F(KeyReplacement, AnEndAtAnyCallLeavesTheOldKeysOrTheNewOnes) {
  bool ended = true;
  int old_ones = 0, new_ones = 0;
  for (int call = 0; ended; ++call) {
    SCOPED_TRACE("call " + std::to_string(call));
    const KeyRing before = LoadAllKeys(keys_);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      calls = 0, last_call = call, dies = true;
      ::_exit(Replace().empty() ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ended = WEXITSTATUS(status) == 9;
    ASSERT_TRUE(ended || status == 0);
    const KeyRing after = LoadAllKeys(keys_);
    EXPECT_EQ(LoadPublicKeys(File("verify.pub")).public_key(Role::kPlanner), after.public_key(Role::kPlanner));
    ++(after == before ? old_ones : new_ones);
    EXPECT_EQ(std::distance(fs::directory_iterator(keys_), {}), std::ssize(kAllRoles) + 1);
    if (!ended) break;
    ASSERT_EQ(Replace(), "") << "what was left does not matter";
    EXPECT_EQ(std::distance(fs::directory_iterator(scratch_.path()), {}), 1) << "and is gone";
  }
  EXPECT_GT(old_ones, 8) << "a directory, the files, and their directory";
  EXPECT_GT(new_ones, 8) << "the files of the old keys";
}

TEST_F(KeyReplacement, AFailureAtAnyCallSaysWhichKeysAreInPlace) {
  bool failed = true;
  int old_ones = 0, new_ones = 0;
  for (int call = 0; failed; ++call) {
    SCOPED_TRACE("call " + std::to_string(call));
    const KeyRing before = LoadAllKeys(keys_);
    calls = 0, last_call = call, dies = false;
    const std::string why = Replace();
    failed = calls > call;
    last_call = -1;
    const bool is_old = LoadAllKeys(keys_) == before;
    if (!why.empty()) {
      EXPECT_EQ(why.find("the new keys are in place") == why.npos, is_old) << why;
      ++(is_old ? old_ones : new_ones);
    }
    ASSERT_EQ(Replace(), "");
    EXPECT_EQ(std::distance(fs::directory_iterator(scratch_.path()), {}), 1);
  }
  EXPECT_GT(old_ones, 8);
  EXPECT_GT(new_ones, 8);
}

TEST_F(KeyReplacement, AFullDiskLeavesTheOldKeysAndNothingElse) {
  const auto before = Files();
  const FileSizeLimit limit(100);
  EXPECT_THAT(Replace(), HasSubstr("cannot be written"));
  EXPECT_TRUE(Files() == before);
}

TEST_F(KeyReplacement, WhatIsLeftAndIsNoKeyIsNotRemoved) {
  fs::create_directory(scratch_ / ".keys.replacing");
  std::ofstream(scratch_ / ".keys.replacing/notes.txt") << "my notes";
  const auto before = Files();
  EXPECT_THAT(Replace(), HasSubstr("/.keys.replacing: cannot be removed: Directory not empty"));
  EXPECT_TRUE(Files() == before);
  fs::remove_all(scratch_ / ".keys.replacing");
  const KeyRing old = LoadAllKeys(keys_);
  fs::create_directory_symlink(keys_, scratch_ / ".keys.replacing");
  EXPECT_THAT(Replace(), HasSubstr("/.keys.replacing: cannot be removed"));
  EXPECT_TRUE(LoadAllKeys(keys_) == old) << "a link is not followed";
}

TEST_F(KeyReplacement, TwoAtATimeAreOne) {
  const int parent = ::open(scratch_.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  ASSERT_EQ(::flock(parent, LOCK_EX), 0);
  const auto before = Files();
  EXPECT_THAT(Replace(), HasSubstr("another `forereach keygen --again` is at work here"));
  EXPECT_TRUE(Files() == before);
  ::close(parent);
  EXPECT_EQ(Replace(), "");
}

TEST_F(KeyReplacement, ALinkADotAndAnyUmaskLeadToTheSame) {
  fs::create_directory_symlink(keys_, scratch_ / "link");
  const mode_t umask_before = ::umask(0777);
  const std::string by_link = WhyRefused([&] { ReplaceKey("test", scratch_ / "link", Role::kPlanner); });
  ::umask(0);
  const std::string by_slash = WhyRefused([&] { ReplaceKey("test", keys_ + "/", Role::kPlanner); });
  ::umask(umask_before);
  EXPECT_EQ(by_link, "");
  EXPECT_EQ(by_slash, "");
  EXPECT_TRUE(fs::is_symlink(scratch_ / "link"));
  const fs::path here = fs::current_path();
  fs::current_path(keys_);
  EXPECT_EQ(WhyRefused([] { ReplaceKey("test", ".", Role::kPlanner); }), "");
  fs::current_path(here);
  struct stat status {};
  ASSERT_EQ(::stat(keys_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0700u);
  (void)LoadAllKeys(keys_);
}

}  // namespace forereach::key_replacement_test
