#include "forereach/dynamics/equations_header.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <utility>
#include <vector>

#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/stages.h"
#include "forereach/dynamics/text_model.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

// A part of an expression in C++; `is_number`: without a state, an input or a parameter in it.
struct Part {
  std::string text;
  bool is_number = false;
};

// A double of C++: a whole number that is larger than any integer of C++ would not be one, and -0 no negative zero.
std::string DoubleText(double number) {
  const std::string text = ToText(number);
  return text + (text.find_first_of(".e") == std::string::npos ? ".0" : "");
}

std::string NumberText(double number) { return "T(" + DoubleText(number) + ")"; }

// A variable's name in C++, which is no keyword and no name of another variable.
std::string Variable(const std::string& name, std::size_t index) {
  const bool is_reserved = name.starts_with('_') || name.find("__") != std::string::npos;
  return is_reserved ? "v" + std::to_string(index) : "v_" + name;
}

std::string CallText(Function function, const std::string& a, const std::string& b) {
  switch (function) {
    case Function::kSignedSquare: return "SignedSquare(" + a + ")";
    case Function::kHypot: return "sqrt(pow(" + a + ", 2) + pow(" + b + ", 2))";
    case Function::kSoftplus: return "Softplus(" + a + ", " + b + ")";
    case Function::kSmoothGate: return "SmoothGate(" + a + ")";
    default: break;
  }
  const auto named = std::ranges::find(Functions(), function, &NamedFunction::function);
  return std::string(named->name) + "(" + a + (named->arguments == 2 ? ", " + b : "") + ")";
}

class Writer final {
 public:
  explicit Writer(const ModelText& text) : text_(text) {
    for (const auto* variables : {&text.states, &text.inputs})
      for (const ModelText::Variable& variable : *variables) Add(variable.name, false);
    for (const ModelText::Parameter& parameter : text.parameters) Add(parameter.name, false);
  }

  // The body of the struct's function Step, line by line.
  std::string Lines() {
    std::string lines;
    std::size_t k = 0;
    for (; k < text_.states.size() + text_.inputs.size(); ++k)
      lines += Line("const T& " + parts_[k].text + " = z[" + std::to_string(k) + "]");
    for (std::size_t p = 0; p < text_.parameters.size(); ++p)
      lines += Line("const T& " + parts_[k + p].text + " = parameters[" + std::to_string(p) + "]");
    for (const auto& [name, value] : text_.definitions) {
      const Part part = PartOf(value);
      Add(name, part.is_number);
      lines += Line("const T " + parts_.back().text + " = " + part.text);
    }
    for (std::size_t state = 0; state < text_.states.size(); ++state) {
      Part next = PartOf(text_.equations[state]);
      if (text_.integrator == ModelText::Integrator::kEuler)
        next = {parts_[state].text + " + " + parts_[k + Step()].text + " * " + Inner(next), false};
      if (next.is_number) Refuse(text_.equations[state], "is a number");
      lines += "    next[" + std::to_string(state) + "] = " + next.text + ";\n";
    }
    return lines;
  }

 private:
  static std::string Line(const std::string& statement) { return "    [[maybe_unused]] " + statement + ";\n"; }

  void Add(const std::string& name, bool is_number) {
    parts_.push_back({Variable(name, parts_.size()), is_number});
    static_cast<void>(names_.Add(name));
  }

  [[nodiscard]] std::size_t Step() const {
    return ToSize(std::ranges::find(text_.parameters, "dt", &ModelText::Parameter::name) - text_.parameters.begin());
  }

  // In parentheses, unless it is a name, a number or a call with one argument.
  static std::string Inner(const Part& part) {
    const bool is_operation = part.text.find(' ') != std::string::npos || part.text.starts_with('-');
    return is_operation ? "(" + part.text + ")" : part.text;
  }

  [[noreturn]] void Refuse(const ExpressionText& at, const std::string& what) const {
    throw ExportError(text_.file + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) + ": " + what +
                      ", without a state, an input or a parameter in it: write one number, or make it a parameter");
  }

  [[nodiscard]] Part PartOf(const ExpressionText& expression) const {
    using Kind = Expression::Kind;
    const Expression parsed = ParseExpression(expression, names_);
    std::vector<Part> parts;
    for (const Expression::Node& node : parsed.nodes) {
      if (node.kind == Kind::kNumber || node.kind == Kind::kName) {
        parts.push_back(node.kind == Kind::kNumber ? Part{NumberText(node.number), true} : parts_[ToSize(node.a)]);
        continue;
      }
      const bool has_second = node.kind != Kind::kWholePower && node.b >= 0;
      const Part& a = parts[ToSize(node.a)];
      const Part& b = parts[ToSize(has_second ? node.b : node.a)];
      const bool is_root = node.kind == Kind::kCall && node.function == Function::kHypot;
      const bool needs_a = node.kind == Kind::kPower || is_root;  // log(a), a^2
      if ((a.is_number && (b.is_number || needs_a)) || (b.is_number && is_root))
        Refuse({"", node.line, node.column}, "an operation on numbers");
      parts.push_back({Operation(node, a, b), false});
    }
    return parts.back();
  }

  [[nodiscard]] static std::string Operation(const Expression::Node& node, const Part& a, const Part& b) {
    using Kind = Expression::Kind;
    switch (node.kind) {
      case Kind::kNegate: return "-" + Inner(a);
      case Kind::kAdd: return Inner(a) + " + " + Inner(b);
      case Kind::kSubtract: return Inner(a) + " - " + Inner(b);
      case Kind::kMultiply: return Inner(a) + " * " + Inner(b);
      case Kind::kDivide: return Inner(a) + " / " + Inner(b);
      case Kind::kPower: return "exp(" + Inner(b) + " * log(" + a.text + "))";
      case Kind::kWholePower: return "pow(" + a.text + ", " + std::to_string(node.b) + ")";
      case Kind::kCall: return CallText(node.function, a.text, b.text);
      case Kind::kNumber:
      case Kind::kName: break;
    }
    throw std::logic_error("an expression with an operation that has no text");
  }

  const ModelText& text_;
  NameList names_;
  std::vector<Part> parts_;  // of the names
};

template <class List, class Of>
std::string Joined(const List& list, const Of& of) {
  std::string text;
  for (const auto& entry : list) text += (text.empty() ? "" : ", ") + of(entry);
  return text;
}

std::string Quoted(const auto& named) { return "\"" + named.name + "\""; }

template <class List>
std::string NameArray(const std::string& type, const char* member, const List& list) {
  return "  static constexpr std::array<const char*, " + type + "> " + member + "{" +
         Joined(list, [](const auto& named) { return Quoted(named); }) + "};\n";
}

// Units and paths are anybody's text; they neither end a comment nor seem to begin one.
std::string InComment(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  for (const char* mark : {"*/", "/*"})
    for (std::size_t at = 0; (at = text.find(mark, at)) != std::string::npos;) text.insert(at + 1, " ");
  return text;
}

std::string UnitsOf(const std::vector<ModelText::Variable>& variables) {
  return Joined(variables, [](const ModelText::Variable& variable) { return variable.name + " " + variable.unit; });
}

void RequireGain(const ModelText& text) {
  if (HasStages(text.integrator))
    throw ExportError(
        text.file +
        ": model.integrator: midpoint and rk4 are bounded stage by stage, which machine code of the rates makes at "
        "most 1.2 times as fast. What is faster is the whole step, written out in `next`: see \"At full speed\" in "
        "docs/expressions.md");
  for (const auto& [name, lower, upper] : text.parameters)
    if (lower != upper)
      throw ExportError(
          text.file + ": model.parameters." + name +
          ": is a range, with which a step is computed by intervals; machine code makes it at most 1.1 times "
          "as fast. Write one number: the difference belongs to the residual");
}

}  // namespace

std::string StructName(const std::string& name) {
  std::string text;
  bool starts = true;
  for (const char c : name) {
    if (c == '_') {
      starts = true;
      continue;
    }
    text += starts ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
    starts = false;
  }
  const bool is_free = std::ranges::any_of(text, [](unsigned char c) { return std::islower(c) != 0; }) &&
                       std::isdigit(static_cast<unsigned char>(text[0])) == 0 && text != "Eigen";
  return is_free ? text : "Model" + text;
}

std::string EquationsHeader(const ModelText& text, const std::string& name, const std::string& origin) {
  const auto model = MakeTextModel(text);
  RequireGain(text);
  if (const int size = model->program().size; size > kMostCompiled)
    throw ExportError(text.file + ": model: its values and derivatives are " + std::to_string(size) +
                      " operations, more than the " + std::to_string(kMostCompiled) +
                      " that compilers finish with in a minute");
  const std::string parameters = std::to_string(text.parameters.size()), lines = Writer(text).Lines();
  const bool has_signed_squares = lines.find("SignedSquare(") != std::string::npos;
  return "/** " + InComment(origin) + "\n\nStates: " + InComment(UnitsOf(text.states)) +
         ". Inputs: " + InComment(UnitsOf(text.inputs)) + ". */\n" +
         "#pragma once\n\n#include <algorithm>\n#include <array>\n#include <cmath>\n#include <span>\n\n" +
         std::string(has_signed_squares ? "#include \"forereach/dynamics/saturation.h\"\n" : "") +
         "#include \"forereach/numerics/compilation.h\"\n\n"
         "struct " +
         StructName(name) + " {\n" + "  static constexpr int kStates = " + std::to_string(text.states.size()) +
         ", kInputs = " + std::to_string(text.inputs.size()) + ";\n" + "  static constexpr const char* kName = \"" +
         name + "\";\n" + NameArray("kStates", "kStateNames", text.states) +
         NameArray("kInputs", "kInputNames", text.inputs) + NameArray(parameters, "kParameterNames", text.parameters) +
         "\n  /** The values of the parameters, in this order. */\n"
         "  std::array<double, " +
         parameters + "> values{" +
         Joined(text.parameters, [](const auto& parameter) { return DoubleText(parameter.lower); }) + "};\n" +
         "  [[nodiscard]] std::array<double, " + parameters + "> parameters() const { return values; }\n" +
         "\n  /** The equations for every scalar type. @param z the states, then the inputs. @param next the states "
         "after the\n"
         "  step. */\n"
         "  template <class T>\n"
         "  static constexpr void Step(std::span<const T> parameters, std::span<const T> z, std::span<T> next) {\n"
         "    using std::abs, std::acos, std::asin, std::atan, std::atan2, std::cos, std::exp, std::log, std::max, "
         "std::min,\n"
         "        std::pow, std::sin, std::sqrt, std::tan, std::tanh;\n" +
         std::string(has_signed_squares ? "    using forereach::SignedSquare;\n" : "") + lines + "  }\n};\n";
}

}  // namespace forereach
