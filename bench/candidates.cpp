#include "bench/candidates.h"

#include <algorithm>

#include "lcmtypes/codec.h"
#include "task/canonical.h"

namespace forereach::bench {

Config MakeConfig(const Task& task) {
  Config config;
  config.problem = task.problem;
  config.obstacles = task.obstacles;
  config.gate.needs_robot_state = false;
  config.gate.obstacles = ObstaclesSource::kTask;
  config.grounds = GroundsOf(DigestOf(std::string_view("benchmark")), *task.problem, task.obstacles);
  return config;
}

candidate_plan_t MakeCandidate(const Task& task) {
  candidate_plan_t candidate{};
  SetText(candidate.source, "benchmark");
  candidate.step_us = 100'000;
  candidate.num_states = static_cast<std::int16_t>(task.center.size());
  candidate.num_inputs = static_cast<std::int16_t>(task.controls.rows());
  candidate.num_steps = candidate.progress_steps = static_cast<std::int16_t>(task.controls.cols());
  std::ranges::copy(task.center, candidate.initial_center);
  std::ranges::copy(task.half_width, candidate.initial_half_width);
  for (Eigen::Index t = 0; t < task.controls.cols(); ++t) {
    const Eigen::VectorXd control = task.controls.col(t);
    std::ranges::copy(control, candidate.control[t]);
  }
  return candidate;
}

void Stamp(candidate_plan_t& candidate, std::int64_t plan_id, std::int64_t now_us) {
  candidate.utime = now_us;
  candidate.plan_id = candidate.sequence = plan_id;
  candidate.start_utime = now_us + 100'000;
}

}  // namespace forereach::bench
