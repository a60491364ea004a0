#include "forereach/dynamics/expression.h"

#include <algorithm>
#include <charconv>
#include <numbers>
#include <optional>
#include <system_error>

#include "forereach/numerics/text.h"

namespace forereach {
namespace {

using Kind = Expression::Kind;
using Node = Expression::Node;

constexpr NamedFunction kFunctions[] = {
    {"sin", Function::kSin, 1},     {"cos", Function::kCos, 1},           {"tan", Function::kTan, 1},
    {"asin", Function::kAsin, 1},   {"acos", Function::kAcos, 1},         {"atan", Function::kAtan, 1},
    {"sqrt", Function::kSqrt, 1},   {"exp", Function::kExp, 1},           {"log", Function::kLog, 1},
    {"tanh", Function::kTanh, 1},   {"abs", Function::kAbs, 1},           {"atan2", Function::kAtan2, 2},
    {"min", Function::kMin, 2},     {"max", Function::kMax, 2},           {"signed_square", Function::kSignedSquare, 1},
    {"hypot", Function::kHypot, 2}, {"softplus", Function::kSoftplus, 2}, {"smooth_gate", Function::kSmoothGate, 1}};
constexpr std::string_view kPiName = "pi";

bool IsLetter(char c) { return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || c == '_'; }
bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

const NamedFunction* FindFunction(std::string_view name) {
  const auto found = std::ranges::find(kFunctions, name, &NamedFunction::name);
  return found == std::end(kFunctions) ? nullptr : found;
}

std::vector<std::string> FunctionNames() {
  std::vector<std::string> names;
  for (const NamedFunction& function : kFunctions) names.emplace_back(function.name);
  return names;
}

struct Place {
  int line = 1, column = 1;
};

struct Token {
  enum class Kind { kNumber, kName, kSign, kEnd };
  Kind kind = Kind::kEnd;
  std::string_view text = {};
  double number = 0;
  Place place = {};

  [[nodiscard]] bool Is(char sign) const { return kind == Kind::kSign && text[0] == sign; }
};

std::string Shown(std::string_view text) {
  constexpr std::size_t kMost = 60;
  return std::string(text.substr(0, kMost)) + (text.size() > kMost ? "..." : "");
}

std::string Shown(const Token& token) { return token.kind == Token::Kind::kEnd ? "the end" : Shown(token.text); }

[[noreturn]] void Fail(const Place& place, const std::string& what) {
  throw ExpressionError(place.line, place.column, what);
}

// Splits a text into tokens.
class Lexer final {
 public:
  explicit Lexer(const ExpressionText& text) : text_(text.text), place_{text.line, text.column} {}

  Token Next() {
    while (at_ < text_.size() && IsBlank(text_[at_])) Advance(1);
    Token token{.place = place_};
    if (at_ == text_.size()) return token;
    const char c = text_[at_];
    if (IsDigit(c) || c == '.') {
      token.kind = Token::Kind::kNumber;
      token.text = NumberHere();
      token.number = ValueOf(token.text);
    } else if (IsLetter(c)) {
      token.kind = Token::Kind::kName;
      token.text = text_.substr(at_, NameEnd(at_) - at_);
    } else {
      token.kind = Token::Kind::kSign;
      token.text = SignHere();
    }
    Advance(token.text.size());
    return token;
  }

  /** Whether the next token is an opening parenthesis. */
  [[nodiscard]] bool OpensNext() const {
    std::size_t next = at_;
    while (next < text_.size() && IsBlank(text_[next])) ++next;
    return next < text_.size() && text_[next] == '(';
  }

 private:
  [[nodiscard]] std::size_t DigitsEnd(std::size_t from) const {
    while (from < text_.size() && IsDigit(text_[from])) ++from;
    return from;
  }
  [[nodiscard]] std::size_t NameEnd(std::size_t from) const {
    while (from < text_.size() && (IsLetter(text_[from]) || IsDigit(text_[from]))) ++from;
    return from;
  }
  [[nodiscard]] char Look(std::size_t at) const { return at < text_.size() ? text_[at] : '\0'; }

  [[nodiscard]] std::string_view NumberHere() const {
    const std::size_t whole = DigitsEnd(at_);
    std::size_t end = whole;
    if (Look(whole) == '.') end = DigitsEnd(whole + 1);
    const bool ends_in_point = end == whole + 1;
    if (const char e = Look(end); e == 'e' || e == 'E') {
      const std::size_t sign = Look(end + 1) == '+' || Look(end + 1) == '-' ? 1 : 0;
      if (IsDigit(Look(end + 1 + sign))) end = DigitsEnd(end + 1 + sign);
    }
    const std::string_view number = text_.substr(at_, end - at_);
    if (ends_in_point) Fail(place_, Shown(number) + " is not a number; write digits behind the point");
    if (whole > at_ + 1 && Look(at_) == '0') Fail(place_, Shown(number) + " has a leading zero");
    if (Look(end) == '.') Fail(place_, Shown(number) + ". is not a number");
    if (const std::size_t name = NameEnd(end); name != end)
      Fail(place_, Shown(text_.substr(at_, name - at_)) + " is not a number; write * for a product: " + Shown(number) +
                       "*" + Shown(text_.substr(end, name - end)));
    return number;
  }

  [[nodiscard]] double ValueOf(std::string_view number) const {
    double value = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
    if (error == std::errc::result_out_of_range)
      Fail(place_, Shown(number) + " is too large or too small to represent");
    if (error != std::errc() || end != number.data() + number.size()) Fail(place_, Shown(number) + " is not a number");
    return value;
  }

  [[nodiscard]] std::string_view SignHere() const {
    constexpr std::string_view kSigns = "+-*/^(),";
    const char c = text_[at_];
    if (kSigns.find(c) != std::string_view::npos) {
      if (c == '*' && Look(at_ + 1) == '*') Fail(place_, "** is not an operator; write ^ for a power");
      return text_.substr(at_, 1);
    }
    const bool is_printable = ' ' < c && c < '\x7f';
    std::string shown(1, c);
    if (!is_printable) {
      constexpr std::string_view kDigits = "0123456789abcdef";
      const auto byte = static_cast<unsigned char>(c);
      shown = std::string("the byte 0x") + kDigits[byte / 16] + kDigits[byte % 16];
    }
    Fail(place_, shown + " does not occur in expressions; expected a name, a number or one of + - * / ^ ( ) ,");
  }

  void Advance(std::size_t count) {
    for (; count > 0; --count, ++at_) {
      ++place_.column;
      if (text_[at_] == '\n') place_ = {place_.line + 1, 1};
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
  Place place_;
};

// Operator precedence with a stack of the operators whose last operand is not complete yet.
class Parser final {
 public:
  Parser(const ExpressionText& text, const NameList& names) : lexer_(text), names_(names) {
    if (text.text.size() > kLargestExpression)
      Fail({text.line, text.column}, "has " + std::to_string(text.text.size()) + " bytes, at most " +
                                         std::to_string(kLargestExpression) + " are allowed");
  }

  Expression Parse() {
    bool wants_operand = true;
    for (Token token = lexer_.Next();; token = lexer_.Next()) {
      if (wants_operand) {
        wants_operand = !TakeOperand(token);
      } else {
        if (token.kind == Token::Kind::kEnd) break;
        wants_operand = TakeOperator(token);
      }
    }
    ReduceDownTo(kLowest);
    if (!pending_.empty()) Fail(pending_.back().place, "( has no )");
    return std::move(expression_);
  }

 private:
  static constexpr int kOpen = 0, kLowest = 1, kSum = 1, kProduct = 2, kNegation = 3, kPower = 4;

  struct Pending {
    char sign;       // + - * / ^, n for a negation, and ( for a parenthesis or a call
    int precedence;  // kOpen for (
    Place place;
    const NamedFunction* function = nullptr;  // of a call
    int arguments = 1;                        // begun so far

    // A level holds at most one sum and one product.
    [[nodiscard]] bool is_level() const { return precedence != kSum && precedence != kProduct; }
  };

  // Returns whether the operand is complete.
  bool TakeOperand(const Token& token) {
    if (token.kind == Token::Kind::kNumber) {
      Emit({.kind = Kind::kNumber, .number = token.number}, token.place);
      return true;
    }
    if (token.kind == Token::Kind::kName) return TakeName(token);
    if (token.Is('+')) return false;
    if (token.Is('-')) {
      Push({'n', kNegation, token.place});
    } else if (token.Is('(')) {
      Push({'(', kOpen, token.place});
    } else {
      Fail(token.place, "expected a number, a name or (, found " + Shown(token));
    }
    return false;
  }

  bool TakeName(const Token& token) {
    const NamedFunction* function = FindFunction(token.text);
    if (lexer_.OpensNext()) {
      if (function == nullptr) FailAsFunction(token);
      Push({'(', kOpen, token.place, function});
      static_cast<void>(lexer_.Next());
      return false;
    }
    if (function != nullptr) Fail(token.place, Shown(token) + " is a function; expected ( behind it");
    if (token.text == kPiName) {
      Emit({.kind = Kind::kNumber, .number = std::numbers::pi}, token.place);
      return true;
    }
    const int found = names_.Find(token.text);
    if (found < 0) {
      std::vector<std::string> known = names_.all();
      known.emplace_back(kPiName);
      throw ExpressionError(token.place.line, token.place.column, Shown(token) + " is not a name that is known here",
                            std::string(token.text), std::move(known));
    }
    Emit({.kind = Kind::kName, .a = found}, token.place);
    return true;
  }

  [[noreturn]] void FailAsFunction(const Token& token) const {
    if (token.text == kPiName || names_.Find(token.text) >= 0)
      Fail(token.place, Shown(token) + " is not a function; write * for a product: " + Shown(token) + "*(");
    throw ExpressionError(token.place.line, token.place.column, Shown(token) + " is not a function",
                          std::string(token.text), FunctionNames());
  }

  // Returns whether an operand has to follow.
  bool TakeOperator(const Token& token) {
    if (token.kind == Token::Kind::kSign) switch (token.text[0]) {
        case '+':
        case '-': return Binary(token, kSum);
        case '*':
        case '/': return Binary(token, kProduct);
        case '^':  // to the right: a^b^c is a^(b^c)
          Push({'^', kPower, token.place});
          return true;
        case ',': return Comma(token);
        case ')': return Close(token);
        default: break;
      }
    Fail(token.place,
         "expected an operator" + std::string(pending_.empty() ? "" : " or )") + ", found " + Shown(token));
  }

  bool Binary(const Token& token, int precedence) {
    ReduceDownTo(precedence);
    Push({token.text[0], precedence, token.place});
    return true;
  }

  bool Comma(const Token& token) {
    ReduceDownTo(kLowest);
    if (pending_.empty() || pending_.back().function == nullptr)
      Fail(token.place, ", separates the arguments of a function, and here is none");
    Pending& call = pending_.back();
    if (++call.arguments > call.function->arguments) FailCount(call, "more");
    return true;
  }

  bool Close(const Token& token) {
    ReduceDownTo(kLowest);
    if (pending_.empty()) Fail(token.place, ") has no (");
    const Pending open = Pop();
    if (open.function == nullptr) return false;
    if (open.arguments != open.function->arguments) FailCount(open, std::to_string(open.arguments));
    Node call{.kind = Kind::kCall, .function = open.function->function};
    if (open.arguments == 2) call.b = Take();
    call.a = Take();
    Emit(call, open.place);
    return false;
  }

  [[noreturn]] static void FailCount(const Pending& call, const std::string& count) {
    const int wanted = call.function->arguments;
    Fail(call.place, std::string(call.function->name) + " has " + count + (count == "1" ? " argument" : " arguments") +
                         ", has to have " + std::to_string(wanted));
  }

  void Push(const Pending& pending) {
    pending_.push_back(pending);
    if (pending.is_level() && ++depth_ > kDeepestExpression)
      Fail(pending.place, "is nested deeper than " + std::to_string(kDeepestExpression) + " levels");
  }

  Pending Pop() {
    const Pending top = pending_.back();
    pending_.pop_back();
    if (top.is_level()) --depth_;
    return top;
  }

  // Emits the operators on top that bind at least as tightly.
  void ReduceDownTo(int precedence) {
    while (!pending_.empty() && pending_.back().precedence >= precedence) Reduce(Pop());
  }

  void Reduce(const Pending& top) {
    Node node;
    switch (top.sign) {
      case 'n': node.kind = Kind::kNegate; break;
      case '+': node.kind = Kind::kAdd; break;
      case '-': node.kind = Kind::kSubtract; break;
      case '*': node.kind = Kind::kMultiply; break;
      case '/': node.kind = Kind::kDivide; break;
      default: return ReducePower(top);
    }
    if (top.sign != 'n') node.b = Take();
    node.a = Take();
    Emit(node, top.place);
  }

  void ReducePower(const Pending& top) {
    Node node{.kind = Kind::kPower};
    node.b = Take();
    if (const std::optional<int> exponent = WholeNumber(node.b)) {
      // The exponent's nodes are the last ones.
      expression_.nodes.resize(expression_.nodes.size() -
                               (expression_.nodes[ToSize(node.b)].kind == Kind::kNumber ? 1 : 2));
      node.kind = Kind::kWholePower;
      node.b = *exponent;
    }
    node.a = Take();
    Emit(node, top.place);
  }

  // The whole number that a node is, with or without a sign, if it is small enough for a power.
  [[nodiscard]] std::optional<int> WholeNumber(int index) const {
    const Node& node = expression_.nodes[ToSize(index)];
    const bool is_negative = node.kind == Kind::kNegate;
    const Node& literal = is_negative ? expression_.nodes[ToSize(node.a)] : node;
    if (literal.kind != Kind::kNumber || literal.number > kLargestWholePower ||
        std::trunc(literal.number) != literal.number)
      return std::nullopt;
    const int magnitude = static_cast<int>(literal.number);
    return is_negative ? -magnitude : magnitude;
  }

  void Emit(Node node, const Place& place) {
    node.line = place.line;
    node.column = place.column;
    operands_.push_back(static_cast<int>(expression_.nodes.size()));
    expression_.nodes.push_back(node);
  }

  int Take() {
    const int operand = operands_.back();
    operands_.pop_back();
    return operand;
  }

  Lexer lexer_;
  const NameList& names_;
  Expression expression_;
  std::vector<Pending> pending_;
  std::vector<int> operands_;  // complete, and not yet used
  int depth_ = 0;              // the levels in pending_
};

}  // namespace

std::span<const NamedFunction> Functions() { return kFunctions; }

bool IsName(std::string_view text) {
  return !text.empty() && !IsDigit(text[0]) &&
         std::ranges::all_of(text, [](char c) { return IsLetter(c) || IsDigit(c); });
}

bool IsReserved(std::string_view name) { return name == kPiName || FindFunction(name) != nullptr; }

bool NameList::Add(const std::string& name) {
  const bool is_new = places_.emplace(name, static_cast<int>(names_.size())).second;
  names_.push_back(name);
  return is_new;
}

int NameList::Find(std::string_view name) const {
  const auto found = places_.find(name);
  return found == places_.end() ? -1 : found->second;
}

Expression ParseExpression(const ExpressionText& text, const NameList& names) { return Parser(text, names).Parse(); }

}  // namespace forereach
