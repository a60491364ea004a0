#include "forereach/dynamics/program_model.h"

#include <algorithm>
#include <array>
#include <utility>

#include "forereach/dynamics/evaluate.h"
#include "forereach/dynamics/expand.h"
#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {
namespace {

using internal::EvaluateAtPoint;
using internal::EvaluateOverBox;

std::vector<int> Indices(std::span<const unsigned char> marks) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (marks[i] != 0) indices.push_back(static_cast<int>(i));
  return indices;
}

}  // namespace

ProgramModel::ProgramModel(const Program& program, std::vector<Interval> parameters, ModelNames names)
    : InterpretedModel(program, std::move(parameters), std::move(names)),
      at_point_(Indices(program.at_point)),
      over_box_(Indices(program.over_box)) {}

ProgramModel::ProgramModel(std::shared_ptr<const ProgramDraft> draft, std::vector<Interval> parameters,
                           ModelNames names)
    : ProgramModel(draft->View(), std::move(parameters), std::move(names)) {
  draft_ = std::move(draft);
}

void ProgramModel::EvaluateWide(std::span<const double> z, std::span<long double> next) const noexcept {
  std::array<long double, kMaxVariables> wide;
  std::ranges::copy(z, wide.begin());
  const std::span values(FOREREACH_ON_STACK(long double, program().size), ToSize(program().size));
  forereach::Evaluate<long double>(program(), program().at_point, parameters(), {wide.data(), z.size()}, values);
  for (std::size_t k = 0; k < next.size(); ++k) next[k] = values[ToSize(program().value[k])];
}

void ProgramModel::LinearizeOver(std::span<const Interval> box, Linearization& out) const noexcept {
  const std::span values(FOREREACH_ON_STACK(Interval, program().size), ToSize(program().size));
  forereach::Evaluate<Interval>(program(), program().at_point, parameter_ranges(), box, values);
  for (std::size_t k = 0; k < ToSize(num_states()); ++k) out.value[k] = values[ToSize(program().value[k])];
  out.count = program().num_first;
  for (std::size_t e = 0; e < ToSize(out.count); ++e) {
    const Program::First& entry = program().jacobian[e];
    out.entries[e] = {entry.row, entry.column, values[ToSize(entry.node)]};
  }
}

void ProgramModel::EncloseHessian(std::span<const Interval> box, HessianEnclosure& out) const noexcept {
  const std::span values(FOREREACH_ON_STACK(Interval, program().size), ToSize(program().size));
  forereach::Evaluate<Interval>(program(), program().over_box, parameter_ranges(), box, values);
  out.count = program().num_second;
  for (std::size_t e = 0; e < ToSize(out.count); ++e) {
    const Program::Second& entry = program().hessian[e];
    out.entries[e] = {entry.output, entry.row, entry.column, values[ToSize(entry.node)]};
  }
}

ExpansionError ProgramModel::BoundError(std::span<const Interval> domain) const {
  const auto is_point = [](const Interval& range) { return range.lower == range.upper; };
  if (!std::ranges::all_of(parameter_ranges(), is_point)) return ExpansionError::None(program());
  return BoundExpansionError(program(), parameters(), domain);
}

void ProgramModel::Expand(std::span<const double> z, std::span<const PlainInterval> box, Expansion& out,
                          InstructionSet /*instructions*/) const noexcept {
  const Program& p = program();
  double* v = FOREREACH_ON_STACK(double, p.size);
  auto* w = FOREREACH_ON_STACK(PlainInterval, p.size);
  const double* values = parameters().data();
  for (const int i : at_point_) EvaluateAtPoint(p.node(i), ToSize(i), values, z.data(), v);
  for (const int i : over_box_) EvaluateOverBox(p, ToSize(i), values, box.data(), v, w);
  for (std::size_t k = 0; k < ToSize(p.states); ++k) out.value[k] = v[p.value[k]];
  for (std::size_t k = ToSize(p.states); k < PaddedToLanes(ToSize(p.states)); ++k) out.value[k] = 0;
  for (std::size_t e = 0; e < ToSize(p.num_first); ++e) out.jacobian[e] = v[p.jacobian[e].node];
  for (std::size_t e = 0; e < ToSize(p.num_second); ++e) out.hessian[e] = w[p.hessian[e].node];
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
