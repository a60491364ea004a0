/** Nominal models from text. */
#pragma once

#include <memory>

#include "forereach/dynamics/model.h"
#include "forereach/dynamics/model_text.h"

namespace forereach {

/** The model that a text describes. Rates with the Euler step and equations of x+ make a ProgramModel, midpoint and rk4
a StagedModel. Its name is the text's followed by " (text)", which is the name of no compiled model.
@throws ExpressionError (expression.h) if an expression is wrong, has no derivatives, or tells how often an angle has
turned (angles.h).
@throws std::invalid_argument if there are no or too many states, inputs or operations, if an equation is missing, if a
name is used twice or belongs to the language, if a range is empty or not finite, if there is no positive dt, or if an
angle is no state or is there twice. */
[[nodiscard]] std::shared_ptr<const NominalModel> MakeTextModel(const ModelText& text);

/** The compiled model (compiled_models.h) in the place of that of a text; `model` itself if this program has no
compiled equations.
@throws std::invalid_argument if it has some, and none of them are those of the text: it was built for another model, or
before the text was changed. */
[[nodiscard]] std::shared_ptr<const NominalModel> CompiledFor(std::shared_ptr<const NominalModel> model);

}  // namespace forereach
