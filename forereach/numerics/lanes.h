/** Vectors of doubles: Lanes has four, Pack has eight, and WidePack has eight in one register. Results have the same
bits on every machine, because only +, -, *, /, max, min, |.| and comparisons are used, lane by lane, and sums always
have the same order. The instruction set (instruction_set.h) changes the time only.

The convention for passing a vector by value depends on the instruction set for which a function is compiled. So every
function or lambda that takes or returns Lanes is marked FOREREACH_INLINE, which inlines without optimisation too. Bits
and FromBits reinterpret a vector; std::bit_cast would be a call. Pack is a class and is passed in memory; functions
that take or return a WidePack are marked as well. */
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "forereach/numerics/compilation.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

inline constexpr std::size_t kLaneCount = 4;

#if !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi"  // g++ gives it where a template is instantiated
#endif

using Lanes [[gnu::vector_size(32)]] = double;
using LaneMask [[gnu::vector_size(32)]] = std::int64_t;

#define FOREREACH_INLINE [[gnu::always_inline]] inline

/** The least multiple of kLaneCount that is not below `count`. */
constexpr std::size_t PaddedToLanes(std::size_t count) { return (count + kLaneCount - 1) / kLaneCount * kLaneCount; }

FOREREACH_INLINE Lanes LoadLanes(const double* from) {
  Lanes x;
  __builtin_memcpy(&x, from, sizeof x);
  return x;
}
FOREREACH_INLINE void StoreLanes(const Lanes& x, double* to) { __builtin_memcpy(to, &x, sizeof x); }
/** Stores numbers four at a time, with zeros behind the last. (A load of four would wait for four single stores.) */
template <std::size_t N>
FOREREACH_INLINE void StoreAll(const double (&numbers)[N], double* to) {
  const auto at = [&](std::size_t i) __attribute__((always_inline)) { return i < N ? numbers[i] : 0.0; };
  for (std::size_t i = 0; i < N; i += kLaneCount) StoreLanes(Lanes{at(i), at(i + 1), at(i + 2), at(i + 3)}, to + i);
}
FOREREACH_INLINE Lanes AllLanes(double x) { return Lanes{x, x, x, x}; }
FOREREACH_INLINE LaneMask Bits(const Lanes& x) { return reinterpret_cast<LaneMask>(x); }
FOREREACH_INLINE Lanes FromBits(const LaneMask& x) { return reinterpret_cast<Lanes>(x); }
FOREREACH_INLINE Lanes Abs(const Lanes& x) {
  return FromBits(Bits(x) & LaneMask{INT64_MAX, INT64_MAX, INT64_MAX, INT64_MAX});
}
FOREREACH_INLINE Lanes Max(const Lanes& a, const Lanes& b) { return a > b ? a : b; }
/** As Max, gives b where a is NaN. */
FOREREACH_INLINE Lanes Min(const Lanes& a, const Lanes& b) { return a < b ? a : b; }
/** x in the first `count` lanes, `other` in the rest. */
FOREREACH_INLINE Lanes FirstLanes(const Lanes& x, std::size_t count, double other) {
  const auto end = static_cast<std::int64_t>(count);
  return LaneMask{0, 1, 2, 3} < LaneMask{end, end, end, end} ? x : AllLanes(other);
}
/** Set in this lane alone. */
FOREREACH_INLINE LaneMask AtLane(std::size_t lane) {
  const auto i = static_cast<std::int64_t>(lane);
  return LaneMask{0, 1, 2, 3} == LaneMask{i, i, i, i};
}
/** One bit for each lane of a mask. */
FOREREACH_INLINE unsigned BitsOf(const LaneMask& mask) {
#ifdef __SSE2__
  using Half [[gnu::vector_size(16)]] = double;
  std::array<Half, 2> halves;
  __builtin_memcpy(&halves, &mask, sizeof halves);
  return static_cast<unsigned>(__builtin_ia32_movmskpd(halves[0]) | __builtin_ia32_movmskpd(halves[1]) << 2);
#else
  const LaneMask bits = mask & LaneMask{1, 2, 4, 8}, pairs = bits | __builtin_shufflevector(bits, bits, 2, 3, 0, 1);
  return static_cast<unsigned>((pairs | __builtin_shufflevector(pairs, pairs, 1, 0, 3, 2))[0]);
#endif
}

namespace internal {

// For each set of lanes to leave out, as bits: the places from which the halves of the packed lanes come.
inline constexpr auto kPacking = [] {
  std::array<std::array<std::int32_t, 2 * kLaneCount>, 1 << kLaneCount> from{};
  for (std::size_t left_out = 0; left_out < from.size(); ++left_out)
    for (std::size_t lane = 0, to = 0; lane < kLaneCount; ++lane) {
      if (left_out >> lane & 1) continue;
      from[left_out][to++] = static_cast<std::int32_t>(2 * lane);
      from[left_out][to++] = static_cast<std::int32_t>(2 * lane + 1);
    }
  return from;
}();

}  // namespace internal

/** Moves the lanes whose bits are not set in `left_out` to the front, in their order. The lanes behind them are
undefined. */
class Packing {
 public:
  FOREREACH_INLINE explicit Packing(unsigned left_out) {
    __builtin_memcpy(&from_, internal::kPacking[left_out].data(), sizeof from_);
  }
  FOREREACH_INLINE Lanes operator()(const Lanes& x) const {
    const auto halves = reinterpret_cast<Halves>(x);
#ifdef __clang__  // has no shuffle by a variable
    Halves packed;
    for (std::size_t i = 0; i < 2 * kLaneCount; ++i) packed[i] = halves[from_[i]];
    return reinterpret_cast<Lanes>(packed);
#else
    return reinterpret_cast<Lanes>(__builtin_shuffle(halves, from_));
#endif
  }

 private:
  using Halves [[gnu::vector_size(32)]] = std::int32_t;
  Halves from_;
};
/** The sum of four, always in this order. */
FOREREACH_INLINE double Sum(const Lanes& x) { return (x[0] + x[2]) + (x[1] + x[3]); }
/** Sum(a), Sum(b), Sum(c), Sum(d), with the same bits. */
FOREREACH_INLINE Lanes SumEach(const Lanes& a, const Lanes& b, const Lanes& c, const Lanes& d) {
  const Lanes a_c = __builtin_shufflevector(a, c, 0, 1, 4, 5) + __builtin_shufflevector(a, c, 2, 3, 6, 7);
  const Lanes b_d = __builtin_shufflevector(b, d, 0, 1, 4, 5) + __builtin_shufflevector(b, d, 2, 3, 6, 7);
  return __builtin_shufflevector(a_c, b_d, 0, 4, 2, 6) + __builtin_shufflevector(a_c, b_d, 1, 5, 3, 7);
}

/** Whether the masks test(0), test(4), ... hold in the first n lanes of all. */
template <class Test>
FOREREACH_INLINE bool HoldsForFirst(std::size_t n, Test test) {
  const auto count = static_cast<std::int64_t>(n);
  LaneMask fails{}, left{count, count - 1, count - 2, count - 3};
  for (std::size_t k = 0; k < n; k += kLaneCount, left -= LaneMask{4, 4, 4, 4}) fails |= ~test(k) & (left > 0);
  return BitsOf(fails) == 0;
}

inline constexpr std::size_t kPackSize = 8;

/** Eight doubles, in memory and in registers. */
struct alignas(64) Pack {
  Lanes low, high;

  // Access one double in memory.
  [[nodiscard]] double at(std::size_t lane) const { return reinterpret_cast<const double*>(this)[lane]; }
  void set(std::size_t lane, double value) { reinterpret_cast<double*>(this)[lane] = value; }
};

/** A Pack of eight equal numbers, in half the registers. */
struct Same {
  Lanes all;
  [[gnu::always_inline]] operator Pack() const { return {all, all}; }  // NOLINT: it is one
};

FOREREACH_INLINE Same Fill(double x) { return {AllLanes(x)}; }
FOREREACH_INLINE Pack LoadPack(const Pack& p) { return {p.low, p.high}; }
/** From any address of eight doubles. */
FOREREACH_INLINE Pack LoadPack(const double* p) { return {LoadLanes(p), LoadLanes(p + kLaneCount)}; }
FOREREACH_INLINE Lanes Low(const Pack& a) { return a.low; }
FOREREACH_INLINE Lanes High(const Pack& a) { return a.high; }

FOREREACH_INLINE Pack operator+(const Pack& a, const Pack& b) { return {a.low + b.low, a.high + b.high}; }
FOREREACH_INLINE Pack operator-(const Pack& a, const Pack& b) { return {a.low - b.low, a.high - b.high}; }
FOREREACH_INLINE Pack operator*(const Pack& a, const Pack& b) { return {a.low * b.low, a.high * b.high}; }
FOREREACH_INLINE Pack Abs(const Pack& a) { return {Abs(a.low), Abs(a.high)}; }
FOREREACH_INLINE Pack Min(const Pack& a, const Pack& b) { return {Min(a.low, b.low), Min(a.high, b.high)}; }
FOREREACH_INLINE Pack Max(const Pack& a, const Pack& b) { return {Max(a.low, b.low), Max(a.high, b.high)}; }
FOREREACH_INLINE double Max(double a, double b) { return a > b ? a : b; }

/** Eight doubles in one register, for code that runs with AVX-512 alone. Comparisons go by its halves: g++ fixes the
type of their masks before it knows the instruction set. */
struct WidePack {
  using Eight [[gnu::vector_size(64)]] = double;
  using Bits [[gnu::vector_size(64)]] = std::int64_t;
  Eight all;
};

FOREREACH_INLINE Lanes Low(const WidePack& a) { return __builtin_shufflevector(a.all, a.all, 0, 1, 2, 3); }
FOREREACH_INLINE Lanes High(const WidePack& a) { return __builtin_shufflevector(a.all, a.all, 4, 5, 6, 7); }
FOREREACH_INLINE WidePack operator+(const WidePack& a, const WidePack& b) { return {a.all + b.all}; }
FOREREACH_INLINE WidePack operator-(const WidePack& a, const WidePack& b) { return {a.all - b.all}; }
FOREREACH_INLINE WidePack operator*(const WidePack& a, const WidePack& b) { return {a.all * b.all}; }
FOREREACH_INLINE WidePack Abs(const WidePack& a) {
  return {reinterpret_cast<WidePack::Eight>(reinterpret_cast<WidePack::Bits>(a.all) & INT64_MAX)};
}
FOREREACH_INLINE WidePack Min(const WidePack& a, const WidePack& b) { return {a.all < b.all ? a.all : b.all}; }
FOREREACH_INLINE WidePack Max(const WidePack& a, const WidePack& b) { return {a.all > b.all ? a.all : b.all}; }

/** How P, Pack or WidePack, is made. */
template <class P>
struct Packs {
  using Equal = Same;
  FOREREACH_INLINE static Pack Join(const Lanes& low, const Lanes& high) { return {low, high}; }
  FOREREACH_INLINE static Pack Load(const Pack& p) { return LoadPack(p); }
  FOREREACH_INLINE static Pack Load(const double* p) { return LoadPack(p); }
  FOREREACH_INLINE static Same Repeat(const Lanes& x) { return {x}; }
  FOREREACH_INLINE static Same Fill(double x) { return forereach::Fill(x); }
};
template <>
struct Packs<WidePack> {
  using Equal = WidePack;
  FOREREACH_INLINE static WidePack Join(const Lanes& low, const Lanes& high) {
    return {__builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7)};
  }
  FOREREACH_INLINE static WidePack Load(const Pack& p) { return Load(&p.low); }
  FOREREACH_INLINE static WidePack Load(const void* p) {
    WidePack x;
    __builtin_memcpy(&x, p, sizeof x);
    return x;
  }
  FOREREACH_INLINE static WidePack Repeat(const Lanes& x) { return Join(x, x); }
  // A list of eight is assembled number by number.
  FOREREACH_INLINE static WidePack Fill(double x) {
    const Lanes four = AllLanes(x);
    return {__builtin_shufflevector(four, four, 0, 0, 0, 0, 0, 0, 0, 0)};
  }
};

/** The largest of eight. */
template <class P>
FOREREACH_INLINE double MaxLane(const P& a) {
  const Lanes m = Max(Low(a), High(a));
  return Max(Max(m[0], m[2]), Max(m[1], m[3]));
}

/** The sum of eight. Each number passes three roundings. */
template <class P>
FOREREACH_INLINE double SumLanes(const P& a) {
  return Sum(Low(a) + High(a));
}

/** Replaces the last three bits of each double by the number of its lane, so that TaggedLane of the largest gives its
lane. Changes a number by at most seven units in the last place. @pre all are finite. */
template <class P>
FOREREACH_INLINE P TagLanes(const P& a) {
  const LaneMask rest = ~LaneMask{7, 7, 7, 7};
  return Packs<P>::Join(FromBits((Bits(Low(a)) & rest) | LaneMask{0, 1, 2, 3}),
                        FromBits((Bits(High(a)) & rest) | LaneMask{4, 5, 6, 7}));
}
FOREREACH_INLINE std::size_t TaggedLane(double value) { return std::bit_cast<std::uint64_t>(value) & 7; }

/** a with the lanes that hold `value` set to `other`. */
template <class P>
FOREREACH_INLINE P Replace(const P& a, double value, double other) {
  const Lanes v = AllLanes(value), o = AllLanes(other);
  return Packs<P>::Join(Low(a) == v ? o : Low(a), High(a) == v ? o : High(a));
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
