#include "forereach/dynamics/model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {

NominalModel::NominalModel(const Program& program, std::vector<Interval> parameters, ModelNames names)
    : program_(program), ranges_(std::move(parameters)), names_(std::move(names)) {
  for (const Interval& range : ranges_) middles_.push_back(range.Middle());
}

void NominalModel::Evaluate(std::span<const double> z, std::span<double> next) const noexcept {
  std::array<long double, kMaxStates> wide;
  EvaluateWide(z, std::span(wide).first(next.size()));
  for (std::size_t k = 0; k < next.size(); ++k) next[k] = static_cast<double>(wide[k]);
}

void NominalModel::Linearize(std::span<const double> z, Linearization& out) const noexcept {
  std::array<Interval, kMaxVariables> point;
  std::ranges::copy(z, point.begin());
  LinearizeOver({point.data(), z.size()}, out);
}

void NominalModel::EncloseExpansion(std::span<const Interval> point, std::span<const Interval> box, Expansion& out,
                                    ExpansionError& error) const noexcept {
  Linearization linear;
  LinearizeOver(point, linear);
  for (std::size_t k = 0; k < ToSize(num_states()); ++k) {
    out.value[k] = linear.value[k].Middle();
    error.value[k] = linear.value[k].DistanceUpper(out.value[k]);
  }
  for (std::size_t e = 0; e < ToSize(linear.count); ++e) {
    out.jacobian[e] = linear.entries[e].value.Middle();
    error.jacobian[e] = linear.entries[e].value.DistanceUpper(out.jacobian[e]);
    error.jacobian_size[e] = std::abs(out.jacobian[e]);
  }
  HessianEnclosure hessian;
  EncloseHessian(box, hessian);
  for (std::size_t e = 0; e < ToSize(hessian.count); ++e) {
    const Interval& range = hessian.entries[e].second_derivative;
    out.hessian[e] = {range.lower, range.upper};
    error.hessian[e] = 0;
  }
}

bool NominalModel::IsAngle(int state) const { return std::ranges::binary_search(names_.angles, state); }

std::vector<std::string> NominalModel::variable_names() const {
  std::vector<std::string> names = names_.states;
  names.insert(names.end(), names_.inputs.begin(), names_.inputs.end());
  return names;
}

namespace {

// How an expression is laid out in its file does not matter. No two names or numbers stand side by side in one.
std::string WithoutBlanks(std::string text) {
  std::erase_if(text, [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; });
  return text;
}

}  // namespace

// Parameters without a range as for a compiled model. Units are for people.
std::string NominalModel::description() const {
  std::string text = names_.name;
  for (std::size_t p = 0; p < ranges_.size(); ++p) {
    const auto& [lower, upper] = ranges_[p];
    text += " " + names_.parameters[p] + "=";
    if (lower == upper)
      text += ToText(lower);
    else
      text.append("[").append(ToText(lower)).append(",").append(ToText(upper)).append("]");
  }
  const auto add_names = [&](const char* kind, const std::vector<std::string>& names) {
    text += "; ";
    text += kind;
    for (const std::string& name : names) text += " " + name;
  };
  std::vector<std::string> angles;
  for (const int angle : names_.angles) angles.push_back(names_.states[ToSize(angle)]);
  if (!angles.empty()) add_names("angles", angles);
  if (names_.text == nullptr) return text;
  add_names("states", names_.states);
  add_names("inputs", names_.inputs);
  for (const auto& [name, value] : names_.text->definitions)
    text += "; let " + name + " = " + WithoutBlanks(value.text);
  constexpr std::array kKinds{"next", "euler", "midpoint", "rk4"};
  for (std::size_t k = 0; k < names_.states.size(); ++k)
    text += std::string("; ") + kKinds[static_cast<std::size_t>(names_.text->integrator)] + " " + names_.states[k] +
            " = " + WithoutBlanks(names_.text->equations[k].text);
  return text;
}

}  // namespace forereach
