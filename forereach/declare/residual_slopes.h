/** Enclosures of the partial derivatives of a residual over boxes of coordinates and parameters. */
#pragma once

#include <span>
#include <vector>

#include "forereach/dynamics/jet.h"
#include "forereach/dynamics/parametric_residual.h"
#include "forereach/dynamics/program.h"
#include "forereach/numerics/size.h"

namespace forereach {

/** A residual r : (z, theta) -> R^n with d_z coordinates z and parameters theta. Its arguments are w = (z, theta). */
class ResidualSlopes {
 public:
  ResidualSlopes(int num_states, int num_variables, int num_parameters)
      : num_states_(num_states), num_variables_(num_variables), num_arguments_(num_variables + num_parameters) {}
  virtual ~ResidualSlopes() = default;

  [[nodiscard]] int num_states() const { return num_states_; }
  [[nodiscard]] int num_variables() const { return num_variables_; }
  [[nodiscard]] int num_arguments() const { return num_arguments_; }

  /** Whether r_row may depend on an argument. If not, the derivative is exactly zero. */
  [[nodiscard]] virtual bool Occurs(int row, int argument) const = 0;

  /** Encloses r_row and its derivatives over a box.
  @param w num_arguments() ranges. @param active the arguments for which gradient entries are computed, at most
  Jet::kMaxArguments; it contains `column`.
  @return r_row as a Jet: `slope` encloses the generalised partial derivative by z_column over w, and `curvature[i]` the
  derivative of `slope` by active[i]. `curvature[i]` is unbounded if that derivative does not exist. */
  [[nodiscard]] virtual Jet Enclose(int row, int column, std::span<const Interval> w,
                                    std::span<const int> active) const = 0;

 private:
  int num_states_, num_variables_, num_arguments_;
};

/** Those of a residual as text, by automatic differentiation of its program in interval arithmetic. */
class TextSlopes final : public ResidualSlopes {
 public:
  /** @throws ExpressionError, std::invalid_argument as MakeProgram (text_program.h), or unless there is one value for
  each state. */
  explicit TextSlopes(const ParametricResidual& residual);

  [[nodiscard]] bool Occurs(int row, int argument) const override {
    return rows_[ToSize(row)].occurs[ToSize(argument)];
  }
  [[nodiscard]] Jet Enclose(int row, int column, std::span<const Interval> w,
                            std::span<const int> active) const override;

 private:
  struct Row {
    std::vector<unsigned char> needed;  // of the program's nodes
    std::vector<bool> occurs;           // by argument
  };

  ProgramDraft program_;
  std::vector<Row> rows_;
};

/** The ranges of the parameters, in their order. */
[[nodiscard]] std::vector<Interval> ParameterRanges(const ParametricResidual& residual);

}  // namespace forereach
