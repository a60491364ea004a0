/** The inner bound of a plan that was abstained from: what every sound method has to count with. */
#pragma once

#include <optional>
#include <string>

#include "advise/case.h"
#include "forereach/certify/certifier.h"

namespace forereach {

struct InnerBound {
  int step = 0;         ///< The last one to which the certifier's tube was computed.
  double half_width;    ///< m, of its slice there: rho_P.
  double least;         ///< Half the spread there of systems that agree with all data: no sound tube is narrower.
  std::string contact;  ///< The claim that such a system provably breaks; empty if none was found.
};

/** By rollouts of the extremal residuals (forereach/certify/extremal.h) from the center and the corners of X_0. `least`
is true up to the rounding of these; the contact is confirmed by the verifier in 256 bits.
@param tube of Certify for the case. Nothing if X_0 is no box, rows are affine, regions or an error in z are declared, p
is not 2, or it would take long: more than kMostInnerObservations, or six varying coordinates or states with a width. */
[[nodiscard]] std::optional<InnerBound> BoundFromWithin(const Case& judged, const Certifier& certifier,
                                                        const Tube& tube);

inline constexpr int kMostInnerObservations = 4000, kMostInnerCoordinates = 6;

/** "half-width at step 12: 1.02 m; no sound tube is below 0.871 m", and the contact. */
[[nodiscard]] std::string Describe(const InnerBound& bound);

}  // namespace forereach
