/** Tables of the reports on cars. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace forereach::research {

using Cells = std::vector<std::string>;

/** As std::printf writes it; "none" of none. */
[[nodiscard]] std::string Text(const char* format, std::optional<double> value);
/** Of the whole, to two decimals; "none" of nothing. */
[[nodiscard]] std::string Percent(std::int64_t part, std::int64_t whole);
/** "[1, 2]", with all digits. */
[[nodiscard]] std::string List(const Eigen::VectorXd& numbers);

template <class T>
[[nodiscard]] std::vector<T> Join(std::vector<T> first, const std::vector<T>& more) {
  first.insert(first.end(), more.begin(), more.end());
  return first;
}

/** A table in Markdown. */
[[nodiscard]] std::string Markdown(const Cells& head, const std::vector<Cells>& rows);

}  // namespace forereach::research
