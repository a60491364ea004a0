// Drives tasks in this thread and without waiting, each with many seeds of the planner and of what disturbs the robot.
#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "bus/log.h"
#include "bus/process.h"
#include "command_line/command_line.h"
#include "command_line/progress.h"
#include "forereach/certify/way_clear.h"
#include "forereach/fault_t.hpp"
#include "lcmtypes/codec.h"
#include "logger/logger_node.h"
#include "simulator/drive_counts.h"
#include "simulator/lockstep.h"
#include "task/step_time.h"
#include "tests/worlds.h"

namespace forereach {
namespace {

struct Options {
  std::vector<std::string> tasks;
  std::string obstacles;
  int seeds = 20, first_seed = 1;
  bool advice = false, repair = false, certifies = false;
  double scatter = 0;
  double errors = 0, input_errors = 0;
  double wear = 0;
  std::string log;
};

std::string TextOf(const DriveCounts& all) {
  const double share =
      all.proposed > 0 ? 100.0 * static_cast<double>(all.certified) / static_cast<double>(all.proposed) : 0;
  const double seconds = all.goals > 0 ? all.seconds_to_goal / static_cast<double>(all.goals) : 0;
  return fmt::format(
      "{:>3} of {:<3} {:>6.1f} s {:>8} {:>6} {:>4} of {:<6} {:>5} {:>9} {:>4} of {:<5} {:>3.0f} % {:>8} {:>4} of {:<5}",
      all.goals, all.drives, seconds, all.contacts, all.limits, all.outside, all.steps, all.stops, all.emergency_stops,
      all.certified, all.proposed, share, all.searches, all.lost_rounds, all.rounds);
}

struct Drive {
  DriveCounts counts;
  std::string fault;            // the first that was latched; empty: none
  std::vector<double> ends_at;  // the measured state
};

// A robot that moves less than its task's target by a share.
Plant Worn(const Config& config, double share) {
  return [target = std::shared_ptr<const Target>(MakeTarget(config)), share](
             std::span<const double> x, std::span<const double> u, std::span<double> next, double longer) {
    const std::vector<double> before(x.begin(), x.end());
    target->Step(x, u, next, longer);
    for (std::size_t i = 0; i < next.size(); ++i) next[i] -= share * (next[i] - before[i]);
  };
}

// Even seeds have an adversary, odd ones disturbances, errors of measurement and of inputs, and steps off their times
// at random, all within what the task declares.
Drive DriveOnce(Config config, const Config& world, int seed, const Options& options) {
  constexpr std::int64_t kStartUs = 1'700'000'000'000'000, kApartUs = 8LL * 3600 * 1'000'000;  // three a day
  const int number = seed - options.first_seed;
  config.planner.seed = seed;
  config.robot.disturbance_seed = seed;
  const char* const kind = seed % 2 == 0 ? "adversarial" : "random";
  if (config.problem->declaration.IsDisturbed()) config.robot.disturbance = kind;
  if (!config.problem->declaration.state_error.isZero(0)) config.robot.sensor_error = kind;
  if (!config.problem->declaration.input_error.isZero(0)) config.robot.input_error = kind;
  if (StepErrorUs(config.gate).value_or(0) > 0) config.robot.step_jitter = kind;
  config.logger.directory = options.log;
  config.logger.flush_ms = 60'000;  // of simulated time
  Plant plant;
  if (options.wear > 0) plant = Worn(config, options.wear * (number + 1) / options.seeds);
  Lockstep lockstep(config, world, kStartUs + number * kApartUs, std::move(plant));
  std::ostringstream summary;
  std::optional<LoggerNode> logger;
  if (!options.log.empty()) logger.emplace(lockstep.config(), lockstep.bus(), summary);
  Drive drive;
  lockstep.bus().Subscribe(config.bus.fault, [&drive](const Received& received) {
    const auto fault = Decoded<fault_t>(received.bytes);
    if (fault && drive.fault.empty()) drive.fault = GetText(fault->message);
  });
  lockstep.Run(logger ? &*logger : nullptr);
  if (logger) logger->Stop();
  drive.counts = CountsOf(lockstep);
  drive.ends_at.assign(lockstep.robot().state().begin(), lockstep.robot().state().end());
  return drive;
}

// The task of a robot that measures with errors, a share of what its planner allows a start, and takes its steps off
// their times by the same share of a tenth of a step; its inputs act beside the plan's by a share of their range. A
// task that declares errors keeps its own.
Config WithErrors(Config config, double share, double of_inputs) {
  if (share == 0 || config.problem->declaration.HasErrorInZ()) return config;
  Problem& problem = Own(config.problem);
  std::vector<double>& half_width = config.planner.initial_half_width;
  problem.declaration.state_error =
      share * Eigen::Map<const Eigen::VectorXd>(half_width.data(), std::ssize(half_width));
  problem.declaration.input_error = of_inputs * (problem.domain.input.upper() - problem.domain.input.lower());
  problem.declaration.given_are_exact = true;
  for (double& width : half_width) width *= 1 + share;  // what is measured at the start is off, too
  config.gate.step_error_ms = share / 10 * config.period * 1e3;
  config.gate.step_us = StepUs(config);
  problem.timing.error = StepErrorSeconds(config);
  if (problem.between) problem.between->period = LongestPeriod(config);
  return config;
}

// Each obstacle elsewhere, in each coordinate by up to `most` metres.
std::vector<Obstacle> Scattered(const std::vector<Obstacle>& obstacles, double most, int seed) {
  std::mt19937 random(static_cast<std::uint32_t>(seed));
  std::vector<Obstacle> scattered;
  for (const Obstacle& obstacle : obstacles) {
    Eigen::VectorXd by(obstacle.dim());
    for (double& coordinate : by)
      coordinate = most * (2 * static_cast<double>(random()) / static_cast<double>(std::mt19937::max()) - 1);
    scattered.push_back(Shifted(obstacle, by));
  }
  return scattered;
}

// One row: the task with each seed. False if one of them was not good.
bool DriveAll(const std::string& name, const Config& config, const Options& options) {
  const Config world = options.obstacles.empty() ? config : LoadConfig(options.obstacles, TransitionsFile::kIgnore);
  const auto begin = std::chrono::steady_clock::now();
  DriveCounts all;
  std::string bad;
  bool all_good = true;
  {
    Progress progress(name + " drives", static_cast<std::size_t>(options.seeds));
    for (int seed = options.first_seed; seed < options.first_seed + options.seeds; ++seed) {
      Config scattered = config;
      if (options.scatter > 0) scattered.obstacles = Scattered(config.obstacles, options.scatter, seed);
      const Drive drive = DriveOnce(scattered, world, seed, options);
      const bool is_good = drive.fault.empty() && drive.counts.good();
      if (!is_good)
        bad += fmt::format("{:>26} {}, abstained {}, {}, ends at {:.2f}\n", fmt::format("seed {}", seed),
                           TextOf(drive.counts), drive.counts.abstained,
                           drive.fault.empty() ? "no fault" : "fault: " + drive.fault, fmt::join(drive.ends_at, ", "));
      all_good = all_good && is_good;
      all += drive.counts;
      progress.Advance();
      // It has stood for its whole time and searched, as with any other seed.
      if (drive.counts.certified == 0) {
        bad += "no plan of this drive is certified: no further seed is driven\n";
        break;
      }
    }
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  std::cout << fmt::format("{:<26} {} {:>5.1f} s\n", name, TextOf(all), seconds.count()) << bad << std::flush;
  return all_good;
}

int Run(const Options& options) {
  bool all_good = true;
  std::cout << fmt::format("{:<26} {:^10} {:>8} {:>8} {:>6} {:^14} {:>5} {:>9} {:^20} {:>8} {:^13} {:>6}\n", "task",
                           "goals", "to goal", "contacts", "limits", "steps outside", "stops", "emergency",
                           "plans certified", "searches", "rounds lost", "time");
  for (const std::string& task : options.tasks) {
    Config config = WithErrors(LoadConfig(task), options.errors, options.input_errors);
    const std::string name = std::filesystem::path(task).stem().string();
    all_good = DriveAll(name, config, options) && all_good;
    if (options.advice) {
      config.gate.advises = true;
      all_good = DriveAll(name + ", advised", config, options) && all_good;
      config.gate.advises = false;
    }
    if (options.certifies) {
      config.planner.certifies = true;
      all_good = DriveAll(name + ", certifies", config, options) && all_good;
      config.planner.certifies = false;
    }
    if (options.repair) {
      config.planner.repairs = true;
      all_good = DriveAll(name + ", repaired", config, options) && all_good;
    }
  }
  return all_good ? 0 : 1;
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) {
  using namespace forereach;
  Options options;
  const Command program{
      .name = "forereach_drives",
      .purpose =
          "Drives each task with many seeds of planner and disturbance on a simulated clock. Exits with 1 if a "
          "goal is missed, something is touched, a limit is exceeded or a step leaves its slice.",
      .footer = "Example:\n  forereach_drives config/drive/unicycle.yaml config/drive/reaching_arm.yaml --seeds 20",
      .options = {
          Required({"tasks", &options.tasks, "TASK", "Task files (YAML)"}),
          {"--obstacles", &options.obstacles, "FILE",
           "Task file whose obstacles are sent on OBSTACLES; by default each task's own"},
          {"--seeds", &options.seeds, "N", "The number of drives of each task", NumberRange{1, 1'000'000}},
          {"--first-seed", &options.first_seed, "K", "The first seed", NumberRange{1, 1'000'000'000}},
          {.name = "--errors",
           .variable = &options.errors,
           .help = "Tasks without errors of measurement get this share of planner.initial_half_width, and steps "
                   "off their times by as much of a tenth of model.dt",
           .range = NumberRange{0, 1}},
          {.name = "--input-errors",
           .variable = &options.input_errors,
           .help = "With --errors, inputs act beside the plan's by up to this share of their range",
           .range = NumberRange{0, 1}},
          {.name = "--scatter",
           .variable = &options.scatter,
           .help = "Moves each obstacle of the task by up to so many metres in each coordinate, by the seed",
           .range = NumberRange{0, 1000}},
          {.name = "--wear",
           .variable = &options.wear,
           .help = "The robot moves less than its task says: in the last drive by this share, before by less",
           .range = NumberRange{0, 1}},
          {"--log", &options.log, "DIR", "Records the drives as a logger does; they begin eight hours apart"},
          {"--advice", &options.advice, "Drives each task once more with gate.advice: send"},
          {"--certifies", &options.certifies, "Drives each task once more with planner.certifies: true"},
          {"--repair", &options.repair, "Drives each task once more with planner.repair: true"}}};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  logging::Silence();
  return Guarded("forereach_drives", [&] { return Run(options); });
}
