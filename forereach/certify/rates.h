/** How fast states move, as transitions and slices show it, against what is declared: `Between::turn_rate` of the
heading, and `StepTiming::rate_bound`.

Both bound the derivative of a state in every true motion, turn_rate only as far as a step of a plan may last, so in a
step that lasts h no state changes by more than its bound times h. An angle changes by its difference up to whole turns.
What a record may be off is taken off the change, so a motion that keeps the bounds is never refuted
(docs/soundness.md, 3.17). */
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forereach/certify/problem.h"
#include "forereach/numerics/interval.h"
#include "forereach/residual/consistency.h"
#include "forereach/sets/eigen.h"

namespace forereach {

/** The least |b - a - 2 pi i| over a and b in the intervals, from below; i is an integer for an angle, 0 otherwise. */
[[nodiscard]] double LeastChange(const Interval& a, const Interval& b, bool is_angle) noexcept;

class RateBounds final {
 public:
  /** @param problem must outlive this object. */
  explicit RateBounds(const Problem& problem);

  /** One declared bound: |dx/ds| <= rate, and from one sample of a plan to the next |x(s') - x(s)| <= change. */
  struct Bound {
    int state;
    double rate, change;
    std::string key;  ///< In the task file.
    bool is_angle;
    double longest;  ///< In steps up to so long alone, s; infinity: in all.
  };
  /** Those that are finite. */
  [[nodiscard]] std::span<const Bound> bounds() const { return bounds_; }

  /** For each of bounds() the least rate of its state that a transition shows, rounded down: 0 where it shows none, or
  its step may have been longer than the bound speaks of. @param longer by how much the step lasted longer or shorter
  than dt, at most, s. @param is_learned whether the declared errors of what is recorded are its own, also where given
  transitions are exact. */
  [[nodiscard]] Eigen::VectorXd Shown(std::span<const double> z, std::span<const double> next, double longer,
                                      bool is_learned) const;
  /** The bound that is exceeded by the largest factor; null if none is. @param shown what Shown returns. */
  [[nodiscard]] const Bound* FindExceeded(const Eigen::VectorXd& shown) const;
  /** The same as a contradiction by one transition: its second observation is -1. */
  [[nodiscard]] std::optional<Violation> FindViolation(const Eigen::VectorXd& shown, int transition) const;

 private:
  const Problem* problem_;
  double period_;
  std::vector<Bound> bounds_;
};

/** rate / bound, infinite for a bound of 0. */
[[nodiscard]] inline double FactorOf(double rate, double bound) { return bound > 0 ? rate / bound : kInfinity; }

/** The key of the least bound on the rate of a state; empty if there is none. */
[[nodiscard]] std::string KeyOfRate(const Problem& problem, int state);

}  // namespace forereach
