// The `forereach` program as a person or a script calls it.
#include <cstdio>
#include <regex>

#include "tests/cli/program.h"
#include "tests/task/task_files.h"

namespace forereach::cli_test {

using Json = nlohmann::json;

Json CertifyJson(const std::string& config, const std::string& plan) {
  return Json::parse(
      Forereach("certify --json --config config/" + config + ".yaml --plan config/plans/" + plan + ".csv").text);
}

std::set<std::string> KeysOf(const Json& object) {
  std::set<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.insert(key);
  return keys;
}

struct Case {
  const char *config, *plan, *outcome, *cause;
  int code;
  friend void PrintTo(const Case& of, std::ostream* out) { *out << of.config << " " << of.plan; }
};

class Shipped : public testing::TestWithParam<Case> {};

TEST_P(Shipped, EachShippedPlanGetsItsOutcomeAndExitCode) {
  const Case& c = GetParam();
  const Output output =
      Forereach(std::string("certify --config config/") + c.config + ".yaml --plan config/plans/" + c.plan + ".csv");
  EXPECT_EQ(output.code, c.code) << output.text;
  const Json decision = CertifyJson(c.config, c.plan);
  EXPECT_EQ(decision["outcome"], c.outcome);
  EXPECT_EQ(decision["cause"], c.cause == nullptr ? Json(nullptr) : Json(c.cause));
}

INSTANTIATE_TEST_SUITE_P(
    Tasks, Shipped,
    testing::Values(Case{"bicycle", "bicycle_certified", "certified", nullptr, 0},
                    Case{"bicycle", "bicycle_domain", "abstain_domain", "domain_exit", 1},
                    Case{"bicycle", "bicycle_safety", "abstain_safety", "obstacle", 1},
                    Case{"bicycle_falsified", "bicycle_certified", "abstain_falsified", "pairwise", 1},
                    Case{"point_mass", "point_mass_certified", "certified", nullptr, 0},
                    Case{"point_mass", "point_mass_domain", "abstain_domain", "domain_exit", 1},
                    Case{"point_mass", "point_mass_safety", "abstain_safety", "obstacle", 1},
                    Case{"point_mass_falsified", "point_mass_certified", "abstain_falsified", "pairwise", 1},
                    Case{"post_samples", "straight", "certified", nullptr, 0},
                    Case{"post", "straight", "abstain_safety", "obstacle", 1},
                    Case{"truck", "truck_turn", "abstain_safety", "obstacle", 1},
                    Case{"pedestrian", "pedestrian_go", "abstain_safety", "obstacle", 1},
                    Case{"pedestrian", "pedestrian_brake", "certified", nullptr, 0}));

TEST(CertifyJsonTest, SaysWhenItHoldsAndWhatItIsAbout) {
  const Json samples = CertifyJson("post_samples", "straight"), post = CertifyJson("post", "straight"),
             truck = CertifyJson("truck", "truck_turn"), brake = CertifyJson("pedestrian", "pedestrian_brake");
  EXPECT_EQ(samples["holds"], "samples");
  EXPECT_EQ(samples["tube"].back()["clearance"].size(), 1u);
  for (const Json& decision : {post, truck, brake}) {
    EXPECT_EQ(decision["holds"], "all_times");
    EXPECT_EQ(decision["tube"].back()["clearance"].size(), 0u) << "there is nothing after the last sample";
    EXPECT_EQ(decision["tube"][0]["clearance"].size(), 1u);
  }
  EXPECT_EQ(post["step"], 7) << "between 8.4 m and 9.6 m";
  EXPECT_EQ(truck["part"], 1) << "the cab";
  EXPECT_EQ(brake["part"], 0);
  EXPECT_EQ(brake["inputs"]["schedule"], Json({{"start_us", 0}, {"step_us", 100'000}, {"clock_error_us", 7001}}))
      << "0.1 is no double: the times of the samples are rounded";
}

// The pedestrian is seen only from 10 s on, when the plan has ended.
TEST(CertifyJsonTest, AnObstacleThatIsNowhereHasNoClearance) {
  const ScratchDirectory scratch;
  std::string task = Read(FOREREACH_SOURCE_DIR "/config/pedestrian.yaml");
  task = std::regex_replace(task, std::regex("growth: 0.2\\}"), "growth: 0.2, from: 10}");
  task = std::regex_replace(task, std::regex("transitions: "), "transitions: " FOREREACH_SOURCE_DIR "/config/");
  const std::string path = scratch.Write("task.yaml", task), decision_path = scratch / "decision.json";
  const Output output = Forereach("certify --json --config " + path + " --plan config/plans/pedestrian_go.csv");
  EXPECT_EQ(output.code, 0);
  const Json decision = Json::parse(output.text);
  EXPECT_EQ(decision["tube"][0]["clearance"], Json::array({nullptr}));
  EXPECT_EQ(decision["message"], "certified: no obstacle is there; steps up to 0.002 s off their times");
  for (const char* key : {"obstacle", "part", "closest_step", "margin", "threshold"})
    EXPECT_EQ(decision[key], nullptr) << key;
  scratch.Write("decision.json", output.text);
  EXPECT_EQ(Forereach("verify " + decision_path).code, 0);
}

TEST(CertifyJsonTest, SaysWhichDisturbanceItAllowsFor) {
  const ScratchDirectory scratch;
  std::string task = Read(FOREREACH_SOURCE_DIR "/config/bicycle.yaml");
  task = std::regex_replace(task, std::regex("transitions: "), "transitions: " FOREREACH_SOURCE_DIR "/config/");
  const std::string noise = "  noise_bound: [0, 0, 0, 0, 0, 0]\n";
  const auto with = [&](const std::string& bounds) {
    return scratch.Write("task.yaml", Replaced(task, noise, noise + "  disturbance: " + bounds + "\n"));
  };
  const std::string plan = " --plan config/plans/bicycle_certified.csv", decision_path = scratch / "decision.json";
  std::string path = with("[0, 0, 1e-4, 0.01, 0, 0]");
  const Output output = Forereach("certify --json --config " + path + plan);
  ASSERT_EQ(output.code, 0);
  const Json decision = Json::parse(output.text), calm = CertifyJson("bicycle", "bicycle_certified");
  EXPECT_EQ(decision["disturbance"], Json({0.0, 0.0, 1e-4, 0.01, 0.0, 0.0}));
  EXPECT_THAT(decision["message"], HasSubstr("under the declared disturbance"));
  EXPECT_NE(decision["digests"]["declaration"], calm["digests"]["declaration"]);
  EXPECT_GT(decision["tube"][1]["half_width"][3], calm["tube"][1]["half_width"][3]);
  scratch.Write("decision.json", output.text);
  EXPECT_EQ(Forereach("verify " + decision_path).code, 0);
  EXPECT_THAT(Forereach("certify --config " + path + plan).text,
              HasSubstr("\n  each step disturbed by up to: theta 0.0001 v 0.01\n"));
  Json altered = decision;
  altered["disturbance"][2] = 0;
  scratch.Write("decision.json", altered.dump());
  EXPECT_EQ(Forereach("verify " + decision_path + " 2>&1").code, 1);

  path = with("{theta: 1e-4, v: \"1e-3*abs(v*(delta - a))\"}");
  const Output grows = Forereach("certify --json --config " + path + plan);
  ASSERT_EQ(grows.code, 0);
  Json growing = Json::parse(grows.text);
  EXPECT_EQ(growing["disturbance"], Json({0.0, 0.0, 1e-4, "1e-3*abs(v*(delta - a))", 0.0, 0.0}));
  EXPECT_NE(growing["digests"]["declaration"], decision["digests"]["declaration"]);
  scratch.Write("decision.json", grows.text);
  EXPECT_EQ(Forereach("verify " + decision_path).code, 0);
  growing["disturbance"][3] = "1e-3*abs(v*delta)";
  scratch.Write("decision.json", growing.dump());
  EXPECT_EQ(Forereach("verify " + decision_path + " 2>&1").code, 1);
  EXPECT_THAT(Forereach("certify --config " + path + plan).text,
              HasSubstr("\n  each step disturbed by up to: theta 0.0001 v 1e-3*abs(v*(delta - a))\n"));

  path = with("[0, 0, 0, 0, 0, 0]");
  const Json zeros = Json::parse(Forereach("certify --json --config " + path + plan).text);
  EXPECT_FALSE(zeros.contains("disturbance"));
  for (const char* same : {"tube", "message"}) EXPECT_EQ(zeros[same], calm[same]);
  EXPECT_EQ(zeros["digests"]["declaration"], calm["digests"]["declaration"]);
}

TEST(CertifyJsonTest, HasExactlyTheKeysOfTheContract) {
  const Json decision = CertifyJson("bicycle", "bicycle_certified");
  EXPECT_EQ(KeysOf(decision),
            (std::set<std::string>{"outcome", "holds", "part", "step", "cause", "coordinate", "exit",
                                   "first_observation", "second_observation", "obstacle", "closest_step", "margin",
                                   "threshold", "message", "capped", "inputs", "tube", "digests", "elapsed_us"}));
  const std::string page = Read(FOREREACH_SOURCE_DIR "/docs/decision.md");
  for (const std::string& key : KeysOf(decision)) EXPECT_THAT(page, HasSubstr("\n| `" + key + "` |"));
  EXPECT_EQ(KeysOf(decision["digests"]),
            (std::set<std::string>{"plan", "tube", "config", "model", "declaration", "observations", "obstacles"}));
  const Json& tube = decision["tube"];
  ASSERT_EQ(tube.size(), 13u);
  const std::set<std::string> slice_keys{"center", "half_width", "generators", "clearance", "radius"};
  std::set<std::string> step_keys = slice_keys;
  step_keys.insert({"envelope", "remainder"});
  for (std::size_t t = 0; t < 12; ++t) EXPECT_EQ(KeysOf(tube[t]), step_keys) << t;
  EXPECT_EQ(KeysOf(tube[12]), slice_keys);
  EXPECT_EQ(tube[0]["center"].size(), 6u);
  EXPECT_EQ(tube[0]["generators"].size(), 6u);
  for (const Json& slice : tube) EXPECT_GT(slice["clearance"][0].get<double>(), 0);
}

// The witness fields that are not null.
std::set<std::string> WitnessOf(const Json& decision) {
  std::set<std::string> present;
  for (const char* key : {"step", "coordinate", "exit", "first_observation", "second_observation", "obstacle",
                          "closest_step", "margin", "threshold"})
    if (!decision.at(key).is_null()) present.insert(key);
  return present;
}

using Keys = std::set<std::string>;

TEST(CertifyJsonTest, ACertificateNamesItsClosestObstacle) {
  const Json decision = CertifyJson("bicycle", "bicycle_certified");
  EXPECT_EQ(WitnessOf(decision), (Keys{"obstacle", "closest_step", "margin", "threshold"}));
  EXPECT_EQ(decision["obstacle"], 0);
  const auto step = decision["closest_step"].get<std::size_t>();
  EXPECT_EQ(decision["threshold"], 1.0);
  double least = std::numeric_limits<double>::infinity();
  for (const Json& slice : decision["tube"]) least = std::min(least, slice["clearance"][0].get<double>());
  EXPECT_EQ(decision["tube"][step]["clearance"][0], least);
  EXPECT_NEAR(decision["margin"].get<double>() - decision["threshold"].get<double>(), least, 1e-12);
}

TEST(CertifyPicture, ShowsTheTubeAndWhatBecameOfIt) {
  const ScratchDirectory scratch;
  const std::pair<const char*, const char*> shown[] = {{"bicycle_certified", ">certified<"},
                                                       {"bicycle_safety", ">abstained (S)<"},
                                                       {"bicycle_domain", ">tube before the abstention<"}};
  for (const auto& [plan, name] : shown) {
    const std::string file = scratch / (std::string(plan) + ".svg");
    const Output output = Forereach(std::string("certify --config config/bicycle.yaml --plan config/plans/") + plan +
                                    ".csv --picture '" + file + "'");
    EXPECT_LE(output.code, 1) << output.text;
    EXPECT_THAT(Read(file), AllOf(HasSubstr(name), HasSubstr(">obstacle<")));
  }
}

TEST(CertifyJsonTest, AnAbstentionSNamesTheObstacleAndWhatIsMissing) {
  const Json decision = CertifyJson("bicycle", "bicycle_safety");
  EXPECT_EQ(WitnessOf(decision), (Keys{"step", "obstacle", "closest_step", "margin", "threshold"}));
  EXPECT_THAT(decision, Holds({{"obstacle", 0}, {"closest_step", decision["step"]}}));
  EXPECT_LT(decision["margin"].get<double>(), decision["threshold"].get<double>());
}

TEST(CertifyJsonTest, AnAbstentionDNamesCoordinateValueAndBound) {
  const Json decision = CertifyJson("bicycle", "bicycle_domain");
  EXPECT_EQ(WitnessOf(decision), (Keys{"step", "coordinate", "exit", "margin", "threshold"}));
  EXPECT_EQ(decision["coordinate"], 4) << "a, of x, y, theta, v, a, delta";
  EXPECT_THAT(decision, Holds({{"exit", "upper"}, {"threshold", 3.0}}));
  EXPECT_GT(decision["margin"].get<double>(), 3.0);
}

TEST(CertifyJsonTest, AnAbstentionFNamesThePairAndWhatTheDeclarationAllows) {
  const Json decision = CertifyJson("bicycle_falsified", "bicycle_certified");
  EXPECT_EQ(WitnessOf(decision),
            (Keys{"coordinate", "first_observation", "second_observation", "margin", "threshold"}));
  EXPECT_THAT(decision, Holds({{"first_observation", 0}, {"second_observation", 6}, {"coordinate", 2}}));
  EXPECT_GT(decision["margin"].get<double>(), decision["threshold"].get<double>());
}

TEST(CertifyJsonTest, WithoutObstaclesThereIsNoClosestOne) {
  const ScratchDirectory scratch;
  std::string text = Read(FOREREACH_SOURCE_DIR "/config/bicycle.yaml");
  text = std::regex_replace(text, std::regex("obstacles:\n *- circle.*"), "obstacles: []");
  text = std::regex_replace(text, std::regex("transitions: data"), "transitions: " FOREREACH_SOURCE_DIR "/config/data");
  const Json decision = Json::parse(Forereach("certify --json --config " + scratch.Write("task.yaml", text) +
                                              " --plan config/plans/bicycle_certified.csv")
                                        .text);
  EXPECT_EQ(decision["outcome"], "certified");
  EXPECT_EQ(WitnessOf(decision), Keys{});
}

TEST(CertifyJsonTest, TubeEndsAtTheStepThatLeftTheDomain) {
  const Json decision = CertifyJson("bicycle", "bicycle_domain");
  EXPECT_EQ(decision["tube"].size(), decision["step"].get<std::size_t>() + 1);
  EXPECT_FALSE(decision["tube"].back().contains("envelope"));
}

TEST(CertifyJsonTest, FalsifiedHasNoTubeAndNoStep) {
  const Json decision = CertifyJson("bicycle_falsified", "bicycle_certified");
  EXPECT_TRUE(decision["tube"].empty());
  EXPECT_TRUE(decision["step"].is_null());
}

TEST(CertifyJsonTest, SafetyNamesAStepWhoseClearanceIsNotProven) {
  const Json decision = CertifyJson("bicycle", "bicycle_safety");
  const auto step = decision["step"].get<std::size_t>();
  EXPECT_LE(decision["tube"][step]["clearance"][0].get<double>(), 0);
  for (std::size_t t = 0; t < step; ++t) EXPECT_GT(decision["tube"][t]["clearance"][0].get<double>(), 0) << t;
}

TEST(BadInput, ExitsWithTwoAndOneLine) {
  for (const char* arguments :
       {"certify --config none.yaml --plan config/plans/bicycle_certified.csv",
        "certify --config config/bicycle.yaml --plan none.csv",
        "certify --config config/bicycle.yaml --plan config/plans/point_mass_certified.csv",
        "plan --config config/bicycle.yaml --out /tmp/not_written.csv",
        "replay tests/data/course.lcmlog --config tests/data/course.yaml --key none",
        "verify tests/data/course.lcmlog --config tests/data/course.yaml --key none",
        "replay none.lcmlog --config config/bicycle.yaml", "report none.lcmlog --config config/bicycle.yaml"}) {
    const Output output = Forereach(std::string(arguments) + " 2>&1 >/dev/null");
    EXPECT_EQ(output.code, 2) << arguments;
    EXPECT_EQ(std::count(output.text.begin(), output.text.end(), '\n'), 1) << output.text;
  }
}

TEST(BadInput, UsageExitsWithTwo) {
  for (const char* arguments : {"", "certify", "nonsense", "certify --config"})
    EXPECT_EQ(Forereach(std::string(arguments) + " >/dev/null 2>&1").code, 2) << arguments;
}

// Bad input of the file itself, so it was taken as the task.
TEST(BadInput, ATaskFileIsTakenWithAndWithoutItsOption) {
  for (const char* command : {"fit", "declare", "check", "export-model", "run", "plan --out x.csv"})
    for (const char* before : {" ", " --config "}) {
      const Output output = Forereach(std::string(command) + before + "none.yaml 2>&1 >/dev/null");
      EXPECT_EQ(output.code, 2) << command << before;
      EXPECT_THAT(output.text, HasSubstr("none.yaml: cannot be read")) << command << before;
    }
  EXPECT_THAT(Forereach("fit a.yaml --config b.yaml 2>&1").text, HasSubstr("--config: is given too often"));
}

TEST(BadInput, AnUnknownWordBringsTheOneThatWasMeant) {
  const struct {
    const char *arguments, *sentence;
  } cases[] = {{"certfy --config x", "forereach: unknown command certfy; did you mean certify?"},
               {"cetrify", "unknown command cetrify; did you mean certify?"},
               {"verfiy x", "unknown command verfiy; did you mean verify?"},
               {"replya", "unknown command replya; did you mean replay?"},
               {"check_log x", "unknown command check_log; did you mean check-log?"},
               {"nonsense", "unknown command nonsense; known here: certify, init, import"},
               {"--verison", "unknown option --verison; did you mean --version?"},
               {"certify --confg x --plan y", "unknown option --confg of certify; did you mean --config?"},
               {"certify --config x --plan y --jsn", "unknown option --jsn of certify; did you mean --json?"},
               {"certify --config x --plan y --jsn=3", "unknown option --jsn of certify; did you mean --json?"},
               {"certify --config x --plan y z", "unexpected argument z of certify"},
               {"certify --config x --plan y \"$(printf '\\033[2J')\"", "unexpected argument ?[2J of certify"},
               {"nonsense --help", "unknown command nonsense; known here: certify, init, import"},
               {"cetrify --help", "unknown command cetrify; did you mean certify?"},
               {"certify --confg --help", "unknown option --confg of certify; did you mean --config?"},
               {"certify --config x --plan", "--plan: its value is missing"},
               {"", "A subcommand is required"}};
  for (const auto& [arguments, sentence] : cases) {
    const Output output = Forereach(std::string(arguments) + " 2>&1 >/dev/null");
    EXPECT_EQ(output.code, 2) << arguments;
    EXPECT_THAT(output.text, HasSubstr(sentence)) << arguments;
  }
}

// Forereach() looks for texts of libraries in what is said.
TEST(BadInput, NonsenseInAFileIsNamedInWordsOfOurs) {
  const ScratchDirectory scratch;
  const std::string sqlite("SQLite format 3\0\x10\0\1\1\0\x40\x20\x20", 24);
  const std::string contents[] = {"{",
                                  "[1, ",
                                  std::string("\0\xff\0", 3),
                                  "{\"a\": 1}",
                                  "a: [b",
                                  "a: *b",
                                  "\t- x: {y}",
                                  "[[1]]",
                                  "{\"inputs\": {\"config\": 3}, \"outcome\": []}",
                                  sqlite + std::string(1000, 'x')};
  const std::string task = " --config config/bicycle.yaml ", file = scratch / "decisions.sqlite";
  const std::string commands[] = {"certify --plan config/plans/bicycle_certified.csv --config " + file,
                                  "certify" + task + "--plan " + file,
                                  "check --no-picture --config " + file,
                                  "check-log " + scratch.path(),
                                  "verify " + file,
                                  "replay" + task + file,
                                  "report" + task + file,
                                  "advise " + file,
                                  "export --format csv --out " + (scratch / "out") + " " + file,
                                  "log list " + file,
                                  "import --out " + (scratch / "out.csv") + " --dt 0.1 " + file,
                                  "fit --config " + file,
                                  "declare --config " + file,
                                  "declare" + task + "--check " + file,
                                  "plan --out " + (scratch / "plan.csv") + " --config " + file,
                                  "run --config " + file,
                                  "status --key " + file,
                                  "keys --config " + file};
  for (const std::string& content : contents) {
    std::ofstream(file, std::ios::binary) << content;
    for (const std::string& command : commands) {
      const Output output = Forereach(command + " 2>&1 </dev/null");
      EXPECT_THAT(output.code, AnyOf(1, 2)) << command << "\n" << content << "\n" << output.text;
      EXPECT_FALSE(output.text.empty()) << command << "\n" << content;
    }
  }
}

// Each is refused with 2 and says what cannot be used.
TEST(BadInput, ExitsWithTwoAndNamesTheInputThatCannotBeUsed) {
  const ScratchDirectory scratch;
  scratch.Write("empty", "");
  const std::string certify = "certify --config config/bicycle.yaml --plan config/plans/bicycle_certified.csv";
  const std::string plan = "plan --config config/demo.yaml --out " + (scratch / "x.csv");
  const std::string log = "tests/data/course.lcmlog --config tests/data/course.yaml", empty = scratch / "empty";
  const struct {
    std::string arguments, sentence;
  } cases[] = {
      {"certify --config config --plan x.csv", "config: is a directory, not a file"},
      {"certify --config config/bicycle.yaml --plan config", "config: is a directory, not a file"},
      {"certify --config config/bicycle.yaml --plan " + empty,
       "empty:1: the file is empty; it has to begin with the header"},
      {"certify --config " + empty + " --plan x.csv", "empty:1: has no YAML document"},
      {"certify --config '' --plan x.csv", "--config: the value is empty; write a FILE"},
      {certify + " --plan x.csv", "--plan"},
      {"plan --config config/demo.yaml --out " + (scratch / "none/x.csv"), "none/x.csv: cannot be written"},
      {"plan --config config/demo.yaml --out " + scratch.path(), "cannot be written: Is a directory"},
      {"plan --config config/demo.yaml --out ''", "--out: the value is empty; write a FILE.csv"},
      {"plan --config config/bicycle.yaml --out x.csv", "config/bicycle.yaml: planner.goal: missing"},
      {plan + " --seed -1", "--seed: Value -1 not in range 0 to 4294967295"},
      {plan + " --seed 4294967296", "--seed: Value 4294967296 not in range"},
      {plan + " --seed nan", "--seed: Value nan not in range"},
      {plan + " --seed 1.5", "--seed: Value 1.5 not in range"},
      {"verify config", "config: neither a decision database nor event logs, *.lcmlog or lcmlog-*, in this directory"},
      {"verify " + empty, empty + ": is empty, and neither a candidate nor a decision"},
      {"verify none.json", "none.json: cannot be read: No such file or directory"},
      {"verify " + log + " --jobs 0", "--jobs: Value 0 not in range 1 to 256"},
      {"verify " + log + " --jobs 99999999999", "--jobs: Value 99999999999 not in range 1 to 256"},
      {"replay config --config tests/data/course.yaml", "config: neither a decision database nor event logs"},
      {"report config --config tests/data/course.yaml", "config: neither a decision database nor event logs"},
      {"report " + log + " --picture " + (scratch / "none/x.svg"), "there is no directory"},
      {"report " + log + " --picture x.gif", "x.gif ends in .gif; it has to end in .svg or .png"},
      {"report " + log + " --picture ''", "--picture: the value is empty; write a FILE"},
      {"check-log none", "none: there is no such directory"},
      {"run --config config", "config: is a directory, not a file"},
      {"run --config config/demo.yaml --directory config/demo.yaml", "cannot make the directory config/demo.yaml"},
      {"run --config config/bicycle.yaml --directory " + (scratch / "log"), "planner.goal: missing"},
      {"keys extra", "unexpected argument extra of keys"},
      {"keygen config", "--robot is required"},
      {"keygen --robot alpha", "directory is required"},
      {"keygen --robot alpha config", "config: cannot be made: File exists"},
      {"keygen --robot alpha ''", "the value is empty; write a DIR"},
      {"keygen --robot 'a b' " + (scratch / "keys"), "\"a b\": a robot's name has to be 1 to 64 letters"},
      {"keygen --robot alpha config --again planer",
       "--again: planer not in {certifier,planner,perception,robot,operator,logger}"},
      {"keygen --robot alpha config --again planner", "/config: there are no keys in it"},
      {"keygen --robot alpha none --again planner", "key none: cannot be read: No such file or directory"},
      {"status --config none.yaml", "none.yaml: cannot be read"},
      {"status --config config/demo.yaml --lcm-url nonsense", "nonsense has to begin with udpm:// or memq://"},
      {"declare --config config/bicycle.yaml --gap nan", "--gap"},
      {"declare --config config/bicycle.yaml --gap -1", "--gap: Value -1 not in range"},
      {"declare --config config/bicycle.yaml --max-boxes 0", "--max-boxes: Value 0 not in range 1 to 100000000"},
      {"declare --config config/demo.yaml", "config/demo.yaml:1: residual: missing"},
      {"declare --config config/bicycle.yaml --check config", "config: is a directory, not a file"},
      {"declare --config config/bicycle.yaml --cover a --check b", "--cover excludes --check"}};
  for (const auto& [arguments, sentence] : cases) {
    const Output output = Forereach(arguments + " 2>&1 >/dev/null");
    EXPECT_EQ(output.code, 2) << arguments << "\n" << output.text;
    EXPECT_THAT(output.text, HasSubstr(sentence)) << arguments;
  }
}

// Its name appears when it is whole. A pipe would wait for a reader, and a device would be replaced.
TEST(OutputFiles, AreWholeOrNotThere) {
  const ScratchDirectory scratch;
  const std::string log = "tests/data/course.lcmlog --config tests/data/course.yaml";
  const std::string full = "cd '" FOREREACH_SOURCE_DIR "'; ulimit -f 8; trap '' XFSZ; '" FOREREACH_PROGRAM "' ";
  for (const std::string& arguments : {"report " + log + " --picture '" + (scratch / "a.svg") + "'",
                                       "report " + log + " --picture '" + (scratch / "a.png") + "'",
                                       "report " + log + " --out '" + (scratch / "a.html") + "'"}) {
    const Output output = Shell(full + arguments + " 2>&1");
    EXPECT_EQ(output.code, 2) << arguments << "\n" << output.text;
    EXPECT_THAT(output.text, HasSubstr("cannot be written: File too large")) << arguments;
    EXPECT_TRUE(std::filesystem::is_empty(scratch.path())) << arguments;
  }
  const std::string pipe = scratch / "pipe";
  ASSERT_EQ(Shell("mkfifo '" + pipe + "'").code, 0);
  for (const std::string& command : {"report " + log, std::string("export-model config/bicycle_text.yaml")}) {
    const Output output = Forereach(command + " --force --out '" + pipe + "' 2>&1");
    EXPECT_EQ(output.code, 2) << command << "\n" << output.text;
    EXPECT_THAT(output.text, HasSubstr("pipe: is no file that can be replaced")) << command;
  }
  const Output exported = Forereach("export " + log + " --format jsonl --out '" + pipe + "' 2>&1");
  EXPECT_THAT(exported.text, AllOf(HasSubstr("pipe: the file exists"), Not(HasSubstr("--force"))));
  EXPECT_THAT(Forereach("report " + log + " --out '" + pipe + "' 2>&1").text, HasSubstr("or write --force"));
}

TEST(Report, OfADamagedLogExitsWithOne) {
  const ScratchDirectory scratch;
  std::string bytes = Read(FOREREACH_SOURCE_DIR "/tests/data/course.lcmlog");
  scratch.Write("whole.lcmlog", bytes);
  bytes.replace(bytes.size() / 2, 8, 8, '\0');  // a header or its content
  bytes.replace(bytes.find("\xED\xA1\xDA\x01", bytes.size() / 3), 4, 4, '\0');
  scratch.Write("damaged.lcmlog", bytes);
  const std::string task = " --config tests/data/course.yaml";
  for (const std::string& more :
       {std::string(), std::string(" --json"), " --advice-seconds 0 --force --out '" + (scratch / "x.html") + "'"}) {
    EXPECT_EQ(Forereach("report '" + (scratch / "whole.lcmlog") + "'" + task + more).code, 0) << more;
    EXPECT_EQ(Forereach("report '" + (scratch / "damaged.lcmlog") + "'" + task + more).code, 1) << more;
  }
}

TEST(Keygen, AgainReplacesOneKeyAndSaysWhoNeedsWhichFile) {
  const ScratchDirectory scratch;
  const std::string keys = scratch / "keys";
  ASSERT_EQ(Forereach("keygen --robot alpha " + keys).code, 0);
  const Output output = Forereach("keygen --robot alpha " + keys + " --again planner 2>&1");
  EXPECT_THAT(output, Exits(0, keys + ": the planner has a new key."));
  std::size_t at = 0;
  for (const char* line :
       {"  certifier.key to the machine that speaks as certifier", "  robot.key to", "  perception.key to",
        "  operator.key to", "  logger.key to", "  planner.key to the new machine of the planner", "  verify.pub to"}) {
    at = output.text.find(line, at);
    EXPECT_NE(at, std::string::npos) << line << "\n" << output.text;
  }
  EXPECT_THAT(Forereach("keygen --robot beta " + keys + " --again planner 2>&1"),
              Exits(2, "the keys are of robot alpha, not of beta"));
}

// The lines below "Example:", "Examples:" or "Try:".
std::vector<std::string> ExamplesOf(const std::string& help) {
  std::vector<std::string> examples;
  std::istringstream lines(help);
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("Example") || line.starts_with("Try:"))
      inside = true;
    else if (!line.starts_with("  "))
      inside = false;
    else if (inside)
      examples.push_back(line.substr(2));
  }
  return examples;
}

// What a robot's machine runs does not load what only plans, reads or draws.
TEST(Program, CommandsForARunningSystemLoadNoLibraryOfTheOthers) {
  const Output libraries = Forereach("--version && ldd '" FOREREACH_PROGRAM "'");
  ASSERT_THAT(libraries, Exits(0, "liblcm"));
  for (const char* library : {"libompl", "libcairo", "libmpfi", "libsqlite3"})
    EXPECT_THAT(libraries.text, Not(HasSubstr(library)));
}

// Each example is run as it stands, in a directory that has the repository's config/, with a near goal, and a recorded
// log under the name that the examples use, too. "old" is the same run. Not run: what needs a bus, and declare's
// covers, which take long and have tests of their own.
TEST(Help, EveryExampleRuns) {
  const ScratchDirectory scratch;
  std::filesystem::copy(FOREREACH_SOURCE_DIR "/config", scratch / "config", std::filesystem::copy_options::recursive);
  // A short drive: eight of the commands verify or replay its certificates.
  scratch.Write("config/demo.yaml", Replaced(Read(scratch / "config/demo.yaml"), "goal: [120, 0]", "goal: [30, 0]"));
  std::filesystem::create_directory_symlink("run", scratch / "old");
  std::filesystem::create_directories(scratch / "bin");
  std::filesystem::create_symlink(FOREREACH_PROGRAM, scratch / "bin/forereach");
  std::set<std::string> ran;
  const auto run = [&](const std::string& example) {
    const Output output = Forereach("--version >/dev/null && cd " + scratch.path() + " && PATH=" + scratch.path() +
                                    "/bin:$PATH && " + example + " 2>&1");
    EXPECT_EQ(output.code, 0) << example << "\n" << output.text;
    ran.insert(example);
  };
  // Other tests run these: they need a bus, hours or a server.
  constexpr std::array elsewhere = {"doctor", "cover.json", "postgresql://"};
  const auto run_all_of = [&](const std::string& command) {
    for (const std::string& example : ExamplesOf(Forereach(command + " --help").text))
      if (!std::ranges::any_of(elsewhere, [&](const char* word) { return example.find(word) != std::string::npos; }))
        run(example);
  };
  run_all_of("run");  // records run/log
  run_all_of("check-log");
  for (const auto& entry : std::filesystem::directory_iterator(scratch / "run/log"))
    if (entry.path().extension() == ".lcmlog")
      std::filesystem::copy_file(entry.path(), scratch / "run/log/events-20260101-120000-000000.lcmlog");
  for (const char* command :
       {"", "certify", "plan", "declare", "verify", "replay", "merge", "report", "keygen", "keys"})
    run_all_of(command);
  EXPECT_GE(ran.size(), 10u);
}

TEST(Help, ExitsWithZeroAndShowsAnExample) {
  for (const char* command : {"", "certify ", "plan ", "replay ", "report ", "run "}) {
    const Output output = Forereach(std::string(command) + "--help");
    EXPECT_EQ(output.code, 0) << command;
    EXPECT_THAT(output.text, HasSubstr("forereach ")) << command;
  }
}

// ---- plan: what it suggests passes.

class PlanCommand : public testing::TestWithParam<std::tuple<std::string, int>> {};

std::string LineAfter(const std::string& text, const std::string& mark) {
  const std::size_t at = text.find(mark);
  if (at == std::string::npos) return "";
  const std::size_t begin = at + mark.size();
  return text.substr(begin, text.find('\n', begin) - begin);
}

TEST_P(PlanCommand, SuggestsACommandThatExitsWithZero) {
  const auto& [task, seed] = GetParam();
  const ScratchDirectory scratch;
  const std::string file = scratch / "a plan's.csv", config = "config/" + task + ".yaml";
  const Output planned =
      Forereach("plan --config " + config + " --out \"" + file + "\" --seed " + std::to_string(seed));
  ASSERT_EQ(planned.code, 0) << planned.text;
  const std::string suggested = LineAfter(planned.text, "now: forereach ");
  ASSERT_NE(suggested, "") << planned.text;
  const Output certified = Forereach(suggested);
  EXPECT_EQ(certified.code, 0) << planned.text << certified.text;
  // What it says of the plan is what certify says.
  EXPECT_THAT(planned.text, HasSubstr(certified.text.substr(0, certified.text.find('\n'))));
  // The tube ends in a stop: around zero speed, acceleration and steering.
  const Json tube = Json::parse(Forereach(suggested + " --json").text)["tube"];
  for (const std::size_t rests : {3u, 4u, 5u})
    EXPECT_NEAR(tube.back()["center"][rests].get<double>(), 0, 1e-9) << "state " << rests;
  EXPECT_GT(tube.back()["center"][0].get<double>(), 1) << "it drives";
}

INSTANTIATE_TEST_SUITE_P(ShippedTasks, PlanCommand,
                         testing::Combine(testing::Values("demo", "policy"), testing::Range(0, 12)));

TEST(Plan, TheSameSeedGivesTheSamePlan) {
  const ScratchDirectory scratch;
  for (const char* file : {"a.csv", "b.csv"})
    ASSERT_EQ(Forereach("plan --config config/demo.yaml --seed 5 --out " + (scratch / file)).code, 0);
  EXPECT_EQ(Read(scratch / "a.csv"), Read(scratch / "b.csv"));
}

using Replacements = std::vector<std::pair<std::string, std::string>>;

// The field of circles with parts of its text replaced.
std::string DemoWith(const ScratchDirectory& scratch, const Replacements& replacements) {
  std::string text = Read(FOREREACH_SOURCE_DIR "/tests/data/field.yaml");
  const auto replace = [&text](const std::string& what, const std::string& with) {
    const std::size_t at = text.find(what);
    ASSERT_NE(at, std::string::npos) << what;
    text.replace(at, what.size(), with);
  };
  replace("transitions: ../../config/data/", "transitions: " FOREREACH_SOURCE_DIR "/config/data/");
  for (const auto& [what, with] : replacements) replace(what, with);
  return scratch.Write("task.yaml", text);
}

TEST(Plan, SaysWhyWhenNoPlanIsFound) {
  const std::string first = "{center: [18, 3], radius: 2.5}", speed_noise = "noise_bound: [0, 0, 0, 0";
  const struct {
    Replacements task;
    int code;
    const char* sentence;
  } cases[] = {{{{first, "{center: [0, 0], radius: 2.5}"}}, 1, "searches found a candidate"},
               {{{first, "{center: [4.5, 0], radius: 2}"}, {"half_width: [0.05, 0.05", "half_width: [3, 3"}},
                1,
                "not certified, the last: abstain S"},
               {{{speed_noise, "noise_bound: [0, 0, 0, 1"}}, 1, "not certified, the last: abstain D"},
               {{{"delta: 0.609638820", "delta: 0.0001"}}, 1, "1 candidate was not certified, the last: abstain F"},
               {{{"  goal: [120, 0]\n", ""}}, 2, "planner.goal: missing"},
               {{{"algorithm: kpiece", "algorithm: magic"}}, 2, "planner.algorithm: magic"}};
  for (const auto& c : cases) {
    const ScratchDirectory scratch;
    const std::string out = scratch / "plan.csv";
    const Output output = Forereach("plan --config " + DemoWith(scratch, c.task) + " --out " + out + " 2>&1");
    EXPECT_EQ(output.code, c.code) << output.text;
    EXPECT_THAT(output.text, AllOf(HasSubstr(c.sentence), Not(HasSubstr("now:"))));
    EXPECT_FALSE(std::ifstream(out).good()) << "nothing is written";
  }
}

TEST(Doctor, PrintsOneJsonDocument) {
  const Output output = Forereach("doctor --json");
  const Json document = Json::parse(output.text);
  EXPECT_EQ(output.code, document["good"] ? 0 : 1);
  ASSERT_EQ(document["checks"].size(), 5u);
  const Json& keys = document["checks"][4];
  EXPECT_EQ(keys["found"], "UNSIGNED: anyone on this network can move this robot");
  EXPECT_TRUE(keys["warning"]) << "the bus works all the same";
  for (const Json& check : document["checks"])
    EXPECT_TRUE(check["good"] || !check["advice"].get<std::string>().empty());
}

// ---- README's code is the code of tests/install.

// The contents of all fenced blocks of a language.
std::vector<std::string> Blocks(const std::string& markdown, const std::string& language) {
  std::vector<std::string> blocks;
  const std::string fence = "```" + language + "\n";
  for (std::size_t at = markdown.find(fence); at != std::string::npos; at = markdown.find(fence, at + 1)) {
    const std::size_t begin = at + fence.size();
    blocks.push_back(markdown.substr(begin, markdown.find("```", begin) - begin));
  }
  return blocks;
}

TEST(Readme, CodeIsTheInstalledExample) {
  const std::vector<std::string> blocks = Blocks(Read(FOREREACH_SOURCE_DIR "/README.md"), "cpp");
  EXPECT_EQ(Only(blocks), Read(FOREREACH_SOURCE_DIR "/tests/install/main.cpp"));
}

}  // namespace forereach::cli_test
