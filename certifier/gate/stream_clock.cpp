#include "certifier/gate/stream_clock.h"

#include <cstdlib>

#include <fmt/core.h>

#include "certifier/gate/stamp.h"
#include "forereach/numerics/text.h"
#include "task/step_time.h"

namespace forereach {
namespace {

std::string Allowed(std::int64_t most_us) {
  return fmt::format(", at most {} ms are allowed", ToText(static_cast<double>(most_us) / 1e3));
}

std::string Lag(std::int64_t lag_us) {
  return fmt::format("{} ms {}", ToText(static_cast<double>(std::abs(lag_us)) / 1e3), lag_us < 0 ? "before" : "after");
}

}  // namespace

std::optional<ClockBounds> ClockBoundsOf(const Config& config) {
  if (!config.gate.max_clock_error_ms) return std::nullopt;
  const std::int64_t error_us = Microseconds(*config.gate.max_clock_error_ms);
  return ClockBounds{error_us, Microseconds(config.bus.delay_ms), ScheduleErrorUs(config.gate) - error_us};
}

std::string WhyOff(const Arrival& arrival, const ClockBounds& bounds) {
  // A message is never early by more than the clocks differ, but late by the network, too.
  const std::int64_t late = bounds.error_us + bounds.delay_us;
  switch (FreshnessOf(arrival.utime, arrival.at_us, late, bounds.error_us)) {
    case Freshness::kStale:
      return fmt::format("behind, or its messages are late: the last one arrived {} after its stamp{}",
                         Milliseconds(arrival.at_us, arrival.utime), Allowed(late));
    case Freshness::kFuture:
      return fmt::format("ahead: the last message arrived {} before its stamp{}",
                         Milliseconds(arrival.utime, arrival.at_us), Allowed(bounds.error_us));
    case Freshness::kFresh: break;
  }
  return {};
}

std::string WhyApart(const Arrival& robot, const Arrival& obstacles, const ClockBounds& bounds) {
  const std::int64_t of_robot = robot.at_us - robot.utime, of_obstacles = obstacles.at_us - obstacles.utime;
  // Each arrives late by its clock and the network; a robot's stamp is also off by what a step may be.
  const std::int64_t most = bounds.error_us + bounds.delay_us + bounds.step_us;
  if (std::abs(of_robot - of_obstacles) <= most) return {};
  return fmt::format(
      "the clocks of the robot and of the obstacles' sender are apart: their messages arrive {} and {} their stamps{}",
      Lag(of_robot), Lag(of_obstacles), Allowed(most));
}

}  // namespace forereach
