/** Algorithm 1 of the paper: certifies a plan, or abstains and says why.

What does not depend on the plan is computed once, in the constructor: residuals of the observations, the pairwise test,
the envelope's tables. Certify then allocates nothing, locks nothing, logs nothing and throws nothing. What is observed
later is added by Learn, between two calls of Certify. */
#pragma once

#include <optional>
#include <span>

#include "certifier/certify/decision.h"
#include "certifier/certify/problem.h"
#include "certifier/reach/propagator.h"
#include "certifier/residual/observation_store.h"
#include "certifier/safety/projection.h"
#include "certifier/safety/separation.h"

namespace forereach {

class Certifier final {
 public:
  /** @throws std::invalid_argument naming the part of the problem that does not fit: sizes, non-finite numbers, no
  transitions, a transition outside the domain, an order out of range.
  @throws std::runtime_error saying what to change if this program or thread does not compute as bounds need it
  (certifier/numerics/arithmetic.h). */
  explicit Certifier(std::shared_ptr<const Problem> problem);

  [[nodiscard]] const Problem& problem() const { return *problem_; }
  [[nodiscard]] const Projection& projection() const { return projection_; }
  /** The pair of observations that contradicts the declaration, if there is one. Learned ones are numbered on from the
  problem's. */
  [[nodiscard]] const std::optional<Violation>& violation() const { return known_.violation(); }
  /** That pair's observations. @pre violation(). */
  [[nodiscard]] Observations Contradiction() const { return known_.Contradiction(); }
  [[nodiscard]] std::size_t num_observations() const { return known_.size(); }
  /** True if some row of L has too many nonzero columns for the exact set-to-sample distance. */
  [[nodiscard]] bool uses_hull_distance() const { return known_.uses_hull_distance(); }

  enum class Learned {
    kAdded,  ///< From now on every certificate rests on it; violation() says whether it falsifies the declaration.
    kOutsideDomain,  ///< Not proven to lie in the domain: it says nothing about the residual there.
    kUnusable,       ///< Not finite, or the nominal map has no finite enclosure there.
  };
  /** Adds one executed transition (z, x+), d_z and n entries. Its errors must be within the declared noise bound.
  Not to be called while Certify runs. Cost: about a microsecond, and a new index whenever Compact has not been called
  for 256 of them. */
  Learned Learn(std::span<const double> z, std::span<const double> next);
  /** Learned transitions that are not in the index yet. */
  [[nodiscard]] int num_unindexed() const { return store_.tail_size(); }
  /** Puts them into it. May run in a thread of its own beside anything; the next Learn takes it up. */
  void Compact() { store_.Compact(); }

  /** What is proven of the distance between slice t of a tube and an obstacle: by interval hulls or by the best
  direction, whichever proves more. */
  [[nodiscard]] Separation SeparateSlice(const Tube& tube, int t, const Obstacle& obstacle) const noexcept;

  /** Throws std::invalid_argument, naming value and bound, unless Certify may be called with these: sizes as the
  problem's, 1..kMaxSteps steps, finite controls, obstacles in the safety dimension, X_0 with at most order * n
  generators. */
  void Require(const Plan& plan, const Zonotope& initial_set, std::span<const Obstacle> obstacles) const;

  /** Decides whether every admissible residual keeps the robot clear of the obstacles, from every state in
  `initial_set`, under `plan`. The outcome is kCertified only with a proof in real arithmetic that, for t = 0..T, the
  slice `tube.slice(t)` contains every reachable state and its projection is disjoint from every obstacle.

  Order of the tests: F; then for t < T the domain, the remainder, the envelope (D ends the run at its first step);
  after the horizon the bounds of `Problem::rest` on the hull of X_T, in their order (D, kNoStop, at step T); then S, at
  its first unsafe t in 0..T. X_T is not tested against the domain. Cost O(T (N + n m)) plus a clearance a slice and
  obstacle that comes close. Any number of threads may call it, each with a tube of its own. @pre Require passes. */
  [[nodiscard]] Decision Certify(const Plan& plan, const Zonotope& initial_set, std::span<const Obstacle> obstacles,
                                 Tube& tube) const noexcept;

 private:
  [[nodiscard]] Decision Propagate(const Plan& plan, Tube& tube) const noexcept;
  /** SeparateSlice, where what the hulls prove is known. */
  [[nodiscard]] Separation BetterOf(const Separation& by_hulls, const Tube& tube, int t,
                                    const Obstacle& obstacle) const noexcept;
  /** Outcome kNone if the last slice provably stands. */
  [[nodiscard]] Decision JudgeRest(const Tube& tube) const noexcept;
  [[nodiscard]] Decision JudgeSafety(std::span<const Obstacle> obstacles, const Tube& tube) const noexcept;

  std::shared_ptr<const Problem> problem_;
  Projection projection_;
  ObservationStore store_;
  ObservationStore::Snapshot known_;  // propagator_ refers to it
  Propagator propagator_;
};

}  // namespace forereach
