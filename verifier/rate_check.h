/** Confirms bounds on how fast the states of a motion x' = f(x, u) move between two samples (`model.rate_bound`), by
the verifier's own parser and intervals of 128 bits. */
#pragma once

#include <span>

#include "forereach/dynamics/model.h"
#include "forereach/reach/domain.h"
#include "forereach/sets/box.h"
#include "verifier/answer.h"

namespace forereach::verifier {

/** The claim |x_k'| <= bound. */
struct RateClaim {
  int state;
  double bound;
};

struct RateVerdict {
  Answer answer = Answer::kYes;
  int state = -1;  ///< Unless kYes: the first state of which a claim, or that it stays in its range, is not shown.
};

/** Whether no motion that begins in the domain's box Z, with a constant input, leaves `reachable`, B, within a period,
since Z + [0, period] f(B) in B, and all claims hold over B. Boxes are halved until each answers, or `most_boxes` of a
state have not. @param reachable of z, d_z entries. kNo: a claim is false at a point of B. */
[[nodiscard]] RateVerdict CheckRates(const NominalModel& model, const Domain& domain, double period,
                                     const Box& reachable, std::span<const RateClaim> claims, int most_boxes = 20'000);

}  // namespace forereach::verifier
