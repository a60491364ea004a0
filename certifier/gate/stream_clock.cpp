#include "certifier/gate/stream_clock.h"

#include <cstdlib>

#include "certifier/gate/stamp.h"
#include "forereach/numerics/text.h"
#include "task/step_time.h"

namespace forereach {
namespace {

std::string Allowed(std::int64_t most_us) {
  return ", at most " + ToText(static_cast<double>(most_us) / 1e3) + " ms are allowed";
}

std::string Lag(std::int64_t lag_us) {
  return ToText(static_cast<double>(std::abs(lag_us)) / 1e3) + (lag_us < 0 ? " ms before" : " ms after");
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
      return "behind, or its messages are late: the last one arrived " + Milliseconds(arrival.at_us, arrival.utime) +
             " after its stamp" + Allowed(late);
    case Freshness::kFuture:
      return "ahead: the last message arrived " + Milliseconds(arrival.utime, arrival.at_us) + " before its stamp" +
             Allowed(bounds.error_us);
    case Freshness::kFresh: break;
  }
  return {};
}

std::string WhyApart(const Arrival& robot, const Arrival& obstacles, const ClockBounds& bounds) {
  const std::int64_t of_robot = robot.at_us - robot.utime, of_obstacles = obstacles.at_us - obstacles.utime;
  const std::int64_t most = bounds.error_us + bounds.delay_us + bounds.step_us;
  if (std::abs(of_robot - of_obstacles) <= most) return {};
  return "the clocks of the robot and of the obstacles' sender are apart: their messages arrive " + Lag(of_robot) +
         " and " + Lag(of_obstacles) + " their stamps" + Allowed(most);
}

}  // namespace forereach
