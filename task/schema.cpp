#include "task/schema.h"

#include <algorithm>
#include <iterator>

#include <fmt/core.h>

#include "command_line/nearest.h"
#include "forereach/numerics/text.h"
#include "task/key_rows.h"
#include "task/schema_parts.h"

namespace forereach {
namespace {

using Type = Key::Type;
using Size = Key::Size;

std::string Numbered(const char* what, Size size) {
  switch (size) {
    case Size::kStates: return fmt::format("{}, one a state", what);
    case Size::kInputs: return fmt::format("{}, one an input", what);
    case Size::kVariables: return fmt::format("{}, one a state and input", what);
    case Size::kSafety: return fmt::format("{}, one a safety coordinate", what);
    case Size::kPoint: return fmt::format("2 or 3 {}", what);
    case Size::kAny: break;
  }
  return what;
}

std::string CountText(const Range& count) { return fmt::format("{} to {}", ToText(count.lower), ToText(count.upper)); }

std::string TypeText(const Key& key) {
  switch (key.type) {
    case Type::kMap: return "map";
    case Type::kList: return fmt::format("list of {}", CountText(key.count));
    case Type::kNumber: return "number";
    case Type::kInteger: return "integer";
    case Type::kVector: return Numbered("numbers", key.size);
    case Type::kVectors: return fmt::format("{} lists of {}", CountText(key.count), Numbered("numbers", key.size));
    case Type::kNames:
      return CountText(key.count) + (key.size == Size::kStates ? " names of states" : " names of states and inputs");
    case Type::kWord: return (key.words.size() > 1 ? "one of " : "") + Joined({key.words.begin(), key.words.end()});
    case Type::kText: return "text";
    case Type::kExpression: return "expression";
    case Type::kChannel: return "channel";
  }
  return "";
}

bool HasNumbers(const Key& key) {
  return key.type == Type::kNumber || key.type == Type::kInteger || key.type == Type::kVector ||
         key.type == Type::kVectors;
}

// " in [0, inf) m"; no range where any finite number is allowed.
std::string RangeText(const Key& key) {
  std::string text;
  if (HasNumbers(key) && key.range.text() != kReal.text())
    text = (key.size == Size::kAny ? " in " : ", in ") + key.range.text();
  const bool is_of_each = key.size == Size::kStates || key.size == Size::kInputs;  // "numbers, one a state"
  if (key.unit.empty() || (key.unit.starts_with("of ") && is_of_each)) return text;
  return fmt::format("{}{}{}", text, key.unit.starts_with("of ") ? ", unit " : text.empty() ? ", " : " ", key.unit);
}

// Whether a row is the second form of the number before it: the least and the largest value.
bool IsRangeOf(const Key& number, const Key& key) {
  return key.path == number.path && number.type == Type::kNumber && key.type == Type::kVector && key.count.upper == 2;
}

std::string DefaultText(const Key& key) {
  const std::string whose = key.only.empty() ? "" : fmt::format(" for {}", key.only);
  if (key.required) return fmt::format(", required{}", whose);
  return key.fallback.empty() ? "" : fmt::format(", default{}: {}", whose, key.fallback);
}

std::vector<Key> MakeSchema(std::initializer_list<std::vector<Key> (*)()> parts) {
  std::vector<Key> keys{key_rows::Map("", "The file.")};
  for (const auto part : parts) std::ranges::move(part(), std::back_inserter(keys));
  return keys;
}

}  // namespace

std::span<const Key> Schema() {
  static const std::vector<Key> keys = MakeSchema({key_rows::ModelKeys, key_rows::ProblemKeys, key_rows::OptionKeys});
  return keys;
}

std::span<const Key> ModelFileSchema() {
  static const std::vector<Key> keys = MakeSchema({key_rows::ModelFileKeys});
  return keys;
}

std::string Range::text() const {
  std::string text = lower_open ? "(" : "[";
  text += fmt::format("{}, {}", ToText(lower), ToText(upper));
  return text + (upper_open ? ")" : "]");
}

std::string SchemaMarkdown() {
  std::string text =
      "## Keys\n\n"
      "A dot leads one map down. `[]` is every entry of a list, `<state>` the name of a state, `<input>` of an input,\n"
      "`<variable>` of either, `<name>` any name. Lists of numbers are in the model's order, each in its variable's\n"
      "unit. A range does not contain an end with `(` or `)`. `[least, largest]` is a list of two such numbers.\n";
  const std::span<const Key> keys = Schema();
  for (std::size_t i = 1; i < keys.size(); ++i) {  // the first is the file
    const Key& key = keys[i];
    if (IsRangeOf(keys[i - 1], key)) continue;
    const bool may_be_range = i + 1 < keys.size() && IsRangeOf(key, keys[i + 1]);
    if (key.path.find('.') == std::string::npos) text += fmt::format("\n### {}\n\n", key.path);
    text += fmt::format("- `{}`: {}{}{}{}. {}\n", key.path, TypeText(key), RangeText(key),
                        may_be_range ? ", or [least, largest]" : "", DefaultText(key), key.meaning);
  }
  return text;
}

}  // namespace forereach
