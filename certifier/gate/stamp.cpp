#include "certifier/gate/stamp.h"

#include <cmath>

namespace forereach {

Stamp CheckStamp(std::int64_t utime, std::int64_t now_us, const GateOptions& options) {
  const std::int64_t max_age = Microseconds(options.max_age_ms), max_ahead = Microseconds(options.max_ahead_ms);
  return {FreshnessOf(utime, now_us, max_age, max_ahead), WhyNotFresh(utime, now_us, max_age, max_ahead)};
}

bool IsNotAfter(std::int64_t utime, std::int64_t then_us, std::int64_t now_us, const GateOptions& options) {
  return IsNotAfter(utime, then_us, now_us, Microseconds(options.max_ahead_ms));
}

std::int64_t Microseconds(double milliseconds) { return std::llround(milliseconds * 1e3); }

}  // namespace forereach
