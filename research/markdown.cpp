#include "research/markdown.h"

#include <cstdio>

#include <fmt/ranges.h>

namespace forereach::research {

std::string Text(const char* format, std::optional<double> value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value.value_or(0));
  return value ? text : "none";
}

std::string Percent(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? Text("%.2f", 100.0 * static_cast<double>(part) / static_cast<double>(whole)) : "none";
}

std::string List(const Eigen::VectorXd& numbers) {
  return fmt::format("[{:.17g}]", fmt::join(numbers.begin(), numbers.end(), ", "));
}

std::string Markdown(const Cells& head, const std::vector<Cells>& rows) {
  std::string text = fmt::format("\n| {} |\n|", fmt::join(head, " | "));
  for (std::size_t i = 0; i < head.size(); ++i) text += "---|";
  text += "\n";
  for (const Cells& row : rows) text += fmt::format("| {} |\n", fmt::join(row, " | "));
  return text;
}

}  // namespace forereach::research
