// How every process starts, refuses to, and ends.
#include "tests/test.h"

#include "tests/keys.h"
#include "tests/process/process_fixture.h"

namespace forereach::usage_test {

struct Executable {
  const char *name, *path;
  friend void PrintTo(const Executable& program, std::ostream* out) { *out << program.name; }
};

struct UsageTest : testing::TestWithParam<Executable> {
  std::string program() const { return GetParam().path; }

  // The last line on standard error, without its end; LCM itself may have written lines before it.
  static std::string LastLine(const ChildProcess& process) {
    std::string text = process.error();
    while (text.ends_with('\n')) text.pop_back();
    return text.substr(text.rfind('\n') + 1);
  }

  const ScratchDirectory scratch_;
};

INSTANTIATE_TEST_SUITE_P(Processes, UsageTest,
                         testing::Values(Executable{"certifier", FOREREACH_CERTIFIER},
                                         Executable{"planner", FOREREACH_PLANNER},
                                         Executable{"logger", FOREREACH_LOGGER},
                                         Executable{"robot_sim", FOREREACH_ROBOT_SIM}),
                         [](const auto& instance) { return instance.param.name; });

TEST_P(UsageTest, HelpTeachesWithAnExample) {
  ChildProcess process({program(), "--help"});
  EXPECT_EQ(process.WaitForExit(), 0);
  EXPECT_THAT(process.output(),
              AllOf(HasSubstr("--config"), HasSubstr("--lcm-url"), HasSubstr("Example:\n  forereach-")));
}

TEST_P(UsageTest, WithoutAKeyItWarns) {
  const std::string task = scratch_.Write("task.yaml", PatientTask()), url = PrivateBusUrl();
  for (const bool with_key : {false, true}) {
    std::vector<std::string> command{program(), "--config", task, "--lcm-url", url};
    if (with_key) command.insert(command.end(), {"--key", MakeTestKeys(scratch_ / "keys")});
    if (program() == FOREREACH_LOGGER) command.insert(command.end(), {"--directory", scratch_ / "log"});
    ChildProcess process(command);
    EXPECT_TRUE(process.WaitForLog("ready on")) << process.error();
    EXPECT_EQ(process.error().find("UNSIGNED: anyone on this network can move this robot") == std::string::npos,
              with_key);
    EXPECT_EQ(process.Terminate(), 0);
  }
}

TEST_P(UsageTest, ExitsWithTwoWithoutConfig) {
  ChildProcess process({program()});
  EXPECT_EQ(process.WaitForExit(), 2);
  EXPECT_THAT(process.error(), HasSubstr("--config is required"));
}

TEST_P(UsageTest, AnUnknownOptionIsNamed) {
  ChildProcess process({program(), "--config", "x", "--nonsense"});
  EXPECT_EQ(process.WaitForExit(), 2);
  EXPECT_THAT(process.error(), HasSubstr("unknown option --nonsense; known here: --"));
}

TEST_P(UsageTest, AnUnknownOptionBringsTheOneThatWasMeant) {
  ChildProcess process({program(), "--confg", "x"});
  EXPECT_EQ(process.WaitForExit(), 2);
  EXPECT_THAT(process.error(), HasSubstr("unknown option --confg; did you mean --config?"));
}

TEST_P(UsageTest, VersionIsNameAndVersion) {
  ChildProcess process({program(), "--version"});
  EXPECT_EQ(process.WaitForExit(), 0);
  const std::string name = program().substr(program().rfind('/') + 1);
  EXPECT_FIELDS(process, (output(), name + " " FOREREACH_VERSION "\n"), (error(), ""));
}

TEST_P(UsageTest, AMissingFileIsNamedInOneLine) {
  ChildProcess process({program(), "--config", scratch_ / "none.yaml"});
  EXPECT_EQ(process.WaitForExit(), 2);
  EXPECT_THAT(process.error(), HasSubstr("none.yaml"));
  EXPECT_EQ(LastLine(process) + "\n", process.error());
}

TEST_P(UsageTest, AnUnknownKeyIsNamedWithItsFileAndLineInOneLine) {
  const std::string text = PatientTask(), path = scratch_.Write("task.yaml", text + "speeed: 3\n");
  ChildProcess process({program(), "--config", path, "--lcm-url", PrivateBusUrl()});
  EXPECT_EQ(process.WaitForExit(), 2);
  const std::string line = std::to_string(std::ranges::count(text, '\n') + 1);
  EXPECT_THAT(process.error(), AllOf(HasSubstr("task.yaml:" + line), HasSubstr("speeed")));
  EXPECT_EQ(LastLine(process) + "\n", process.error());
}

TEST_P(UsageTest, ABusThatIsNoMulticastIsRefused) {
  ChildProcess process(
      {program(), "--config", scratch_.Write("task.yaml", PatientTask()), "--lcm-url", "udpm://1.2.3.4:7667?ttl=0"});
  EXPECT_EQ(process.WaitForExit(), 2);
  EXPECT_THAT(LastLine(process),
              AllOf(HasSubstr("udpm://1.2.3.4:7667"), HasSubstr("\"1.2.3.4\" has to be one of IPv4 multicast")));
  EXPECT_THAT(process.error(), Not(HasSubstr("ready on")));
}

TEST_P(UsageTest, EndsCleanlyOnSigterm) {
  ChildProcess process({program(), "--config",
                        scratch_.Write("task.yaml", PatientTask() + "logger: {directory: log}\n"), "--lcm-url",
                        PrivateBusUrl()});
  ASSERT_TRUE(process.WaitForLog("ready on udpm://")) << process.error();
  EXPECT_EQ(process.Terminate(), 0) << process.error();
  EXPECT_NE(process.output(), "") << "a summary";
}

}  // namespace forereach::usage_test
