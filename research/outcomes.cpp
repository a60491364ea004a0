// What ForeReach answers: the main table, recall by N, where plans leave the domain, where certification first stops.
#include <cmath>
#include <string>

#include "research/experiment.h"

namespace forereach::research {
namespace {

Cell Largest(const System& system) { return PaperCell(system, system.sample_sizes.back(), 0, 0); }

void AddBothChannels(const Scope& scope, const System& system, std::vector<Cell>& cells) {
  for (const int observations : scope.SizesOf(system))
    for (const double noise : {0.0, system.noise_scale})
      AddSeeds(scope, PaperCell(system, observations, noise, 0), cells);
}

std::vector<Cell> BothChannels(const Scope& scope) {
  std::vector<Cell> cells;
  for (const System* system : Systems()) AddBothChannels(scope, *system, cells);
  return cells;
}

// ---- main

std::vector<Cell> MainCells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const System* system : Systems()) AddSeeds(scope, Largest(*system), cells);
  return cells;
}

std::vector<Table> MainTables(const Results& results) {
  Table table{"Main results", "Noiseless. Point mass N = 100, bicycle N = 400. Coverage is of complete tubes."};
  for (const System* system : Systems()) {
    const Cell cell = Largest(*system);
    const auto row = [&](const char* what, Mark mark, const char* key, Group group, Statistic statistic,
                         bool follows = false) {
      table.Add(system->name + ", " + NameOf(group) + ": " + what, {mark, PaperOrNone(system->name + "." + key)},
                results.Mean(cell, group, statistic), 3, "", follows);
    };
    row("coverage", Mark::kOurs, "B.coverage", Group::kB, Coverage);
    row("D", Mark::kFitted, "B.domain", Group::kB, DomainRate);
    // The paper's D and S add up to one, and ours all but do.
    row("S", Mark::kFitted, "B.safety", Group::kB, SafetyRate, true);
    row("certified", Mark::kFitted, "B.certified", Group::kB, CertificateRate, true);
    row("coverage", Mark::kOurs, "C.coverage", Group::kC, Coverage);
    row("recall", Mark::kFitted, "C.recall", Group::kC, Recall);
    row("recall", Mark::kOurs, "A.recall", Group::kA, Recall);
    table.Add(system->name + ": false certificates, all groups", results.FalseCertificates(cell), 0);
  }
  return {table};
}

// ---- recall

std::vector<Cell> RecallCells(const Scope& scope) {
  std::vector<Cell> cells;
  AddBothChannels(scope, BicycleSystem(), cells);
  return cells;
}

std::vector<Table> RecallTables(const Results& results) {
  const System& bicycle = BicycleSystem();
  Table quiet{"Recall by N", "Bicycle, noiseless; mean ± sample standard deviation over the seeds.", {}};
  Table noisy{"Recall by N, sub-Gaussian channel",
              "Bicycle, s = 4.16e-6, cut at sigma = 3 s. The paper: as its noiseless rows."};
  for (const int observations : results.scope.SizesOf(bicycle)) {
    const std::string n = std::to_string(observations);
    for (const double noise : {0.0, bicycle.noise_scale}) {
      const Cell cell = PaperCell(bicycle, observations, noise, 0);
      std::vector<Row>& rows = (noise == 0 ? quiet : noisy).rows;
      rows.push_back({"C: recall, N = " + n,
                      {Mark::kFitted, Paper("bicycle.C.recall." + n)},
                      results.Mean(cell, Group::kC, Recall),
                      4,
                      ""});
      rows.push_back({"B: coverage, N = " + n,
                      {Mark::kOurs, Paper("bicycle.B.coverage." + n)},
                      results.Mean(cell, Group::kB, Coverage),
                      4,
                      ""});
      rows.push_back({"A: recall, N = " + n, {}, results.Mean(cell, Group::kA, Recall), 4, ""});
      rows.push_back({"B: D, N = " + n, {}, results.Mean(cell, Group::kB, DomainRate), 4, ""});
    }
  }
  return {quiet, noisy};
}

std::vector<Plot> RecallPlots(const Results& results) {
  const System& bicycle = BicycleSystem();
  std::string lines;
  for (const int observations : results.scope.SizesOf(bicycle)) {
    const Estimate ours = results.Mean(PaperCell(bicycle, observations, 0, 0), Group::kC, Recall);
    const PaperValue paper = Paper("bicycle.C.recall." + std::to_string(observations));
    lines += DataLine(
        {static_cast<double>(observations), ours.mean.value_or(NAN), ours.deviation, paper.value, paper.deviation});
  }
  return {{"recall",
           "Recall of group C by the number of observations, mean and one standard deviation over the seeds; the "
           "paper's points are moved a little to the right. The scenarios were fitted to these figures.",
           720, 440, DataBlock("recall", lines) + R"(set logscale x 2
set xtics (25, 50, 100, 150, 200, 400)
set xrange [22:450]; set yrange [0:1.05]
set xlabel 'observations N'; set ylabel 'certified recall, bicycle C'
set key bottom right
plot $recall using ($1*1.03):4 with lines lw 1.4 dt 2 lc rgb grey notitle, \
  '' using ($1*1.03):4:5 with yerrorbars pt 6 ps 0.9 lw 1.4 lc rgb grey title 'the paper', \
  '' using 1:2 with lines lw 2 lc rgb green notitle, \
  '' using 1:2:3 with yerrorbars pt 7 ps 0.7 lw 1.6 lc rgb green title 'ForeReach, here'
)"}};
}

// ---- exits

// Of both systems, every N and channel, by group.
Table FalseByGroup(const Results& results) {
  Table table{"False certificates by group", "Every N, both channels and all seeds of the scope together."};
  for (const System* system : Systems())
    for (const Group group : kGroups) {
      int wrong = 0, certificates = 0;
      for (const Cell& cell : BothChannels(results.scope)) {
        if (cell.system != system) continue;
        const Tally& tally = results.Of(cell, group);
        wrong += tally.false_certificates(), certificates += tally.certified;
      }
      table.Add(system->name + ", " + NameOf(group) + ": of " + std::to_string(certificates) + " certificates", wrong,
                0);
    }
  return table;
}

std::vector<Table> ExitTables(const Results& results) {
  double plans = 0, exits = 0, prefixes = 0, complete = 0, covered = 0, undecided = 0, wrong = 0;
  int decisions = 0, rejections = 0, late = 0;
  for (const Cell& cell : BothChannels(results.scope)) {
    const CellResult& result = results.Of(cell);
    ++decisions;
    rejections += result[0].falsified == result[0].plans;
    for (const Tally& tally : result) {
      plans += tally.plans, exits += tally.domain, prefixes += tally.prefix_covered, undecided += tally.undecided;
      late += tally.domain_steps[static_cast<std::size_t>(cell.system->horizon)];
      complete += tally.complete(), covered += tally.covered, wrong += tally.false_certificates();
    }
  }
  const std::string why = "the paper's queries include systems or layouts that its text does not list";
  return {{"Domain exits and pairwise tests",
           "Both systems, every N, both channels, groups A to C.",
           {{"plans", {Mark::kOurs, Paper("exits.queries")}, plans, 0, why},
            {"of these D", {Mark::kOurs, Paper("exits.domain")}, exits, 0, why},
            {"D / plans", {Mark::kOurs, Paper("exits.fraction")}, exits / plans, 3, why, true},
            {"D after the horizon", {Mark::kOurs, Paper("exits.after_horizon")}, late, 0, why},
            {"prefixes of D that contain every rollout", {}, prefixes, 0, ""},
            {"complete tubes", {}, complete, 0, ""},
            {"of these contain every rollout", {}, covered, 0, ""},
            {"membership undecided", {}, undecided, 0, ""},
            {"false certificates", {}, wrong, 0, ""},
            {"pairwise tests", {Mark::kOurs, Paper("pairwise.decisions")}, decisions, 0, "this run has fewer cells"},
            {"of these rejected", {Mark::kOurs, Paper("pairwise.rejections")}, rejections, 0, ""}}},
          FalseByGroup(results)};
}

// ---- steps

std::vector<Table> StepTables(const Results& results) {
  std::vector<Table> tables;
  for (const int observations : {BicycleSystem().sample_sizes.front(), BicycleSystem().sample_sizes.back()}) {
    Table table{"First abstention, N = " + std::to_string(observations),
                "Bicycle, noiseless: the part of a group's plans that abstains first at a step. The paper shows these "
                "as a picture."};
    for (const Group group : {Group::kB, Group::kC})
      for (const bool is_domain : {true, false})
        for (std::size_t t = 0; t <= static_cast<std::size_t>(BicycleSystem().horizon); ++t) {
          std::vector<std::optional<double>> parts;
          Cell cell = PaperCell(BicycleSystem(), observations, 0, 0);
          for (; cell.seed < results.scope.seeds; ++cell.seed) {
            const Tally& tally = results.Of(cell, group);
            parts.push_back(static_cast<double>((is_domain ? tally.domain_steps : tally.safety_steps)[t]) /
                            tally.plans);
          }
          const Estimate part = EstimateOf(parts);
          if (*part.mean == 0) continue;
          const std::string what = std::string(1, NameOf(group)) + (is_domain ? ": D at step " : ": S at step ");
          table.Add(what + std::to_string(t), part, 4);
        }
    tables.push_back(table);
  }
  return tables;
}

constexpr std::size_t kFirstStepShown = 5;  // Nothing happens before.

std::vector<Plot> StepPlots(const Results& results) {
  Plot plot{"steps", "The step at which a plan of the bicycle first abstains, noiseless, as a part of its group.", 900,
            400, ""};
  std::string panels;
  for (const int observations : {BicycleSystem().sample_sizes.front(), BicycleSystem().sample_sizes.back()}) {
    std::string lines;
    for (std::size_t t = kFirstStepShown; t <= static_cast<std::size_t>(BicycleSystem().horizon); ++t) {
      double exits = 0, unsafe = 0, unsafe_along = 0, plans = 0;
      Cell cell = PaperCell(BicycleSystem(), observations, 0, 0);
      for (; cell.seed < results.scope.seeds; ++cell.seed) {
        const Tally &b = results.Of(cell, Group::kB), &c = results.Of(cell, Group::kC);
        exits += b.domain_steps[t], unsafe += b.safety_steps[t], unsafe_along += c.safety_steps[t], plans += b.plans;
      }
      lines += DataLine({static_cast<double>(t), exits / plans, unsafe / plans, unsafe_along / plans});
    }
    const std::string n = std::to_string(observations);
    plot.script += DataBlock("steps" + n, lines);
    panels += "set title 'N = " + n + "'\nplot $steps" + n +
              " using 2:xtic(1) lc rgb blue title 'B: leaves the domain (D)', '' using 3 lc rgb orange title 'B: may "
              "touch the obstacle (S)', '' using 4 lc rgb green title 'C: may touch the obstacle (S)'\n";
  }
  plot.script +=
      "set multiplot layout 1,2\nset style data histogram\nset style histogram clustered gap 1\n"
      "set style fill solid 0.9 noborder\nset yrange [0:0.5]\nset xlabel 'step'\n"
      "set ylabel 'part of the plans'\nset key top left\n" +
      panels + "unset multiplot\n";
  return {plot};
}

std::vector<Cell> StepCells(const Scope& scope) {
  std::vector<Cell> cells;
  for (const int observations : {BicycleSystem().sample_sizes.front(), BicycleSystem().sample_sizes.back()})
    AddSeeds(scope, PaperCell(BicycleSystem(), observations, 0, 0), cells);
  return cells;
}

}  // namespace

Experiment MainResults() { return {"main", "outcomes of both systems, Table 1", MainCells, MainTables}; }

Experiment RecallByN() {
  return {"recall", "the bicycle's recall and coverage by N, both channels", RecallCells, RecallTables, RecallPlots};
}

Experiment DomainExits() {
  return {"exits", "domain exits, coverage and pairwise tests over every cell", BothChannels, ExitTables};
}

Experiment FirstAbstentions() {
  return {"steps", "the step at which certification first stops", StepCells, StepTables, StepPlots};
}

}  // namespace forereach::research
