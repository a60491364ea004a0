/** Eight doubles at a time, the same to the last bit on every machine.

The width is fixed, and a pack knows +, -, *, |.|, max and min only, each lane by itself: what an instruction set
changes is the time. A hot function is written once, as templates and functions of an unnamed namespace, and becomes
machine code twice: inlined into an entry point marked FOREREACH_AVX2, and into one marked FOREREACH_FLATTEN. A member
of the class that owns them holds the InstructionSet and chooses. */
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "certifier/numerics/compilation.h"

#define FOREREACH_FLATTEN [[gnu::flatten]]
#if defined(__x86_64__)
#define FOREREACH_AVX2 [[gnu::target("avx2"), gnu::flatten]]
#else
#define FOREREACH_AVX2 [[gnu::flatten]]
#endif

FOREREACH_ARITHMETIC_BEGIN

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"  // nothing here is ever called: all of it is inlined

namespace forereach {

enum class InstructionSet { kBaseline, kAvx2 };

/** The best one that this machine has. */
[[nodiscard]] inline InstructionSet BestInstructionSet() noexcept {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") ? InstructionSet::kAvx2 : InstructionSet::kBaseline;
#else
  return InstructionSet::kBaseline;
#endif
}

namespace simd {

inline constexpr std::size_t kLanes = 8;
inline constexpr std::int64_t kAllButSign = std::numeric_limits<std::int64_t>::max();

typedef double Quad __attribute__((vector_size(32)));
typedef std::int64_t QuadMask __attribute__((vector_size(32)));

/** Eight doubles, in memory and in registers. */
struct alignas(64) Pack {
  Quad low, high;

  // As memory: one lane is read or written, the others are left alone.
  [[nodiscard]] double at(std::size_t lane) const { return reinterpret_cast<const double*>(this)[lane]; }
  void set(std::size_t lane, double value) { reinterpret_cast<double*>(this)[lane] = value; }
};

/** One number in every lane, at half the registers. */
struct Same {
  Quad all;
  [[gnu::always_inline]] operator Pack() const { return {all, all}; }  // NOLINT: it is one
};

[[gnu::always_inline]] inline Same Fill(double x) { return {Quad{x, x, x, x}}; }
[[gnu::always_inline]] inline Pack Load(const Pack& p) { return {p.low, p.high}; }

/** From any address of eight doubles. */
[[gnu::always_inline]] inline Pack Load(const double* p) {
  typedef double Unaligned __attribute__((vector_size(32), aligned(8), may_alias));
  return {*reinterpret_cast<const Unaligned*>(p), *reinterpret_cast<const Unaligned*>(p + 4)};
}

/** The first `count` of eight doubles, zero in the other lanes. @pre eight can be read. */
[[gnu::always_inline]] inline Pack LoadFirst(const double* p, std::size_t count) {
  const auto n = static_cast<std::int64_t>(count);
  const QuadMask all{n, n, n, n};
  const Pack pack = Load(p);
  return {reinterpret_cast<Quad>(reinterpret_cast<QuadMask>(pack.low) & (QuadMask{0, 1, 2, 3} < all)),
          reinterpret_cast<Quad>(reinterpret_cast<QuadMask>(pack.high) & (QuadMask{4, 5, 6, 7} < all))};
}

[[gnu::always_inline]] inline Pack operator+(const Pack& a, const Pack& b) { return {a.low + b.low, a.high + b.high}; }
[[gnu::always_inline]] inline Pack operator-(const Pack& a, const Pack& b) { return {a.low - b.low, a.high - b.high}; }
[[gnu::always_inline]] inline Pack operator*(const Pack& a, const Pack& b) { return {a.low * b.low, a.high * b.high}; }

[[gnu::always_inline]] inline Pack Abs(const Pack& a) {
  const QuadMask mask{kAllButSign, kAllButSign, kAllButSign, kAllButSign};
  return {reinterpret_cast<Quad>(reinterpret_cast<QuadMask>(a.low) & mask),
          reinterpret_cast<Quad>(reinterpret_cast<QuadMask>(a.high) & mask)};
}

/** a where a < b, else b. */
[[gnu::always_inline]] inline Pack Min(const Pack& a, const Pack& b) {
  return {a.low < b.low ? a.low : b.low, a.high < b.high ? a.high : b.high};
}

/** a where a > b, else b. */
[[gnu::always_inline]] inline Pack Max(const Pack& a, const Pack& b) {
  return {a.low > b.low ? a.low : b.low, a.high > b.high ? a.high : b.high};
}

[[gnu::always_inline]] inline double Max(double a, double b) { return a > b ? a : b; }

/** The largest of eight. */
[[gnu::always_inline]] inline double MaxLane(const Pack& a) {
  const Quad m = a.low > a.high ? a.low : a.high;
  return Max(Max(m[0], m[2]), Max(m[1], m[3]));
}

/** The sum of eight, each added three times at most. */
[[gnu::always_inline]] inline double SumLanes(const Pack& a) {
  const Quad s = a.low + a.high;
  return (s[0] + s[2]) + (s[1] + s[3]);
}

/** Puts the number of its lane into the last three bits of each, finite, double: an error of seven units in the last
place at most, for which the largest of eight says where it stands. */
[[gnu::always_inline]] inline Pack TagLanes(const Pack& a) {
  const QuadMask rest = ~QuadMask{7, 7, 7, 7};
  return {reinterpret_cast<Quad>((reinterpret_cast<QuadMask>(a.low) & rest) | QuadMask{0, 1, 2, 3}),
          reinterpret_cast<Quad>((reinterpret_cast<QuadMask>(a.high) & rest) | QuadMask{4, 5, 6, 7})};
}
[[gnu::always_inline]] inline std::size_t TaggedLane(double value) { return std::bit_cast<std::uint64_t>(value) & 7; }

/** a with the lanes that hold `value` set to `other`. */
[[gnu::always_inline]] inline Pack Replace(const Pack& a, double value, double other) {
  const Pack v = Fill(value), o = Fill(other);
  return {a.low == v.low ? o.low : a.low, a.high == v.high ? o.high : a.high};
}

}  // namespace simd
}  // namespace forereach

#pragma GCC diagnostic pop

FOREREACH_ARITHMETIC_END
