// `forereach run` drives a robot with each model of the library to its goal.

#include "tests/cli/program.h"
#include "tests/task/task_files.h"

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
  EXPECT_THAT(robot, Holds({{"goal_reached", true}, {"contacts", 0}, {"limits_exceeded", 0}}));
  EXPECT_GE(robot["steps_executed"], 20);
  EXPECT_THAT(robot, Holds({{"steps_inside_slice", robot["steps_executed"]},
                            {"emergency_stops", 0},
                            {"plans_refused", Json::object()}}));
  // One that cannot stand is never without a plan before the goal.
  if (Read(FOREREACH_SOURCE_DIR "/" + task).find("hold: []") != std::string::npos) EXPECT_EQ(robot["stops"], 0);
}

void CopyDrives(const ScratchDirectory& scratch) {
  for (const char* part : {"drive", "models"})
    std::filesystem::copy(std::string(FOREREACH_SOURCE_DIR "/config/") + part, scratch / part);
}

TEST(Run, RefusesAStartAtASpeedAndCheckNamesIt) {
  const ScratchDirectory scratch;
  CopyDrives(scratch);
  const std::string task = Read(scratch / "drive/unicycle.yaml"), path = scratch / "drive/unicycle.yaml";
  const auto with = [&](const char* speed) {
    scratch.Write("drive/unicycle.yaml",
                  Replaced(task, "start: [0, 0, 0, 0, 0]", std::string("start: [0, 0, 0, ") + speed + ", 0]"));
  };
  for (const char* speed : {"1", "-0.5", "0.021"}) {
    with(speed);
    EXPECT_THAT(Forereach("run " + path + " --directory '" + (scratch / "log") + "' 2>&1"),
                Exits(2, "unicycle.yaml: robot.start: v is " + std::string(speed)));
    EXPECT_THAT(Forereach("check " + path).text, HasSubstr("robot.start: remark: v begins at " + std::string(speed)));
  }
  with("0.02");  // planner.initial_half_width
  EXPECT_EQ(Forereach("run " + path + " --directory '" + (scratch / "log") + "' 2>&1").code, 0);
}

TEST(Run, SaysWhatBecameOfThePlansIfTheRobotDoesNotArrive) {
  const ScratchDirectory scratch;
  CopyDrives(scratch);
  scratch.Write("drive/unicycle.yaml",
                Replaced(Read(scratch / "drive/unicycle.yaml"), "time_limit_s: 60", "time_limit_s: 3"));
  EXPECT_THAT(Forereach("run '" + (scratch / "drive/unicycle.yaml") + "' --directory '" + (scratch / "log") + "' 2>&1"),
              Exits(1, ContainsRegex("did not reach planner.goal: the planner searched [1-9][0-9]* times and "
                                     "proposed [1-9][0-9]* plans, [1-9][0-9]* were certified")));
}

// What keeps the start is said, and not what cannot help.
TEST(Plan, FromWhereNoneIsPossibleSaysWhy) {
  const ScratchDirectory scratch;
  CopyDrives(scratch);
  const std::string task = Read(scratch / "drive/unicycle.yaml"), path = scratch / "drive/unicycle.yaml";
  const struct {
    const char *center, *why;
  } cases[] = {{"[2.5, 0.3, 0, 0, 0]", "task.obstacles[0]: the robot may touch it at the start"},
               {"[-3, 0.3, 0, 0, 0]", "below its bound -1"}};
  for (const auto& [center, why] : cases) {
    scratch.Write("drive/unicycle.yaml", Replaced(task, "center: [0, 0, 0, 0, 0]", std::string("center: ") + center));
    EXPECT_THAT(Forereach("plan " + path + " --out '" + (scratch / "plan.csv") + "' 2>&1"),
                Exits(1, why, Not(HasSubstr("planner.time_limit_ms may help"))));
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
