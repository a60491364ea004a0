/** Tests of a message's stamp by the limits of a task, gate.max_age_ms and gate.max_ahead_ms. */
#pragma once

#include <cstdint>
#include <string>

#include "certifier/gate/freshness.h"
#include "certifier/task/config.h"

namespace forereach {

struct Stamp {
  Freshness freshness;
  std::string fault;  ///< The reason why it is not fresh, as text; empty if it is fresh.
};

/** The freshness of a message with the stamp `utime` that arrived at `now_us`, both microseconds since the Unix epoch.
 */
[[nodiscard]] Stamp Judge(std::int64_t utime, std::int64_t now_us, const GateOptions& options);

/** Whether a fresh message with the stamp `utime` is not later than an event at `then_us`. False if the order is
unknown, because the clock was set back after the event and `then_us` lies in the future. */
[[nodiscard]] bool IsNotAfter(std::int64_t utime, std::int64_t then_us, std::int64_t now_us,
                              const GateOptions& options);

/** Milliseconds as microseconds, rounded to the nearest. */
[[nodiscard]] std::int64_t Microseconds(double milliseconds);

/** The difference of two times in microseconds as text, to the nearest millisecond: "12 ms". */
[[nodiscard]] std::string Milliseconds(std::int64_t later_us, std::int64_t earlier_us);

}  // namespace forereach
