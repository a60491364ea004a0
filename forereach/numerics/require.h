/** What a caller has to keep to. */
#pragma once

#include <stdexcept>
#include <string>

namespace forereach {

/** @throws std::invalid_argument with `what`, unless `good`. */
inline void Require(bool good, const std::string& what) {
  if (!good) throw std::invalid_argument(what);
}

}  // namespace forereach
