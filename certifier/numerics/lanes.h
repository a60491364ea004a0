/** Four doubles at a time, by the compiler's vectors: the same bits on every instruction set, since only +, -, *, max,
abs and comparisons are used and sums are always taken in the same order. */
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "certifier/numerics/simd.h"

namespace forereach {

inline constexpr std::size_t kLanes = 4;

// Passing these between functions depends on the instruction set, so everything here is inlined.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

using Lanes [[gnu::vector_size(32)]] = double;
using LaneMask [[gnu::vector_size(32)]] = std::int64_t;

#define FOREREACH_INLINE [[gnu::always_inline]] inline

/** Up to the next multiple of kLanes. */
constexpr std::size_t PaddedToLanes(std::size_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

FOREREACH_INLINE Lanes LoadLanes(const double* from) {
  Lanes x;
  __builtin_memcpy(&x, from, sizeof x);
  return x;
}
FOREREACH_INLINE void StoreLanes(const Lanes& x, double* to) { __builtin_memcpy(to, &x, sizeof x); }
FOREREACH_INLINE Lanes AllLanes(double x) { return Lanes{x, x, x, x}; }
FOREREACH_INLINE Lanes Abs(const Lanes& x) {
  return std::bit_cast<Lanes>(std::bit_cast<LaneMask>(x) & LaneMask{INT64_MAX, INT64_MAX, INT64_MAX, INT64_MAX});
}
FOREREACH_INLINE Lanes Max(const Lanes& a, const Lanes& b) { return a > b ? a : b; }
FOREREACH_INLINE double Sum(const Lanes& x) { return (x[0] + x[2]) + (x[1] + x[3]); }

/** What the hot functions outside of classes run on: the best there is, unless a test chooses. */
inline InstructionSet active_instruction_set = BestInstructionSet();

}  // namespace forereach
