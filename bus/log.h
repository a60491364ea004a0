/** Log lines of a process, on standard error. */
#pragma once

#include <cstdint>
#include <string>

#include <fmt/core.h>

namespace forereach {

/** Gives the log this name, before any line is written; otherwise it is "forereach". Control characters in a line are
escaped, because a line may contain text from the network. */
void SetUpLog(const std::string& name);

namespace logging {

enum class Level : std::uint8_t { kInfo, kWarning, kError };

/** Writes no further line. */
void Silence();
/** Returns when all lines are written. */
void Flush();

/** Writes one line, made from a format string of {fmt} and its values. */
void Write(Level level, fmt::string_view format, fmt::format_args values);

template <class... Values>
void Info(fmt::format_string<Values...> format, Values&&... values) {
  Write(Level::kInfo, format, fmt::make_format_args(values...));
}
template <class... Values>
void Warn(fmt::format_string<Values...> format, Values&&... values) {
  Write(Level::kWarning, format, fmt::make_format_args(values...));
}
template <class... Values>
void Error(fmt::format_string<Values...> format, Values&&... values) {
  Write(Level::kError, format, fmt::make_format_args(values...));
}

}  // namespace logging
}  // namespace forereach
