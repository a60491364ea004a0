/** Run-time tests of the arithmetic that bounds rely on, for properties that the preprocessor cannot check
(compilation.h).

Every file that includes this header tests its own arithmetic at program start. If its compiler fuses or reorders
operations, it reports this to the library, and the construction of a Certifier fails. The constructor of a Certifier
also tests its thread, because link-time flags or other libraries may have disabled subnormal numbers or changed the
rounding mode. */
#pragma once

#include <bit>
#include <cstdint>
#include <limits>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** Checks that all files that include this header compute as written, and that this thread rounds to nearest and has
subnormal numbers. @throws std::runtime_error that says what to change if one of these is false. */
void RequireExactArithmetic();

}  // namespace forereach

namespace forereach::internal {

/** Records the result of a file's test. */
void ReportFile(bool computes_as_written) noexcept;

}  // namespace forereach::internal

FOREREACH_ARITHMETIC_BEGIN

namespace {

// One for each file that includes this header, so it has internal linkage.
struct ForeReachArithmetic {
  [[gnu::noinline]] static bool IsAsWritten() {
    // volatile: the compiler must not compute with the values.
    volatile double above = 1 + 0x1p-30, below = 1 - 0x1p-30, one = 1, tiny = 0x1p-60, three = 3, five = 5, nothing = 0,
                    no_number = std::numeric_limits<double>::quiet_NaN(),
                    endless = std::numeric_limits<double>::infinity();
    const double a = above, b = below, u = one, t = tiny, d = three, n = five, z = nothing, nan = no_number;
    // 1 - 2^-60 is rounded to 1. Each product is computed separately, because a compiler may not fuse one that is used
    // twice.
    const double difference = a * b - u, negated = u - above * below, product = above * below, later = product - one;
    const bool fuses = difference != 0 || negated != 0 || later != 0;
    const bool reorders = (u + t) - u != 0 || (t + u) - u != 0;
    const bool inverts = n / d != 0x1.aaaaaaaaaaaabp+0 || d / d != 1;  // 5 * (1 / 3) is one unit less
    const bool assumes_finite = nan == nan || !(nan != nan) || !(endless > std::numeric_limits<double>::max());
    const bool drops_sign = std::bit_cast<std::uint64_t>(0 - z) != 0 || std::bit_cast<std::uint64_t>(-z) == 0;
    return !fuses && !reorders && !inverts && !assumes_finite && !drops_sign;
  }
  ForeReachArithmetic() { forereach::internal::ReportFile(IsAsWritten()); }
};
[[maybe_unused]] const ForeReachArithmetic forereach_arithmetic;

}  // namespace

FOREREACH_ARITHMETIC_END
