/** Why the equations of a model have no finite enclosure over a box: the operation that meets its kink or pole. */
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forereach/dynamics/model.h"
#include "forereach/numerics/interval.h"

namespace forereach {

/** An operation of a model's text whose value, slope or curvature has no bound over a box, or may not have one. */
struct Unbounded {
  std::string operation;     ///< As it is written: abs, sqrt, /, ^.
  int line = 0, column = 0;  ///< Where, in the model's file, if it has one. They count from 1.
  std::vector<int> states;   ///< The states on which its argument depends, by their indices.
  /** The range of what must not be where it may be: the argument of the function, the divisor, the base of the power,
  the difference of the arguments of min and max, y of atan2(y, x), the first argument of hypot. */
  Interval argument;
};

/** The first such operation, in the order of evaluation, on which the next value of `state` depends over `box`; if
there is none, that of another state. Nothing if every operation is bounded, or if the model has no text (TextOf).
Ranges are by intervals, as the certifier's. Not for the certify step: it parses the text. @param box d_z intervals. */
[[nodiscard]] std::optional<Unbounded> FindUnbounded(const NominalModel& model, std::span<const Interval> box,
                                                     int state);

/** hypot(a, c) or sqrt(a^2 + d), c = sqrt(d) a constant, where a may be zero in a box in which it is known only up to
more than c. Its second derivative by a is 1 / c at a = 0 and falls off within c, so over the box the bound on it, which
is at least that, is many times what the remainder needs. */
struct SharpSmoothing {
  std::string operation;  ///< hypot or sqrt.
  int line = 0, column = 0;
  std::string argument;    ///< a as it is written, if it is a name; otherwise empty.
  double width = 0;        ///< c
  Interval range;          ///< of a
  bool is_square = false;  ///< It is multiplied by a: that is signed_square(a), smoothed.
};

/** All of them, in the order of evaluation at the start of a step; each once. @pre as FindUnbounded. */
[[nodiscard]] std::vector<SharpSmoothing> FindSharp(const NominalModel& model, std::span<const Interval> box);

}  // namespace forereach
