/** Algorithm 1 of the paper: certifies a plan, or abstains with a cause and a witness.

The residual is bounded by the set-membership envelope of the problem's observations, or by a ResidualEnclosure that the
caller supplies. The constructor computes everything that does not depend on the plan: the residuals of the
observations, the pairwise test and the envelope's tables. Certify then allocates nothing, takes no lock, logs nothing
and throws nothing. Learn adds later observations between two calls of Certify. */
#pragma once

#include <optional>
#include <span>
#include <string>

#include "forereach/certify/decision.h"
#include "forereach/certify/learned.h"
#include "forereach/certify/limits.h"
#include "forereach/certify/problem.h"
#include "forereach/certify/rates.h"
#include "forereach/certify/safety.h"
#include "forereach/reach/propagator.h"
#include "forereach/residual/affine_rows_enclosure.h"
#include "forereach/residual/enclosure.h"
#include "forereach/residual/learned_transitions.h"
#include "forereach/residual/observation_store.h"
#include "forereach/residual/regional_enclosure.h"
#include "forereach/safety/projection.h"

namespace forereach {

class Certifier final {
 public:
  /** @throws std::invalid_argument if a part of the problem is invalid: sizes, non-finite numbers, no transitions, a
  transition outside the domain, an order out of range. The message names the part.
  @throws std::runtime_error if the arithmetic of this program or thread is not round-to-nearest with subnormals
  (forereach/numerics/arithmetic.h). The message says what to change.
  Cost: about O(N log N) for a sparse L; the pairwise test of a dense L can take O(N^2). */
  explicit Certifier(std::shared_ptr<const Problem> problem);

  /** Certifies with the bounds of `residual`: a certificate is as sound as they are. Of the problem's declaration only
  the disturbance and what may have slopes (regions, affine rows) are read; an input_error is refused. There are no
  observations and there is no violation.
  @param residual must outlive the certifier. Errors as above, for the other parts of the problem. */
  Certifier(std::shared_ptr<const Problem> problem, const ResidualEnclosure& residual);

  [[nodiscard]] const Problem& problem() const { return *problem_; }
  [[nodiscard]] const Projection& projection() const { return safety_.placement().projection(); }
  /** The pair of observations that contradicts the declaration, Eq. (falsification), if there is one. Otherwise, with
  the second observation -1, the transition that contradicts a declared bound on a rate (rates.h): `difference` is the
  least rate that it shows. In an affine row it is as AsViolation says (affine_rows_enclosure.h). Learned observations
  are numbered after those of the problem. */
  [[nodiscard]] const std::optional<Violation>& violation() const { return violation_; }
  /** Why an affine row of the residual has no bound: the direction in which the observations do not vary. Empty if all
  rows have one. */
  [[nodiscard]] std::string Unexcited() const;
  /** The observations of violation(), ascending: one, two or, of an affine row, all that decide it. @pre violation()
  has a value. */
  [[nodiscard]] std::vector<int> Contradicting() const;
  /** These transitions as they were recorded, whatever is declared of them; of learned ones `longer` is that of their
  clock. @pre as above. */
  [[nodiscard]] Transitions Contradiction() const;
  [[nodiscard]] std::size_t num_observations() const { return observed_ ? observed_->known.size() : 0; }
  /** True if some row of L has too many nonzero columns for the exact set-to-sample distance. */
  [[nodiscard]] bool uses_hull_distance() const { return observed_ && observed_->known.uses_hull_distance(); }

  using Learned = forereach::Learned;
  /** Adds one executed transition (z, x+) with d_z and n entries. Its observation error must be within the declared
  noise bound, and its disturbance within the declared one. @param longer by how much the step lasted longer or shorter
  than dt, at most, s. @param by_clock the same by its clock, where steps are declared to be on time and the clock does
  not count: for Contradiction alone. Do not call it while Certify runs. Cost: about a microsecond. If Compact has not
  been called for 256 transitions, it also builds an index; if it narrows an affine row, that is derived anew
  (AffineSet::Derive). @pre no ResidualEnclosure was supplied. The same holds for num_unindexed and Compact. */
  Learned Learn(std::span<const double> z, std::span<const double> next, double longer = 0,
                std::optional<double> by_clock = {});
  /** Number of learned transitions that are not in the index yet. */
  [[nodiscard]] int num_unindexed() const { return observed_->store.tail_size(); }
  /** Builds an index that includes them. It may run in its own thread at any time; the next Learn uses the new
  index. */
  void Compact() { observed_->store.Compact(); }

  /** The test against obstacles alone, for a tube that Certify has made, and the distances to them (safety.h). */
  [[nodiscard]] const SafetyTest& safety() const { return safety_; }
  /** The test of the problem's limits alone (limits.h). */
  [[nodiscard]] const LimitTest& limits() const { return limits_; }
  /** The last tests of Certify alone, for a tube that Certify has made of this plan: among other obstacles, or from a
  later step on. A limit that may be exceeded at sample t comes before an obstacle that may be touched in unit t or
  later (safety.h). Outcome kCertified, or kSafety with the first failure. */
  [[nodiscard]] Decision JudgeSafety(const Plan& plan, const ObstacleView& obstacles, Tube& tube,
                                     int first = 0) const noexcept;
  /** SafetyTest::Separate. */
  [[nodiscard]] Separation SeparateSlice(const Tube& tube, int t, const Obstacle& obstacle,
                                         const Schedule& schedule = {}) const {
    return safety_.Separate(tube, t, obstacle, schedule).separation;
  }

  /** What keeps a plan from being certified: `what` names value and bound. */
  struct Misfit {
    enum class Kind { kSize, kNumber } kind;
    std::string what;
  };
  /** The first misfit of a plan: sizes other than the problem's, not 1..kMaxSteps steps or a schedule out of its bounds
  (motion.h), then a control that is not finite. Nothing if there is none. Controls are read only if the sizes fit. */
  [[nodiscard]] std::optional<Misfit> FindMisfit(const Plan& plan) const;

  /** Checks the preconditions of Certify: a plan without a misfit, X_0 in the states with at most order * n generators,
  obstacles of the safety dimension p, and a schedule if one of them moves. @throws std::invalid_argument with the value
  and its bound if one is violated. */
  void Require(const Plan& plan, const Zonotope& initial_set, const ObstacleView& obstacles) const;
  /** The same without the plan, which FindMisfit has passed. */
  void Require(const Zonotope& initial_set, const ObstacleView& obstacles) const;

  /** Decides whether the plan is safe for every admissible residual, every disturbance and every initial state in
  `initial_set`. The outcome is kCertified only with a proof in real arithmetic that, for t = 0..T, `tube.slice(t)`
  contains every reachable state and the body there is disjoint from every obstacle (Theorem "ForeReach containment");
  with Problem::between also at all times between these samples, for every motion within the declared bounds; and that
  the problem's limits hold at the samples.

  The tests run in this order. First F. Then, for t < T, the domain, the remainder and the envelope; the first failure
  ends the run. After the horizon, the first step from whose slice no motion within the declared rates leads into the
  next slice (D, kBetween): the turn rate of `Problem::between` or a bound of `Problem::timing` contradicts the model
  there, and would prove what is not so. Then the bounds of `Problem::rest` on Box(X_T), in their order (D, kNoStop,
  step T). Then S (JudgeSafety): the first sample or step t at which a limit or an obstacle fails. X_T is not tested
  against the domain.
  @param tube receives the slices.
  @param known so many first steps are not propagated again if `tube` has them: it is of the last call, which was for
  the same initial set and a plan with the same first controls, with no call of Learn since. The result is the same bits
  as with 0.
  @pre Require passes.
  Cost O(T (N + n m)) at most, plus the separation of each slice from each near obstacle. Any number of threads may call
  it, each with its own tube. */
  [[nodiscard]] Decision Certify(const Plan& plan, const Zonotope& initial_set, const ObstacleView& obstacles,
                                 Tube& tube, int known = 0) const noexcept;

 private:
  friend class Extender;
  // X_0 of a tube; F if the observations contradict the declaration, else outcome kNone.
  [[nodiscard]] Decision Begin(const Zonotope& initial_set, Tube& tube) const noexcept;
  // From step tube.length() on.
  [[nodiscard]] Decision Propagate(const Plan& plan, Tube& tube) const noexcept;
  /** Outcome kNone unless a step from `first` on changes a state by more than its declared rate allows, whatever the
  states in its two slices. */
  [[nodiscard]] Decision JudgeBetween(const Tube& tube, int first = 0) const noexcept;
  /** Outcome kNone if the last slice is provably at rest. */
  [[nodiscard]] Decision JudgeRest(const Tube& tube) const noexcept;
  // As the public one: limits from one sample on, obstacles from one unit on. @param before as SafetyTest's.
  [[nodiscard]] Decision JudgeSafety(const Plan& plan, const ObstacleView& obstacles, Tube& tube, int first_sample,
                                     int first_unit, const Decision& before) const noexcept;

  void TestRates();
  void ForgetDropped();

  struct Observed {
    explicit Observed(const Problem& problem);
    Observed(const Problem& problem, const Observations& observations);

    ObservationStore store;
    ObservationStore::Snapshot known;
    std::optional<RegionalEnclosure> regional;  // over `known`, where regions are declared
    std::optional<AffineRowsEnclosure> affine;  // over lipschitz(), where rows are affine

    // Of the rows that are not affine.
    [[nodiscard]] const ResidualEnclosure& lipschitz() const {
      return regional ? static_cast<const ResidualEnclosure&>(*regional) : known;
    }
    [[nodiscard]] const ResidualEnclosure& residual() const {
      return affine ? static_cast<const ResidualEnclosure&>(*affine) : lipschitz();
    }
    // Of a pair, by L or the regions.
    [[nodiscard]] const std::optional<Violation>& pair_violation() const {
      return regional && !known.violation() ? regional->violation() : known.violation();
    }
    // What contradicts affine rows, if no pair contradicts the others; or null.
    [[nodiscard]] const AffineContradiction* affine_contradiction() const;
    [[nodiscard]] std::optional<Violation> violation() const;
    // Adds one observation. Its id, negative outside the domain.
    int Add(std::span<const double> z, const Observations& observation);
  };

  std::shared_ptr<const Problem> problem_;
  SafetyTest safety_;
  LimitTest limits_;
  RateBounds rates_;
  std::optional<Violation> too_fast_;  // a transition that contradicts a bound on a rate
  // Learned transitions as they were recorded: those whose observations are kept, and some more. Of each the id of its
  // observation, ascending.
  LearnedTransitions learned_;
  std::vector<int> learned_ids_;
  std::optional<Observed> observed_;  // none where an enclosure was given; propagator_ refers to it
  std::optional<Violation> violation_;
  Propagator propagator_;
};

}  // namespace forereach
