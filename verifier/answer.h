/** What interval arithmetic says of a claim: it holds, it does not, or more bits are needed to tell. */
#pragma once

#include <string>

#include "verifier/real.h"

namespace forereach::verifier {

enum class Answer { kYes, kNo, kUnknown };

/** Whether a <= b (a < b) for the numbers meant. */
[[nodiscard]] inline Answer IsAtMost(const Real& a, const Real& b) {
  if (CertainlyAtMost(a, b)) return Answer::kYes;
  return CertainlyBelow(b, a) ? Answer::kNo : Answer::kUnknown;
}
[[nodiscard]] inline Answer IsBelow(const Real& a, const Real& b) {
  if (CertainlyBelow(a, b)) return Answer::kYes;
  return CertainlyAtMost(b, a) ? Answer::kNo : Answer::kUnknown;
}

/** A claim that does not hold, or could not be told. */
struct Failure {
  int step = -1;             ///< t of X_t, -1 where none applies.
  std::string what;          ///< The claim, in words.
  std::string found, bound;  ///< A number, and what it was held to: "at most 4.5".
  bool certain = true;       ///< False: more bits might tell.
  /** found - bound against the larger of the two, 1 where that says nothing. A tiny one is a rounding error's size. */
  double excess = 1;
};

}  // namespace forereach::verifier
