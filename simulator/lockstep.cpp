#include "simulator/lockstep.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <utility>

#include "bus/bus_options.h"
#include "bus/process.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/safety/grid_map.h"

namespace forereach {
namespace {

constexpr std::int64_t kClockStepUs = 1000;

Config OnOneBus(Config config) {
  config.bus.keys = AllKeysOf(config.bus);
  config.bus.url = "memq://";
  return config;
}

// The robot stands at its start, and the planner proposes nothing to one that only says so. A speed within a
// candidate's X0 is one that a plan may start with.
void RequireStanding(const Config& config) {
  const std::vector<double>&start = config.robot.start, &half_width = config.planner.initial_half_width;
  for (const int k : HeldStates(config))
    if (!(std::abs(start[ToSize(k)]) <= half_width[ToSize(k)]))
      throw ConfigError(
          "{}: robot.start: {} is {}, and the simulated robot stands at its start: the states of robot.hold are zero "
          "there, up to planner.initial_half_width; begin with 0",
          config.path, config.problem->model->state_names()[ToSize(k)], ToText(start[ToSize(k)]));
}

}  // namespace

Lockstep::Lockstep(Config config, const Config& world, std::int64_t now_us, Plant plant)
    : config_(OnOneBus(std::move(config))),
      now_us_(now_us),
      clock_([this] { return now_us_; }),
      bus_(OpenBusOfAllRoles(config_.bus, clock_)),
      certifier_(config_, *bus_, {clock_, clock_}),
      planner_(config_, *bus_),
      robot_(config_, *bus_, std::cout, std::move(plant)),
      perception_(ObstacleSender::PeriodUs(config_.gate)) {
  RequireStanding(config_);
  if (config_.gate.obstacles != ObstaclesSource::kBus) return;
  Config seen = world;
  std::erase_if(seen.obstacles, [this](const Obstacle& each) {  // the certifier has it of its task
    return each.grid() && std::ranges::any_of(config_.obstacles, [&](const Obstacle& own) {
             return own.grid() && MapOf(own) == MapOf(each);
           });
  });
  RequireSendable(seen);
  perception_.Set(now_us_, seen.obstacles);
}

void Lockstep::Run(Node* last) {
  certifier_.Tick(now_us_);  // as a process does before it hears anything
  Deliver();
  std::vector<Node*> nodes{&robot_, &planner_, &certifier_};
  if (last != nullptr) nodes.push_back(last);
  // The robot ends the run by its own limit. This one is for a robot that does not.
  const auto end = now_us_ + static_cast<std::int64_t>((config_.robot.time_limit_s + 60) * 1e6);
  const auto is_done = [&] { return robot_.done() || (last != nullptr && last->done()); };
  while (!is_done() && now_us_ < end) {
    Perceive();
    for (Node* node : nodes) {
      node->Tick(now_us_);
      Deliver();
    }
    const std::int64_t due_us = robot_.due_us();  // no boundary is late
    now_us_ = now_us_ < due_us ? std::min(due_us, now_us_ + kClockStepUs) : now_us_ + kClockStepUs;
  }
}

void Lockstep::Stop() {
  for (Node* node : std::initializer_list<Node*>{&planner_, &certifier_, &robot_}) node->Stop();
}

// Sends the obstacles as a perception would, since this bus has no other sender of them.
void Lockstep::Perceive() {
  if (const auto seen = perception_.Due(now_us_)) static_cast<void>(bus_->Publish(config_.bus.obstacles, *seen));
}

void Lockstep::Deliver() {
  while (bus_->Dispatch(0) > 0) {
  }
}

}  // namespace forereach
