// `forereach declare`: its matrix, its cover, and the results of --check for valid and altered covers.
#include <regex>

#include "identify/cover_file.h"
#include "tests/cli/program.h"
#include "tests/records/logs.h"
#include "tests/task/task_files.h"

namespace forereach::declare_test {

using Json = nlohmann::json;

// The bicycle's task with another residual section.
struct DeclareTest : testing::Test {
  void WriteTask(const std::string& residual) {
    const std::string text = Read(FOREREACH_SOURCE_DIR "/config/bicycle.yaml");
    std::ofstream(task_) << Replaced(std::regex_replace(text, std::regex("\nresidual: .*"), "\n" + residual),
                                     "transitions: ", "transitions: " FOREREACH_SOURCE_DIR "/config/");
  }
  Output Declare(const std::string& options = "") const {
    return Forereach("declare --config " + task_ + " " + options + " 2>&1");
  }
  Output Check() const { return Declare("--check " + cover_); }

  // Writes the cover with one thing changed.
  template <class Change>
  void Tamper(const Change& change) const {
    Json document = Json::parse(Read(cover_));
    change(document);
    std::ofstream(cover_) << document;
  }
  // As somebody would who knows how digests are made.
  void Reseal() const {
    const std::string digest =
        ToHex(CoverDigest(LoadCover(cover_, LoadConfig(task_, TransitionsFile::kIgnore)).claims));
    Tamper([&](Json& document) { document["digests"]["cover"] = digest; });
  }
  void ExpectRefuted(const char* text) const { EXPECT_THAT(Check(), Exits(1, text, "check: refuted")); }

  ScratchDirectory scratch_;
  const std::string task_ = scratch_ / "task.yaml", cover_ = scratch_ / "cover.json";
};

// A disturbance has no slope: the bounds, and a cover that was made before, stay what they are.
TEST_F(DeclareTest, ADisturbanceLeavesTheCoverAlone) {
  WriteTask("residual: {name: heading_saturation}");
  ASSERT_EQ(Declare("--cover " + cover_).code, 0);
  const std::string task = Read(task_), noise = "  noise_bound: [0, 0, 0, 0, 0, 0]\n";
  std::ofstream(task_) << Replaced(task, noise, noise + "  disturbance: [0, 0, 0.01, 0.1, 0, 0]\n");
  EXPECT_EQ(Check().code, 0);
  EXPECT_THAT(Declare("--between").text, HasSubstr("declaration.disturbance is a bound at the samples."));
  std::ofstream(task_) << task;
  EXPECT_THAT(Declare("--between").text, Not(HasSubstr("disturbance")));
}

TEST(Declare, ProvesTheMatrixOfTheShippedBicycleTask) {
  const Output output = Forereach("declare --config config/bicycle.yaml --json");
  EXPECT_EQ(output.code, 0);
  const Json document = Json::parse(output.text);
  const Json& lipschitz = document["lipschitz"];
  ASSERT_EQ(lipschitz.size(), 6u);
  double sum = 0;
  for (const Json& row : lipschitz) {
    ASSERT_EQ(row.size(), 8u);
    for (const Json& entry : row) sum += entry.get<double>();
  }
  EXPECT_NEAR(lipschitz[2][3], 0.01195760, 1e-8);
  EXPECT_NEAR(lipschitz[2][5], 0.40767005, 1e-8);
  EXPECT_EQ(sum, lipschitz[2][3].get<double>() + lipschitz[2][5].get<double>());
  EXPECT_LE(document["lower"][2][3], lipschitz[2][3]);
  EXPECT_LE(document["gap"], 1e-7);
  EXPECT_TRUE(document["reached"]);
  EXPECT_EQ(document["entries"][1]["point"]["v"], 25);
  EXPECT_GT(document["boxes"], 2);
  for (const char* digest : {"config", "model", "residual"})
    EXPECT_EQ(document["digests"][digest].get<std::string>().size(), 64u);
}

TEST_F(DeclareTest, ItsLineGoesIntoATaskFileAndBoundsAtLeastAsMuch) {
  WriteTask("residual: {name: heading_saturation, understeer: [0.3, 0.34], friction: [0.85, 0.95]}\n");
  const Json document = Json::parse(Declare("--json").text);
  const std::string text =
      std::regex_replace(Read(task_), std::regex("\n  lipschitz: .*"), "\n  " + document["yaml"].get<std::string>());
  std::ofstream(task_) << text;
  const Eigen::MatrixXd lipschitz = LoadConfig(task_, TransitionsFile::kIgnore).problem->declaration.lipschitz;
  for (const int l : {3, 5}) {
    const double bound = document["lipschitz"][2][static_cast<std::size_t>(l)];
    EXPECT_GE(lipschitz(2, l), bound);
    EXPECT_LE(lipschitz(2, l), bound * (1 + 1e-9));
  }
  EXPECT_GT(lipschitz(2, 5), 0.4077);
  EXPECT_THAT(Declare().text, HasSubstr("declaration:\n  " + document["yaml"].get<std::string>()));
}

// What it prints is pasted into the task; a slope that is too small, or a box that is too large, is refuted.
TEST_F(DeclareTest, RegionsAreProvenAndCheckedInTheTask) {
  WriteTask("residual: {name: heading_saturation}");
  const Output output = Declare("--regions 16 --cover " + cover_);
  ASSERT_EQ(output.code, 0);
  const std::string text = Read(task_), found = output.text.substr(output.text.find("  lipschitz:")),
                    declared = "  lipschitz: {theta: {v: 0.017926410, delta: 0.609638820}}\n";
  std::ofstream(task_) << Replaced(text, declared, found);
  const Config config = LoadConfig(task_, TransitionsFile::kIgnore);
  const std::vector<Region>& regions = config.problem->declaration.regions;
  ASSERT_GT(regions.size(), 4);
  EXPECT_LE(regions.size(), 16);
  EXPECT_TRUE(std::ranges::any_of(regions, [](const Region& region) { return region.lipschitz.isZero(0); }));
  EXPECT_THAT(Check(), Exits(0, "check: confirmed"));
  EXPECT_THAT(Declare("--from-data --by v,delta"), Exits(2, "slopes are proposed for the whole domain"));

  const auto with = [&](const std::string& region) {
    std::ofstream(task_) << Replaced(text, declared, declared + "  regions:\n    - " + region + "\n");
    return Check();
  };
  EXPECT_THAT(with("{in: {v: [0, 6]}, lipschitz: {theta: {}}}"), Exits(0, "check: confirmed: 4 bounds"));
  EXPECT_THAT(with("{in: {v: [0, 9]}, lipschitz: {theta: {}}}"),
              Exits(1, "declaration.regions[0]: theta by v: a box's bound is 0", "check: refuted"));
  EXPECT_THAT(with("{in: {v: [20, 30]}, lipschitz: {theta: {v: 0.01, delta: 0.3}}}"),
              Exits(1, "declaration.regions[0]: theta by delta: a box's bound is 0.3", "check: refuted"));
  EXPECT_THAT(with("{in: {v: [0, 6]}, bound: {theta: 0.1}}"),
              Exits(1, "declaration.regions[0].bound: nothing is proven of it here", "check: cannot verify"));
}

TEST_F(DeclareTest, BetweenProposesProvenBoundsFromTheEquations) {
  const Output output = Forereach("declare --config tests/data/field.yaml --between");
  EXPECT_THAT(output, Exits(0, "from the equations of kinematic_bicycle\n", "The residual is not included"));
  const Json document = Json::parse(Forereach("declare --config tests/data/field.yaml --between --json").text);
  EXPECT_EQ(document["source"], "equations");
  EXPECT_TRUE(document["proven"]);
  ASSERT_EQ(document["entries"].size(), 2u) << "the task has no body with a heading";
  EXPECT_EQ(document["entries"][0]["name"], "x''");
  const double bound = document["entries"][0]["upper"], found = document["entries"][0]["lower"];
  EXPECT_GT(found, 21.8) << "3 m/s^2 along and 21.7 m/s^2 across the heading";
  EXPECT_LE(bound, found * (1 + 1e-7));
  EXPECT_THAT(output.text, HasSubstr("\n\ntask:\n  " + document["yaml"].get<std::string>() + "\n"));
}

TEST_F(DeclareTest, BetweensLineGoesIntoATaskFileAndBoundsAtLeastAsMuch) {
  const std::string body = "  body: {pose: [x, y, theta], parts: [{disc: {at: [1, 0], radius: 1}}]}\n",
                    unsaid = std::regex_replace(Read(FOREREACH_SOURCE_DIR "/tests/data/field.yaml"),
                                                std::regex("  (between|step_period_ms): .*\n"), ""),
                    demo = Replaced(unsaid, "  projection: [x, y]\n", body);
  std::ofstream(task_) << demo;
  const Json document = Json::parse(Declare("--between --json").text);
  ASSERT_EQ(document["entries"].size(), 4u);
  std::ofstream(task_) << Replaced(demo, body, body + "  " + document["yaml"].get<std::string>() + "\n");
  const Between between = LoadConfig(task_, TransitionsFile::kIgnore).problem->between.value();
  const double bounds[] = {between.acceleration[0], between.acceleration[1], between.turn_rate,
                           between.turn_acceleration};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_GE(bounds[i], document["entries"][i]["upper"]);
    EXPECT_LE(bounds[i], document["entries"][i]["upper"].get<double>() * (1 + 1e-5));
  }
}

TEST_F(DeclareTest, BetweenProvesRatesIfAskedAndTheVerifierConfirmsThem) {
  const std::string field = Read(FOREREACH_SOURCE_DIR "/tests/data/field.yaml");
  std::ofstream(task_) << field;
  EXPECT_THAT(Declare("--between"), Exits(0, Not(HasSubstr("rate"))));
  EXPECT_THAT(Declare("--between --rates"), Exits(0, "x'", "\nmodel:\n  rate_bound: {x: 12.",
                                                  "The verifier confirms these rates, for steps of up to 0.15"));
  const Json document = Json::parse(Declare("--between --rates --json").text);
  ASSERT_EQ(document["entries"].size(), 6u) << "a and delta are set at steps";
  const std::string said = document["rates"]["yaml"];
  std::ofstream(task_) << Replaced(field, "set_at_steps: [a, delta]", "set_at_steps: [a, delta], " + said);
  const Eigen::VectorXd bound = LoadConfig(task_, TransitionsFile::kIgnore).problem->timing.rate_bound;
  for (int k = 0; k < 4; ++k) {
    const double proven = document["entries"][ToSize(2 + k)]["upper"];
    EXPECT_GE(bound[k], proven);
    EXPECT_LE(bound[k], proven * (1 + 1e-5));
  }
  EXPECT_EQ(bound[4], std::numeric_limits<double>::infinity());
}

TEST_F(DeclareTest, NoRateIsProvenWithoutEquations) {
  std::ofstream(task_) << Read(FOREREACH_SOURCE_DIR "/tests/data/field.yaml");
  EXPECT_THAT(Declare("--between --rates --from positions"),
              Exits(2, "--rates: positions show no bound on a rate; --from equations proves it"));
  std::ofstream(task_) << TaskFor(
      "model: {states: {x: m, v: m/s}, inputs: {u: m/s^2}, parameters: {dt: 0.1}, next: {x: x + dt*v, v: v + dt*u}}\n",
      2, 1, "x, v");
  EXPECT_THAT(Declare("--between --rates"),
              Exits(2, "in continuous time are not known, so none of its rates is proven: `rate` says them, `next`"));
}

TEST_F(DeclareTest, BetweenTakesLoggedPositionsIfAsked) {
  const std::string point_mass = Read(FOREREACH_SOURCE_DIR "/config/point_mass.yaml");
  std::ofstream(task_) << Replaced(point_mass, "transitions: data/point_mass_100.csv", "transitions: steps.csv");
  const auto steps = [&](const char* second) {
    scratch_.Write("steps.csv", std::string("px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n"
                                            "0,0,1,0,0,0,0.15,0,1,0\n") +
                                    second + ",0,1,0,0,0,0.345,0,1,0\n");
  };
  steps("0.15");
  EXPECT_THAT(Declare("--between --from positions"),
              Exits(0, "from the logged positions\n", "in 1 triples of logged samples. This proves nothing"));
  const Json document = Json::parse(Declare("--between --from positions --json").text);
  EXPECT_EQ(document["source"], "positions");
  EXPECT_FALSE(document["proven"]);
  EXPECT_NEAR(document["entries"][0]["upper"], 2, 1e-9) << "(0.345 - 2 * 0.15) / 0.15^2";
  EXPECT_EQ(document["entries"][1]["upper"], 0);
  steps("0.16");
  EXPECT_THAT(Declare("--between --from positions"),
              Exits(2, "transitions: none begins with the state in which the one before it ends"));
}

TEST_F(DeclareTest, BetweenProposesInSpaceFromEquationsAndFromPositions) {
  std::string task = Read(FOREREACH_SOURCE_DIR "/config/drive/double_integrator_3d.yaml");
  task = Replaced(task, "{file: ../models/double_integrator_3d.yaml}",
                  "{states: {px: m, py: m, pz: m, vx: m/s, vy: m/s, vz: m/s}, inputs: {ax: m/s^2, ay: m/s^2, az: "
                  "m/s^2}, parameters: {dt: 0.1}, integrator: euler, rate: {px: vx, py: vy, pz: vz, vx: ax, vy: ay, "
                  "vz: az}}");
  std::ofstream(task_) << Replaced(task, "transitions: double_integrator_3d.csv", "transitions: steps.csv");
  std::string line;
  std::getline(std::ifstream(FOREREACH_SOURCE_DIR "/config/drive/double_integrator_3d.csv") >> std::ws, line);
  const Config config = LoadConfig(task_, TransitionsFile::kIgnore);
  const auto row = [&](double from, double to) {  // in z, where nothing else is
    return "0,0," + std::to_string(from) + ",0,0,0,0,0,0,0,0," + std::to_string(to) + ",0,0,0\n";
  };
  scratch_.Write("steps.csv", line + "\n" + row(0, 0.25) + row(0.25, 0.75));
  const Json proven = Json::parse(Declare("--between --json").text),
             measured = Json::parse(Declare("--between --from positions --json").text);
  ASSERT_EQ(proven["entries"].size(), 3u);
  ASSERT_EQ(measured["entries"].size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(proven["entries"][k]["key"], "acceleration");
    EXPECT_GT(proven["entries"][k]["upper"], 0);
    EXPECT_EQ(measured["entries"][k]["name"], proven["entries"][k]["name"]);
    EXPECT_NEAR(measured["entries"][k]["upper"], k == 2 ? 0.25 / (config.period * config.period) : 0, 1e-9);
  }
}

// An arm of one link, 1 m long: the second derivative of its end is at most w^2 + |u|.
TEST_F(DeclareTest, BetweenProposesForPartsAtExpressions) {
  std::ofstream(task_) << R"(
model: {states: {q: rad, w: rad/s}, inputs: {u: rad/s^2}, parameters: {dt: 0.05}, integrator: rk4, rate: {q: w, w: u}}
domain: {state: {lower: [-3, -2], upper: [3, 2]}, input: {lower: [-1], upper: [1]}}
declaration: {lipschitz: {}, noise_bound: [0, 0]}
transitions: none.csv
task:
  initial_set: {center: [0, 0], half_width: [0.01, 0.01]}
  body: {parts: [{hull: {places: [["0", "0"], [cos(q), sin(q)]], radius: 0.05}}]}
  between: {acceleration: [9, 9]}
  obstacles: []
certifier: {method: centred, zonotope_order: 5}
)";
  const Json document = Json::parse(Declare("--between --max-boxes 2000 --json").text);
  ASSERT_EQ(document["entries"].size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    const Json& entry = document["entries"][k];
    EXPECT_EQ(entry["name"], "places''[" + std::to_string(k) + "]");
    EXPECT_GT(entry["upper"], 4) << "w^2 is reached";
    EXPECT_LT(entry["upper"], 5.5) << "sqrt(w^4 + u^2), a step later, is 4.33";
  }
  // A pose that only says what the planner's goal is in, so of which nothing has to be said.
  const std::string posed = Replaced(Read(task_), "body: {parts", "body: {pose: [q, w], parts");
  std::ofstream(task_) << posed;
  EXPECT_EQ(Json::parse(Declare("--between --max-boxes 2000 --json").text)["entries"], document["entries"]);
}

TEST_F(DeclareTest, BetweenBoundsAsManyStatesAndInputsAsATaskMayHave) {
  std::string states, inputs, rates;
  for (int i = 0; i < 16; ++i) {
    states += (i == 0 ? "x" : ", x") + std::to_string(i) + ": m";
    rates +=
        "    x" + std::to_string(i) + ": " + (i < 15 ? "x" + std::to_string(i + 1) : std::string("u0 - u7")) + "\n";
  }
  for (int i = 0; i < 8; ++i) inputs += (i == 0 ? "u" : ", u") + std::to_string(i) + ": m";
  std::ofstream(task_) << TaskFor("model:\n  states: {" + states + "}\n  inputs: {" + inputs +
                                      "}\n  parameters: {dt: 0.05}\n  integrator: rk4\n  rate:\n" + rates,
                                  16, 8, "x0, x1");
  EXPECT_THAT(Declare("--between"), Exits(0, "x0''       at most 1.05277 "));
}

TEST_F(DeclareTest, BetweenExcludesWhatBelongsToTheResidual) {
  for (const char* options : {"--between --cover cover.json", "--between --check cover.json", "--from positions"})
    EXPECT_EQ(Forereach("declare --config config/demo.yaml " + std::string(options) + " 2>&1").code, 2) << options;
  std::ofstream(task_) << Replaced(Read(FOREREACH_SOURCE_DIR "/tests/data/field.yaml"), "-0.36]", "-1.5]");
  EXPECT_THAT(Declare("--between"), Exits(1, "no finite bound on the motion between two samples"));
}

TEST_F(DeclareTest, StopsAtTheWorkLimitWithABoundAndSaysSo) {
  WriteTask("residual: {name: heading_saturation}\n");
  EXPECT_THAT(Declare("--max-boxes 20 --cover " + cover_), Exits(1, "stopped at a gap of"));
  EXPECT_THAT(Check(), Exits(0));
}

// Every residual there is, over a domain or parameters without a finite slope: a sentence, not a search without end.
TEST_F(DeclareTest, SaysWhereThereIsNoFiniteBound) {
  const std::string bicycle = Read(FOREREACH_SOURCE_DIR "/config/bicycle.yaml");
  const auto expect = [&](const std::string& text, std::initializer_list<const char*> words, const char* options = "") {
    std::ofstream(task_) << text;
    const Output output = Declare(std::string("--jobs 1 ") + options);
    EXPECT_EQ(output.code, 1) << output.text;
    for (const char* word : words) EXPECT_THAT(output.text, HasSubstr(word));
    EXPECT_EQ(std::count(output.text.begin(), output.text.end(), '\n'), 1) << output.text;
  };
  const std::string pole = std::regex_replace(bicycle, std::regex("0\\.48\\]"), "1.6]");
  const std::string words = "no finite bound for the slope of theta by v";
  for (const char* options : {"", "--json", "--max-boxes 100000000", "--gap 1e-12", "--max-boxes 5"})
    expect(pole, {words.c_str(), "delta in [", "heading_saturation", "domain", task_.c_str()}, options);
  EXPECT_FALSE(std::filesystem::exists(cover_));
  std::ofstream(task_) << pole;
  EXPECT_EQ(Declare("--cover " + cover_).code, 1);
  EXPECT_FALSE(std::filesystem::exists(cover_)) << "a cover without a bound proves nothing";
}

TEST_F(DeclareTest, ADomainWithoutAPointIsBadInput) {
  const std::string bicycle = Read(FOREREACH_SOURCE_DIR "/config/bicycle.yaml");
  std::ofstream(task_) << std::regex_replace(bicycle, std::regex("domain:\n"),
                                             "domain:\n  inequalities:\n    - {coefficients: {v: 1}, bound: -1}\n");
  EXPECT_THAT(Declare(), Exits(2, "no point of its box satisfies"));
}

TEST_F(DeclareTest, CoverIsConfirmed) {
  WriteTask("residual: {name: heading_saturation, gravity: [9.78, 9.84]}\n");
  EXPECT_EQ(Declare("--cover " + cover_).code, 0);
  EXPECT_THAT(Check(), Exits(0));
  EXPECT_EQ(Json::parse(Declare("--json --check " + cover_).text)["verdict"], "confirmed");
}

// Slopes, a pole and a cover of a text over the domain of the task, where v is in [0, 25].
TEST_F(DeclareTest, ATextIsBoundedAndItsCoverIsConfirmed) {
  WriteTask("residual: {parameters: {c: [0.1, 0.2]}, let: {drag: c*v*abs(v)}, add: {v: -dt*drag, a: 0.5*abs(jerk)}}\n");
  const Json document = Json::parse(Declare("--json --cover " + cover_).text);
  EXPECT_NEAR(document["lipschitz"][3][3], 0.1 * 0.2 * 2 * 25, 1e-6);
  EXPECT_EQ(document["lipschitz"][4][6], 0.5);
  EXPECT_EQ(document["residual"]["add"]["v"], "-dt*drag");
  EXPECT_EQ(document["residual"]["parameters"]["c"], Json::parse("[0.1, 0.2]"));
  EXPECT_THAT(Check(), Exits(0, "check: confirmed: 2 bounds of the residual"));
  Tamper([](Json& file) { file["entries"][1]["bound"] = file["entries"][1]["cover"] = 0.499; });
  Reseal();
  ExpectRefuted("a by jerk: a box's bound is");
  for (const char* other : {"c*v*v", "c*v*abs(a)"}) {
    WriteTask("residual: {parameters: {c: [0.1, 0.2]}, let: {drag: " + std::string(other) +
              "}, add: {v: -dt*drag, a: 0.5*abs(jerk)}}\n");
    ExpectRefuted("another domain, residual or parameters");
  }
  WriteTask("residual: {add: {v: log(v - 3)}}\n");
  EXPECT_THAT(Declare(), Exits(1, "no finite bound for the slope of v by v: the residual has none over v in ["));
}

TEST_F(DeclareTest, TamperedCoversAreRefused) {
  WriteTask("residual: {name: heading_saturation}\n");
  Declare("--cover " + cover_);
  const std::string whole = Read(cover_);
  const auto each_time = [&](const auto& change, const char* claim) {
    Tamper(change);
    ExpectRefuted("altered");
    Reseal();
    ExpectRefuted(claim);
    std::ofstream(cover_) << whole;
  };
  each_time([](Json& document) { document["entries"][0]["cover"].erase(3); }, "a part of the domain is missing");
  each_time([](Json& document) { document["entries"].erase(1); }, "theta by delta: stands 0 times");
  each_time([](Json& document) { document["entries"][1]["bound"] = 0.4; }, "above the declared");
  each_time([](Json& document) { document["entries"][0]["cover"] = 0.0119; }, "but the slope is");
  EXPECT_EQ(Check().code, 0);
}

TEST_F(DeclareTest, CoverOfAnotherTaskIsRefused) {
  WriteTask("residual: {name: heading_saturation}\n");
  Declare("--cover " + cover_);
  WriteTask("residual: {name: heading_saturation, understeer: 0.33}\n");
  ExpectRefuted("another domain, residual or parameters");
}

TEST_F(DeclareTest, BadInputExitsWithTwoAndOneLine) {
  const auto expect = [&](const std::string& residual, const char* text) {
    WriteTask(residual);
    const Output output = Declare();
    EXPECT_THAT(output, Exits(2, text)) << residual;
    EXPECT_EQ(std::count(output.text.begin(), output.text.end(), '\n'), 1) << output.text;
  };
  expect("", "residual: missing");
  expect(
      "residual: {name: velocity_knee}\n",
      "residual.name: the residual velocity_knee is for a model with the state px, which kinematic_bicycle does not");
  expect("residual: {name: heading_saturation, knee: 1}\n", "residual.knee: is for velocity_knee");
  expect("residual: {name: heading_saturation, mu: 1}\n", "residual.mu: unknown key");
  expect("residual: {name: heading_saturation, friction: [0.9, 0.8]}\n",
         "residual.friction[1]: 0.8 is outside [0.9, inf)");
  expect("residual: {name: heading_saturation, friction: [0.9]}\n", "residual.friction: has 1 entries");
  expect("residual: {name: heading_saturation, friction: [-1, 1]}\n", "residual.friction[0]: -1 is outside [0, inf)");
  EXPECT_EQ(Forereach("declare --config config/bicycle.yaml --check README.md 2>/dev/null").code, 2);
  EXPECT_EQ(Forereach("declare --config config/bicycle.yaml --gap 0 2>/dev/null").code, 2);
}

TEST(DeclareHelp, ShowsOptionsExitCodesAndAnExample) {
  const Output output = Forereach("declare --help");
  EXPECT_EQ(output.code, 0);
  for (const char* text :
       {"--check", "exit 0", "residual: {parameters:", "forereach declare --config config/bicycle.yaml"})
    EXPECT_THAT(output.text, HasSubstr(text));
}

}  // namespace forereach::declare_test
