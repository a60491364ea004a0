/** The loop that times one certify call, with the widths of its end slice as counters. */
#pragma once

#include <functional>

#include <benchmark/benchmark.h>

#include "bench/tasks.h"
#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"

namespace forereach::bench {

inline void AddWidths(benchmark::State& state, const std::function<double(int)>& half_width) {
  state.counters["width_x"] = 2 * half_width(0);
  state.counters["width_y"] = 2 * half_width(1);
  state.counters["width_theta"] = 2 * half_width(2);
}

/** One call on one plan. Skips, loudly, where the answer is not the certificate that the task is made for. */
inline void RunCertify(benchmark::State& state, const Certifier& certifier, const Task& task,
                       const ObstacleView& obstacles) {
  const Plan plan = task.plan();
  const Zonotope initial_set = task.initial_set();
  Tube tube;
  if (certifier.Certify(plan, initial_set, obstacles, tube).outcome != Outcome::kCertified)
    return state.SkipWithError("no certificate");
  for (auto _ : state) benchmark::DoNotOptimize(certifier.Certify(plan, initial_set, obstacles, tube));
  AddWidths(state, [&](int k) { return tube.slice(tube.length()).HalfWidthUpper(k); });
}
inline void RunCertify(benchmark::State& state, const Certifier& certifier, const Task& task) {
  RunCertify(state, certifier, task, task.obstacles);
}

}  // namespace forereach::bench
