// Affine rows through the command line: `declare --from-data` says what the data refute and proposes rows that hold,
// `certify` and `check` say what the data lack and which of them contradict.

#include <fmt/format.h>

#include "forereach/certify/certifier.h"
#include "tests/cli/program.h"
#include "tests/task/task_files.h"

namespace forereach::affine_rows_command_test {

using Json = nlohmann::json;

constexpr double kNoise = 0.0005;

struct AffineRowsCommandTest : testing::Test {
  // A point mass whose residual of vx is residual(vx, ax), off by up to `noise`; ax is drawn, or a share of vx.
  template <class Residual>
  void Drive(int steps, double noise, const Residual& residual, double share = 0) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    rows_.clear();
    double px = 0, vx = 1;
    for (int i = 0; i < steps; ++i) {
      const double drawn = 2 * uniform(random), ax = share > 0 ? share * vx : drawn - 0.2 * px - 0.5 * vx,
                   next_px = px + 0.15 * vx + 0.5 * 0.15 * 0.15 * ax,
                   next_vx = vx + 0.15 * ax + residual(vx, ax) + noise * uniform(random);
      rows_.push_back(fmt::format("{},0,{},0,{},0,{},0,{},0\n", px, vx, ax, next_px, next_vx));
      px = next_px;
      vx = share > 0 ? 2 * uniform(random) : next_vx;
      if (share > 0) px = uniform(random);
    }
    Write(rows_);
  }
  void Write(const std::vector<std::string>& rows) const {
    scratch_.Write("steps.csv",
                   fmt::format("px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n{}", fmt::join(rows, "")));
  }
  void WriteTask(const std::string& declaration) const {
    const std::string task = Replaced(kTask, "[0.1, 0.1, 0.1, 0.1]", "[0.01, 0.01, 0.01, 0.01]");
    const std::size_t begin = task.find("declaration:"), end = task.find("transitions:");
    scratch_.Write("task.yaml", task.substr(0, begin) + declaration + task.substr(end));
  }
  void Declared(const std::string& more = "") const {
    WriteTask("declaration:\n  lipschitz: {}\n  noise_bound: [1e-9, 1e-9, 0.0005, 1e-9]\n" + more);
  }
  Output Declare(const std::string& options) const {
    return Forereach("declare --config " + scratch_ / "task.yaml" + " --from-data --by vx,ax " + options + " 2>&1");
  }
  // Of the proposal, "affine", and of it the one row that needs slopes.
  Json Affine(const std::string& options = "") const {
    return Json::parse(Declare("--json " + options).text)["affine"];
  }
  // The proposed text is a task that the transitions do not contradict, and bounds the row.
  Config Proposed(const Json& affine) const {
    WriteTask(affine["yaml"].get<std::string>());
    Config config = LoadConfig(scratch_ / "task.yaml");
    const Certifier certifier(config.problem);
    EXPECT_FALSE(certifier.violation());
    EXPECT_EQ(certifier.Unexcited(), "");
    return config;
  }
  Output Certify(const std::string& options = "") const {
    scratch_.Write("plan.csv", "ax,ay\n0.5,0\n0.5,0\n0.5,0\n");
    return Forereach("certify --config " + scratch_ / "task.yaml" + " --plan " + scratch_ / "plan.csv" + " " + options +
                     " 2>&1");
  }

  ScratchDirectory scratch_;
  std::vector<std::string> rows_;
};

double Gain(double vx, double ax) { return -0.02 * vx - 0.03 * ax + 0.002; }

TEST_F(AffineRowsCommandTest, AnAffineResidualIsNotRefutedAndItsTextIsNarrowerThanSlopes) {
  Drive(100, kNoise, Gain);
  Declared();
  const Json affine = Affine();
  ASSERT_EQ(affine["rows"].size(), 1u) << "the other states need no slopes";
  EXPECT_THAT(affine["rows"][0], Holds({{"state", "vx"}, {"affine_refuted", nullptr}, {"rest", 0.0}}));
  EXPECT_EQ(affine["held_out"]["left"], 0);
  EXPECT_LT(affine["half_width"], 0.9 * affine["half_width_by_slopes"].get<double>());
  EXPECT_THAT(Declare("").text,
              AllOf(HasSubstr("vx          not refuted"), HasSubstr("Or with affine rows, which no transition refutes"),
                    HasSubstr("  affine: {rows: [vx], columns: [vx, ax]}\n")));
  const Config config = Proposed(affine);
  EXPECT_EQ(config.problem->declaration.affine.columns, std::vector({2, 4}));
  EXPECT_TRUE(config.problem->declaration.lipschitz.isZero(0));
}

// The lines that it names refute it alone; it is the last of the first so many that does, and no fewer do.
TEST_F(AffineRowsCommandTest, AKinkRefutesItAfterSoManyTransitionsAndNotOneSooner) {
  Drive(100, kNoise, [](double vx, double) { return -0.02 * std::abs(vx); });
  Declared();
  const Json row = Affine()["rows"][0];
  const int after = row["affine_refuted"]["after"];
  const std::vector<int> lines = row["affine_refuted"]["lines"];
  EXPECT_GT(after, 3) << "of three unknowns";
  EXPECT_LT(after, 100);
  EXPECT_EQ(lines.back(), after + 1) << "the header is line 1";
  EXPECT_LE(lines.size(), 4u);
  EXPECT_GT(row["rest"], 0.9) << "a plane takes nothing off |vx|";
  EXPECT_THAT(Declare("").text, AllOf(HasSubstr(fmt::format("refuted by {}: lines {}", after, fmt::join(lines, ", "))),
                                      Not(HasSubstr("Or with affine rows"))));

  Write({rows_.begin(), rows_.begin() + after});
  EXPECT_EQ(Affine()["rows"][0]["affine_refuted"]["after"], after);
  Write({rows_.begin(), rows_.begin() + after - 1});
  const Json whole = Affine()["rows"];
  ASSERT_FALSE(whole.empty());
  for (const Json& each : whole) EXPECT_EQ(each["affine_refuted"], nullptr);
  std::vector<std::string> few;
  for (const int line : lines) few.push_back(rows_[static_cast<std::size_t>(line) - 2]);
  Write(few);
  EXPECT_EQ(Affine()["rows"][0]["affine_refuted"]["after"], few.size());
}

// Drag by the square of the speed, small beside the gain.
TEST_F(AffineRowsCommandTest, WhatAPlaneLeavesIsProposedAsRestWhereItIsSmall) {
  Drive(100, kNoise, [](double vx, double ax) { return Gain(vx, ax) - 0.004 * vx * std::abs(vx); });
  Declared();
  const Json affine = Affine();
  EXPECT_FALSE(affine["rows"][0]["affine_refuted"].is_null());
  EXPECT_GT(affine["rows"][0]["rest"], 0);
  EXPECT_LE(affine["rows"][0]["rest"], 0.5);
  const Declaration declaration = Proposed(affine).problem->declaration;
  EXPECT_GT(declaration.affine.Rest(2, 2), 0);
  EXPECT_TRUE(declaration.lipschitz.isZero(0));
}

// A slow first half shows half of the slopes that the second has.
TEST_F(AffineRowsCommandTest, SlopesOfTheFirstHalfAreRefutedByAPairOfTheSecond) {
  Drive(100, 0, [](double vx, double) { return vx > 0.5 ? -0.05 * (vx - 0.5) : 0; });
  std::ranges::stable_sort(rows_, {},
                           [](const std::string& row) { return std::stod(row.substr(row.find(",0,") + 3)); });
  Declared();
  Write(rows_);
  const Json row = Affine("--factor 1")["rows"][0];
  const int after = row["slopes_refuted"]["after"];
  EXPECT_GT(after, 50);
  ASSERT_EQ(row["slopes_refuted"]["lines"].size(), 2u);
  EXPECT_EQ(row["slopes_refuted"]["lines"][1], after + 1);
  EXPECT_THAT(Declare("--factor 1").text, HasSubstr(fmt::format("refuted by {}: lines ", after)));
}

// Scatter of the robot that is declared too small refutes every plane; what is proposed of it as a disturbance does
// not.
TEST_F(AffineRowsCommandTest, IsJudgedWithTheDisturbanceThatIsProposed) {
  Drive(200, 6 * kNoise, Gain);
  Declared();
  EXPECT_FALSE(Affine("--disturbance declared")["rows"][0]["affine_refuted"].is_null());
  const Json affine = Affine();
  EXPECT_EQ(affine["rows"][0]["affine_refuted"], nullptr);
  EXPECT_GT(Proposed(affine).problem->declaration.DisturbanceBound(2), 5 * kNoise);
}

TEST_F(AffineRowsCommandTest, BoundsTheSlopesThatErrorsOfTheRecordNeed) {
  Drive(100, kNoise, Gain);
  Declared("  state_error: {vx: 0.0001}\n  input_error: {ax: 0.001}\n");
  const Declaration declaration = Proposed(Affine()).problem->declaration;
  EXPECT_GE(declaration.lipschitz(2, 2), 0.02);
  EXPECT_GE(declaration.lipschitz(2, 4), 0.03);
  EXPECT_LE(declaration.lipschitz(2, 4), 0.06);
}

TEST_F(AffineRowsCommandTest, ProposesNoneThatWouldHaveNoBoundAndCertifySaysWhy) {
  Drive(60, kNoise, Gain, 0.5);
  Declared();
  const Output output = Declare("");
  EXPECT_THAT(output,
              Exits(0, "vx          not refuted", "No affine rows are proposed: the residual of vx has no bound: "));
  EXPECT_THAT(output.text, AllOf(testing::ContainsRegex("(-0.5 vx [+] ax|0.5 vx - ax) is the same in all observations"),
                                 Not(HasSubstr("Or with affine rows"))));
  EXPECT_EQ(Affine()["yaml"], nullptr);

  Declared("  affine: {rows: [vx], columns: [vx, ax]}\n");
  const auto why = testing::ContainsRegex(
      "abstain D: at step 0 the next vx has no finite enclosure: the residual of vx has no bound: (-0.5 vx [+] ax|0.5 "
      "vx - ax) is the same in all observations");
  EXPECT_THAT(Certify(), Exits(1, ""));
  EXPECT_THAT(Certify().text, why);
  EXPECT_THAT(Json::parse(Certify("--json").text)["message"].get<std::string>(), why);
  EXPECT_THAT(Forereach("check " + scratch_ / "task.yaml" + " 2>&1").text,
              testing::ContainsRegex("declaration.affine: the residual of vx has no bound: "));
}

// One step is wrong: those that show it are named, and refute the row alone.
TEST_F(AffineRowsCommandTest, CertifyAndCheckNameAllObservationsThatContradict) {
  int step = 0;
  Drive(40, kNoise, [&](double vx, double ax) { return Gain(vx, ax) + (step++ == 17 ? 0.3 : 0); });
  Declared("  affine: {rows: [vx], columns: [vx, ax]}\n");
  const Certifier certifier(LoadConfig(scratch_ / "task.yaml").problem);
  ASSERT_TRUE(certifier.violation());
  const std::vector<int> named = certifier.Contradicting();
  EXPECT_EQ(named.size(), 4u) << "one more than there are unknowns";
  EXPECT_THAT(Certify(),
              Exits(1, fmt::format("abstain F: no affine residual of vx agrees with observations {}: one is ",
                                   fmt::join(named, ", "))));
  std::vector<int> lines;
  std::vector<std::string> few;
  for (const int i : named) lines.push_back(i + 2), few.push_back(rows_[static_cast<std::size_t>(i)]);
  EXPECT_THAT(Forereach("check " + scratch_ / "task.yaml" + " 2>&1").text,
              HasSubstr(fmt::format("vx: no affine residual agrees with lines {} of ", fmt::join(lines, ", "))));
  Write(few);
  EXPECT_THAT(Certify(), Exits(1, "abstain F: no affine residual of vx agrees with observations 0, 1, 2, 3: "));
}

// Twelve columns are as many as a row may have.
TEST_F(AffineRowsCommandTest, ProposesNoneOfMoreColumnsThanARowMayHave) {
  constexpr int kStates = 12;
  std::string states, next, header, ends;
  for (int k = 0; k < kStates; ++k) {
    states += fmt::format("{}s{}: 1", k > 0 ? ", " : "", k);
    next += fmt::format("{}s{}: 0.5*s{}", k > 0 ? ", " : "", k, k);
    header += fmt::format("s{},", k);
    ends += fmt::format(",s{}_next", k);
  }
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.9, 0.9);
  std::string rows = header + "u" + ends + "\n";
  for (int i = 0; i < 40; ++i) {
    std::vector<double> z(kStates + 1), after(kStates);
    for (double& entry : z) entry = uniform(random);
    for (std::size_t k = 0; k < kStates; ++k) after[k] = 0.5 * z[k] + (k == 0 ? 0.1 * z[1] : 0);
    rows += fmt::format("{},{}\n", fmt::join(z, ","), fmt::join(after, ","));
  }
  scratch_.Write("steps.csv", rows);
  scratch_.Write("task.yaml", Replaced(TaskFor("model: {states: {" + states +
                                                   "}, inputs: {u: 1}, parameters: {dt: 0.1}, "
                                                   "next: {" +
                                                   next + "}}\n",
                                               kStates, 1, "s0"),
                                       "noise_bound: [0", "noise_bound: [1e-9"));
  const auto declare = [&](const std::string& by) {
    return Forereach("declare --config " + scratch_ / "task.yaml" + " --from-data " + by + " 2>&1").text;
  };
  EXPECT_THAT(declare(""), HasSubstr("an affine row has at most 12 columns, and here 13 vary: name fewer (--by)"));
  EXPECT_THAT(declare("--by s0,s1,s2,s3,s4,s5,s6,s7,s8,s9,s10,s11"), HasSubstr("affine: {rows: [s0], columns: [s0, "));
}

}  // namespace forereach::affine_rows_command_test
