/** The expressions of a task file. docs/expressions.md describes the language.

ParseExpression makes a flat list of operations from a text, and Evaluate applies them to values of any scalar type: to
Symbol, which records a program (program.h), or to numbers. */
#pragma once

#include <cmath>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "forereach/dynamics/model_text.h"
#include "forereach/dynamics/saturation.h"
#include "forereach/numerics/size.h"

namespace forereach {

inline constexpr std::size_t kLargestExpression = 1 << 16;  ///< Bytes.
/** Of all expressions of one file, in bytes: each is read several times, by whatever may use it. */
inline constexpr std::size_t kLargestExpressions = 1 << 20;
inline constexpr int kDeepestExpression = 200;  ///< Parentheses, signs and powers inside each other.
inline constexpr int kLargestWholePower = 64;

/** A text is not an expression, or uses a name that is not known. */
class ExpressionError final : public std::invalid_argument {
 public:
  /** @param line, column where the error is, both counted from 1. @param word, known see below. */
  ExpressionError(int line, int column, const std::string& what, std::string word = {},
                  std::vector<std::string> known = {})
      : std::invalid_argument(what), line_(line), column_(column), word_(std::move(word)), known_(std::move(known)) {}

  [[nodiscard]] int line() const { return line_; }
  [[nodiscard]] int column() const { return column_; }
  /** The wrong name, and the names that could stand in its place; empty if the error is another one. */
  [[nodiscard]] const std::string& word() const { return word_; }
  [[nodiscard]] const std::vector<std::string>& known() const { return known_; }

 private:
  int line_, column_;
  std::string word_;
  std::vector<std::string> known_;
};

enum class Function : unsigned char {
  kSin,
  kCos,
  kTan,
  kAsin,
  kAcos,
  kAtan,
  kSqrt,
  kExp,
  kLog,
  kTanh,
  kAbs,
  kAtan2,  ///< atan2(y, x)
  kMin,
  kMax,
  kSignedSquare,  ///< a |a|
  kHypot,         ///< sqrt(a^2 + b^2)
  kSoftplus,      ///< softplus(x, temperature), see saturation.h
  kSmoothGate     ///< smooth_gate(e), see saturation.h
};

struct NamedFunction {
  std::string_view name;
  Function function;
  int arguments;  ///< 1 or 2.
};
/** Every function of the language. */
[[nodiscard]] std::span<const NamedFunction> Functions();

/** Whether a text has the form of a name: a letter or underscore, then letters, digits and underscores. */
[[nodiscard]] bool IsName(std::string_view text);
/** Whether a name belongs to the language: a function or pi. */
[[nodiscard]] bool IsReserved(std::string_view name);

/** Names and their places in an order, found in logarithmic time: a hostile text uses many names often. */
class NameList final {
 public:
  NameList() = default;
  explicit NameList(std::span<const std::string> names) {
    for (const std::string& name : names) static_cast<void>(Add(name));
  }

  /** Appends a name. False if an equal one was there before, which Find then goes on to find. */
  bool Add(const std::string& name);
  /** The place of a name; -1 if it is not there. */
  [[nodiscard]] int Find(std::string_view name) const;
  [[nodiscard]] const std::vector<std::string>& all() const { return names_; }

 private:
  std::vector<std::string> names_;
  std::map<std::string, int, std::less<>> places_;
};

/** A parsed expression: operations in the order of evaluation, which is that of the text. The last one is the value. */
struct Expression {
  enum class Kind : unsigned char {
    kNumber,      ///< `number`
    kName,        ///< the name with index a
    kNegate,      ///< -a
    kAdd,         ///< a + b
    kSubtract,    ///< a - b
    kMultiply,    ///< a b
    kDivide,      ///< a / b
    kPower,       ///< exp(b log a)
    kWholePower,  ///< a^b, where b is the exponent itself, |b| <= kLargestWholePower
    kCall         ///< function(a) or function(a, b)
  };
  struct Node {
    Kind kind = Kind::kNumber;
    Function function = Function::kSin;
    int a = -1, b = -1;  ///< Indices of earlier nodes, except where `kind` says otherwise.
    double number = 0;
    int line = 1, column = 1;  ///< Of the number, name, operator or function.
  };

  std::vector<Node> nodes;
};

/** Parses a text. The stack is bounded, and the time is that of finding each name.
@param names the names that may be used. The first of equal names counts.
@throws ExpressionError if the text is not an expression, is larger than kLargestExpression, is nested deeper than
kDeepestExpression, or uses another name. */
[[nodiscard]] Expression ParseExpression(const ExpressionText& text, const NameList& names);
[[nodiscard]] inline Expression ParseExpression(const ExpressionText& text, std::span<const std::string> names) {
  return ParseExpression(text, NameList(names));
}

namespace internal {

template <class T>
T Call(Function function, const T& a, const T& b) {
  using std::abs, std::acos, std::asin, std::atan, std::atan2, std::cos, std::exp, std::log, std::max, std::min,
      std::pow, std::sin, std::sqrt, std::tan, std::tanh;
  switch (function) {
    case Function::kSin: return sin(a);
    case Function::kCos: return cos(a);
    case Function::kTan: return tan(a);
    case Function::kAsin: return asin(a);
    case Function::kAcos: return acos(a);
    case Function::kAtan: return atan(a);
    case Function::kSqrt: return sqrt(a);
    case Function::kExp: return exp(a);
    case Function::kLog: return log(a);
    case Function::kTanh: return tanh(a);
    case Function::kAbs: return abs(a);
    case Function::kSignedSquare: return SignedSquare(a);
    case Function::kAtan2: return atan2(a, b);
    case Function::kMin: return min(a, b);
    case Function::kMax: return max(a, b);
    case Function::kHypot: return sqrt(pow(a, 2) + pow(b, 2));
    case Function::kSoftplus: return Softplus(a, b);
    case Function::kSmoothGate: return SmoothGate(a);
  }
  throw std::logic_error("an expression with a function that has no value");
}

template <class T>
T ValueOf(const Expression::Node& node, std::span<const T> earlier) {
  using Kind = Expression::Kind;
  using std::exp, std::log, std::pow;
  const T& a = earlier[ToSize(node.a)];
  const T& b = earlier[ToSize(node.kind == Kind::kWholePower || node.b < 0 ? node.a : node.b)];
  switch (node.kind) {
    case Kind::kNegate: return -a;
    case Kind::kAdd: return a + b;
    case Kind::kSubtract: return a - b;
    case Kind::kMultiply: return a * b;
    case Kind::kDivide: return a / b;
    case Kind::kPower: return exp(b * log(a));
    case Kind::kWholePower: return pow(a, node.b);
    case Kind::kCall: return Call(node.function, a, b);
    case Kind::kNumber:
    case Kind::kName: break;
  }
  throw std::logic_error("an expression with an operation that has no operands");
}

}  // namespace internal

/** The value of an expression over the scalar type T, which has the operators, functions and pow(T, int) that the
expression uses. @param values of the names, in their order. @param number makes a T from a double. */
template <class T, class Number>
[[nodiscard]] T Evaluate(const Expression& expression, std::span<const T> values, const Number& number) {
  using Kind = Expression::Kind;
  std::vector<T> results;
  results.reserve(expression.nodes.size());
  for (const Expression::Node& node : expression.nodes) switch (node.kind) {
      case Kind::kNumber: results.push_back(number(node.number)); break;
      case Kind::kName: results.push_back(values[ToSize(node.a)]); break;
      default: results.push_back(internal::ValueOf<T>(node, results)); break;
    }
  return results.back();
}

}  // namespace forereach
