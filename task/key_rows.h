/** Functions that make rows of the schema. */
#pragma once

#include <algorithm>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "forereach/dynamics/expression.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/text.h"
#include "task/document.h"
#include "task/draft.h"
#include "task/schema.h"

namespace forereach::key_rows {

inline constexpr Range kNotNegative{0, kReal.upper, false, true};
inline constexpr Range kPositive{0, kReal.upper};
constexpr Range UpTo(double upper) { return {0, upper, true, false}; }
constexpr Range Between(double lower, double upper) { return {lower, upper, false, false}; }

// ---- One function for each type. Arguments: path, the members that the type uses, meaning, reader.

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

/** A word of a task file and the value that it stands for. */
template <class T>
struct Named {
  std::string_view name;
  T value;
};

template <class T>
std::vector<std::string_view> NamesIn(const std::vector<Named<T>>& all) {
  std::vector<std::string_view> names;
  for (const Named<T>& named : all) names.push_back(named.name);
  return names;
}

/** The value with a name. @throws std::logic_error if there is none; the check of the row excludes that. */
template <class T>
const T& ValueNamed(const std::vector<Named<T>>& all, std::string_view name) {
  const auto found = std::ranges::find(all, name, &Named<T>::name);
  if (found == all.end()) throw std::logic_error("a word that the schema does not have: " + std::string(name));
  return found->value;
}

inline Key Expression(std::string path, std::string meaning) {
  return Of(Key::Type::kExpression, std::move(path), std::move(meaning));
}

/** @throws ConfigError with the place of the error in an expression of `file`, and the nearest known name. */
[[noreturn]] void FailAt(const std::string& file, const ExpressionError& error);

inline bool Has(const Document& file, const std::string& map, std::string_view name) {
  const std::vector<std::string> keys = file.KeysOf(map);
  return std::ranges::find(keys, name) != keys.end();
}

/** The path of a file that a task file names, relative to the task file's directory. */
inline std::string RelativeTo(const std::string& file, const std::string& path) {
  return (std::filesystem::path(file).parent_path() / path).string();
}

inline std::string Entry(const std::string& key, Eigen::Index i) { return key + "[" + std::to_string(i) + "]"; }

/** @throws ConfigError unless lower <= upper. */
inline void RequireOrdered(const Document& file, double lower, double upper, const std::string& lower_key,
                           const std::string& upper_key) {
  if (lower <= upper) return;
  file.Fail(upper_key,
            ToText(upper) + " is outside " + Range{lower, kReal.upper, false, true}.text() + ", below " + lower_key);
}

/** A parameter that is a number, or a list of its smallest and largest value. */
inline ModelText::Parameter ReadParameter(const Document& file, const std::string& key, const std::string& name) {
  if (file.Count(key) == 0) {
    const double value = file.Number(key);
    return {name, value, value};
  }
  const Eigen::VectorXd ends = file.Vector(key);
  RequireOrdered(file, ends[0], ends[1], Entry(key, 0), Entry(key, 1));
  return {name, ends[0], ends[1]};
}

/** Makes rows that set members of one options structure. Their defaults are the members' initial values. */
template <class Options>
class OptionRows final {
 public:
  /** @param map the path of the options' map. @param part returns the structure in a draft. */
  OptionRows(std::string map, Options& (*part)(TaskDraft&)) : map_(std::move(map)), part_(part) {}

  template <class T>
  Key Number(const char* name, std::string unit, Range range, T Options::*member, std::string meaning) const {
    return Filling(member, key_rows::Number(Path(name), std::move(unit), range, std::move(meaning)));
  }
  Key Integer(const char* name, Range range, int Options::*member, std::string meaning) const {
    Key key = Number(name, "", range, member, std::move(meaning));
    key.type = Key::Type::kInteger;
    return key;
  }
  Key Vector(const char* name, std::string unit, Range range, Key::Size size, std::vector<double> Options::*member,
             std::string meaning) const {
    return Filling(member, key_rows::Vector(Path(name), std::move(unit), range, size, std::move(meaning)));
  }
  Key Text(const char* name, std::string Options::*member, std::string meaning) const {
    return Filling(member, key_rows::Text(Path(name), std::move(meaning)));
  }
  Key Channel(const char* name, std::string Options::*member, std::string meaning) const {
    Key key = Text(name, member, std::move(meaning));
    key.type = Key::Type::kChannel;
    return key;
  }
  /** The path of a file or directory. */
  Key File(const char* name, std::string Options::*member, std::string meaning) const {
    Key key = Text(name, member, std::move(meaning));
    if (!key.fallback.empty()) key.fallback = "`" + key.fallback + "` in the working directory";
    key.read = [part = part_, member](const Document& file, const std::string& at, TaskDraft& draft) {
      part(draft).*member = RelativeTo(file.path(), file.Text(at));
    };
    return key;
  }
  /** A member that has one of few values. */
  template <class T>
  Key Word(const char* name, const std::vector<Named<T>>& words, T Options::*member, std::string meaning) const {
    Key key = key_rows::Word(Path(name), NamesIn(words), std::move(meaning));
    for (const Named<T>& word : words)
      if (word.value == Options{}.*member) key.fallback = word.name;
    key.read = [part = part_, member, words](const Document& file, const std::string& at, TaskDraft& draft) {
      part(draft).*member = ValueNamed(words, file.Text(at));
    };
    return key;
  }
  /** A member that is one of these words. */
  Key OneOf(const char* name, const std::vector<std::string_view>& words, std::string Options::*member,
            std::string meaning) const {
    return Filling(member, key_rows::Word(Path(name), words, std::move(meaning)));
  }

 private:
  static std::string Shown(double value) { return ToText(value); }
  static std::string Shown(int value) { return std::to_string(value); }
  static std::string Shown(const std::string& value) { return value; }
  static std::string Shown(const std::vector<double>&) { return ""; }
  static std::string Shown(const std::optional<double>&) { return ""; }

  std::string Path(const char* name) const { return map_ + "." + name; }

  template <class T>
  Key Filling(T Options::*member, Key key) const {
    key.fallback = Shown(Options{}.*member);
    key.read = [part = part_, member](const Document& file, const std::string& at, TaskDraft& draft) {
      file.Read(at, part(draft).*member);
    };
    return key;
  }

  std::string map_;
  Options& (*part_)(TaskDraft&);
};

// ---- The parts of the schema, in its order.

std::vector<Key> ModelKeys();          ///< model
std::vector<Key> ModelFileKeys();      ///< model, of a model file
std::vector<Key> ProblemKeys();        ///< domain, declaration, residual, task, certifier
std::vector<Key> ResidualKeys();       ///< residual, among those
std::vector<Key> OptionKeys();         ///< gate, realtime, bus, planner, robot, logger
std::vector<Key> LawKeys();            ///< planner.let, stop, emergency_stop, hints, at_rest, among those
std::vector<Key> RobotResidualKeys();  ///< robot.residual, among those

/** @throws ConfigError if an expression of LawKeys is wrong. */
void CheckLaws(const Document& file, const TaskDraft& draft);

}  // namespace forereach::key_rows
