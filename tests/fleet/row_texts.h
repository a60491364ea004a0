/** Rows as texts, column by column, to compare those of two databases. */
#pragma once

#include <bit>

#include <fmt/format.h>

#include "records/schema.h"
#include "tests/test.h"

namespace forereach {

inline std::string TextOf(const std::string& value) { return value; }
inline std::string TextOf(std::int64_t value) { return std::to_string(value); }
inline std::string TextOf(int value) { return std::to_string(value); }
inline std::string TextOf(double value) {
  return std::isnan(value) ? "nan" : fmt::format("{:x}", std::bit_cast<std::uint64_t>(value));
}
inline std::string TextOf(const std::optional<std::int64_t>& value) { return value ? std::to_string(*value) : "none"; }
template <class Number>
std::string TextOf(OrNull<Number> value) {
  return std::to_string(value.number);
}
inline std::string TextOf(const auto& values) {
  std::string text;
  for (const auto& value : values) text += TextOf(value) + " ";
  return text;
}

/** Each row with its columns, sorted. */
inline std::vector<std::string> TextsOf(const Rows& rows) {
  std::vector<std::string> texts;
  const auto add = [&texts](const char* table, const auto& all) {
    for (const auto& row : all) {
      std::string& text = texts.emplace_back(table);
      std::apply([&text](const auto&... column) { ((text += "|" + TextOf(column.value)), ...); }, ColumnsOf(row));
    }
  };
  add("decision", rows.decisions);
  add("event", rows.events);
  add("gap", rows.gaps);
  add("transition", rows.transitions);
  std::ranges::sort(texts);
  return texts;
}

/** The first rows that one has and the other has not; empty if they have the same, equally often. */
inline std::string DifferenceOf(const Rows& rows, const Rows& others) {
  const std::vector<std::string> a = TextsOf(rows), b = TextsOf(others);
  const auto [in_a, in_b] = std::ranges::mismatch(a, b);
  if (in_a == a.end() && in_b == b.end()) return {};
  return fmt::format("{} and {} rows: {} and {}", a.size(), b.size(), in_a == a.end() ? "none" : *in_a,
                     in_b == b.end() ? "none" : *in_b);
}

}  // namespace forereach
