/** Programs from the expressions of a task file: equations of a model, residuals, laws, limits. */
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "forereach/dynamics/model.h"
#include "forereach/dynamics/model_text.h"
#include "forereach/dynamics/program.h"
#include "forereach/numerics/interval.h"

namespace forereach {

/** States, inputs and parameters of a model, and the definitions of the text that it was made from. */
[[nodiscard]] ExpressionNames NamesOf(const NominalModel& model);
/** Those of a text. */
[[nodiscard]] ExpressionNames NamesOf(const ModelText& text);

/** The program whose value k is expressions[k], without derivatives. Its variables are the states, then the inputs; its
parameters have the order of the names.
@throws ExpressionError (expression.h) if an expression or definition is wrong, if the operations up to it are too many,
or if the name of a definition is used twice or belongs to the language.
@throws std::invalid_argument if there are too many states or inputs, if another name is used twice or belongs to the
language, or if the range of a parameter is empty or not finite. */
[[nodiscard]] ProgramDraft MakeProgram(const ExpressionNames& names, std::span<const ExpressionText> expressions);

/** @name The same in parts, for a program in which expressions are evaluated at states of its own. */
///@{
/** The variables that are the states. */
[[nodiscard]] std::vector<Symbol> StatesOf(ProgramDraft& program);
/** The values of the expressions at these states. @throws as MakeProgram. */
[[nodiscard]] std::vector<Symbol> ValuesAt(std::span<const Symbol> states, const ExpressionNames& names,
                                           std::span<const ExpressionText> expressions, ProgramDraft& program);
void SetValues(std::span<const Symbol> values, ProgramDraft& program);
///@}

/** @throws ExpressionError at a call of softplus or smooth_gate on which an expression depends, itself or through
definitions: they have derivatives in residuals only, where `forereach declare` bounds them, and Differentiate needs
those of everything else. @pre MakeProgram takes these expressions. */
void RequireDerivatives(const ExpressionNames& names, std::span<const ExpressionText> expressions);

/** The same as a function of z = (x, u), for planning, simulation and display, not for bounds. */
class TextFunction final {
 public:
  /** @throws as MakeProgram. */
  TextFunction(const ExpressionNames& names, std::span<const ExpressionText> expressions);

  [[nodiscard]] int num_variables() const { return program_->View().variables; }
  [[nodiscard]] int num_values() const { return static_cast<int>(program_->View().value.size()); }

  /** Sets values[k] to the value of expression k in extended precision, for the middles of the parameters.
  @param z num_variables() entries. @param values num_values() entries. */
  void Evaluate(std::span<const double> z, std::span<long double> values) const noexcept;

 private:
  std::shared_ptr<const ProgramDraft> program_;
  std::vector<unsigned char> needed_;
  std::vector<double> parameters_;
};

}  // namespace forereach
