// The tail: many certify calls, each timed by itself.
//   tail [--calls N] [--observations N]        prints one JSON document, microseconds
#include <chrono>
#include <iostream>
#include <optional>

#include "bench/latencies.h"
#include "bench/tasks.h"
#include "command_line/command_line.h"
#include "forereach/certify/tube.h"

namespace forereach::bench {
namespace {

double MicrosecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
}

// Plans that differ a little, so that no branch predictor knows them by heart.
Latencies Measure(Scenario scenario, int observations, int calls) {
  const Task& task = CachedTask(scenario, observations);
  const Certifier& certifier = CachedCertifier(scenario, observations);
  const std::vector<Eigen::MatrixXd> plans = MakePlans(task, 256);
  const Zonotope initial_set = task.initial_set();
  Tube tube;
  Latencies latencies(static_cast<std::size_t>(calls));
  const auto count = static_cast<int>(plans.size());
  for (int call = -count; call < calls; ++call) {  // the first round warms up
    const Plan plan = Task::PlanOf(plans[static_cast<std::size_t>((call + count) % count)]);
    const auto begin = std::chrono::steady_clock::now();
    (void)certifier.Certify(plan, initial_set, task.obstacles, tube);
    if (call >= 0) latencies.Add(MicrosecondsSince(begin));
  }
  return latencies;
}

// What the clock itself adds to each latency.
Latencies MeasureClock(int calls) {
  Latencies latencies(static_cast<std::size_t>(calls));
  for (int call = 0; call < calls; ++call) latencies.Add(MicrosecondsSince(std::chrono::steady_clock::now()));
  return latencies;
}

}  // namespace
}  // namespace forereach::bench

int main(int argc, char** argv) {
  using namespace forereach;
  using namespace forereach::bench;
  int calls = 1'000'000, observations = 400;
  const Command program{.name = "tail",
                        .purpose = "Latency of single certify calls: percentiles as JSON",
                        .options = {{"--calls", &calls, "", "calls measured", NumberRange{1, 100'000'000}},
                                    {"--observations", &observations, "", "N", NumberRange{25, 1'000'000}}}};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  std::cout << nlohmann::json{{"observations", observations},
                              {"bicycle", Measure(Scenario::kBicycle, observations, calls).ToJson()},
                              {"clock", MeasureClock(calls).ToJson()}}
                   .dump(2)
            << std::endl;
}
