// Commands that read logs: each reads a log once, and says the same on any number of threads. This program counts the
// bytes that it reads while a command runs in it.

#include "cli/commands.h"
#include "forereach/certified_plan_t.hpp"
#include "lcmtypes/seal.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"

namespace forereach::passes_test {

namespace fs = std::filesystem;

std::int64_t BytesRead() {
  std::ifstream file("/proc/self/io");
  std::string name;
  std::int64_t bytes = -1;
  file >> name >> bytes;
  EXPECT_EQ(name, "rchar:");
  return bytes;
}

struct PassesTest : testing::TestWithParam<const char*> {
  // The recorded course in the directory of a logger, without a database.
  PassesTest() {
    fs::create_directory(scratch_ / "log");
    log_ = scratch_ / "log/events-20260101-120000-000000.lcmlog";
    fs::copy(kCourseLog, log_);
  }

  // @return what the command prints.
  std::string Run(std::string line) {
    for (const auto& [name, value] : {std::pair<std::string, std::string>{"LOG", log_},
                                      {"DIRECTORY", scratch_ / "log"},
                                      {"OUT", scratch_ / "out"},
                                      {"TASK", kCourseTask}})
      for (std::size_t at; (at = line.find(name)) != std::string::npos;) line.replace(at, name.size(), value);
    std::istringstream words(line);
    std::vector<std::string> arguments{"forereach"};
    for (std::string word; words >> word;) arguments.push_back(word);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    std::string chosen;
    const Command program{.name = "forereach",
                          .commands = {ReplayCommand(), VerifyCommand(), AdviseCommand(), ReportCommand(),
                                       ExportCommand(), LogCommand(), CheckLogCommand(), MergeCommand()},
                          .chosen = &chosen};
    testing::internal::CaptureStdout();
    const bool is_parsed = !ParseCommandLine(program, static_cast<int>(argv.size()), argv.data());
    const int code = is_parsed ? std::ranges::find(program.commands, chosen, &Command::name)->run() : kExitBadInput;
    const std::string output = testing::internal::GetCapturedStdout();
    EXPECT_LE(code, 1) << line << "\n" << output;
    return output;
  }

  // How often the command reads the log, with everything else that it reads.
  double Passes(const std::string& line) {
    const std::int64_t before = BytesRead();
    Run(line);
    return static_cast<double>(BytesRead() - before) / static_cast<double>(fs::file_size(log_));
  }

  ScratchDirectory scratch_;
  std::string log_;
};

TEST_P(PassesTest, ALogIsReadOnce) {
  const double passes = Passes(GetParam());
  EXPECT_GT(passes, 0.99) << "otherwise nothing was counted";
  EXPECT_LT(passes, 1.4) << "the log, and the task with its transitions";
}

// A shard also reads the program for its digest.
TEST_F(PassesTest, AShardReadsALogOnce) {
  const double program =
      static_cast<double>(fs::file_size(fs::read_symlink("/proc/self/exe"))) / static_cast<double>(fs::file_size(log_));
  const auto passes = [&](const std::string& line, int programs) { return Passes(line) - programs * program; };
  EXPECT_LT(passes("replay LOG --config TASK --shard 1/2 --out OUT1", 1), 1.5);
  EXPECT_LT(passes("replay LOG --config TASK --shard 2/2 --out OUT2", 1), 1.5);
  EXPECT_LT(passes("merge OUT1 OUT2", 2), 0.4) << "without the log";
}

INSTANTIATE_TEST_SUITE_P(
    Commands, PassesTest,
    testing::Values("replay LOG --config TASK", "replay DIRECTORY --config TASK", "replay LOG --compare --config TASK",
                    "verify LOG --config TASK", "advise LOG --config TASK", "report LOG --config TASK",
                    "report DIRECTORY --config TASK", "report LOG --picture OUT.svg --config TASK",
                    "verify DIRECTORY --config TASK", "advise DIRECTORY --config TASK", "log list LOG",
                    "report LOG --out OUT.html --config TASK", "report DIRECTORY --out OUT.html --config TASK",
                    "export LOG --format csv --out OUT", "export LOG --format mcap --out OUT",
                    "export LOG --format jsonl --out OUT", "export LOG --format npz --out OUT",
                    "export DIRECTORY --format csv --out OUT", "log filter LOG --out OUT.lcmlog --channel ROBOT_STATE",
                    "log merge LOG --out OUT.lcmlog", "log cut LOG --out OUT.lcmlog --from 1",
                    "log cut LOG --out OUT.lcmlog --outcome certified"));

struct ThreadsTest : PassesTest {
  // Slices shrunken so that every certificate is refuted, and every other one sealed anew: there is much to say.
  ThreadsTest() {
    bool reseals = false;
    std::filesystem::remove(log_);
    CopyLog(kCourseLog, log_, [&](LogEvent& event) {
      if (auto certified = Decoded<certified_plan_t>(event.data)) {
        certified->slice_upper[1][0] -= 1e-9;
        if (reseals = !reseals; reseals) SetDigest(certified->certificate_digest, CertificateDigest(*certified));
        event.data = Encode(*certified);
      }
      return true;
    });
  }
};

TEST_P(ThreadsTest, FourSayWhatOneSays) {
  const std::string page = scratch_ / "out.html", line = GetParam();
  const std::string said = Run(line + " --jobs 1");
  const std::vector<std::uint8_t> written = ReadBytes(page);
  EXPECT_GT(said.size() + written.size(), 500u);
  EXPECT_EQ(Run(line + " --jobs 4"), said);
  EXPECT_EQ(ReadBytes(page), written);
}

INSTANTIATE_TEST_SUITE_P(Commands, ThreadsTest,
                         testing::Values("verify --json LOG --config TASK", "replay --json LOG --config TASK",
                                         "replay LOG --compare --config TASK --json",
                                         "report LOG --out OUT.html --force --advice-seconds 0 --config TASK"));

}  // namespace forereach::passes_test
