/** A scalar type that records only the arguments from which it was computed. Evaluate equations with it to find the
arguments on which each output may depend. The derivatives by all other arguments are exactly zero. */
#pragma once

#include <cstdint>

#include "forereach/numerics/compilation.h"

namespace forereach {

class Occurrence final {
 public:
  constexpr Occurrence() = default;
  constexpr explicit Occurrence(double) {}

  /** The argument with this index. @pre 0 <= index < 64. */
  [[nodiscard]] static constexpr Occurrence Argument(int index) {
    Occurrence result;
    result.mask_ = std::uint64_t{1} << index;
    return result;
  }

  [[nodiscard]] constexpr bool Of(int index) const { return (mask_ >> index & 1) != 0; }

#define FOREREACH_BOTH(name)                                     \
  friend constexpr Occurrence name(Occurrence a, Occurrence b) { \
    a.mask_ |= b.mask_;                                          \
    return a;                                                    \
  }
#define FOREREACH_ONE(name) \
  friend constexpr Occurrence name(Occurrence a) { return a; }
  FOREREACH_BOTH(operator+)
  FOREREACH_BOTH(operator-)
  FOREREACH_BOTH(operator*)
  FOREREACH_BOTH(operator/)
  FOREREACH_BOTH(min)
  FOREREACH_BOTH(max)
  FOREREACH_BOTH(atan2)
  FOREREACH_BOTH(Softplus)
  FOREREACH_ONE(operator-)
  FOREREACH_ONE(abs)
  FOREREACH_ONE(sqrt)
  FOREREACH_ONE(exp)
  FOREREACH_ONE(log)
  FOREREACH_ONE(sin)
  FOREREACH_ONE(cos)
  FOREREACH_ONE(tan)
  FOREREACH_ONE(asin)
  FOREREACH_ONE(acos)
  FOREREACH_ONE(atan)
  FOREREACH_ONE(tanh)
  FOREREACH_ONE(SmoothGate)
  friend constexpr Occurrence pow(Occurrence a, int n) { return n == 0 ? Occurrence() : a; }
#undef FOREREACH_BOTH
#undef FOREREACH_ONE

 private:
  std::uint64_t mask_ = 0;
};

}  // namespace forereach
