#include "verifier/expressions.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "forereach/numerics/size.h"

namespace forereach::verifier {
namespace {

// What the language calls by name. hypot is no operation of its own.
struct Function {
  std::string_view name;
  int arguments;
  std::optional<Op> op;
};
constexpr std::array kFunctions{Function{"sin", 1, Op::kSin},
                                Function{"cos", 1, Op::kCos},
                                Function{"tan", 1, Op::kTan},
                                Function{"asin", 1, Op::kAsin},
                                Function{"acos", 1, Op::kAcos},
                                Function{"atan", 1, Op::kAtan},
                                Function{"sqrt", 1, Op::kSqrt},
                                Function{"exp", 1, Op::kExp},
                                Function{"log", 1, Op::kLog},
                                Function{"tanh", 1, Op::kTanh},
                                Function{"abs", 1, Op::kAbs},
                                Function{"smooth_gate", 1, Op::kSmoothGate},
                                Function{"signed_square", 1, Op::kSignedSquare},
                                Function{"atan2", 2, Op::kAtan2},
                                Function{"min", 2, Op::kMin},
                                Function{"max", 2, Op::kMax},
                                Function{"softplus", 2, Op::kSoftplus},
                                Function{"hypot", 2, std::nullopt}};

const Function* FindFunction(std::string_view name) {
  const auto* const found = std::ranges::find(kFunctions, name, &Function::name);
  return found == kFunctions.end() ? nullptr : found;
}

constexpr std::string_view kDigits = "0123456789";
constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_";

bool IsIn(std::string_view set, char c) { return set.find(c) != std::string_view::npos; }

enum class Kind { kNumber, kName, kSymbol, kEnd };

struct Token {
  Kind kind = Kind::kEnd;
  std::string_view text;
  std::size_t place = 0;

  [[nodiscard]] bool Is(char symbol) const { return kind == Kind::kSymbol && text[0] == symbol; }
};

class Lexer {
 public:
  explicit Lexer(const ExpressionText& expression) : expression_(expression), text_(expression.text) {}

  Token Next() {
    constexpr std::string_view kBlank = " \t\r\n";
    at_ = std::min(text_.find_first_not_of(kBlank, at_), text_.size());
    if (at_ == text_.size()) return {Kind::kEnd, {}, at_};
    const std::size_t begin = at_;
    if (IsIn(kLetters, text_[at_])) {
      while (at_ < text_.size() && (IsIn(kLetters, text_[at_]) || IsIn(kDigits, text_[at_]))) ++at_;
      return {Kind::kName, text_.substr(begin, at_ - begin), begin};
    }
    if (IsIn(kDigits, text_[at_]) || text_[at_] == '.') return Number();
    if (IsIn("+-*/^(),", text_[at_])) return {Kind::kSymbol, text_.substr(at_++, 1), begin};
    Fail(begin, "this character has no meaning in an expression");
  }

  [[noreturn]] void Fail(std::size_t place, const std::string& what) const {
    const std::string_view before = text_.substr(0, place);
    const auto breaks = std::ranges::count(before, '\n');
    const std::size_t in_line = breaks == 0 ? place + ToSize(expression_.column) : place - before.rfind('\n');
    throw ExpressionError("line " + std::to_string(expression_.line + breaks) + ", column " + std::to_string(in_line) +
                          ": " + what);
  }

 private:
  // 12  1.5  .5  1e-3
  Token Number() {
    const std::size_t begin = at_;
    const std::size_t whole = SkipDigits();
    if (whole > 1 && text_[begin] == '0') Fail(begin, "a number has no leading zero");
    if (at_ < text_.size() && text_[at_] == '.') {
      ++at_;
      if (SkipDigits() == 0) Fail(begin, "a number has a digit after its point");
    }
    if (at_ < text_.size() && IsIn("eE", text_[at_])) {
      ++at_;
      if (at_ < text_.size() && IsIn("+-", text_[at_])) ++at_;
      if (SkipDigits() == 0) Fail(begin, "an exponent has a digit");
    }
    if (at_ < text_.size() && (IsIn(kLetters, text_[at_]) || text_[at_] == '.'))
      Fail(at_, "a number ends before a letter or a second point");
    return {Kind::kNumber, text_.substr(begin, at_ - begin), begin};
  }

  std::size_t SkipDigits() {
    const std::size_t begin = at_;
    at_ = std::min(text_.find_first_not_of(kDigits, at_), text_.size());
    return at_ - begin;
  }

  const ExpressionText& expression_;
  std::string_view text_;
  std::size_t at_ = 0;
};

// What waits for its right operand or for its closing parenthesis. A sign binds between * and ^.
struct Pending {
  enum class Kind { kBinary, kSign, kParenthesis, kCall };
  Kind kind;
  char symbol = ' ';
  std::size_t place = 0;
  const Function* function = nullptr;
  int arguments = 1;  ///< Of a call, so far.

  [[nodiscard]] bool IsOpen() const { return kind == Kind::kParenthesis || kind == Kind::kCall; }
  [[nodiscard]] bool Nests() const { return kind != Kind::kBinary || symbol == '^'; }
  [[nodiscard]] int strength() const {
    if (kind == Kind::kSign) return 3;
    return symbol == '^' ? 4 : symbol == '*' || symbol == '/' ? 2 : 1;
  }
};

// The value of what has been read, and n if it is the literal n or -n of a whole number.
struct Value {
  int place = -1;
  std::optional<int> whole;
};

// Dijkstra's shunting yard: values and pending operations on a stack each.
class Parser {
 public:
  Parser(const ExpressionText& expression, const Names& names, Tape& tape)
      : lexer_(expression), names_(names), tape_(tape) {
    if (expression.text.size() > kMaxExpressionSize)
      lexer_.Fail(0, "the expression has " + std::to_string(expression.text.size()) + " characters, at most " +
                         std::to_string(kMaxExpressionSize) + " are allowed");
  }

  int Run() {
    Token token = lexer_.Next();
    bool wants_value = true;
    while (wants_value || token.kind != Kind::kEnd) {
      const Token next = token.kind == Kind::kEnd ? token : lexer_.Next();
      wants_value = wants_value ? TakeValue(token, next) : TakeOperator(token);
      token = call_opened_ ? lexer_.Next() : next;
      call_opened_ = false;
      if (tape_.size() > kMaxOperations)
        lexer_.Fail(token.place, "more than " + std::to_string(kMaxOperations) + " operations");
    }
    FinishDownTo(0);
    if (!pending_.empty()) lexer_.Fail(pending_.back().place, "this parenthesis is not closed");
    return values_.back().place;
  }

 private:
  // Returns whether a value is wanted still.
  bool TakeValue(const Token& token, const Token& next) {
    switch (token.kind) {
      case Kind::kNumber: values_.push_back(NumberOf(token)); return false;
      case Kind::kName:
        if (!next.Is('(')) {
          values_.push_back({PlaceOf(token), {}});
          return false;
        }
        Push({Pending::Kind::kCall, '(', next.place, FunctionOf(token)});
        call_opened_ = true;
        return true;
      case Kind::kSymbol:
        if (token.Is('(')) {
          Push({Pending::Kind::kParenthesis, '(', token.place});
          return true;
        }
        if (token.Is('-')) Push({Pending::Kind::kSign, '-', token.place});
        if (token.Is('-') || token.Is('+')) return true;
        break;
      case Kind::kEnd: break;
    }
    lexer_.Fail(token.place, "expected a number, a name or an opening parenthesis");
  }

  // Returns whether a value is wanted next.
  bool TakeOperator(const Token& token) {
    if (token.kind != Kind::kSymbol || token.Is('(')) lexer_.Fail(token.place, "expected an operator");
    if (token.Is(')')) {
      Close(token);
      return false;
    }
    if (token.Is(',')) {
      FinishDownTo(0);
      if (pending_.empty() || pending_.back().kind != Pending::Kind::kCall)
        lexer_.Fail(token.place, "a comma separates the arguments of a function");
      ++pending_.back().arguments;
      return true;
    }
    const Pending binary{Pending::Kind::kBinary, token.text[0], token.place};
    FinishDownTo(binary.strength() + (token.Is('^') ? 1 : 0));  // ^ groups to the right, the others to the left
    Push(binary);
    return true;
  }

  void Push(const Pending& pending) {
    nesting_ += pending.Nests();
    if (nesting_ > kMaxNesting)
      lexer_.Fail(pending.place, "nested deeper than " + std::to_string(kMaxNesting) + " levels");
    pending_.push_back(pending);
  }
  Pending Pop() {
    const Pending last = pending_.back();
    pending_.pop_back();
    nesting_ -= last.Nests();
    return last;
  }
  Value PopValue() {
    const Value last = values_.back();
    values_.pop_back();
    return last;
  }

  // Carries out what is pending since the last open parenthesis and binds at least so strongly.
  void FinishDownTo(int strength) {
    while (!pending_.empty() && !pending_.back().IsOpen() && pending_.back().strength() >= strength) {
      const Pending last = Pop();
      const Value right = PopValue();
      values_.push_back(last.kind == Pending::Kind::kSign ? Negated(right)
                                                          : Value{Combined(last.symbol, PopValue(), right), {}});
    }
  }

  void Close(const Token& token) {
    FinishDownTo(0);
    if (pending_.empty()) lexer_.Fail(token.place, "this parenthesis was not opened");
    const Pending open = Pop();
    if (open.kind == Pending::Kind::kParenthesis) return;
    const Function& function = *open.function;
    if (open.arguments != function.arguments)
      lexer_.Fail(token.place, std::string(function.name) + " takes " + std::to_string(function.arguments) +
                                   " argument(s), not " + std::to_string(open.arguments));
    const int second = function.arguments == 2 ? PopValue().place : -1;
    const int first = PopValue().place;
    values_.push_back({function.op ? tape_.Add(*function.op, first, second) : Hypotenuse(first, second), {}});
  }

  int Combined(char symbol, const Value& left, const Value& right) {
    switch (symbol) {
      case '+': return tape_.Add(Op::kAdd, left.place, right.place);
      case '-': return tape_.Add(Op::kSubtract, left.place, right.place);
      case '*': return tape_.Add(Op::kMultiply, left.place, right.place);
      case '/': return tape_.Add(Op::kDivide, left.place, right.place);
      default: break;
    }
    if (right.whole == 0) return tape_.Number(1);  // also where the base has no value
    if (right.whole) return tape_.Add({Op::kPower, left.place, -1, *right.whole});
    const int logarithm = tape_.Add(Op::kLog, left.place);
    return tape_.Add(Op::kExp, tape_.Add(Op::kMultiply, right.place, logarithm));
  }

  int Hypotenuse(int a, int b) {
    const int squares = tape_.Add(Op::kAdd, tape_.Add({Op::kPower, a, -1, 2}), tape_.Add({Op::kPower, b, -1, 2}));
    return tape_.Add(Op::kSqrt, squares);
  }

  Value Negated(const Value& value) {
    const bool is_literal = value.whole && tape_.at(value.place).op == Op::kNumber;
    return {tape_.Add(Op::kNegate, value.place), is_literal ? std::optional(-*value.whole) : std::nullopt};
  }

  Value NumberOf(const Token& token) {
    double number = 0;
    const auto [end, error] = std::from_chars(token.text.data(), token.text.data() + token.text.size(), number);
    if (error != std::errc() || end != token.text.data() + token.text.size())
      lexer_.Fail(token.place, "this number exceeds the range of doubles");
    Value value{tape_.Number(number), {}};
    if (number == std::floor(number) && number <= kMaxExponent) value.whole = static_cast<int>(number);
    return value;
  }

  int PlaceOf(const Token& token) {
    if (token.text == "pi") return tape_.Number(std::numbers::pi);
    const auto found = names_.find(token.text);
    if (found == names_.end()) lexer_.Fail(token.place, "unknown name " + std::string(token.text));
    return found->second;
  }
  const Function* FunctionOf(const Token& token) {
    const Function* const function = FindFunction(token.text);
    if (function == nullptr) lexer_.Fail(token.place, "unknown function " + std::string(token.text));
    return function;
  }

  Lexer lexer_;
  const Names& names_;
  Tape& tape_;
  std::vector<Pending> pending_;
  std::vector<Value> values_;
  int nesting_ = 0;
  bool call_opened_ = false;
};

}  // namespace

bool IsReserved(std::string_view name) { return name == "pi" || FindFunction(name) != nullptr; }

int Parse(const ExpressionText& expression, const Names& names, Tape& tape) {
  return Parser(expression, names, tape).Run();
}

}  // namespace forereach::verifier
