// `forereach run` drives a robot with each model of the library to its goal.
#include "tests/test.h"

#include "tests/cli/program.h"
#include "tests/paths.h"

namespace forereach::drive_test {

using Json = nlohmann::json;

// The line of JSON in an output that has this key.
Json LineWith(const std::string& output, const std::string& key) {
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line);)
    if (const Json parsed = Json::parse(line, nullptr, false); parsed.is_object() && parsed.contains(key))
      return parsed;
  return {};
}

class Drive : public testing::TestWithParam<std::string> {};

TEST_P(Drive, ReachesItsGoal) {
  const ScratchDirectory scratch;
  const std::string task = "config/drive/" + GetParam() + ".yaml";
  const Output run = Forereach("run --config " + task + " --directory '" + scratch.path() + "'");
  EXPECT_EQ(run.code, 0);
  const Json robot = LineWith(run.text, "steps_executed");
  SCOPED_TRACE(run.text);
  ASSERT_TRUE(robot.is_object());
  EXPECT_EQ(robot["goal_reached"], true);
  EXPECT_EQ(robot["contacts"], 0);
  EXPECT_EQ(robot["limits_exceeded"], 0);
  EXPECT_GE(robot["steps_executed"], 20);
  EXPECT_EQ(robot["steps_inside_slice"], robot["steps_executed"]);
  EXPECT_EQ(robot["emergency_stops"], 0);
  EXPECT_EQ(robot["plans_refused"], Json::object());
  // One that cannot stand is never without a plan before the goal.
  if (Read(FOREREACH_SOURCE_DIR "/" + task).find("hold: []") != std::string::npos) {
    EXPECT_EQ(robot["stops"], 0);
  }
}

std::vector<std::string> Drives() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(FOREREACH_SOURCE_DIR "/config/drive"))
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem());
  std::ranges::sort(names);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Models, Drive, testing::ValuesIn(Drives()), [](const auto& info) { return info.param; });

}  // namespace forereach::drive_test
