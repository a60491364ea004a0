/** The reachable tube of one plan, Eq. (propagation): what Certify computes, and what a certificate is about. */
#pragma once

#include <span>
#include <vector>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/interval.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "forereach/reach/propagator.h"
#include "forereach/safety/separation.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

/** The computed part of the reachable tube: slices X_0 .. X_length and a record of each completed step. Construct it
once and reuse it for every plan: it has room for the longest horizon, about 2.5 MB. Each has a cache line to itself:
threads write to neighbouring ones. */
class alignas(64) Tube final {
 public:
  Tube() : slices_(kMaxSteps + 1), steps_(kMaxSteps + 1), places_(kMaxPieces) {}

  /** Upper bounds on the half-widths of the hull of X_t, t <= length(). */
  [[nodiscard]] std::span<const double> half_width(int t) const {
    return {step(t).half_width.data(), ToSize(slice(t).dim())};
  }
  /** An interval that contains coordinate k of every point of X_t, rounded outward. Cost O(1). */
  [[nodiscard]] Interval hull(int t, int k) const {
    const double center = slice(t).center(k), r = half_width(t)[ToSize(k)];
    return {SubDown(center, r), AddUp(center, r)};
  }
  /** Number of completed steps; X_0 .. X_length() are valid. */
  [[nodiscard]] int length() const { return length_; }
  [[nodiscard]] const Zonotope& slice(int t) const { return slices_[ToSize(t)]; }
  [[nodiscard]] const StepRecord& step(int t) const { return steps_[ToSize(t)]; }

 private:
  friend class Certifier;
  friend class Extender;
  friend class Pieces;
  friend class SafetyTest;
  std::vector<Zonotope> slices_;
  std::vector<StepRecord> steps_;
  std::vector<Zonotope> places_;  // scratch memory of SafetyTest
  int length_ = 0;
};

}  // namespace forereach
