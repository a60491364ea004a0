/** Which executed transitions (z, x+) are observations of a problem's residual. */
#pragma once

#include <optional>
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

/** A step that was longer or shorter than dt by so much or more, half of dt, s, says nothing. */
[[nodiscard]] double TooFarOff(const NominalModel& model);

/** Whether the duration of a step can count: the model's equations or declared rates say how each state moves with time
(StepOffsets). */
[[nodiscard]] bool KnowsDurations(const Problem& problem);

/** @throws std::invalid_argument unless Transitions::longer is none, or in [0, TooFarOff) for each transition, and,
where one is positive, as KnowsDurations asks; the message says why not. */
void ValidateDurations(const Problem& problem);

/** What counts of the duration of a learned step that was, by its clock, up to `by_clock` s longer or shorter than dt.
On time is a step within two errors of its boundaries and two units of a clock of microseconds: it counts as it is, or
as one of dt if steps have no errors. Nothing for another one: it is not learned. @param is_any nobody looks at a clock:
another one counts as it is, too, below TooFarOff and with KnowsDurations. */
[[nodiscard]] std::optional<double> CountedDuration(const Problem& problem, double by_clock, bool is_any);

/** Examines a transition, z = (x, u) of d_z entries and x+ of n, in the model's units. @param longer by how much the
step lasted longer or shorter than dt, at most, s. Without a fault `observed` gets
the enclosure of its residual, one row. Cost: one evaluation of the model. */
[[nodiscard]] Learned Observe(const Problem& problem, std::span<const double> z, std::span<const double> next,
                              double longer, Observations& observed);

/** The refusal as a clause; empty for kAdded. */
[[nodiscard]] std::string Explain(Learned learned);

}  // namespace forereach
