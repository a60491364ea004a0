/** Random expressions, and random problems whose models are texts made of them. */
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/text_model.h"
#include "forereach/numerics/size.h"
#include "tests/oracle/problems.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach {

/** An expression with every operation of the language. @param leaves names and numbers. @param gates with softplus and
smooth_gate too, which models may not use. */
inline std::string AnyExpression(Random& random, const std::vector<std::string>& leaves, int depth,
                                 bool gates) {  // NOLINT(misc-no-recursion): not deep
  static const std::vector<std::string> unary{"sin",  "cos", "tan", "asin", "acos", "atan",
                                              "sqrt", "exp", "log", "tanh", "abs"};
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

/** A model of 1 to 4 states and 1 or 2 inputs: weakly coupled, with a random expression in each equation. */
inline ModelText WeaklyCoupledText(Random& random) {
  using Integrator = ModelText::Integrator;
  ModelText text;
  text.name = text.file = "random";
  const double dt = random.Uniform(0.02, 0.2), c = random.Uniform(0.3, 1);
  const bool is_exact = random.Coin(0.7);
  text.parameters = {{"dt", dt, dt}, {"c", c, is_exact ? c : c + random.Uniform(0, 0.1)}, {"k", -1.5, -1.5}};
  std::vector<std::string> leaves{"c", "k", "0.5", "2"};
  const int states = random.Integer(1, 4), inputs = random.Integer(1, 2);
  for (int j = 0; j < states; ++j) text.states.push_back({"x" + std::to_string(j), "1"});
  for (int i = 0; i < inputs; ++i) text.inputs.push_back({"u" + std::to_string(i), "1"});
  for (const auto* variables : {&text.states, &text.inputs})
    for (const auto& [name, unit] : *variables) leaves.insert(leaves.end(), 2, name);
  text.definitions.push_back({"shared", {AnyExpression(random, leaves, 2, false)}});
  leaves.emplace_back("shared");
  text.integrator = std::array{Integrator::kNone, Integrator::kEuler, Integrator::kMidpoint,
                               Integrator::kRk4}[static_cast<std::size_t>(random.Below(4))];
  const auto any = [&](const std::vector<ModelText::Variable>& all) {
    return all[static_cast<std::size_t>(random.Below(static_cast<int>(all.size())))].name;
  };
  for (const auto& [name, unit] : text.states) {
    const std::string rate = "-c*" + name + " + " + any(text.states) + "/2 + " + any(text.inputs) + " + " +
                             (random.Coin() ? "0.2*tanh(" : "0.1*(") + AnyExpression(random, leaves, 4, false) + ")";
    text.equations.push_back({text.integrator == Integrator::kNone ? name + " + dt*(" + rate + ")" : rate});
  }
  return text;
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
    switch (random_.Below(22)) {
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

/** Any number of states and inputs, small ones more often; all integrators; exact parameters and ranges. */
inline ModelText TameText(Random& random) {
  const auto names_of = [](const char* letter, int count) {
    std::vector<std::string> names;
    for (int i = 0; i < count; ++i) names.push_back(letter + std::to_string(i));
    return names;
  };
  const int n = random.Coin(0.9) ? random.Integer(1, 5) : random.Integer(6, 16);
  const auto states = names_of("x", n),
             inputs = names_of("u", random.Coin(0.9) ? random.Integer(1, 2) : random.Integer(3, 8));
  const double dt = random.Uniform(0.02, 0.2);
  std::vector<ModelText::Parameter> parameters{{"dt", dt, dt}};
  std::vector<std::string> known = states;
  known.insert(known.end(), inputs.begin(), inputs.end());
  for (const std::string& name : names_of("p", random.Integer(0, 3))) {
    const double lower = random.Uniform(-1.5, 1.5);
    parameters.push_back({name, lower, lower + (random.Coin() ? 0 : std::ldexp(1, -random.Integer(4, 20)))});
    known.push_back(name);
  }
  TameExpression expression(random, known);
  Lines definitions, equations;
  for (const std::string& name : names_of("d", random.Integer(0, 3))) {
    definitions.emplace_back(name, expression(random.Integer(1, 2)));
    expression.Add(name);
  }
  const auto integrator = static_cast<ModelText::Integrator>(random.Below(4));
  for (const std::string& name : states) {
    const std::string rate = expression(random.Integer(1, 3));
    equations.emplace_back(name, integrator == ModelText::Integrator::kNone ? name + " + dt*(" + rate + ")" : rate);
  }
  return TextModel(equations, inputs, parameters, definitions, integrator);
}

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

/** One to four states; all integrators. */
inline ModelText KinkedText(Random& random) {
  std::vector<std::string> states, inputs{"u0"};
  for (int k = random.Integer(1, 4); k > 0; --k) states.push_back("x" + std::to_string(k));
  std::vector<std::string> known = states;
  known.insert(known.end(), inputs.begin(), inputs.end());
  std::vector<ModelText::Parameter> parameters{{"dt", 0.125, 0.125}};
  if (random.Coin(0.3)) {
    parameters.push_back({"p", 0, random.Coin() ? 0 : 0.03125});
    known.emplace_back("p");
  }
  KinkedExpression expression(random, known);
  Lines definitions, equations;
  if (random.Coin()) {
    definitions.emplace_back("d", expression(2));
    expression.Add("d");
  }
  const auto integrator = static_cast<ModelText::Integrator>(random.Coin() ? 0 : random.Below(4));
  for (const std::string& name : states) {
    const std::string rate = expression(random.Integer(1, 3));
    equations.emplace_back(name, integrator == ModelText::Integrator::kNone ? name + " + dt*(" + rate + ")" : rate);
  }
  return TextModel(equations, inputs, parameters, definitions, integrator);
}

inline ModelText AnyText(Random& random) { return random.Coin() ? WeaklyCoupledText(random) : TameText(random); }

/** f0(z) of a text in high precision, by the formulas of the integrators. @param parameters their values. */
class TextInHighPrecision {
 public:
  TextInHighPrecision(const ModelText& text, const std::vector<double>& parameters)
      : text_(text), parameters_(parameters.begin(), parameters.end()) {
    for (const auto* variables : {&text.states, &text.inputs})
      for (const auto& [name, unit] : *variables) names_.push_back(name);
    for (const auto& parameter : text.parameters) names_.push_back(parameter.name);
    for (const auto& [name, value] : text.definitions) {
      definitions_.push_back(ParseExpression(value, names_));
      names_.push_back(name);
    }
    for (const ExpressionText& equation : text.equations) equations_.push_back(ParseExpression(equation, names_));
  }

  /** @param z states, then inputs. */
  [[nodiscard]] std::vector<Real> operator()(const std::vector<Real>& z) const {
    using Integrator = ModelText::Integrator;
    using exact::Real;
    const Real dt = parameters_[ToSize(std::ranges::find(text_.parameters, "dt", &ModelText::Parameter::name) -
                                       text_.parameters.begin())];
    std::vector<Real> x(z.begin(), z.begin() + static_cast<std::ptrdiff_t>(equations_.size()));
    const auto after = [&](const Real& length, const std::vector<Real>& rates) {
      std::vector<Real> sum = z;
      for (std::size_t k = 0; k < rates.size(); ++k) sum[k] = x[k] + length * rates[k];
      return sum;
    };
    const auto next = [&](const Real& length, const std::vector<Real>& rates) {
      std::vector<Real> sum = after(length, rates);
      sum.resize(x.size());
      return sum;
    };
    const std::vector<Real> k1 = Values(z);
    switch (text_.integrator) {
      case Integrator::kNone: return k1;
      case Integrator::kEuler: return next(dt, k1);
      case Integrator::kMidpoint: return next(dt, Values(after(dt / 2, k1)));
      case Integrator::kRk4: break;
    }
    const std::vector<Real> k2 = Values(after(dt / 2, k1)), k3 = Values(after(dt / 2, k2)), k4 = Values(after(dt, k3));
    std::vector<Real> sum;
    for (std::size_t k = 0; k < k1.size(); ++k) sum.push_back(k1[k] + Real(2) * (k2[k] + k3[k]) + k4[k]);
    return next(dt / 6, sum);
  }

 private:
  [[nodiscard]] std::vector<Real> Values(const std::vector<Real>& z) const {
    std::vector<Real> known = z, values;
    known.insert(known.end(), parameters_.begin(), parameters_.end());
    const auto value = [&](const Expression& expression) {
      return Evaluate<Real>(expression, known, [](double number) { return Real(number); });
    };
    for (const Expression& definition : definitions_) known.push_back(value(definition));
    for (const Expression& equation : equations_) values.push_back(value(equation));
    return values;
  }

  ModelText text_;
  std::vector<Real> parameters_;
  std::vector<std::string> names_;
  std::vector<Expression> definitions_, equations_;
};

constexpr double kTextReach = 3;  ///< Of each state; of each input it is 1.

/** A random text with transitions of it and an admissible residual, for some value of its parameters. Null if the text
has no value at most points. */
inline std::shared_ptr<Problem> AnyTextProblem(Random& random, const ModelText& text) {
  const auto model = MakeTextModel(text);
  const int n = model->num_states(), variables = model->num_variables();
  auto problem = std::make_shared<Problem>(
      WorldOf(model, Within(Eigen::VectorXd::Constant(n, kTextReach)), Within(Eigen::VectorXd::Ones(variables - n))));
  problem->zonotope_order = random.Integer(1, 6);
  Declaration& declaration = problem->declaration;
  for (int k = 0; k < n; ++k) {
    for (int l = 0; l < variables; ++l)
      if (random.Coin(0.2)) declaration.lipschitz(k, l) = random.Uniform(0, 0.05);
    declaration.noise_bound[k] = random.Coin(0.3) ? random.Uniform(0, 1e-3) : 0;
  }
  std::vector<double> parameters;
  for (const auto& [name, lower, upper] : text.parameters) parameters.push_back(random.Coin() ? lower : upper);
  const TextInHighPrecision nominal(text, parameters);
  const Ramps residual(random, declaration.lipschitz);
  const int count = random.Integer(1, 20);
  problem->transitions = {Eigen::MatrixXd(count, variables), Eigen::MatrixXd(count, n)};
  for (int i = 0, attempts = 0; i < count; ++attempts) {
    if (attempts > 20 * count) return nullptr;
    Eigen::VectorXd z(variables), next(n);
    for (int l = 0; l < variables; ++l) z[l] = (l < n ? kTextReach : 1) * random.Uniform(-0.9, 0.9);
    const std::vector<Real> exact_z(z.begin(), z.end()), value = nominal(exact_z);
    for (int k = 0; k < n; ++k)
      next[k] = (value[static_cast<std::size_t>(k)] + residual(exact_z, k) +
                 declaration.noise_bound[k] * random.Uniform(-1, 1))
                    .ToDouble();
    if (!next.allFinite()) continue;
    problem->transitions.z.row(i) = z;
    problem->transitions.x_next.row(i++) = next;
  }
  return problem;
}

inline std::shared_ptr<Problem> AnyTextProblem(Random& random) {
  const ModelText text = AnyText(random);
  return AnyTextProblem(random, text);
}

/** Of states that are points, at kinks and beside them, or touch a kink with an end; and of boxes. */
inline Query KinkedQuery(Random& random, const Problem& problem) {
  const int n = problem.model->num_states(), inputs = problem.model->num_inputs();
  const auto whole_half = [&] { return 0.5 * random.Integer(-3, 3); };
  Eigen::VectorXd center(n), half(n);
  for (int k = 0; k < n; ++k) {
    center[k] = random.Coin(0.7) ? whole_half() : random.Uniform(-1.5, 1.5);
    half[k] = random.Coin(0.6) ? 0 : std::ldexp(1, -random.Integer(3, 12));
    if (random.Coin(0.2)) center[k] += random.Sign() * half[k];
    if (random.Coin(0.1)) center[k] += random.Sign() * std::ldexp(1, -random.Integer(20, 60));
  }
  Query query;
  query.initial_set = Zonotope::FromBox(center, half);
  query.controls = random.Matrix(inputs, random.Integer(1, 4), 0.7);
  for (Eigen::Index i = 0; i < query.controls.size(); ++i)
    if (random.Coin()) query.controls(i) = 0.5 * random.Integer(-2, 2);
  return query;
}

inline Query AnyTextQuery(Random& random, const Problem& problem) {
  const int n = problem.model->num_states(), inputs = problem.model->num_inputs();
  const Eigen::VectorXd center = random.Vector(n, 0.6 * kTextReach);
  Eigen::VectorXd half = random.Vector(n).cwiseAbs();
  half *= random.Coin(0.1) ? 0 : std::ldexp(1, -random.Integer(4, 12));
  Query query;
  query.initial_set = Zonotope::FromBox(center, half);
  query.controls = random.Matrix(inputs, random.Integer(1, 12), 0.7);
  return query;
}

}  // namespace forereach
