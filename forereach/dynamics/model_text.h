/** The equations of a nominal model as text, as a task file has them. docs/expressions.md describes the language. */
#pragma once

#include <string>
#include <vector>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** One expression and where it stands, for error messages. Line and column count from 1. */
struct ExpressionText {
  std::string text;
  int line = 1, column = 1;

  friend bool operator==(const ExpressionText&, const ExpressionText&) = default;
};

/** x+ = f0(x, u) in words: names, parameters and expressions. With Integrator::kNone the equations are x+ itself;
otherwise they are the rates x' in continuous time, and the integrator's formula over one step of dt is x+. */
struct ModelText {
  enum class Integrator { kNone, kEuler, kMidpoint, kRk4 };

  struct Variable {
    std::string name, unit;
    friend bool operator==(const Variable&, const Variable&) = default;
  };
  /** A constant that lies in [lower, upper]; the same at all times. */
  struct Parameter {
    std::string name;
    double lower = 0, upper = 0;
    friend bool operator==(const Parameter&, const Parameter&) = default;
  };
  /** An intermediate definition. It may use states, inputs, parameters and earlier definitions. */
  struct Definition {
    std::string name;
    ExpressionText value;
    friend bool operator==(const Definition&, const Definition&) = default;
  };

  std::string name;  ///< For messages.
  std::string file;  ///< Where the text comes from, for messages.
  std::vector<Variable> states, inputs;
  std::vector<Parameter> parameters;  ///< One of them is dt, the step in s, with lower == upper.
  std::vector<Definition> definitions;
  std::vector<ExpressionText> equations;  ///< One for each state, in the order of the states.
  Integrator integrator = Integrator::kNone;
  std::vector<std::string> angles;  ///< The states that are angles (NominalModel::angles), in any order.

  friend bool operator==(const ModelText&, const ModelText&) = default;
};

/** The names that expressions may use, and what they stand for. */
struct ExpressionNames {
  std::vector<std::string> states, inputs;
  std::vector<ModelText::Parameter> parameters;
  std::vector<ModelText::Definition> definitions;  ///< Each may use those before it.
};

}  // namespace forereach
