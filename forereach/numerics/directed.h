/** Directed rounding: turns floating-point results into bounds in real arithmetic. XUp(a, b) >= a X b >= XDown(a, b).

All arithmetic is round-to-nearest. The rounding error of a sum or product is itself a double (TwoSum, fused
multiply-add), and its sign tells whether the rounded result lies above or below the exact one. An exact result is
returned unchanged, so bounds do not widen without a rounding error. NaN stays NaN, and every comparison in the library
is written so that NaN fails it. Cost: some operations each; no branch on the rounding mode. */
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "forereach/numerics/arithmetic.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kMaxDouble = std::numeric_limits<double>::max();
inline constexpr double kUnitRoundoff = 0x1p-53;

/** Whether the certify step bounds its rounding errors. It always does in the product. bench/ compiles the library a
second time without it, under another name, to measure the cost. */
#ifdef FOREREACH_WITHOUT_ROUNDING
inline constexpr bool kCountsRounding = false;
#else
inline constexpr bool kCountsRounding = true;
#endif

/** The error of plain operations whose rounding errors add up to at most `relative` times `size`. */
[[nodiscard]] inline double RoundingError(double relative, double size) noexcept {
  return kCountsRounding ? relative * size : 0;
}

/** The smallest double above x. Infinity and NaN are returned unchanged. */
[[nodiscard]] inline double NextUp(double x) noexcept {
  if (!(x < kInfinity)) return x;
  if (x == 0) return std::numeric_limits<double>::denorm_min();
  const auto bits = std::bit_cast<std::int64_t>(x);
  return std::bit_cast<double>(x > 0 ? bits + 1 : bits - 1);
}

/** The largest double below x. Minus infinity and NaN are returned unchanged. */
[[nodiscard]] inline double NextDown(double x) noexcept { return -NextUp(-x); }

namespace internal {

// Below this, the error of a product may not be a double, so its sign is not available.
inline constexpr double kSafeProduct = 0x1p-960;

// A NaN error, from an overflow in its computation, counts as positive.
[[nodiscard]] inline double UpIfBelow(double rounded, double error) noexcept {
  return error <= 0 ? rounded : NextUp(rounded);
}

// An overflow to minus infinity is not an upper bound of the exact finite result.
[[nodiscard]] inline double UpperOfOverflow(double rounded, bool operands_finite) noexcept {
  return rounded < 0 && operands_finite ? -kMaxDouble : rounded;
}

}  // namespace internal

/** The least double >= a + b, or the next one above it if b is the largest double or its negative. */
[[nodiscard]] inline double AddUp(double a, double b) noexcept {
  const double sum = a + b;
  if (!std::isfinite(sum)) return internal::UpperOfOverflow(sum, std::isfinite(a) && std::isfinite(b));
  const double b_part = sum - a;
  return internal::UpIfBelow(sum, (a - (sum - b_part)) + (b - b_part));
}

/** A double >= a * b: the least one, or one above it for results below 2^-960. */
[[nodiscard]] inline double MulUp(double a, double b) noexcept {
  const double product = a * b;
  if (!std::isfinite(product)) return internal::UpperOfOverflow(product, std::isfinite(a) && std::isfinite(b));
  if (std::abs(product) < internal::kSafeProduct) return a == 0 || b == 0 ? 0 : NextUp(product);
  return internal::UpIfBelow(product, std::fma(a, b, -product));
}

/** A double >= a / b: the least one, or one above it if |a| or |a / b| is below 2^-960. @pre b != 0. */
[[nodiscard]] inline double DivUp(double a, double b) noexcept {
  const double quotient = a / b;
  if (!std::isfinite(quotient)) return internal::UpperOfOverflow(quotient, std::isfinite(a) && b != 0);
  if (a == 0) return 0;
  if (std::abs(quotient) < internal::kSafeProduct || std::abs(a) < internal::kSafeProduct) return NextUp(quotient);
  const double remainder = std::fma(-quotient, b, a);
  return internal::UpIfBelow(quotient, b > 0 ? remainder : -remainder);
}

/** A double >= sqrt(x). @pre x >= 0. */
[[nodiscard]] inline double SqrtUp(double x) noexcept {
  const double root = std::sqrt(x);
  if (x == 0 || !std::isfinite(root)) return root;
  if (x < internal::kSafeProduct) return NextUp(root);
  return internal::UpIfBelow(root, std::fma(-root, root, x));
}

/** The least double >= x / 2. Halving rounds if x is subnormal and odd. */
[[nodiscard]] inline double HalfUp(double x) noexcept {
  const double half = x / 2;
  return 2 * half < x ? NextUp(half) : half;
}

[[nodiscard]] inline double SubUp(double a, double b) noexcept { return AddUp(a, -b); }
[[nodiscard]] inline double AddDown(double a, double b) noexcept { return -AddUp(-a, -b); }
[[nodiscard]] inline double SubDown(double a, double b) noexcept { return -AddUp(-a, b); }
[[nodiscard]] inline double MulDown(double a, double b) noexcept { return -MulUp(-a, b); }
[[nodiscard]] inline double DivDown(double a, double b) noexcept { return -DivUp(-a, b); }

/** A double <= sqrt(x). @pre x >= 0. */
[[nodiscard]] inline double SqrtDown(double x) noexcept {
  const double root = std::sqrt(x);
  if (x == 0 || !std::isfinite(root)) return root;
  if (x < internal::kSafeProduct) return NextDown(root);
  return std::fma(-root, root, x) < 0 ? NextDown(root) : root;
}

/** An upper bound on the exact sum of `terms` non-negative doubles, given their plain floating-point sum in any order.
The relative error of such a sum is below terms * u / (1 - terms * u), and additions do not underflow. */
[[nodiscard]] inline double SumUpper(double plain_sum, int terms) noexcept {
  if (terms <= 1 || plain_sum == 0) return plain_sum;
  return NextUp(MulUp(plain_sum, 1 + (2.0 * terms) * kUnitRoundoff));
}

/** An upper bound on the error |fl(sum_l a_l b_l) - sum_l a_l b_l| of a plain dot product of `terms` products in any
order, given an upper bound `magnitude` on sum_l |a_l b_l|. It is twice the textbook bound gamma_terms plus a smallest
double for each product, which may have underflowed. */
[[nodiscard]] inline double DotErrorUpper(double magnitude, int terms) noexcept {
  if (magnitude == 0) return 0;
  return AddUp(MulUp(magnitude, (2.0 * terms) * kUnitRoundoff), terms * std::numeric_limits<double>::denorm_min());
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
