/** Rows of the schema that set members of an options structure. */
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "forereach/numerics/text.h"
#include "task/draft.h"
#include "task/key_rows.h"
#include "task/named_values.h"
#include "task/row_readers.h"

namespace forereach::key_rows {

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
    if (!key.fallback.empty()) key.fallback = fmt::format("`{}` in the working directory", key.fallback);
    key.read = [part = part_, member](const Field& at, TaskDraft& draft) { part(draft).*member = PathIn(at); };
    return key;
  }
  /** A member that has one of few values. */
  template <class T>
  Key Word(const char* name, const std::vector<Named<T>>& words, T Options::*member, std::string meaning) const {
    Key key = key_rows::Word(Path(name), NamesIn(words), std::move(meaning));
    for (const Named<T>& word : words)
      if (word.value == Options{}.*member) key.fallback = word.name;
    key.read = [part = part_, member, words](const Field& at, TaskDraft& draft) {
      part(draft).*member = ValueNamed(words, at.Text());
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
    key.read = [part = part_, member](const Field& at, TaskDraft& draft) { at.Read(part(draft).*member); };
    return key;
  }

  std::string map_;
  Options& (*part_)(TaskDraft&);
};

}  // namespace forereach::key_rows
