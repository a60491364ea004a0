#include "forereach/certify/learned.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/text.h"
#include "forereach/reach/step_offsets.h"
#include "forereach/residual/no_nominal_value.h"

namespace forereach {
namespace {

// @throws std::invalid_argument if it is not known how a state moves in a step that is off dt by so many seconds.
void RequireRates(const Problem& problem, double longer) {
  StepTiming timing = problem.timing;
  timing.error = std::max(timing.error, DivUp(longer, 2));
  static_cast<void>(StepOffsets(*problem.model, timing));
}

}  // namespace

bool IsWithin(const Problem& problem, std::span<const double> z, bool is_learned) {
  const Declaration& declaration = problem.declaration;
  if (!declaration.HasErrorInZ() || (declaration.given_are_exact && !is_learned)) return problem.domain.Contains(z);
  return FindExit(problem.domain, problem.declaration.BoxAround(z)).kind == DomainExit::Kind::kNone;
}

double TooFarOff(const NominalModel& model) { return StepOf(model) / 2; }

bool KnowsDurations(const Problem& problem) try {
  const double most = TooFarOff(*problem.model);
  RequireRates(problem, most);
  return most > 0;  // without dt nothing is off it
} catch (const std::invalid_argument&) {
  return false;
}

void ValidateDurations(const Problem& problem) {
  const Eigen::VectorXd& longer = problem.transitions.longer;
  if (longer.size() == 0) return;
  if (longer.size() != problem.transitions.size())
    throw std::invalid_argument("transitions: " + std::to_string(longer.size()) + " durations, must be " +
                                std::to_string(problem.transitions.size()) + " or none");
  if (longer.isZero(0)) return;
  const double most = TooFarOff(*problem.model);
  for (Eigen::Index i = 0; i < longer.size(); ++i)
    if (!(longer[i] >= 0 && longer[i] < most))
      throw std::invalid_argument("transition " + std::to_string(i) + ": a duration is off by " + ToText(longer[i]) +
                                  " s, outside [0, " + ToText(most) + "), from 0 up to half of dt");
  RequireRates(problem, longer.maxCoeff());
}

std::optional<double> CountedDuration(const Problem& problem, double by_clock, bool is_any) {
  const double error = problem.timing.error;
  if (by_clock <= AddUp(MulUp(2, error), 2e-6)) return error > 0 ? by_clock : 0;
  if (is_any && by_clock < TooFarOff(*problem.model) && KnowsDurations(problem)) return by_clock;
  return std::nullopt;
}

Learned Observe(const Problem& problem, std::span<const double> z, std::span<const double> next, double longer,
                Observations& observed) {
  const auto finite = [](double value) { return std::isfinite(value); };
  if (!std::ranges::all_of(z, finite) || !std::ranges::all_of(next, finite)) return Learned::kNotFinite;
  if (!IsWithin(problem, z, true)) return problem.domain.Contains(z) ? Learned::kNearTheEdge : Learned::kOutsideDomain;
  if (longer > 0 && !(longer < TooFarOff(*problem.model))) return Learned::kNoNominalSlope;
  const auto row = [](std::span<const double> values) {
    return Eigen::Map<const Eigen::RowVectorXd>(values.data(), std::ssize(values));
  };
  try {
    observed = Observe(*problem.model, problem.declaration,
                       {row(z), row(next), Eigen::VectorXd::Constant(1, longer), 1}, problem.timing);
  } catch (const AmbiguousAngle&) {
    return Learned::kAmbiguousAngle;
  } catch (const NoNominalValue& error) {
    return error.at() == NoNominalValue::At::kAround ? Learned::kNoNominalSlope : Learned::kNoNominalValue;
  } catch (const std::invalid_argument&) {
    return Learned::kNoNominalValue;
  }
  return Learned::kAdded;
}

std::string Explain(Learned learned) {
  switch (learned) {
    case Learned::kAdded: break;
    case Learned::kNotFinite: return "NaN or infinity in it";
    case Learned::kOutsideDomain: return "it lies outside the certification domain";
    case Learned::kNearTheEdge:
      return "within the declared errors of states and inputs it may lie outside the certification domain";
    case Learned::kNoNominalSlope:
      return "the nominal model has no finite derivative within the declared errors of states and inputs there, or the "
             "step was so far off its time that nothing bounds the residual";
    case Learned::kNoNominalValue: return "the nominal model has no finite value there";
    case Learned::kAmbiguousAngle:
      return "an angle is more than a quarter of a turn away from the nominal model's, so its turns cannot be told";
  }
  return "";
}

}  // namespace forereach
