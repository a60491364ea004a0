#include "forereach/safety/limit_values.h"

#include <algorithm>
#include <array>
#include <utility>

#include "forereach/dynamics/text_enclosure.h"
#include "forereach/numerics/size.h"

namespace forereach {

LimitValues::LimitValues(const NominalModel& model, std::vector<Limit> limits) : limits_(std::move(limits)) {
  if (limits_.empty()) return;
  std::vector<ExpressionText> expressions;
  for (const Limit& limit : limits_) expressions.push_back(limit.that);
  values_.emplace(NamesOf(model), expressions);
  const TextEnclosure enclosure(NamesOf(model), expressions);
  for (std::size_t i = 0; i < limits_.size(); ++i) uses_input_.push_back(enclosure.UsesInput(static_cast<int>(i)));
}

bool LimitValues::SomeUseInputs() const { return std::ranges::find(uses_input_, true) != uses_input_.end(); }

void LimitValues::Room(std::span<const double> x, std::span<const double> u, std::span<double> room) const {
  if (!values_) return;
  std::array<double, kMaxVariables> z{};
  std::ranges::copy(u, std::ranges::copy(x, z.begin()).out);
  std::array<long double, kMaxLimits> values;
  values_->Evaluate({z.data(), ToSize(values_->num_variables())}, {values.data(), size()});
  for (std::size_t i = 0; i < size(); ++i) {
    const auto value = static_cast<double>(values[i]);
    const double above = limits_[i].at_most - value, below = value - limits_[i].at_least;
    // NaN goes on into `room`, and Keep refuses it.
    room[i] = u.empty() && UsesInput(i) ? kInfinity : below < above ? below : above;
  }
}

bool LimitValues::Keep(std::span<const double> x, std::span<const double> u, std::span<const double> margin) const {
  std::array<double, kMaxLimits> room;
  Room(x, u, {room.data(), size()});
  for (std::size_t i = 0; i < size(); ++i)
    if (!(room[i] >= margin[i])) return false;
  return true;
}

}  // namespace forereach
