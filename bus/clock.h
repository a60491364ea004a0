/** Clocks. */
#pragma once

#include <cstdint>
#include <functional>

namespace forereach {

/** A source of the time in microseconds since the Unix epoch. */
using Clock = std::function<std::int64_t()>;
/** The system's wall clock, in microseconds since the Unix epoch. */
[[nodiscard]] std::int64_t WallClockUs();
/** The monotonic clock, in microseconds since an arbitrary time. */
[[nodiscard]] std::int64_t SteadyClockUs();

}  // namespace forereach
