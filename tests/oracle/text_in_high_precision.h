/** The values of a model as text in high precision. */
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/model_text.h"
#include "forereach/numerics/size.h"
#include "tests/oracle/exact.h"

namespace forereach {

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
  [[nodiscard]] std::vector<exact::Real> operator()(const std::vector<exact::Real>& z) const {
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
  [[nodiscard]] std::vector<exact::Real> Values(const std::vector<exact::Real>& z) const {
    std::vector<exact::Real> known = z, values;
    known.insert(known.end(), parameters_.begin(), parameters_.end());
    const auto value = [&](const Expression& expression) {
      return Evaluate<exact::Real>(expression, known, [](double number) { return exact::Real(number); });
    };
    for (const Expression& definition : definitions_) known.push_back(value(definition));
    for (const Expression& equation : equations_) values.push_back(value(equation));
    return values;
  }

  ModelText text_;
  std::vector<exact::Real> parameters_;
  std::vector<std::string> names_;
  std::vector<Expression> definitions_, equations_;
};

}  // namespace forereach
