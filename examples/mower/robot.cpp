// The mower's robot: it executes certified plans and nothing else. Sizes, digests, channels and key are the task
// file's.
//   robot TASK [KEYS [URL [BOUNDARIES]]]      without end, unless it is said after how many steps
#include <cmath>
#include <csignal>
#include <iostream>

#include "bus/clock.h"
#include "clients/robot_client.h"

// In place of a real one: it turns slower than it is told, and loses speed where it turns.
class Mower final : public forereach::RobotClient::Robot {
 public:
  std::span<const double> state() const override { return x_; }                                   // your odometry
  void Hold() override { x_[3] = x_[4] = 0; }                                                     // your brakes
  int StepsToRest(std::span<const double>, std::span<const double>) const override { return 0; }  // their time
  void Move(std::span<const double> u, double dt) {  // your motors, for one step
    for (int i = 0; i < 100 && !u.empty(); ++i) {
      const double v = x_[3], omega = x_[4], h = dt / 100;
      x_[0] += h * v * std::cos(x_[2]);
      x_[1] += h * v * std::sin(x_[2]);
      x_[2] += h * omega;
      x_[3] += h * (u[0] - 0.03 * std::abs(omega) - v) / 0.2;
      x_[4] += h * (0.8 * u[1] - omega) / 0.2;
    }
  }

 private:
  double x_[5] = {};  // x, y, theta, v, omega
};

static volatile std::sig_atomic_t is_told_to_end = 0;

int main(int argc, char** argv) try {
  std::signal(SIGTERM, [](int) { is_told_to_end = 1; });
  const auto argument = [&](int k) { return argc > k ? argv[k] : ""; };
  Mower mower;
  forereach::RobotClient client({argument(1), argument(2), argument(3)}, mower);
  std::int64_t boundary = forereach::WallClockUs();
  for (int left = argc > 4 ? std::stoi(argument(4)) : -1; left != 0 && !is_told_to_end; --left) {
    client.Listen(boundary, [] { return is_told_to_end != 0; });
    mower.Move(client.supervisor().control(), static_cast<double>(client.step_us()) * 1e-6);
    client.Boundary(boundary);
    boundary += client.step_us();
  }
  const auto& counts = client.supervisor().counts();
  std::cout << counts.boundaries << " boundaries, " << counts.steps << " steps, " << counts.steps_inside
            << " inside their slices\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
