/** Columns of numbers and texts as a page carries them: base64 of zlib's format, which a browser unpacks into a typed
array with its DecompressionStream. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace forereach {

/** RFC 4648, with padding. */
[[nodiscard]] std::string Base64(std::string_view bytes);

/** Base64 of the bytes in zlib's format: a binary value, since a document has it in another place (page/document.h).
@throws std::bad_alloc. */
[[nodiscard]] nlohmann::json Packed(std::string_view bytes);

/** A column of a page: {"type": "f64", "data": Packed}. Types are i8, u8, i16, ..., i64, f32 and f64, little-endian. */
template <class Number>
[[nodiscard]] nlohmann::json ColumnAsItIs(std::span<const Number> values) {
  static_assert(std::is_arithmetic_v<Number>);
  std::string type(1, std::is_floating_point_v<Number> ? 'f' : std::is_signed_v<Number> ? 'i' : 'u');
  type += std::to_string(8 * sizeof(Number));
  return {{"type", type}, {"data", Packed({reinterpret_cast<const char*>(values.data()), values.size_bytes()})}};
}

/** A column in the first of these types that has all of the values; the types rise to their own. */
template <class Narrow, class... Wider, class Number>
[[nodiscard]] nlohmann::json NarrowColumn(std::span<const Number> values) {
  if constexpr (sizeof(Narrow) < sizeof(Number)) {
    if (!std::ranges::all_of(values, [](Number value) { return std::in_range<Narrow>(value); }))
      return NarrowColumn<Wider...>(values);
    const std::vector<Narrow> narrow(values.begin(), values.end());
    return ColumnAsItIs(std::span<const Narrow>(narrow));
  } else {
    return ColumnAsItIs(values);
  }
}

/** Integers are written in the narrowest type that has all of them: a browser unpacks and reads these sooner. */
template <class Number>
[[nodiscard]] nlohmann::json Column(std::span<const Number> values) {
  if constexpr (std::is_floating_point_v<Number>)
    return ColumnAsItIs(values);
  else if constexpr (std::is_signed_v<Number>)
    return NarrowColumn<std::int8_t, std::int16_t, std::int32_t, std::int64_t>(values);
  else
    return NarrowColumn<std::uint8_t, std::uint16_t, std::uint32_t>(values);
}
template <class Number>
[[nodiscard]] nlohmann::json Column(const std::vector<Number>& values) {
  return Column(std::span<const Number>(values));
}

/** A column of each row's number, made by `of`. */
template <class Number, class Row, class Of>
[[nodiscard]] nlohmann::json ColumnOf(const std::vector<Row>& rows, const Of& of) {
  std::vector<Number> values;
  values.reserve(rows.size());
  for (const Row& row : rows) values.push_back(static_cast<Number>(of(row)));
  return Column(values);
}

}  // namespace forereach
