/** Functions of state and input from the expressions of a task, bounded over slices: limits, and places of a body. By
the verifier's own parser and arithmetic. */
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "forereach/dynamics/model.h"
#include "forereach/dynamics/model_text.h"
#include "verifier/real.h"
#include "verifier/tape.h"
#include "verifier/tube.h"

namespace forereach::verifier {

/** Expressions, and where on their tape the wanted ones are. */
struct Formulas {
  Tape tape;
  std::vector<int> results;
};

/** The tape of `expressions`. Its variables and parameters have the order of their names.
@throws ExpressionError (expressions.h). */
[[nodiscard]] Formulas FormulasOf(std::span<const std::string> variables, std::span<const std::string> parameters,
                                  std::span<const ModelText::Definition> definitions,
                                  std::span<const ExpressionText> expressions);

/** h over a slice <c, D>: for every x in it, h(x, u) lies in value + slope . (x - c) + bend, by Taylor's theorem with
the second derivatives over the slice's hull, and in `range`, that of its hull. What value and slope are known up to
counts as bend. */
struct Enclosed {
  Real value;               ///< A point.
  std::vector<Real> slope;  ///< An entry for each state, points.
  Real bend, range;
};

class Functions final {
 public:
  /** Of the model's states, inputs, parameters and definitions. @throws ExpressionError (expressions.h). */
  Functions(const NominalModel& model, std::span<const ExpressionText> expressions);

  [[nodiscard]] bool UsesInput(std::size_t k) const { return uses_input_[k]; }
  /** The value of each expression at z = (x, u), for all values of the parameters. */
  [[nodiscard]] std::vector<Real> At(std::span<const Real> z) const;
  [[nodiscard]] std::vector<Enclosed> Over(const Slice& slice, std::span<const Real> input) const;

 private:
  [[nodiscard]] std::vector<Real> Parameters() const;

  Formulas formulas_;
  std::vector<std::pair<double, double>> parameters_;
  std::vector<bool> uses_input_;
};

/** Functions of a problem's task. */
struct TaskFunctions {
  Functions limits;               ///< Of each limit.
  std::vector<Functions> places;  ///< For each part of the body, of its places.
};

/** Bounds of an enclosed function over its slice. */
[[nodiscard]] Bounds RangeOver(const Slice& slice, const Enclosed& function);

}  // namespace forereach::verifier
