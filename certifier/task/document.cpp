#include "certifier/task/document.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include "certifier/task/config.h"
#include "certifier/task/files.h"
#include "certifier/task/number.h"

namespace forereach {
namespace {

using Type = Key::Type;
using Values = std::map<std::string, YAML::Node, std::less<>>;

int LineOf(const YAML::Mark& mark) { return mark.line + 1; }

std::string At(const std::string& path, int line) { return path + ":" + std::to_string(line) + ": "; }

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

bool Contains(const std::vector<std::string>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

// What a wrong word was probably meant to be, and what it may be.
std::string Suggestion(std::string_view word, const std::vector<std::string>& known) {
  const auto closer = [&](const std::string& a, const std::string& b) {
    return EditDistance(word, a) < EditDistance(word, b);
  };
  const auto nearest = std::min_element(known.begin(), known.end(), closer);
  const bool near = nearest != known.end() && EditDistance(word, *nearest) <= 1 + nearest->size() / 4;
  return near ? "did you mean " + *nearest + "?" : "known here: " + Joined(known);
}

// The last key of a path, and the path of the map it stands in.
std::string_view Leaf(std::string_view path) { return path.substr(path.rfind('.') + 1); }
std::string_view Parent(std::string_view path) {
  const std::size_t end = path.rfind('.');
  return path.substr(0, end == std::string_view::npos ? 0 : end);
}

// The path of what a path stands in: a list for an index.
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
    case Type::kWord:
    case Type::kText:
    case Type::kChannel: return "a word";
  }
  return "";
}

class Checker {
 public:
  Checker(const std::string& path, const SchemaScope& scope, Values& values)
      : path_(path), scope_(scope), values_(values) {}

  // `pattern` is the path in the schema, `key` the same with names and indices filled in.
  void Check(const YAML::Node& node, const std::string& pattern, const std::string& key) {
    const Key& row = RowFor(node, pattern, key);
    values_.insert_or_assign(key, node);
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
      case Type::kChannel: return CheckText(node, row, key);
    }
  }

 private:
  static std::string Index(std::size_t i) { return std::string("[") + std::to_string(i) + "]"; }

  [[noreturn]] void Fail(const YAML::Node& node, const std::string& key, const std::string& what) const {
    throw ConfigError(At(path_, LineOf(node.Mark())) + OneLine(key + (key.empty() ? "" : ": ") + what));
  }

  const Key& RowFor(const YAML::Node& node, const std::string& pattern, const std::string& key) const {
    const Key* last = nullptr;
    std::string forms;
    for (const Key& row : Schema()) {
      if (row.path != pattern) continue;
      if (HasForm(node, row.type)) return row;
      forms += (last ? " or " : "") + FormName(row.type);
      last = &row;
    }
    // A list of a wrong kind is best explained entry by entry.
    if (last && node.IsSequence() && (last->type == Type::kVectors || last->type == Type::kNames)) return *last;
    Fail(node, key, Shown(node) + " is not " + forms);
  }

  void CheckMap(const YAML::Node& node, const std::string& pattern, const std::string& key) {
    const YAML::Node name = node["name"];
    const std::string kind = name && name.IsScalar() ? name.Scalar() : "";
    std::vector<std::string> seen;
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) Fail(entry.first, key, Shown(entry.first) + " is not a key");
      const std::string word = entry.first.Scalar(), child = Below(key, word);
      const Key& row = ChildRow(entry.first, pattern, key);
      if (Contains(seen, word)) Fail(entry.first, child, "stands twice");
      if (!row.only.empty() && row.only != kind) Fail(entry.first, child, "is for " + row.only + ", not for " + kind);
      seen.push_back(word);
      Check(entry.second, row.path, child);
    }
    for (const Key& row : Schema())
      if (row.required && IsChild(row, pattern) && (row.only.empty() || row.only == kind) &&
          !Contains(seen, Leaf(row.path)) && !Leaf(row.path).starts_with('<'))
        Fail(node, Below(key, Leaf(row.path)), "missing: " + row.meaning);
  }

  const Key& ChildRow(const YAML::Node& entry, const std::string& pattern, const std::string& key) const {
    const std::string& word = entry.Scalar();
    std::vector<std::string> known;
    for (const Key& row : Schema()) {
      if (!IsChild(row, pattern)) continue;
      const std::string leaf(Leaf(row.path));
      if (leaf.starts_with('<')) {
        known = leaf == "<state>" ? scope_.states : scope_.variables();
        if (known.empty() || Contains(known, word)) return row;
      } else if (leaf == word) {
        return row;
      } else if (!Contains(known, leaf)) {
        known.push_back(leaf);
      }
    }
    Fail(entry, Below(key, word), "unknown key; " + Suggestion(word, known));
  }

  void CheckNumber(const YAML::Node& node, const Key& row, const std::string& key) {
    const bool integer = row.type == Type::kInteger;
    if (!HasForm(node, Type::kNumber))
      Fail(node, key, Shown(node) + " is not " + (integer ? "an integer" : "a number"));
    values_.insert_or_assign(key, node);
    const std::string& token = node.Scalar();
    const Parsed<double> number = ParseNumber(token);
    const std::string_view problem = integer ? ParseInteger(token).problem : number.problem;
    if (!problem.empty()) Fail(node, key, Shown(node) + " " + std::string(problem));
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
      case Key::Size::kVariables: return one_each(scope_.variables());
      case Key::Size::kSafety:
        return require(static_cast<std::size_t>(scope_.safety_dim), ", as many as task.projection has rows");
      case Key::Size::kAny: return RequireCount(node, row, key);
    }
  }

  void RequireCount(const YAML::Node& node, const Key& row, const std::string& key) const {
    if (!row.count.Contains(static_cast<double>(node.size())))
      Fail(node, key, "has " + std::to_string(node.size()) + " entries, which is outside " + row.count.text());
  }

  void CheckNames(const YAML::Node& node, const Key& row, const std::string& key) const {
    RequireCount(node, row, key);
    const std::vector<std::string> known = row.size == Key::Size::kStates ? scope_.states : scope_.variables();
    std::vector<std::string> seen;
    for (std::size_t i = 0; i < node.size(); ++i) {
      if (!node[i].IsScalar()) Fail(node[i], key + Index(i), Shown(node[i]) + " is not a name");
      const std::string& name = node[i].Scalar();
      if (Contains(seen, name)) Fail(node[i], key + Index(i), name + " stands twice");
      if (!known.empty() && !Contains(known, name))
        Fail(node[i], key + Index(i), name + " is not a coordinate; " + Suggestion(name, known));
      seen.push_back(name);
    }
  }

  void CheckText(const YAML::Node& node, const Key& row, const std::string& key) const {
    const std::string& text = node.Scalar();
    if (text.empty() || text.find('\0') != std::string::npos) Fail(node, key, "is empty or not text");
    if (row.type == Type::kWord && std::find(row.words.begin(), row.words.end(), text) == row.words.end())
      Fail(node, key, Shown(node) + " is not known; " + Suggestion(text, {row.words.begin(), row.words.end()}));
    if (row.type == Type::kChannel &&
        (text.size() > 63 || text.find_first_not_of(kChannelLetters) != std::string::npos))
      Fail(node, key, Shown(node) + " is not 1 to 63 letters, digits and underscores");
  }

  static constexpr const char* kChannelLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";

  const std::string& path_;
  const SchemaScope& scope_;
  Values& values_;
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

// Not by YAML::LoadAll: of a lone comma it reads empty documents without end.
YAML::Node Parse(const std::string& path, const std::string& text) {
  try {
    std::istringstream in(text);
    YAML::Parser parser(in);
    Nobody nobody;
    if (!parser.HandleNextDocument(nobody)) throw ConfigError(At(path, 1) + "has no YAML document, has to have one");
    if (parser.HandleNextDocument(nobody)) throw ConfigError(At(path, 1) + "has several YAML documents, has to have one");
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw ConfigError(At(path, LineOf(error.mark)) + "not valid YAML: " + error.msg);
  }
}

Eigen::VectorXd VectorOf(const YAML::Node& node) {
  Eigen::VectorXd vector(static_cast<Eigen::Index>(node.size()));
  for (std::size_t i = 0; i < node.size(); ++i)
    vector[static_cast<Eigen::Index>(i)] = ParseNumber(node[i].Scalar()).value;
  return vector;
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

std::vector<std::string> SchemaScope::variables() const {
  std::vector<std::string> all = states;
  all.insert(all.end(), inputs.begin(), inputs.end());
  return all;
}

Document::Document(const std::string& path)
    : path_(path), text_(ReadWhole(path, kLargestTaskFile)), tree_(std::make_unique<Tree>(Tree{Parse(path, text_), {}})) {}

Document::~Document() = default;

void Document::Check(const SchemaScope& scope) {
  tree_->values.clear();
  Checker(path_, scope, tree_->values).Check(tree_->root, "", "");
}

bool Document::Has(std::string_view key) const { return tree_->Find(key) != nullptr; }

bool Document::IsList(std::string_view key) const { return tree_->Get(key).IsSequence(); }

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

int Document::Integer(std::string_view key) const {
  return static_cast<int>(ParseInteger(tree_->Get(key).Scalar()).value);
}

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

void Document::Read(std::string_view key, double& value) const {
  if (Has(key)) value = Number(key);
}

void Document::Read(std::string_view key, int& value) const {
  if (Has(key)) value = Integer(key);
}

void Document::Read(std::string_view key, std::string& value) const {
  if (Has(key)) value = Text(key);
}

void Document::Read(std::string_view key, std::vector<double>& value) const {
  if (!Has(key)) return;
  const Eigen::VectorXd vector = Vector(key);
  value.assign(vector.begin(), vector.end());
}

std::string Document::Place(std::string_view key) const {
  std::string_view known = key;
  while (!known.empty() && !Has(known)) known = Enclosing(known);
  const YAML::Node* node = tree_->Find(known);
  return At(path_, node ? LineOf(node->Mark()) : 1) + std::string(key) + ": ";
}

void Document::Fail(std::string_view key, const std::string& what) const { throw ConfigError(Place(key) + what); }

}  // namespace forereach
