// forereach-research: the paper's experiments, one subcommand each, and `all`.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "command_line/command_line.h"
#include "research/affine_study.h"
#include "research/chunks/training.h"
#include "research/drift/drift.h"
#include "research/drift/drive.h"
#include "research/plans.h"
#include "research/real/real.h"
#include "research/regional.h"
#include "research/run.h"
#include "research/tightness.h"

using namespace forereach::research;

namespace {

constexpr const char* kFooter = R"(
Each prints a table with the paper's figure, ours, the difference, and a word where they differ.
Results stay in --out: cells/ has a JSON file for each finished cell, which is never run again, so a run that was
stopped goes on where it was; NAME.csv, tables.csv and report.md are made of them.

  forereach-research all --quick            a look, in seconds
  forereach-research recall --seeds 3       one experiment on three of the ten seeds
  forereach-research all --out run/paper    everything, in minutes
  forereach-research plans --first-seed 100 --N 60 --method "Plug-in Gaussian"
                                               your own: scenarios, observations and outcomes as CSV, with intervals
  forereach-research train                  the policy of `chunks` and of config/policy.yaml, taught anew
  forereach-research real --data ../dart    declarations from a real car's logs, judged by others: research/real-car.md
  forereach-research drift                  a published car of nine states: research/higher-order-car.md
  forereach-research drift --drive          the same car driven to goals, certified
  forereach-research regional               a bound for each region of the domain: research/regions.md
  forereach-research tightness              tubes over what no sound method can fall below
  forereach-research affine                 affine rows of the residual: research/affine.md
  FOREREACH=forereach-research scripts/fleet --hosts one,two run/job all --quick
                                               cells of experiments on several machines: --shard and merge

Exit: 0 done, 2 bad usage or a file that cannot be used.)";

// The smallest that still shows what a method does.
constexpr int kQuickSeeds = 2;
constexpr Effort kQuickEffort{30, 24};

// I/N, I from 1.
std::pair<int, int> ShardOf(const std::string& text) {
  int number = 0, count = 0;
  char more = 0;
  if (std::sscanf(text.c_str(), "%d/%d%c", &number, &count, &more) != 2 || number < 1 || number > count)
    throw std::invalid_argument("--shard: " + text + " is not I/N with 1 <= I <= N");
  return {number - 1, count};
}

void Train(const std::string& file, unsigned threads) {
  TrainingOptions options;
  options.threads = threads;
  const forereach::Policy policy = TrainPolicy(options);
  forereach::SavePolicy(file, policy);
  constexpr std::uint64_t kOtherSeed = 2;
  std::cout << file << ": error " << CloningError(policy, MakeDemonstrations(1200, kOtherSeed, threads))
            << " on errands it was not taught, 1 being that of a policy that knows the mean only" << std::endl;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace forereach;
  RunOptions options;
  bool quick = false, drives = false;
  std::optional<int> seeds;
  options.threads = std::max(1u, std::thread::hardware_concurrency());
  std::string directory, report, shard;
  std::vector<std::string> shards;

  std::string name, policy = "config/policies/bicycle.json", data;
  std::vector<std::string> others;
  PlansOptions plans;
  Command program{
      .name = "forereach-research",
      .purpose = "The paper's experiments, done again.",
      .footer = kFooter,
      .options = {{"--quick", &quick, "",
                   "2 seeds, 30 plans a group, 24 rollouts a plan, the smallest and largest N; `real`: shorter tables"},
                  {"--seeds", &seeds, "", "how many seeds; the paper has 10", NumberRange{1, 1000}},
                  {"--threads", &options.threads, "", "how many cells at once; results do not depend on it",
                   NumberRange{1, 1024}},
                  {"--out", &directory, "",
                   "directory of results; default run/research, with --quick run/research-quick"},
                  {"--shard", &shard, "I/N",
                   "of experiments, only the I-th of N shards of the cells; --out is the file, for `merge`"},
                  {"--report", &report, "", "where the report goes; default report.md in --out"}},
      .chosen = &name};
  for (const Experiment& experiment : Experiments())
    program.commands.push_back({.name = experiment.name, .purpose = experiment.about});
  program.commands.push_back({.name = "all", .purpose = "all of them, in this order"});
  program.commands.push_back({.name = "merge",
                              .purpose = "what a run of the shards' cells prints and keeps in --out",
                              .options = {Required({"shards", &shards, "FILE", "every shard of one run"})}});
  program.commands.push_back({.name = "train",
                              .purpose = "make the policy that `chunks` asks for its plans",
                              .options = {{"--policy", &policy, "", "where it goes"}}});
  program.commands.push_back(
      {.name = "plans",
       .purpose = "plans of your choice of method, size, seeds and horizon, each written out as CSV",
       .options = {{"--system", &plans.system, "", "point_mass or bicycle"},
                   {"--method", &plans.method, "", "a name as in the tables of `methods`"},
                   {"--N", &plans.observations, "", "how many observations", NumberRange{1, 100000}},
                   {"--horizon", &plans.horizon, "", "T, steps of a plan", NumberRange{4, 40}},
                   {"--first-seed", &plans.first_seed, "", "the report's ten are 0 to 9; take others for a test",
                    NumberRange{0, 1000000}}}});
  program.commands.push_back(
      {.name = "real",
       .purpose = "what a declaration from a real car's logs is worth on other logs of it",
       .options = {{"--data", &data, "FOLDER", "the drives: every CSV file of the recorder"},
                   {"--other", &others, "FILE.csv", "a drive to judge by only; may be repeated"}}});
  program.commands.push_back(
      {.name = "drift",
       .purpose = "what has to be declared for CommonRoad's single-track drift model, and its worth",
       .options = {{"--drive", &drives, "",
                    "instead, drive it to goals: planner, certifier, guard and simulated robot; 20 seeds"}}});
  program.commands.push_back({.name = "regional", .purpose = "a bound on the residual for each region of the domain"});
  program.commands.push_back({.name = "tightness", .purpose = "tubes over the inner bound; recall in pieces of X_0"});
  program.commands.push_back({.name = "affine", .purpose = "rows of the residual that are affine, up to a rest"});
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;

  for (const Experiment& experiment : Experiments())
    if (name == experiment.name || name == "all") options.names.push_back(experiment.name);
  options.scope.quick = quick;
  if (quick) options.scope.seeds = kQuickSeeds, options.effort = kQuickEffort;
  if (seeds) options.scope.seeds = *seeds;
  options.directory = directory;
  if (directory.empty() && name != "merge") options.directory = DefaultDirectory(quick);
  options.report = report;
  const std::string command =
      "research/run " + name + (quick ? " --quick" : "") + (seeds ? " --seeds " + std::to_string(*seeds) : "");
  options.origin = OriginOf(command, options.threads);
  try {
    if (!shard.empty() && (options.names.empty() || directory.empty()))
      throw std::invalid_argument("--shard: of experiments alone, with --out FILE");
    if (name == "train") return Train(policy, options.threads), 0;
    if (name == "real") {
      RunReal({data, others, options.directory, quick, command + " --data " + data}, std::cout);
    } else if (name == "plans") {
      plans.seeds = options.scope.seeds;
      plans.effort = options.effort;
      plans.threads = options.threads;
      plans.directory = options.directory;
      RunPlans(plans, std::cout);
    } else if (name == "regional") {
      RunRegional({options.directory, quick, command}, std::cout);
    } else if (name == "tightness") {
      return RunTightness(quick, std::cout), 0;
    } else if (name == "affine") {
      RunAffine({options.directory, quick, command}, std::cout);
    } else if (name == "drift") {
      if (drives)
        RunDriftDrives({options.directory, seeds.value_or(quick ? kQuickSeeds : 20), quick, command + " --drive"},
                       std::cout);
      else
        RunDrift({options.directory, quick, command}, std::cout);
    } else if (name == "merge") {
      return MergeShards(shards, options, std::cout), 0;
    } else if (!shard.empty()) {
      const auto [index, count] = ShardOf(shard);
      RunShard(options, index, count, directory);
    } else {
      RunExperiments(options, std::cout);
    }
  } catch (const std::exception& error) {
    std::cerr << "forereach-research: " << error.what() << "\n";
    return 2;
  }
  std::cerr << "Results: " << options.directory.string() << "\n";
  return 0;
}
