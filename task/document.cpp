#include "task/document.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include "command_line/nearest.h"
#include "forereach/dynamics/expression.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "task/config_error.h"
#include "task/draft.h"
#include "task/files.h"
#include "task/number.h"

namespace forereach {
namespace {

using Type = Key::Type;

int LineOf(const YAML::Mark& mark) { return mark.line + 1; }

std::string At(const std::string& path, int line) { return fmt::format("{}:{}: ", path, line); }

bool Contains(const std::vector<std::string>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

// The last key of a path, and the path of its map.
std::string_view Leaf(std::string_view path) { return path.substr(path.rfind('.') + 1); }
std::string_view Parent(std::string_view path) {
  const std::size_t end = path.rfind('.');
  return path.substr(0, end == std::string_view::npos ? 0 : end);
}

bool IsChild(const Key& row, std::string_view map) {
  return !row.path.empty() && Parent(row.path) == map && !row.path.ends_with("[]");
}

std::string Below(const std::string& map, std::string_view key) {
  return map.empty() ? std::string(key) : map + "." + std::string(key);
}

// What stands in a file may not break the line of a message, nor drive a terminal.
std::string OneLine(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return text;
}

std::string Shown(const YAML::Node& node) {
  if (node.IsMap()) return "a map";
  if (node.IsSequence()) return "a list";
  if (node.IsNull()) return "nothing";
  return node.Scalar().substr(0, 60);
}

bool HasForm(const YAML::Node& node, Type type) {
  switch (type) {
    case Type::kMap: return node.IsMap();
    case Type::kList:
    case Type::kVector: return node.IsSequence();
    case Type::kVectors: return node.IsSequence() && node.size() > 0 && node[0].IsSequence();
    case Type::kNames: return node.IsSequence() && (node.size() == 0 || !node[0].IsSequence());
    case Type::kNumber:
    case Type::kInteger: return node.IsScalar() && node.Tag() == "?";  // not quoted
    case Type::kWord:
    case Type::kText:
    case Type::kExpression:
    case Type::kChannel: return node.IsScalar();
  }
  return false;
}

std::string FormName(Type type) {
  switch (type) {
    case Type::kMap: return "a map";
    case Type::kList: return "a list";
    case Type::kVector: return "a list of numbers";
    case Type::kVectors: return "a list of lists of numbers";
    case Type::kNames: return "a list of names";
    case Type::kNumber: return "a number";
    case Type::kInteger: return "an integer";
    case Type::kExpression: return "an expression";
    case Type::kWord:
    case Type::kText:
    case Type::kChannel: return "a word";
  }
  return "";
}

bool IsNumber(Type type) { return type == Type::kNumber || type == Type::kInteger; }

// Of a number, or of the numbers of a list.
std::string NumberName(Type type) { return FormName(type == Type::kInteger ? Type::kInteger : Type::kNumber); }

// ", its unit is s"; empty for a pure number, and where each entry of a list has a unit of its own.
std::string UnitOf(const Key& row) {
  return row.unit.empty() || row.unit.starts_with("of ") ? "" : fmt::format(", its unit is {}", row.unit);
}

// What a number has to be: "write a number in (0, 60], its unit is s".
std::string Wanted(const Key& row) {
  return fmt::format("write {} in {}{}", NumberName(row.type), row.range.text(), UnitOf(row));
}

Parsed<double> Parse(const std::string& token, Type type) {
  if (type != Type::kInteger) return ParseNumber(token);
  const auto [value, problem] = ParseInteger(token);
  return {static_cast<double>(value), problem};
}

std::string Without(std::string token, std::string_view letters) {
  std::erase_if(token, [&](char c) { return letters.find(c) != std::string_view::npos; });
  return token;
}

// The number that a token begins with, without its unit.
std::string Leading(const std::string& token) { return token.substr(0, token.find_last_of("0123456789.") + 1); }

std::string WithoutLeadingZeros(std::string token) {
  const std::size_t begin = token.starts_with('-') ? 1 : 0;
  while (token.size() > begin + 1 && token[begin] == '0' && IsDigit(token[begin + 1])) token.erase(begin, 1);
  return token;
}

// 1e3 and 64.0 as integers are written.
std::string AsInteger(const std::string& token) {
  constexpr double kLargest = 1e15;  // exact in a double
  const Parsed<double> whole = ParseNumber(token);
  const bool is_one =
      whole.problem.empty() && std::abs(whole.value) < kLargest && std::trunc(whole.value) == whole.value;
  return is_one ? std::to_string(static_cast<long long>(whole.value)) : token;
}

// What to write instead of a token that is not the number it should be.
std::string Correction(const std::string& token, const Key& row) {
  const std::string digits = Without(token, "+-");
  if (digits.size() > 1 && digits[0] == '0' && std::isalpha(static_cast<unsigned char>(digits[1])) != 0 &&
      digits[1] != 'e')
    return "write it in decimal";
  std::string with_point = token;
  std::ranges::replace(with_point, ',', '.');
  const std::pair<std::string, std::string> tries[] = {
      {WithoutLeadingZeros(token), ", or its decimal value if octal was meant"},
      {with_point, ", with a point"},
      {Without(token, "_ '"), ""},
      {row.type == Type::kInteger ? AsInteger(token) : token, ""},
      {Leading(token), fmt::format(" alone{}", UnitOf(row))}};
  for (const auto& [other, remark] : tries)
    if (other != token && Parse(other, row.type).problem.empty()) return fmt::format("write {}{}", other, remark);
  return Wanted(row);
}

}  // namespace

struct Field::Node {
  const Document& document;
  std::string key, name;
  YAML::Node yaml;
  double number = 0;                             // of a number, once it is checked
  std::vector<std::unique_ptr<Node>> entries{};  // of a map or list, in the file's order

  [[nodiscard]] int line() const { return LineOf(yaml.Mark()); }
};

namespace {

// Checks the values of a document, and hands each to its row's reader.
class Checker {
  using Node = Field::Node;

 public:
  Checker(std::span<const Key> schema, TaskDraft& draft) : schema_(schema), scope_(draft.scope), draft_(draft) {}

  // `pattern` is the path in the schema, at.key the same with names and indices filled in.
  void Check(Node& at, const std::string& pattern) {
    const Key& row = RowFor(at, pattern);
    CheckValue(at, row, pattern);
    if (!row.read) return;
    try {
      row.read(Field(at), draft_);
    } catch (const std::invalid_argument& error) {
      Field(at).Fail(error.what());
    }
  }

 private:
  void CheckValue(Node& at, const Key& row, const std::string& pattern) {
    switch (row.type) {
      case Type::kMap: return CheckMap(at, pattern);
      case Type::kList:
        RequireCount(at, row);
        for (std::size_t i = 0; i < at.yaml.size(); ++i) Check(AddEntry(at, i), pattern + "[]");
        return;
      case Type::kNumber:
      case Type::kInteger: return CheckNumber(at, row);
      case Type::kVector: return CheckVector(at, row);
      case Type::kVectors:
        RequireCount(at, row);
        for (std::size_t i = 0; i < at.yaml.size(); ++i) CheckVector(AddEntry(at, i), row);
        return;
      case Type::kNames: return CheckNames(at, row);
      case Type::kWord:
      case Type::kText:
      case Type::kExpression:
      case Type::kChannel: return CheckText(at, row);
    }
  }

  static std::string Index(std::size_t i) { return fmt::format("[{}]", i); }

  static Node& AddEntry(Node& list, std::size_t i) {
    return *list.entries.emplace_back(
        new Node{list.document, list.key + Index(i), Index(i), std::as_const(list.yaml)[i]});
  }

  [[noreturn]] static void Fail(const Node& at, const std::string& what) { Fail(at, at.yaml, at.key, what); }
  // For what has no node of its own: a key, or an entry of a list of names.
  [[noreturn]] static void Fail(const Node& in, const YAML::Node& yaml, const std::string& key,
                                const std::string& what) {
    throw ConfigError(At(in.document.path(), LineOf(yaml.Mark())) +
                      OneLine(fmt::format("{}{}{}", key, key.empty() ? "" : ": ", what)));
  }

  // The row of a key whose value is a number or one of these words. Null if it is none of them.
  [[nodiscard]] const Key* WordRowFor(const YAML::Node& node, const std::string& pattern) const {
    const auto has_it = [&](const Key& row) {
      return row.path == pattern && row.type == Type::kWord &&
             std::ranges::find(row.words, node.Scalar()) != row.words.end();
    };
    const auto row = std::ranges::find_if(schema_, has_it);
    return row == schema_.end() ? nullptr : &*row;
  }

  [[nodiscard]] const Key& RowFor(const Node& at, const std::string& pattern) const {
    const YAML::Node& node = at.yaml;
    const Key* last = nullptr;
    std::string forms;
    for (const Key& row : schema_) {
      if (row.path != pattern) continue;
      if (HasForm(node, row.type)) {
        const Key* const word = IsNumber(row.type) ? WordRowFor(node, pattern) : nullptr;
        return word ? *word : row;
      }
      forms += (last ? " or " : "") + FormName(row.type);
      last = &row;
    }
    // What is wrong with a number is explained where numbers are read.
    if (last && forms == FormName(last->type) && IsNumber(last->type)) return *last;
    // A list of a wrong kind is best explained entry by entry.
    if (last && node.IsSequence() && (last->type == Type::kVectors || last->type == Type::kNames)) return *last;
    Fail(at, fmt::format("{} is not {}", Shown(node), forms));
  }

  void CheckMap(Node& at, const std::string& pattern) {
    const YAML::Node name = std::as_const(at.yaml)["name"];  // otherwise yaml-cpp adds the key
    const std::string kind = name && name.IsScalar() ? name.Scalar() : "";
    std::map<std::string, int> seen;            // the line of each
    std::multimap<const Key*, Node*> children;  // in the schema's order, since its rows are in one array
    for (const auto& entry : at.yaml) {
      if (!entry.first.IsScalar()) Fail(at, entry.first, at.key, fmt::format("{} is not a key", Shown(entry.first)));
      const std::string word = entry.first.Scalar(), key = Below(at.key, word);
      const Key& row = ChildRow(at, entry.first, pattern);
      const auto [first, is_new] = seen.emplace(word, LineOf(entry.first.Mark()));
      // yaml-cpp takes a map with both.
      if (!is_new)
        Fail(at, entry.first, key, fmt::format("duplicate key, first in line {}; delete one of them", first->second));
      if (!row.only.empty() && row.only != kind)
        Fail(at, entry.first, key,
             fmt::format("is for {}{}", row.only, kind.empty() ? "" : fmt::format(", not for {}", kind)));
      children.emplace(&row, at.entries.emplace_back(new Node{at.document, key, word, entry.second}).get());
    }
    // A row's reader relies on the rows before it.
    for (const Key& row : schema_) {
      if (!IsChild(row, pattern)) continue;
      if (row.required && (row.only.empty() || row.only == kind) && !seen.contains(std::string(Leaf(row.path))) &&
          !Leaf(row.path).starts_with('<'))
        Fail(at, at.yaml, Below(at.key, Leaf(row.path)), fmt::format("missing: {}", row.meaning));
      const auto [begin, end] = children.equal_range(&row);
      for (auto child = begin; child != end; ++child) Check(*child->second, row.path);
    }
  }

  [[nodiscard]] const Key& ChildRow(const Node& map, const YAML::Node& entry, const std::string& pattern) const {
    const std::string& word = entry.Scalar();
    std::vector<std::string> known;
    for (const Key& row : schema_) {
      if (!IsChild(row, pattern)) continue;
      const std::string leaf(Leaf(row.path));
      if (leaf == "<name>") {
        RequireName(map, entry);
        return row;
      }
      if (leaf.starts_with('<')) {
        known = leaf == "<state>" ? scope_.states : leaf == "<input>" ? scope_.inputs : scope_.variables;
        if (known.empty() || Contains(known, word)) return row;
      } else if (leaf == word) {
        return row;
      } else if (!Contains(known, leaf)) {
        known.push_back(leaf);
      }
    }
    if (const std::size_t colon = word.find(':'); colon != std::string::npos && Contains(known, word.substr(0, colon)))
      Fail(map, entry, Below(map.key, word),
           fmt::format("unknown key; write a space after the colon: {}: {}", word.substr(0, colon),
                       word.substr(colon + 1)));
    Fail(map, entry, Below(map.key, word),
         fmt::format("unknown key; {}{}", CommaAdvice(word), Suggestion(word, known)));
  }

  static void RequireName(const Node& map, const YAML::Node& entry) {
    const std::string& word = entry.Scalar();
    const std::string at = Below(map.key, word.substr(0, kLongestName));
    if (!IsName(word))
      Fail(map, entry, at,
           fmt::format("is not a name; {}a name has letters, digits and underscores, and does not begin with a digit",
                       CommaAdvice(word)));
    if (word.size() > kLongestName)
      Fail(map, entry, at,
           fmt::format("...: the name has {} letters, at most {} are allowed", word.size(), kLongestName));
  }

  // In { }, a comma ends an expression, and YAML takes the rest for a key.
  static std::string CommaAdvice(const std::string& word) {
    return word.find(')') == std::string::npos ? "" : "put an expression with a comma inside { } into quotes; ";
  }

  static constexpr std::size_t kLongestName = 64;

  static void CheckNumber(Node& at, const Key& row) {
    const YAML::Node& node = at.yaml;
    const std::string not_one = fmt::format(" is not {}", NumberName(row.type));
    if (node.IsNull()) Fail(at, fmt::format("has no value; {}", Wanted(row)));
    if (!node.IsScalar()) Fail(at, fmt::format("{}{}; {}", Shown(node), not_one, Wanted(row)));
    const std::string& token = node.Scalar();
    if (!HasForm(node, Type::kNumber))
      Fail(at,
           fmt::format("\"{}\" is {}, not {}; {}", Shown(node),
                       node.Tag() == "!" ? "quoted text" : fmt::format("tagged {}", node.Tag()), NumberName(row.type),
                       Parse(token, row.type).problem.empty()
                           ? fmt::format("write {}{}", token, node.Tag() == "!" ? " without quotes" : " alone")
                           : Wanted(row)));
    const auto [value, problem] = Parse(token, row.type);
    if (!problem.empty()) Fail(at, fmt::format("{} {}; {}", Shown(node), problem, Correction(token, row)));
    if (!row.range.Contains(value)) Fail(at, fmt::format("{} is outside {}", token, row.range.text()));
    at.number = value;
  }

  void CheckVector(Node& at, const Key& row) const {
    if (!at.yaml.IsSequence()) Fail(at, fmt::format("{} is not a list of numbers", Shown(at.yaml)));
    RequireSize(at, row);
    for (std::size_t i = 0; i < at.yaml.size(); ++i) CheckNumber(AddEntry(at, i), row);
  }

  void RequireSize(const Node& at, const Key& row) const {
    const auto require = [&](std::size_t size, const std::string& why) {
      if (size != 0 && at.yaml.size() != size)
        Fail(at, fmt::format("has {} entries, has to have {}{}", at.yaml.size(), size, why));
    };
    const auto one_each = [&](const std::vector<std::string>& names) { require(names.size(), ": " + Joined(names)); };
    switch (row.size) {
      case Key::Size::kStates: return one_each(scope_.states);
      case Key::Size::kInputs: return one_each(scope_.inputs);
      case Key::Size::kVariables: return one_each(scope_.variables);
      case Key::Size::kSafety:
        return require(ToSize(scope_.safety_dim), ", one a safety coordinate (task.projection or task.body)");
      case Key::Size::kPoint:
        if (at.yaml.size() != 2 && at.yaml.size() != 3)
          Fail(at, fmt::format("has {} entries, has to have 2 or 3", at.yaml.size()));
        return;
      case Key::Size::kAny: return RequireCount(at, row);
    }
  }

  static void RequireCount(const Node& at, const Key& row) {
    if (!row.count.Contains(static_cast<double>(at.yaml.size())))
      Fail(at, fmt::format("has {} entries, which is outside {}", at.yaml.size(), row.count.text()));
  }

  void CheckNames(const Node& at, const Key& row) const {
    RequireCount(at, row);
    const std::vector<std::string> known = row.size == Key::Size::kStates ? scope_.states : scope_.variables;
    std::vector<std::string> seen;
    for (std::size_t i = 0; i < at.yaml.size(); ++i) {
      if (!at.yaml[i].IsScalar())
        Fail(at, at.yaml[i], at.key + Index(i), fmt::format("{} is not a name", Shown(at.yaml[i])));
      const std::string& name = at.yaml[i].Scalar();
      if (Contains(seen, name)) Fail(at, at.yaml[i], at.key + Index(i), fmt::format("duplicate name {}", name));
      if (!known.empty() && !Contains(known, name))
        Fail(at, at.yaml[i], at.key + Index(i),
             fmt::format("{} is not a coordinate; {}", name, Suggestion(name, known)));
      seen.push_back(name);
    }
  }

  void CheckText(const Node& at, const Key& row) {
    const std::string& text = at.yaml.Scalar();
    if (row.type == Type::kExpression && (expressions_ += text.size()) > kLargestExpressions)
      Fail(at, fmt::format("the expressions of this file, up to this one, have {} bytes, at most {} are allowed",
                           expressions_, kLargestExpressions));
    if (text.empty() || text.find('\0') != std::string::npos) Fail(at, "is empty or not text");
    if (row.type == Type::kWord && std::find(row.words.begin(), row.words.end(), text) == row.words.end())
      Fail(at,
           fmt::format("{} is not known; {}", Shown(at.yaml), Suggestion(text, {row.words.begin(), row.words.end()})));
    if (row.type == Type::kChannel &&
        (text.size() > 63 || text.find_first_not_of(kChannelLetters) != std::string::npos))
      Fail(at, fmt::format("{} is not 1 to 63 letters, digits and underscores", Shown(at.yaml)));
  }

  static constexpr const char* kChannelLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";

  const std::span<const Key> schema_;
  const SchemaScope& scope_;
  TaskDraft& draft_;
  std::size_t expressions_ = 0;  // bytes of those so far
};

class Nobody final : public YAML::EventHandler {
  using Mark = YAML::Mark;
  using Anchor = YAML::anchor_t;
  void OnDocumentStart(const Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const Mark&, Anchor) override {}
  void OnAlias(const Mark&, Anchor) override {}
  void OnScalar(const Mark&, const std::string&, Anchor, const std::string&) override {}
  void OnSequenceStart(const Mark&, const std::string&, Anchor, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const Mark&, const std::string&, Anchor, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

// YAML allows no tabs before a key.
std::string TabAdvice(const std::string& text, int line) {
  std::istringstream lines(text);
  std::string at;
  for (int i = 0; i <= line && std::getline(lines, at); ++i) {
    const std::string blank = at.substr(0, at.find_first_not_of(" \t"));
    if (blank.find('\t') != std::string::npos)
      return fmt::format("; line {} is indented with a tab, write spaces", i + 1);
  }
  return "";
}

// Does not use YAML::LoadAll, which reads endless empty documents from a single comma.
YAML::Node ParseYaml(const std::string& path, const std::string& text) {
  try {
    std::istringstream in(text);
    YAML::Parser parser(in);
    Nobody nobody;
    if (!parser.HandleNextDocument(nobody)) throw ConfigError("{}has no YAML document, has to have one", At(path, 1));
    if (parser.HandleNextDocument(nobody))
      throw ConfigError("{}has several YAML documents, has to have one", At(path, 1));
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw ConfigError(
        "{}not valid YAML; look at indentation, brackets, quotes, colons and words with * or &, here and "
        "in the line before{}",
        At(path, LineOf(error.mark)), TabAdvice(text, error.mark.line));
  }
}

// Where a scalar's characters stand in its file, so far as they can be found.
class Layout final {
 public:
  Layout(const std::string& file, const YAML::Mark& mark) : file_(file), line_(mark.line + 1) {
    for (int left = mark.line; left > 0 && at_ < file.size(); --left) at_ = LineEnd() + 1;
    at_ += ToSize(mark.column);
    column_ = mark.column + 1;
    const char style = at_ < file.size() ? file[at_] : '\0';
    if (style == '"' || style == '\'') Advance();
    if (style == '|' || style == '>')  // the text begins in the next line
      while (at_ < file.size() && line_ == mark.line + 1) Advance();
  }

  [[nodiscard]] int line() const { return line_; }
  [[nodiscard]] int column() const { return column_; }

  /** Skips blanks up to this character. False if another one stands there. */
  [[nodiscard]] bool Find(char c) {
    while (at_ < file_.size() && file_[at_] != c && IsBlank(file_[at_])) Advance();
    return at_ < file_.size() && file_[at_] == c;
  }
  void Advance() {
    ++column_;
    if (file_[at_++] == '\n') {
      ++line_;
      column_ = 1;
    }
  }
  static bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

 private:
  [[nodiscard]] std::size_t LineEnd() const { return std::min(file_.find('\n', at_), file_.size()); }

  const std::string& file_;
  std::size_t at_ = 0;
  int line_, column_ = 1;
};

// A scalar as it is laid out in its file. YAML has joined its lines, or cut off their indentation.
ExpressionText Laid(const std::string& scalar, const std::string& file, const YAML::Mark& mark) {
  ExpressionText laid{"", LineOf(mark), mark.column + 1};
  Layout layout(file, mark);
  int line = 0, column = 0;  // behind what is laid
  for (const char c : scalar) {
    if (Layout::IsBlank(c)) continue;
    if (!layout.Find(c)) return {scalar, LineOf(mark), mark.column + 1};  // an escape
    if (laid.text.empty()) {
      laid.line = line = layout.line();
      laid.column = column = layout.column();
    }
    for (; line < layout.line(); ++line, column = 1) laid.text += '\n';
    laid.text.append(ToSize(layout.column() - column), ' ');
    laid.text += c;
    layout.Advance();
    column = layout.column();
  }
  return laid;
}

// The entry of a node that is `key` or leads to it.
const Field::Node* EntryTowards(const Field::Node& node, std::string_view key) {
  for (const auto& entry : node.entries)
    if (key.starts_with(entry->key) &&
        (key.size() == entry->key.size() || key[entry->key.size()] == '.' || key[entry->key.size()] == '['))
      return entry.get();
  return nullptr;
}

}  // namespace

const std::string& Field::key() const { return node_->key; }
const std::string& Field::name() const { return node_->name; }
const std::string& Field::file() const { return node_->document.path(); }

const Field::Node* Field::Find(std::string_view name) const {
  const auto found = std::ranges::find_if(node_->entries, [&](const auto& entry) { return entry->name == name; });
  return found == node_->entries.end() ? nullptr : found->get();
}

Field Field::operator[](std::string_view name) const {
  if (const Node* node = Find(name)) return Field(*node);
  throw std::logic_error(fmt::format("read without a check that it is there: {}", Below(key(), name)));
}

Field Field::operator[](Eigen::Index i) const { return Field(*node_->entries.at(ToSize(i))); }

int Field::Count() const { return static_cast<int>(node_->entries.size()); }

std::vector<Field> Field::Entries() const {
  std::vector<Field> fields;
  for (const auto& entry : node_->entries) fields.emplace_back(*entry);
  return fields;
}

std::vector<Field> Field::Entries(std::string_view name) const {
  return Has(name) ? (*this)[name].Entries() : std::vector<Field>{};
}

std::vector<std::string> Field::Keys() const {
  std::vector<std::string> keys;
  for (const auto& entry : node_->entries) keys.push_back(entry->name);
  return keys;
}

double Field::Number() const { return node_->number; }

std::string Field::Text() const { return node_->yaml.Scalar(); }

Eigen::VectorXd Field::Vector() const {
  Eigen::VectorXd vector(Count());
  for (Eigen::Index i = 0; i < vector.size(); ++i) vector[i] = (*this)[i].Number();
  return vector;
}

std::vector<Eigen::VectorXd> Field::Vectors() const {
  std::vector<Eigen::VectorXd> vectors;
  for (const Field& entry : Entries()) vectors.push_back(entry.Vector());
  return vectors;
}

std::vector<std::string> Field::Names() const {
  std::vector<std::string> names;
  for (const auto& entry : node_->yaml) names.push_back(entry.Scalar());
  return names;
}

ExpressionText Field::Expression() const {
  return Laid(node_->yaml.Scalar(), node_->document.text(), node_->yaml.Mark());
}

void Field::Read(std::vector<double>& value) const {
  const Eigen::VectorXd vector = Vector();
  value.assign(vector.begin(), vector.end());
}

std::string Field::Place() const { return fmt::format("{}{}: ", At(file(), node_->line()), key()); }

void Field::Fail(const std::string& what) const { throw ConfigError(Place() + what); }

void Field::Fail(std::string_view name, const std::string& what) const {
  if (const Node* node = Find(name)) Field(*node).Fail(what);
  throw ConfigError("{}{}: {}", At(file(), node_->line()), Below(key(), name), what);
}

Document::Document(const std::string& path, const std::string& named_by)
    : Document(path, Text{ReadWhole(path, kLargestTaskFile, named_by)}) {}

Document::Document(std::string path, Text text)
    : path_(std::move(path)),
      text_(std::move(text.bytes)),
      root_(new Field::Node{*this, "", "", ParseYaml(path_, text_)}) {}

Document::~Document() = default;

void Document::Read(TaskDraft& draft, std::span<const Key> schema) try {
  Checker(schema, draft).Check(*root_, "");
} catch (const YAML::Exception& error) {
  throw ConfigError("{}a value here has another form than its key wants", At(path_, LineOf(error.mark)));
}

Field Document::root() const { return Field(*root_); }

std::string Document::Place(std::string_view key) const {
  const Field::Node* known = root_.get();
  while (const Field::Node* entry = EntryTowards(*known, key)) known = entry;
  return fmt::format("{}{}: ", At(path_, known->line()), key);
}

void Document::Fail(std::string_view key, const std::string& what) const { throw ConfigError(Place(key) + what); }

}  // namespace forereach
