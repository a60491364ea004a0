// Commands read a log once: this program counts the bytes that it reads while a command runs in it.
#include "tests/test.h"

#include "cli/commands.h"
#include "tests/paths.h"
#include "tests/records/course.h"

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

class PassesTest : public testing::TestWithParam<const char*> {
 protected:
  // The recorded course in the directory of a logger, without a database.
  PassesTest() {
    fs::create_directory(scratch_ / "log");
    log_ = scratch_ / "log/events-20260101-120000-000000.lcmlog";
    fs::copy(kCourseLog, log_);
  }

  // How often the command reads the log, with everything else that it reads.
  double Passes(std::string line) {
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
    const Command program{
        .name = "forereach",
        .commands = {ReplayCommand(), VerifyCommand(), AdviseCommand(), ReportCommand(), ExportCommand(), LogCommand()},
        .chosen = &chosen};
    const std::int64_t before = BytesRead();
    testing::internal::CaptureStdout();
    const bool is_parsed = !ParseCommandLine(program, static_cast<int>(argv.size()), argv.data());
    const int code = is_parsed ? std::ranges::find(program.commands, chosen, &Command::name)->run() : kExitBadInput;
    const std::string output = testing::internal::GetCapturedStdout();
    EXPECT_LE(code, 1) << line << "\n" << output;
    // An export reads the program, too, since what was kept of another program is not used.
    const std::int64_t own_bytes =
        line.starts_with("export") ? static_cast<std::int64_t>(fs::file_size(fs::read_symlink("/proc/self/exe"))) : 0;
    return static_cast<double>(BytesRead() - before - own_bytes) / static_cast<double>(fs::file_size(log_));
  }

  ScratchDirectory scratch_;
  std::string log_;
};

TEST_P(PassesTest, ALogIsReadOnce) {
  const double passes = Passes(GetParam());
  EXPECT_GT(passes, 0.99) << "otherwise nothing was counted";
  EXPECT_LT(passes, 1.4) << "the log, and the task with its transitions";
}

INSTANTIATE_TEST_SUITE_P(Commands, PassesTest,
                         testing::Values("replay LOG --config TASK", "replay DIRECTORY --config TASK",
                                         "replay LOG --compare --config TASK", "verify LOG --config TASK",
                                         "advise LOG --config TASK", "report LOG --config TASK",
                                         "report DIRECTORY --config TASK", "report LOG --picture OUT.svg --config TASK",
                                         "log list LOG", "report LOG --out OUT.html --config TASK",
                                         "report DIRECTORY --out OUT.html --config TASK",
                                         "export LOG --format csv --out OUT", "export LOG --format mcap --out OUT"));

}  // namespace forereach::passes_test
