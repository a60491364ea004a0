#include "clients/supervised.h"

#include "certifier/gate/stamp.h"

namespace forereach {
namespace {

GuardDomain DomainOf(const Config& config) {
  const auto entries = [](const Eigen::VectorXd& bounds) { return std::vector<double>(bounds.begin(), bounds.end()); };
  const Domain& domain = config.problem->domain;
  return {entries(domain.state.lower()), entries(domain.state.upper()), entries(domain.input.lower()),
          entries(domain.input.upper())};
}

}  // namespace

SupervisorOptions SupervisorOptionsOf(const Config& config) {
  SupervisorOptions options;
  options.guard.num_states = config.problem->model->num_states();
  options.guard.num_inputs = config.problem->model->num_inputs();
  options.guard.step_us = Microseconds(config.robot.step_period_ms);
  options.guard.config_digest = config.grounds.config;
  options.guard.model_digest = config.grounds.model;
  options.guard.keys = KeysOf(config.bus, Role::kRobot);
  options.guard.bus_name = config.bus.bus_name();
  options.guard.channel = config.bus.certified;
  options.guard.withdrawn = config.bus.withdrawn;
  options.guard.domain = DomainOf(config);
  options.guard.angles = config.problem->model->angles();
  options.max_age_us = Microseconds(config.gate.max_age_ms);
  options.max_ahead_us = Microseconds(config.gate.max_ahead_ms);
  options.fault = config.bus.fault;
  options.command = config.bus.command;
  options.robot_state = config.bus.robot_state;
  options.transition = config.bus.transition;
  options.event = config.bus.event;
  return options;
}

void ExpectTask(const Config& config, Supervisor& supervisor) {
  supervisor.Expect(config.grounds.config, config.grounds.model, DomainOf(config), config.problem->model->angles());
}

}  // namespace forereach
