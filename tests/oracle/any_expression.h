/** Random expressions: of every operation, tame ones, and ones with kinks. */
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/oracle/random.h"

namespace forereach {

/** An expression with every operation of the language. @param leaves names and numbers. @param gates with softplus and
smooth_gate too, which models may not use. */
inline std::string AnyExpression(Random& random, const std::vector<std::string>& leaves, int depth,
                                 bool gates) {  // NOLINT(misc-no-recursion): not deep
  static const std::vector<std::string> unary{"sin",  "cos", "tan", "asin", "acos", "atan",
                                              "sqrt", "exp", "log", "tanh", "abs",  "signed_square"};
  static const std::vector<std::string> binary{"atan2", "min", "max", "hypot"};
  const auto one_of = [&](const std::vector<std::string>& all) {
    return all[static_cast<std::size_t>(random.Below(static_cast<int>(all.size())))];
  };
  if (depth == 0) return one_of(leaves);
  const auto inner = [&] { return AnyExpression(random, leaves, random.Below(depth), gates); };
  switch (random.Below(gates ? 8 : 6)) {
    case 0: return one_of(unary) + "(" + inner() + ")";
    case 1: return one_of(binary) + "(" + inner() + ", " + inner() + ")";
    case 2: return "(" + inner() + ")^" + std::to_string(random.Integer(-2, 3));
    case 3: return "(" + inner() + ")/(3 + " + inner() + ")";
    case 4: return "(" + inner() + ")*(" + inner() + ")";
    case 5: return "(" + inner() + (random.Coin() ? " - " : " + ") + inner() + ")";
    case 6: return "softplus(" + inner() + ", c)";
    default: return "smooth_gate(" + inner() + ")";
  }
}

/** Writes random expressions by rules, which a text separates by "; ". In a rule A and B are expressions of one level
less, L is a leaf, # a power and N a number. A rule that stands twice is twice as likely. */
class RuledExpression {
 public:
  struct Rules {
    std::string_view rules, bold{};  // one expression in thirty is a bold one, if there are any
    double leaves = 0.1;             // how likely an expression ends early
    int least_power, largest_power;
    double numbers = 0;  // how likely a leaf is a number
    std::function<std::string(Random&)> number{};
  };
  RuledExpression(Random& random, const Rules& rules, std::vector<std::string> names)
      : random_(random), rules_(rules), names_(std::move(names)), all_(Split(rules.rules)), bold_(Split(rules.bold)) {}

  void Add(const std::string& name) { names_.push_back(name); }

  [[nodiscard]] std::string operator()(int depth) {
    if (depth == 0 || random_.Coin(rules_.leaves)) return Leaf();
    const bool is_bold = !bold_.empty() && random_.Coin(0.03);
    const std::string a = (*this)(depth - 1);
    std::string text;
    for (const char c : OneOf(is_bold ? bold_ : all_)) {
      if (c == 'A')
        text += a;
      else if (c == 'B')
        text += (*this)(depth - 1);
      else if (c == 'L')
        text += Leaf();
      else if (c == '#')
        text += std::to_string(random_.Integer(rules_.least_power, rules_.largest_power));
      else if (c == 'N')
        text += rules_.number(random_);
      else
        text += c;
    }
    return text;
  }

 private:
  template <class T>
  [[nodiscard]] const T& OneOf(const std::vector<T>& all) {
    return all[static_cast<std::size_t>(random_.Below(static_cast<int>(all.size())))];
  }
  std::string Leaf() {
    return rules_.numbers > 0 && random_.Coin(rules_.numbers) ? rules_.number(random_) : OneOf(names_);
  }

  static std::vector<std::string_view> Split(std::string_view rules) {
    std::vector<std::string_view> all;
    for (std::size_t end; !rules.empty(); rules.remove_prefix(std::min(end, rules.size())))
      end = std::min(rules.find("; "), rules.size()), all.push_back(rules.substr(0, end)), end += 2;
    return all;
  }

  Random& random_;
  const Rules& rules_;
  std::vector<std::string> names_;
  std::vector<std::string_view> all_, bold_;
};

/** Over names whose values are about 1. Most have all derivatives there; one in thirty calls of a function may have a
pole or a kink. */
inline RuledExpression TameExpression(Random& random, std::vector<std::string> names) {
  static const RuledExpression::Rules rules{
      .rules =
          "A + B; A + B; A - (B); A - (B); (A)*(B); (A)*(B); (A)*(B); (A)/(1.5 + sin(B)); -(A)^#; "
          "(2 + tanh(A))^-2; (2 + tanh(A))^N; sin(A); cos(A); tan(tanh(A)); asin(0.9*sin(A)); "
          "acos(0.9*cos(A)); atan(A); atan2(A, 2 + cos(B)); sqrt(0.5 + (A)^2); exp(-(A)^2); log(1.2 + (A)^2); "
          "hypot(A, 0.3); 0.5*signed_square(sin(A) - 0.5); tanh(A)",
      .bold = "abs(A); min(A, L); max(A, L); 1/(A); sqrt(A); log(A); tan(A)",
      .least_power = 2,
      .largest_power = 4,
      .numbers = 0.2,
      .number = [](Random& of) {
        std::array<char, 32> text;
        const int digits = of.Integer(1, 17);
        return std::string(text.data(), static_cast<std::size_t>(std::snprintf(text.data(), text.size(), "%.*g", digits,
                                                                               of.Uniform(0.1, 2))));
      }};
  return {random, rules, std::move(names)};
}

/** With kinks and edges of domains where names are whole halves. */
inline RuledExpression KinkedExpression(Random& random, std::vector<std::string> names) {
  static const RuledExpression::Rules rules{
      .rules =
          "A + B; A - (B); (A)*(B); (A)*(B); (A)^#; abs(A); abs(A); abs(A); min(A, B); min(A, B); max(A, B); "
          "max(A, B); sqrt(A); hypot(A, B); (A)/(B); asin(A); atan2(A, B); sin(A)",
      .leaves = 0.15,
      .least_power = 2,
      .largest_power = 3,
      .numbers = 0.25,
      .number = [](Random& of) {
        return std::array{"0", "0.5", "1", "2"}[static_cast<std::size_t>(of.Below(4))];
      }};
  return {random, rules, std::move(names)};
}

}  // namespace forereach
