/** The nominal models that come with the library. */
#pragma once

#include <memory>

#include "certifier/dynamics/model.h"

namespace forereach {

/** point_mass.h with step dt in seconds. @throws std::invalid_argument unless dt is positive and finite. */
[[nodiscard]] std::shared_ptr<const NominalModel> MakePointMass(double dt);

/** kinematic_bicycle.h with step dt in seconds and wheelbase in metres. Same errors for both. */
[[nodiscard]] std::shared_ptr<const NominalModel> MakeKinematicBicycle(double dt, double wheelbase);

}  // namespace forereach
