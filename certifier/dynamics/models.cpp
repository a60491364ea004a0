#include "certifier/dynamics/models.h"

#include <stdexcept>

#include "certifier/dynamics/equations_model.h"
#include "certifier/dynamics/kinematic_bicycle.h"
#include "certifier/dynamics/point_mass.h"
#include "certifier/numerics/text.h"

namespace forereach {
namespace {

void RequirePositive(const char* name, double value) {
  if (!(value > 0 && value < kInfinity))
    throw std::invalid_argument(std::string(name) + ": " + ToText(value) + " is not positive and finite");
}

}  // namespace

std::shared_ptr<const NominalModel> MakePointMass(double dt) {
  RequirePositive("dt", dt);
  return std::make_shared<EquationsModel<PointMass>>(PointMass{dt}, "point_mass dt=" + ToText(dt),
                                                     std::map<std::string, double>{{"dt", dt}});
}

std::shared_ptr<const NominalModel> MakeKinematicBicycle(double dt, double wheelbase) {
  RequirePositive("dt", dt);
  RequirePositive("wheelbase", wheelbase);
  return std::make_shared<EquationsModel<KinematicBicycle>>(
      KinematicBicycle{dt, wheelbase}, "kinematic_bicycle dt=" + ToText(dt) + " wheelbase=" + ToText(wheelbase),
      std::map<std::string, double>{{"dt", dt}, {"wheelbase", wheelbase}});
}

}  // namespace forereach
