// `forereach import --database`: the transitions of all robots, and what differs between them.
#include "fleet/transitions.h"

#include "fleet/ingest.h"
#include "forereach/transition_t.hpp"
#include "tests/cli/program.h"
#include "tests/fleet/postgres.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"

namespace forereach::transitions_test {

class FleetImportTest : public PostgresTest {
 protected:
  // The recorded course as a robot's log, with its transitions changed.
  void Add(const std::string& robot, const std::function<void(int number, transition_t&)>& change = {}) {
    const std::string log = scratch_ / (robot + ".lcmlog");
    int number = 0;
    CopyLog(kCourseLog, log, [&](LogEvent& event) {
      auto transition = Decoded<transition_t>(event.data);
      if (transition && change) {
        change(number++, *transition);
        event.data = Encode(*transition);
      }
      return true;
    });
    Store store(server_->Address());
    static_cast<void>(IngestLogs({.robot = {}, .logs = {log}, .database = {}, .missing = {}}, store,
                                 {.robot = robot, .config = kCourseTask, .key = {}, .shard = {}}));
  }
  static std::vector<transition_t> OfCourse() {
    std::vector<transition_t> all;
    for (const LogEvent& event : ReadLog(kCourseLog).events)
      if (const auto transition = Decoded<transition_t>(event.data)) all.push_back(*transition);
    return all;
  }
  Output Import(const std::string& options) const {
    return Forereach("import --config " + kCourseTask + " --database '" + server_->Address() + "' " + options +
                     " 2>&1");
  }
  nlohmann::json Tables(const std::string& options = "") const {
    return nlohmann::json::parse(Import("--json " + options).text);
  }

  const ScratchDirectory scratch_;
  const std::string out_ = scratch_ / "fleet.csv";
};

TEST_F(FleetImportTest, WritesWhatEachRobotHasExecuted) {
  const std::vector<transition_t> of_course = OfCourse();
  ASSERT_GT(of_course.size(), 10u);
  Add("r1");
  Add("r2");
  EXPECT_THAT(Import("--out " + out_),
              Exits(0, "import: " + std::to_string(2 * of_course.size()) + " transitions of 0.1 s in "));
  const Config config = LoadConfig(kCourseTask);
  const NominalModel& model = *config.problem->model;
  const Transitions all = LoadTransitions(out_, model);
  ASSERT_EQ(all.size(), 2 * std::ssize(of_course));
  for (Eigen::Index i = 0; i < all.size(); ++i) {
    const transition_t& expected = of_course[static_cast<std::size_t>(i) % of_course.size()];
    for (int k = 0; k < model.num_states(); ++k) {
      EXPECT_EQ(all.z(i, k), expected.state[k]);
      EXPECT_EQ(all.x_next(i, k), expected.next_state[k]);
    }
    for (int l = 0; l < model.num_inputs(); ++l) EXPECT_EQ(all.z(i, model.num_states() + l), expected.input[l]);
  }
  // It is what other commands read.
  const std::string task = scratch_.Write(
      "task.yaml", Replaced(Read(kCourseTask), "transitions: course_transitions.csv", "transitions: fleet.csv"));
  EXPECT_THAT(Forereach("declare --from-data --by v,delta --config " + task + " 2>&1"),
              Exits(0, "from " + std::to_string(2 * of_course.size()) + " transitions"));
}

// Of each robot alone, and of all together.
TEST_F(FleetImportTest, WritesWhatFitReads) {
  std::string text = Replaced(Read(kCourseTask), "transitions: course_transitions.csv", "transitions: fleet.csv");
  text = Replaced(text, "{name: kinematic_bicycle, dt: 0.1, wheelbase: 2.5, set_at_steps: [a, delta]}",
                  "{file: " FOREREACH_SOURCE_DIR
                  "/config/models/kinematic_bicycle.yaml, parameters: {dt: 0.1, wheelbase: 2.5}, angles: []}");
  const std::string task = scratch_.Write("task.yaml", text.substr(0, text.find("\ncertifier:") + 1));
  Add("r1");
  Add("r2", [](int, transition_t& transition) {  // It turns less, as a longer car does.
    transition.next_state[2] = transition.state[2] + 0.8 * (transition.next_state[2] - transition.state[2]);
  });
  const auto wheelbase = [&](const std::string& robots) {
    EXPECT_THAT(Import("--out " + out_ + robots).text, HasSubstr("transitions of 0.1 s in "));
    const Output output = Forereach("fit --json --parameters wheelbase --config " + task);
    EXPECT_EQ(output.code, 0) << robots;
    std::filesystem::remove(out_);
    return nlohmann::json::parse(output.text)["parameters"][0]["after"].get<double>();
  };
  const double first = wheelbase(" --robot r1"), second = wheelbase(" --robot r2"), pooled = wheelbase("");
  EXPECT_NEAR(second, first / 0.8, 1e-6 * second);
  EXPECT_LT(first + 0.05, pooled);
  EXPECT_LT(pooled, second - 0.05);
}

// The task looks at no clock.
TEST_F(FleetImportTest, TakesStepsOfOtherDurationsWithThese) {
  Add("r1", [](int number, transition_t& transition) {
    if (number == 0) transition.duration_us += 2000;
    if (number == 1) transition.duration_us = 200'000;
  });
  EXPECT_THAT(Import("--out " + out_), Exits(0, "import: " + std::to_string(OfCourse().size() - 1) + " transitions",
                                             "column dt_error says it of each"));
  const Transitions all = LoadTransitions(out_, *LoadConfig(kCourseTask).problem->model);
  EXPECT_NEAR(all.Longer(0), 0.002, 2e-6);
  EXPECT_LT(all.Longer(1), 2e-6);
}

// Steps may be up to 60 ms off, and a file's up to half of dt, 50 ms: what is written is read again.
TEST_F(FleetImportTest, TakesNoStepThatATaskRefusesByItsDuration) {
  std::string text = Replaced(Read(kCourseTask), "transitions: course_transitions.csv", "transitions: fleet.csv");
  text = Replaced(text, "step_error_ms: any", "step_error_ms: 30");
  const std::string task =
      scratch_.Write("task.yaml", Replaced(text, "set_at_steps: [a, delta]",
                                           "set_at_steps: [a, delta], rate_bound: {x: 20, y: 20, theta: 3, v: 9}"));
  Add("r1", [](int number, transition_t& transition) {
    if (number < 2) transition.duration_us += number == 0 ? 49'998 : 49'999;
  });
  EXPECT_THAT(Forereach("import --config " + task + " --database '" + server_->Address() + "' --out " + out_ + " 2>&1"),
              Exits(0, "import: " + std::to_string(OfCourse().size() - 1) + " transitions"));
  const Config config = LoadConfig(task);
  EXPECT_NEAR(config.problem->transitions.Longer(0), 0.049999, 1e-9);
  EXPECT_LT(config.problem->transitions.Longer(1), 3e-6);
}

TEST_F(FleetImportTest, TakesOneRobotOrDay) {
  const std::string count = std::to_string(OfCourse().size());
  Add("r1");
  Add("r2");
  EXPECT_THAT(Import("--robot r2"), Exits(0, "import: " + count + " transitions"));
  EXPECT_THAT(Import("--robot r3"), Exits(1, "import: 0 transitions"));
  const auto days = Tables("--by day")["Residuals"]["rows"];
  ASSERT_EQ(days.size(), 1u);
  EXPECT_EQ(days[0][1], std::to_string(2 * OfCourse().size()));
  EXPECT_THAT(Import("--robot r1 --day " + days[0][0].get<std::string>()),
              Exits(0, "import: " + count + " transitions"));
  EXPECT_THAT(Import("--day 2001-01-01"), Exits(1, "import: 0 transitions"));
  for (const std::string day : {"2001-13-01", "2001-02-29", "2001-1-1", "today", "2001-01-01x", "+001-01-01"})
    EXPECT_THAT(Import("--day " + day), Exits(2, "--day: "));
}

// By name, of a row of the table of residuals.
double CellOf(const nlohmann::json& table, std::size_t row, const std::string& column) {
  const auto columns = table["columns"].get<std::vector<std::string>>();
  const auto at = static_cast<std::size_t>(std::ranges::find(columns, column) - columns.begin());
  return std::stod(table["rows"].at(row).at(at).get<std::string>());
}

TEST_F(FleetImportTest, ShowsWhatDiffersBetweenRobots) {
  Add("r1");
  Add("r2", [](int, transition_t& transition) { transition.next_state[3] += 0.25; });
  const auto table = Tables()["Residuals"];
  EXPECT_NEAR(CellOf(table, 1, "v mean") - CellOf(table, 0, "v mean"), 0.25, 1e-3);
  EXPECT_NEAR(CellOf(table, 1, "v deviation"), CellOf(table, 0, "v deviation"), 1e-3);
  EXPECT_EQ(CellOf(table, 1, "x mean"), CellOf(table, 0, "x mean"));
}

TEST_F(FleetImportTest, NamesTheRobotsThatRefuteTheDeclaration) {
  Add("r1");
  Add("r2");
  EXPECT_TRUE(Tables()["Contradictions of the declaration"]["rows"].empty());
  // Each is consistent with itself: the declaration says that the residual of x is a constant.
  Add("r3", [](int, transition_t& transition) { transition.next_state[0] += 0.5; });
  EXPECT_THAT(Import("--robot r3"), Exits(0));
  auto rows = Tables()["Contradictions of the declaration"]["rows"];
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0][0], "x");
  EXPECT_THAT((std::set<std::string>{rows[0][3], rows[0][6]}), Contains("r3"));
  EXPECT_NE(rows[0][3], rows[0][6]);
  // And one that is not.
  Add("r4", [](int number, transition_t& transition) { transition.next_state[0] += number == 4 ? 0.01 : 0; });
  EXPECT_THAT(Import(""), Exits(1, "Contradictions of the declaration"));
  rows = Tables()["Contradictions of the declaration"]["rows"];
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0][3], "r4");
  EXPECT_EQ(rows[0][6], "r4");
  EXPECT_EQ(Import("--out " + out_).code, 1);
  EXPECT_TRUE(std::filesystem::exists(out_)) << "they are the data that say it";
}

TEST_F(FleetImportTest, LeavesOutWhatNoCertifierLearns) {
  Add("r1", [](int number, transition_t& transition) {
    if (number == 0) transition.num_states = 4;
    if (number == 1) transition.next_state[0] = NAN;
    if (number == 2 || number == 3) transition.state[0] = 1e6;
  });
  const auto tables = Tables();
  EXPECT_EQ(tables["Residuals"]["rows"][0][2], "4");
  EXPECT_EQ(tables["Refused"]["rows"].size(), 3u) << tables["Refused"];
}

TEST_F(FleetImportTest, LeavesOutRowsThatNoMessageHas) {
  Add("r1");
  const std::string nth = "WHERE event_number = (SELECT event_number FROM transitions ORDER BY 1 OFFSET ";
  const std::string many = "'[' || repeat('0,', 16) || '0]'";  // a message has 16 at most
  EXPECT_EQ(server_
                ->Sql("UPDATE transitions SET next_state = '[1, 2]' " + nth +
                      "1 LIMIT 1); UPDATE transitions SET state = " + many + ", next_state = " + many + nth +
                      "2 LIMIT 1); UPDATE transitions SET input = '[]' || '' " + nth + "3 LIMIT 1)")
                .text,
            "");
  const auto tables = Tables();
  EXPECT_EQ(tables["Residuals"]["rows"][0][2], "3");
  const auto refused = tables["Refused"]["rows"];
  ASSERT_EQ(refused.size(), 2u) << refused;
  EXPECT_THAT((std::set<std::string>{refused[0][0], refused[1][0]}), testing::ElementsAre("1", "2"));
  EXPECT_THAT(tables["Refused"].dump(), HasSubstr("the row has other sizes than a message of a step"));
}

}  // namespace forereach::transitions_test
