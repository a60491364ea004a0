// `forereach verify` on a decision: confirmed as it is, refuted with one thing changed, digests made good again or not.
#include <regex>

#include "command_line/progress.h"
#include "records/decision_json.h"
#include "tests/cli/program.h"
#include "tests/records/logs.h"

namespace forereach::verify_command_test {

using Json = nlohmann::json;

// A task of its own beside its transitions, and the decision on a plan of it.
struct VerifyDecision : testing::Test {
  VerifyDecision() {
    std::filesystem::copy(FOREREACH_SOURCE_DIR "/config/data", scratch_ / "data");
    task_ = Read(FOREREACH_SOURCE_DIR "/config/bicycle.yaml");
    WriteTask(task_);
    decision_ = Certify("bicycle_certified");
  }

  void WriteTask(const std::string& text) { std::ofstream(scratch_ / "task.yaml") << text; }

  Json Certify(const std::string& plan) {
    return Json::parse(
        Forereach("certify --json --config " + scratch_ / "task.yaml --plan config/plans/" + plan + ".csv").text);
  }

  Output Verify(const std::string& options = "") {
    std::ofstream(scratch_ / "decision.json") << decision_;
    return Forereach("verify " + scratch_ / "decision.json " + options + " 2>&1");
  }

  // As somebody would who knows how digests are made.
  void Reseal() { decision_["digests"]["tube"] = ToHex(TubeDigest(decision_["tube"])); }
  void Reseal(const Config& config) {
    decision_["digests"]["config"] = ToHex(config.grounds.config);
    decision_["digests"]["declaration"] = ToHex(config.grounds.declaration);
    decision_["digests"]["obstacles"] = ToHex(config.grounds.obstacles);
  }

  void ExpectRefuted(std::initializer_list<const char*> texts) {
    const Output output = Verify();
    EXPECT_EQ(output.code, 1);
    for (const char* text : texts) EXPECT_THAT(output.text, HasSubstr(text));
  }

  ScratchDirectory scratch_;
  std::string task_;
  Json decision_;
};

TEST_F(VerifyDecision, TheUnchangedDecisionIsConfirmed) {
  EXPECT_THAT(Verify(), Exits(0, "1 certificates, 1 confirmed, 0 refuted"));
}

TEST_F(VerifyDecision, EveryShippedCertificateIsConfirmed) {
  for (const auto& [task, plan] : {std::pair{"bicycle", "bicycle_certified"},
                                   {"point_mass", "point_mass_certified"},
                                   {"post_samples", "straight"},
                                   {"pedestrian", "pedestrian_brake"}}) {
    const std::string file = scratch_ / task;
    Forereach(std::string("certify --json --config config/") + task + ".yaml --plan config/plans/" + plan + ".csv > " +
              file);
    EXPECT_EQ(Forereach("verify " + file).code, 0) << task;
  }
}

// A weak motor and a drag, which five steps bound. Data by which the gain is another refute it.
TEST_F(VerifyDecision, OfAnAffineRowIsConfirmed) {
  const auto write_steps = [&](double gain) {
    std::ostringstream rows;
    rows.precision(17);
    rows << "x,v,a,x_next,v_next\n";
    for (const auto& [v, a] : {std::pair{1.0, 0.5}, {0.0, -1.0}, {2.0, 1.0}, {1.5, -0.5}, {0.5, 0.0}})
      rows << "0," << v << "," << a << "," << 0.1 * v << "," << v + 0.1 * (gain * a - 0.1 * v) << "\n";
    scratch_.Write("steps.csv", rows.str());
  };
  write_steps(0.8);
  scratch_.Write("plan.csv", "a\n1\n1\n-1\n-0.5\n");
  WriteTask(
      "model: {states: {x: m, v: m/s}, inputs: {a: m/s^2}, parameters: {dt: 0.1}, next: {x: x + dt*v, v: v + dt*a}}\n"
      "domain: {state: {lower: [-9, -9], upper: [9, 9]}, input: {lower: [-2], upper: [2]}}\n"
      "declaration: {lipschitz: {}, affine: {rows: [v], columns: [v, a]}, noise_bound: [1e-9, 1e-6]}\n"
      "transitions: steps.csv\n"
      "task: {initial_set: {center: [0, 1], half_width: [0.01, 0.01]}, projection: [x], between: samples,\n"
      "       obstacles: [{half_plane: {normal: [1], offset: 2}}]}\n");
  const std::string task = " --config " + scratch_ / "task.yaml", plan = " --plan " + scratch_ / "plan.csv";
  decision_ = Json::parse(Forereach("certify --json" + task + plan).text);
  ASSERT_EQ(decision_["outcome"], "certified") << decision_;
  EXPECT_EQ(Verify().code, 0);
  EXPECT_THAT(Forereach("check" + task + plan + " 2>&1").text,
              HasSubstr("the residual of v is affine in v, a, on the whole domain"));
  EXPECT_THAT(Forereach("declare --from-data" + task + " 2>&1").text, HasSubstr("declaration.affine: slopes are"));
  write_steps(0.7);
  EXPECT_NE(Verify().code, 0);
}

// A robot that stands: `parts` of its body, the half-widths of its initial set, and an obstacle.
class StandingDecision : public VerifyDecision {
 protected:
  void CertifyStanding(const std::string& parts, double half_width, const std::string& obstacle) {
    scratch_.Write("data.csv", "x,y,th,u,x_next,y_next,th_next\n0,0,0,0,0,0,0\n");
    scratch_.Write("plan.csv", "u\n0\n");
    std::ostringstream task;
    task
        << "model: {states: {x: m, y: m, th: rad}, inputs: {u: '1'}, parameters: {dt: 0.1}, next: {x: x, y: y, th: "
           "th}}\n"
           "domain: {state: {lower: [-1e160, -1e160, -9], upper: [1e160, 1e160, 9]}, input: {lower: [0], upper: [0]}}\n"
           "declaration: {lipschitz: {}, noise_bound: [0, 0, 0]}\ntransitions: data.csv\ntask:\n"
           "  initial_set: {center: [0, 0, 0], half_width: ["
        << half_width << ", " << half_width << ", 0]}\n  body: {pose: [x, y, th], parts: " << parts
        << "}\n  between: samples\n  obstacles: [" << obstacle << "]\n";
    WriteTask(task.str());
    decision_ = Json::parse(
        Forereach("certify --json --config " + scratch_ / "task.yaml --plan " + scratch_ / "plan.csv").text);
    ASSERT_EQ(decision_["outcome"], "certified");
  }
};

// Also where the best bound is that of the whole body, the threshold is of the part that the record names.
TEST_F(StandingDecision, OfABodyOfTwoPartsIsConfirmed) {
  const std::string parts = "[{disc: {at: [0, 2.7], radius: 0}}, {disc: {at: [0, 0], radius: 0}}]";
  CertifyStanding(parts, 0, "{half_plane: {normal: [0, 1], offset: 5.1}}");
  EXPECT_THAT(decision_, Holds({{"part", 0}, {"threshold", 0.0}}));
  EXPECT_NEAR(decision_["margin"].get<double>(), 5.1 - 2.7, 1e-9);
  EXPECT_EQ(Verify().code, 0);
  CertifyStanding(parts, 0, "{half_plane: {normal: [0, -1], offset: 2.8}}");
  EXPECT_THAT(decision_, Holds({{"part", 1}, {"threshold", 0.0}}));
  EXPECT_EQ(Verify().code, 0);
  decision_["part"] = nullptr;
  ExpectRefuted({"threshold"});
}

TEST_F(StandingDecision, WhoseRadiusIsAboveEveryDoubleIsConfirmed) {
  CertifyStanding("[{disc: {at: [0, 0], radius: 0}}]", 1e155, "");
  EXPECT_TRUE(decision_["tube"][0]["radius"].is_null());
  EXPECT_EQ(Verify().code, 0);
}

// A certificate of the samples does not become one of all times, and no certificate gets other times.
TEST_F(VerifyDecision, WithOtherWordsOfWhenItHoldsIsRefuted) {
  const Json before = decision_;
  EXPECT_EQ(decision_["holds"], "samples");
  decision_["holds"] = "all_times";
  ExpectRefuted({"the record was altered after it was made: holds"});
  decision_.erase("holds");
  EXPECT_THAT(Verify(), Exits(2, "holds"));
  decision_ = before;
  decision_["message"] = std::regex_replace(decision_["message"].get<std::string>(),
                                            std::regex("certified at its sample instants only: the robot stays clear"),
                                            "certified: the robot stays clear at all times");
  ExpectRefuted({"the record was altered after it was made: message"});
  decision_ = before;
  decision_["inputs"]["schedule"]["step_us"] = 1;
  ExpectRefuted({"the record was altered after it was made: inputs.schedule"});
}

TEST_F(VerifyDecision, WhoseTaskHasANameThatNoFileHasIsBadInput) {
  decision_["inputs"]["config"]["absolute"] = std::string(5000, 'a');
  const Output output = Verify();
  EXPECT_EQ(output.code, 0) << output.text << "the name as given serves";
  decision_["inputs"]["config"]["given"] = "nowhere.yaml";
  EXPECT_EQ(Verify().code, 2);
}

TEST_F(VerifyDecision, NestedWithoutEndIsBadInput) {
  const std::string text = decision_.dump(), deep = std::string(1'000'000, '[') + std::string(1'000'000, ']');
  std::ofstream(scratch_ / "decision.json") << std::string(text).insert(text.find("\"center\""), "\"a\":" + deep + ",");
  EXPECT_THAT(Forereach("verify " + scratch_ / "decision.json 2>&1"), Exits(2, "nested deeper than 32 levels"));
}

TEST_F(VerifyDecision, PrintsItsVerdictAsJson) {
  Json document = Json::parse(Verify("--json").text);
  EXPECT_EQ(document["confirmed"], 1);
  EXPECT_TRUE(document["failures"].empty());
  decision_["tube"][3]["half_width"][0] = 0;
  document = Json::parse(Verify("--json").text);
  EXPECT_EQ(document["refuted"], 1);
  EXPECT_EQ(document["failures"][0]["step"], 3);
  EXPECT_EQ(document["failures"][0]["mismatches"].size(), 1u);
}

TEST_F(VerifyDecision, TakesAnotherTaskByOption) {
  EXPECT_EQ(Verify("--config config/bicycle.yaml").code, 0);
  EXPECT_EQ(Verify("--config config/point_mass.yaml").code, 2) << "of another size";
  EXPECT_EQ(Verify("--config none.yaml").code, 2);
}

TEST_F(VerifyDecision, RefusesAnAbstention) {
  decision_ = Certify("bicycle_safety");
  EXPECT_THAT(Verify(), Exits(1, "0 certificates"));
  decision_["outcome"] = "certified";
  ExpectRefuted({"refuted", "clear of obstacle"});
}

TEST_F(VerifyDecision, RefutesASliceShrunkenByOneUlp) {
  for (std::size_t t = 0; t < decision_["tube"].size(); ++t) {
    const Json before = decision_;
    Json& half_width = decision_["tube"][t]["half_width"][t % 6];
    half_width = std::nextafter(half_width.get<double>(), 0.0);
    ExpectRefuted({"refuted", "the record was altered after it was made: digest of tube"});
    decision_ = before;
  }
}

TEST_F(VerifyDecision, RefutesASliceThatWasShrunkenAndResealed) {
  Json& half_width = decision_["tube"][5]["half_width"][0];
  half_width = half_width.get<double>() * (1 - 1e-12);
  Reseal();
  EXPECT_THAT(Verify(), Exits(1, "step 5: not so: ", Not(HasSubstr("altered"))));
}

TEST_F(VerifyDecision, RefutesAnInitialSliceShrunkenByOneUlpAndResealed) {
  Json& slice = decision_["tube"][0];
  slice["half_width"][3] = std::nextafter(slice["half_width"][3].get<double>(), 0.0);
  Reseal();
  ExpectRefuted({"step 0: not so"});
}

TEST_F(VerifyDecision, RefutesADroppedGenerator) {
  decision_["tube"][7]["generators"].erase(2);
  ExpectRefuted({"digest of tube", "step 7: not so: the hull of the recorded generators"});
  Reseal();
  ExpectRefuted({"step 7: not so: the hull of the recorded generators"});
}

TEST_F(VerifyDecision, RefutesAChangedControl) {
  decision_["inputs"]["controls"][2][1] = decision_["inputs"]["controls"][2][1].get<double>() + 1e-6;
  ExpectRefuted({"digest of plan", "step 3: not so"});
}

TEST_F(VerifyDecision, RefutesAChangedSigma) {
  WriteTask(std::regex_replace(task_, std::regex("noise_bound: .*"), "noise_bound: [0, 0, 1e-9, 0, 0, 0]"));
  ExpectRefuted({"digest of the config", "digest of the declaration", "step 0: not so", "residual of theta"});
  Reseal(LoadConfig(scratch_ / "task.yaml"));
  EXPECT_THAT(Verify(), Exits(1, Not(HasSubstr("digest of"))));
}

TEST_F(VerifyDecision, RefutesAMovedObstacle) {
  std::smatch center;
  ASSERT_TRUE(std::regex_search(task_, center, std::regex("circle: \\{center: \\[([^,]*), ([^\\]]*)\\]")));
  const Json& last = decision_["tube"].back()["center"];
  std::ostringstream moved;
  moved << "circle: {center: [" << last[0] << ", " << last[1] << "]";
  WriteTask(center.prefix().str() + moved.str() + center.suffix().str());
  ExpectRefuted({"digest of the config", "digest of the obstacles", "clear of obstacle 0"});
  Reseal(LoadConfig(scratch_ / "task.yaml"));
  ExpectRefuted({"not so: the ", " keeps clear of obstacle 0"});
}

// A body of two parts that turns, bounds between the samples, an obstacle that moves, and one that comes a minute
// later.
class VerifyWorld : public VerifyDecision {
 protected:
  VerifyWorld() {
    task_ = std::regex_replace(task_, std::regex("\n  (projection|between):[^\n]*"), "");
    task_ = std::regex_replace(task_, std::regex("\n  obstacles:\n    - circle:[^\n]*"), R"(
  body:
    pose: [x, y, theta]
    parts:
      - hull: {points: [[-1, -0.9], [3.5, -0.9], [3.5, 0.9], [-1, 0.9]]}
      - disc: {at: [2, 0], radius: 1}
  between: {acceleration: [12, 12], turn_rate: 2.5, turn_acceleration: 4}
  obstacles:
    - circle: {center: [11.4, 19], radius: 1}
      motion: {velocity: [0.5, -1], uncertainty: 0.1, growth: 0.2, growth_rate: 0.1}
    - circle: {center: [0, 0], radius: 9}
      motion: {velocity: [0, 0], from: 60})");
    WriteTask(task_);
    decision_ = Certify("bicycle_certified");
  }

  void ExpectAltered(const char* field) { ExpectRefuted({"the record was altered after it was made: ", field}); }
};

TEST_F(VerifyWorld, ADecisionWithABodyAndMovingObstaclesIsConfirmed) {
  EXPECT_EQ(decision_["holds"], "all_times");
  EXPECT_EQ(decision_["inputs"]["schedule"]["step_us"], 100'000);
  EXPECT_TRUE(decision_["tube"].back()["clearance"].empty());
  EXPECT_TRUE(decision_["tube"][0]["clearance"][1].is_null()) << "nowhere";
  EXPECT_THAT(Verify(), Exits(0));
}

TEST_F(VerifyWorld, AChangedWitnessIsRefuted) {
  const Json before = decision_;
  decision_["holds"] = "samples";
  ExpectAltered("holds");
  decision_ = before;
  decision_["part"] = 1 - decision_["part"].get<int>();
  ExpectAltered("threshold");
  decision_ = before;
  decision_["inputs"]["schedule"]["step_us"] = 100'001;
  ExpectAltered("inputs.schedule");
  decision_ = before;
  for (const char* number : {"margin", "threshold"}) decision_[number] = decision_[number].get<double>() + 0.25;
  ExpectAltered("threshold");
}

TEST_F(VerifyWorld, AClearanceIsThatOfTheStepAfterItsSample) {
  const auto t = decision_["closest_step"].get<std::size_t>();
  Json& clearance = decision_["tube"][t]["clearance"][0];
  const double proven = clearance;
  clearance = proven * 1.001;
  Reseal();
  ExpectRefuted({"not so: the motion to the next sample keeps clear of obstacle 0"});
  clearance = nullptr;  // nowhere
  Reseal();
  ExpectRefuted({"not so: the motion to the next sample keeps clear of obstacle 0"});
}

TEST_F(VerifyWorld, AnotherMotionIsRefuted) {
  WriteTask(std::regex_replace(task_, std::regex("growth: 0.2"), "growth: 0.3"));
  ExpectRefuted({"digest of the obstacles", "not so: the motion to the next sample keeps clear of obstacle 0"});
  WriteTask(std::regex_replace(task_, std::regex("from: 60"), "until: 60"));
  ExpectRefuted({"digest of the obstacles", "obstacle 1"});
}

TEST_F(VerifyDecision, RefutesAChangedObservation) {
  std::string data = Read(scratch_ / "data/bicycle_corridor_400.csv");
  data.erase(data.rfind('\n', data.size() - 2) + 1);  // the last row
  std::ofstream(scratch_ / "data/bicycle_corridor_400.csv") << data;
  ExpectRefuted({"digest of the observations"});
}

TEST_F(VerifyDecision, BadInputExitsWithTwo) {
  for (const char* file : {"none.json", "README.md", "config/bicycle.yaml", "tests/data/course.lcmlog"})
    EXPECT_EQ(Forereach(std::string("verify ") + file + " 2>/dev/null").code, 2) << file;
  decision_.erase("inputs");
  EXPECT_EQ(Verify().code, 2);
  decision_ = Json::array();
  EXPECT_EQ(Verify().code, 2);
}

TEST(VerifyHelp, ShowsOptionsExitCodesAndAnExample) {
  const Output output = Forereach("verify --help");
  EXPECT_EQ(output.code, 0);
  for (const char* text : {"DECISION|LOG|DATABASE", "exit 0", "forereach verify decision.json",
                           "forereach verify run/log", "--config FILE"})
    EXPECT_THAT(output.text, HasSubstr(text));
}

TEST(ProgressTest, PrintsTheShareDoneAndTheTimeLeft) {
  EXPECT_EQ(Progress::Line("plans", 5, 10, 3), "[###############...............] 5 of 10 plans, 3 s left");
  EXPECT_EQ(Progress::Line("plans", 0, 10, 3), "[..............................] 0 of 10 plans");
  EXPECT_EQ(Progress::Line("plans", 10, 10, 3), "[##############################] 10 of 10 plans");
}

}  // namespace forereach::verify_command_test
