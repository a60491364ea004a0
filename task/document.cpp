#include "task/document.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <sstream>
#include <stdexcept>
#include <utility>

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
using Values = std::map<std::string, YAML::Node, std::less<>>;

int LineOf(const YAML::Mark& mark) { return mark.line + 1; }

std::string At(const std::string& path, int line) { return path + ":" + std::to_string(line) + ": "; }

bool Contains(const std::vector<std::string>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

// The last key of a path, and the path of its map.
std::string_view Leaf(std::string_view path) { return path.substr(path.rfind('.') + 1); }
std::string_view Parent(std::string_view path) {
  const std::size_t end = path.rfind('.');
  return path.substr(0, end == std::string_view::npos ? 0 : end);
}

// The path of the enclosing map, or list for an index.
std::string_view Enclosing(std::string_view path) {
  const std::size_t end = path.find_last_of(".[");
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
  return row.unit.empty() || row.unit.starts_with("of ") ? "" : ", its unit is " + row.unit;
}

// What a number has to be: "write a number in (0, 60], its unit is s".
std::string Wanted(const Key& row) { return "write " + NumberName(row.type) + " in " + row.range.text() + UnitOf(row); }

bool Reads(const std::string& token, Type type) {
  return type == Type::kInteger ? ParseInteger(token).problem.empty() : ParseNumber(token).problem.empty();
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
      {Leading(token), " alone" + UnitOf(row)}};
  for (const auto& [other, remark] : tries)
    if (other != token && Reads(other, row.type)) return "write " + other + remark;
  return Wanted(row);
}

class Checker {
 public:
  Checker(const std::string& path, std::span<const Key> schema, const SchemaScope& scope,
          const Document::Visitor& visit, Values& values)
      : path_(path), schema_(schema), scope_(scope), visit_(visit), values_(values) {}

  // `pattern` is the path in the schema, `key` the same with names and indices filled in.
  void Check(const YAML::Node& node, const std::string& pattern, const std::string& key) {
    const Key& row = RowFor(node, pattern, key);
    values_.insert_or_assign(key, node);
    CheckValue(node, row, pattern, key);
    visit_(row, key);
  }

 private:
  void CheckValue(const YAML::Node& node, const Key& row, const std::string& pattern, const std::string& key) {
    switch (row.type) {
      case Type::kMap: return CheckMap(node, pattern, key);
      case Type::kList:
        RequireCount(node, row, key);
        for (std::size_t i = 0; i < node.size(); ++i) Check(node[i], pattern + "[]", key + Index(i));
        return;
      case Type::kNumber:
      case Type::kInteger: return CheckNumber(node, row, key);
      case Type::kVector: return CheckVector(node, row, key);
      case Type::kVectors:
        RequireCount(node, row, key);
        for (std::size_t i = 0; i < node.size(); ++i) CheckVector(node[i], row, key + Index(i));
        return;
      case Type::kNames: return CheckNames(node, row, key);
      case Type::kWord:
      case Type::kText:
      case Type::kExpression:
      case Type::kChannel: return CheckText(node, row, key);
    }
  }

  struct Child {
    std::string key;
    YAML::Node value;
  };

  static std::string Index(std::size_t i) { return std::string("[") + std::to_string(i) + "]"; }

  [[noreturn]] void Fail(const YAML::Node& node, const std::string& key, const std::string& what) const {
    throw ConfigError(At(path_, LineOf(node.Mark())) + OneLine(key + (key.empty() ? "" : ": ") + what));
  }

  // The row of a key whose value is a number or one of these words. Null if it is none of them.
  const Key* WordRowFor(const YAML::Node& node, const std::string& pattern) const {
    const auto has_it = [&](const Key& row) {
      return row.path == pattern && row.type == Type::kWord &&
             std::ranges::find(row.words, node.Scalar()) != row.words.end();
    };
    const auto row = std::ranges::find_if(schema_, has_it);
    return row == schema_.end() ? nullptr : &*row;
  }

  const Key& RowFor(const YAML::Node& node, const std::string& pattern, const std::string& key) const {
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
    Fail(node, key, Shown(node) + " is not " + forms);
  }

  void CheckMap(const YAML::Node& node, const std::string& pattern, const std::string& key) {
    const YAML::Node name = node["name"];
    const std::string kind = name && name.IsScalar() ? name.Scalar() : "";
    std::map<std::string, int> seen;            // the line of each
    std::multimap<const Key*, Child> children;  // in the schema's order, since its rows are in one array
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) Fail(entry.first, key, Shown(entry.first) + " is not a key");
      const std::string word = entry.first.Scalar(), child = Below(key, word);
      const Key& row = ChildRow(entry.first, pattern, key);
      const auto [first, is_new] = seen.emplace(word, LineOf(entry.first.Mark()));
      if (!is_new)
        Fail(entry.first, child,
             "duplicate key, first in line " + std::to_string(first->second) + "; delete one of them");
      if (!row.only.empty() && row.only != kind)
        Fail(entry.first, child, "is for " + row.only + (kind.empty() ? "" : ", not for " + kind));
      children.emplace(&row, Child{child, entry.second});
    }
    // A row's reader relies on the rows before it.
    for (const Key& row : schema_) {
      if (!IsChild(row, pattern)) continue;
      if (row.required && (row.only.empty() || row.only == kind) && !seen.contains(std::string(Leaf(row.path))) &&
          !Leaf(row.path).starts_with('<'))
        Fail(node, Below(key, Leaf(row.path)), "missing: " + row.meaning);
      const auto [begin, end] = children.equal_range(&row);
      for (auto child = begin; child != end; ++child) Check(child->second.value, row.path, child->second.key);
    }
  }

  const Key& ChildRow(const YAML::Node& entry, const std::string& pattern, const std::string& key) const {
    const std::string& word = entry.Scalar();
    std::vector<std::string> known;
    for (const Key& row : schema_) {
      if (!IsChild(row, pattern)) continue;
      const std::string leaf(Leaf(row.path));
      if (leaf == "<name>") {
        RequireName(entry, key);
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
      Fail(entry, Below(key, word),
           "unknown key; write a space after the colon: " + word.substr(0, colon) + ": " + word.substr(colon + 1));
    Fail(entry, Below(key, word), "unknown key; " + CommaAdvice(word) + Suggestion(word, known));
  }

  void RequireName(const YAML::Node& entry, const std::string& key) const {
    const std::string& word = entry.Scalar();
    const std::string at = Below(key, word.substr(0, kLongestName));
    if (!IsName(word))
      Fail(entry, at,
           "is not a name; " + CommaAdvice(word) +
               "a name has letters, digits and underscores, and does not begin with a digit");
    if (word.size() > kLongestName)
      Fail(entry, at,
           "...: the name has " + std::to_string(word.size()) + " letters, at most " + std::to_string(kLongestName) +
               " are allowed");
  }

  // In { }, a comma ends an expression, and YAML takes the rest for a key.
  static std::string CommaAdvice(const std::string& word) {
    return word.find(')') == std::string::npos ? "" : "put an expression with a comma inside { } into quotes; ";
  }

  static constexpr std::size_t kLongestName = 64;

  void CheckNumber(const YAML::Node& node, const Key& row, const std::string& key) {
    const std::string not_one = " is not " + NumberName(row.type);
    if (node.IsNull()) Fail(node, key, "has no value; " + Wanted(row));
    if (!node.IsScalar()) Fail(node, key, Shown(node) + not_one + "; " + Wanted(row));
    const std::string& token = node.Scalar();
    if (!HasForm(node, Type::kNumber))
      Fail(node, key,
           "\"" + Shown(node) + "\" is " + (node.Tag() == "!" ? "quoted text" : "tagged " + node.Tag()) + ", not " +
               NumberName(row.type) + "; " +
               (Reads(token, row.type) ? "write " + token + (node.Tag() == "!" ? " without quotes" : " alone")
                                       : Wanted(row)));
    values_.insert_or_assign(key, node);
    const Parsed<double> number = ParseNumber(token);
    const std::string_view problem = row.type == Type::kInteger ? ParseInteger(token).problem : number.problem;
    if (!problem.empty()) Fail(node, key, Shown(node) + " " + std::string(problem) + "; " + Correction(token, row));
    if (!row.range.Contains(number.value)) Fail(node, key, token + " is outside " + row.range.text());
  }

  void CheckVector(const YAML::Node& node, const Key& row, const std::string& key) {
    if (!node.IsSequence()) Fail(node, key, Shown(node) + " is not a list of numbers");
    values_.insert_or_assign(key, node);
    RequireSize(node, row, key);
    for (std::size_t i = 0; i < node.size(); ++i) CheckNumber(node[i], row, key + Index(i));
  }

  void RequireSize(const YAML::Node& node, const Key& row, const std::string& key) const {
    const auto require = [&](std::size_t size, const std::string& why) {
      if (size != 0 && node.size() != size)
        Fail(node, key, "has " + std::to_string(node.size()) + " entries, has to have " + std::to_string(size) + why);
    };
    const auto one_each = [&](const std::vector<std::string>& names) { require(names.size(), ": " + Joined(names)); };
    switch (row.size) {
      case Key::Size::kStates: return one_each(scope_.states);
      case Key::Size::kInputs: return one_each(scope_.inputs);
      case Key::Size::kVariables: return one_each(scope_.variables);
      case Key::Size::kSafety:
        return require(ToSize(scope_.safety_dim), ", one a safety coordinate (task.projection or task.body)");
      case Key::Size::kPoint:
        if (node.size() != 2 && node.size() != 3)
          Fail(node, key, "has " + std::to_string(node.size()) + " entries, has to have 2 or 3");
        return;
      case Key::Size::kAny: return RequireCount(node, row, key);
    }
  }

  void RequireCount(const YAML::Node& node, const Key& row, const std::string& key) const {
    if (!row.count.Contains(static_cast<double>(node.size())))
      Fail(node, key, "has " + std::to_string(node.size()) + " entries, which is outside " + row.count.text());
  }

  void CheckNames(const YAML::Node& node, const Key& row, const std::string& key) const {
    RequireCount(node, row, key);
    const std::vector<std::string> known = row.size == Key::Size::kStates ? scope_.states : scope_.variables;
    std::vector<std::string> seen;
    for (std::size_t i = 0; i < node.size(); ++i) {
      if (!node[i].IsScalar()) Fail(node[i], key + Index(i), Shown(node[i]) + " is not a name");
      const std::string& name = node[i].Scalar();
      if (Contains(seen, name)) Fail(node[i], key + Index(i), "duplicate name " + name);
      if (!known.empty() && !Contains(known, name))
        Fail(node[i], key + Index(i), name + " is not a coordinate; " + Suggestion(name, known));
      seen.push_back(name);
    }
  }

  void CheckText(const YAML::Node& node, const Key& row, const std::string& key) {
    const std::string& text = node.Scalar();
    if (row.type == Type::kExpression && (expressions_ += text.size()) > kLargestExpressions)
      Fail(node, key,
           "the expressions of this file, up to this one, have " + std::to_string(expressions_) + " bytes, at most " +
               std::to_string(kLargestExpressions) + " are allowed");
    if (text.empty() || text.find('\0') != std::string::npos) Fail(node, key, "is empty or not text");
    if (row.type == Type::kWord && std::find(row.words.begin(), row.words.end(), text) == row.words.end())
      Fail(node, key, Shown(node) + " is not known; " + Suggestion(text, {row.words.begin(), row.words.end()}));
    if (row.type == Type::kChannel &&
        (text.size() > 63 || text.find_first_not_of(kChannelLetters) != std::string::npos))
      Fail(node, key, Shown(node) + " is not 1 to 63 letters, digits and underscores");
  }

  static constexpr const char* kChannelLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";

  const std::string& path_;
  const std::span<const Key> schema_;
  const SchemaScope& scope_;
  const Document::Visitor& visit_;
  Values& values_;
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
      return "; line " + std::to_string(i + 1) + " is indented with a tab, write spaces";
  }
  return "";
}

// Does not use YAML::LoadAll, which reads endless empty documents from a single comma.
YAML::Node Parse(const std::string& path, const std::string& text) {
  try {
    std::istringstream in(text);
    YAML::Parser parser(in);
    Nobody nobody;
    if (!parser.HandleNextDocument(nobody)) throw ConfigError(At(path, 1) + "has no YAML document, has to have one");
    if (parser.HandleNextDocument(nobody))
      throw ConfigError(At(path, 1) + "has several YAML documents, has to have one");
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw ConfigError(At(path, LineOf(error.mark)) + "not valid YAML: " + error.msg + TabAdvice(text, error.mark.line));
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

Eigen::VectorXd VectorOf(const YAML::Node& node) {
  std::vector<double> entries;
  for (const auto& entry : node) entries.push_back(ParseNumber(entry.Scalar()).value);
  return Eigen::Map<const Eigen::VectorXd>(entries.data(), std::ssize(entries));
}

}  // namespace

struct Document::Tree {
  YAML::Node root;
  Values values;

  const YAML::Node* Find(std::string_view key) const {
    const auto found = values.find(key);
    return found == values.end() ? nullptr : &found->second;
  }
  const YAML::Node& Get(std::string_view key) const {
    if (const YAML::Node* node = Find(key)) return *node;
    throw std::logic_error("read without a check that it is there: " + std::string(key));
  }
};

Document::Document(const std::string& path, const std::string& named_by)
    : path_(path),
      text_(ReadWhole(path, kLargestTaskFile, named_by)),
      tree_(std::make_unique<Tree>(Tree{Parse(path, text_), {}})) {}

Document::~Document() = default;

void Document::Check(const SchemaScope& scope, const Visitor& visit, std::span<const Key> schema) {
  Checker(path_, schema, scope, visit, tree_->values).Check(tree_->root, "", "");
}

int Document::Count(std::string_view key) const {
  const YAML::Node* node = tree_->Find(key);
  return node ? static_cast<int>(node->size()) : 0;
}

std::vector<std::string> Document::KeysOf(std::string_view key) const {
  std::vector<std::string> keys;
  if (const YAML::Node* node = tree_->Find(key))
    for (const auto& entry : *node) keys.push_back(entry.first.Scalar());
  return keys;
}

double Document::Number(std::string_view key) const { return ParseNumber(tree_->Get(key).Scalar()).value; }

std::string Document::Text(std::string_view key) const { return tree_->Get(key).Scalar(); }

Eigen::VectorXd Document::Vector(std::string_view key) const { return VectorOf(tree_->Get(key)); }

std::vector<Eigen::VectorXd> Document::Vectors(std::string_view key) const {
  std::vector<Eigen::VectorXd> vectors;
  for (const auto& entry : tree_->Get(key)) vectors.push_back(VectorOf(entry));
  return vectors;
}

std::vector<std::string> Document::Names(std::string_view key) const {
  std::vector<std::string> names;
  for (const auto& entry : tree_->Get(key)) names.push_back(entry.Scalar());
  return names;
}

ExpressionText Document::Expression(std::string_view key) const {
  const YAML::Node& node = tree_->Get(key);
  return Laid(node.Scalar(), text_, node.Mark());
}

void Document::Read(std::string_view key, double& value) const { value = Number(key); }

void Document::Read(std::string_view key, int& value) const {
  value = static_cast<int>(ParseInteger(tree_->Get(key).Scalar()).value);
}

void Document::Read(std::string_view key, std::string& value) const { value = Text(key); }

void Document::Read(std::string_view key, std::vector<double>& value) const {
  const Eigen::VectorXd vector = Vector(key);
  value.assign(vector.begin(), vector.end());
}

void Document::Read(std::string_view key, std::optional<double>& value) const { value = Number(key); }

std::string Document::Place(std::string_view key) const {
  std::string_view known = key;
  while (!known.empty() && tree_->Find(known) == nullptr) known = Enclosing(known);
  const YAML::Node* node = tree_->Find(known);
  return At(path_, node ? LineOf(node->Mark()) : 1) + std::string(key) + ": ";
}

void Document::Fail(std::string_view key, const std::string& what) const { throw ConfigError(Place(key) + what); }

}  // namespace forereach
