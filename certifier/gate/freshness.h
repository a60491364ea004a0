/** The freshness of a stamp, as a pure function of times. */
#pragma once

#include <cstdint>

namespace forereach {

enum class Freshness { kFresh, kStale, kFuture };

/** kStale if `stamp` is more than max_age before `now`, kFuture if it is more than max_ahead after it. All in
microseconds, none negative; exact for all values. */
[[nodiscard]] constexpr Freshness FreshnessOf(std::int64_t stamp, std::int64_t now, std::int64_t max_age,
                                              std::int64_t max_ahead) noexcept {
  if (stamp <= now)  // The difference of two's complement numbers, taken unsigned, does not overflow.
    return static_cast<std::uint64_t>(now) - static_cast<std::uint64_t>(stamp) > static_cast<std::uint64_t>(max_age)
               ? Freshness::kStale
               : Freshness::kFresh;
  return static_cast<std::uint64_t>(stamp) - static_cast<std::uint64_t>(now) > static_cast<std::uint64_t>(max_ahead)
             ? Freshness::kFuture
             : Freshness::kFresh;
}

}  // namespace forereach
