/** Random expressions: of every operation, tame ones, and ones with kinks. */
#pragma once

#include <array>
#include <cstdio>
#include <string>
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

/** Writes random expressions over names whose values are about 1. Most have all derivatives there; one in thirty calls
of a function may have a pole or a kink. */
class TameExpression {
 public:
  TameExpression(Random& random, std::vector<std::string> names) : random_(random), names_(std::move(names)) {}

  void Add(const std::string& name) { names_.push_back(name); }

  [[nodiscard]] std::string operator()(int depth) {
    if (depth == 0 || random_.Coin(0.1)) return Leaf();
    if (random_.Coin(0.03)) return Bold(depth - 1);
    const std::string a = (*this)(depth - 1);
    switch (random_.Below(23)) {
      case 0:
      case 1: return a + " + " + (*this)(depth - 1);
      case 2:
      case 3: return a + " - (" + (*this)(depth - 1) + ")";
      case 4:
      case 5:
      case 6: return "(" + a + ")*" + "(" + (*this)(depth - 1) + ")";
      case 7: return "(" + a + ")/(1.5 + sin(" + (*this)(depth - 1) + "))";
      case 8: return "-(" + a + ")^" + std::to_string(random_.Integer(2, 4));
      case 9: return "(2 + tanh(" + a + "))^" + (random_.Coin() ? "-2" : Number());
      case 10: return "sin(" + a + ")";
      case 11: return "cos(" + a + ")";
      case 12: return "tan(tanh(" + a + "))";
      case 13: return "asin(0.9*sin(" + a + "))";
      case 14: return "acos(0.9*cos(" + a + "))";
      case 15: return "atan(" + a + ")";
      case 16: return "atan2(" + a + ", 2 + cos(" + (*this)(depth - 1) + "))";
      case 17: return "sqrt(0.5 + (" + a + ")^2)";
      case 18: return "exp(-(" + a + ")^2)";
      case 19: return "log(1.2 + (" + a + ")^2)";
      case 20: return "hypot(" + a + ", 0.3)";
      case 21: return "0.5*signed_square(sin(" + a + ") - 0.5)";
      default: return "tanh(" + a + ")";
    }
  }

 private:
  std::string Number() {
    std::array<char, 32> text;
    return {text.data(), static_cast<std::size_t>(std::snprintf(text.data(), text.size(), "%.*g",
                                                                random_.Integer(1, 17), random_.Uniform(0.1, 2)))};
  }
  std::string Leaf() {
    return random_.Coin(0.2) ? Number()
                             : names_[static_cast<std::size_t>(random_.Below(static_cast<int>(names_.size())))];
  }
  std::string Bold(int depth) {
    const std::string a = (*this)(depth);
    switch (random_.Below(7)) {
      case 0: return "abs(" + a + ")";
      case 1: return "min(" + a + ", " + Leaf() + ")";
      case 2: return "max(" + a + ", " + Leaf() + ")";
      case 3: return "1/(" + a + ")";
      case 4: return "sqrt(" + a + ")";
      case 5: return "log(" + a + ")";
      default: return "tan(" + a + ")";
    }
  }

  Random& random_;
  std::vector<std::string> names_;
};

/** Writes random expressions with kinks and edges of domains where names are whole halves. */
class KinkedExpression {
 public:
  KinkedExpression(Random& random, std::vector<std::string> names) : random_(random), names_(std::move(names)) {}

  void Add(const std::string& name) { names_.push_back(name); }

  [[nodiscard]] std::string operator()(int depth) {
    if (depth == 0 || random_.Coin(0.15)) return Leaf();
    const std::string a = (*this)(depth - 1);
    switch (random_.Below(18)) {
      case 0: return a + " + " + (*this)(depth - 1);
      case 1: return a + " - (" + (*this)(depth - 1) + ")";
      case 2:
      case 3: return "(" + a + ")*(" + (*this)(depth - 1) + ")";
      case 4: return "(" + a + ")^" + std::to_string(random_.Integer(2, 3));
      case 5:
      case 6:
      case 7: return "abs(" + a + ")";
      case 8:
      case 9: return "min(" + a + ", " + (*this)(depth - 1) + ")";
      case 10:
      case 11: return "max(" + a + ", " + (*this)(depth - 1) + ")";
      case 12: return "sqrt(" + a + ")";
      case 13: return "hypot(" + a + ", " + (*this)(depth - 1) + ")";
      case 14: return "(" + a + ")/(" + (*this)(depth - 1) + ")";
      case 15: return "asin(" + a + ")";
      case 16: return "atan2(" + a + ", " + (*this)(depth - 1) + ")";
      default: return "sin(" + a + ")";
    }
  }

 private:
  std::string Leaf() {
    static const std::vector<std::string> numbers{"0", "0.5", "1", "2"};
    const auto& all = random_.Coin(0.25) ? numbers : names_;
    return all[static_cast<std::size_t>(random_.Below(static_cast<int>(all.size())))];
  }

  Random& random_;
  std::vector<std::string> names_;
};

}  // namespace forereach
