#include "forereach/residual/growing_disturbance.h"

#include <string>

#include "forereach/dynamics/angles.h"
#include "forereach/dynamics/evaluate.h"
#include "forereach/dynamics/text_program.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/require.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

GrowingDisturbance::GrowingDisturbance(const NominalModel& model, std::vector<ExpressionText> bounds)
    : bounds_(std::move(bounds)) {
  Require(std::ssize(bounds_) == model.num_states(), "declaration: " + std::to_string(bounds_.size()) +
                                                         " expressions of a disturbance, must be " +
                                                         std::to_string(model.num_states()));
  const ExpressionNames names = NamesOf(model);
  program_ = std::make_shared<const ProgramDraft>(MakeProgram(names, bounds_));
  const Program program = program_->View();
  for (std::size_t k = 0; k < bounds_.size(); ++k)
    RequireSameAfterTurns(program, static_cast<int>(k), bounds_[k], "declaration.disturbance." + names.states[k],
                          model.angles(), names.states);
  needed_.assign(program.nodes.size(), 0);
  for (const int node : program.value) needed_[ToSize(node)] = 1;
  MarkOperands(program.nodes, needed_);
  for (const auto& [name, lower, upper] : names.parameters) parameters_.emplace_back(lower, upper);
}

void GrowingDisturbance::Enclose(std::span<const Interval> box, std::span<Interval> sizes) const noexcept {
  const Program program = program_->View();
  const std::span all(FOREREACH_ON_STACK(Interval, program.size), ToSize(program.size));
  Evaluate<Interval>(program, needed_, std::span<const Interval>(parameters_), box, all);
  for (std::size_t k = 0; k < bounds_.size(); ++k) {
    const Interval& value = all[ToSize(program.value[k])];
    // Where the expression may have no value nothing is bounded, and the step has no finite enclosure: D.
    sizes[k] = value.IsFinite() ? abs(value) : Interval(0, kInfinity);
  }
}

std::optional<std::pair<int, std::vector<Interval>>> GrowingDisturbance::FindUnbounded(
    std::vector<Interval> box) const {
  constexpr int kHalvings = 60;
  std::vector<Interval> sizes(bounds_.size());
  const auto is_unbounded = [&](std::size_t k) {
    Enclose(box, sizes);
    return !sizes[k].IsFinite();
  };
  for (std::size_t k = 0; k < bounds_.size(); ++k) {
    if (!is_unbounded(k)) continue;
    std::vector<Interval> where = box;
    for (std::size_t l = 0; l < box.size(); ++l) {
      Interval& range = box[l];
      bool matters = false;
      for (int i = 0; i < kHalvings; ++i) {
        const Interval whole = range, low(whole.lower, whole.Middle()), high(whole.Middle(), whole.upper);
        // Halving finds a place to name in the error; that the whole box is bounded is not concluded from its parts.
        range = low;
        const bool in_low = is_unbounded(k);
        range = high;
        const bool in_high = is_unbounded(k);
        matters |= in_low != in_high;
        range = in_low ? low : in_high ? high : whole;
        if (!in_low && !in_high) break;
      }
      if (matters) where[l] = range;
    }
    return std::pair(static_cast<int>(k), where);
  }
  return std::nullopt;
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
