// Runs: quick figures in bands that a broken method would miss, the same files for any number of threads, resuming.
#include "research/run.h"

#include "tests/test.h"

#include "research/methods/envelope.h"
#include "research/plans.h"
#include "research/run_directory.h"
#include "research/sides.h"
#include "tests/paths.h"
#include "tests/shell.h"

namespace forereach::research::run_test {

namespace fs = std::filesystem;

struct RunTest : testing::Test {
  [[nodiscard]] RunOptions Quick(std::vector<std::string> names, const std::string& directory) const {
    return {std::move(names), {2, true}, {30, 24}, 1, root_ / directory, "", {}};
  }

  const ScratchDirectory scratch_;
  const fs::path root_ = scratch_.path();
};

TEST_F(RunTest, QuickFiguresThatNoSoundMethodMisses) {
  const RunDirectory directory(root_, {30, 24});
  const Scope scope{2, true};
  const auto estimate = [&](const Cell& cell, Group group, Statistic statistic) {
    std::vector<Cell> cells;
    AddSeeds(scope, cell, cells);
    return *Results(scope, cells, RunAll(cells, directory, 1)).Mean(cell, group, statistic).mean;
  };
  const Cell bicycle = PaperCell(BicycleSystem(), 400, 0, 0), point_mass = PaperCell(PointMassSystem(), 100, 0, 0);
  EXPECT_EQ(estimate(bicycle, Group::kB, CertificateRate), 0);
  for (const Cell& cell : {bicycle, point_mass})
    for (const Group group : kGroups) EXPECT_EQ(estimate(cell, group, Coverage), 1) << cell.key() << NameOf(group);
  EXPECT_GT(estimate(point_mass, Group::kC, Recall), 0.95);
}

TEST_F(RunTest, QuickBaselinesFallOnTheirSides) {
  const RunDirectory directory(root_, {30, 24});
  const Scope scope{1, true};
  const auto estimate = [&](const char* method, int observations, Group group, Statistic statistic) {
    Cell cell = PaperCell(BicycleSystem(), observations, 0, 0);
    cell.method = *std::ranges::find(Methods(), method, &Method::name);
    return Results(scope, {cell}, RunAll({cell}, directory, 1)).Mean(cell, group, statistic).mean;
  };
  // Unsound where there are no data, and of use where there are.
  for (const char* method : {"Global calibration", "Plug-in Gaussian"}) {
    EXPECT_LT(*estimate(method, 400, Group::kB, Coverage), 0.8) << method;
    EXPECT_GT(*estimate(method, 400, Group::kC, Recall), 0.2) << method;
  }
  // Wider elsewhere than the global one, and of less use.
  EXPECT_GT(*estimate("Regional calibration", 400, Group::kB, Coverage),
            *estimate("Global calibration", 400, Group::kB, Coverage) + 0.2);
  EXPECT_LT(*estimate("Regional calibration", 400, Group::kC, Recall),
            *estimate("Global calibration", 400, Group::kC, Recall) - 0.2);
  EXPECT_LT(*estimate("GP (k=2)", 100, Group::kB, Coverage), 0.8);
  EXPECT_GT(*estimate("GP (k=2)", 100, Group::kC, Recall), 0.9);
  EXPECT_GE(*estimate("GP (k=3)", 100, Group::kB, Coverage), *estimate("GP (k=2)", 100, Group::kB, Coverage));
  // Of no use.
  for (const char* method : {"Alanwar Alg. 6", "CP-SLS-MPC equations", "Scalar envelope"})
    for (const Group group : kGroups) EXPECT_EQ(estimate(method, 400, group, CertificateRate), 0) << method;
  EXPECT_EQ(estimate("Scalar envelope", 400, Group::kC, DomainRate), 1);
}

// A count over ten seeds of sixty plans each, and twice the standard error that its spread over these seeds gives it.
// All are of this very data, so another count is another method, arithmetic or scenario, and not another draw.
struct Band {
  const System& system;
  int observations;
  Group group;
  int Tally::*count;
  int value, width;

  [[nodiscard]] bool Holds(const Method& method) const {
    int sum = 0;
    for (int seed = 0; seed < 10; ++seed) {
      Cell cell = PaperCell(system, observations, 0, seed);
      cell.method = method;
      sum += RunCell(cell, {60, 1})[static_cast<std::size_t>(group)].*count;
    }
    return std::abs(sum - value) <= width;
  }
};

TEST(RunCell, FiguresLieInBandsThatAnEnvelopeAFifthOffMisses) {
  const Method narrow{"narrow", [](const Setting&s) { return MakeScaledForeReach(s, 0.8); }},
      wide{"wide", [](const Setting&s) { return MakeScaledForeReach(s, 1.2); }};
  const System &bicycle = BicycleSystem(), &point_mass = PointMassSystem();
  for (const Band& band :
       {Band{bicycle, 25, Group::kC, &Tally::certified, 153, 26},
        Band{bicycle, 50, Group::kC, &Tally::certified, 216, 20}, Band{bicycle, 25, Group::kB, &Tally::domain, 591, 5},
        Band{bicycle, 100, Group::kB, &Tally::domain, 576, 8}, Band{bicycle, 400, Group::kB, &Tally::domain, 551, 15},
        Band{point_mass, 100, Group::kB, &Tally::domain, 474, 18}}) {
    const std::string what = band.system.name + " " + NameOf(band.group) + " " + std::to_string(band.observations);
    EXPECT_TRUE(band.Holds(Methods().front())) << what;
    EXPECT_FALSE(band.Holds(narrow)) << what;
    EXPECT_FALSE(band.Holds(wide)) << what;
  }
}

TEST(RunCell, CpSlsIsStarvedWithFewObservationsAndVacuousWithMany) {
  const auto run = [](int observations) {
    Cell cell = PaperCell(BicycleSystem(), observations, 0, 0);
    cell.method = *std::ranges::find(Methods(), "CP-SLS-MPC equations", &Method::name);
    return RunCell(cell, {60, 1});
  };
  int vacuous = 0;
  for (const Tally& few : run(100)) {
    EXPECT_EQ(few.domain, few.plans);
    EXPECT_THAT(few.budgets.total, Each(-1));
    EXPECT_THAT(few.budgets.least_mass, Each(Lt(119)));
  }
  for (const Tally& many : run(400)) {
    vacuous += many.vacuous;
    EXPECT_EQ(many.certified, 0);
    EXPECT_EQ(many.vacuous + many.safety + many.domain, many.plans);
    EXPECT_THAT(many.budgets.least_mass, Each(Gt(119)));
    for (std::size_t i = 0; i < many.budgets.total.size(); ++i) {
      if (many.budgets.complete[i] == 0) continue;
      EXPECT_NEAR(many.budgets.total[i], 0.1 + many.budgets.drift[i] + many.budgets.tube[i], 1e-12);
    }
  }
  EXPECT_GT(vacuous, 0);
}

TEST_F(RunTest, LimitsAndAssumptionsHoldInAQuickRun) {
  std::ostringstream out;
  RunOptions options = Quick({"limits", "degradation", "assumptions"}, "limits");
  options.effort = {3, 8};
  RunExperiments(options, out);
  EXPECT_THAT(out.str(),
              AllOf(HasSubstr("| admissible pairs | exact | 64 | Short-horizon lower-bound scan | 64 | 0 | same |"),
                    HasSubstr("| of these with a positive bound | ours | 64 | Short-horizon lower-bound scan | 64 |"),
                    HasSubstr("| bicycle, N = 400: tubes that miss an extremal state, of 4 | not given |  |  | 0 |")));
  for (const char* system : {"bicycle", "point_mass"})
    EXPECT_THAT(out.str(), HasSubstr(std::string("| ") + system +
                                     ": false certificates, all groups | not given |  |  | 0 |  |  |  |"));
  EXPECT_THAT(out.str(),
              AllOf(HasSubstr("| Affine residual, linear target: F | ours | 0.000 | Affine control example | 0.000 "),
                    HasSubstr("| Affine residual, linear target: C coverage | ours | 1.000 | Affine control example | "
                              "1.000 "),
                    HasSubstr("| Affine residual, knee target: F | ours | 1.000 | Affine control example | 1.000 ")));
}

std::string WithoutOrigin(std::string report) {
  const std::size_t from = report.find(kOriginBegins), to = report.find(kOriginEnds);
  return to == std::string::npos ? report : report.erase(from, to - from);
}

TEST_F(RunTest, FilesAreTheSameForAnyNumberOfThreads) {
  const std::vector<std::string> names{"main", "steps", "chunks"};
  RunOptions one = Quick(names, "one"), two = Quick(names, "two");
  two.threads = 2;
  one.origin = OriginOf("research/run all", 1);
  two.origin = OriginOf("research/run all --threads 2", 2);
  std::ostringstream out_one, out_two;
  RunExperiments(one, out_one);
  RunExperiments(two, out_two);
  const std::string report = WithoutOrigin(Read(root_ / "one/report.md"));
  EXPECT_LT(report.size() + 100, Read(root_ / "one/report.md").size());
  EXPECT_EQ(report, WithoutOrigin(Read(root_ / "two/report.md")));
  for (const char* name : {"main.csv", "steps.csv", "chunks.csv", "tables.csv", "figures/steps.svg"}) {
    EXPECT_FALSE(Read(root_ / "one" / name).empty());
    EXPECT_EQ(Read(root_ / "one" / name), Read(root_ / "two" / name)) << name;
  }
  EXPECT_EQ(out_one.str(), out_two.str());
  EXPECT_THAT(out_one.str(), HasSubstr("| bicycle, C: recall | fitted | 0.983 |"));
  EXPECT_THAT(out_one.str(), HasSubstr("| fixed grid, N = 400: recall | ours | 0.695 ± 0.012 |"));
}

TEST_F(RunTest, AFinishedCellIsNotRunAgain) {
  const Cell cell = PaperCell(PointMassSystem(), 100, 0, 0);
  const RunDirectory directory(root_, {4, 10});
  const std::vector<CellResult> first = RunAll({cell}, directory, 1);
  // What is on file counts, not what a run would give.
  const fs::path file = root_ / "cells" / (cell.key() + ".json");
  auto json = nlohmann::json::parse(Read(file));
  EXPECT_EQ(json["groups"]["C"]["plans"], 4);
  json["groups"]["C"]["plans"] = 77;
  std::ofstream(file) << json;
  EXPECT_EQ(RunAll({cell}, directory, 2)[0][2].plans, 77);
  // One that was being written when the run was stopped does not.
  fs::rename(file, file.string() + ".part");
  EXPECT_EQ(RunAll({cell}, directory, 2)[0][2].plans, 4);
  EXPECT_EQ(ToCsv({cell}, RunAll({cell}, directory, 1)), ToCsv({cell}, first));
}

TEST_F(RunTest, AnotherEffortOrADamagedFileIsRefusedByName) {
  const Cell cell = PaperCell(PointMassSystem(), 100, 0, 0);
  const RunDirectory directory(root_, {2, 2});
  (void)RunAll({cell}, directory, 1);
  EXPECT_THAT(
      [&] {
        const RunDirectory other(root_, {3, 2});
      },
      ThrowsMessage<std::runtime_error>(HasSubstr("run.json: scenarios: begun with 2, this run has 3")));
  std::ofstream(root_ / "cells" / (cell.key() + ".json")) << "{\"groups\": {\"A\"";
  EXPECT_THAT([&] { (void)RunAll({cell}, directory, 1); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr(cell.key() + ".json: "), HasSubstr("delete it"))));
}

TEST_F(RunTest, TooSmallADeclarationIsSeenByTheTestOrByTheTruth) {
  std::ostringstream out;
  RunExperiments(Quick({"incorrect"}, "incorrect"), out);
  // 12 data sets: 2 seeds, 2 channels; N = 100 of the point mass, N = 25 and 400 of the bicycle.
  EXPECT_THAT(out.str(), HasSubstr("| L times 1: corridor | not given |  |  | 0 |"));
  EXPECT_THAT(out.str(), HasSubstr("| L times 0.03154: corridor | not given |  |  | 12 |"));
  EXPECT_THAT(out.str(), HasSubstr("| L times 0.03154: below the knee | not given |  |  | 0 |"));
  EXPECT_THAT(out.str(), HasSubstr("L times 1: false certificates, all groups | not given |  |  | 0 |"));
  const auto false_certificates = [&](const std::string& system) {
    const std::string row = "| " + system + ", L times 0.03154: false certificates, all groups | not given |  |  | ";
    const std::size_t at = out.str().find(row);
    return at == std::string::npos ? -1 : std::atoi(out.str().c_str() + at + row.size());
  };
  EXPECT_GT(false_certificates("bicycle"), 5);
  EXPECT_GT(false_certificates("point_mass"), 0);
}

TEST(Cell, KeysTellCellsApart) {
  const Cell cell = PaperCell(BicycleSystem(), 400, 0, 0);
  EXPECT_EQ(cell.key(), "bicycle-ForeReach-deployed-N400-s0-order5-corridor-seed0");
  for (const auto& change : std::initializer_list<void (*)(Cell&)>{
           [](Cell& c) { c.system = &PointMassSystem(); }, [](Cell& c) { c.method.name = "GP (k=2)"; },
           [](Cell& c) { c.declared.name = "scalar"; }, [](Cell& c) { c.observations = 25; },
           [](Cell& c) { c.noise = 1e-5; }, [](Cell& c) { c.zonotope_order = 1; }, [](Cell& c) { c.seed = 1; },
           [](Cell& c) { c.layout = Layout::kBelowKnee; }}) {
    Cell other = cell;
    change(other);
    EXPECT_NE(other.key(), cell.key());
    EXPECT_EQ(other.key().find_first_of(" ()/="), std::string::npos) << other.key();
  }
}

TEST(SideOf, HasABandAndMayBeOfBothKinds) {
  EXPECT_EQ(SideOf({1.0, 0.98}), "sound and informative");
  EXPECT_EQ(SideOf({0.96, 0.06}), "sound and informative");
  EXPECT_EQ(SideOf({0.94, 0.98}), "unsound");
  EXPECT_EQ(SideOf({1.0, 0.05}), "uninformative");
  EXPECT_EQ(SideOf({0.5, 0.0}), "unsound and uninformative");
  EXPECT_EQ(SideOf({std::nullopt, 0.0}), "uninformative");
}

TEST(IsReproduced, NeedsTheSideAndBothFigures) {
  const Point paper{0.9015, 0.0696};
  EXPECT_TRUE(IsReproduced({0.85, 0.1}, paper));
  EXPECT_FALSE(IsReproduced({0.3, 0.1}, paper)) << "unsound as the paper's, but elsewhere";
  EXPECT_FALSE(IsReproduced({0.9, 0.6}, paper));
  EXPECT_FALSE(IsReproduced({0.96, 0.07}, paper)) << "near, on the other side";
  EXPECT_FALSE(IsReproduced({std::nullopt, 0.0}, {1.0, 0.0})) << "no tube is complete";
  EXPECT_TRUE(IsReproduced({std::nullopt, 0.0}, {std::nullopt, 0.0}));
}

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST_F(RunTest, PlansAreWrittenOneByOneWithTheColumnsOfTheDocuments) {
  const auto run = [&](const char* name, unsigned threads) {
    std::ostringstream out;
    RunPlans({"bicycle", "ForeReach", 60, 8, 100, 3, {6, 10}, threads, root_ / name}, out);
    return out.str();
  };
  const std::string out = run("one", 1);
  EXPECT_EQ(run("two", 2), out);
  for (const char* name : {"scenarios.csv", "controls.csv", "outcomes.csv", "intervals.csv", "transitions-102.csv"}) {
    EXPECT_FALSE(Read(root_ / "one" / name).empty()) << name;
    EXPECT_EQ(Read(root_ / "one" / name), Read(root_ / "two" / name)) << name;
  }
  const std::vector<std::string> scenarios = Lines(Read(root_ / "one/scenarios.csv")),
                                 controls = Lines(Read(root_ / "one/controls.csv")),
                                 outcomes = Lines(Read(root_ / "one/outcomes.csv"));
  EXPECT_EQ(scenarios.size(), 1u + 3 * 3 * 6);
  EXPECT_EQ(controls.size(), 1u + 3 * 3 * 6 * 8);
  EXPECT_EQ(outcomes.size(), 1u + 3 * 3 * 6);
  for (const auto* lines : {&scenarios, &controls, &outcomes})
    for (const std::string& line : *lines)
      EXPECT_EQ(std::ranges::count(line, ','), std::ranges::count(lines->front(), ',')) << line;
  EXPECT_EQ(scenarios[1].substr(0, 8), "100,A,0,");
  EXPECT_EQ(controls[0], "seed,group,plan,step,jerk,steer_rate");
  EXPECT_EQ(outcomes[0], "seed,group,plan,answer,step,safe,complete,cover,area");

  // The lines say what a cell counts.
  System shorter = BicycleSystem();
  shorter.horizon = 8;
  std::size_t at = 1;
  for (const int seed : {100, 101, 102})
    for (const Tally& tally : RunCell(PaperCell(shorter, 60, 0, seed), {6, 10}))
      for (std::size_t i = 0; i < tally.answers.size(); ++i)
        EXPECT_THAT(outcomes[at++], StartsWith(std::to_string(seed) + "," + tally.group + "," + std::to_string(i) +
                                               "," + tally.answers[i] + ","));
  std::ostringstream ignored;
  RunPlans({"bicycle", "Scalar envelope", 60, 8, 100, 3, {6, 10}, 2, root_ / "other"}, ignored);
  EXPECT_NE(Read(root_ / "other/outcomes.csv"), Read(root_ / "one/outcomes.csv"));
  EXPECT_THROW(RunPlans({"bicycle", "Magic", 60, 8, 0, 1, {1, 1}, 1, root_ / "no"}, ignored), std::invalid_argument);
  EXPECT_THROW(RunPlans({"boat", "ForeReach", 60, 8, 0, 1, {1, 1}, 1, root_ / "no"}, ignored), std::invalid_argument);

  // research/methods.md has a table of each file, with these columns and no others.
  const std::string document = Read(fs::path(FOREREACH_SOURCE_DIR) / "research/methods.md") + "\n";
  for (const File& file : FilesOfPlans()) {
    std::string table = "`" + std::string(file.name) + "`\n\n| column | what |\n|---|---|\n";
    for (const Column& column : file.columns)
      table += std::string("| ") + column.name + " | " + column.meaning + " |\n";
    EXPECT_THAT(document, HasSubstr(table + "\n"));
  }
}

Output Command(const std::string& arguments) {
  return Shell(FOREREACH_BINARY_DIR "/research/forereach-research " + arguments + " 2>&1");
}

TEST_F(RunTest, TheCommandTeachesRunsAndRefuses) {
  const Output help = Command("--help");
  EXPECT_EQ(help.code, 0);
  for (const Experiment& experiment : Experiments()) EXPECT_THAT(help.text, HasSubstr(experiment.name));
  EXPECT_EQ(Command("").code, 2);
  EXPECT_EQ(Command("nothing").code, 2);
  EXPECT_EQ(Command("norms --seeds 0").code, 2);

  const std::string out = " --out " + (root_ / "run").string();
  const Output norms = Command("norms" + out);
  EXPECT_EQ(norms.code, 0) << norms.text;
  EXPECT_THAT(norms.text, HasSubstr("| bicycle | exact | 11.368 | Norm ratios | 11.368 | 0.000 | same |"));
  const Output quick = Command("norms --quick" + out);
  EXPECT_EQ(quick.code, 2);
  EXPECT_THAT(quick.text, HasSubstr("run.json: scenarios: begun with 600, this run has 30"));
}

}  // namespace forereach::research::run_test
