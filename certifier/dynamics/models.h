/** The nominal models that come with the library. */
#pragma once

#include <memory>

#include "certifier/dynamics/model.h"

namespace forereach {

/** The model of point_mass.h. @param dt step, s. @throws std::invalid_argument unless dt is positive and finite. */
[[nodiscard]] std::shared_ptr<const NominalModel> MakePointMass(double dt);

/** The model of kinematic_bicycle.h. @param dt step, s. @param wheelbase metres.
@throws std::invalid_argument unless both are positive and finite. */
[[nodiscard]] std::shared_ptr<const NominalModel> MakeKinematicBicycle(double dt, double wheelbase);

}  // namespace forereach
