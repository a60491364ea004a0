/** How far the boundaries of the simulated robot's steps are off their times: by up to half of robot.step_error_ms
early or late. So a boundary is within all of it of the plan's start and of the plan's first step, whichever these are.
*/
#pragma once

#include <cstdint>
#include <random>

#include "task/config.h"

namespace forereach {

class StepJitter final {
 public:
  explicit StepJitter(const Config& config);

  /** The offset of the next boundary, microseconds. random: uniform. adversarial: the most, early or late. The draws
  depend on the seed and the number of calls only. */
  [[nodiscard]] std::int64_t Next();

 private:
  std::int64_t most_us_;
  bool is_adversarial_;
  std::mt19937_64 random_;
};

}  // namespace forereach
