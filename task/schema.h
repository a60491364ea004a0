/** The schema of task files: one row for each key, with its path, unit, range, default, meaning, and the member that it
sets.

Documents are checked and read by these rows (document.h). config/README.md is generated from them. */
#pragma once

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace forereach {

class Field;
struct TaskDraft;

/** An interval of admissible numbers. */
struct Range {
  double lower, upper;
  bool lower_open = true, upper_open = true;

  [[nodiscard]] bool Contains(double x) const {
    return (lower_open ? lower < x : lower <= x) && (upper_open ? x < upper : x <= upper);
  }
  /** In the notation of "[0, inf)". */
  [[nodiscard]] std::string text() const;
};

inline constexpr Range kReal{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};

/** One row. In a path, a dot precedes each key, `[]` stands for every entry of a list, `<state>` for the name of every
state, `<input>` for that of every input, `<variable>` for that of both, and `<name>` for any name. A path has several
rows if its value has several forms. */
struct Key {
  enum class Type {
    kMap,
    kList,  ///< Its entries have the row `path[]`.
    kNumber,
    kInteger,
    kVector,   ///< A list of numbers.
    kVectors,  ///< A list of vectors: a matrix by rows, or points.
    kNames,    ///< A list of different coordinates.
    kWord,     ///< One of `words`.
    kText,
    kExpression,  ///< See docs/expressions.md. Its text is parsed by the reader.
    kChannel,     ///< Letters, digits and underscores, at most 63.
  };
  /** The number of entries of a vector, or of every vector of kVectors. kPoint: 2 or 3. */
  enum class Size { kAny, kStates, kInputs, kVariables, kSafety, kPoint };
  /** Stores the checked value, with everything in it, in the draft.
  @throws ConfigError, std::invalid_argument if it contradicts values that were read before. */
  using Reader = std::function<void(const Field& at, TaskDraft& draft)>;

  std::string path = "";
  Type type = Type::kMap;
  std::string unit = "";
  Range range = kReal;  ///< Of each number.
  Size size = Size::kAny;
  Range count = kReal;                       ///< Of the entries of a list.
  std::vector<std::string_view> words = {};  ///< Of kWord.
  std::string only = "";                     ///< The key is allowed only if the key `name` of its map has this value.
  bool required = false;
  std::string fallback = "";  ///< The default, in words or as YAML.
  std::string meaning = "";
  Reader read = {};  ///< Empty if the reader of the enclosing map or list reads it.
};

/** All rows of a task file, in the order in which it is read. The model, and the projection or body, precede the keys
whose names or sizes depend on them. */
[[nodiscard]] std::span<const Key> Schema();

/** All rows of a model file, which a task file includes by `model.file`. */
[[nodiscard]] std::span<const Key> ModelFileSchema();

/** A JSON Schema (draft 7) of task files, for editors: keys, forms, words, ranges, counts and what is required. It
knows no names of a model's states and inputs, and no rule between keys but those by a map's `name`. */
[[nodiscard]] std::string SchemaJson();

/** The section "Keys" of config/README.md. */
[[nodiscard]] std::string SchemaMarkdown();

}  // namespace forereach
