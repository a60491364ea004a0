/** A message's stamp against the clock, by what a task allows: gate.max_age_ms and gate.max_ahead_ms. */
#pragma once

#include <cstdint>
#include <string>

#include "certifier/gate/freshness.h"
#include "certifier/task/config.h"

namespace forereach {

struct Stamp {
  Freshness freshness;
  std::string fault;  ///< Why it is not fresh, in words; empty if it is.
};

/** Of a message stamped `utime` that came at `now_us`, both microseconds since the Unix epoch. */
[[nodiscard]] Stamp Judge(std::int64_t utime, std::int64_t now_us, const GateOptions& options);

/** True if a fresh message stamped `utime` is no later than what happened at `then_us`. Where the clock has been set
back since, so that `then_us` lies ahead, nothing is known of their order: false. */
[[nodiscard]] bool IsNotAfter(std::int64_t utime, std::int64_t then_us, std::int64_t now_us,
                              const GateOptions& options);

/** To the nearest microsecond. */
[[nodiscard]] std::int64_t Microseconds(double milliseconds);

/** Of microseconds, to the nearest millisecond: "12 ms". */
[[nodiscard]] std::string Milliseconds(std::int64_t later_us, std::int64_t earlier_us);

}  // namespace forereach
