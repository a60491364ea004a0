/** An HTML document that needs no network: its style, scripts and data are in it, and its policy allows no other.
Its columns of numbers and texts are base64 of zlib's format, which a browser unpacks into a typed array with its
DecompressionStream. */
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <nlohmann/json.hpp>

#include "lcmtypes/codec.h"

namespace forereach {

/** A file of the pages, embedded when the program is built (page/embed.cmake). */
struct PageAsset {
  std::string_view text;
  std::string_view sha256;  ///< In hexadecimal.
};

/** Of the page of a run, of the live page, and of both. kPageStyle is for both. */
extern const PageAsset kPageBody, kPageScript, kLiveBody, kLiveStyle, kLiveScript, kPageStyle, kSharedScript,
    kChartScript;

struct PageDocument {
  std::string title;
  const PageAsset& body;
  std::vector<const PageAsset*> styles, scripts;
  /** What it may request beside: "'none'", or "'self'" for its own server. */
  std::string connect = "'none'";

  /** Its Content-Security-Policy. */
  [[nodiscard]] std::string Policy() const;
  /** @param data for the scripts, which find it as JSON in the element "data". No tag begins in it. Each of its
  binary values is in an element "column" of its own, and the JSON has its place among these: a browser
  reads small elements faster than a large one, and a script those that it needs. */
  [[nodiscard]] std::string Html(nlohmann::json data) const;
};

/** What ToHex made a text of; zeros for what is no such text. */
[[nodiscard]] Digest DigestOfHex(std::string_view hex);
[[nodiscard]] inline std::string_view BytesOf(const Digest& digest) {
  return {reinterpret_cast<const char*>(digest.data()), digest.size()};
}

/** RFC 4648, with padding. */
[[nodiscard]] std::string Base64(std::string_view bytes);

/** Makes base64 of bytes in zlib's format, without holding the bytes. All throw std::bad_alloc. */
class Packer final {
 public:
  Packer();
  ~Packer();
  Packer(const Packer&) = delete;
  Packer& operator=(const Packer&) = delete;

  void Add(std::string_view bytes) { Deflate(bytes, false); }
  /** A binary value, since a document has it in another place (PageDocument). */
  [[nodiscard]] nlohmann::json Finish();

 private:
  struct Stream;
  void Deflate(std::string_view bytes, bool is_last);

  std::unique_ptr<Stream> stream_;
  std::string packed_;
};

[[nodiscard]] inline nlohmann::json Packed(std::string_view bytes) {
  Packer packer;
  packer.Add(bytes);
  return packer.Finish();
}

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
template <class Number>
[[nodiscard]] nlohmann::json ColumnOf(const auto& rows, const auto& of) {
  std::vector<Number> values;
  values.reserve(rows.size());
  for (const auto& row : rows) values.push_back(static_cast<Number>(std::invoke(of, row)));
  return Column(values);
}

}  // namespace forereach
