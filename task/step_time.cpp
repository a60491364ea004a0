#include "task/step_time.h"

#include <algorithm>
#include <cmath>

#include "forereach/numerics/interval.h"
#include "forereach/numerics/limits.h"

namespace forereach {
namespace {

std::int64_t MicrosecondsOf(double ms) { return std::llround(ms * 1e3); }

// step_us, to the nearest double, as a model.dt is that was written as whole microseconds.
double StepSeconds(const Config& config) { return static_cast<double>(StepUs(config)) / 1e6; }

double SecondsUp(std::int64_t us) { return DivUp(static_cast<double>(us), 1e6); }

}  // namespace

std::optional<std::int64_t> StepErrorUs(const GateOptions& options) {
  if (!options.step_error_ms || *options.step_error_ms == kAnyTime) return std::nullopt;
  return MicrosecondsOf(*options.step_error_ms);
}

std::int64_t ScheduleErrorUs(const GateOptions& options) {
  return MicrosecondsOf(options.max_clock_error_ms.value_or(0)) + StepErrorUs(options).value_or(0);
}

std::int64_t StepUs(const Config& config) { return std::llround(config.period * 1e6); }

double StepErrorSeconds(const Config& config) {
  const std::optional<std::int64_t> error_us = StepErrorUs(config.gate);
  if (!error_us || (*error_us == 0 && StepSeconds(config) == config.period)) return 0;
  // model.dt need not be a whole number of microseconds, by which guards count: over a plan the difference adds up
  // (docs/soundness.md, 3.15).
  const Interval differs = Interval(static_cast<double>(StepUs(config))) / Interval(1e6) - Interval(config.period);
  return AddUp(SecondsUp(*error_us), MulUp(kMaxSteps, differs.Magnitude()));
}

double LongestPeriod(const Config& config) {
  const std::optional<std::int64_t> error_us = StepErrorUs(config.gate);
  const double step = error_us ? std::max(config.period, StepSeconds(config)) : config.period;
  return error_us.value_or(0) > 0 ? AddUp(step, SecondsUp(*error_us)) : step;
}

}  // namespace forereach
