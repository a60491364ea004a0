// Expressions: any text is an expression whose value does not change when every operation is put into parentheses, or
// it is refused at a place inside it. The verifier's parser takes the same texts and gives them the same values.
#include "forereach/dynamics/expression.h"

#include <bit>
#include <charconv>
#include <optional>

#include "forereach/dynamics/jet.h"
#include "fuzz/fuzz.h"
#include "verifier/expressions.h"
#include "verifier/jet.h"

namespace forereach {
namespace {

using Kind = Expression::Kind;
using Node = Expression::Node;

const std::vector<std::string> kNames{"x", "y", "theta", "v", "omega", "dt"};

std::string Decimal(double number) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, number).ptr};
}

std::string Call(const Node& node, const std::string& a, const std::string& b) {
  const auto function = std::ranges::find(Functions(), node.function, &NamedFunction::function);
  return std::string(function->name) + "(" + a + (node.b < 0 ? "" : ", " + b) + ")";
}

std::string Operation(const Node& node, const std::string& a, const std::string& b) {
  switch (node.kind) {
    case Kind::kNegate: return "(-" + a + ")";
    case Kind::kAdd: return "(" + a + "+" + b + ")";
    case Kind::kSubtract: return "(" + a + "-" + b + ")";
    case Kind::kMultiply: return "(" + a + "*" + b + ")";
    case Kind::kDivide: return "(" + a + "/" + b + ")";
    case Kind::kPower: return "(" + a + "^(0+" + b + "))";  // the sum is no number
    case Kind::kWholePower: return "(" + a + "^" + std::to_string(node.b) + ")";
    default: return Call(node, a, b);
  }
}

// The text with parentheses around each operation; empty if it would be too long.
std::string Parenthesised(const Expression& expression) {
  constexpr std::size_t kLongest = 2000;
  std::vector<std::string> texts;
  for (const Node& node : expression.nodes) {
    if (node.kind == Kind::kNumber) {
      texts.push_back(Decimal(node.number));
    } else if (node.kind == Kind::kName) {
      texts.push_back(kNames[ToSize(node.a)]);
    } else {
      const bool has_second = node.b >= 0 && node.kind != Kind::kWholePower;
      texts.push_back(Operation(node, texts[ToSize(node.a)], has_second ? texts[ToSize(node.b)] : std::string()));
    }
    if (texts.back().size() > kLongest) return "";
  }
  return texts.back();
}

constexpr double kValues[] = {0.75, -1.25, 0.5, 3, -0.1, 0.05};

double ValueOf(const Expression& expression) {
  return Evaluate<double>(expression, kValues, [](double x) { return x; });
}

// The same bits; two that are not numbers are the same.
bool AreSame(double a, double b) {
  return (a != a && b != b) || std::bit_cast<std::uint64_t>(a + 0.0) == std::bit_cast<std::uint64_t>(b + 0.0);
}

// The value by the verifier's parser and arithmetic; none if it refuses the text.
std::optional<verifier::Real> VerifiersValue(const std::string& text) {
  verifier::Tape tape;
  verifier::Names names;
  for (std::size_t i = 0; i < kNames.size(); ++i)
    names[kNames[i]] = tape.Add({verifier::Op::kVariable, -1, -1, static_cast<int>(i)});
  try {
    const std::vector<int> result{verifier::Parse({text}, names, tape)};
    const std::vector<verifier::Real> z(std::begin(kValues), std::end(kValues));
    return verifier::Evaluate(tape, result, verifier::RealArithmetic(z, {})).front();
  } catch (const verifier::ExpressionError& error) {
    Require(*error.what() != '\0');
    return std::nullopt;
  }
}

// Two enclosures of one number.
bool Overlap(const Interval& a, const verifier::Real& b) {
  return !CertainlyBelow(a.upper, b) && !CertainlyBelow(b, a.lower);
}

int NumLines(const std::string& text) { return 1 + static_cast<int>(std::ranges::count(text, '\n')); }

}  // namespace

bool Try(Bytes data) {
  const std::string text(data.begin(), data.end());
  const std::optional<verifier::Real> verified = VerifiersValue(text);
  Expression expression;
  try {
    expression = ParseExpression({text}, kNames);
  } catch (const ExpressionError& error) {
    Require(!verified);
    Require(*error.what() != '\0' && 1 <= error.line() && error.line() <= NumLines(text) && 1 <= error.column() &&
            error.column() <= static_cast<int>(text.size()) + 1);
    return false;
  }
  Require(!expression.nodes.empty() && expression.nodes.size() <= text.size());
  const std::vector<Jet> at(std::begin(kValues), std::end(kValues));
  Require(verified &&
          Overlap(Evaluate<Jet>(expression, at, [](double number) { return Jet(number); }).value, *verified));
  const std::string again = Parenthesised(expression);
  if (!again.empty()) try {
      Require(AreSame(ValueOf(ParseExpression({again}, kNames)), ValueOf(expression)));
    } catch (const ExpressionError& error) {
      Require(std::string_view(error.what()).find("nested deeper") != std::string_view::npos);
    }
  return true;
}

}  // namespace forereach
