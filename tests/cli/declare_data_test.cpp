// `forereach declare --from-data` and `--hold-out`: what they propose goes into a task file, and what they say is true.

#include "forereach/certify/certifier.h"
#include "forereach/residual/region_grid.h"
#include "tests/cli/program.h"
#include "tests/task/task_files.h"

namespace forereach::declare_data_test {

using Json = nlohmann::json;

struct DeclareDataTest : testing::Test {
  // A point mass in one long drive. The residual of vx is -0.02 |vx|, observed to within 0.001.
  DeclareDataTest() {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::ostringstream rows;
    rows.precision(17);
    rows << "px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n";
    double px = 0, vx = 0;
    for (int i = 0; i < 200; ++i) {
      const double ax = uniform(random) - 0.1 * px - 0.3 * vx, next_px = px + 0.15 * vx + 0.5 * 0.15 * 0.15 * ax,
                   next_vx = vx + 0.15 * ax - 0.02 * std::abs(vx) + 0.001 * uniform(random);
      rows << px << ",0," << vx << ",0," << ax << ",0," << next_px << ",0," << next_vx << ",0\n";
      px = next_px;
      vx = next_vx;
    }
    scratch_.Write("steps.csv", rows.str());
    scratch_.Write("task.yaml", Replaced(kTask, "[0, 0, 0.01, 0.01]", "[0.001, 0, 0.0015, 0.01]"));
  }
  Output Declare(const std::string& options) const {
    return Forereach("declare --config " + task_ + " --from-data " + options + " 2>&1");
  }

  ScratchDirectory scratch_;
  const std::string task_ = scratch_ / "task.yaml";
};

TEST_F(DeclareDataTest, WhatTheErrorsOfTheRecordExplainNeedsNoSlope) {
  const Json exact = Json::parse(Declare("--by vx --json").text);
  const std::string line = "transitions: steps.csv\n";
  const std::string task = Replaced(Read(task_), line, "  state_error: {vx: 0.0001}\n" + line);
  std::ofstream(task_) << task;
  const Json document = Json::parse(Declare("--by vx --json").text);
  EXPECT_LT(document["entries"][0]["smallest"], exact["entries"][0]["smallest"]);
  const std::size_t begin = task.find("declaration:"), end = task.find("transitions:");
  std::ofstream(task_) << task.substr(0, begin) + document["yaml"].get<std::string>() + task.substr(end);
  const Config config = LoadConfig(task_);
  EXPECT_EQ(config.problem->declaration.state_error, Eigen::Vector4d(0, 0, 0.0001, 0));
  EXPECT_FALSE(Certifier(config.problem).violation());
}

// Drag of 0.02 |vx| with noise needs slopes, unless it is declared as what disturbs each step; what is proposed is a
// task again.
TEST_F(DeclareDataTest, KeepsAnExpressionOfTheDisturbanceAndJudgesByIt) {
  const Json without = Json::parse(Declare("--by vx --json").text);
  const std::string line = "transitions: steps.csv\n";
  const std::string task = Replaced(Read(task_), line, "  disturbance: {vx: 0.03*vx}\n" + line);
  std::ofstream(task_) << task;
  const Json document = Json::parse(Declare("--by vx --json").text);
  EXPECT_GT(without["lipschitz"][2][2], 0);
  EXPECT_EQ(document["lipschitz"][2][2], 0);
  const std::size_t begin = task.find("declaration:"), end = task.find("transitions:");
  std::ofstream(task_) << task.substr(0, begin) + document["yaml"].get<std::string>() + task.substr(end);
  const Config config = LoadConfig(task_);
  EXPECT_EQ(config.problem->declaration.DisturbanceText(2), "0.03*vx");
  EXPECT_FALSE(Certifier(config.problem).violation());
}

// Steps from above 1 m/s are disturbed twenty times as much.
TEST_F(DeclareDataTest, ProposesRegionsWithTheDisturbanceThatTheyNeed) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::ostringstream rows;
  rows.precision(17);
  rows << "px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n";
  for (int i = 0; i < 400; ++i) {
    const double vx = 2 * uniform(random), ax = uniform(random);
    rows << "0,0," << vx << ",0," << ax << ",0," << 0.15 * vx + 0.5 * 0.15 * 0.15 * ax << ",0,"
         << vx + 0.15 * ax + (vx > 1 ? 0.02 : 0.001) * uniform(random) << ",0\n";
  }
  scratch_.Write("steps.csv", rows.str());
  const std::string task = Replaced(kTask, "[0, 0, 0.01, 0.01]", "[0.001, 0, 1e-9, 0.01]");
  std::ofstream(task_) << task;
  const Json document = Json::parse(Declare("--by vx --regions 4 --json").text);
  const std::size_t begin = task.find("declaration:"), end = task.find("transitions:");
  std::ofstream(task_) << task.substr(0, begin) + document["yaml"].get<std::string>() + task.substr(end);
  const Config config = LoadConfig(task_);
  const Declaration& declaration = config.problem->declaration;
  EXPECT_GT(declaration.DisturbanceBound(2), 0.02);
  ASSERT_FALSE(declaration.regions.empty());
  const RegionGrid grid(declaration);
  const auto at = [&](double vx) {
    RegionGrid::Box box{};
    box.lower[2] = box.upper[2] = vx;
    return grid.LargestBound(RegionBound::kDisturbance, 2, box);
  };
  EXPECT_LT(at(-1.5), 0.004);
  EXPECT_LT(at(0.5), 0.004);
  EXPECT_GT(at(0.5), 0.001);
  EXPECT_GT(at(1.5), 0.02);
  EXPECT_EQ(at(-3), declaration.DisturbanceBound(2)) << "nothing is said of where the robot has not been";
  EXPECT_FALSE(Certifier(config.problem).violation());
  EXPECT_THAT(Declare("--regions 2").text, HasSubstr("Take the regions out first"));
  std::ofstream(task_) << task;
  EXPECT_THAT(Declare("--by vx --regions 4").text, HasSubstr("Transitions in each region"));
  EXPECT_THAT(Declare("--by vx --regions 4 --hold-out").text, HasSubstr("--regions: --hold-out judges"));
  EXPECT_THAT(Declare("--by vx --regions 257").text, HasSubstr("--regions: has to be at most 256"));
}

// The first of the rows lies next to the domain's edge.
TEST_F(DeclareDataTest, NamesTheLinesOfTheFileWhereTransitionsAreLeftOut) {
  const Json before = Json::parse(Declare("--by vx --json").text);
  const std::string line = "transitions: steps.csv\n", rows = Read(scratch_ / "steps.csv");
  scratch_.Write("steps.csv", std::string(rows).insert(rows.find('\n') + 1, "20,0,0,0,0,0,20,0,0,0\n"));
  const std::string task = Replaced(Read(task_), line, "  state_error: {px: 1e-12}\n" + line);
  std::ofstream(task_) << task;
  const Json after = Json::parse(Declare("--by vx --json").text);
  EXPECT_EQ(after["transitions"], before["transitions"]);
  for (const int which : {0, 1})
    EXPECT_EQ(after["entries"][0]["lines"][which], before["entries"][0]["lines"][which].get<int>() + 1);
}

TEST_F(DeclareDataTest, ItsLinesGoIntoATaskFileThatNoTransitionContradicts) {
  const Json document = Json::parse(Declare("--by vx --noise estimated --json").text);
  EXPECT_FALSE(document["proven"]);
  const std::string task = Read(task_);
  const std::size_t begin = task.find("declaration:"), end = task.find("transitions:");
  std::ofstream(task_) << task.substr(0, begin) + document["yaml"].get<std::string>() + task.substr(end);
  const Config config = LoadConfig(task_);
  EXPECT_FALSE(Certifier(config.problem).violation());
  EXPECT_EQ(config.problem->declaration.lipschitz(2, 2), document["lipschitz"][2][2]);
  ASSERT_EQ(document["entries"].size(), 1u) << document;
  const Json& entry = document["entries"][0];
  EXPECT_LE(entry["smallest"], 0.02);
  EXPECT_LE(entry["at_least"], entry["smallest"].get<double>() * (1 + 1e-6));
  EXPECT_NEAR(entry["proposed"], 1.5 * entry["smallest"].get<double>(), 1e-6);
  EXPECT_EQ(document["never_varied"], Json({"py", "vy", "ay"}));
  ASSERT_EQ(document["alone"].size(), 24u) << "every entry";
  const Json& lone = document["alone"][2 * 6 + 2];
  EXPECT_THAT(lone, Holds({{"row", "vx"}, {"column", "vx"}}));
  EXPECT_EQ(lone["pairs"], 200 * 199 / 2) << "no other column counts with --by vx";
  EXPECT_GT(lone["slope"], 0);
  EXPECT_LE(lone["slope"], 0.0201);
}

TEST_F(DeclareDataTest, SaysWhatIsNotProven) {
  EXPECT_THAT(Declare("--by vx"),
              Exits(0, "an estimate and no proof", "Nothing of this is proven.",
                    "Never varied in these transitions, so that nothing is known of their slopes: py, vy, ay."));
}

TEST_F(DeclareDataTest, SaysSoIfNoSlopesAreConsistent) {
  const Output output = Declare("--by px= --by vx=vy --disturbance declared");
  EXPECT_THAT(output, Exits(1, "no L is consistent", "their residuals of vx differ by"));
  EXPECT_LT(output.text.find("--disturbance estimated"), output.text.find("--noise estimated"));
}

TEST_F(DeclareDataTest, WhatSlopesAndNoiseExplainIsNoScatter) {
  EXPECT_THAT(Declare("--by vx").text, AllOf(Not(HasSubstr("disturbance:")), Not(HasSubstr("<- the knee")),
                                             HasSubstr("of 100 recorded steps, "), HasSubstr(" 0 left")));
  EXPECT_EQ(Json::parse(Declare("--by vx --json").text)["rows"][2]["scatter"], 0);
}

TEST_F(DeclareDataTest, HoldOutCountsContradictionsOfEachFactorAndDrawsThem) {
  const std::string picture = scratch_ / "trade";
  const Json document = Json::parse(Declare("--by vx --hold-out --blocks 8 --json --picture " + picture).text);
  ASSERT_EQ(document["factors"].size(), 7u);
  int last = 101;
  for (const Json& row : document["factors"]) {
    EXPECT_THAT(row, Holds({{"transitions", 100}, {"blocks", 4}}));
    EXPECT_LE(row["contradicting"], last);
    EXPECT_GE(row["block_rate_at_most"], row["blocks_contradicting"].get<int>() / 4.0);
    EXPECT_EQ(row["stretches"], 8) << "25 transitions of a block give two stretches of 10";
    EXPECT_LE(row["states_inside"], row["states"]);
    last = row["contradicting"];
  }
  EXPECT_NEAR(document["factors"][6]["block_rate_at_most"], 1 - std::pow(0.05, 0.25), 1e-6);
  for (const char* ending : {".svg", ".png"}) EXPECT_GT(std::filesystem::file_size(picture + ending), 1000u);
  EXPECT_THAT(Read(picture + ".svg"), HasSubstr("<svg"));
}

// A robot that turns on and on, as its heading is logged: as it grows, or wrapped at pi.
TEST_F(DeclareDataTest, AWrappedAngleLiesInItsSliceLikeOneThatGrows) {
  const auto share = [&](bool wrapped) {
    const auto logged = [&](double t) { return wrapped ? std::remainder(t, 2 * std::numbers::pi) : t; };
    std::mt19937 random(4);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::ostringstream rows;
    rows.precision(17);
    rows << "x,y,t,omega,x_next,y_next,t_next\n";
    double x = 0, y = 0, t = 0;
    for (int i = 0; i < 200; ++i) {
      const double omega = 3 + 0.5 * uniform(random), next_x = x + 0.1 * std::cos(t), next_y = y + 0.1 * std::sin(t),
                   next_t = t + 0.1 * omega + 0.001 * uniform(random);
      rows << x << "," << y << "," << logged(t) << "," << omega << "," << next_x << "," << next_y << ","
           << logged(next_t) << "\n";
      x = next_x, y = next_y, t = next_t;
    }
    scratch_.Write("steps.csv", rows.str());
    scratch_.Write("task.yaml",
                   "model:\n  states: {x: m, y: m, t: rad}\n  inputs: {omega: rad/s}\n  parameters: {dt: 0.1}\n"
                   "  next: {x: x + dt*cos(t), y: y + dt*sin(t), t: t + dt*omega}\n  angles: [t]\n"
                   "domain:\n  state: {lower: [-9, -9, -90], upper: [9, 9, 90]}\n"
                   "  input: {lower: [-5], upper: [5]}\n"
                   "declaration: {lipschitz: {}, noise_bound: [1e-9, 1e-9, 0.002]}\ntransitions: steps.csv\n"
                   "task:\n  initial_set: {center: [0, 0, 0], half_width: [0.001, 0.001, 0.001]}\n"
                   "  projection: [x, y]\n  obstacles: []\n  between: samples\n");
    const Json document = Json::parse(Declare("--by omega --hold-out --blocks 4 --steps 20 --json").text);
    const Json& row = document["factors"][0];
    EXPECT_GT(row["states"], 0);
    return row["states_inside"].get<double>() / row["states"].get<double>();
  };
  const double grows = share(false);
  EXPECT_GT(grows, 0.9);
  EXPECT_EQ(share(true), grows);
}

TEST_F(DeclareDataTest, BadInputIsExitTwo) {
  const std::pair<const char*, const char*> cases[] = {
      {"--by vz", "--by: the model has no 'vz'"},
      {"--by vx=px --by vx=py", "--by: vx is given twice"},
      {"--hold-out --blocks 201", "--blocks: 201 is more than the task's 200 transitions"},
      {"--factor 0.9", "not in range"},
      {"--hold-out --picture trade.gif", "ends in .gif"},
      {"--between", "excludes"}};
  for (const auto& [options, words] : cases) {
    const Output output = Declare(options);
    EXPECT_EQ(output.code, 2) << options;
    EXPECT_THAT(output.text, HasSubstr(words)) << options;
  }
  EXPECT_EQ(Forereach("declare --config " + task_ + " --hold-out 2>&1").code, 2) << "it needs --from-data";
}

// x+ = x + 0.1 u, and the robot obeys each command one step late, which is no function of (x, u). The sensor errs by
// 0.001.
struct LateCommandTest : testing::Test {
  LateCommandTest() {
    std::mt19937 random(5);
    std::ostringstream rows("x,u,x_next\n", std::ios::ate);
    double x = 0, last = 0, u = 0;
    for (int i = 0; i < 400; ++i) {
      if (random() % 8 == 0) u = (static_cast<int>(random() % 5) - 2) / 2.0;
      rows << x << "," << u << "," << x + 0.1 * last << "\n";
      x += 0.1 * last;
      last = u;
    }
    scratch_.Write("steps.csv", rows.str());
    Declared("lipschitz: {}\n  noise_bound: [0.001]");
  }
  void Declared(const std::string& declaration) {
    scratch_.Write("task.yaml",
                   "model: {states: {x: m}, inputs: {u: m/s}, parameters: {dt: 0.1}, next: {x: x + dt*u}}\n"
                   "domain: {state: {lower: [-100], upper: [100]}, input: {lower: [-1], upper: [1]}}\n"
                   "declaration:\n  " +
                       declaration +
                       "\ntransitions: steps.csv\ngate: {obstacles: task}\n"
                       "task: {initial_set: {center: [0], half_width: [0.01]}, projection: [x], between: samples, "
                       "obstacles: [{box: {lower: [98], upper: [99]}}]}\n");
  }
  Output Declare(const std::string& options) const {
    return Forereach("declare --config " + scratch_ / "task.yaml" + " --from-data " + options + " 2>&1");
  }

  ScratchDirectory scratch_;
};

TEST_F(LateCommandTest, ScatterIsADisturbanceAndKeepsTheRobotInItsSlices) {
  EXPECT_THAT(Declare(""), Exits(0, "noise_bound: [0.001]\n  disturbance: [0.", "<- the knee",
                                 "differ by more than noise_bound explains: x.", Not(HasSubstr("warning"))));
  const Json row = Json::parse(Declare("--json").text)["rows"][0];
  EXPECT_NEAR(row["disturbance"], 1.5 * row["scatter"].get<double>(), 1e-5);
  EXPECT_GT(row["scatter"], 0.05);
  EXPECT_TRUE(row["trades"].back()["slopes"].is_null()) << "the same place and command, and another step";
  const std::string hold_out = Declare("--hold-out --json").text;
  const Json report = Json::parse(hold_out.substr(0, hold_out.rfind('}') + 1));
  for (const Json& factor : report["factors"])
    if (factor["factor"] >= 1.5) EXPECT_EQ(factor["states_inside"], factor["states"]) << factor["factor"];
}

TEST_F(LateCommandTest, ScatterTakenForNoiseLosesTheRobotAndIsSaid) {
  EXPECT_EQ(Declare("--disturbance declared").code, 1);
  const Output output = Declare("--noise estimated --disturbance declared");
  EXPECT_THAT(output.text, HasSubstr("recorded steps have left the slices"));
  EXPECT_THAT(output.text, AllOf(HasSubstr("<- with the noise raised"), Not(HasSubstr("<- declared"))));
  EXPECT_THAT(output.text, HasSubstr("stretches of 10 steps"));
  EXPECT_THAT(Declare("--noise estimated --disturbance declared --hold-out").text,
              HasSubstr("warning: the slices of their certificates were left by "));
  EXPECT_THAT(Declare("--hold-out --by u").text, Not(HasSubstr("at factor 5")));
}

// The first true state of a stretch is as far from the recorded one as any.
TEST(HoldOut, ARecordWithinTheDeclaredErrorLiesInItsSlices) {
  const ScratchDirectory scratch;
  std::ostringstream rows("p,u,p_next\n", std::ios::ate);
  for (int i = 0; i < 40; ++i) rows << (i % 2 == 0 ? "-0.0499,0,0.0499\n" : "0.0499,0,-0.0499\n");
  scratch.Write("steps.csv", rows.str());
  scratch.Write("task.yaml",
                "model: {states: {p: m}, inputs: {u: m/s}, parameters: {dt: 0.1}, next: {p: p + dt*u}}\n"
                "domain: {state: {lower: [-5], upper: [5]}, input: {lower: [-2], upper: [2]}}\n"
                "declaration: {lipschitz: {}, noise_bound: [0], state_error: {p: 0.05}}\n"
                "transitions: steps.csv\ngate: {obstacles: task}\n"
                "task: {initial_set: {center: [0], half_width: [0.01]}, projection: [p], between: samples, "
                "obstacles: [{box: {lower: [4], upper: [5]}}]}\n");
  const Output output =
      Forereach("declare --config " + scratch / "task.yaml" + " --from-data --hold-out --blocks 4 --steps 5 2>&1");
  EXPECT_THAT(output.text, HasSubstr("factor"));
  EXPECT_THAT(output.text, Not(HasSubstr("left the slices"))) << output.text;
}

TEST_F(LateCommandTest, CheckNamesTheDisturbanceFirstAndEveryPair) {
  Declared("lipschitz: {x: {u: 0.001}}\n  noise_bound: [0.001]");
  const std::string text = Forereach("check " + scratch_ / "task.yaml" + " 2>&1").text;
  EXPECT_THAT(text, HasSubstr("the robot does not always do the same at nearly the same place"));
  const std::size_t noise = text.find("noise_bound of x at least");
  EXPECT_LT(text.find("declare a disturbance of x of at least 0."), noise);
  EXPECT_NE(noise, std::string::npos);
  EXPECT_THAT(text, testing::ContainsRegex("contradicted by [0-9]+ pairs"));
  EXPECT_THAT(text, testing::ContainsRegex("times\\), and [0-9]+ more\n"));
}

TEST_F(LateCommandTest, CheckSaysHowManyStepsLeaveTheirSlices) {
  const auto check = [&] { return Forereach("check " + scratch_ / "task.yaml" + " 2>&1").text; };
  Declared("lipschitz: {x: {u: 0.1}}\n  noise_bound: [0.13]");
  EXPECT_THAT(check(), HasSubstr("recorded steps have left the slices"));
  Declared("lipschitz: {x: {u: 0.001}}\n  noise_bound: [0.001]\n  disturbance: [0.2]");
  EXPECT_THAT(check(), AllOf(Not(HasSubstr("left the slices")), HasSubstr(" consistent, 0 left\n")));
  const Json held_out = Json::parse(Forereach("check --json " + scratch_ / "task.yaml").text)["held_out"];
  EXPECT_GT(held_out["inside"], 0);
  EXPECT_EQ(held_out["left"], 0);
  const std::string init = "init --transitions " + scratch_ / "steps.csv" + " --dt 0.1 --out " + scratch_ / "new.yaml";
  EXPECT_THAT(Forereach(init + " 2>&1").text, Not(HasSubstr("left the slices"))) << "slopes of 1 promise little";
}

// In every other pair of steps the robot jumps from where it stood before.
TEST_F(LateCommandTest, InitSaysHowManyStepsLeaveTheirSlices) {
  const auto init = [&](double jump) {
    std::ostringstream rows("x,u,x_next\n", std::ios::ate);
    for (int block = 0; block < 20; ++block) {
      const double step = block % 2 == 0 ? 0 : jump;
      rows << "0,0," << step << "\n" << step << ",0," << 2 * step << "\n";
    }
    scratch_.Write("jumps.csv", rows.str());
    return Forereach("init --force --transitions " + scratch_ / "jumps.csv" + " --dt 0.1 --out " +
                     scratch_ / "new.yaml" + " 2>&1")
        .text;
  };
  EXPECT_THAT(init(0.5), HasSubstr("20 of 20 recorded steps have left the slices"));
  EXPECT_THAT(init(0.5), HasSubstr("(10 stretches of 2 steps)"));
  EXPECT_THAT(init(0.01), Not(HasSubstr("left the slices"))) << "less than the errors that it declares";
}

// Steps from y = 0 at a speed v, whose residual of y is an error of the sensor.
struct NoiseCliff : testing::Test {
  void Write(const std::vector<std::pair<double, double>>& steps) const {
    std::ostringstream rows("y,v,a,y_next,v_next\n", std::ios::ate);
    rows.precision(9);
    for (const auto& [v, error] : steps) rows << "0," << v << ",0," << 0.1 * v + error << "," << v << "\n";
    scratch_.Write("steps.csv", rows.str());
  }
  static std::vector<std::pair<double, double>> Steps(int count, double error) {
    std::mt19937 random(6);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<std::pair<double, double>> steps;
    for (int i = 0; i < count; ++i) {
      const double v = 2 + 1.5 * uniform(random);
      steps.emplace_back(v, error * uniform(random));
    }
    return steps;
  }
  // One pair of nearly the same speed shows an error of 0.0262, and one far apart that there is a slope.
  void WriteCliff() const {
    std::vector<std::pair<double, double>> steps = Steps(297, 0.018);
    steps.insert(steps.end(), {{1.5, 0.0262}, {1.5001, -0.0262}, {1.0235, 0.030026}});
    Write(steps);
  }
  Output Declare(const std::string& noise, const std::string& options = "") const {
    scratch_.Write(
        "task.yaml",
        "model: {states: {y: m, v: m/s}, inputs: {a: m/s^2}, parameters: {dt: 0.1}, next: {y: y + dt*v, v: v + "
        "dt*a}}\ndomain: {state: {lower: [-100, 0], upper: [100, 4]}, input: {lower: [-1], upper: [1]}}\n"
        "declaration: {lipschitz: {}, noise_bound: [" +
            noise +
            ", 0]}\ntransitions: steps.csv\ntask: {initial_set: {center: [0, 1.5], half_width: [0.01, 0.01]}, "
            "projection: [y], between: samples, obstacles: []}\n");
    return Forereach("declare --config " + scratch_ / "task.yaml" + " --from-data --by v " + options + " 2>&1");
  }
  Json Document(const std::string& noise, const std::string& options = "") const {
    return Json::parse(Declare(noise, "--json " + options).text);
  }
  double Steepest(const std::string& noise, const std::string& options = "") const {
    return Document(noise, options)["lipschitz"][0][1];
  }

  ScratchDirectory scratch_;
};

// A sensor whose error is a little larger than declared: only pairs at nearly the same place show it.
TEST_F(NoiseCliff, TheKneeIsProposedInsteadOfASteepSlope) {
  Write(Steps(300, 0.025));
  EXPECT_GT(Steepest("0.02", "--disturbance declared"), 1) << "the slope explains noise";
  EXPECT_LT(Steepest("0.02"), 0.05);
  EXPECT_THAT(Declare("0.02").text, HasSubstr("<- the knee"));
  EXPECT_LT(Steepest("0.026"), 0.05);
  EXPECT_THAT(Declare("0.038").text, Not(HasSubstr("<- the knee"))) << "1.5 times what near places show";
}

TEST_F(NoiseCliff, OneTableShowsItFromBothSides) {
  WriteCliff();
  for (const auto& [noise, slope] :
       {std::pair("0.0245", 34.0), {"0.0255", 14.0}, {"0.0261", 2.0}, {"0.0265", 0.00677}}) {
    const Json row = Document(noise)["rows"][0];
    EXPECT_NEAR(row["knee"], 0.0262, 1e-6) << noise;
    const auto slope_at = [&](std::size_t i) { return row["trades"][i]["slopes"][1].get<double>(); };
    ASSERT_EQ(row["trades"].size(), 6u);
    EXPECT_NEAR(slope_at(5), slope, 0.01 * slope) << "as declared, " << noise;
    EXPECT_NEAR(slope_at(2), 52.4, 0.1) << "at 0.9 of the knee";
    EXPECT_LT(slope_at(3), 0.05) << "at the knee";
    EXPECT_LT(Steepest(noise), 0.05) << noise;
  }
  EXPECT_THAT(Declare("0.0245").text,
              AllOf(HasSubstr("0.0245      v 34"), HasSubstr("  <- declared\n"), HasSubstr("  <- the knee\n"),
                    HasSubstr("  <- proposed\n"), HasSubstr("differ by more than noise_bound explains: y")));
  for (const char* noise : {"0.0263", "0.0265", "0.039"})
    EXPECT_THAT(Declare(noise).text, AllOf(HasSubstr("0.02358     v 52.4"), HasSubstr("  <- the knee\n"),
                                           HasSubstr("  <- declared, proposed"),
                                           HasSubstr("at the knee or above it, by less than a factor of 1.5: y")));
  EXPECT_THAT(Declare("0.0394").text, AllOf(HasSubstr("0.0262"), Not(HasSubstr("<- the knee"))));
  EXPECT_THAT(Declare("0.0245", "--disturbance declared").text,
              AllOf(HasSubstr("  <- declared, proposed"), HasSubstr("these slopes are a cliff: y")));
}

TEST_F(NoiseCliff, IsDrawn) {
  WriteCliff();
  const std::string picture = scratch_ / "cliff";
  EXPECT_EQ(Declare("0.0245", "--picture " + picture).code, 0);
  EXPECT_GT(std::filesystem::file_size(picture + ".png"), 1000u);
  EXPECT_THAT(Read(picture + ".svg"), HasSubstr("y: knee at 0.0262"));
  Write({{1, 0}, {2, 0.01}, {3, 0.02}});
  EXPECT_THAT(Declare("0", "--picture " + picture), Exits(2, "no slopes to draw against it"));
}

}  // namespace forereach::declare_data_test
