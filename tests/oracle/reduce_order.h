#pragma once

#include "forereach/sets/order_reduction.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

/** AppendAndReduce without generators to append: the reduction of the order alone. */
inline void ReduceOrder(Zonotope& set, int order) noexcept {
  constexpr std::array<double, kMaxStates> kNone{};
  AppendAndReduce(set, kNone.data(), kNone.data(), order);
}

}  // namespace forereach
