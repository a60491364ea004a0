#include "certifier/residual/observations.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "certifier/numerics/size.h"

namespace forereach {
namespace {

double UlpOf(double x) { return NextUp(std::abs(x)) - std::abs(x); }

[[noreturn]] void Refuse(int row, const char* why) {
  throw std::invalid_argument("transition " + std::to_string(row) + ": " + why);
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
      const double x_next = transitions.x_next(i, k), ulp = UlpOf(x_next);
      const Interval residual = Interval(x_next) + Interval(-ulp, ulp) - nominal.value[ToSize(k)];
      if (!residual.IsFinite()) Refuse(i, "the nominal model has no finite value there");
      observations.lower(i, k) = residual.lower;
      observations.upper(i, k) = residual.upper;
    }
  }
  return observations;
}

}  // namespace forereach
