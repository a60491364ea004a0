/** Tests of a message's stamp by the limits of a task, gate.max_age_ms and gate.max_ahead_ms. */
#pragma once

#include <cstdint>
#include <string>

#include "lcmtypes/freshness.h"
#include "task/gate_options.h"

namespace forereach {

struct Stamp {
  Freshness freshness;
  std::string fault;  ///< The reason why it is not fresh, as text; empty if it is fresh.
};

/** The freshness of a message with the stamp `utime` that arrived at `now_us`, both microseconds since the Unix
epoch. */
[[nodiscard]] Stamp CheckStamp(std::int64_t utime, std::int64_t now_us, const GateOptions& options);

/** IsNotAfter of lcmtypes/freshness.h, with the task's max_ahead. */
[[nodiscard]] bool IsNotAfter(std::int64_t utime, std::int64_t then_us, std::int64_t now_us,
                              const GateOptions& options);

/** Milliseconds as microseconds, rounded to the nearest. */
[[nodiscard]] std::int64_t Microseconds(double milliseconds);

}  // namespace forereach
