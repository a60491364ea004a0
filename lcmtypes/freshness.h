/** The freshness of a message: functions of its stamp and of times, all in microseconds. */
#pragma once

#include <cstdint>
#include <string>

#include "forereach/numerics/compilation.h"

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

/** The reason why it is not fresh, as text: "stamped 700 ms ago, at most 500 ms allowed"; empty if it is. */
[[nodiscard]] std::string WhyNotFresh(std::int64_t stamp, std::int64_t now, std::int64_t max_age,
                                      std::int64_t max_ahead);

/** True if a fresh message with this stamp is no later than what happened at `then`. If the clock was set back since,
so that `then` is more than max_ahead after `now`, their order is unknown: false. */
[[nodiscard]] constexpr bool IsNotAfter(std::int64_t stamp, std::int64_t then, std::int64_t now,
                                        std::int64_t max_ahead) noexcept {
  return stamp <= then && FreshnessOf(then, now, INT64_MAX, max_ahead) != Freshness::kFuture;
}

/** later - earlier as text, to the nearest millisecond: "12 ms". */
[[nodiscard]] std::string Milliseconds(std::int64_t later, std::int64_t earlier);

}  // namespace forereach
