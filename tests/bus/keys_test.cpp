// Key files: their readers, their content, and the errors of files that cannot be used.
#include "bus/keys.h"

#include <sys/stat.h>
#include <unistd.h>

#include "tests/test.h"

#include "tests/file_size_limit.h"
#include "tests/keys.h"

namespace forereach::keys_test {

std::string ProblemOf(const std::function<void()>& load) {
  return Thrown<KeyError>([&] { load(); });
}

unsigned ModeOf(const std::string& path) {
  struct stat status {};
  EXPECT_EQ(::stat(path.c_str(), &status), 0) << path;
  return status.st_mode & 07777;
}

struct KeyFiles : testing::Test {
  [[nodiscard]] std::string File(const std::string& name) const { return keys_ + "/" + name; }
  [[nodiscard]] std::string Problem(const std::string& name = "planner.key", Role role = Role::kPlanner) const {
    return ProblemOf([&] { (void)LoadKeys(File(name), role); });
  }

  const ScratchDirectory scratch_;
  const std::string keys_ = MakeTestKeys(scratch_ / "keys");
};

TEST_F(KeyFiles, AreForTheirOwnerAloneAndOneForEachRole) {
  EXPECT_EQ(ModeOf(keys_), 0700u);
  EXPECT_EQ(ModeOf(File("verify.pub")), 0644u);
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(keys_)) files += entry.is_regular_file();
  EXPECT_EQ(files, kAllRoles.size() + 1);
  for (const Role role : kAllRoles) {
    const std::string path = File(std::string(RoleName(role)) + ".key");
    EXPECT_EQ(ModeOf(path), 0600u);
    const KeyRing of_directory = LoadKeys(keys_, role), of_file = LoadKeys(path, role);
    EXPECT_TRUE(of_directory == of_file);
    for (const Role other : kAllRoles) EXPECT_EQ(of_file.Holds(other), other == role);
    EXPECT_TRUE(LoadPublicKeys(keys_).IsSigned(role, {}, of_file.Sign(role, {})));
    EXPECT_TRUE(LoadAllKeys(keys_).Holds(role));
  }
  EXPECT_THAT(Read(File("verify.pub")), Not(HasSubstr("secret")));
  EXPECT_THAT(Read(File("verify.pub")), Not(HasSubstr("group")));
  EXPECT_EQ(LoadPublicKeys(File("verify.pub")).robot(), "test");
}

TEST_F(KeyFiles, NoTwoDirectoriesHaveAKeyInCommon) {
  const KeyRing one = LoadAllKeys(keys_), other = LoadAllKeys(MakeTestKeys(scratch_ / "others"));
  EXPECT_FALSE(one == other);
  EXPECT_FALSE(one.Tag({}) == other.Tag({}));
  for (const Role role : kAllRoles)
    for (const Role another : kAllRoles) EXPECT_NE(one.public_key(role), other.public_key(another));
}

TEST_F(KeyFiles, AreNeverReplaced) {
  const KeyRing before = LoadAllKeys(keys_);
  EXPECT_THAT(ProblemOf([&] { MakeKeys("test", keys_); }), HasSubstr("cannot be made: File exists"));
  EXPECT_TRUE(LoadAllKeys(keys_) == before);
  std::filesystem::create_directory_symlink(scratch_ / "elsewhere", scratch_ / "link");
  EXPECT_THAT(ProblemOf([&] { MakeKeys("test", scratch_ / "link"); }), HasSubstr("cannot be made"));
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "elsewhere"));
}

TEST_F(KeyFiles, NoUmaskOpensOrClosesThem) {
  for (const mode_t mask : {0000, 0777}) {
    const mode_t before = ::umask(mask);
    const std::string made = scratch_ / ("umask" + std::to_string(mask));
    const std::string problem = ProblemOf([&] { MakeKeys("test", made); });
    ::umask(before);
    EXPECT_EQ(problem, "");
    EXPECT_EQ(ModeOf(made), 0700u);
    EXPECT_EQ(ModeOf(made + "/certifier.key"), 0600u);
    EXPECT_EQ(ModeOf(made + "/verify.pub"), 0644u);
  }
}

TEST_F(KeyFiles, AWriteThatFailsLeavesNothingBehind) {
  const std::string made = scratch_ / "cut";
  const FileSizeLimit limit(100);
  EXPECT_THAT(ProblemOf([&] { MakeKeys("test", made); }), HasSubstr("cannot be written"));
  EXPECT_FALSE(std::filesystem::exists(made));
}

TEST_F(KeyFiles, RefusesARobotsNameThatIsTooLongOrHasOtherCharacters) {
  for (const std::string& bad :
       {std::string(), std::string("a b"), std::string("a\nb"), std::string("../a/b"), std::string(65, 'a')})
    EXPECT_THAT(ProblemOf([&] { MakeKeys(bad, scratch_ / "new"); }), HasSubstr("robot's name has to be")) << bad;
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "new"));
  EXPECT_EQ(ProblemOf([&] { MakeKeys(std::string(64, 'a'), scratch_ / "new"); }), "");
}

TEST_F(KeyFiles, OfAnotherRoleAreRefused) {
  const std::string problem = Problem("planner.key", Role::kCertifier);
  EXPECT_THAT(problem, HasSubstr("planner.key: line 3: role: is planner, this program speaks as certifier"));
  EXPECT_THAT(Problem("verify.pub"), HasSubstr("contains only public keys"));
  EXPECT_THAT(ProblemOf([&] { (void)LoadAllKeys(File("planner.key")); }), HasSubstr("needs the directory"));
}

TEST_F(KeyFiles, OfTwoRobotsInOneDirectoryAreRefused) {
  const std::string others = MakeTestKeys(scratch_ / "others");
  std::filesystem::copy_file(others + "/robot.key", File("robot.key"),
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(ProblemOf([&] { (void)LoadAllKeys(keys_); }), HasSubstr("robot.key: belongs to other keys"));
}

TEST_F(KeyFiles, ThatOthersCanReadOrWriteAreRefused) {
  for (const mode_t mode : {0640, 0604}) {
    ::chmod(File("planner.key").c_str(), mode);
    EXPECT_THAT(Problem(), HasSubstr("chmod 600")) << std::oct << mode;
  }
  for (const mode_t mode : {0620, 0602}) {
    ::chmod(File("planner.key").c_str(), mode);
    EXPECT_THAT(Problem(), HasSubstr("others can write it")) << std::oct << mode;
    ::chmod(File("verify.pub").c_str(), mode);
    EXPECT_THAT(ProblemOf([&] { (void)LoadPublicKeys(keys_); }), HasSubstr("others can write it")) << std::oct << mode;
  }
  ::chmod(File("planner.key").c_str(), 0400);
  EXPECT_EQ(Problem(), "");
}

TEST_F(KeyFiles, ThatAreNoRegularFilesAreRefusedAndNotWaitedFor) {
  ASSERT_EQ(::mkfifo(File("fifo").c_str(), 0600), 0);
  EXPECT_THAT(Problem("fifo"), HasSubstr("is no regular file"));
  std::filesystem::create_symlink(File("fifo"), File("link"));
  EXPECT_THAT(Problem("link"), HasSubstr("is no regular file"));
  EXPECT_THAT(ProblemOf([] { (void)LoadKeys("/dev/zero", Role::kPlanner); }), HasSubstr("is no regular file"));
  EXPECT_THAT(Problem("none"), HasSubstr("cannot be read: No such file"));
  std::filesystem::create_symlink(File("planner.key"), File("good link"));
  EXPECT_EQ(Problem("good link"), "");
  ::chmod(File("planner.key").c_str(), 0644);
  EXPECT_THAT(Problem("good link"), HasSubstr("others can read it")) << "it is what the link leads to that counts";
}

TEST_F(KeyFiles, AreReadLineByLine) {
  const std::string good = Read(File("planner.key"));
  std::vector<std::string> lines;
  std::istringstream text(good);
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 11u);
  const auto problem = [&](const std::vector<std::string>& changed, const std::string& end = "\n") {
    std::string all;
    for (const std::string& line : changed) all += line + (&line == &changed.back() ? end : "\n");
    std::ofstream(File("planner.key"), std::ios::trunc) << all;
    return Problem();
  };
  EXPECT_EQ(problem(lines), "");
  EXPECT_THAT(problem(lines, ""), HasSubstr("line 11: is missing, or does not end"));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string at = "line " + std::to_string(i + 1);
    auto missing = lines, twice = lines, upper = lines, tailed = lines;
    missing.erase(missing.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_THAT(problem(missing), HasSubstr(at)) << i;
    twice.insert(twice.begin() + static_cast<std::ptrdiff_t>(i), lines[i]);
    EXPECT_THAT(problem(twice), HasSubstr("line " + std::to_string(i + 2))) << i;
    tailed[i] += " ";
    EXPECT_THAT(problem(tailed), HasSubstr(at)) << i;
    if (i < 3) continue;
    upper[i].back() = 'G';
    EXPECT_THAT(problem(upper), HasSubstr("64 lower-case hexadecimal digits")) << i;
    EXPECT_THAT(problem(upper), Not(HasSubstr(lines[i].substr(lines[i].rfind(' ') + 1, 20))))
        << "a secret is not shown";
  }
  auto other = lines;
  std::swap(other[3], other[4]);
  EXPECT_THAT(problem(other), HasSubstr("line 4: has to begin with \"secret \""));
  other = lines;
  other[7] = "public perception " + lines[5].substr(lines[5].rfind(' ') + 1);
  EXPECT_THAT(problem(other), HasSubstr("line 8: public perception: is another role's key too"));
  other = lines;
  other[5] = "public certifier " + lines[6].substr(lines[6].rfind(' ') + 1);
  EXPECT_THAT(problem(other), HasSubstr("line 6: public certifier: is the key of planner too"));
  other = lines;
  other[3] = "secret " + std::string(64, '0');
  EXPECT_THAT(problem(other), HasSubstr("public planner: is not that of the secret in line 4"));
  EXPECT_THAT(problem({std::string(5000, 'a')}), HasSubstr("line 1"));
  EXPECT_THAT(problem({""}), HasSubstr("line 1"));
}

}  // namespace forereach::keys_test
