/** Columns of numbers and texts as a page carries them: base64 of zlib's format, which a browser unpacks into a typed
array with its DecompressionStream. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <nlohmann/json.hpp>

namespace forereach {

/** RFC 4648, with padding. */
[[nodiscard]] std::string Base64(std::string_view bytes);

/** Base64 of the bytes in zlib's format: a binary value, since a document has it in another place (page/document.h).
@throws std::bad_alloc. */
[[nodiscard]] nlohmann::json Packed(std::string_view bytes);

/** A column of a page: {"type": "f64", "data": Packed}. Types are u8, u32, i32, i64, f32 and f64, little-endian. */
template <class Number>
[[nodiscard]] nlohmann::json Column(const std::vector<Number>& values) {
  static_assert(std::is_arithmetic_v<Number>);
  std::string type(1, std::is_floating_point_v<Number> ? 'f' : std::is_signed_v<Number> ? 'i' : 'u');
  type += std::to_string(8 * sizeof(Number));
  return {{"type", type},
          {"data", Packed({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Number)})}};
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
