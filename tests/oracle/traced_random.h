/** Random inputs in a test: what fails says the seed that repeats it.
`for (TracedRandom random(7); random.Again(100);) {...}` makes a hundred trials. */
#pragma once

#include <cstdint>

#include <gtest/gtest.h>

#include "tests/oracle/random.h"

namespace forereach {

class TracedRandom final : public Random {
 public:
  // clang 14 has no std::source_location.
  explicit TracedRandom(std::uint64_t seed, const char* file = __builtin_FILE(), int line = __builtin_LINE())
      : Random(seed), trace_(file, line, trace()) {}

  bool Again(int trials) { return ++trial_ < trials; }
  /** From 0. */
  [[nodiscard]] int trial() const { return trial_; }

 private:
  testing::ScopedTrace trace_;
  int trial_ = -1;
};

}  // namespace forereach
