// Models as text in task files: what they mean, and what is said of those that mean nothing.

#include <fmt/format.h>

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/expression.h"
#include "task/canonical.h"
#include "tests/task/task_files.h"

namespace forereach::model_text_test {

// In the place of the first line of the good task. Errors are asserted by line and column.
constexpr const char* kModel =
    "model:\n"                                               // 1
    "  states: {px: m, py: m, vx: m/s, vy: m/s}\n"           // 2
    "  inputs: {ax: m/s^2, ay: m/s^2}\n"                     // 3
    "  parameters: {dt: 0.15, drag: 0.5, mass: [1, 1.2]}\n"  // 4
    "  let:\n"                                               // 5
    "    half: dt*dt/2\n"                                    // 6
    "    loss: drag/mass\n"                                  // 7
    "  next:\n"                                              // 8
    "    px: px + dt*vx + half*ax\n"                         // 9
    "    py: py + dt*vy + half*ay\n"                         // 10
    "    vx: vx + dt*(ax - loss*vx)\n"                       // 11
    "    vy: vy + dt*(ay - loss*vy)\n";                      // 12

std::string WithoutModel() {
  const std::string task = kTask;
  return task.substr(task.find('\n') + 1);
}

struct ModelTextTest : testing::Test {
  std::string Error(const std::string& model) const { return files_.Error(model + WithoutModel()); }
  std::string ErrorWith(const std::string& from, const std::string& to) const {
    return Error(Replaced(kModel, from, to));
  }
  Config Load(const std::string& model) const { return files_.Load(model + WithoutModel()); }

  TaskFiles files_;
};

TEST_F(ModelTextTest, SaysWhatTheModelIs) {
  const Config config = Load(kModel);
  const NominalModel& model = *config.problem->model;
  EXPECT_EQ(model.state_names(), (std::vector<std::string>{"px", "py", "vx", "vy"}));
  EXPECT_EQ(model.input_names(), (std::vector<std::string>{"ax", "ay"}));
  EXPECT_EQ(model.parameter_names(), (std::vector<std::string>{"dt", "drag", "mass"}));
  EXPECT_FIELDS(config, (period, 0.15), (gate.longest_step_ms, 150));
  ASSERT_NE(model.text(), nullptr);
  const ModelText& text = *model.text();
  EXPECT_FIELDS(
      text, (states[2], (ModelText::Variable{"vx", "m/s"})), (parameters[2], (ModelText::Parameter{"mass", 1, 1.2})),
      (definitions[1], (ModelText::Definition{"loss", {"drag/mass", 7, 11}})),
      (equations[3], (ExpressionText{"vy + dt*(ay - loss*vy)", 12, 9})), (integrator, ModelText::Integrator::kNone));
}

TEST_F(ModelTextTest, EquationsAreInTheOrderOfTheStates) {
  const std::string other =
      Replaced(Replaced(kModel, "    px: px + dt*vx + half*ax\n", ""), "    vy: vy + dt*(ay - loss*vy)\n",
               "    vy: vy + dt*(ay - loss*vy)\n    px: px + dt*vx + half*ax\n");
  EXPECT_EQ(Load(other).grounds.model, Load(kModel).grounds.model);
}

TEST_F(ModelTextTest, TheDigestIsOfWhatTheTextMeans) {
  const Digest digest = Load(kModel).grounds.model;
  for (const auto& [from, to] : {std::pair{"{dt: 0.15,", "{dt: 1.5e-1,"},
                                 {"    half: dt*dt/2\n", "    # a comment\n    half: dt*dt/2\n"},
                                 {"px: px + dt*vx", "px: px  +  dt * vx"}})
    EXPECT_EQ(Load(Replaced(kModel, from, to)).grounds.model, digest) << to;
  for (const auto& [from, to] : {std::pair{"{dt: 0.15,", "{dt: 0.2,"},
                                 {"mass: [1, 1.2]", "mass: [1, 1.3]"},
                                 {"dt*dt/2", "dt*dt/3"},
                                 {"vx + dt*(ax", "vx - dt*(ax"}})
    EXPECT_NE(Load(Replaced(kModel, from, to)).grounds.model, digest) << to;
}

TEST_F(ModelTextTest, RatesNeedAnIntegrator) {
  const std::string rates = Replaced(std::string(kModel).substr(0, std::string(kModel).find("  next:")), "  let:\n",
                                     "  integrator: rk4\n  let:\n") +
                            "  rate: {px: vx, py: vy, vx: ax - loss*vx, vy: ay}\n";
  EXPECT_EQ(Load(rates).problem->model->text()->integrator, ModelText::Integrator::kRk4);
  EXPECT_EQ(Load(Replaced(rates, "rk4", "midpoint")).problem->model->text()->integrator,
            ModelText::Integrator::kMidpoint);
  EXPECT_EQ(Load(Replaced(rates, "rk4", "euler")).problem->model->text()->integrator, ModelText::Integrator::kEuler);
  EXPECT_EQ(Error(Replaced(rates, "rk4", "rk5")), "5: model.integrator: rk5 is not known; did you mean rk4?");
  EXPECT_EQ(Error(Replaced(rates, "  integrator: rk4\n", "")),
            "2: model.integrator: missing: how the rates give the next state, one of euler, midpoint, rk4");
  EXPECT_EQ(Error(std::string(kModel) + "  integrator: rk4\n"),
            "13: model.integrator: is for model.rate; model.next is the next state itself");
  EXPECT_EQ(Error(std::string(kModel) + "  rate: {px: 1}\n  integrator: rk4\n"),
            "2: model: has both next and rate; delete one of them");
}

TEST_F(ModelTextTest, ErrorsInExpressionsNameLineAndColumn) {
  EXPECT_EQ(ErrorWith("vx + dt*(ax", "vx + dt*(axx"), "11:18: axx is not a name that is known here; did you mean ax?");
  EXPECT_EQ(ErrorWith("dt*dt/2", "dtt*dt/2"), "6:11: dtt is not a name that is known here; did you mean dt?");
  EXPECT_EQ(ErrorWith("vx + dt*(ax - loss*vx)", "vx + dt*sn(ax)"), "11:17: sn is not a function; did you mean sin?");
  EXPECT_EQ(ErrorWith("vx + dt*(ax - loss*vx)", "vx + dt*sin(ax, vx)"), "11:17: sin has more arguments, has to have 1");
  EXPECT_EQ(ErrorWith("vx + dt*(ax - loss*vx)", "vx + dt*(ax"), "11:17: ( has no )");
  // A definition is known behind it only.
  EXPECT_EQ(ErrorWith("half: dt*dt/2", "half: loss"),
            "6:11: loss is not a name that is known here; did you mean mass?");
  EXPECT_EQ(
      ErrorWith("half: dt*dt/2", "half: acceleration"),
      "6:11: acceleration is not a name that is known here; known here: px, py, vx, vy, ax, ay, dt, drag, mass, pi");
}

// A hostile file costs neither minutes nor a message of its own size.
TEST_F(ModelTextTest, AnUnknownNameAmongManyIsAnsweredInShort) {
  std::string parameters = "drag: 0.5";
  for (int i = 0; i < 900; ++i) parameters += ", " + std::string(60, 'p') + std::to_string(i) + ": 1";
  const std::string model = Replaced(kModel, "drag: 0.5", parameters);
  const std::string error = Error(Replaced(model, "dt*dt/2", std::string(60000, 'z')));
  EXPECT_THAT(error, AllOf(StartsWith("6:11: " + std::string(60, 'z') + "... is not a name that is known"),
                           HasSubstr("known here: px, py, vx, vy, ax, ay, dt, drag, "), HasSubstr(" more")));
  EXPECT_LT(error.size(), 8000u);
  EXPECT_THAT(Error(Replaced(model, "dt*dt/2", std::string(61, 'p') + "17")),
              HasSubstr("did you mean " + std::string(60, 'p') + "17?"));
}

TEST_F(ModelTextTest, PlacesAreRightHoweverYamlWritesAText) {
  const std::string line = "    vx: vx + dt*(ax - loss*vx)\n";
  const auto error = [&](const std::string& other) { return ErrorWith(line, other); };
  EXPECT_EQ(error("    vx: \"vx + dtt\"\n"), "11:15: dtt is not a name that is known here; did you mean dt?");
  EXPECT_EQ(error("    vx: 'vx + dtt'\n"), "11:15: dtt is not a name that is known here; did you mean dt?");
  EXPECT_EQ(error("    vx: vx\n      + dtt\n"), "12:9: dtt is not a name that is known here; did you mean dt?");
  EXPECT_EQ(error("    vx: |\n      vx\n        + dtt\n"),
            "13:11: dtt is not a name that is known here; did you mean dt?");
  EXPECT_EQ(error("    vx: >-\n      vx +\n\n      dtt\n"),
            "14:7: dtt is not a name that is known here; did you mean dt?");
  EXPECT_EQ(error("    vx: |\n      vx +\n"), "12:11: expected a number, a name or (, found the end");
  // Behind an escape the place of the whole text is given.
  EXPECT_EQ(error("    vx: \"vx\\t+ dtt\"\n"), "11:14: dtt is not a name that is known here; did you mean dt?");
  EXPECT_EQ(error("    vx: 0\n"), "");
  EXPECT_EQ(error("    vx: |\n      vx\n        + dt*(\n        ax)\n"), "");
}

// Definitions that only a residual uses need no derivatives.
TEST_F(ModelTextTest, FunctionsForResidualsAreRefusedWithTheirPlace) {
  const std::string soft = "    soft: vx + softplus(vx, 0.1)\n    half: dt*dt/2\n";
  const std::string model = Replaced(kModel, "    half: dt*dt/2\n", soft);
  EXPECT_EQ(files_.Error(model + WithoutModel() + "residual: {add: {vx: 0.01*soft}}\n"), "");
  EXPECT_EQ(Error(Replaced(model, "half: dt*dt/2\n", "half: dt*dt/2 + 0*soft\n")),
            "6:16: softplus and smooth_gate are for residuals and the planner's laws: the model, limits and places "
            "need derivatives");
}

TEST_F(ModelTextTest, ACommaInsideBracesEndsAnExpression) {
  const std::string next = "  next:\n    px: px + dt*vx + half*ax\n";
  const std::string flow = std::string(kModel).substr(0, std::string(kModel).find("  next:"));
  EXPECT_EQ(Error(flow + "  next: {px: hypot(px, vx), py: py, vx: vx, vy: vy}\n"),
            "8: model.next.vx): unknown key; put an expression with a comma inside { } into quotes; did you mean vx?");
  EXPECT_EQ(Error(flow + "  next: {px: \"hypot(px, vx)\", py: py, vx: vx, vy: vy}\n"), "");
}

TEST_F(ModelTextTest, RefusesNamesThatAreNoNamesOrAreTaken) {
  EXPECT_EQ(ErrorWith("{px: m,", "{p-x: m,"),
            "2: model.states.p-x: is not a name; a name has letters, digits and underscores, and does not begin with a "
            "digit");
  EXPECT_EQ(ErrorWith("drag: 0.5", "sin: 0.5"),
            "4: model.parameters.sin: sin is a function of the language; choose another name");
  EXPECT_EQ(ErrorWith("drag: 0.5", "pi: 3"),
            "4: model.parameters.pi: pi is a number of the language; choose another name");
  EXPECT_EQ(ErrorWith("drag: 0.5", "px: 0.5"),
            "4: model.parameters.px: is a name of model.states already; choose another name");
  EXPECT_EQ(ErrorWith("{ax: m/s^2, ay", "{vx: m/s^2, ay"),
            "3: model.inputs.vx: is a name of model.states already; choose another name");
  EXPECT_EQ(ErrorWith("    half: dt*dt/2", "    drag: dt*dt/2"),
            "6: model.let.drag: is a name of model.parameters already; choose another name");
  EXPECT_EQ(ErrorWith("{ax: m/s^2, ay", "{px_next: m/s^2, ay"),
            "3: model.inputs.px_next: is the column of the state px after a step; choose another name");
  EXPECT_EQ(ErrorWith("{px: m,", "{px: m, px: m,"),
            "2: model.states.px: duplicate key, first in line 2; delete one of them");
  const std::string longest(64, 'a');
  EXPECT_EQ(ErrorWith("drag: 0.5", "drag: 0.5, " + longest + ": 1"), "");
  EXPECT_EQ(ErrorWith("drag: 0.5", "drag: 0.5, a" + longest + ": 1"),
            "4: model.parameters." + longest + ": ...: the name has 65 letters, at most 64 are allowed");
}

// They are written into headers and new tasks, as comments.
TEST_F(ModelTextTest, UnitsAreOneShortLine) {
  const std::string error = "2: model.states.px: a unit has at most 64 bytes and no control characters";
  EXPECT_EQ(ErrorWith("px: m,", "px: \"m\\nx\","), error);
  EXPECT_EQ(ErrorWith("px: m,", "px: \"m\\r\","), error);
  EXPECT_EQ(ErrorWith("px: m,", "px: " + std::string(65, 'm') + ","), error);
  EXPECT_EQ(ErrorWith("px: m,", "px: " + std::string(64, 'm') + ","), "");
  EXPECT_EQ(ErrorWith("px: m,", "px: \"\u00b0/s\","), "");
}

// Each is read again for every law and limit that may use it.
TEST_F(ModelTextTest, ExpressionsAreBoundedInAll) {
  const auto with = [&](std::size_t definitions) {
    std::string one = "px", text = "    half: dt*dt/2\n";
    while (one.size() + 3 <= kLargestExpression) one += "+px";
    for (std::size_t i = 0; i < definitions; ++i) text += "    d" + std::to_string(i) + ": " + one + "\n";
    return ErrorWith("    half: dt*dt/2\n", text);
  };
  constexpr std::size_t kMost = kLargestExpressions / kLargestExpression;
  EXPECT_EQ(with(kMost - 1), "");
  EXPECT_THAT(with(kMost + 1),
              AllOf(StartsWith("23: model.let.d16: the expressions of this file, up to this one, have "),
                    HasSubstr(" bytes, at most 1048576 are allowed")));
}

TEST_F(ModelTextTest, EachStateHasItsEquation) {
  EXPECT_EQ(ErrorWith("    vx: vx + dt*(ax - loss*vx)\n", ""),
            "9: model.next.vx: missing: each state needs its equation");
  EXPECT_EQ(ErrorWith("    vx: vx +", "    vz: vx +"), "11: model.next.vz: unknown key; did you mean vx?");
  EXPECT_EQ(ErrorWith("    vx: vx + dt*(ax - loss*vx)\n", "    vx: [1, 2]\n"),
            "11: model.next.vx: a list is not an expression");
  EXPECT_THAT(ErrorWith("    vx: vx + dt*(ax - loss*vx)\n", "    vx:\n"),
              HasSubstr("model.next.vx: nothing is not an expression"));
}

TEST_F(ModelTextTest, NamesARequiredKeyThatIsMissing) {
  EXPECT_EQ(ErrorWith("dt: 0.15, ", ""), "4: model.parameters.dt: missing: the step of the model, in s");
  EXPECT_EQ(ErrorWith("  parameters: {dt: 0.15, drag: 0.5, mass: [1, 1.2]}\n", ""),
            "2: model.parameters.dt: missing: the step of the model, in s");
  EXPECT_EQ(ErrorWith("  inputs: {ax: m/s^2, ay: m/s^2}\n", ""),
            "2: model.inputs: missing: a model as text needs this key");
  EXPECT_EQ(ErrorWith("{ax: m/s^2, ay: m/s^2}", "{}"), "3: model.inputs: has 0 entries, which is outside [1, 8]");
  EXPECT_EQ(Error("model: {dt: 0.15}\n"), "1: model: has no model: write name, file, or states with their equations");
  EXPECT_EQ(Error("model: {name: point_mass}\n"), "1: model.dt: missing: The time from one control to the next.");
}

TEST_F(ModelTextTest, TheStepIsOneNumberInItsRange) {
  const auto error = [&](const std::string& step) { return ErrorWith("dt: 0.15", "dt: " + step); };
  EXPECT_EQ(error("60"), "");
  EXPECT_EQ(error("60.001"), "4: model.parameters.dt: 60.001 is outside (0, 60], its unit is s");
  EXPECT_EQ(error("1e-300"), "");
  EXPECT_EQ(error("0"), "4: model.parameters.dt: 0 is outside (0, 60], its unit is s");
  EXPECT_EQ(error("-0.1"), "4: model.parameters.dt: -0.1 is outside (0, 60], its unit is s");
  EXPECT_EQ(error("[0.1, 0.2]"), "4: model.parameters.dt: is a list, has to be one number: the step is exact");
}

TEST_F(ModelTextTest, ParametersAreNumbersOrRanges) {
  const auto error = [&](const std::string& mass) { return ErrorWith("mass: [1, 1.2]", "mass: " + mass); };
  EXPECT_EQ(error("[1, 1]"), "");
  EXPECT_EQ(error("[1, 0.9]"), "4: model.parameters.mass[1]: 0.9 is outside [1, inf), below model.parameters.mass[0]");
  EXPECT_EQ(error("[1, 2, 3]"), "4: model.parameters.mass: has 3 entries, which is outside [2, 2]");
  EXPECT_EQ(error(".inf"), "4: model.parameters.mass: .inf is not a finite number; write a number in (-inf, inf)");
  EXPECT_EQ(error("heavy"), "4: model.parameters.mass: heavy is not a number; write a number in (-inf, inf)");
}

std::string ManyStates(int count) {
  std::string states, next;
  for (int k = 0; k < count; ++k) {
    const std::string name = "s" + std::to_string(k), comma = k == 0 ? "" : ", ";
    states += comma + name + ": m";
    next += comma + name + ": " + name + " + u";
  }
  return "model: {states: {" + states + "}, inputs: {u: m}, parameters: {dt: 0.1}, next: {" + next + "}}\n";
}

TEST_F(ModelTextTest, AtMostSixteenStates) {
  EXPECT_THAT(Error(ManyStates(16)), HasSubstr("domain.state.lower: has 4 entries, has to have 16"));
  EXPECT_EQ(Error(ManyStates(17)), "1: model.states: has 17 entries, which is outside [1, 16]");
}

TEST_F(ModelTextTest, RefusesKeysOfTwoFormsOfAModel) {
  EXPECT_EQ(Error(std::string(kModel) + "  dt: 0.15\n"), "13: model.dt: is model.parameters.dt of a model as text");
  EXPECT_EQ(Error(std::string(kModel) + "  name: point_mass\n  dt: 0.15\n"),
            "2: model.states: is for a model as text, this one has a name");
  EXPECT_EQ(Error(std::string(kModel) + "  wheelbase: 1\n"), "13: model.wheelbase: is for kinematic_bicycle");
  EXPECT_EQ(Error("model: {file: drag.yaml, states: {x: m}}\n"),
            "1: model.states: stands in the model file, not beside its name");
}

struct ModelFileTest : ModelTextTest {
  ModelFileTest() { files_.directory().Write("drag.yaml", kModel); }
};

TEST_F(ModelFileTest, GivesTheSameModelAsTheTaskWithItsText) {
  const Config here = Load(kModel), included = Load("model: {file: drag.yaml}\n");
  EXPECT_FIELDS(included, (problem->model->text()->equations, here.problem->model->text()->equations),
                (problem->model->text()->name, "drag"), (period, 0.15));
}

TEST_F(ModelFileTest, TheTaskReplacesParameters) {
  const Config config = Load("model: {file: drag.yaml, parameters: {dt: 0.2, mass: 2, drag: [0, 1]}}\n");
  EXPECT_EQ(config.period, 0.2);
  const std::vector<ModelText::Parameter> expected{{"dt", 0.2, 0.2}, {"drag", 0, 1}, {"mass", 2, 2}};
  EXPECT_EQ(config.problem->model->text()->parameters, expected);
  EXPECT_EQ(Error("model: {file: drag.yaml, parameters: {mas: 2}}\n"),
            "1: model.parameters.mas: is not a parameter of drag.yaml; did you mean mass?");
  EXPECT_EQ(Error("model: {file: drag.yaml, parameters: {dt: 61}}\n"),
            "1: model.parameters.dt: 61 is outside (0, 60], its unit is s");
}

TEST_F(ModelFileTest, ChangesTheDigestOfTheTaskWithItsBytes) {
  const std::string task = "model: {file: drag.yaml}\n" + WithoutModel();
  const Digest digest = files_.Load(task).grounds.config;
  EXPECT_EQ(digest, TaskDigest(task, kModel));
  files_.directory().Write("drag.yaml", std::string(kModel) + "# a comment\n");
  EXPECT_NE(files_.Load(task).grounds.config, digest);
}

TEST_F(ModelFileTest, ErrorsNameTheFileThatIsWrong) {
  const std::string path = files_.directory() / "", directory = path.substr(0, path.size() - 1);
  EXPECT_THAT(
      Error("model: {file: drg.yaml}\n"),
      AllOf(StartsWith("1: model.file: drg.yaml is not in " + directory + " nor in /"),
            HasSubstr("/share/forereach/config (which does not exist)"), HasSubstr("; did you mean drag.yaml?")));
  files_.directory().Write("drag.yaml", Replaced(kModel, "vx + dt*(ax", "vx + dt*(axx"));
  EXPECT_EQ(Error("model: {file: drag.yaml}\n"),
            "drag.yaml:11:18: axx is not a name that is known here; did you mean ax?");
  files_.directory().Write("drag.yaml", "model: {file: drag.yaml}\n");
  EXPECT_EQ(Error("model: {file: drag.yaml}\n"),
            "drag.yaml:1: model.file: unknown key; known here: states, inputs, parameters, let, next, rate, "
            "integrator, angles");
  files_.directory().Write("drag.yaml", std::string(kModel) + "domain: {}\n");
  EXPECT_EQ(Error("model: {file: drag.yaml}\n"), "drag.yaml:13: domain: unknown key; known here: model");
}

TEST_F(ModelFileTest, AnotherFileCanBeReadInstead) {
  const std::string task = files_.directory().Write("task.yaml", "model: {file: gone.yaml}\n" + WithoutModel());
  files_.directory().Write("steps.csv", kTransitions);
  const Config config = LoadConfig(task, NamedFiles{{}, {}, files_.directory() / "drag.yaml"});
  EXPECT_EQ(config.problem->model->text()->name, "gone");
}

// A unicycle in the plane; `more` are further lines of the model.
std::string Turning(const std::string& more, const std::string& projection = "x, y") {
  return TaskFor(
      "model:\n"                                                                                          // 1
      "  states: {x: m, y: m, theta: rad, v: m/s}\n"                                                      // 2
      "  inputs: {a: m/s^2, omega: rad/s}\n"                                                              // 3
      "  parameters: {dt: 0.1}\n"                                                                         // 4
      "  next: {x: x + dt*v*cos(theta), y: y + dt*v*sin(theta), theta: theta + dt*omega, v: v + dt*a}\n"  // 5
          + more,                                                                                         // 6
      4, 2, projection);
}

constexpr const char* kNoTurn =
    "x,y,theta,v,a,omega,x_next,y_next,theta_next,v_next\n"
    "0,0,0,0,0,0,0,0,0,0\n";
constexpr const char* kTurns =
    "x,y,theta,v,a,omega,x_next,y_next,theta_next,v_next\n"
    "0,0,0,0,0,0,0,0,-6.2,0\n"
    "0,0,0.5,0,0,0,0,0,13,0\n";

struct AnglesTest : testing::Test {
  std::string Error(const std::string& task, const std::string& steps = kNoTurn) const {
    return files_.Error(task, steps);
  }
  TaskFiles files_;
};

TEST_F(AnglesTest, AreStatesThatTheEquationsDoNotTellApart) {
  const Config config = files_.Load(Turning("  angles: [theta]\n"), kTurns), none = files_.Load(Turning(""), kNoTurn);
  EXPECT_EQ(config.problem->model->angles(), std::vector<int>{2});
  EXPECT_TRUE(none.problem->model->angles().empty());
  EXPECT_NE(config.grounds.model, none.grounds.model);
  EXPECT_EQ(files_.Load(Turning("  angles: []\n"), kNoTurn).grounds.model, none.grounds.model);
  EXPECT_EQ(Error(Turning("  angles: [thetta]\n")),
            "6: model.angles[0]: thetta is not a coordinate; did you mean theta?");
  EXPECT_THAT(Error(Turning("  angles: [v]\n")),
              StartsWith("5:13: angles: v: the equation of x is not seen to be the same after a turn of it by 2 pi"));
  EXPECT_THAT(Error(Turning("  angles: [omega]\n")), HasSubstr("model.angles[0]: omega is not a coordinate"));
}

TEST_F(AnglesTest, AreNotCoordinatesOfObstacles) {
  EXPECT_EQ(
      Error(Turning("  angles: [theta, x]\n")),
      "14: task.projection: depends on x, which is one of model.angles: how often an angle has turned is not known");
}

TEST_F(AnglesTest, RegionsBoundMoreThanSlopesOnlyWhereTheDomainHasLessThanATurn) {
  const auto with = [](const std::string& upper, const std::string& says) {
    const std::string task = Replaced(Turning("  angles: [theta]\n"), "[1, 1, 1, 1]", "[1, 1, " + upper + ", 1]");
    return Replaced(task, "}\ntransitions", ", regions: [{in: {theta: [0, 1]}, " + says + "}]}\ntransitions");
  };
  for (const std::string key : {"disturbance", "noise_bound", "bound"}) {
    EXPECT_EQ(Error(with("5.2831853", key + ": {v: 0}")), "");
    EXPECT_EQ(Error(with("5.2831854", key + ": {v: 0}")),
              "10: declaration.regions: regions[0]." + key +
                  " is bounded by theta, an angle, of which the domain has [-1, 5.2831854], must be less than a turn: "
                  "another number may be the same configuration");
  }
  EXPECT_EQ(Error(with("100", "lipschitz: {v: {}}")), "");
}

TEST_F(AnglesTest, ALimitIsTheSameAfterATurn) {
  const auto with = [](const std::string& that) {
    return Turning("  angles: [theta]\n") + "  limits: [{name: wall, that: " + that + ", at_most: 2}]\n";
  };
  EXPECT_EQ(Error(with("v*cos(theta)")), "");
  EXPECT_EQ(Error(with("x + theta")),
            "17:31: limits: wall is not seen to be the same after a turn of the angle theta by 2 pi: write it with "
            "sin, cos or tan of it");
}

// Slopes by place tie px to the other states, so the slack may not hold its axis.
TEST(RegionsByPlace, GiveNoWiderTubeWherePlaceIsAStateOfItsOwn) {
  std::string steps = "px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n";
  for (int i = 0; i < 60; ++i) {
    const double px = -2 + i / 6.0, vx = i % 7 * 0.4, vy = i % 5 * 0.4 - 0.8;
    const double r = -0.25 * std::min(px, 0.7 + 0.3 * px) + 0.02 * std::sin(3 * px);
    steps += fmt::format("{},0,{},{},0,0,{},{},{},{}\n", px, vx, vy, px + 0.15 * vx, 0.15 * vy, 0.9 * vx - 0.4 * vy + r,
                         0.9 * vy + 0.4 * vx + r / 2);
  }
  const auto half_width = [&](const std::string& projection) {
    const TaskFiles files;
    const Config config = files.Load(
        "model:\n  states: {px: m, py: m, vx: m/s, vy: m/s}\n  inputs: {ax: m/s^2, ay: m/s^2}\n  parameters: {dt: "
        "0.15}\n"
        "  next:\n    px: px + dt*vx\n    py: py + dt*vy\n    vx: 0.9*vx - 0.4*vy + dt*ax\n    vy: 0.9*vy + 0.4*vx + "
        "dt*ay\n"
        "domain:\n  state: {lower: [-200, -20, -15, -15], upper: [200, 20, 15, 15]}\n"
        "  input: {lower: [-3, -3], upper: [3, 3]}\n"
        "declaration:\n  lipschitz: {vx: {px: 0.4}, vy: {px: 0.2}}\n  noise_bound: [0.01, 0, 0.0001, 0.0001]\n  "
        "regions:\n"
        "    - {in: {px: [-200, 1]}, lipschitz: {vx: {px: 0.3101}, vy: {px: 0.1551}}}\n"
        "    - {in: {px: [1, 200]}, lipschitz: {vx: {px: 0.1351}, vy: {px: 0.06755}}}\n"
        "transitions: steps.csv\ntask:\n"
        "  initial_set: {center: [0, 0, 2, 0.1], half_width: [0.005, 0.005, 0.001, 0.001]}\n  projection: " +
            projection + "\n  obstacles: []\n  between: samples\n",
        steps);
    Tube tube;
    const std::array<double, 24> controls{};
    const Certifier certifier(config.problem);
    EXPECT_FALSE(certifier.violation());
    const Zonotope initial_set = Zonotope::Enclose(config.initial_set);
    static_cast<void>(certifier.Certify({controls.data(), 2, 12, 2}, initial_set, {}, tube));
    EXPECT_EQ(tube.length(), 12);
    return tube.half_width(tube.length())[0];
  };
  EXPECT_LE(half_width("[px, py]"), 1.001 * half_width("[[1, 0, 0, 0], [1e-12, 1, 0, 0]]"));
}

// The line of the file, not the row from 0.
TEST(NoNominalValue, NamesFileLineAndState) {
  const TaskFiles files;
  const std::string steps = "x,u,x_next\n0.5,0,0\n0,0,0\n";
  for (const char* next : {"x + log(x)", "x + 1/x", "sqrt(x - 0.1)"})
    EXPECT_THAT(files.Error(TaskFor("model: {states: {x: m}, inputs: {u: m}, parameters: {dt: 0.1}, next: {x: " +
                                        std::string(next) + "}}\n",
                                    1, 1, "x"),
                            steps),
                StartsWith("steps.csv:3: x: the nominal model has no finite value there; "))
        << next;
}

// The simulated robot wraps its angles, so another residual would jump, unless the domain is within a turn.
TEST_F(AnglesTest, AResidualIsTheSameAfterATurn) {
  for (const std::string before : {"residual: {", "robot: {residual: {"}) {
    const auto with = [&](const std::string& value) {
      return Turning("  angles: [theta]\n") + before + "add: {v: " + value + "}}" + (before[1] == 'o' ? "}" : "") +
             "\n";
    };
    EXPECT_EQ(Error(with("0.1*theta")), "");
    const auto beyond = [&](const std::string& value, const char* most) {
      return Replaced(with(value), "upper: [1, 1, 1, 1]", std::string("upper: [1, 1, ") + most + ", 1]");
    };
    EXPECT_EQ(Error(beyond("0.1*theta", "3.14")), "");
    EXPECT_EQ(Error(beyond("0.1*sin(theta)", "3.15")), "");
    EXPECT_THAT(Error(beyond("0.1*theta", "3.15")),
                MatchesRegex("17:[0-9]+: the residual of v is not seen to be the same after a turn of the angle theta "
                             "by 2 pi: write it with sin, cos or tan of it"));
  }
}

TEST_F(AnglesTest, APlaceOfTheBodyIsTheSameAfterATurn) {
  const auto with = [](const std::string& place) {
    return Replaced(Turning("  angles: [theta]\n"), "  projection: [x, y]\n",
                    "  body: {parts: [{disc: {place: [x, \"" + place + "\"], radius: 0.1}}]}\n");
  };
  EXPECT_EQ(Error(with("y + sin(theta)")), "");
  EXPECT_EQ(Error(with("y + theta")),
            "14:38: body: the place y + theta is not seen to be the same after a turn of the angle theta by 2 pi: "
            "write it with sin, cos or tan of it");
}

TEST_F(AnglesTest, ATransitionWhoseTurnsCannotBeToldIsRefusedWithItsLine) {
  EXPECT_EQ(Error(Turning("  angles: [theta]\n"), std::string(kTurns) + "0,0,0,0,0,0,0,0,2,0\n"),
            "steps.csv:4: transition 2: theta is 2 rad away from the nominal model's next value, up to whole turns, "
            "which is more than pi/2: how often it has turned cannot be told");
}

TEST_F(AnglesTest, ACompiledModelTakesAnglesToo) {
  const auto task = [](const std::string& model) { return TaskFor(model, 6, 2, "x, y"); };
  const std::string columns =
      "x,y,theta,v,a,delta,jerk,steer_rate,x_next,y_next,theta_next,v_next,a_next,delta_next\n0,0,0,0,0,0,0,0,0,0,-6.2,"
      "0,0,0\n";
  const auto model = [](const std::string& angles) {
    return "model: {name: kinematic_bicycle, dt: 0.1, wheelbase: 2, angles: [" + angles + "]}\n";
  };
  EXPECT_EQ(files_.Load(task(model("theta")), columns).problem->model->angles(), std::vector<int>{2});
  EXPECT_EQ(Error(task(model("teta")), columns), "1: model.angles: teta is no state; did you mean theta?");
  EXPECT_THAT(Error(task(model("v")), columns), HasSubstr("angles: v: the equation of x"));
  EXPECT_EQ(Error(TaskFor("model: {name: point_mass, dt: 0.1, angles: [px]}\n", 4, 2, "px, py")),
            "1: model.angles: no state of point_mass is an angle");
}

TEST_F(AnglesTest, OfAModelFileMayBeReplaced) {
  files_.directory().Write(
      "model.yaml",
      "model:\n  states: {x: m, y: m, theta: rad}\n  inputs: {u: rad/s}\n  parameters: {dt: 0.1}\n"
      "  next: {x: x + dt*cos(theta), y: y + dt*sin(theta), theta: theta + dt*u}\n  angles: [theta]\n");
  const std::string steps = "x,y,theta,u,x_next,y_next,theta_next\n0,0,0,0,0,0,0\n";
  const auto load = [&](const std::string& more) {
    return files_.Load(TaskFor("model: {file: model.yaml" + more + "}\n", 3, 1, "x, y"), steps);
  };
  EXPECT_EQ(load("").problem->model->angles(), std::vector<int>{2});
  EXPECT_TRUE(load(", angles: []").problem->model->angles().empty());
  EXPECT_THAT(Error(TaskFor("model: {file: model.yaml, angles: [u]}\n", 3, 1, "x, y"), steps),
              HasSubstr("1: model.angles: u is no state"));
}

}  // namespace forereach::model_text_test
