/** Counts and indices are signed where arithmetic is done on them; the standard library counts in std::size_t. */
#pragma once

#include <concepts>
#include <cstddef>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** n as a size or an index of a container. @pre n >= 0 */
[[nodiscard]] constexpr std::size_t ToSize(std::integral auto n) noexcept { return static_cast<std::size_t>(n); }

}  // namespace forereach
