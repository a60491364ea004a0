/** Algorithm 1 of the paper: certifies a plan, or abstains and says why.

What does not depend on the plan is computed once, in the constructor: residuals of the observations, the pairwise test,
the envelope's tables. Certify then allocates nothing, locks nothing, logs nothing and throws nothing. */
#pragma once

#include <optional>
#include <span>

#include "certifier/certify/decision.h"
#include "certifier/certify/problem.h"
#include "certifier/reach/propagator.h"
#include "certifier/residual/lipschitz_envelope.h"
#include "certifier/safety/projection.h"
#include "certifier/safety/separation.h"

namespace forereach {

class Certifier final {
 public:
  /** @throws std::invalid_argument naming the part of the problem that does not fit: sizes, non-finite numbers, no
  transitions, a transition outside the domain, an order out of range. */
  explicit Certifier(std::shared_ptr<const Problem> problem);

  [[nodiscard]] const Problem& problem() const { return *problem_; }
  [[nodiscard]] const Projection& projection() const { return projection_; }
  /** The pair of observations that contradicts the declaration, if there is one. */
  [[nodiscard]] const std::optional<Violation>& violation() const { return violation_; }
  /** True if some row of L has too many nonzero columns for the exact set-to-sample distance. */
  [[nodiscard]] bool uses_hull_distance() const { return envelope_.uses_hull_distance(); }

  /** What is proven of the distance between slice t of a tube and an obstacle: by interval hulls or by the best
  direction, whichever proves more. */
  [[nodiscard]] Separation SeparateSlice(const Tube& tube, int t, const Obstacle& obstacle) const noexcept;

  /** Throws std::invalid_argument, naming value and bound, unless Certify may be called with these: sizes as the
  problem's, 1..kMaxSteps steps, finite controls, obstacles in the safety dimension, X_0 with at most order * n generators. */
  void Require(const Plan& plan, const Zonotope& initial_set, std::span<const Obstacle> obstacles) const;

  /** Decides whether every admissible residual keeps the robot clear of the obstacles, from every state in
  `initial_set`, under `plan`. The outcome is kCertified only with a proof in real arithmetic that, for t = 0..T, the
  slice `tube.slice(t)` contains every reachable state and its projection is disjoint from every obstacle.

  Order of the tests: F; then for t < T the domain, the remainder, the envelope (D ends the run at its first step); after
  the horizon S, at its first unsafe t in 0..T. X_T is not tested against the domain.
  Cost O(T (N + n m)) plus a clearance a slice and obstacle that comes close. Any number of threads may call it, each
  with a tube of its own. @pre Require passes. */
  [[nodiscard]] Decision Certify(const Plan& plan, const Zonotope& initial_set, std::span<const Obstacle> obstacles,
                                 Tube& tube) const noexcept;

 private:
  [[nodiscard]] Decision Propagate(const Plan& plan, Tube& tube) const noexcept;
  /** SeparateSlice, where what the hulls prove is known. */
  [[nodiscard]] Separation BetterOf(const Separation& by_hulls, const Tube& tube, int t,
                                    const Obstacle& obstacle) const noexcept;
  [[nodiscard]] Decision JudgeSafety(std::span<const Obstacle> obstacles, const Tube& tube) const noexcept;

  std::shared_ptr<const Problem> problem_;
  Projection projection_;
  Observations observations_;
  std::optional<Violation> violation_;
  LipschitzEnvelope envelope_;
  Propagator propagator_;
};

}  // namespace forereach
