#include "cli/step_times.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include "forereach/numerics/text.h"

namespace forereach {
namespace {

// What is neither is nonsense, which may come from anybody.
constexpr std::int64_t kLatest = std::int64_t{1} << 60, kLongest = std::int64_t{3'600'000'000};
bool IsTime(std::int64_t utime) { return -kLatest <= utime && utime <= kLatest; }

// To tenths, up.
double MillisecondsUp(double us) { return std::ceil(us / 100) / 10; }

std::string Milliseconds(std::int64_t us) { return fmt::format("{} ms", ToText(static_cast<double>(us) / 1e3)); }

}  // namespace

void StepTimes::HearStep(std::int64_t utime, std::int64_t duration_us) {
  if (!IsTime(utime) || duration_us < 0 || duration_us > kLongest) return;
  if (utime != next_utime_) off_us_ = 0;
  next_utime_ = utime + step_us_;
  off_us_ += duration_us - step_us_;
  step_error_us_ = std::max(step_error_us_, std::abs(off_us_));
  ++steps_;
}

void StepTimes::HearStamp(std::int64_t utime, std::int64_t arrival_us) {
  if (!IsTime(utime)) return;
  const std::int64_t delay = arrival_us - utime;
  least_delay_us_ = stamps_ == 0 ? delay : std::min(least_delay_us_, delay);
  largest_delay_us_ = stamps_ == 0 ? delay : std::max(largest_delay_us_, delay);
  ++stamps_;
}

std::optional<double> StepTimes::StepErrorMs() const {
  if (steps_ == 0) return std::nullopt;
  return MillisecondsUp(static_cast<double>(kMargin * step_error_us_));
}

std::optional<double> StepTimes::ClockErrorMs(double delay_ms) const {
  if (stamps_ == 0) return std::nullopt;
  const double late = static_cast<double>(largest_delay_us_) - 1e3 * delay_ms;
  return MillisecondsUp(kMargin * std::max({static_cast<double>(-least_delay_us_), late, 0.0}));
}

std::string StepTimes::Text(double seconds, double delay_ms) const {
  std::string text;
  if (const auto error = StepErrorMs())
    text += fmt::format("steps: {} in {} s, boundaries up to {} from their times\n      -> robot.step_error_ms: {}\n",
                        steps_, ToText(seconds), Milliseconds(step_error_us_), ToText(*error));
  else
    text += fmt::format("steps: none in {} s: let the robot drive meanwhile\n", ToText(seconds));
  if (const auto error = ClockErrorMs(delay_ms))
    text += fmt::format(
        "clocks: {} states and obstacles in {} s arrive {} to {} after their stamps, bus.delay_ms is {}\n      -> "
        "gate.max_clock_error_ms: {}, if obstacles move\n",
        stamps_, ToText(seconds), Milliseconds(least_delay_us_), Milliseconds(largest_delay_us_), ToText(delay_ms),
        ToText(*error));
  else
    text += fmt::format("clocks: neither states nor obstacles in {} s\n", ToText(seconds));
  return text + fmt::format("Proposed is {} times the largest that was measured; what was not heard may be larger.\n",
                            kMargin);
}

}  // namespace forereach
