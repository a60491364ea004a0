/** Functions that make rows of the schema, one for each type, and ranges for them. */
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "forereach/numerics/limits.h"
#include "task/schema.h"

namespace forereach::key_rows {

inline constexpr Range kNotNegative{0, kReal.upper, false, true};
inline constexpr Range kPositive{0, kReal.upper};
constexpr Range UpTo(double upper) { return {0, upper, true, false}; }
constexpr Range Between(double lower, double upper) { return {lower, upper, false, false}; }

// Arguments: path, the members that the type uses, meaning, reader.

inline Key Map(std::string path, std::string meaning, Key::Reader read = {}) {
  return {.path = std::move(path), .meaning = std::move(meaning), .read = std::move(read)};
}

inline Key Of(Key::Type type, std::string path, std::string meaning, Key::Reader read = {}) {
  Key key = Map(std::move(path), std::move(meaning), std::move(read));
  key.type = type;
  return key;
}

inline Key Number(std::string path, std::string unit, Range range, std::string meaning, Key::Reader read = {}) {
  Key key = Of(Key::Type::kNumber, std::move(path), std::move(meaning), std::move(read));
  key.unit = std::move(unit);
  key.range = range;
  return key;
}

inline Key Vector(std::string path, std::string unit, Range range, Key::Size size, std::string meaning,
                  Key::Reader read = {}) {
  Key key = Number(std::move(path), std::move(unit), range, std::move(meaning), std::move(read));
  key.type = Key::Type::kVector;
  key.size = size;
  if (size == Key::Size::kAny) key.count = Between(1, kMaxVariables);
  return key;
}

inline Key Vectors(std::string path, std::string unit, Range range, Range count, Key::Size size, std::string meaning,
                   Key::Reader read = {}) {
  Key key = Vector(std::move(path), std::move(unit), range, size, std::move(meaning), std::move(read));
  key.type = Key::Type::kVectors;
  key.count = count;
  return key;
}

inline Key List(std::string path, Range count, std::string meaning) {
  Key key = Of(Key::Type::kList, std::move(path), std::move(meaning));
  key.count = count;
  return key;
}

inline Key Names(std::string path, Range count, Key::Size size, std::string meaning, Key::Reader read = {}) {
  Key key = Of(Key::Type::kNames, std::move(path), std::move(meaning), std::move(read));
  key.count = count;
  key.size = size;
  return key;
}

inline Key Word(std::string path, std::vector<std::string_view> words, std::string meaning, Key::Reader read = {}) {
  Key key = Of(Key::Type::kWord, std::move(path), std::move(meaning), std::move(read));
  key.words = std::move(words);
  return key;
}

inline Key Text(std::string path, std::string meaning, Key::Reader read = {}) {
  return Of(Key::Type::kText, std::move(path), std::move(meaning), std::move(read));
}

/** The key must be present if its map is. */
inline Key Required(Key key) {
  key.required = true;
  return key;
}

inline Key Optional(Key key, std::string fallback) {
  key.fallback = std::move(fallback);
  return key;
}

inline Key OnlyFor(std::string name, Key key) {
  key.only = std::move(name);
  return key;
}

inline Key Expression(std::string path, std::string meaning) {
  return Of(Key::Type::kExpression, std::move(path), std::move(meaning));
}

}  // namespace forereach::key_rows
