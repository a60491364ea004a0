#include "certifier/declare/flow.h"

#include "certifier/dynamics/kinematic_bicycle.h"
#include "certifier/dynamics/point_mass.h"

namespace forereach {

std::unique_ptr<Flow> MakeFlow(const NominalModel& model) {
  if (model.name() == KinematicBicycle::kName)
    return std::make_unique<EquationsFlow<KinematicBicycle>>(model.parameters());
  if (model.name() == PointMass::kName) return std::make_unique<EquationsFlow<PointMass>>(model.parameters());
  return nullptr;
}

}  // namespace forereach
