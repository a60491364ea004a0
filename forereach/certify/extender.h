/** Tubes that branch, for planners whose tree holds proven slices: a node is extended by one control at a time.

A node keeps what later steps need of all steps before it: the slice X_t, the half-widths of its hull, where the search
of the envelope ended, and the closest approach to an obstacle. An extension takes one step and judges what is new:
domain and envelope, the declared rates, then the limits and the obstacles in the new slice. It finds, to the bit, what
Certifier::Certify decides on the controls from X_0 to there without Problem::rest.

A node is not a certificate: it cannot know whether the plan ends at rest, nor what else is asked of a whole plan.
Certify judges the plan before it is used. */
#pragma once

#include <array>
#include <span>
#include <vector>

#include "forereach/certify/certifier.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/interval.h"
#include "forereach/sets/zonotope_arrays.h"

namespace forereach {

/** What is proven of the controls so far. A value of its own, in about 8 n (4 + order n) bytes: 1.9 kB for six states
and order 5. */
class TubeNode final {
 public:
  /** t: the number of steps since X_0. */
  [[nodiscard]] int depth() const { return depth_; }
  [[nodiscard]] int dim() const { return dim_; }
  /** The center of X_t, n entries. */
  [[nodiscard]] std::span<const double> center() const { return {numbers_.data(), ToSize(dim_)}; }
  /** Tube::hull(depth(), k). */
  [[nodiscard]] Interval hull(int k) const {
    const double middle = center()[ToSize(k)], r = numbers_[ToSize(dim_ + k)];
    return {SubDown(middle, r), AddUp(middle, r)};
  }
  /** The witness of the closest approach as in a certificate, and whether a search was capped. Outcome kNone. */
  [[nodiscard]] const Decision& closest() const { return closest_; }
  /** All memory that it uses. */
  [[nodiscard]] std::size_t bytes() const { return sizeof *this + numbers_.capacity() * sizeof(double); }

 private:
  friend class Extender;
  int depth_ = 0, dim_ = 0;
  AxesInSlack axes_;
  std::array<FoundIn, kMaxStates> found_{};
  Decision closest_;
  std::vector<double> numbers_;  // center, half-widths, slack, then the rows of G
};

/** Extends the nodes of one tree. One thread at a time may use it. */
class Extender final {
 public:
  /** @param certifier, tube outlive this object, and what `obstacles` refers to, too. The tube is scratch memory.
  @param schedule of all plans of the tree. @pre Certifier::Require passes for these obstacles and a plan of this
  schedule. @param finds_closest false: a node is proven clear, and its closest() names nothing, in half the time. */
  Extender(const Certifier& certifier, const ObstacleView& obstacles, const Schedule& schedule, Tube& tube,
           bool finds_closest = true)
      : certifier_(certifier), obstacles_(obstacles), schedule_(schedule), tube_(tube), finds_closest_(finds_closest) {}

  /** The node of X_0. Outcome kNone: `root` is set. Otherwise F or S, the reason why no plan from there is certified,
  and it is unchanged. @pre Certifier::Require passes for this set. */
  [[nodiscard]] Decision Begin(const Zonotope& initial_set, TubeNode& root);

  /** The node after one more step. Outcome kNone: `next` is set; it may be `node`. Otherwise F, D or S, what Certify
  decides on these controls, and `next` is unchanged: no plan that begins so is certified.
  @param input m entries. @throws std::invalid_argument if it has not m finite ones, or `node` is at kMaxSteps.
  @pre the node was made by an extender of the same arguments, and nothing was learned since.
  Cost: a step of Certify and a copy of the slice, whatever the depth. It allocates only what `next` has no room for. */
  [[nodiscard]] Decision Extend(const TubeNode& node, std::span<const double> input, TubeNode& next);

 private:
  void Load(const TubeNode& node);
  void Save(TubeNode& node) const;
  [[nodiscard]] Decision Judge(const Plan& plan, Decision decision, const Decision& before, TubeNode& next);

  const Certifier& certifier_;
  const ObstacleView obstacles_;
  const Schedule schedule_;
  Tube& tube_;
  const bool finds_closest_;
};

}  // namespace forereach
