/** A task driven by planner, certifier and simulated robot, on one bus in this thread. */
#pragma once

#include <cstdint>
#include <memory>

#include "bus/node.h"
#include "certifier/gate/obstacle_sender.h"
#include "certifier/process/certifier_node.h"
#include "planner_bridge/planner_node.h"
#include "simulator/sim_node.h"
#include "task/config.h"

namespace forereach {

/** Time is simulated and does not advance during computations, so a run is the same on every machine. */
class Lockstep final {
 public:
  /** @param world a task whose obstacles are sent on OBSTACLES if `config` has gate.obstacles: bus. @param now_us the
  time at which the run begins. @param plant what moves the robot; empty: the task's target. @throws ConfigError as the
  nodes do, or if the obstacles cannot be sent. */
  Lockstep(Config config, const Config& world, std::int64_t now_us, Plant plant = {});

  /** With the keys of all roles. */
  [[nodiscard]] const Config& config() const { return config_; }
  [[nodiscard]] Bus& bus() { return *bus_; }
  [[nodiscard]] const PlannerNode& planner() const { return planner_; }
  [[nodiscard]] const RobotSimNode& robot() const { return robot_; }

  /** Drives until the robot or `last` is done, or a minute after its time limit. @param last takes its turn after the
  three nodes; null for none. */
  void Run(Node* last = nullptr);
  /** Stops the three nodes, which print their summaries on standard output. */
  void Stop();

 private:
  void Deliver();
  void Perceive();

  const Config config_;
  std::int64_t now_us_;
  const Clock clock_;
  const std::unique_ptr<Bus> bus_;
  CertifierNode certifier_;
  PlannerNode planner_;
  RobotSimNode robot_;
  ObstaclesOfFile perception_;
};

}  // namespace forereach
