/** Dates with times, as recorders and people write them. */
#pragma once

#include <optional>
#include <string_view>

namespace forereach {

/** The seconds since 1970 of a date of ISO 8601, to microseconds and better: "2026-01-31T12:34:56.25+01:00"; UTC
without a zone. A blank may stand for the T, a comma before the fraction, and all separators may be left out, as in
"20260131T123456Z". Nothing for another text. */
[[nodiscard]] std::optional<long double> SecondsOfDate(std::string_view text);

}  // namespace forereach
