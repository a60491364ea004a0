/** Steps whose boundaries are off the plan's schedule: what that adds to a step of the tube.

Boundary t is at the time s_t = s_0 + t dt + j_t, with j_0 = 0 and |j_t| <= E, so step t lasts dt + j_{t+1} - j_t and
    x_{t+1} = f0(x_t, u_t) + r + w + (j_{t+1} - j_t) g + e,    g in d f0 / d dt,
    |e| <= ((1 + |j_{t+1} - j_t| / dt)^q - 1) (|r| + w^):
residual and disturbance change by no more than the power q of the duration does (StepRate::Growth). With d some double
next to E g, j_t = E b_t, (j_{t+1} - j_t) g in d b_{t+1} - d b_t + [-1, 1] |b_{t+1} - b_t| |E g - d|. Where the end of a
state moves in proportion to the duration (StepRate::IsProportional), g = (f0(x_t, u_t) - x_t) / dt, which the step has
bounded already. The last generator d' of X_t, t > 0, is that of b_t. The step takes it out of the image, counts
|J d' - d| as a half-width, and appends d as the generator of b_{t+1}, so offsets do not add up: what stays of them is
how g changes from step to step. docs/soundness.md, 3.15. */
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "forereach/dynamics/expansion.h"
#include "forereach/dynamics/model.h"
#include "forereach/dynamics/rounding.h"
#include "forereach/dynamics/step_rate.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/limits.h"
#include "forereach/residual/enclosure.h"
#include "forereach/sets/eigen.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

class Zonotope;

/** What the offsets of both ends add to one step. */
struct OffsetSpread {
  std::array<double, kMaxStates> column;  ///< d
  /** Bounds on all that is added without correlation: disturbance and remainder, too. */
  std::array<double, kMaxStates> half_width;
};

/** A step up to the image of its slice, from which follows what the offsets add. */
struct StepSoFar {
  const Zonotope& slice;                ///< X_t
  std::span<const PlainInterval> hull;  ///< that of Z_t, d_z intervals rounded to nearest
  const double* half_width;             ///< upper bounds on the half-widths of the hull of X_t
  const Expansion& expansion;
  const StepError& error;
  const Remainder& remainder;
  const ResidualBounds& residual;
  /** Upper bounds on w^ with what the errors of the inputs add to the residual, on what they add to f0, and on the sum
  of both; readable up to kMaxStates. */
  const double *unexpected, *of_inputs, *disturbance;
  bool is_first;  ///< j_t = 0.
};

class StepOffsets final {
 public:
  /** @throws std::invalid_argument if a number is out of its range, the error is not below half of the model's dt, or
  neither rate_bound nor the equations say how state k moves with time; the message names it. */
  StepOffsets(const NominalModel& model, const StepTiming& timing);

  /** Nothing is ever off: E = 0. */
  [[nodiscard]] bool AreZero() const { return error_ == 0; }

  /** Sets `spread`, adds |d| to the sums of rows, and unless the step is the first, takes the last generator out of the
  image. What has no finite bound is infinite or NaN in them. Allocates nothing. @param image what the slice's
  generators have become, and nothing else yet. Cost O(entries of J), and the operations of the rates that the step
  itself does not bound. */
  void Add(const StepSoFar& step, OffsetSpread& spread, Zonotope& image, ImageSums& sums,
           InstructionSet instructions) const noexcept;

 private:
  using PerState = std::array<double, kMaxStates>;

  // Of a row of J - I: the entry of J, less `own`, by which the row's state moves with that of the column.
  struct Slope {
    unsigned short row, column, entry;
    double own;
  };

  // False if J has no entry for state k's own.
  [[nodiscard]] bool AddSlopesOf(const Program& program, int k);
  template <std::size_t kStates>  // a constant number of states, or 0
  FOREREACH_INLINE void AddInline(const StepSoFar& step, OffsetSpread& spread, Zonotope& image,
                                  ImageSums& sums) const noexcept;
  void EncloseByIntervals(std::span<const PlainInterval> hull, PerState& middle, PerState& reach) const noexcept;

  double error_, period_ = 0;
  Interval duration_{0};
  // Of each state where its rate counts: the growth of what the model does not know, if one end is off and if both are;
  // E / dt, rounded up, where the rate follows from the step itself. E V_k where V_k is declared.
  PerState growth_once_{}, growth_twice_{}, by_step_{}, declared_{};
  std::vector<Slope> slopes_;     // of the latter, where they are not zero
  std::optional<StepRate> rate_;  // of the others
  std::vector<int> by_intervals_;
  std::size_t states_;
};

}  // namespace forereach

FOREREACH_ARITHMETIC_END
