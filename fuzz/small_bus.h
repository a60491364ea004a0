/** Messages on the bus of the small task (tests/certifier/small_task.h), as a robot and its sensors would send them. */
#pragma once

#include "certifier/gate/obstacle_message.h"
#include "forereach/execution_event_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "fuzz/fuzz.h"

namespace forereach {

inline robot_state_t RobotState(FuzzedDataProvider& input, std::int64_t sequence, std::int64_t now) {
  robot_state_t state{};
  state.utime = now;
  state.sequence = AnyInteger(input, sequence, 8);
  state.executing_plan_id = input.ConsumeIntegralInRange(0, 9) - 1;
  state.executing_step = static_cast<std::int16_t>(input.ConsumeIntegralInRange(0, 12) - 1);
  state.mode = input.ConsumeBool() ? AnySmall(input, 4) : robot_state_t::EXECUTING;
  state.num_states = input.ConsumeBool() ? AnySmall(input, 16) : std::int16_t{4};
  state.state[0] = 0.15 * state.executing_step;  // where the candidate that certifies wants it
  state.state[1] = 0.015 * state.executing_step;
  state.state[2] = 1;
  state.state[3] = 0.1;
  if (input.ConsumeBool()) state.state[input.ConsumeIntegralInRange(0, 4)] = AnyNumber(input);
  return state;
}

inline transition_t Transition(FuzzedDataProvider& input, std::int64_t now) {
  transition_t transition{};
  transition.utime = now;
  transition.num_states = 4;
  transition.num_inputs = 2;
  transition.state[2] = 1;
  transition.next_state[0] = 0.15;
  transition.next_state[2] = 1;
  if (input.ConsumeBool()) transition.state[input.ConsumeIntegralInRange(0, 3)] = AnyNumber(input);
  if (input.ConsumeBool()) transition.next_state[input.ConsumeIntegralInRange(0, 3)] = AnyNumber(input);
  return transition;
}

inline obstacle_shape_t AnyShape(FuzzedDataProvider& input) {
  obstacle_shape_t shape{};
  shape.kind = input.ConsumeIntegralInRange<std::int16_t>(0, 7);
  shape.dimension = input.ConsumeIntegralInRange<std::int16_t>(1, 3);
  shape.num_points = input.ConsumeIntegralInRange<std::int16_t>(0, 16);
  shape.value = AnyNumber(input);
  for (int p = 0; p < shape.num_points; ++p)
    for (double& coordinate : shape.point[p]) coordinate = AnyNumber(input);
  return shape;
}

inline obstacles_t AnyObstacles(FuzzedDataProvider& input, std::int64_t sequence, std::int64_t now) {
  obstacles_t obstacles = ToMessage({Obstacle::Circle(Eigen::Vector2d(3.5, 0), 0.5)}, now);
  obstacles.sequence = AnyInteger(input, sequence, 8);
  if (!input.ConsumeBool()) return obstacles;
  obstacles.num_obstacles = input.ConsumeIntegralInRange<std::int16_t>(-1, 4);
  for (int i = 0; i < obstacles.num_obstacles; ++i) {
    obstacles.obstacle[i] = obstacles.obstacle[0];
    obstacles.obstacle[i].track = i;
    obstacles.obstacle[i].shape = AnyShape(input);
  }
  return obstacles;
}

// Windows of one track in reach of the plan; garbage as asked.
inline obstacles_t AnyMoving(FuzzedDataProvider& input, std::int64_t sequence, std::int64_t now) {
  ObstacleMotion motion;
  motion.stamp_us = now;
  motion.velocity.y() = 0.1;
  const Obstacle circle = Obstacle::Circle(Eigen::Vector2d(3.5, 0), 0.5);
  obstacles_t obstacles = ToMessage({circle.Moving(motion)}, now);
  obstacles.sequence = AnyInteger(input, sequence, 8);
  if (!input.ConsumeBool()) return obstacles;
  obstacles.num_obstacles = input.ConsumeIntegralInRange<std::int16_t>(-1, 4);
  for (int i = 0; i < obstacles.num_obstacles; ++i) {
    obstacle_t& piece = obstacles.obstacle[i];
    piece.shape = input.ConsumeBool() ? AnyShape(input) : obstacles.obstacle[0].shape;
    piece.track = AnySmall(input, 2);
    piece.utime = AnyInteger(input, now, 1'000'000);
    piece.from_utime = AnyInteger(input, now, 1'000'000);
    piece.until_utime = AnyInteger(input, now, 4'000'000);
    for (double& number : piece.velocity) number = AnyNumber(input);
    for (double* number : {&piece.uncertainty, &piece.growth, &piece.growth_rate})
      if (input.ConsumeBool()) *number = AnyNumber(input);
    piece.gone = AnySmall(input, 2);
  }
  return obstacles;
}

inline execution_event_t AnAnswer(FuzzedDataProvider& input) {
  execution_event_t event{};
  event.kind = input.ConsumeBool() ? AnySmall(input, 16) : execution_event_t::WITHDRAWN;
  event.plan_id = input.ConsumeIntegralInRange(0, 9) - 1;
  event.step = AnySmall(input, 12);
  event.value = input.ConsumeBool() ? AnyNumber(input) : input.ConsumeIntegralInRange(0, 15);
  return event;
}

}  // namespace forereach
