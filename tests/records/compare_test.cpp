// `forereach replay --compare`: what another task would have changed.
#include "records/replay.h"

#include "records/database.h"
#include "records/timeline.h"
#include "tests/cli/program.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"

namespace forereach::compare_test {

struct CompareTest : testing::Test {
  Output CompareUnder(const std::string& config, const std::string& logs = kCourseLog,
                      const std::string& more = "") const {
    return Forereach("replay '" + logs + "' --compare --config '" + config + "' " + more + " 2>&1");
  }

  const ScratchDirectory scratch_;
};

TEST_F(CompareTest, TheSameTaskChangesNothing) {
  const Output output = CompareUnder(kCourseTask);
  EXPECT_EQ(output.code, 0) << output.text;
  EXPECT_EQ(output.text, "compare: had " + kCourseTask + " been declared, 0 of " + std::to_string(kCourseAbstained) +
                             " abstentions and rejections would have been certificates, and none of the " +
                             std::to_string(kCourseCertified) + " certificates lost\n");
}

TEST_F(CompareTest, CountsWhatIsGainedAndLost) {
  const Config task = LoadConfig(kCourseTask);
  Config free = task;
  free.obstacles.clear();
  const Comparison none = Compare({kCourseLog}, free);
  EXPECT_FIELDS(none, (candidates, kCourseDecisions), (certificates, kCourseCertified));
  EXPECT_EQ(none.num_lost(), 0) << "without obstacles every certificate stands";
  std::int64_t safety = 0;
  class Counter final : public TimelineUser {
   public:
    explicit Counter(std::int64_t& count) : count_(count) {}
    void OnDecision(const RecordedDecision& recorded) override {
      count_ += recorded.decision.outcome == decision_t::ABSTAIN_SAFETY;
    }

   private:
    std::int64_t& count_;
  } counter(safety);
  Timeline timeline(task, {&counter});
  timeline.Read({kCourseLog}, false);
  EXPECT_GT(safety, 0);
  std::int64_t gained_of_safety = 0;
  for (const auto& [why, count] : none.gained) {
    EXPECT_EQ(why.outcome, decision_t::ABSTAIN_SAFETY) << "only obstacles are gone";
    EXPECT_GE(why.step, 0);
    gained_of_safety += count;
  }
  EXPECT_EQ(gained_of_safety, none.num_gained());
  EXPECT_EQ(std::ssize(none.gained_plans), none.num_gained());
  EXPECT_TRUE(none.lost_plans.empty());
  std::int64_t otherwise = none.refused_alike;
  for (const auto& [whys, count] : none.otherwise) otherwise += count;
  EXPECT_EQ(none.num_gained() + otherwise, kCourseAbstained);
}

TEST_F(CompareTest, ACertificateThatIsLostIsNamed) {
  Config task = LoadConfig(kCourseTask);
  auto problem = std::make_shared<Problem>(*task.problem);
  problem->declaration.noise_bound *= 100;
  problem->declaration.noise_bound.array() += 0.5;
  task.problem = problem;
  const Comparison compared = Compare({kCourseLog}, task);
  EXPECT_EQ(compared.num_gained(), 0);
  EXPECT_GT(compared.num_lost(), 0);
  ASSERT_EQ(std::ssize(compared.lost_plans), compared.num_lost());
  EXPECT_THAT(compared.lost_plans, testing::Each(HasSubstr("event ")));
  Comparison twice = compared;
  twice += compared;
  EXPECT_FIELDS(twice, (num_lost(), 2 * compared.num_lost()), (candidates, 2 * kCourseDecisions));
}

TEST_F(CompareTest, PrintsJson) {
  const Output output = CompareUnder(kCourseTask, kCourseLog, "--json");
  EXPECT_EQ(output.code, 0) << output.text;
  const auto document = nlohmann::json::parse(output.text);
  EXPECT_THAT(document, Holds({{"candidates", kCourseDecisions}, {"gained", 0}, {"refused_alike", kCourseAbstained}}));
  EXPECT_TRUE(document["lost_by"].empty());
}

TEST_F(CompareTest, ADirectoryIsReplayedAndCompared) {
  const std::string directory = scratch_ / "log";
  std::filesystem::create_directory(directory);
  {
    Database database(directory + "/decisions.sqlite");
    for (const char* name : {"events-1.lcmlog", "events-2.lcmlog"}) {
      std::filesystem::copy_file(kCourseLog, directory + "/" + name);
      database.BeginRun(name, 3);
    }
  }
  const Output replay = Forereach("replay '" + directory + "' --config '" + kCourseTask + "' 2>&1");
  EXPECT_EQ(replay.code, 0) << replay.text;
  EXPECT_THAT(replay.text, HasSubstr("replay: " + std::to_string(2 * kCourseDecisions) + " candidates, " +
                                     std::to_string(2 * kCourseDecisions) + " decisions agree, 0 differ"));
  EXPECT_THAT(CompareUnder(kCourseTask, directory).text,
              HasSubstr("none of the " + std::to_string(2 * kCourseCertified) + " certificates lost"));
  std::filesystem::remove(directory + "/events-1.lcmlog");
  EXPECT_THAT(Forereach("replay '" + directory + "' --config '" + kCourseTask + "' 2>&1"),
              Exits(1, "events-1.lcmlog: the log is not in the database's directory"));
  EXPECT_EQ(Forereach("replay '" + directory + "' '" + directory + "' --config '" + kCourseTask + "' 2>&1").code, 2);
}

// Every line about a plan names its robot.
TEST_F(CompareTest, ManyRobotsAreToldApart) {
  for (const char* robot : {"a", "b"}) {
    std::filesystem::create_directories(scratch_ / ("night/" + std::string(robot)));
    std::filesystem::copy_file(kCourseLog, scratch_ / ("night/" + std::string(robot) + "/one.lcmlog"));
  }
  const Output output = CompareUnder(kCourseTask, scratch_ / "night", "--json");
  const auto document = nlohmann::json::parse(output.text);
  ASSERT_EQ(document["by_robot"].size(), 2u) << output.text;
  EXPECT_EQ(document["by_robot"][0]["robot"], scratch_ / "night/a");
  EXPECT_EQ(document["by_robot"][1]["certificates"], kCourseCertified);
  EXPECT_EQ(document["candidates"], 2 * kCourseDecisions);
  EXPECT_THAT(CompareUnder(kCourseTask, scratch_ / "night").text,
              HasSubstr((scratch_ / "night/a") + ": 0 of " + std::to_string(kCourseAbstained) + " abstentions"));
  // Without obstacles each robot wins certificates, and all are named.
  std::string task = Replaced(Read(kCourseTask), "transitions: ", "transitions: " FOREREACH_SOURCE_DIR "/tests/data/");
  task = Replaced(task, "gate: {obstacles: bus, obstacles_lost_ms: never}", "gate: {obstacles: task}");
  const std::size_t from = task.find("  obstacles:\n"), to = task.find("\ncertifier:");
  task.replace(from, to - from, "  obstacles: []\n");
  const auto free =
      nlohmann::json::parse(CompareUnder(scratch_.Write("free.yaml", task), scratch_ / "night", "--json").text);
  const auto gained = free["gained_plans"].get<std::vector<std::string>>();
  ASSERT_EQ(gained.size(), free["gained"]);
  for (const auto& of_robot : free["by_robot"]) {
    EXPECT_GT(of_robot["gained"], 20);
    EXPECT_EQ(std::ranges::count_if(gained,
                                    [&](const std::string& plan) {
                                      return plan.starts_with(of_robot["robot"].get<std::string>() + ": event ") ||
                                             plan.starts_with(of_robot["robot"].get<std::string>() + ": one.lcmlog");
                                    }),
              of_robot["gained"].get<std::ptrdiff_t>());
  }
}

TEST_F(CompareTest, RefusesToCompareWithoutOneTask) {
  EXPECT_EQ(Forereach("replay '" + kCourseLog + "' --compare 2>&1").code, 2);
  EXPECT_EQ(Forereach("replay '" + kCourseLog + "' --compare --other-task --config '" + kCourseTask + "' 2>&1").code,
            2);
}

}  // namespace forereach::compare_test
