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

/** Base64 of the bytes in zlib's format. @throws std::bad_alloc. */
[[nodiscard]] std::string Packed(std::string_view bytes);

/** A column of a page: {"type": "f64", "data": Packed}. Types are i8, u8, i16, ..., i64, f32 and f64, little-endian. */
template <class Number>
[[nodiscard]] nlohmann::json ColumnAsItIs(std::span<const Number> values) {
  static_assert(std::is_arithmetic_v<Number>);
  std::string type(1, std::is_floating_point_v<Number> ? 'f' : std::is_signed_v<Number> ? 'i' : 'u');
  type += std::to_string(8 * sizeof(Number));
  return {{"type", type}, {"data", Packed({reinterpret_cast<const char*>(values.data()), values.size_bytes()})}};
}

template <class Number>
struct Narrower {
  using Type = void;
};
template <>
struct Narrower<std::int64_t> {
  using Type = std::int32_t;
};
template <>
struct Narrower<std::int32_t> {
  using Type = std::int16_t;
};
template <>
struct Narrower<std::int16_t> {
  using Type = std::int8_t;
};
template <>
struct Narrower<std::uint32_t> {
  using Type = std::uint16_t;
};
template <>
struct Narrower<std::uint16_t> {
  using Type = std::uint8_t;
};

/** Integers are written in the narrowest type that has all of them: a browser unpacks and reads these sooner. */
template <class Number>
[[nodiscard]] nlohmann::json Column(std::span<const Number> values) {
  using Narrow = typename Narrower<Number>::Type;
  if constexpr (!std::is_void_v<Narrow>)
    if (std::ranges::all_of(values, [](Number value) { return std::in_range<Narrow>(value); })) {
      const std::vector<Narrow> narrow(values.begin(), values.end());
      return Column(std::span<const Narrow>(narrow));
    }
  return ColumnAsItIs(values);
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
