/** What disturbs the simulated robot: w of x+ = f0(x, u) + r(x, u) + w, within declaration.disturbance; the error of
its measurements, within declaration.state_error; and that of the inputs that act, within declaration.input_error.

x+ and f0 + r are rounded numbers. The draws keep one unit in the last place of f0 + r away from the bound, which leaves
room for both roundings: the robot stays within the declaration in real arithmetic. */
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "forereach/residual/declaration.h"
#include "task/robot_options.h"

namespace forereach {

class Disturbance final {
 public:
  /** The longest time for which an adversary keeps its signs, in steps. */
  static constexpr int kLongestHold = 32;

  /** @param options robot.disturbance "none", "random" or "adversarial", and its seed. */
  Disturbance(const Declaration& declaration, const RobotOptions& options);
  /** The error of a measurement: likewise by robot.sensor_error. */
  [[nodiscard]] static Disturbance OfMeasurements(const Declaration& declaration, const RobotOptions& options);
  /** What acts beside a plan's inputs: likewise by robot.input_error. */
  [[nodiscard]] static Disturbance OfInputs(const Declaration& declaration, const RobotOptions& options);

  /** Adds w to f0 + r of the step at z, or the error to the true state or the plan's inputs, n or m entries. z is read
  only where the bound depends on state and input. random: each w_k is uniform in [-bound, bound]. adversarial: w_k =
  bound or -bound; all signs are drawn anew after 1 to kLongestHold steps, so that the errors of many steps add up. The
  draws depend on the seed and the number of calls only, not on the standard library. */
  void Add(std::span<double> next, std::span<const double> z = {});

 private:
  Disturbance(const Eigen::VectorXd& bounds, std::shared_ptr<const GrowingDisturbance> growing, const std::string& kind,
              std::uint64_t seed);
  [[nodiscard]] double Share(std::size_t k);

  const Eigen::VectorXd bounds_;
  const std::shared_ptr<const GrowingDisturbance> growing_;  // or null
  std::vector<Region> regions_;
  const bool acts_, adversarial_;
  std::mt19937_64 random_;
  std::vector<double> signs_;
  int steps_left_ = 0;  // until the signs change
};

}  // namespace forereach
