/** The Taylor remainder of one step, Eq. (qt-formula): an interval that contains
    rho_k(d) = 1/2 d^T H_k d
for every d = x - c with x in the slice and every H_k in the interval Hessian over the slice's hull. Inputs are points,
so their entries of d are zero. expansion.h describes the two methods.

The code is straight-line code for a program that is known at compile time. It treats four terms at a time. */
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "certifier/dynamics/expand.h"
#include "certifier/dynamics/expansion.h"
#include "certifier/numerics/directed.h"
#include "certifier/numerics/instruction_set.h"
#include "certifier/numerics/lanes.h"
#include "certifier/numerics/size.h"
#include "certifier/sets/zonotope.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach::internal {

/** The second derivatives by states, in the order in which each method uses them. */
struct RemainderTerms {
  // A term of kPaper: one second derivative.
  struct Single {
    std::size_t output = 0, first = 0, second = 0, entry = 0;
  };
  // A term of kCentred: a mixed derivative, a diagonal one of the first variable, or both.
  struct Joined {
    static constexpr std::size_t kNone = Program::kMaxSecond;
    std::size_t output = 0, first = 0, second = 0, mixed = kNone, diagonal = kNone;
    std::size_t pair = 0;  // index into `pairs` for the mixed derivative
    [[nodiscard]] constexpr bool has_mixed() const { return mixed != kNone; }
    [[nodiscard]] constexpr bool has_diagonal() const { return diagonal != kNone; }
  };
  // Two variables with a mixed derivative in at least one output.
  struct Pair {
    std::size_t first = 0, second = 0;
    constexpr bool operator==(const Pair&) const = default;
  };
  std::array<Single, Program::kMaxSecond> single{};
  std::array<Joined, Program::kMaxSecond> joined{};
  std::array<Pair, Program::kMaxSecond> pairs{};
  std::size_t num_single = 0, num_joined = 0, num_pairs = 0;

  constexpr explicit RemainderTerms(const Program& program) {
    for (int e = 0; e < program.num_second; ++e) {
      const Program::Second& entry = program.hessian[ToSize(e)];
      if (entry.row >= program.states || entry.column >= program.states) continue;
      single[num_single++] = {ToSize(entry.output), ToSize(entry.row), ToSize(entry.column), ToSize(e)};
    }
    for (std::size_t i = 0; i < num_single; ++i)
      if (const auto& [output, first, second, entry] = single[i]; first != second)
        joined[num_joined++] = {output, first, second, entry, Joined::kNone, PairOf(first, second)};
    for (std::size_t i = 0; i < num_single; ++i)
      if (single[i].first == single[i].second) Join(single[i]);
  }

 private:
  constexpr void Join(const Single& diagonal) {
    for (std::size_t i = 0; i < num_joined; ++i) {
      Joined& term = joined[i];
      if (term.output != diagonal.output || term.has_diagonal()) continue;
      if (term.first != diagonal.first && term.second != diagonal.first) continue;
      if (term.first != diagonal.first) std::swap(term.first, term.second);
      term.diagonal = diagonal.entry;
      return;
    }
    joined[num_joined++] = {diagonal.output, diagonal.first, diagonal.first, Joined::kNone, diagonal.entry, 0};
  }
  constexpr std::size_t PairOf(std::size_t i, std::size_t l) {
    const Pair pair{std::min(i, l), std::max(i, l)};
    std::size_t p = 0;
    while (p < num_pairs && pairs[p] != pair) ++p;
    if (p == num_pairs) pairs[num_pairs++] = pair;
    return p;
  }
};

template <const Program& kProgram>
inline constexpr RemainderTerms kRemainderTerms{kProgram};

// kRemainderRelative exceeds the relative rounding error of the operations below, measured against the sum of the sizes
// of their terms. kRemainderTiny exceeds the error by underflow. Its product with a derivative is a normal number
// unless the derivative is tiny; processors multiply subnormal numbers slowly.
inline constexpr double kRemainderRelative = 0x1p-44, kRemainderTiny = 0x1p-1000;

inline double CountedError(double error) { return kCountsRounding ? error : 0; }

inline double Size(const PlainInterval& x) { return std::max(std::abs(x.lower), std::abs(x.upper)); }

template <const Program& kProgram>
FOREREACH_INLINE void EncloseSizes(const double* half_width, const PlainInterval* hessian, const double* error,
                                   Remainder& out) {
  constexpr auto kStates = ToSize(kProgram.states);
  double sums[kStates] = {};
  ForEachConstant<kRemainderTerms<kProgram>.num_single>([&](auto i) __attribute__((always_inline)) {
    constexpr RemainderTerms::Single kTerm = kRemainderTerms<kProgram>.single[i];
    constexpr double kWeight = kTerm.first == kTerm.second ? 0.5 : 1;
    const double r = half_width[kTerm.first], other = half_width[kTerm.second];
    if (r == 0 || other == 0) return;  // exactly zero
    sums[kTerm.output] +=
        kWeight * Size(hessian[kTerm.entry]) * (r * other + kRemainderTiny) * (1 + kRemainderRelative) +
        CountedError(error[kTerm.entry]);
  });
  constexpr double kZeros[kStates] = {};
  StoreAll(kZeros, out.center.data());
  StoreAll(sums, out.half_width.data());
}

// The ends P, N of d_i d_l in [-N, P] for each pair of variables: P_0, N_0, P_1, N_1, ...
template <const Program& kProgram>
using ProductEnds = std::array<double, PaddedToLanes(2 * kRemainderTerms<kProgram>.num_pairs)>;

template <const Program& kProgram>
FOREREACH_INLINE ProductEnds<kProgram> EncloseProducts(const Zonotope& slice, const double* half_width) {
  constexpr std::size_t kPairs = kRemainderTerms<kProgram>.num_pairs;
  ProductEnds<kProgram> ends;
  std::array<Lanes, ends.size()> sums{};
  for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount)
    ForEachConstant<kPairs>([&](auto p) __attribute__((always_inline)) {
      constexpr RemainderTerms::Pair kPair = kRemainderTerms<kProgram>.pairs[p];
      const auto row = [&](std::size_t k) { return slice.padded_row(static_cast<int>(k)).data() + j; };
      const Lanes a = LoadLanes(row(kPair.first)) * AllLanes(half_width[kPair.second]);
      const Lanes b = LoadLanes(row(kPair.second)) * AllLanes(half_width[kPair.first]);
      sums[2 * p] += Abs(a + b);
      sums[2 * p + 1] += Abs(a - b);
    });
  ForEachConstant<(kPairs + 1) / 2>([&](auto g) __attribute__((always_inline)) {  // two pairs at a time
    constexpr RemainderTerms::Pair kOne = kRemainderTerms<kProgram>.pairs[2 * g];
    constexpr RemainderTerms::Pair kTwo = kRemainderTerms<kProgram>.pairs[std::min<std::size_t>(2 * g + 1, kPairs - 1)];
    const double *r = half_width, *s = slice.slacks();
    const Lanes r_i{r[kOne.first], r[kOne.first], r[kTwo.first], r[kTwo.first]};
    const Lanes r_l{r[kOne.second], r[kOne.second], r[kTwo.second], r[kTwo.second]};
    const Lanes s_i{s[kOne.first], s[kOne.first], s[kTwo.first], s[kTwo.first]};
    const Lanes s_l{s[kOne.second], s[kOne.second], s[kTwo.second], s[kTwo.second]};
    const Lanes product = r_i * r_l, quarter = AllLanes(0.25) / product;
    const Lanes sum = SumEach(sums[4 * g], sums[4 * g + 1], sums[4 * g + 2], sums[4 * g + 3]) + (s_i * r_l + s_l * r_i);
    const LaneMask fits =
        (product > AllLanes(0x1p-400)) & (product < AllLanes(0x1p400));  // otherwise a factor could underflow
    StoreLanes(fits ? Min(product, sum * sum * quarter) : product, &ends[4 * g]);
  });
  return ends;
}

// max over 0 <= s <= r of 1/2 a s^2 + h t s, with h and t >= 0. Multiplies by a and h last, so that an underflow before
// is scaled like the margin that covers it.
FOREREACH_INLINE Lanes Peak(const Lanes& a, const Lanes& h, const Lanes& t, const Lanes& r) {
  const Lanes slope = h * t, top = slope / -a, s = -a * r > slope ? top : r;
  return a * (s * s * AllLanes(0.5)) + h * (t * s);
}

// get(term) of the joined terms kFirst .. kFirst + 3, and zero behind the last term.
template <const Program& kProgram, std::size_t kFirst, class Get>
FOREREACH_INLINE Lanes FourTerms(Get get) {
  const auto at = [&](std::size_t i) __attribute__((always_inline)) {
    constexpr const RemainderTerms& kTerms = kRemainderTerms<kProgram>;
    return i < kTerms.num_joined ? get(kTerms.joined[i]) : 0.0;
  };
  return Lanes{at(kFirst), at(kFirst + 1), at(kFirst + 2), at(kFirst + 3)};
}

// The ranges of four joined terms 1/2 a d_i^2 + h d_i d_l, and bounds on their rounding errors.
struct TermRanges {
  Lanes lower, upper, rounding;
};

template <const Program& kProgram, std::size_t kFirst>
FOREREACH_INLINE TermRanges EncloseTerms(const double* half_width, const PlainInterval* hessian, const double* error,
                                         const double* products) {
  const auto each = [](auto get) __attribute__((always_inline)) { return FourTerms<kProgram, kFirst>(get); };
  using Term = RemainderTerms::Joined;
  const Lanes r = each([&](const Term& t) { return half_width[t.first]; });
  const Lanes other = each([&](const Term& t) { return t.has_mixed() ? half_width[t.second] : 0; });
  const Lanes positive = each([&](const Term& t) { return t.has_mixed() ? products[2 * t.pair] : 0; });
  const Lanes negative = each([&](const Term& t) { return t.has_mixed() ? products[2 * t.pair + 1] : 0; });
  // If a variable is a point, its terms are exactly zero, even if a derivative is infinite.
  const LaneMask has_diagonal = r > AllLanes(0), has_mixed = has_diagonal & (other > AllLanes(0));
  const auto of_mixed = [&](auto get) __attribute__((always_inline)) {
    return has_mixed ? each([&](const Term& t) { return t.has_mixed() ? get(t.mixed) : 0; }) : AllLanes(0);
  };
  const auto of_diagonal = [&](auto get) __attribute__((always_inline)) {
    return has_diagonal ? each([&](const Term& t) { return t.has_diagonal() ? get(t.diagonal) : 0; }) : AllLanes(0);
  };
  const auto lower = [&](std::size_t e) { return hessian[e].lower; };
  const auto upper = [&](std::size_t e) { return hessian[e].upper; };
  const auto counted = [&](std::size_t e) { return CountedError(error[e]); };

  const Lanes h_lower = of_mixed(lower), h_upper = of_mixed(upper), h_size = Max(Abs(h_lower), Abs(h_upper));
  const Lanes a_lower = of_diagonal(lower), a_upper = of_diagonal(upper), a_size = Max(Abs(a_lower), Abs(a_upper));
  const Lanes half_square = r * r * AllLanes(0.5);
  const Lanes low = Min(h_lower * positive, -(h_upper * negative)) + half_square * Min(a_lower, AllLanes(0));
  const Lanes high = Max(h_upper * positive, -(h_lower * negative)) + half_square * Max(a_upper, AllLanes(0));
  const Lanes size = h_size * (r * other) + half_square * a_size;
  // Uses both ends of h, so that a NaN in either end reaches the result.
  const Lanes underflow = AllLanes(0.5 * kRemainderTiny) * (Abs(h_lower) + Abs(h_upper) + a_size);
  const Lanes margin = of_mixed(counted) + of_diagonal(counted) + underflow;
  return {Max(low, -Peak(-a_lower, h_size, other, r)), Min(high, Peak(a_upper, h_size, other, r)),
          AllLanes(RoundingError(kRemainderRelative, 1)) * size + margin * AllLanes(1 + kRemainderRelative)};
}

template <const Program& kProgram>
FOREREACH_INLINE void EncloseCentred(const Zonotope& slice, const double* half_width, const PlainInterval* hessian,
                                     const double* error, Remainder& out) {
  constexpr auto kStates = ToSize(kProgram.states);
  constexpr std::size_t kTerms = kRemainderTerms<kProgram>.num_joined;
  const ProductEnds<kProgram> products = EncloseProducts<kProgram>(slice, half_width);
  double lower[kStates] = {}, upper[kStates] = {}, rounding[kStates] = {};
  ForEachConstant<(kTerms + kLaneCount - 1) / kLaneCount>([&](auto g) __attribute__((always_inline)) {
    constexpr std::size_t kFirst = g * kLaneCount;
    const TermRanges ranges = EncloseTerms<kProgram, kFirst>(half_width, hessian, error, products.data());
    ForEachConstant<std::min(kLaneCount, kTerms - kFirst)>([&](auto i) __attribute__((always_inline)) {
      constexpr std::size_t kLane = i, kOutput = kRemainderTerms<kProgram>.joined[kFirst + kLane].output;
      lower[kOutput] += ranges.lower[kLane];
      upper[kOutput] += ranges.upper[kLane];
      rounding[kOutput] += ranges.rounding[kLane];
    });
  });
  double center[kStates], half[kStates];
  ForEachConstant<kStates>([&](auto k) __attribute__((always_inline)) {
    center[k] = (lower[k] + upper[k]) * 0.5;
    half[k] = (upper[k] - lower[k]) * 0.5 + rounding[k];
  });
  StoreAll(center, out.center.data());
  StoreAll(half, out.half_width.data());
}

/** @param half_width r, n entries: inputs are points. @param hessian in the order of the program's.
@param error of each term, StepError::remainder.
Rounding is included. An entry that is not finite gives a half-width that is not. Cost O(second derivatives * m). */
/** NominalModel::EncloseRemainder for one program: |rho_k(d) - out.center_k| <= out.half_width_k for every d and H_k as
above, in real arithmetic. If an entry of `hessian` is not finite, neither is the half-width of its output, unless one
of its two variables is a point. Cost O(second derivatives * m). */
template <const Program& kProgram>
FOREREACH_INLINE void EncloseBy(Method method, const Zonotope& slice, const double* half_width,
                                const PlainInterval* hessian, const double* error, Remainder& out) {
  switch (method) {
    case Method::kPaper: return EncloseSizes<kProgram>(half_width, hessian, error, out);
    case Method::kCentred: return EncloseCentred<kProgram>(slice, half_width, hessian, error, out);
  }
  out.half_width.fill(kInfinity);  // no method: no bound
}

}  // namespace forereach::internal

FOREREACH_ARITHMETIC_END
