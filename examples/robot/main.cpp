// A robot that executes certified plans and nothing else: a point mass as in config/point_mass.yaml, without keys. Your
// robot also sets guard.keys, config_digest, model_digest and domain (robot/guard.h), and signs its messages.
//   robot [URL [BOUNDARIES]]      by default on the loopback bus, without end
#include <chrono>
#include <iostream>
#include <stdexcept>

#include <lcm/lcm-cpp.hpp>

#include "robot/supervisor.h"

using forereach::Bytes, forereach::Supervisor, lcm::ReceiveBuffer;

static std::int64_t Now() {
  return duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}
static Bytes BytesOf(const ReceiveBuffer* m) { return {static_cast<const std::uint8_t*>(m->data), m->data_size}; }

class Robot final : public Supervisor::Robot {
 public:
  explicit Robot(lcm::LCM& lcm) : lcm_(lcm) {}
  std::span<const double> state() const override { return x_; }                                   // your sensors
  void Hold() override { x_[2] = x_[3] = 0; }                                                     // your brakes
  int StepsToRest(std::span<const double>, std::span<const double>) const override { return 0; }  // their time
  void Reload() override {}  // without a digest it accepts plans of every task
  void Send(const std::string& channel, Bytes message) override {
    if (lcm_.publish(channel, message.data(), static_cast<unsigned>(message.size())) != 0)
      throw std::runtime_error("not sent");  // the supervisor sends it again later
  }
  void Move(std::span<const double> control) {  // your actuators, for one step; without a control they hold
    for (std::size_t k = 0; k < control.size(); ++k) {
      x_[k] += 0.15 * x_[k + 2] + 0.15 * 0.15 / 2 * control[k];
      x_[k + 2] += 0.15 * control[k];
    }
  }

 private:
  lcm::LCM& lcm_;
  double x_[4] = {0, 0, 0, 0};  // px, py, vx, vy
};

int main(int argc, char** argv) {
  lcm::LCM lcm(argc > 1 ? argv[1] : "udpm://239.255.76.67:7667?ttl=0");
  Robot robot(lcm);
  Supervisor supervisor({.guard = {.num_states = 4, .num_inputs = 2, .step_us = 150'000}}, robot);
  using Handler = void (*)(const ReceiveBuffer*, const std::string&, Supervisor*);
  const Handler certified = [](auto* m, auto&, auto* to) { to->OnCertified(BytesOf(m), Now()); };
  const Handler withdrawn = [](auto* m, auto&, auto* to) { to->OnWithdrawn(BytesOf(m), Now()); };
  const Handler fault = [](auto* m, auto&, auto* to) { to->OnFault(BytesOf(m), Now()); };
  const Handler command = [](auto* m, auto&, auto* to) {
    if (const std::string why = to->OnCommand(BytesOf(m), Now()); !why.empty()) std::cerr << why << '\n';
  };
  for (const auto& [channel, handler] :
       {std::pair("PLAN_CERTIFIED", certified), {"PLAN_WITHDRAWN", withdrawn}, {"FAULT", fault}, {"COMMAND", command}})
    lcm.subscribeFunction(channel, handler, &supervisor);
  std::int64_t boundary = Now();
  for (int left = argc > 2 ? std::stoi(argv[2]) : -1; left != 0; --left, boundary += 150'000) {
    while (Now() < boundary) lcm.handleTimeout(1);
    robot.Move(supervisor.control());  // a simulated step; yours has ended by now
    supervisor.Boundary(boundary, Now());
  }
  std::cout << supervisor.counts().boundaries << " boundaries, " << supervisor.counts().steps << " steps\n";
}
