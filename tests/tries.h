/** How many random problems a test tries. */
#pragma once

#include "tests/sanitized.h"

namespace forereach {

/** Under sanitizers, which are about ten times slower and look for misuse of memory rather than for wrong bounds, a
tenth of `count`. */
constexpr int Tries(int count) {
#if FOREREACH_SANITIZED
  return count < 10 ? 1 : count / 10;
#else
  return count;
#endif
}

}  // namespace forereach
