/** Nominal models from text. */
#pragma once

#include <memory>

#include "certifier/dynamics/model.h"
#include "certifier/dynamics/model_text.h"

namespace forereach {

/** The model that a text describes. Rates with the Euler step and equations of x+ make a ProgramModel, midpoint and rk4
a StagedModel.
@throws ExpressionError (expression.h) if an expression is wrong.
@throws std::invalid_argument if there are no or too many states, inputs or operations, if an equation is missing, if a
name is used twice or belongs to the language, if a range is empty or not finite, or if there is no positive dt. */
[[nodiscard]] std::shared_ptr<const NominalModel> MakeTextModel(const ModelText& text);

}  // namespace forereach
