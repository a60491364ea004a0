/** forereach-robot-sim: the simulated robot on the bus, or a transitions file made with its target. */
#include <algorithm>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "simulator/sim_node.h"
#include "simulator/target.h"
#include "task/config.h"
#include "task/process.h"

namespace forereach {
namespace {

constexpr const char* kName = "forereach-robot-sim";

struct SampleOptions {
  std::string output;
  std::uint64_t seed = 1;
  int count = 400;
  std::vector<std::string> ranges;
};

std::vector<Option> Declared(SampleOptions& options) {
  constexpr const char* kMake = "--make-transitions";
  return {{.name = kMake,
           .variable = &options.output,
           .type = "FILE",
           .help = "Do not drive: write transitions of the target to this CSV file, and exit"},
          {.name = "--seed", .variable = &options.seed, .help = "Seed of the samples", .needs = kMake},
          {.name = "--count",
           .variable = &options.count,
           .help = "The number of transitions",
           .range = NumberRange{1, 10'000'000},
           .needs = kMake},
          {.name = "--range",
           .variable = &options.ranges,
           .type = "NAME=LOWER:UPPER",
           .help = "Narrows one coordinate of the domain, as in v=7.25:15.75; once for each coordinate",
           .needs = kMake}};
}

// All of `text` as a number.
double ParseNumber(const std::string& text) {
  std::size_t read = 0;
  const double number = std::stod(text, &read);
  if (read != text.size()) throw std::invalid_argument(text);
  return number;
}

SampleRange ParseRange(const std::string& text) {
  const std::size_t equals = text.find('='), colon = text.find(':', equals + 1);
  try {
    if (equals == std::string::npos || colon == std::string::npos) throw std::invalid_argument(text);
    return {text.substr(0, equals), ParseNumber(text.substr(equals + 1, colon - equals - 1)),
            ParseNumber(text.substr(colon + 1))};
  } catch (const std::logic_error&) {  // what stod throws
    throw ConfigError("--range {}: has to be NAME=LOWER:UPPER, as in v=7.25:15.75", text);
  }
}

void WriteTransitions(const std::string& config_path, const SampleOptions& options) {
  std::vector<SampleRange> ranges;
  for (const std::string& text : options.ranges) ranges.push_back(ParseRange(text));
  const Config config = LoadConfig(config_path, TransitionsFile::kIgnore);
  try {
    Disturbance disturbance(config.problem->declaration, config.robot);
    const Transitions made =
        MakeTransitions(*MakeTarget(config), *config.problem, options.seed, options.count, ranges, {}, &disturbance);
    SaveTransitions(options.output, *config.problem->model, made);
  } catch (const std::invalid_argument& error) {
    throw ConfigError("{}: {}", config_path, error.what());
  }
}

int RunWriteTransitions(int argc, char** argv) {
  std::string config_path;
  SampleOptions sample;
  std::vector<Option> options = Declared(sample);
  options.insert(options.begin(), Required({"--config", &config_path, "FILE", "The task file (YAML)"}));
  const Command program{.name = kName,
                        .purpose = "Writes transitions of the task file's target, uniform over its domain.",
                        .options = std::move(options)};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  return Guarded(kName, [&] {
    WriteTransitions(config_path, sample);
    return 0;
  });
}

bool IsMakeTransitions(std::string_view argument) {
  return argument == "--make-transitions" || argument.starts_with("--make-transitions=");
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) {
  using namespace forereach;
  if (std::any_of(argv, argv + argc, IsMakeTransitions)) return RunWriteTransitions(argc, argv);
  SampleOptions for_help;
  return RunProcess(
      argc, argv,
      {kName,
       "The simulated robot: executes certified plans only, one step at a time, on a target that differs from the "
       "nominal model by the task file's robot.residual and robot.disturbance. Ends at the goal or at "
       "robot.time_limit_s, and prints one line of JSON about the run.",
       "forereach-robot-sim --config config/demo.yaml\n"
       "  forereach-robot-sim --config config/demo.yaml --make-transitions made.csv --seed 1 --count 400 "
       "--range v=7.25:15.75",
       Role::kRobot},
      [](const Config& config, Bus& bus) { return std::make_unique<RobotSimNode>(config, bus); }, Declared(for_help));
}
