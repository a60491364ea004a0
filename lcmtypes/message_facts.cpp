// What lcmtypes/*.lcm say, for who must not say it again. The comments there have a form:
//
//   int16_t outcome;        // {OutcomeName} [unit] meaning
//   double control[128][8]; // {num_steps, num_inputs} [unit] meaning
//                           // and more of it
//
//   // outcome: OutcomeName, without CAUSE_    (or: outcome: LevelName, upper case; or: outcome)
//   const int16_t CAUSE_NONE = 0;  // meaning
//
// A field without a comment is explained by its constants, if it has some, or by the field before it. In braces is, of
// a number that stands for a name, the function that tells it ("FaultName, 0: none" if 0 stands for none), and of an
// array, how many entries are in use. A comment behind an empty line names the field that the constants below it are
// the values of, the function, if there is one, that tells their names, and how the names are made of the constants'.
#include <algorithm>
#include <cctype>
#include <fstream>
#include <iostream>
#include <iterator>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

struct Field {
  std::string type, name, braces, unit, meaning;
  std::vector<std::string> sizes;
};
struct Constant {
  std::string name, number, meaning;
};
struct Group {
  std::string field, function, prefix;
  bool is_upper = false;
  std::vector<Constant> constants;
};
struct Type {
  std::string name;
  std::vector<Field> fields;
  std::vector<Group> groups;

  // Others are parts of messages.
  [[nodiscard]] bool is_message() const {
    return std::ranges::any_of(fields, [](const Field& field) { return field.name == "sequence"; });
  }
};

std::string ReadWhole(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<std::string> SplitAt(const std::string& text, const std::regex& mark) {
  if (text.empty()) return {};
  return {std::sregex_token_iterator(text.begin(), text.end(), mark, -1), {}};
}

Field FieldOf(const std::smatch& match) {
  static const std::regex kComment(R"((?:\{([^}]*)\} ?)?(?:\[([^\]`]*)\](?!\() ?)?(.*))");
  const std::string sizes = match[3], comment = match[4];
  std::smatch parts;
  std::regex_match(comment, parts, kComment);
  Field field{match[1], match[2], parts[1], parts[2], parts[3], {}};
  static const std::regex kSize(R"(\d+)");
  std::copy(std::sregex_token_iterator(sizes.begin(), sizes.end(), kSize), {}, std::back_inserter(field.sizes));
  return field;
}

// The lines of a struct's body.
class Parser final {
 public:
  explicit Parser(Type& type) : type_(type) {}

  // False if the line is not understood.
  bool Take(const std::string& line) {
    static const std::regex kField(R"( *(\w+) +(\w+)((?:\[\d+\])*); *(?:// *(.*))?)"),
        kConstant(R"( *const int16_t (\w+) = (-?\d+); *// *(.*))"), kComment(R"( *// *(.*))"),
        kGroup(R"( *// (\w+)(?:: (\w+)(, upper case)?(?:, without (\w+))?)?)");
    std::smatch match;
    if (std::regex_match(line, match, kConstant) && !type_.groups.empty()) {
      Meaning(type_.groups.back().constants.emplace_back(Constant{match[1], match[2], match[3]}).meaning);
    } else if (std::regex_match(line, match, kField)) {
      Meaning(type_.fields.emplace_back(FieldOf(match)).meaning);
    } else if (meaning_ == nullptr && std::regex_match(line, match, kGroup)) {
      type_.groups.push_back({match[1], match[2], match[4], match[3].matched, {}});
    } else if (meaning_ != nullptr && std::regex_match(line, match, kComment)) {
      *meaning_ += " " + match[1].str();
    } else {
      meaning_ = nullptr;
      return line.find_first_not_of(' ') == std::string::npos;
    }
    return true;
  }

 private:
  void Meaning(std::string& meaning) { meaning_ = &meaning; }

  Type& type_;
  std::string* meaning_ = nullptr;  // that the next line may go on with
};

Type Parse(const std::string& path) {
  std::istringstream lines(ReadWhole(path));
  static const std::regex kBegin(R"(struct (\w+) \{)");
  Type type;
  Parser parser(type);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (std::smatch match; type.name.empty() && std::regex_match(line, match, kBegin))
      type.name = match[1];
    else if (!type.name.empty() && line == "}")
      return type;
    else if (!type.name.empty() && !parser.Take(line))
      throw std::runtime_error(path + ":" + std::to_string(number) +
                               ": neither a field, a constant nor a comment: " + line);
  }
  throw std::runtime_error(path + ": has no struct with an end");
}

bool IsMessage(const Field& field) { return field.type.ends_with("_t") && !field.type.starts_with("int"); }

// ---- As C++.

constexpr const char* kNote = "// Made from lcmtypes/*.lcm by lcmtypes/message_facts.cpp.\n";

std::string Includes(const std::vector<Type>& types) {
  std::string text;
  for (const Type& type : types) text += "#include \"forereach/" + type.name + ".hpp\"\n";
  return text;
}

std::string NameOf(const Group& group, std::string constant) {
  if (!constant.starts_with(group.prefix)) throw std::runtime_error(constant + ": does not begin with " + group.prefix);
  constant.erase(0, group.prefix.size());
  if (!group.is_upper)
    std::ranges::transform(constant, constant.begin(), [](unsigned char c) { return std::tolower(c); });
  return constant;
}

std::string Names(const std::vector<Type>& types) {
  std::string text = kNote + ("#include \"lcmtypes/names.h\"\n\n" + Includes(types)) + "\nnamespace forereach {\n";
  for (const Type& type : types)
    for (const Group& group : type.groups) {
      if (group.function.empty()) continue;
      text += "\nstd::string_view " + group.function + "(std::int16_t number) {\n  switch (number) {\n";
      for (const Constant& constant : group.constants)
        text += "    case " + type.name + "::" + constant.name + ": return \"" + NameOf(group, constant.name) + "\";\n";
      text += "    default: return \"unknown\";\n  }\n}\n";
    }
  return text + "\n}  // namespace forereach\n";
}

// How a visitor is told of a field of `m`.
std::string CallFor(const Field& field) {
  const std::string begin = "(\"" + field.name + "\", m." + field.name;
  if (field.type == "byte") return (field.name.ends_with("_digest") ? ".Digest" : ".Text") + begin + ")";
  if (field.sizes.empty()) {
    if (IsMessage(field)) return ".Nested" + begin + ")";
    if (field.braces.empty()) return begin + ")";
    static const std::string kNone = ", 0: none";
    if (!field.braces.ends_with(kNone)) return ".Code" + begin + ", " + field.braces + ")";
    const std::string function = field.braces.substr(0, field.braces.size() - kNone.size());
    return ".Code" + begin + ", [](std::int16_t n) -> std::string_view { return n == 0 ? \"none\" : " + function +
           "(n); })";
  }
  std::vector<std::string> counts = SplitAt(field.braces, std::regex(", "));
  for (std::string& count : counts) count.insert(0, "m.");
  if (counts.empty()) counts = field.sizes;
  if (counts.size() != field.sizes.size())
    throw std::runtime_error(field.name + ": " + std::to_string(counts.size()) + " counts of entries in use");
  std::string call = (IsMessage(field) ? ".List" : counts.size() == 1 ? ".Row" : ".Rows") + begin;
  for (const std::string& count : counts) call += ", " + count;
  return call + ")";
}

std::string Fields(const std::vector<Type>& types) {
  std::string text = kNote + ("#pragma once\n\n" + Includes(types)) +
                     "#include \"lcmtypes/names.h\"\n\nnamespace forereach {\n",
              messages;
  for (const Type& type : types) {
    text += "\ntemplate <class To>\nvoid Fields(const " + type.name + "& m, To& to) {\n";
    for (const Field& field : type.fields) text += "  to" + CallFor(field) + ";\n";
    text += "}\n";
    if (type.is_message()) messages += (messages.empty() ? "" : ", ") + type.name;
  }
  return text + "\ntemplate <template <class...> class List>\nusing AllMessages = List<" + messages +
         ">;\n\n}  // namespace forereach\n";
}

// ---- As tables.

std::string Code(const std::string& text) { return "`" + text + "`"; }

// A field without a meaning is explained by its constants or by the field before it.
std::string TablesOf(const Type& type) {
  struct Row {
    std::string names, meaning;
  };
  std::vector<Row> rows;
  for (const Field& field : type.fields) {
    if (field.meaning.empty() && std::ranges::find(type.groups, field.name, &Group::field) != type.groups.end())
      continue;
    std::string name = field.name;
    for (const std::string& size : field.sizes) name += "[" + size + "]";
    const std::string unit = IsMessage(field) ? Code(field.type) : field.unit;
    if (unit.empty() && field.meaning.empty() && !rows.empty())
      rows.back().names += ", " + Code(name);
    else
      rows.push_back({Code(name), unit + (unit.empty() || field.meaning.empty() ? "" : ": ") + field.meaning});
  }
  std::string text = "| field | meaning |\n|---|---|\n";
  for (const Row& row : rows) text += "| " + row.names + " | " + row.meaning + " |\n";
  for (const Group& group : type.groups) {
    text += "\n| " + Code(group.field) + " | meaning |\n|---|---|\n";
    for (const Constant& constant : group.constants)
      text += "| " + Code(constant.name) + " " + constant.number + " | " + constant.meaning + " |\n";
  }
  return text;
}

// The document with the tables of each type between its marks.
std::string Document(const std::vector<Type>& types, std::string text) {
  for (const Type& type : types) {
    const std::string begins = "<!-- " + type.name + " -->\n", ends = "<!-- end of " + type.name + " -->\n";
    const std::size_t begin = text.find(begins), end = text.find(ends);
    if (begin == std::string::npos || end == std::string::npos || end < begin)
      throw std::runtime_error("the document has no " + begins + "and after it " + ends);
    text.replace(begin + begins.size(), end - begin - begins.size(), TablesOf(type));
  }
  return text;
}

int Run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 3)
    throw std::runtime_error("message_facts names|fields|document OUT FILE.lcm...: writes what these files say");
  std::vector<Type> types;
  std::transform(arguments.begin() + 2, arguments.end(), std::back_inserter(types), Parse);
  std::ranges::sort(types, {}, &Type::name);
  const std::string &what = arguments[0], &out = arguments[1];
  const std::string text = what == "names"    ? Names(types)
                           : what == "fields" ? Fields(types)
                                              : Document(types, ReadWhole(out));
  std::ofstream file(out, std::ios::binary);
  if (!(file << text << std::flush)) throw std::runtime_error(out + ": cannot be written");
  return 0;
}

}  // namespace

int main(int count, char** arguments) try {
  return Run({arguments + 1, arguments + count});
} catch (const std::exception& error) {
  std::cerr << "message_facts: " << error.what() << "\n";
  return 2;
}
