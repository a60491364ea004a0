// A robot that executes certified plans and nothing else: a point mass, as config/point_mass.yaml and
// examples/python/rover.yaml have it. It reads sizes, digests, channels and key from the task file.
//   robot TASK [KEYS [URL [BOUNDARIES]]]      without end, unless it is said after how many steps
#include <csignal>
#include <iostream>

#include "bus/clock.h"
#include "clients/robot_client.h"

class PointMass final : public forereach::RobotClient::Robot {
 public:
  std::span<const double> state() const override { return x_; }                                   // your sensors
  void Hold() override { x_[2] = x_[3] = 0; }                                                     // your brakes
  int StepsToRest(std::span<const double>, std::span<const double>) const override { return 0; }  // their time
  void Move(std::span<const double> control, double dt) {  // your actuators, for one step; without a control they hold
    for (std::size_t k = 0; k < control.size(); ++k) {
      x_[k] += dt * x_[k + 2] + dt * dt / 2 * control[k];
      x_[k + 2] += dt * control[k];
    }
  }

 private:
  double x_[4] = {0, 0, 0, 0};  // px, py, vx, vy
};

static volatile std::sig_atomic_t is_told_to_end = 0;

int main(int argc, char** argv) try {
  std::signal(SIGTERM, [](int) { is_told_to_end = 1; });
  const auto argument = [&](int k) { return argc > k ? argv[k] : ""; };
  PointMass robot;
  forereach::RobotClient client({argument(1), argument(2), argument(3)}, robot);
  std::int64_t boundary = forereach::WallClockUs();
  for (int left = argc > 4 ? std::stoi(argument(4)) : -1; left != 0 && !is_told_to_end; --left) {
    client.Listen(boundary, [] { return is_told_to_end != 0; });
    robot.Move(client.supervisor().control(), static_cast<double>(client.step_us()) * 1e-6);  // yours has ended by now
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
