/** A small task made in code, and candidates that get each outcome from it.

A point mass with dt = 0.15 s that is exactly its nominal model, and a circle of 0.5 m at (3.5, 0). From X_0 around the
origin at 1 m/s along px, ten steps without control stay clear of the circle, 2 m/s^2 drive into it, and 4 m/s^2 lie
outside the input domain. */
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "task/config.h"
#include "tests/messages.h"
#include "tests/worlds.h"

namespace forereach {

inline constexpr std::int64_t kNow = 1'700'000'000'000'000;

/** One step of the small task's robot from (x, u), as its model says but for vx, which is off by `error`: that
contradicts the declaration. */
inline transition_t Executed(const NominalModel& model, const Eigen::VectorXd& z, double error = 0) {
  transition_t transition{.duration_us = 150'000, .num_states = 4, .num_inputs = 2};
  std::copy_n(z.data(), 4, transition.state);
  std::copy_n(z.data() + 4, 2, transition.input);
  model.Evaluate({z.data(), 6}, {transition.next_state, 4});
  transition.next_state[2] += error;
  return transition;
}

inline Config SmallTask() {
  Problem problem = PaperPointMass(5);
  problem.declaration.state_error = Vec({0, 0, 0, 0});
  problem.transitions.z = Eigen::MatrixXd{{0, 0, 1, 0, 0, 0}, {1, 2, -1, 0.5, 0.25, -0.5}};
  problem.transitions.x_next.resize(2, 4);
  for (int i = 0; i < 2; ++i)
    problem.transitions.x_next.row(i) =
        Eigen::Map<const Eigen::RowVector4d>(Executed(*problem.model, problem.transitions.z.row(i)).next_state);

  Config config;
  config.obstacles = {Obstacle::Circle(Eigen::Vector2d(3.5, 0), 0.5)};
  config.gate.needs_robot_state = false;
  config.gate.step_error_ms = kAnyTime;
  config.gate.obstacles = ObstaclesSource::kTask;
  config.says_between = true;
  config.grounds = GroundsOf(DigestOf(std::string_view("small task")), problem, config.obstacles);
  config.problem = std::make_shared<const Problem>(std::move(problem));
  return config;
}

/** The same where obstacles come from the bus too. */
inline Config SmallTaskOnTheBus() {
  Config config = SmallTask();
  config.gate.obstacles = ObstaclesSource::kBus;
  config.gate.obstacles_lost_ms = kNeverLost;
  return config;
}

/** The same with a second observation that a constant residual cannot explain: F. */
inline Config FalsifiedTask() {
  Config config = SmallTask();
  Own(config.problem).transitions.x_next(1, 2) += 0.01;
  return config;
}

inline constexpr double kAccelerationThatCertifies = 0, kAccelerationIntoTheCircle = 2, kAccelerationOutsideDomain = 4;

/** Ten steps with a constant acceleration along px, sent now, to start in half a second. */
inline candidate_plan_t Candidate(std::int64_t plan_id, double acceleration = kAccelerationThatCertifies,
                                  std::int64_t now_us = kNow) {
  candidate_plan_t candidate{.utime = now_us, .plan_id = plan_id};
  SetText(candidate.source, "test");
  candidate.start_utime = now_us + 500'000;
  candidate.step_us = 150'000;
  candidate.num_states = 4;
  candidate.num_inputs = 2;
  candidate.num_steps = 10;
  candidate.progress_steps = 6;
  candidate.initial_center[2] = 1;
  candidate.initial_center[3] = 0.1;
  for (int k = 0; k < 4; ++k) candidate.initial_half_width[k] = 0.05;
  for (int t = 0; t < 10; ++t) candidate.control[t][0] = acceleration;
  return candidate;
}

/** A step at rest in the origin, or one in which it gets up speed by itself: that contradicts the declaration. */
inline transition_t AtRest(std::int64_t utime, double speed = 0) {
  return {.utime = utime, .duration_us = 150'000, .num_states = 4, .num_inputs = 2, .next_state = {0, 0, speed}};
}

}  // namespace forereach
