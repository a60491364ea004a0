#include "forereach/residual/observations.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "forereach/dynamics/angles.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/residual/no_nominal_value.h"

namespace forereach {
namespace {

double UlpOf(double x) { return NextUp(std::abs(x)) - std::abs(x); }

[[noreturn]] void Refuse(int row, const char* why) {
  throw std::invalid_argument("transition " + std::to_string(row) + ": " + why);
}

// x_next up to its last bit, less the nominal value.
Interval ResidualOf(double x_next, double unit, const Interval& nominal) {
  return Interval(x_next) + Interval(-unit, unit) - nominal;
}

// The residual for the number of turns that brings it next to zero. The division may be rounded: if the result is
// within a quarter of a turn, no other number of turns gives such a result (docs/soundness.md, 3.14).
Interval ResidualOfAngle(double x_next, const Interval& nominal) {
  const double turns = std::round((nominal.Middle() - x_next) / kTurn.lower);
  return ResidualOf(x_next, std::max(UlpOf(x_next), kAngleUnit), nominal) + Interval(turns) * kTurn;
}

bool IsWithinAQuarterTurn(const Interval& residual) {
  return -kQuarterTurn <= residual.lower && residual.upper <= kQuarterTurn;
}

[[noreturn]] void RefuseAngle(int row, const std::string& name, const Interval& residual) {
  throw AmbiguousAngle(row, "transition " + std::to_string(row) + ": " + name + " is " + ToText(residual.Middle()) +
                                " rad away from the nominal model's next value, up to whole turns, which is more than "
                                "pi/2: how often it has turned cannot be told");
}

}  // namespace

Observations Observe(const NominalModel& model, const Transitions& transitions) {
  const int n = model.num_states(), count = transitions.size();
  if (count == 0) throw std::invalid_argument("transitions: none given, at least one is needed");
  if (transitions.z.cols() != model.num_variables() || transitions.x_next.cols() != n ||
      transitions.x_next.rows() != count)
    throw std::invalid_argument("transitions: sizes do not fit the model " + model.name());

  Observations observations{transitions.z, Eigen::MatrixXd(count, n), Eigen::MatrixXd(count, n)};
  Linearization nominal;
  for (int i = 0; i < count; ++i) {
    const Eigen::VectorXd z = transitions.z.row(i);
    if (!z.allFinite() || !transitions.x_next.row(i).allFinite()) Refuse(i, "not finite");
    model.Linearize({z.data(), ToSize(z.size())}, nominal);
    for (int k = 0; k < n; ++k) {
      const double x_next = transitions.x_next(i, k);
      const bool is_angle = model.IsAngle(k);
      const Interval& value = nominal.value[ToSize(k)];
      const Interval residual = is_angle ? ResidualOfAngle(x_next, value) : ResidualOf(x_next, UlpOf(x_next), value);
      if (!residual.IsFinite()) throw NoNominalValue(i, model.state_names()[ToSize(k)]);
      if (is_angle && !IsWithinAQuarterTurn(residual)) RefuseAngle(i, model.state_names()[ToSize(k)], residual);
      observations.lower(i, k) = residual.lower;
      observations.upper(i, k) = residual.upper;
    }
  }
  return observations;
}

}  // namespace forereach
