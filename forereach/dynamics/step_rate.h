/** The times of steps: what is declared of them, and how fast the end of a step moves with the step's duration: d f0 /
d dt, enclosed over boxes.

With f0^h the step of duration h, f0^(dt + delta)(z) - f0^dt(z) = delta g for some g in d f0^h(z) / d h, |h - dt| <=
|delta|. For an Euler step this is the rate x' itself; for midpoint, Runge-Kutta and `next` it is derived from the text
of the step. What the model does not know grows with a power of the duration: Growth. */
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "forereach/dynamics/model_text.h"
#include "forereach/dynamics/program.h"
#include "forereach/numerics/interval.h"
#include "forereach/sets/eigen.h"

namespace forereach {

/** What is declared of the times of steps. */
struct StepTiming {
  /** E: a boundary of steps is at most this far from its time, counted from the plan's start and from the first step's,
  in seconds; below half a step. 0: steps are on time. */
  double error = 0;
  /** The states that the robot's software sets at boundaries, however long a step lasts, by their indices. */
  std::vector<int> set_at_steps = {};
  /** For each state a bound on |dx_k/ds| of every true motion, in its unit a second; infinite: none, then the model's
  equations say it. No entries: none for any. */
  Eigen::VectorXd rate_bound = {};
};

class StepRate final {
 public:
  /** @throws as MakeProgram (text_program.h); std::invalid_argument if the text has no parameter dt. */
  explicit StepRate(const ModelText& text);

  /** Whether the end of state k depends on the duration at all: false for a step that says nothing of it. */
  [[nodiscard]] bool UsesDuration(int k) const { return uses_duration_[static_cast<std::size_t>(k)]; }
  /** Whether f0^h_k(z) - z_k is h times a number that does not depend on h, by the form of the equations: then
  f0^h_k(z) = z_k + h / dt (f0_k(z) - z_k), as in an Euler step. docs/soundness.md, 3.15, has the rules. */
  [[nodiscard]] bool IsProportional(int k) const { return is_proportional_[static_cast<std::size_t>(k)]; }

  /** Whether f0^0_k(z) = z_k, or f0^h_k(z) tends to it with h, by the form of the equations: a step of no duration
  leaves state k where it is. Otherwise some number in the equations stands for the duration, and dt does not say how
  the state moves. False also where the form does not show it. docs/soundness.md, 3.15, has the rules. */
  [[nodiscard]] bool BeginsAtState(int k) const { return begins_at_state_[static_cast<std::size_t>(k)]; }

  /** q: one more than the order of the integrator, 2 for Euler, 3 for midpoint, 5 for rk4; and 2 for `next`. */
  [[nodiscard]] int power() const { return power_; }
  /** (1 + share)^q - 1, rounded up: in a step whose duration differs from dt by `share` of it, residual and
  disturbance differ from those of dt by at most so much of |r| + w^. */
  [[nodiscard]] double Growth(double share) const noexcept;

  /** The same for some states: Enclose leaves the others' entries alone. @param states n marks. */
  [[nodiscard]] StepRate Of(std::span<const unsigned char> states) const;

  /** Sets rate[k] to an interval that contains d f0^h_k(z) / d h for every z in the box and h in `duration`; infinite
  where there is none. Allocates nothing. @param box d_z intervals. @param rate n entries. Cost O(operations). */
  void Enclose(std::span<const Interval> box, const Interval& duration, std::span<Interval> rate) const noexcept;

 private:
  void Need(std::span<const unsigned char> states);

  std::shared_ptr<const ProgramDraft> program_;
  std::vector<int> states_;  // those that Enclose bounds
  std::vector<unsigned char> needed_;
  std::vector<Interval> parameters_;
  std::size_t dt_ = 0;  // its place among the parameters
  std::vector<bool> uses_duration_, is_proportional_, begins_at_state_;
  int power_;
};

}  // namespace forereach
