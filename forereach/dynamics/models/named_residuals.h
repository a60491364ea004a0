/** Residuals from a list of names and parameters: those of a task file, and those that come with the library. */
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forereach/dynamics/model.h"
#include "forereach/dynamics/parametric_residual.h"

namespace forereach {

/** What a residual adds to a model: its own parameters and definitions, and the expressions of the states that it
changes, by their names. */
struct ResidualText {
  std::string name;  ///< For messages.
  std::vector<ModelText::Parameter> parameters;
  std::vector<ModelText::Definition> definitions;
  std::map<std::string, ExpressionText, std::less<>> values;
};

/** The residual of a model: the names of the model come before its own.
@throws std::invalid_argument if it changes a state that the model does not have. The expressions are not parsed. */
[[nodiscard]] ParametricResidual ResidualOf(const NominalModel& model, const ResidualText& text);

/** The residuals of the paper's target systems. Each may be used with every model that has the names which it uses.

heading_saturation, of a car, Eq. (bicycle-residual-heading): lateral forces saturate, so it turns less than the
kinematic bicycle. It is zero while the lateral acceleration is below friction times gravity.
- understeer: fraction of the heading rate lost in full saturation
- friction, gravity (m/s^2), gate_temperature (s^2/m): where and how fast the saturation begins

velocity_knee, of a point mass, Eqs. (pointmass-residual-accel), (pointmass-discrete-residual): drag and a lateral force
that increase above a speed.
- damping, cross (1/s): the drag along the velocity and the force across it
- knee, softplus_temperature (m/s): where and how fast they begin
- regularizer (m/s), smoothing (m^2/s^2): keep the gain finite and the speed differentiable at rest

The parameters have the paper's values. */
[[nodiscard]] std::span<const ResidualText> NamedResiduals();

/** The one with this name. @throws std::invalid_argument if there is none. */
[[nodiscard]] const ResidualText& ResidualNamed(std::string_view name);

}  // namespace forereach
