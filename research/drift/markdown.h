/** Tables of the reports. */
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace forereach::research {

using Cells = std::vector<std::string>;

[[nodiscard]] inline std::string Text(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

[[nodiscard]] inline std::string Percent(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? Text("%.2f", 100.0 * static_cast<double>(part) / static_cast<double>(whole)) : "none";
}

/** A table in Markdown. */
[[nodiscard]] std::string Markdown(const Cells& head, const std::vector<Cells>& rows);

}  // namespace forereach::research
