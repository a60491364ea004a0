// `forereach init` and `forereach check`: a task to begin with, and what keeps one from certifying plans.

#include <fmt/format.h>

#include "forereach/dynamics/unbounded.h"
#include "forereach/numerics/size.h"
#include "task/task_template.h"
#include "tests/cli/program.h"
#include "tests/task/task_files.h"

namespace forereach::task_file_test {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string kSource = FOREREACH_SOURCE_DIR;

struct TaskFileTest : testing::Test {
  TaskFileTest() {
    for (const char* directory : {"/models", "/drive"})
      fs::copy(kSource + "/config" + directory, scratch_.path() + directory);
  }
  [[nodiscard]] Output Init(const std::string& options) const {
    return Forereach("init " + options + " --out " + task_ + " 2>&1");
  }
  [[nodiscard]] Output Check(const std::string& options = "") const {
    return Forereach("check " + task_ + " " + options + " 2>&1");
  }
  /** Writes kTask with one thing changed, and its data. */
  void WriteTask(const std::string& from = "", const std::string& to = "",
                 const std::string& transitions = kTransitions) const {
    const std::string task = Replaced(kTask, "[0, 0, 0.01, 0.01]", "[0.01, 0.01, 0.01, 0.01]");
    scratch_.Write("task.yaml", from.empty() ? task : Replaced(task, from, to));
    scratch_.Write("steps.csv", transitions);
  }
  template <class... Change>
  [[nodiscard]] Output CheckWith(const Change&... change) const {
    WriteTask(change...);
    return Check();
  }

  ScratchDirectory scratch_;
  const std::string task_ = scratch_ / "task.yaml";
};

using InitTest = TaskFileTest;
using CheckTest = TaskFileTest;

// ---- init

TEST_F(InitTest, EveryModelOfTheLibraryGivesATaskThatLoads) {
  int models = 0;
  for (const auto& entry : fs::directory_iterator(kSource + "/config/models")) {
    const std::string name = entry.path().stem().string();
    SCOPED_TRACE(name);
    ASSERT_THAT(Init("--force --model " + name), Exits(0));
    const Config config = LoadConfig(task_, TransitionsFile::kIgnore);
    EXPECT_EQ(config.problem->model->name(), name + " (text)");
    EXPECT_TRUE(config.says_between);
    EXPECT_NE(config.gate.obstacles, ObstaclesSource::kUnsaid);
    EXPECT_THAT(Check(), Exits(1, "task_steps.csv does not exist")) << "there are no data yet";
    ++models;
  }
  EXPECT_GE(models, 13);
}

std::vector<std::string> TextsOf(const Law& law) {
  std::vector<std::string> texts;
  for (const ExpressionText& expression : law) texts.push_back(expression.text);
  return texts;
}

std::vector<std::vector<std::string>> TextsOf(const std::vector<Law>& laws) {
  std::vector<std::vector<std::string>> texts;
  for (const Law& law : laws) texts.push_back(TextsOf(law));
  return texts;
}

// The laws, rest and hold of the task that drives the model, and the angles of the model's file.
TEST_F(InitTest, AModelOfTheLibraryComesWithTheLawsThatDriveIt) {
  for (const auto& entry : fs::directory_iterator(kSource + "/config/models")) {
    const std::string name = entry.path().stem().string();
    SCOPED_TRACE(name);
    ASSERT_EQ(Init("--force --model " + name).code, 0);
    EXPECT_THAT(Read(task_), HasSubstr("\n  # goal: ["));
    scratch_.Write("task.yaml", Replaced(Read(task_), "\n  # goal: [", "\n  goal: ["));
    const Config task = LoadConfig(task_, TransitionsFile::kIgnore);
    const Config drive = LoadConfig(kSource + "/config/drive/" + name + ".yaml", TransitionsFile::kIgnore);
    EXPECT_EQ(std::ssize(task.planner.goal), task.problem->projection.rows());
    ASSERT_FALSE(task.laws.stop.empty());
    EXPECT_EQ(TextsOf(task.laws.stop), TextsOf(drive.laws.stop));
    EXPECT_EQ(TextsOf(task.laws.emergency_stop), TextsOf(drive.laws.emergency_stop));
    EXPECT_EQ(TextsOf(task.laws.hints), TextsOf(drive.laws.hints));
    ASSERT_EQ(task.laws.definitions.size(), drive.laws.definitions.size());
    for (std::size_t i = 0; i < task.laws.definitions.size(); ++i)
      EXPECT_EQ(task.laws.definitions[i].value.text, drive.laws.definitions[i].value.text);
    ASSERT_EQ(task.laws.speed.has_value(), drive.laws.speed.has_value());
    if (task.laws.speed) EXPECT_EQ(task.laws.speed->text, drive.laws.speed->text);
    ASSERT_TRUE(task.laws.at_rest && drive.laws.at_rest);
    ASSERT_EQ(task.laws.at_rest->size(), drive.laws.at_rest->size());
    for (std::size_t i = 0; i < task.laws.at_rest->size(); ++i) {
      EXPECT_EQ((*task.laws.at_rest)[i].coordinate, (*drive.laws.at_rest)[i].coordinate);
      EXPECT_NEAR((*task.laws.at_rest)[i].tolerance, (*drive.laws.at_rest)[i].tolerance, 1e-15);
    }
    EXPECT_EQ(HeldStates(task), HeldStates(drive));
    for (const auto& [state, rate] : task.robot.emergency_stop) EXPECT_EQ(rate, 1) << state;
    EXPECT_EQ(task.problem->rest.size(), drive.problem->rest.size());
    EXPECT_EQ(task.problem->model->angles(), drive.problem->model->angles());
  }
}

// A task begins where its model has bounds: a car with tyres and an aeroplane do not stand.
TEST_F(InitTest, ATaskOfTheLibraryBeginsWhereItsModelHasBounds) {
  for (const auto& entry : fs::directory_iterator(kSource + "/config/models")) {
    const std::string name = entry.path().stem().string();
    SCOPED_TRACE(name);
    ASSERT_EQ(Init("--force --model " + name).code, 0);
    const Config config = LoadConfig(task_, TransitionsFile::kIgnore);
    const Domain& domain = config.problem->domain;
    std::vector<Interval> box;
    for (Eigen::Index k = 0; k < config.initial_set.dim(); ++k) {
      box.emplace_back(config.initial_set.lower()[k], config.initial_set.upper()[k]);
      EXPECT_TRUE(domain.state.lower()[k] <= box.back().lower && box.back().upper <= domain.state.upper()[k]) << k;
    }
    for (Eigen::Index k = 0; k < domain.input.dim(); ++k)
      box.emplace_back(std::clamp(0.0, domain.input.lower()[k], domain.input.upper()[k]));
    for (int k = 0; k < config.problem->model->num_states(); ++k)
      EXPECT_FALSE(FindUnbounded(*config.problem->model, box, k)) << k;
  }
}

// The laws are not guessed.
TEST_F(InitTest, WithoutATaskThatDrivesTheModelTheLawsAreLeftToYou) {
  const auto leaves_them = [&] {
    ASSERT_EQ(Init("--force --model unicycle").code, 0);
    EXPECT_THAT(Read(task_), AllOf(HasSubstr("\n# planner:\n#   goal: ["), HasSubstr("\n#   stop: {a: -v/dt}")));
    EXPECT_FIELDS(LoadConfig(task_, TransitionsFile::kIgnore), (laws.stop.empty(), true), (problem->rest.size(), 2u));
  };
  fs::copy_file(scratch_ / "drive/boat.yaml", scratch_ / "drive/unicycle.yaml", fs::copy_options::overwrite_existing);
  leaves_them();  // a task of another model
  fs::remove(scratch_ / "drive/unicycle.yaml");
  leaves_them();
  scratch_.Write("log.csv", "x,v,x_next,u,v_next\n0,1,0.1,5,1.5\n2,-1,1.9,5,-0.5\n");
  ASSERT_EQ(Init("--force --dt 0.1 --transitions " + (scratch_ / "log.csv")).code, 0);
  EXPECT_THAT(Read(task_), AllOf(HasSubstr("\n#   stop: {u: -v/dt}"), HasSubstr("\n#   at_rest: {v: 0.005}\n"),
                                 HasSubstr("\n  # angles: [v]\n"), HasSubstr("\n#   hold: [v]\n")));
}

// What nobody has looked at yet certifies nothing, even with data of the model itself all over the domain.
TEST_F(InitTest, PlaceholdersKeepPlansFromBeingCertified) {
  for (const char* name : {"unicycle", "differential_drive", "point_mass"}) {
    SCOPED_TRACE(name);
    ASSERT_EQ(Init(std::string("--force --model ") + name).code, 0);
    const Config config = LoadConfig(task_, TransitionsFile::kIgnore);
    const NominalModel& model = *config.problem->model;
    Transitions transitions{Eigen::MatrixXd::Zero(50, model.num_variables()),
                            Eigen::MatrixXd::Zero(50, model.num_states())};
    for (Eigen::Index i = 0; i < 50; ++i) {
      Eigen::VectorXd z = Eigen::VectorXd::Constant(model.num_variables(), 0.1 * static_cast<double>(i - 25));
      Eigen::VectorXd next(model.num_states());
      model.Evaluate({z.data(), ToSize(model.num_variables())}, {next.data(), ToSize(model.num_states())});
      transitions.z.row(i) = z.transpose();
      transitions.x_next.row(i) = next.transpose();
    }
    SaveTransitions(scratch_ / "task_steps.csv", model, transitions);
    SavePlan(scratch_ / "plan.csv", model, Eigen::MatrixXd::Zero(model.num_inputs(), 5));
    EXPECT_THAT(Forereach("certify --config " + task_ + " --plan " + (scratch_ / "plan.csv") + " 2>&1"), Exits(1));
    EXPECT_THAT(Check(), Exits(1, "from a declaration that is too wide"));
  }
}

TEST_F(InitTest, SaysWhatTheParametersAre) {
  ASSERT_EQ(Init("--model differential_drive --dt 0.05").code, 0);
  EXPECT_THAT(Read(task_), AllOf(HasSubstr("\n    dt: 0.05  # s"), HasSubstr("\n    wheel_radius: 0.033  # m\n"),
                                 HasSubstr("\n    track: 0.16  # m, from wheel to wheel\n")));
  EXPECT_EQ(LoadConfig(task_, TransitionsFile::kIgnore).period, 0.05);
}

TEST_F(InitTest, OverwritesNothingUnlessTold) {
  scratch_.Write("task.yaml", "mine\n");
  EXPECT_THAT(Init("--model unicycle"), Exits(2, "the file exists, and is not changed"));
  EXPECT_EQ(Read(task_), "mine\n");
  scratch_.Write("task.yaml", std::string(100'000, '#'));
  EXPECT_EQ(Init("--model unicycle --force").code, 0);
  EXPECT_EQ(LoadConfig(task_, TransitionsFile::kIgnore).problem->model->num_states(), 5);
}

TEST_F(InitTest, UnknownModelsAreRefusedWithTheNearest) {
  EXPECT_THAT(Init("--model unicicle"), Exits(2, "did you mean models/unicycle.yaml?"));
  EXPECT_FALSE(fs::exists(task_));
}

TEST_F(InitTest, TakesStatesAndInputsFromTheHeaderOfTheTransitions) {
  scratch_.Write("log.csv", "\xef\xbb\xbfx , v,x_next,u, v_next\r\n0,1,0.1,5,1.5\n2,-1,1.9,5,-0.5\n");
  ASSERT_THAT(Init("--dt 0.1 --transitions " + (scratch_ / "log.csv")), Exits(0));
  const Config config = LoadConfig(task_);
  const Problem& problem = *config.problem;
  EXPECT_FIELDS(problem, (model->state_names(), (std::vector<std::string>{"x", "v"})),
                (model->input_names(), std::vector<std::string>{"u"}), (transitions.size(), 2));
  EXPECT_EQ(config.period, 0.1);
  EXPECT_FIELDS(problem.domain, (state.lower(), Eigen::Vector2d(-0.2, -1.2)),
                (state.upper(), Eigen::Vector2d(2.2, 1.2)), (input.lower()[0], 4.9), (input.upper()[0], 5.1));
  EXPECT_THAT(Read(task_), HasSubstr("transitions: log.csv\n"));
}

TEST_F(InitTest, ARoundedRangeContainsItsData) {
  const double values[] = {0, 5e-324, 1e-300, 0.1, 1, 999.9999, 1e15, 1e300};
  for (const double a : values)
    for (const double b : values)
      for (const double sign : {-1.0, 1.0}) {
        const double least = std::min(sign * a, b), largest = std::max(sign * a, b);
        const TemplateVariable range = RangeAround("x", least, largest);
        EXPECT_LE(range.lower, least) << least << " " << largest;
        EXPECT_GE(range.upper, largest) << least << " " << largest;
      }
}

TEST_F(InitTest, HeadersThatAreNoTransitionsAreRefused) {
  const auto refused = [&](const std::string& header, const std::string& why) {
    std::string row = "1";
    for (const char c : header) row += c == ',' ? ",1" : "";
    scratch_.Write("log.csv", header + "\n" + row + "\n");
    const Output output = Init("--dt 0.1 --transitions " + (scratch_ / "log.csv"));
    EXPECT_EQ(output.code, 2) << header;
    EXPECT_THAT(output.text, HasSubstr(why)) << header;
    EXPECT_FALSE(fs::exists(task_)) << header;
  };
  refused("x,u", "no column is a state");
  refused("x,x_next", "no column is an input");
  refused("x,x_next,v_next,u", "there is no column v with the state before it");
  refused("x,x_next,sin", "'sin' cannot be the name");
  refused("x,x_next,a b", "'a b' cannot be the name");
  refused("x,x_next,dt", "'dt' cannot be the name");
  refused("x,x_next,null", "'null' cannot be the name");
  refused("x,x_next," + std::string(65, 'u'), "uuu' cannot be the name");
  refused("x,x_next,u,u", "duplicate column");
  refused("x,x_next,", "a column has no name");
  refused("", "a column has no name");
  std::string states, inputs = "x,x_next";
  for (int k = 0; k < 17; ++k) states += "x" + std::to_string(k) + ",x" + std::to_string(k) + "_next,";
  for (int k = 0; k < 9; ++k) inputs += ",u" + std::to_string(k);
  refused(states + "u", "17 states are outside [0, 16]");
  refused(inputs, "9 inputs are outside [0, 8]");
  scratch_.Write("log.csv", "x,x_next,u\n");
  EXPECT_THAT(Init("--dt 0.1 --transitions " + (scratch_ / "log.csv")).text, HasSubstr("no transitions"));
  scratch_.Write("log.csv", "x,x_next,u\n1,1,1\n");
  EXPECT_THAT(Init("--transitions " + (scratch_ / "log.csv")).text, HasSubstr("needs --dt"));
  EXPECT_EQ(Init("--dt 61 --transitions " + (scratch_ / "log.csv")).code, 2);
  EXPECT_EQ(Init("").code, 2);
  scratch_.Write("a\nb: [.csv", "x,x_next,u\n1,1,1\n");
  EXPECT_THAT(Init("--dt 0.1 --transitions '" + (scratch_ / "a\nb: [.csv") + "'").text,
              HasSubstr("--transitions: the path has a control character"));
  EXPECT_EQ(Init("--dt 0.1 --model unicycle --transitions " + (scratch_ / "log.csv")).code, 2);
}

TEST(YamlTextTest, QuotesTextThatYamlWouldReadOtherwise) {
  EXPECT_EQ(YamlText("a/b_c-1.csv"), "a/b_c-1.csv");
  EXPECT_EQ(YamlText("a b's: #"), "'a b''s: #'");
  EXPECT_EQ(YamlText("-a"), "'-a'");
  EXPECT_EQ(YamlText(""), "''");
}

// ---- check

TEST_F(CheckTest, CountsTransitionsThatTheirErrorsMayTakeOutOfTheDomain) {
  const std::string line = "transitions: steps.csv\n";
  WriteTask(line, "  state_error: {px: 0.5}\n" + line, kTransitions + std::string("19.6,0,1,0,0,0,19.75,0,1,0\n"));
  EXPECT_THAT(Check().text, HasSubstr("remark: 1 transition left out, the first in " + (scratch_ / "steps.csv") +
                                      ":4: within state_error and input_error it may be outside the domain"));
  WriteTask(line, "  state_error: {px: 21}\n" + line);
  EXPECT_THAT(Check(), Exits(1, " 2 transitions left out")) << "all, and that is no mere remark";
}

TEST(Check, ExitsWithTheExpectedCodeForEachShippedTask) {
  for (const auto& [task, code] : {std::pair("demo", 0),
                                   {"post", 0},
                                   {"truck", 0},
                                   {"pedestrian", 0},
                                   {"policy", 0},
                                   {"point_mass", 0},
                                   {"point_mass_text", 0},
                                   {"post_samples", 1},
                                   {"bicycle_falsified", 1},
                                   {"point_mass_falsified", 1}}) {
    const Output output = Forereach(std::string("check config/") + task + ".yaml");
    EXPECT_EQ(output.code, code) << task << "\n" << output.text;
  }
}

TEST_F(CheckTest, SaysThatAPlanCouldBeCertifiedWhenNothingIsWrong) {
  WriteTask();
  EXPECT_THAT(Check(), Exits(0, "a plan could be certified"));
  const Json json = Json::parse(Check("--json --steps 3").text);
  EXPECT_EQ(json["good"], true);
  EXPECT_EQ(json["half_widths"].size(), 4u);
  EXPECT_EQ(json["coordinates"][2],
            Json({{"name", "vx"}, {"domain", {-5.4, 5.4}}, {"data", {1, 2}}, {"matters", true}}));
}

TEST_F(CheckTest, DataOutsideTheDomainAreAllNamed) {
  const std::string at = "0,0,5.4,0,3,0,0.84375,0,5.85,0\n";
  WriteTask("", "", kTransitions + at);
  EXPECT_THAT(Check(), Exits(0));
  WriteTask("", "", kTransitions + at + "0,0,5.5,-5.41,0,0,0,0,0,0\n0,0,6.5,0,0,3.1,0,0,0,0\n");
  const Output output = Check();
  EXPECT_EQ(output.code, 1);
  const std::string steps = scratch_ / "steps.csv";
  EXPECT_THAT(output.text,
              AllOf(HasSubstr(task_ + ":4: domain.state.lower: vy: 1 transition below -5.4, the least is -5.41 in " +
                              steps + ":5\n"),
                    HasSubstr(task_ + ":5: domain.state.upper: vx: 2 transitions above 5.4, the largest is 6.5 in " +
                              steps + ":6\n"),
                    HasSubstr(task_ + ":6: domain.input.upper: ay: 1 transition above 3")));
  WriteTask("  input:", "  balls: [{coordinates: [vx, vy], center: [0, 0], radius: 2}]\n  input:");
  EXPECT_THAT(Check().text, HasSubstr("domain.balls[0]: 1 transition outside, the first in " + steps + ":3\n"));
}

// As `init` writes it.
TEST_F(CheckTest, AMatrixThatDataContradictIsNamedAsAMapIs) {
  scratch_.Write("d.csv", "x,u,x_next\n0,0,0\n1,0.5,1.22\n");
  const auto check = [&](const std::string& lipschitz) {
    scratch_.Write("task.yaml",
                   "model: {states: {x: m}, inputs: {u: m/s}, parameters: {dt: 0.1}, next: {x: x + dt*u}}\n"
                   "domain: {state: {lower: [-10], upper: [10]}, input: {lower: [-1], upper: [1]}}\n"
                   "declaration: {lipschitz: " +
                       lipschitz +
                       ", noise_bound: [0.001]}\ntransitions: d.csv\ngate: {obstacles: task}\n"
                       "task: {initial_set: {center: [0], half_width: [0.01]}, projection: [x], between: samples, "
                       "obstacles: []}\n");
    return Forereach("check " + (scratch_ / "task.yaml") + " 2>&1").text;
  };
  for (const char* lipschitz : {"[[0.1, 0.1]]", "{x: {x: 0.1, u: 0.1}}"})
    EXPECT_THAT(check(lipschitz), HasSubstr("x: lines 2 and 3 of")) << lipschitz;
}

// A state x that stands still; its residual changes by at most 0.1 |x|, and its sensor errs by 0.001.
struct ContradictionsTest : CheckTest {
  std::string CheckOf(const std::string& rows, const std::string& more = "") {
    scratch_.Write("steps.csv", "x,u,x_next\n" + rows);
    scratch_.Write("task.yaml",
                   "model: {states: {x: m}, inputs: {u: m/s}, parameters: {dt: 0.1}, next: {x: x + dt*u}}\n"
                   "domain: {state: {lower: [-10], upper: [10]}, input: {lower: [-1], upper: [1]}}\n"
                   "declaration: {lipschitz: {x: {x: 0.1}}, noise_bound: [0.001]" +
                       more +
                       "}\ntransitions: steps.csv\ngate: {obstacles: task}\n"
                       "task: {initial_set: {center: [0], half_width: [0.01]}, projection: [x], between: samples, "
                       "obstacles: []}\n");
    return Check().text;
  }
};

TEST_F(ContradictionsTest, AreAllNamedWorstFirst) {
  EXPECT_THAT(CheckOf("0,0,0\n1,0,1.2\n2,0,2.5\n"),
              AllOf(HasSubstr("It is contradicted by 3 pairs: lines 3 and 4 (2.941 times), "
                              "lines 2 and 4 (2.475 times), lines 2 and 3 (1.96 times)\n"),
                    HasSubstr("noise_bound of x at least 0.15"), HasSubstr("larger by a factor of 2.98"),
                    Not(HasSubstr("disturbance of x"))));
  EXPECT_THAT(CheckOf("0,0,0\n1,0,1.1021\n2,0,2.05\n"), AllOf(HasSubstr("lines 2 and 3 of"), Not(HasSubstr("pairs"))));
  EXPECT_THAT(CheckOf("0,0,0\n1,0,1.1019\n2,0,2.05\n"), HasSubstr("the data use 99."));
  EXPECT_THAT(CheckOf("0,0,0\n1,0,1\n2,0,2\n3,0,9\n4,0,4\n5,0,5\n"),
              HasSubstr("contradicted by 5 pairs, 5 of them with line 5: lines "));
}

// 0.1 m/step at the end of what is declared there; the columns' standard deviation is about 0.966 m.
TEST_F(ContradictionsTest, AtNearlyTheSamePlaceAskForADisturbance) {
  EXPECT_THAT(CheckOf("-1,0,-1\n1,0,1\n1.09,0,1.19\n"), HasSubstr("declare a disturbance of x of at least 0.0445"));
  EXPECT_THAT(CheckOf("-1,0,-1\n1,0,1\n1.1,0,1.2\n"),
              AllOf(Not(HasSubstr("disturbance of x")), HasSubstr("declare more: noise_bound of x at least 0.045")));
}

// A record that errs by 0.01 hides 0.021 of each residual.
TEST_F(ContradictionsTest, WhatTheErrorsOfTheRecordHideCountsOnce) {
  const std::string error = ", state_error: [0.01]";
  EXPECT_THAT(CheckOf("0,0,0\n1,0,1.1439\n", error), HasSubstr("the data use 99."));
  EXPECT_THAT(CheckOf("0,0,0\n1,0,1.1441\n", error), HasSubstr("lines 2 and 3 of"));
}

// x' = u. A step of 0.1 s at 1 m/s that lasted 0.01 s longer moves x by 0.01 m more, and little of what the residual
// grows; two steps hide 0.002 m.
struct DurationTest : ContradictionsTest {
  void Steps(const std::string& residual, const std::string& column, const std::string& next = "x + dt*u",
             const std::string& first = "0") const {
    scratch_.Write("steps.csv", "x,u,x_next,dt_error\n0,1,0.1," + first + "\n0,1," + residual + "," + column + "\n");
    scratch_.Write("task.yaml",
                   "model: {states: {x: m}, inputs: {u: m/s}, parameters: {dt: 0.1}, next: {x: " + next +
                       "}}\ndomain: {state: {lower: [-10], upper: [10]}, input: {lower: [-1], upper: [1]}}\n"
                       "declaration: {lipschitz: {}, noise_bound: [0.001]}\ntransitions: steps.csv\n"
                       "gate: {obstacles: task}\n"
                       "task: {initial_set: {center: [0], half_width: [0.01]}, projection: [x], between: "
                       "samples, obstacles: [{box: {lower: [9], upper: [10]}}]}\n");
  }
};

TEST_F(DurationTest, OfARecordedStepExplainsHowFarItMoved) {
  Steps("0.112", "0.01");
  EXPECT_THAT(Check(), Exits(0, "recorded steps lasted model.dt, give or take their column dt_error"));
  Steps("0.112", "0");
  EXPECT_THAT(Check(), Exits(1, "lines 2 and 3 of"));
  Steps("0.1202", "0.01");
  EXPECT_EQ(Check().code, 0);
  Steps("0.1204", "0.01");
  EXPECT_THAT(Check(), Exits(1, "lines 2 and 3 of", "it is false"));
  Steps("0.112", "0.01", "x + 0.1*u");
  EXPECT_THAT(Check(), Exits(2, "steps.csv: dt_error: ", "which do not use dt", "declare model.rate_bound"));
  Steps("0.1", "0", "x + 0.1*u");
  EXPECT_EQ(Check().code, 0);
}

// Steps are 1 ms longer and shorter in turn at 1 m/s, so every other state is 1 mm off what a step of dt gives.
TEST_F(DurationTest, LeavesNoSliceByTheTimeThatItSays) {
  Steps("0.1", "0");
  scratch_.Write("task.yaml",
                 Replaced(Replaced(Read(task_), "noise_bound: [0.001]", "noise_bound: [0]"), "[0.01]", "[0]"));
  std::string rows = "x,u,x_next,dt_error\n";
  for (int i = 0; i < 40; ++i) {
    const double begin = -2 + 0.1 * i;
    rows += fmt::format("{},1,{},0.0011\n", begin + 0.001 * (i % 2), begin + 0.1 + 0.001 * (1 - i % 2));
  }
  scratch_.Write("steps.csv", rows);
  EXPECT_THAT(Check(), Exits(0, " consistent, 0 left\n"));
}

TEST_F(DurationTest, WidensTheTubeAndIsVerified) {
  scratch_.Write("plan.csv", "u\n0.5\n0.5\n0\n");
  const std::string decision = scratch_ / "decision.json";
  const auto half_width = [&](const std::string& column) {
    Steps("0.1", column, "x + dt*u", column);
    const std::string certify = "certify --config " + task_ + " --plan " + scratch_ / "plan.csv";
    std::ofstream(decision) << Forereach(certify + " --json").text;
    EXPECT_THAT(Forereach("verify " + decision), Exits(0, "1 confirmed")) << column;
    return Forereach(certify).text;
  };
  const std::string with = half_width("0.02"), without = half_width("0");
  EXPECT_THAT(with, HasSubstr("half-width of its last slice"));
  EXPECT_NE(with, without);
  Steps("0.1", "0.02");
  EXPECT_THAT(Forereach("verify " + decision + " 2>&1"), testing::Field(&Output::code, testing::Ne(0)))
      << "the digest of the observations is of the durations, too";
}

// The first row is outside the domain, so that rows and lines differ by more than the header.
TEST_F(CheckTest, TransitionsThatNothingCanBeObservedOfAreNamedByTheirLine) {
  const auto check = [&](const std::string& model, const std::string& rows) {
    scratch_.Write("task.yaml", TaskFor("model:\n  states: {x: m, y: m, t: rad}\n  inputs: {u: m}\n"
                                        "  parameters: {dt: 0.1}\n" +
                                            model,
                                        3, 1, "x, y"));
    scratch_.Write("steps.csv", "x,y,t,u,x_next,y_next,t_next\n" + rows);
    return Forereach("check " + (scratch_ / "task.yaml") + " 2>&1");
  };
  const std::string rows = "7,0,0,0,0,0,0\n0.5,0,0,0,0.5,0,0\n0,0,0,0,0,0,2\n";
  EXPECT_THAT(check("  next: {x: x, y: y, t: t}\n  angles: [t]\n", rows),
              Exits(1, "steps.csv:4: ", "t is 2 rad away", "has to be rad"));
  const Output value = check("  next: {x: log(x), y: y, t: t}\n", rows);
  EXPECT_EQ(value.code, 1);
  EXPECT_THAT(value.text, AllOf(HasSubstr("steps.csv:4: x: the nominal model has no finite value there\n"),
                                HasSubstr("take such states out of the domain")));
}

// Observation errors of 2 sigma and 0.05 m/s times 1 m/s: the residuals of vx may differ by 0.12. They differ by d.
TEST_F(CheckTest, AContradictionIsNamedWithWhatResolvesIt) {
  const auto with = [&](const std::string& next) {
    return CheckWith(
        "", "",
        "px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n0,0,1,0,0,0,0.15,0,1,0\n0,0,1,1,0,0,0.15,0.15," + next +
            ",1\n");
  };
  EXPECT_THAT(with("1.0699"), Exits(0, task_ + ":9: declaration.lipschitz.vx: remark: vx: the data use 99."));
  EXPECT_THAT(with("1.0701"), Exits(1,
                                    task_ + ":9: declaration.lipschitz.vx: vx: lines 2 and 3 of " +
                                        (scratch_ / "steps.csv") + " differ in the model's error by 0.07",
                                    "noise_bound of vx at least 0.01005"));
  scratch_.Write("task.yaml", Replaced(Read(task_), "[0.01, 0.01, 0.01, 0.01]", "[0.01, 0.01, 0.01006, 0.01]"));
  EXPECT_THAT(Check(), Exits(0));
  EXPECT_THAT(with("1.2").text, Not(HasSubstr(" py: lines")));
  EXPECT_THAT(CheckWith("", "",
                        "px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n0,0,1,0,0,0,0.15,0,1,0\n"
                        "0,0,1,1,0,0,0.15,0.25,1.2,1\n"),
              Exits(1, " py: lines 2 and 3 of", " vx: lines 2 and 3 of"));
}

// A bar that turns on the spot in steps of 1 s.
TEST_F(CheckTest, NamesEveryRowThatTurnsFasterThanDeclaredWorstFirst) {
  const auto with = [&](const std::string& rate) {
    scratch_.Write("task.yaml", R"(model:
  {states: {x: m, y: m, th: rad}, inputs: {w: rad/s}, parameters: {dt: 1}, next: {x: x, y: y, th: th + dt*w}}
domain: {state: {lower: [-9, -9, -9], upper: [9, 9, 9]}, input: {lower: [-4], upper: [4]}}
declaration: {lipschitz: {}, noise_bound: [0, 0, 0]}
transitions: steps.csv
task:
  initial_set: {center: [0, 0, 0], half_width: [0, 0, 0]}
  body: {pose: [x, y, th], parts: [{hull: {points: [[-1.2, 0], [1.2, 0]]}}]}
  between: {acceleration: [0, 0], turn_rate: )" +
                                    rate +
                                    R"(, turn_acceleration: 0}
  obstacles: [{circle: {center: [0, 5], radius: 0.05}}]
gate: {obstacles: task}
)");
    scratch_.Write("steps.csv", "x,y,th,w,x_next,y_next,th_next\n0,0,0,1.5,0,0,1.5\n0,0,0,0,0,0,0\n0,0,3,-3,0,0,0\n");
    return Check();
  };
  EXPECT_THAT(with("0.5"),
              Exits(1,
                    task_ +
                        ":9: task.between.turn_rate: th changes faster than 0.5 a second in 2 "
                        "transitions of " +
                        (scratch_ / "steps.csv") +
                        ", so nothing can be certified: line 4: 2.999 (5.999 times), line 2: 1.499 (2.999 times)",
                    "declare 3 at least"));
  EXPECT_THAT(with("2").text, HasSubstr("in 1 transition of"));
  EXPECT_THAT(with("3"), Exits(0));
}

// In a step of 0.15 s 0.02 m more than the velocity says, of which 0.01 m may be noise: 0.888 m/s^2 over the step.
TEST_F(CheckTest, RemarksOnRowsThatCurveMoreThanDeclaredByTheVelocityOfTheEquations) {
  const auto with = [&](const std::string& acceleration) {
    return CheckWith("between: samples", "between: {acceleration: [" + acceleration + ", 4]}",
                     Replaced(kTransitions, "0.155", "0.17"));
  };
  EXPECT_THAT(with("0.125"), Exits(0,
                                   ":19: task.between.acceleration: remark: coordinate 0 curves by more than 0.125 "
                                   "m/s^2, if its velocity is what the equations say, in 1 transition of " +
                                       (scratch_ / "steps.csv") + ": line 2: 0.8888 (7.111 times)"));
  EXPECT_THAT(with("0.9").text, Not(HasSubstr("curves by more")));
}

TEST_F(CheckTest, PrintsNoShareOfTheDeclarationWhereNothingIsDeclared) {
  const auto with = [&](const std::string& noise_bound) { return CheckWith("[0.01, 0.01, 0.01, 0.01]", noise_bound); };
  EXPECT_THAT(with("[0.01, 0.01, 0.01, 0.01]").text, Not(HasSubstr("nothing is declared")));
  const std::string text = with("[0, 0.01, 0, 0]").text;
  EXPECT_THAT(text, AllOf(HasSubstr("declaration: nothing is declared for px\n"), HasSubstr("\n  py "),
                          HasSubstr("  vx "), Not(HasSubstr("  px 0"))))
      << text;
  const Json rows = Json::parse(Check("--json").text)["declaration"];
  EXPECT_EQ(rows[0]["declared"], false);
  EXPECT_TRUE(rows[0]["used"].is_null());
  EXPECT_EQ(rows[1]["declared"], true);
}

// X0 is a square of half-width 0.1, and the circle's edge is at 3 - radius.
TEST_F(CheckTest, FindsAnObstacleThatTheInitialSetMayTouch) {
  const auto with = [&](const std::string& radius) {
    return CheckWith("{center: [3, 2], radius: 0.8}", "{center: [3, 0], radius: " + radius + "}");
  };
  EXPECT_THAT(with("2.9001"), Exits(1, task_ + ":18: task.obstacles[0]: the robot may touch it at the start"));
  EXPECT_THAT(with("2.8999"), Exits(0));
}

// In 0.15 s at up to 5.4 m/s along both axes, and 3 m/s^2 along both: sqrt(2) (0.81 + 0.03375) = 1.1933 m.
TEST_F(CheckTest, FindsAnObstacleThatIsThinnerThanAStep) {
  const auto with = [&](const std::string& radius) { return CheckWith("radius: 0.8", "radius: " + radius); };
  EXPECT_THAT(with("0.5967"), Exits(0));
  EXPECT_THAT(with("0.5966"),
              Exits(1, task_ + ":19: task.between: the robot moves by up to 1.194 m in one step of 0.15 s"));
  WriteTask("  between: samples\n", "  between: {acceleration: [5, 5]}\n");
  scratch_.Write("task.yaml", Replaced(Read(task_), "radius: 0.8", "radius: 0.1"));
  EXPECT_EQ(Check().code, 0);
}

// The hand, 0.6 m from the first joint or so, moves with 1.2 + 1.6 rad/s; a post of 1 cm is thinner than that.
TEST_F(CheckTest, FindsAThinObstacleForABodyAtExpressions) {
  std::string task = Read(scratch_ / "drive/reaching_arm.yaml");
  const auto line = task.find("  between:");
  task.replace(line, task.find('\n', line) - line, "  between: samples");
  EXPECT_THAT(Forereach("check " + scratch_.Write("drive/thick.yaml", task) + " 2>&1"), Exits(0));
  const auto obstacles = task.find("  obstacles:");
  task.replace(obstacles, task.find("\n\n", obstacles) - obstacles,
               "  obstacles: [{circle: {center: [1, 1], radius: 0.005}}]");
  EXPECT_THAT(Forereach("check " + scratch_.Write("drive/thin.yaml", task) + " 2>&1"),
              Exits(1, "task.between: the robot moves by up to 0."));
}

TEST_F(CheckTest, FindsAStartOfTheRobotOutsideTheDomain) {
  const auto with = [&](const std::string& start) {
    return CheckWith("  between: samples\n", "  between: samples\nrobot: {start: " + start + "}\n");
  };
  EXPECT_THAT(with("[20, 0, 0, -5.4]"), Exits(0));
  EXPECT_THAT(with("[20.1, 0, 0, 0]"),
              Exits(1, task_ + ":20: robot.start: px begins at 20.1, and the domain is [-20, 20]"));
  EXPECT_EQ(with("[3.81, 2, 0, 0]").code, 0);
  EXPECT_THAT(with("[3.79, 2, 0, 0]").text, HasSubstr("robot.start: the robot touches task.obstacles[0] there"));
}

TEST_F(CheckTest, FindsALawThatStopsTheRobotFromNoState) {
  const auto with = [&](const std::string& ax) {
    return CheckWith("  between: samples\n", "  between: samples\nplanner: {at_rest: {vx: 0.1, vy: 0.1}, stop: {ax: " +
                                                 ax + ", ay: -vy}}\nrobot: {hold: [vx, vy]}\n");
  };
  EXPECT_THAT(with("-vx"), Exits(0));
  EXPECT_THAT(with("sqrt(-1 - vx^2)"), Exits(1, task_ + ":20: planner.stop: from none of"));
}

TEST_F(CheckTest, FindsAGoalOutsideTheDomainOrCoveredByAnObstacle) {
  const auto with = [&](const std::string& goal) {
    return CheckWith("  between: samples\n", "  between: samples\nplanner: {goal: " + goal + ", goal_radius: 0.5}\n");
  };
  EXPECT_THAT(with("[20, -20]"), Exits(0));
  EXPECT_THAT(with("[20.1, 0]"), Exits(1, task_ + ":20: planner.goal: px: 20.1 is outside [-20, 20]"));
  EXPECT_EQ(with("[3.29, 2]").code, 1) << "0.8 - 0.29 > 0.5: no point of the goal is free";
  EXPECT_EQ(with("[3.31, 2]").code, 0);
}

// Where the error depends on the place, data are needed on the way to the goal: here px is at most 1 in them.
TEST_F(CheckTest, RemarksOnAGoalBeyondTheDataWhereTheErrorDependsOnThePlace) {
  WriteTask("  between: samples\n", "  between: samples\nplanner: {goal: [8, 0], goal_radius: 0.5}\n");
  EXPECT_THAT(Check().text, Not(HasSubstr("planner.goal: remark")));
  scratch_.Write("task.yaml", Replaced(Read(task_), "lipschitz:\n", "lipschitz:\n    px: {px: 0.001}\n"));
  EXPECT_THAT(Check(), Exits(0, "planner.goal: remark: px: 8 is 7 beyond the data, which lie in [0, 1]"));
}

TEST_F(CheckTest, FindsABoundOfRestThatIsSmallerThanTheTube) {
  const auto with = [&](const std::string& bound) {
    return CheckWith("  between: samples\n", "  between: samples\n  rest: {vx: " + bound + "}\n");
  };
  EXPECT_THAT(with("0.099"), Exits(1, task_ + ":20: task.rest: vx is known only up to"));
  EXPECT_THAT(with("5"), Exits(0));
  const auto planned = [&](const std::string& half_width) {
    return with("5}\nplanner: {goal: [8, 0], goal_radius: 0.5, initial_half_width: [0.1, 0.1, " + half_width +
                ", 0.1]");
  };
  EXPECT_THAT(planned("5.1"),
              Exits(1, "vx is known only up to 5.1 after 0 steps from planner.initial_half_width and "));
  EXPECT_THAT(planned("0.1"), Exits(0));
}

// The table is that of `certify` where there are no obstacles.
TEST_F(CheckTest, PrintsTheHalfWidthsThatCertifyPrints) {
  WriteTask("obstacles: [{circle: {center: [3, 2], radius: 0.8}}]", "obstacles: []");
  const std::string plan = scratch_.Write("plan.csv", "ax,ay\n1,0\n0,-1\n0,0\n");
  const Json check = Json::parse(Check("--json --plan " + plan).text);
  const Json certify = Json::parse(Forereach("certify --json --config " + task_ + " --plan " + plan).text);
  ASSERT_EQ(check["half_widths"].size(), 4u);
  for (std::size_t t = 0; t < 4; ++t) EXPECT_EQ(check["half_widths"][t], certify["tube"][t]["half_width"]) << t;
  EXPECT_EQ(check["tube"], certify["message"]);
}

// Of a plan that somebody gives, the whole tube counts.
TEST_F(CheckTest, FindsThatAGivenPlanLeavesTheDomain) {
  WriteTask();
  std::string controls = "ax,ay\n";
  for (int t = 0; t < 15; ++t) controls += "2,0\n";
  EXPECT_THAT(
      Check("--plan " + scratch_.Write("plan.csv", controls)),
      Exits(1, "domain.state.upper: the tube of " + (scratch_ / "plan.csv"), "vx reaches", "remark: vx: at step "))
      << "the data end at 2 m/s";
}

TEST_F(CheckTest, BadInputIsRefused) {
  WriteTask("dt: 0.15", "dt: -1");
  EXPECT_EQ(Check().code, 2);
  WriteTask("", "", "px\n1\n");
  EXPECT_EQ(Check().code, 2);
  WriteTask();
  EXPECT_EQ(Check("--steps 129").code, 2);
  EXPECT_EQ(Check("--plan none.csv").code, 2);
  EXPECT_EQ(Check("--picture " + (scratch_ / "none/a.svg")).code, 2);
  EXPECT_EQ(Forereach("check 2>/dev/null").code, 2);
}

TEST_F(CheckTest, DrawsAPicture) {
  WriteTask();
  EXPECT_EQ(Check("--picture " + (scratch_ / "a.svg")).code, 0);
  EXPECT_THAT(Read(scratch_ / "a.svg"), HasSubstr("<svg"));
}

TEST_F(CheckTest, PrintsItsFindingsEvenIfItCannotDrawThem) {
  EXPECT_THAT(
      Forereach("check config/drive/quadrotor.yaml --picture " + (scratch_ / "a.svg") + " 2>&1 >" + (scratch_ / "out")),
      Exits(2, "there is no picture"));
  EXPECT_EQ(Read(scratch_ / "out"), Forereach("check config/drive/quadrotor.yaml").text);
}

}  // namespace forereach::task_file_test
