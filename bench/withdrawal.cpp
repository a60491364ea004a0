// From the arrival of an obstacle to the withdrawal of the plan that a robot is driving.
//   withdrawal [--rounds N]        prints one JSON document, microseconds
// Two processes on loopback UDP multicast: the certifier's node, and a robot that executes certified plans under the
// supervisor, on a treadmill: its state is the middle of the slice, and it is back at the start when it holds. This
// process is planner and perception. In each round the robot drives a plan of 12 steps; at a random moment of one step
// an obstacle appears on its path. `withdrawn` is the time from handing the obstacles to the bus to having the
// withdrawal, `answered` that to having the robot's answer.
#include <chrono>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "bench/candidates.h"
#include "bench/latencies.h"
#include "bench/measurement.h"
#include "certifier/gate/obstacle_message.h"
#include "certifier/process/certifier_node.h"
#include "robot/supervisor.h"

namespace forereach::bench {
namespace {

constexpr int kObservations = 400, kWarmUp = 10;
constexpr std::int64_t kPeriodUs = 20'000;

// Executes what the guard lets pass.
class Treadmill final : public Node, private Supervisor::Robot {
 public:
  Treadmill(const Config& config, Bus& bus)
      : bus_(bus),
        supervisor_({.guard = {.num_states = config.problem->model->num_states(),
                               .num_inputs = config.problem->model->num_inputs(),
                               .step_us = kPeriodUs}},
                    *this) {
    bus.Subscribe(config.bus.certified, [this](const Received& received) {
      if (const auto certified = Decoded<certified_plan_t>(received.bytes)) plan_ = *certified;
      supervisor_.OnCertified(received.raw, received.utime);
    });
    bus.Subscribe(config.bus.withdrawn,
                  [this](const Received& received) { supervisor_.OnWithdrawn(received.raw, received.utime); });
    state_.resize(static_cast<std::size_t>(config.problem->model->num_states()));
  }

  void Tick(std::int64_t now_us) override {
    if (next_ == 0) next_ = now_us;
    for (; next_ <= now_us; next_ += kPeriodUs) {
      step_ = supervisor_.control().empty() ? 0 : step_ + 1;
      for (std::size_t k = 0; k < state_.size(); ++k)
        state_[k] = (plan_.slice_lower[step_][k] + plan_.slice_upper[step_][k]) / 2;
      supervisor_.Boundary(next_, now_us);
    }
  }

 private:
  [[nodiscard]] std::span<const double> state() const override { return state_; }
  void Hold() override {}
  void Send(const std::string& channel, Bytes message) override { bus_.Publish(channel, message); }
  void Reload() override {}

  Bus& bus_;
  std::vector<double> state_;
  certified_plan_t plan_{};
  int step_ = 0;
  std::int64_t next_ = 0;
  Supervisor supervisor_;
};

// Planner and perception.
class Driver {
 public:
  Driver(const std::string& url, const Config& config, const Task& clear, const Task& blocked)
      : channels_(config.bus), clear_(clear), blocked_(blocked), bus_(OpenBus(url)), candidate_(MakeCandidate(clear)) {
    candidate_.step_us = kPeriodUs;
    bus_->Subscribe(channels_.robot_state, [this](const Received& r) { state_ = Decoded<robot_state_t>(r.bytes); });
    bus_->Subscribe(channels_.withdrawn, [this](const Received& r) {
      if (const auto message = Decoded<withdrawal_t>(r.bytes)) withdrawn_ = message->plan_id;
    });
    bus_->Subscribe(channels_.event, [this](const Received& r) {
      const auto message = Decoded<execution_event_t>(r.bytes);
      if (message && message->kind == execution_event_t::WITHDRAWN) answered_ = message->plan_id;
    });
  }

  // False if a message was lost or the plan was not driven.
  bool Round(Latencies& withdrawn, Latencies& answered) {
    See(clear_);
    if (!Await([this] { return state_ && state_->mode == robot_state_t::STANDING; })) return false;
    See(clear_);
    const std::int64_t now = WallClockUs();
    Stamp(candidate_, now, now);
    candidate_.sequence = sequence_++;
    candidate_.start_utime = state_->utime + 3 * kPeriodUs;
    bus_->Publish(channels_.candidate, candidate_);
    if (!Await([this] { return state_->executing_plan_id == candidate_.plan_id && state_->executing_step >= 1; }))
      return false;
    std::this_thread::sleep_for(std::chrono::microseconds(random_() % kPeriodUs));
    const auto begin = std::chrono::steady_clock::now();
    const auto elapsed = [&] {
      return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
    };
    See(blocked_);
    if (!Await([this] { return withdrawn_ == candidate_.plan_id; })) return false;
    withdrawn.Add(elapsed());
    if (!Await([this] { return answered_ == candidate_.plan_id; })) return false;
    answered.Add(elapsed());
    return true;
  }

 private:
  void See(const Task& task) {
    obstacles_t message = ToMessage(task.obstacles, WallClockUs());
    message.sequence = obstacles_++;
    bus_->Publish(channels_.obstacles, message);
  }
  template <class Condition>
  bool Await(const Condition& condition) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(500);
    while (!condition()) {
      bus_->Dispatch(1);
      if (std::chrono::steady_clock::now() > deadline) return false;
    }
    return true;
  }

  const BusOptions channels_;
  const Task &clear_, &blocked_;
  std::unique_ptr<Bus> bus_;
  candidate_plan_t candidate_;
  std::int64_t sequence_ = 0, obstacles_ = 0, withdrawn_ = -1, answered_ = -1;
  std::optional<robot_state_t> state_;
  std::mt19937 random_{1};
};

nlohmann::json Measure(int rounds) {
  const Task clear = MakeTask(Scenario::kBicycle, kObservations),
             blocked = MakeBlockedTask(Scenario::kBicycle, kObservations);
  Config config = MakeConfig(clear);
  const auto problem = std::make_shared<Problem>(*config.problem);
  problem->declaration.state_error.setZero(problem->model->num_states());
  config.problem = problem;
  config.gate.needs_robot_state = true;
  config.gate.obstacles = ObstaclesSource::kBus;
  config.gate.obstacles_lost_ms = kNeverLost;
  config.gate.step_error_ms = kAnyTime;
  config.gate.learns = false;  // on a treadmill nothing can be learned
  const std::string url = PortUrl(0);
  const Child certifier(url, true, [&](Bus& bus) { return std::make_unique<CertifierNode>(config, bus); });
  const Child robot(url, true, [&](Bus& bus) { return std::make_unique<Treadmill>(config, bus); });
  Driver driver(url, config, clear, blocked);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  Latencies unused(kWarmUp), withdrawn(static_cast<std::size_t>(rounds)), answered(static_cast<std::size_t>(rounds));
  for (int i = 0; i < kWarmUp; ++i) (void)driver.Round(unused, unused);
  int lost = 0;
  for (int i = 0; i < rounds; ++i) lost += !driver.Round(withdrawn, answered);
  if (lost == rounds) throw std::runtime_error("no plan was withdrawn");
  return {{"withdrawn", withdrawn.ToJson()}, {"answered", answered.ToJson()}, {"lost", lost}};
}

}  // namespace
}  // namespace forereach::bench

int main(int argc, char** argv) {
  using namespace forereach;
  using namespace forereach::bench;
  int rounds = 500;
  const Command program{.name = "withdrawal",
                        .purpose = "Time from an obstacle on the bus to the withdrawal of the plan that a robot drives",
                        .options = {{"--rounds", &rounds, "", "plans that are withdrawn", NumberRange{1, 1'000'000}}}};
  return Print(program, argc, argv, [&] { return Measure(rounds); });
}
