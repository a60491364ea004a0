/** What time it is. */
#pragma once

#include <cstdint>
#include <functional>

namespace forereach {

/** Microseconds since the Unix epoch. */
using Clock = std::function<std::int64_t()>;
[[nodiscard]] std::int64_t WallClockUs();
/** Microseconds since some time, by a clock that nobody sets. */
[[nodiscard]] std::int64_t SteadyClockUs();

}  // namespace forereach
