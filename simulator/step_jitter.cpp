#include "simulator/step_jitter.h"

#include "task/step_time.h"

namespace forereach {

StepJitter::StepJitter(const Config& config)
    : most_us_(config.robot.step_jitter == "none" ? 0 : StepErrorUs(config.gate).value_or(0) / 2),
      is_adversarial_(config.robot.step_jitter == "adversarial"),
      random_(static_cast<std::uint64_t>(config.robot.disturbance_seed) ^ 0x6a697474) {}

std::int64_t StepJitter::Next() {
  if (most_us_ == 0) return 0;
  const std::uint64_t drawn = random_();
  if (is_adversarial_) return drawn >> 63 == 0 ? most_us_ : -most_us_;
  return static_cast<std::int64_t>(drawn % static_cast<std::uint64_t>(2 * most_us_ + 1)) - most_us_;
}

}  // namespace forereach
