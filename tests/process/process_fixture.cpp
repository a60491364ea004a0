#include "tests/process/process_fixture.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include <gtest/gtest.h>
#include <unistd.h>

#include "bus/authentic.h"

namespace forereach {

std::string PrivateBusUrl() {
  // Below the ports that the kernel hands out by itself and those of the campaign.
  return "udpm://239.255.76.67:" + std::to_string(10'000 + getpid() % 10'000) + "?ttl=0";
}

double ResidentBytes(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/statm");
  double size = 0, resident = 0;
  file >> size >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

std::string PatientTask(int time_limit_s) {
  return R"(model: {name: point_mass, dt: 0.15}
domain:
  state: {lower: [-20, -20, -5.4, -5.4], upper: [20, 20, 5.4, 5.4]}
  input: {lower: [-3, -3], upper: [3, 3]}
  balls:
    - {coordinates: [vx, vy], center: [0, 0], radius: 5.4}
declaration:
  lipschitz:
    px: {vx: 0.006914008, vy: 0.005689541}
    py: {vx: 0.005689541, vy: 0.006914008}
    vx: {vx: 0.092186775, vy: 0.075860540}
    vy: {vx: 0.075860540, vy: 0.092186775}
  noise_bound: [0, 0, 0, 0]
  state_error: {}
transitions: )" FOREREACH_SOURCE_DIR R"(/config/data/point_mass_100.csv
task:
  initial_set: {center: [0, 0, 0, 0], half_width: [0.05, 0.05, 0.03, 0.03]}
  projection: [px, py]
  between: samples
  obstacles:
    - circle: {center: [0, 2], radius: 0.8}
gate: {max_age_ms: 20000, max_ahead_ms: 50, certificate_lifetime_ms: 60000, arming: none, max_clock_jump_ms: 10000,
  obstacles: task, state: state}
planner:
  goal: [6, 0]
  goal_radius: 0.5
  cruise_speed: 1.5
  braking: 1
  progress_steps: 6
  tail_steps: 16
  lead_steps: 4
  stop: {ax: -vx/dt, ay: -vy/dt}
  hints: {ax: (desired_speed*cos(desired_heading) - vx)/0.4, ay: (desired_speed*sin(desired_heading) - vy)/0.4}
  at_rest: {vx: 0.001, vy: 0.001}
robot:
  start: [0, 0, 0, 0]
  step_period_ms: 100
  step_error_ms: any
  residual: {name: velocity_knee}
  time_limit_s: )" +
         std::to_string(time_limit_s) + "\n";
}

BusProbe::BusProbe(const std::string& url, const std::vector<std::string>& channels) {
  try {
    bus_ = OpenBus(url);
  } catch (const BusError& error) {
    ADD_FAILURE() << error.what();
    throw;
  }
  for (const std::string& channel : channels) {
    heard_[channel];
    bus_->Subscribe(channel, [this, channel](const Received& received) {
      const Bytes message = WithoutSignature(received.raw);
      heard_[channel].emplace_back(message.begin(), message.end());
    });
  }
}

bool BusProbe::WaitUntil(const std::function<bool()>& done) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!done()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    bus_->Dispatch(10);
  }
  return true;
}

void BusProbe::ListenFor(std::chrono::milliseconds time) {
  const auto deadline = std::chrono::steady_clock::now() + time;
  while (std::chrono::steady_clock::now() < deadline) bus_->Dispatch(10);
}

candidate_plan_t CandidateFor(const Config& config, std::int64_t plan_id, const Eigen::VectorXd& control, int steps,
                              std::chrono::milliseconds lead) {
  candidate_plan_t candidate{.utime = WallClockUs(), .plan_id = plan_id};
  SetText(candidate.source, "process test");
  candidate.start_utime = candidate.utime + std::chrono::microseconds(lead).count();
  candidate.step_us = static_cast<std::int64_t>(config.robot.step_period_ms * 1e3);
  candidate.num_states = static_cast<std::int16_t>(config.initial_set.dim());
  candidate.num_inputs = static_cast<std::int16_t>(control.size());
  candidate.num_steps = candidate.progress_steps = static_cast<std::int16_t>(steps);
  const Eigen::VectorXd &lower = config.initial_set.lower(), &upper = config.initial_set.upper();
  std::ranges::copy(((lower + upper) / 2).eval(), candidate.initial_center);
  std::ranges::copy(((upper - lower) / 2).eval(), candidate.initial_half_width);
  for (int t = 0; t < steps; ++t) std::ranges::copy(control, candidate.control[t]);
  return candidate;
}

void ThrowNotA(const char* type, const std::string& channel) {
  throw std::runtime_error("what came on " + channel + " is not a " + type);
}

}  // namespace forereach
