/** Every key of a task file, once: what it is, in which unit, in which range, and what holds where it is absent.

Documents are checked against this table (document.h), and config/README.md is made from it. */
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace forereach {

/** An interval of admissible numbers. */
struct Range {
  double lower, upper;
  bool lower_open = true, upper_open = true;

  [[nodiscard]] bool Contains(double x) const {
    return (lower_open ? lower < x : lower <= x) && (upper_open ? x < upper : x <= upper);
  }
  /** As in [0, inf). */
  [[nodiscard]] std::string text() const;
};

/** One row. A path has a dot before each key, `[]` for every entry of a list, `<state>` for every state's name and
`<variable>` for every state's or input's. A path has several rows if its value may take several forms. */
struct Key {
  enum class Type {
    kMap,
    kList,  ///< Of what `path[]` says.
    kNumber,
    kInteger,
    kVector,   ///< A list of numbers.
    kVectors,  ///< A list of vectors: a matrix by rows, or points.
    kNames,    ///< A list of different coordinates.
    kWord,     ///< One of `words`.
    kText,
    kChannel,  ///< Letters, digits and underscores, at most 63.
  };
  /** How many entries a vector has, or every vector of kVectors. */
  enum class Size { kAny, kStates, kInputs, kVariables, kSafety };

  std::string path;
  Type type;
  std::string unit;
  Range range;  ///< Of each number.
  Size size = Size::kAny;
  Range count;                          ///< Of the entries of a list.
  std::vector<std::string_view> words;  ///< Of kWord.
  std::string only;                     ///< Belongs to the map only if the key `name` in it has this value.
  bool required = false;
  std::string fallback;  ///< What holds where the key is absent, in words or as YAML.
  std::string meaning;
};

[[nodiscard]] std::span<const Key> Schema();

/** "Keys" of config/README.md: the table for people. */
[[nodiscard]] std::string SchemaMarkdown();

}  // namespace forereach
