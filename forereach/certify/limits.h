/** Whether a tube keeps the limits of its problem (forereach/safety/limit.h). */
#pragma once

#include <optional>
#include <span>

#include "forereach/certify/decision.h"
#include "forereach/certify/problem.h"
#include "forereach/dynamics/text_enclosure.h"

namespace forereach {

class Tube;

/** Immutable, so any number of threads may use it, each with its own tube. */
class LimitTest final {
 public:
  /** @throws std::invalid_argument naming the limit if there are more than kMaxLimits, a name or bound is not as Limit
  requires, if it depends on how often an angle of the model has turned (angles.h), or an expression is none or has no
  derivatives (ExpressionError). */
  explicit LimitTest(const Problem& problem);

  [[nodiscard]] std::span<const Limit> limits() const { return limits_; }

  /** Judges the samples from `first` to tube.length(). The outcome is kNone with a proof that every limit holds at each
  of them; otherwise it is kSafety with the cause kLimit, the first sample that is not proven as `step`, and as
  `coordinate` the first limit there, with the value that it may reach and its bound. @pre tube is that of the plan.
  Cost O(operations of the expressions) for each sample. It allocates nothing. */
  [[nodiscard]] Decision Judge(const Plan& plan, const Tube& tube, int first = 0) const noexcept;

  /** An interval that contains what limit i bounds at all samples of a tube, for display. Nothing if it uses an input
  and no step was completed. */
  [[nodiscard]] std::optional<Interval> Reach(int i, const Plan& plan, const Tube& tube) const noexcept;

 private:
  // Calls visit(i, values of limit i) for each limit that holds at this sample, until it returns true.
  template <class Visit>
  void ForEach(const Plan& plan, const Tube& tube, int t, Visit visit) const noexcept;

  std::vector<Limit> limits_;
  int num_inputs_;
  std::vector<double> input_error_;         // of the inputs that act; none where they are exact
  std::optional<TextEnclosure> functions_;  // none without limits
};

}  // namespace forereach
