/** Seeds of property tests: the same each time, shifted by FOREREACH_TEST_SEED=N in the environment. */
#pragma once

#include <cstdlib>

namespace forereach {

[[nodiscard]] inline unsigned SeedOf(unsigned seed) {
  const char* shift = std::getenv("FOREREACH_TEST_SEED");
  return seed + (shift ? static_cast<unsigned>(std::strtoul(shift, nullptr, 10)) : 0);
}

}  // namespace forereach
