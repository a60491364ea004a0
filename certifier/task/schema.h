/** Every key of a task file, in one row: its path, unit, range, default and meaning, and the member that it fills.

Documents are checked and read by this table (document.h), and config/README.md is made from it. */
#pragma once

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace forereach {

class Document;
struct TaskDraft;

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

inline constexpr Range kReal{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};

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
  /** Takes the value at `key`, which was checked, and everything in it, into the draft.
  @throws ConfigError, std::invalid_argument if it does not fit with what was read before. */
  using Reader = std::function<void(const Document& file, const std::string& key, TaskDraft& draft)>;

  std::string path = "";
  Type type = Type::kMap;
  std::string unit = "";
  Range range = kReal;  ///< Of each number.
  Size size = Size::kAny;
  Range count = kReal;                       ///< Of the entries of a list.
  std::vector<std::string_view> words = {};  ///< Of kWord.
  std::string only = "";                     ///< Belongs to the map only if the key `name` in it has this value.
  bool required = false;
  std::string fallback = "";  ///< The value where the key is absent, in words or as YAML.
  std::string meaning = "";
  Reader read = {};  ///< Empty: the map or list around it reads it.
};

/** The rows, in the order in which a file is read: the model and the projection come before all keys whose names or
sizes depend on them. */
[[nodiscard]] std::span<const Key> Schema();

/** "Keys" of config/README.md: the table for people. */
[[nodiscard]] std::string SchemaMarkdown();

}  // namespace forereach
