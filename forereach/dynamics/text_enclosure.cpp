#include "forereach/dynamics/text_enclosure.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "forereach/dynamics/evaluate.h"
#include "forereach/sets/zonotope.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {
namespace {

std::vector<unsigned char> MarksOf(const Program& program, std::span<const int> results) {
  std::vector<unsigned char> marks(program.nodes.size(), 0);
  for (const int node : results) marks[ToSize(node)] = 1;
  MarkOperands(program.nodes, marks);
  return marks;
}

Interval Around(double half_width) { return {-half_width, half_width}; }

}  // namespace

TextEnclosure::TextEnclosure(const ExpressionNames& names, std::span<const ExpressionText> expressions) {
  ProgramDraft draft = MakeProgram(names, expressions);
  try {
    draft.Differentiate();
  } catch (const std::invalid_argument&) {
    RequireDerivatives(names, expressions);  // says where there is none
    throw;
  }
  program_ = std::make_shared<const ProgramDraft>(std::move(draft));
  const Program program = program_->View();
  over_box_ = MarksOf(program, program.value);
  for (std::size_t i = 0; i < over_box_.size(); ++i) over_box_[i] |= program.over_box[i];
  for (const int node : program.value) {
    const std::vector<unsigned char> used = MarksOf(program, {&node, 1});
    bool uses_input = false;
    for (std::size_t i = 0; i < used.size(); ++i)
      uses_input |= used[i] != 0 && program.nodes[i].op == Op::kVariable && program.nodes[i].a >= program.states;
    uses_input_.push_back(uses_input);
  }
  for (const auto& [name, lower, upper] : names.parameters) parameters_.emplace_back(lower, upper);
}

// An input that is an interval counts as a parameter that is one does: all of this holds for each of its values.
// The slope is some double in the derivative's interval. What the derivative differs from it counts as offset, and so
// does the remainder. A state that is a point adds nothing, whatever the derivatives.
void TextEnclosure::Enclose(std::span<const double> center, std::span<const double> half_width,
                            std::span<const double> input, std::span<AffineEnclosure> values,
                            std::span<const double> input_error) const noexcept {
  const Program program = program_->View();
  const std::size_t n = center.size();
  std::array<Interval, kMaxVariables> box;
  std::ranges::copy(center, box.begin());
  std::ranges::copy(input, box.begin() + static_cast<std::ptrdiff_t>(n));
  for (std::size_t l = 0; l < input_error.size(); ++l)
    if (input_error[l] != 0) box[n + l] += Around(input_error[l]);
  const std::span<const Interval> z(box.data(), n + input.size());
  const std::span all(FOREREACH_ON_STACK(Interval, program.size), ToSize(program.size));
  const std::span<const Interval> parameters(parameters_);
  Evaluate<Interval>(program, program.at_point, parameters, z, all);
  for (std::size_t k = 0; k < values.size(); ++k) {
    values[k].slope.fill(0);
    values[k].offset = all[ToSize(program.value[k])];
  }
  for (const Program::First& entry : program.jacobian) {
    const auto l = ToSize(entry.column);
    if (l >= n || half_width[l] == 0) continue;
    const Interval& derivative = all[ToSize(entry.node)];
    AffineEnclosure& value = values[ToSize(entry.row)];
    if (derivative.IsFinite()) value.slope[l] = derivative.Middle();
    value.offset += (derivative - Interval(value.slope[l])) * Around(half_width[l]);
  }
  for (std::size_t l = 0; l < n; ++l) box[l] = Interval(center[l]) + Around(half_width[l]);
  Evaluate<Interval>(program, over_box_, parameters, z, all);
  for (const Program::Second& entry : program.hessian) {
    const double r = half_width[ToSize(entry.row)], other = half_width[ToSize(entry.column)];
    if (r == 0 || other == 0) continue;
    const Interval product = entry.row == entry.column ? Interval(0, HalfUp(MulUp(r, r))) : Around(MulUp(r, other));
    values[ToSize(entry.output)].offset += all[ToSize(entry.node)] * product;
  }
  for (std::size_t k = 0; k < values.size(); ++k) values[k].range = all[ToSize(program.value[k])];
}

// slope . (x - c) + offset = slope . x + (offset - slope . c). An infinite or undefined bound loses to the range.
Interval RangeOver(const Zonotope& slice, const AffineEnclosure& value) noexcept {
  Interval rest = value.offset;
  std::array<double, kMaxStates> opposite{};
  for (std::size_t l = 0; l < ToSize(slice.dim()); ++l) {
    opposite[l] = -value.slope[l];
    if (opposite[l] != 0) rest += Interval(opposite[l]) * Interval(slice.center(static_cast<int>(l)));
  }
  const double upper = AddUp(rest.upper, slice.SupportUpper(value.slope));
  const double lower = SubDown(rest.lower, slice.SupportUpper(opposite));
  return {lower > value.range.lower ? lower : value.range.lower, upper < value.range.upper ? upper : value.range.upper};
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
