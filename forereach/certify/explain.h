/** Decisions as sentences. */
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "forereach/certify/decision.h"
#include "forereach/certify/problem.h"
#include "forereach/numerics/interval.h"
#include "forereach/safety/obstacle.h"

namespace forereach {

class Certifier;
struct Plan;
class Tube;

/** One sentence with outcome, step, cause and witness by name, with values, bounds and units. Numbers have six digits
and are rounded so that the sentence stays true: a clearance down, a depth up.
@param obstacles those of the call, for their names (NameOf). */
[[nodiscard]] std::string Explain(const Decision& decision, const Problem& problem,
                                  std::span<const Obstacle> obstacles = {});
/** The same with the certifier, the plan and its tube. If the next state has no finite enclosure, it also
says in which direction the observations of an affine row do not vary, or names the operation of the model's text that
meets its kink or pole (dynamics/unbounded.h); of an affine row that is contradicted it names all observations that show
it. Not for the certify step. */
[[nodiscard]] std::string Explain(const Decision& decision, const Certifier& certifier,
                                  std::span<const Obstacle> obstacles, const Plan& plan, const Tube& tube);

/** Contains r_k(z) for every admissible residual and every z over slice t: what step t took for it, with what a slope
adds over the slice. @pre t < tube.length(). */
[[nodiscard]] Interval ResidualOver(const Tube& tube, int t, int k);

/** The closest approach of a certified plan, as Decision has it. */
struct ClosestApproach {
  int step = -1;         ///< Decision::closest_step
  int obstacle = -1;     ///< -1: no obstacle is there during the plan.
  int part = -1;         ///< Named only if the body has several; -1: not known.
  double clearance = 0;  ///< A lower bound on the distance, metres.
};

/** The sentence for a certificate, without kCapped. It says when the certificate holds: at all times with
Problem::between, otherwise at the sample instants only; that it allows for a disturbance, if one is declared; and that
the limits hold at the sample instants, if there are any. */
[[nodiscard]] std::string ExplainCertificate(const Problem& problem, const ClosestApproach& closest,
                                             std::span<const Obstacle> obstacles);

/** The name of the obstacle in such a sentence; empty if it has none, or the sentence is another. For records, which
keep sentences and numbers. */
[[nodiscard]] std::string ObstacleNamedIn(std::string_view sentence);

/** "all_times" or "samples": when a decision of the problem holds. */
[[nodiscard]] const char* HoldsName(const Problem& problem);

/** Appended to the sentence where an abstention S was tried again in pieces (pieces.h): how many were certified or, of
one that stays, how many calls of Certify were made. */
[[nodiscard]] std::string CertifiedInPieces(int pieces);
[[nodiscard]] std::string AlsoInPieces(int trials);

/** Appended to the sentence if Decision::capped. */
inline constexpr const char* kCapped = "; a search met max_leaf_visits";

}  // namespace forereach
