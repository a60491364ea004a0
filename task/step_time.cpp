#include "task/step_time.h"

#include <cmath>

#include "forereach/numerics/directed.h"

namespace forereach {

std::optional<std::int64_t> MaxJitterUs(const GateOptions& options) {
  if (!options.max_clock_error_ms) return std::nullopt;
  return std::llround(*options.max_clock_error_ms * 1e3) / 2;
}

double LongestPeriod(const Config& config) {
  const std::int64_t longer_us = MaxJitterUs(config.gate).value_or(0);
  return longer_us > 0 ? AddUp(config.period, DivUp(static_cast<double>(longer_us), 1e6)) : config.period;
}

}  // namespace forereach
