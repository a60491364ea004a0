#include "forereach/certify/learned.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/text.h"
#include "forereach/reach/step_offsets.h"
#include "forereach/residual/no_nominal_value.h"

namespace forereach {

bool IsWithin(const Problem& problem, std::span<const double> z, bool is_learned) {
  const Declaration& declaration = problem.declaration;
  if (!declaration.HasErrorInZ() || (declaration.given_are_exact && !is_learned)) return problem.domain.Contains(z);
  return FindExit(problem.domain, problem.declaration.BoxAround(z)).kind == DomainExit::Kind::kNone;
}

void ValidateDurations(const Problem& problem) {
  const Eigen::VectorXd& longer = problem.transitions.longer;
  if (longer.size() == 0) return;
  if (longer.size() != problem.transitions.size())
    throw std::invalid_argument("transitions: " + std::to_string(longer.size()) + " durations, must be " +
                                std::to_string(problem.transitions.size()) + " or none");
  for (Eigen::Index i = 0; i < longer.size(); ++i)
    if (!(longer[i] >= 0 && longer[i] < kInfinity))
      throw std::invalid_argument("transition " + std::to_string(i) + ": a duration is off by " + ToText(longer[i]) +
                                  " s, which is negative or not finite");
  StepTiming timing = problem.timing;
  timing.error = std::max(timing.error, DivUp(longer.maxCoeff(), 2));
  static_cast<void>(StepOffsets(*problem.model, timing));
}

double MostLonger(const StepTiming& timing) { return AddUp(MulUp(2, timing.error), 2e-6); }

Learned Observe(const Problem& problem, std::span<const double> z, std::span<const double> next, double longer,
                Observations& observed) {
  const auto finite = [](double value) { return std::isfinite(value); };
  if (!std::ranges::all_of(z, finite) || !std::ranges::all_of(next, finite)) return Learned::kNotFinite;
  if (!IsWithin(problem, z, true)) return problem.domain.Contains(z) ? Learned::kNearTheEdge : Learned::kOutsideDomain;
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
