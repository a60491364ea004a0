/** Whether a program computes as bounds need it, where the preprocessor cannot tell (compilation.h).

Every file that includes this tests itself when the program starts: a file whose compiler was told to fuse or to reorder
operations says so to the library, and no Certifier can be made. So does a thread that makes a Certifier: flags at
linking time, or other libraries, may have switched off subnormal numbers or changed the rounding. */
#pragma once

#include <bit>
#include <cstdint>
#include <limits>

#include "certifier/numerics/compilation.h"

namespace forereach {

/** Throws std::runtime_error, saying what to change, unless all files that include this compute as they are written,
and this thread rounds to nearest and has subnormal numbers. */
void RequireExactArithmetic();

}  // namespace forereach

namespace forereach::internal {

/** Remembers it if a file does not compute as it is written. */
void ReportFile(bool computes_as_written) noexcept;

}  // namespace forereach::internal

FOREREACH_ARITHMETIC_BEGIN

namespace {

// Of each file that includes this one, so without linkage.
struct ForeReachArithmetic {
  [[gnu::noinline]] static bool IsAsWritten() {
    // Not known to the compiler.
    volatile double above = 1 + 0x1p-30, below = 1 - 0x1p-30, one = 1, tiny = 0x1p-60, three = 3, five = 5, nothing = 0,
                    no_number = std::numeric_limits<double>::quiet_NaN(),
                    endless = std::numeric_limits<double>::infinity();
    const double a = above, b = below, u = one, t = tiny, d = three, n = five, z = nothing, nan = no_number;
    // 1 - 2^-60 is rounded to 1. Each product is read anew: one that is used twice need not be fused.
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
