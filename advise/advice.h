/** What would have turned an abstention into a certificate: the least change of each kind, found by a search and then
verified by certifying again with the change. An advice says what would be certified *if* the change were true. It does
not say that it is: a smaller slope has to be declared by somebody, a wider domain has to be covered by the
declaration, an obstacle has to be elsewhere. */
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "advise/case.h"
#include "forereach/certify/certifier.h"

namespace forereach {

struct Config;

enum class Change {
  kObstacles,     ///< S: each obstacle that may be touched stands farther away; or the plan passes it so.
  kInitialSet,    ///< S, D: a smaller X_0 around the same center.
  kHorizon,       ///< S, D: the first steps of the plan alone.
  kTail,          ///< S, D: a braking tail from an earlier step on.
  kSlopes,        ///< S, D: one entry of L, or all, smaller by a factor.
  kDisturbance,   ///< S, D: the bounds on the disturbance smaller by a factor.
  kLessNoise,     ///< S, D: the noise bounds smaller by a factor.
  kStateError,    ///< S, D: the errors of recorded states smaller by a factor.
  kObservation,   ///< S, D: one more observation.
  kDomain,        ///< D: bounds of the domain wider.
  kRest,          ///< D: bounds of rest wider.
  kLimits,        ///< S: limits wider.
  kLargerSlopes,  ///< F: rows of L larger by a factor.
  kNoise,         ///< F: larger noise bounds.
  kOutlier,       ///< F: one observation left out.
};

/** "obstacles", "initial_set" and so on. */
[[nodiscard]] const char* Name(Change change);

/** Who makes a change, the cheapest first: a plan that passes elsewhere, one that ends or brakes earlier, better data,
and whoever declares. */
enum class ChangeKind { kMove, kSlowDown, kData, kDeclaration };
[[nodiscard]] ChangeKind KindOf(Change change);
/** "move", "slow down", "data", "declaration". */
[[nodiscard]] const char* Name(ChangeKind kind);

struct Advice {
  Change change;
  /** A clause with values and units that continues "it would be certified ". Numbers are rounded to the side on which
  it stays true. */
  std::string what;
  /** What is declared smaller by a factor, and that factor: "the slope of theta in v 0.59"; otherwise empty. */
  std::string smaller = {};
  /** The size of the change. kObstacles: the largest distance, m. kInitialSet, kSlopes to kStateError: the factor.
  kHorizon: the number of steps. kTail: the step at which it begins. kObservation: the number of outcomes that were
  tried. kDomain, kRest, kLimits: the number of bounds. kLargerSlopes: the largest factor. kNoise: the largest addition,
  in the state's unit. kOutlier: the observation. */
  double amount = 0;
  int row = -1, column = -1;   ///< kSlopes: the entry of L; -1: all of them.
  Eigen::VectorXd place = {};  ///< kObservation: z.
  /** True if the plan is certified in every case of `after`. Otherwise the change is a necessary condition at most, and
  `then` is the decision's sentence after it. */
  bool turns = false;
  std::string then = {};
  /** The case with the change. kObservation: one for each outcome that was tried: the middle of what the declaration
  allows there, then its ends. */
  std::vector<Case> after;
};

/** The ways to brake from a state (n entries) to rest: m-by-K controls each, a column a step; none if there is no way.
 */
using BrakingTails = std::function<std::vector<Eigen::MatrixXd>(const Eigen::VectorXd& state)>;

/** Those of the task's planner; none if the task does not say how its robot brakes. */
[[nodiscard]] BrakingTails TailsOf(const Config& task);

struct AdviceOptions {
  int most_observations = 8;  ///< How many places kObservation tries; 0: none.
  BrakingTails tails = {};    ///< Without it there is no kTail.
};

/** What would have turned the abstention, in the order of Change; of each kind at most one, of kSlopes one for each
entry and one for all, of kOutlier two. First those that turn it. Empty if the case is certified as it is.
@param certifier of the case's problem.
@throws std::invalid_argument as Certifier::Require does.
Cost: some hundred calls of Certify, and some dozen constructions of a Certifier. */
[[nodiscard]] std::vector<Advice> Advise(const Case& abstained, const Certifier& certifier,
                                         const AdviceOptions& options = {});

/** The coordinates of z on which the declared residual may depend: "v = 6.657, delta = 0.38". */
[[nodiscard]] std::string DescribePlace(const Problem& problem, const Eigen::VectorXd& z);

/** A place at which one observation would turn abstentions. */
struct Place {
  Eigen::VectorXd z;  ///< d_z entries
  int turned = 0;     ///< Abstentions that the middle of the outcomes allowed there would turn.
};

/** Ranks the places of the advices kObservation by how many of the cases one observation there would turn, most first.
@param cases abstentions under the same problem. @param most how many places are tried, evenly of all.
Cost: a construction of a Certifier for each place, and a call of Certify for each place and case. */
[[nodiscard]] std::vector<Place> RankPlaces(const std::vector<Case>& cases, const std::vector<Eigen::VectorXd>& places,
                                            std::size_t most = 64);

}  // namespace forereach
