// forereach-experiments: the paper's experiments, one subcommand each, and `all`.
#include <algorithm>
#include <exception>
#include <iostream>
#include <string>
#include <thread>

#include <CLI/CLI.hpp>

#include "experiments/chunks/training.h"
#include "experiments/run.h"

using namespace forereach::experiments;

namespace {

constexpr const char* kFooter = R"(
Each prints a table with the paper's figure, ours, the difference, and a word where they differ.
Results stay in --out: cells/ has a JSON file for each finished cell, which is never run again, so a run that was
stopped goes on where it was; NAME.csv, tables.csv and report.md are made of them.

  forereach-experiments all --quick            a look, in seconds
  forereach-experiments recall --seeds 3       one experiment on three of the ten seeds
  forereach-experiments all --out run/paper    everything, in minutes
  forereach-experiments train                  the policy of `chunks` and of config/policy.yaml, taught anew

Exit: 0 done, 2 bad usage or a file that cannot be used.)";

// The smallest that still shows what a method does.
constexpr int kQuickSeeds = 2;
constexpr Effort kQuickEffort{30, 24};

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
  RunOptions options;
  bool quick = false;
  int seeds = 0;
  options.threads = std::max(1u, std::thread::hardware_concurrency());
  std::string directory, report;

  CLI::App app("The paper's experiments, done again.", "forereach-experiments");
  app.footer(kFooter);
  app.require_subcommand(1);
  app.fallthrough();
  app.add_flag("--quick", quick, "2 seeds, 30 plans a group, 24 rollouts a plan, the smallest and largest N");
  app.add_option("--seeds", seeds, "how many seeds, 1 to 1000; the paper has 10")->check(CLI::Range(1, 1000));
  app.add_option("--threads", options.threads, "how many cells at once; results do not depend on it")
      ->check(CLI::Range(1u, 1024u))
      ->capture_default_str();
  app.add_option("--out", directory,
                 "directory of results; default run/experiments, with --quick run/experiments-quick");
  app.add_option("--report", report, "where the report goes; default report.md in --out");
  for (const Experiment& experiment : Experiments()) app.add_subcommand(experiment.name, experiment.about);
  app.add_subcommand("all", "all of them, in this order");
  std::string policy = "config/policies/bicycle.json";
  CLI::App* const train = app.add_subcommand("train", "make the policy that `chunks` asks for its plans");
  train->add_option("--policy", policy, "where it goes")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }

  const std::string name = app.get_subcommands().front()->get_name();
  for (const Experiment& experiment : Experiments())
    if (name == experiment.name || name == "all") options.names.push_back(experiment.name);
  options.scope.quick = quick;
  if (quick) options.scope.seeds = kQuickSeeds, options.effort = kQuickEffort;
  if (seeds > 0) options.scope.seeds = seeds;
  options.directory = !directory.empty() ? directory : quick ? "run/experiments-quick" : "run/experiments";
  options.report = report;
  options.command =
      "experiments/run " + name + (quick ? " --quick" : "") + (seeds > 0 ? " --seeds " + std::to_string(seeds) : "");
  try {
    if (train->parsed()) return Train(policy, options.threads), 0;
    RunExperiments(options, std::cout);
  } catch (const std::exception& error) {
    std::cerr << "forereach-experiments: " << error.what() << "\n";
    return 2;
  }
  std::cerr << "Results: " << options.directory.string() << "\n";
  return 0;
}
