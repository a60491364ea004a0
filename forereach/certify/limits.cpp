#include "forereach/certify/limits.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "forereach/certify/tube.h"
#include "forereach/dynamics/angles.h"
#include "forereach/dynamics/text_enclosure.h"
#include "forereach/numerics/require.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

const std::vector<Limit>& Validated(const std::vector<Limit>& limits) {
  Require(limits.size() <= kMaxLimits,
          "limits: " + std::to_string(limits.size()) + " limits, must be at most " + std::to_string(kMaxLimits));
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const auto& [name, that, at_least, at_most] = limits[i];
    const std::string which = "limits: limit " + std::to_string(i) + ": ";
    Require(!name.empty() && name.size() <= kMaxLimitName &&
                std::ranges::all_of(name, [](char c) { return ' ' <= c && c <= '~'; }),
            which + "its name has " + std::to_string(name.size()) + " bytes, must be 1 to " +
                std::to_string(kMaxLimitName) + ", all of them printable");
    Require(at_least <= at_most && at_least < kInfinity && at_most > -kInfinity &&
                (at_least > -kInfinity || at_most < kInfinity),
            which + "from " + ToText(at_least) + " to " + ToText(at_most) + " is no range with a finite end");
  }
  return limits;
}

// Without limits, the names of a model need not fit the language.
std::optional<TextEnclosure> FunctionsOf(const Problem& problem) {
  if (problem.limits.empty()) return std::nullopt;
  std::vector<ExpressionText> expressions;
  for (const Limit& limit : problem.limits) expressions.push_back(limit.that);
  const NominalModel& model = *problem.model;
  TextEnclosure functions(NamesOf(model), expressions);
  for (std::size_t i = 0; i < problem.limits.size(); ++i)
    // A state in the slice stands for all that differ by whole turns (soundness 3.14), so the function has to, too.
    RequireSameAfterTurns(functions.program(), static_cast<int>(i), expressions[i], "limits: " + problem.limits[i].name,
                          model.angles(), model.state_names());
  return functions;
}

}  // namespace

LimitTest::LimitTest(const Problem& problem)
    : limits_(Validated(problem.limits)),
      num_inputs_(problem.model->num_inputs()),
      input_error_(problem.declaration.input_error.begin(), problem.declaration.input_error.end()),
      functions_(FunctionsOf(problem)) {}

// Visits the range of each limit's function at sample t, until the visitor says that it is enough. After the last
// sample no input is applied, so functions of an input have no value there.
template <class Visit>
void LimitTest::ForEach(const Plan& plan, const Tube& tube, int t, Visit visit) const noexcept {
  const Zonotope& slice = tube.slice(t);
  const bool is_last = t == tube.length();
  // Zero is any input: no value that depends on it is visited.
  constexpr std::array<double, kMaxInputs> kNoInput{};
  std::array<AffineEnclosure, kMaxLimits> values;
  functions_->Enclose(slice.center(), tube.half_width(t),
                      is_last ? std::span(kNoInput.data(), ToSize(num_inputs_)) : plan.input(t),
                      {values.data(), limits_.size()}, input_error_);
  for (std::size_t i = 0; i < limits_.size(); ++i)
    if (!(is_last && functions_->UsesInput(static_cast<int>(i))) && visit(i, RangeOver(slice, values[i]))) return;
}

Decision LimitTest::Judge(const Plan& plan, const Tube& tube, int first) const noexcept {
  Decision decision;
  if (limits_.empty()) return decision;
  for (int t = first; t <= tube.length() && decision.outcome == Outcome::kNone; ++t)
    ForEach(plan, tube, t, [&](std::size_t i, const Interval& reached) {
      const auto& [name, that, at_least, at_most] = limits_[i];
      // The whole range has to keep the limit (soundness 3.12). An enclosure that is not finite keeps none.
      const bool is_below = reached.upper <= at_most;
      if (is_below && at_least <= reached.lower) return false;
      decision.outcome = Outcome::kSafety;
      decision.cause = Cause::kLimit;
      decision.step = t;
      decision.coordinate = static_cast<int>(i);
      decision.margin = is_below ? reached.lower : reached.upper;
      decision.threshold = is_below ? at_least : at_most;
      return true;
    });
  return decision;
}

std::optional<Interval> LimitTest::Reach(int limit, const Plan& plan, const Tube& tube) const noexcept {
  std::optional<Interval> reach;
  for (int t = 0; t <= tube.length(); ++t)
    ForEach(plan, tube, t, [&](std::size_t i, const Interval& reached) {
      if (i == ToSize(limit)) reach = reach ? Join(*reach, reached) : reached;
      return false;
    });
  return reach;
}

}  // namespace forereach
