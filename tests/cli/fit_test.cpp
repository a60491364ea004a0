// `forereach fit`: what it prints goes into a task file, and what cannot be fitted is refused.

#include "forereach/dynamics/model.h"
#include "tests/cli/program.h"
#include "tests/task/task_files.h"

namespace forereach::fit_test {

using Json = nlohmann::json;

struct FitCommandTest : testing::Test {
  // x+ = 0.5 x + 0.25 u, without noise.
  FitCommandTest() {
    scratch_.Write("task.yaml", TaskFor("model:\n"
                                        "  states: {x: m, y: m}\n"
                                        "  inputs: {u: m}\n"
                                        "  parameters: {dt: 0.1, decay: 1, gain: [0, 1]}\n"
                                        "  next: {x: decay*x + gain*u, y: y}\n",
                                        2, 1, "x, y"));
    std::ostringstream rows("x,y,u,x_next,y_next\n", std::ios::ate);
    for (int i = 0; i < 20; ++i) {
      const double x = i % 5 / 8.0, u = i % 7 / 8.0;
      rows << x << ",0," << u << "," << 0.5 * x + 0.25 * u << ",0\n";
    }
    scratch_.Write("steps.csv", rows.str());
  }
  Output Fit(const std::string& options) const { return Forereach("fit --config " + task_ + " " + options + " 2>&1"); }

  ScratchDirectory scratch_;
  const std::string task_ = scratch_ / "task.yaml";
};

TEST_F(FitCommandTest, ItsLineGoesIntoATaskFile) {
  const std::string picture = scratch_ / "errors.svg";
  EXPECT_THAT(Fit("--picture " + picture), Exits(0, "model:\n  parameters: {decay: 0.5, gain: 0.25}"));
  EXPECT_THAT(Read(picture), HasSubstr("<svg"));
  const Json document = Json::parse(Fit("--json").text);
  EXPECT_TRUE(document["converged"]);
  EXPECT_EQ(document["parameters"][1]["before"], 0.5) << "the middle of its range";
  EXPECT_LT(document["states"][0]["rms_after"], 1e-9);
  EXPECT_EQ(document["states"][1]["rms_before"], 0);
}

// A heading that is wrapped at pi: every tool names the key, and none estimates from a jump of a turn.
struct WrappedHeading : testing::Test {
  // @param jump of the wrapped step in th; its unit.
  void Write(double jump, const std::string& unit, const std::string& angles = "") const {
    scratch_.Write("task.yaml", TaskFor("model:\n"
                                        "  states: {th: " +
                                            unit +
                                            ", w: rad/s}\n"
                                            "  inputs: {a: rad/s^2}\n"
                                            "  parameters: {dt: 0.1, g: 0.5}\n"
                                            "  next: {th: th + dt*w, w: w + g*dt*a}\n" +
                                            angles,
                                        2, 1, "w"));
    std::string task = Read(task_);
    for (const auto& [from, to] : {std::pair{"-1, -1", "-9, -9"}, {"1, 1", "9, 9"}}) task = Replaced(task, from, to);
    scratch_.Write("task.yaml", task);
    std::ostringstream rows("th,w,a,th_next,w_next\n", std::ios::ate);
    for (int i = 0; i < 40; ++i) {
      const double th = 0.01 * (i % 7), w = 0.1 * (i % 5), a = i % 2 == 0 ? 0.5 : -0.5;
      rows << th << "," << w << "," << a << "," << th + 0.1 * w + (i == 11 ? jump : 0) << "," << w + 0.1 * a << "\n";
    }
    scratch_.Write("steps.csv", rows.str());
  }
  [[nodiscard]] std::vector<std::string> Tools() const {
    std::vector<std::string> outputs;
    for (const char* tool : {"check ", "fit ", "declare --from-data ", "declare --from-data --hold-out --blocks 4 "})
      outputs.push_back(Forereach(tool + task_ + " 2>&1").text);
    return outputs;
  }

  const ScratchDirectory scratch_;
  const std::string task_ = scratch_ / "task.yaml";
};

TEST_F(WrappedHeading, IsNamedEverywhere) {
  for (const double jump : {-6.2831853, 6.2831853, 6.0, -6.6}) {
    Write(jump, "rad");
    for (const std::string& text : Tools())
      EXPECT_THAT(text, AllOf(HasSubstr("steps.csv:13: th differs from the model's next value by "),
                              HasSubstr("about one turn, and model.angles does not name it"),
                              HasSubstr("write `angles: [th]` under model"), Not(HasSubstr("noise_bound of th"))));
  }
}

TEST_F(WrappedHeading, IsNoneInAnotherUnitOrByAnotherJumpOrOnceItIsNamed) {
  const auto expect_none = [this] {
    for (const std::string& text : Tools()) EXPECT_THAT(text, Not(HasSubstr("about one turn")));
  };
  Write(-6.2831853, "m"), expect_none();
  Write(4, "rad"), expect_none();
  Write(-8, "rad"), expect_none();
  Write(-6.2831853, "rad", "  angles: [th]\n"), expect_none();
}

TEST_F(FitCommandTest, NamesParametersThatTheDataDoNotDetermine) {
  const std::string task = Read(task_);
  scratch_.Write("task.yaml",
                 Replaced(Replaced(task, "decay: 1,", "decay: 1, more: 1, idle: 3,"), "x: decay*x", "x: decay*more*x"));
  EXPECT_THAT(Forereach("fit " + task_ + " 2>&1"), Exits(0, "not determined, only together with more\n",
                                                         "not determined: it has no effect on these transitions\n"));
  const Json document = Json::parse(Fit("--json").text);
  EXPECT_EQ(document["parameters"][1]["undetermined_with"], Json({"decay"}));
  EXPECT_TRUE(document["parameters"][3]["deviation"].is_number()) << "of gain";
}

TEST_F(FitCommandTest, SaysWhyAParameterHasNoStandardError) {
  scratch_.Write("steps.csv", "x,y,u,x_next,y_next\n0.5,0,0,0.26,0\n0,0,0.5,0.12,0\n");
  EXPECT_THAT(Fit(""), Exits(0, "none: no informative number is left over to show the noise"));
  EXPECT_THAT(Json::parse(Fit("--json").text)["parameters"][0]["why_no_deviation"], HasSubstr("left over"));
  scratch_.Write("steps.csv", "x,y,u,x_next,y_next\n0.5,0,0,0.26,0\n0,0,0.5,0.12,0\n0.25,0,0.25,0.2,0\n");
  EXPECT_TRUE(Json::parse(Fit("--json").text)["parameters"][0]["why_no_deviation"].is_null()) << "one is left over";
}

TEST_F(FitCommandTest, AParameterThatBeginsWithoutADerivativeIsExitTwo) {
  const std::string task = Replaced(Read(task_), "decay: 1,", "decay: 0,");
  for (const auto& [term, words] : std::vector<std::pair<const char*, const char*>>{
           {"x: sqrt(decay)*x", "no derivative by 'decay' at 0; begin elsewhere"},
           {"x: decay^2*x", "'decay' has no effect near 0; begin elsewhere"}}) {
    scratch_.Write("task.yaml", Replaced(task, "x: decay*x", term));
    EXPECT_THAT(Fit(""), Exits(2, words, Not(HasSubstr("local minimum")))) << term;
  }
}

TEST_F(FitCommandTest, BadInputIsExitTwo) {
  for (const auto& [options, words] :
       std::vector<std::pair<std::string, const char*>>{{"--parameters mass", "the model has no parameter 'mass'"},
                                                        {"--parameters dt", "dt is the step"},
                                                        {"--parameters gain,gain", "parameter 'gain' is given twice"},
                                                        {"--picture errors.gif", "ends in .gif"}}) {
    EXPECT_THAT(Fit(options), Exits(2, words)) << options;
  }
  EXPECT_THAT(Forereach("fit --config config/point_mass.yaml 2>&1"),
              Exits(2, "only the parameters of a model as text can be fitted"));
}

}  // namespace forereach::fit_test
