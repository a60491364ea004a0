/** Random inputs in a test: what fails says the seed that repeats it. */
#pragma once

#include <source_location>

#include <gtest/gtest.h>

#include "tests/oracle/random.h"

namespace forereach {

class TracedRandom final : public Random {
 public:
  explicit TracedRandom(std::uint64_t seed, std::source_location at = std::source_location::current())
      : Random(seed), trace_(at.file_name(), static_cast<int>(at.line()), trace()) {}

 private:
  testing::ScopedTrace trace_;
};

}  // namespace forereach
