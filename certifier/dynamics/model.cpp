#include "certifier/dynamics/model.h"

#include "certifier/dynamics/evaluate.h"
#include "certifier/numerics/text.h"

namespace forereach {

std::vector<std::string> NominalModel::variable_names() const {
  std::vector<std::string> names = names_.states;
  names.insert(names.end(), names_.inputs.begin(), names_.inputs.end());
  return names;
}

std::string NominalModel::description() const {
  std::string text = names_.name;
  for (std::size_t p = 0; p < parameters_.size(); ++p)
    text += " " + names_.parameters[p] + "=" + ToText(parameters_[p]);
  return text;
}

void NominalModel::Evaluate(std::span<const double> z, std::span<double> next) const noexcept {
  std::array<long double, kMaxVariables> wide;
  std::ranges::copy(z, wide.begin());
  NodeValues<long double> values;
  forereach::Evaluate<long double>(program_, program_.at_point, parameters_, {wide.data(), z.size()}, values);
  for (std::size_t k = 0; k < next.size(); ++k) next[k] = static_cast<double>(values[ToSize(program_.value[k])]);
}

void NominalModel::Linearize(std::span<const double> z, Linearization& out) const noexcept {
  std::array<Interval, kMaxVariables> point;
  std::ranges::copy(z, point.begin());
  NodeValues<Interval> values;
  forereach::Evaluate<Interval>(program_, program_.at_point, parameters_, {point.data(), z.size()}, values);
  for (std::size_t k = 0; k < ToSize(num_states()); ++k) out.value[k] = values[ToSize(program_.value[k])];
  out.count = program_.num_first;
  for (std::size_t e = 0; e < ToSize(program_.num_first); ++e) {
    const Program::First& entry = program_.jacobian[e];
    out.entries[e] = {entry.row, entry.column, values[ToSize(entry.node)]};
  }
}

void NominalModel::EncloseHessian(std::span<const Interval> box, HessianEnclosure& out) const noexcept {
  NodeValues<Interval> values;
  forereach::Evaluate<Interval>(program_, program_.over_box, parameters_, box, values);
  out.count = program_.num_second;
  for (std::size_t e = 0; e < ToSize(program_.num_second); ++e) {
    const Program::Second& entry = program_.hessian[e];
    out.entries[e] = {entry.output, entry.row, entry.column, values[ToSize(entry.node)]};
  }
}

}  // namespace forereach
