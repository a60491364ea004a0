/** The nominal models that come with the library. */
#pragma once

#include <memory>
#include <vector>

#include "certifier/dynamics/model.h"

namespace forereach {

/** The model of point_mass.h. @param dt step, s. @throws std::invalid_argument unless dt is positive and finite. */
[[nodiscard]] std::shared_ptr<const NominalModel> MakePointMass(double dt);

/** The model of kinematic_bicycle.h. @param dt step, s. @param wheelbase metres. @param angles the states that are
angles, by their indices, ascending: none, or theta.
@throws std::invalid_argument unless both are positive and finite, or for another angle. */
[[nodiscard]] std::shared_ptr<const NominalModel> MakeKinematicBicycle(double dt, double wheelbase,
                                                                       std::vector<int> angles = {});

/** The step of a model in s: its parameter dt, which every model of a task has. 0 if it has none. */
[[nodiscard]] double StepOf(const NominalModel& model);

/** The equations of a model in continuous time, one for each state: those of its text, or of the two models above.
Empty if the text says what the next state is. */
[[nodiscard]] std::vector<ExpressionText> RatesOf(const NominalModel& model);

}  // namespace forereach
