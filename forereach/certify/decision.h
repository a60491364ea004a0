/** The result for one plan: a certificate, or an abstention with its cause and a witness. */
#pragma once

#include <cstddef>
#include <span>

#include "forereach/numerics/size.h"
#include "forereach/reach/domain.h"
#include "forereach/safety/motion.h"

namespace forereach {

/** The numbers are those of lcmtypes/decision_t.lcm. Zero is not a certificate. */
enum class Outcome { kNone = 0, kCertified = 1, kFalsified = 2, kDomain = 3, kSafety = 4 };
enum class Cause {
  kNone = 0,
  kPairwise = 1,
  kDomainExit = 2,
  kNoFiniteEnclosure = 3,
  kObstacle = 4,
  kNoStop = 5,
  kLimit = 8,
  kBetween = 30,
  kBound = 31
};

struct Decision {
  Outcome outcome = Outcome::kNone;
  Cause cause = Cause::kNone;
  /** The first t at which X_t fails. S by kObstacle with Problem::between: the body may touch the obstacle between t
  and t + 1. -1 for a certificate, and for F found before the first step. */
  int step = -1;

  /** @name Witness. A member that does not apply to the outcome is -1 or kNone. */
  ///@{
  DomainExit exit{};  ///< D by domain exit.
  /** F: residual coordinate. D: coordinate of z, or state without a finite enclosure. S by kLimit: the limit. */
  int coordinate = -1;
  int first_observation = -1, second_observation = -1;  ///< F: the violating pair; by kBound see Violation.
  int obstacle = -1;                                    ///< S by kObstacle, and certificate: the closest obstacle.
  int block = -1;                                       ///< Likewise, of an obstacle that is a grid.
  /** Likewise the part of the body that the margin and the threshold are of; -1: they are of the whole body. */
  int part = -1;
  /** Certificate: the step of the closest slice. If the problem has bounds between the samples: the step t after which
  the body comes closest, before t + 1. */
  int closest_step = -1;
  ///@}

  /** The deciding value and the value that it is compared with. Certificate and S by kObstacle: proven distance from
  the body to the obstacle's core, and the distance to be kept: the radius of the obstacle, its growth and the part's
  radius, or the reach of the whole body where that has one part or none is named (m). S by kLimit: the value that the
  limit's function may reach, infinite if it has no bound, and the limit's bound. D: extreme value of the hull, and the
  bound of the domain or of rest; by kBetween the least change from X_t to X_{t+1} and the largest that is declared, in
  the state's unit. F: difference of two residuals, and the difference that the declaration allows; by kBound the least
  rate that a transition shows, and the declared one, per second, or the least residual and a region's bound. */
  double margin = 0, threshold = 0;

  /** True if a search for the tightest observation reached its cap. The tube is sound but may be wider than
  necessary. */
  bool capped = false;
};

/** A fixed open-loop control sequence u_0 .. u_{T-1}, stored step by step. It does not own the numbers. */
struct Plan {
  const double* controls = nullptr;
  int num_inputs = 0, num_steps = 0;
  int stride = 0;       ///< Doubles from one step to the next, at least num_inputs.
  Schedule schedule{};  ///< Only needed where obstacles move.

  [[nodiscard]] std::span<const double> input(int t) const {
    return {controls + static_cast<std::ptrdiff_t>(t) * stride, ToSize(num_inputs)};
  }
};

}  // namespace forereach
