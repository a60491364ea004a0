/** Random models as text. */
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "tests/oracle/any_expression.h"
#include "tests/text_models.h"

namespace forereach {

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
  RuledExpression expression = TameExpression(random, known);
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
  RuledExpression expression = KinkedExpression(random, known);
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

}  // namespace forereach
