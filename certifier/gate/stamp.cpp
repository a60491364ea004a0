#include "certifier/gate/stamp.h"

#include <cmath>

#include "certifier/numerics/text.h"

namespace forereach {

Stamp Judge(std::int64_t utime, std::int64_t now_us, const GateOptions& options) {
  const Freshness freshness =
      FreshnessOf(utime, now_us, Microseconds(options.max_age_ms), Microseconds(options.max_ahead_ms));
  switch (freshness) {
    case Freshness::kStale:
      return {freshness,
              "stamped " + Milliseconds(now_us, utime) + " ago, at most " + ToText(options.max_age_ms) + " ms allowed"};
    case Freshness::kFuture:
      return {freshness, "stamped " + Milliseconds(utime, now_us) + " ahead, at most " + ToText(options.max_ahead_ms) +
                             " ms allowed"};
    case Freshness::kFresh: break;
  }
  return {freshness, ""};
}

bool IsNotAfter(std::int64_t utime, std::int64_t then_us, std::int64_t now_us, const GateOptions& options) {
  return utime <= then_us && Judge(then_us, now_us, options).freshness != Freshness::kFuture;
}

std::int64_t Microseconds(double milliseconds) { return std::llround(milliseconds * 1e3); }

std::string Milliseconds(std::int64_t later_us, std::int64_t earlier_us) {
  return ToText(std::round((static_cast<double>(later_us) - static_cast<double>(earlier_us)) / 1e3)) + " ms";
}

}  // namespace forereach
