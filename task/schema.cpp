#include "task/schema.h"

#include <algorithm>
#include <iterator>

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
    case Size::kStates: return std::string(what) + ", one a state";
    case Size::kInputs: return std::string(what) + ", one an input";
    case Size::kVariables: return std::string(what) + ", one a state and input";
    case Size::kSafety: return std::string(what) + ", one a safety coordinate";
    case Size::kPoint: return "2 or 3 " + std::string(what);
    case Size::kAny: break;
  }
  return what;
}

std::string CountText(const Range& count) { return ToText(count.lower) + " to " + ToText(count.upper); }

std::string TypeText(const Key& key) {
  switch (key.type) {
    case Type::kMap: return "map";
    case Type::kList: return "list of " + CountText(key.count);
    case Type::kNumber: return "number";
    case Type::kInteger: return "integer";
    case Type::kVector: return Numbered("numbers", key.size);
    case Type::kVectors: return CountText(key.count) + " lists of " + Numbered("numbers", key.size);
    case Type::kNames:
      return CountText(key.count) + (key.size == Size::kStates ? " names of states" : " names of states and inputs");
    case Type::kWord: return (key.words.size() > 1 ? "one of " : "") + Joined({key.words.begin(), key.words.end()});
    case Type::kText: return "text";
    case Type::kExpression: return "expression";
    case Type::kChannel: return "channel";
  }
  return "";
}

// A bar would end the cell of a Markdown table.
std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? "\\|" : std::string(1, c);
  return escaped;
}

bool HasRange(const Key& key) {
  return key.type == Type::kNumber || key.type == Type::kInteger || key.type == Type::kVector ||
         key.type == Type::kVectors;
}

std::string DefaultText(const Key& key) {
  if (key.required) return key.only.empty() ? "required" : "required for " + key.only;
  if (!key.fallback.empty() && !key.only.empty()) return key.fallback + ", for " + key.only;
  return key.fallback;
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
  text += ToText(lower) + ", " + ToText(upper);
  return text + (upper_open ? ")" : "]");
}

std::string SchemaMarkdown() {
  std::string text =
      "## Keys\n\n"
      "A dot leads one map down. `[]` means every entry of a list, `<state>` the name of a state, `<input>` that "
      "of an input,\n"
      "`<variable>` that of either, `<name>` any name. Lists of numbers are in the model's order. A range with `(` or "
      "`)` does "
      "not contain\n"
      "its end. If the default is empty, the key may be left out and has no value.\n"
      "\n"
      "| Key | Type | Unit | Range | Default | Meaning |\n"
      "| --- | --- | --- | --- | --- | --- |\n";
  for (const Key& key : Schema()) {
    if (key.path.empty()) continue;
    text += "| `" + key.path + "` | " + TypeText(key) + " | " + key.unit + " | " +
            (HasRange(key) ? key.range.text() : "") + " | " + DefaultText(key) + " | " + Escaped(key.meaning) + " |\n";
  }
  return text;
}

}  // namespace forereach
