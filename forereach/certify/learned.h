/** Which executed transitions (z, x+) are observations of a problem's residual. */
#pragma once

#include <span>
#include <string>

#include "forereach/certify/problem.h"
#include "forereach/residual/observations.h"

namespace forereach {

/** The check that refused a transition, the first in this order; kAdded if none did. */
enum class Learned {
  kAdded,
  kNotFinite,       ///< An entry is NaN or infinite.
  kOutsideDomain,   ///< z is not proven to lie in the domain: the transition says nothing about the residual there.
  kNearTheEdge,     ///< z lies in the domain, but the box of the true z (Declaration::BoxAround) is not proven to.
  kNoNominalValue,  ///< The nominal map has no finite enclosure at z.
  kNoNominalSlope,  ///< Nor has its derivative over that box or by the duration, or it is not defined there.
  kAmbiguousAngle,  ///< An angle departs from the nominal map's by more than a quarter of a turn (observations.h).
};

/** Whether the box around z (Declaration::BoxAround) provably lies in the domain: a transition that was recorded at z
then counts. @param is_learned whether it was learned: given ones may be exact (Declaration::given_are_exact). */
[[nodiscard]] bool IsWithin(const Problem& problem, std::span<const double> z, bool is_learned);

/** By how much the step of a learned transition may have been longer or shorter than dt by its clock, at most, s: two
errors of its boundaries, and two units of a clock of microseconds. Where steps are declared to be on time, which is
also where no clock is looked at, another step is none that the certificates speak of: nothing says what it shows of a
step of dt. */
[[nodiscard]] double MostLonger(const StepTiming& timing);

/** @throws std::invalid_argument unless Transitions::longer is none, or finite and not negative for each transition,
and, where one is positive, equations or declared rates say how each state moves with time (StepOffsets). */
void ValidateDurations(const Problem& problem);

/** Examines a transition, z = (x, u) of d_z entries and x+ of n, in the model's units. @param longer by how much the
step lasted longer or shorter than dt, at most, s. Without a fault `observed` gets
the enclosure of its residual, one row. Cost: one evaluation of the model. */
[[nodiscard]] Learned Observe(const Problem& problem, std::span<const double> z, std::span<const double> next,
                              double longer, Observations& observed);

/** The refusal as a clause; empty for kAdded. */
[[nodiscard]] std::string Explain(Learned learned);

}  // namespace forereach
