/** Three-valued answers of interval arithmetic to a claim: true, false, or undecided at this precision. */
#pragma once

#include <string>

#include "verifier/real.h"

namespace forereach::verifier {

enum class Answer { kYes, kNo, kUnknown };

/** Whether a <= b (a < b) for the exact numbers that the intervals enclose. */
[[nodiscard]] inline Answer IsAtMost(const Real& a, const Real& b) {
  if (CertainlyAtMost(a, b)) return Answer::kYes;
  return CertainlyBelow(b, a) ? Answer::kNo : Answer::kUnknown;
}
[[nodiscard]] inline Answer IsBelow(const Real& a, const Real& b) {
  if (CertainlyBelow(a, b)) return Answer::kYes;
  return CertainlyAtMost(b, a) ? Answer::kNo : Answer::kUnknown;
}

/** A claim that is false or undecided. */
struct Failure {
  int step = -1;             ///< t of X_t; -1 if no step applies.
  std::string what;          ///< The claim, as text.
  std::string found, bound;  ///< The number found and its bound, for example "at most 4.5".
  bool certain = true;       ///< False: undecided; more bits may decide.
  /** |found - bound| relative to the larger of the two; 1 if this is not defined. Tiny if only rounding is the
  cause. */
  double excess = 1;
};

}  // namespace forereach::verifier
