/** The Taylor remainder of one step, Eq. (qt-formula): an interval that contains
    rho_k(d) = 1/2 d^T H_k d
for every d = x - c with x in the slice and every H_k in the interval Hessian over the slice's hull. Inputs are points,
so their entries of d are zero. expansion.h describes the two methods.

For a program that is a constant this is straight-line code, for one that was read from a text loops over its terms;
both compute the same bits. Four terms are treated at a time. */
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "forereach/dynamics/expand.h"
#include "forereach/dynamics/expansion.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/size.h"
#include "forereach/sets/zonotope.h"

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
  static constexpr std::size_t kMaxPairs = kMaxStates * (kMaxStates - 1) / 2;

  std::vector<Single> single;
  std::vector<Joined> joined;
  std::vector<Pair> pairs;
  std::size_t states = 0;

  constexpr explicit RemainderTerms(const Program& program) : states(ToSize(program.states)) {
    for (int e = 0; e < program.num_second; ++e) {
      const Program::Second& entry = program.hessian[ToSize(e)];
      single.push_back({ToSize(entry.output), ToSize(entry.row), ToSize(entry.column), ToSize(e)});
    }
    for (const auto& [output, first, second, entry] : single)
      if (first != second) joined.push_back({output, first, second, entry, Joined::kNone, PairOf(first, second)});
    for (const Single& term : single)
      if (term.first == term.second) Join(term);
  }

  /** Calls visit(0), ..., visit(n - 1) for n terms or pairs. */
  template <class Visit>
  FOREREACH_INLINE void ForEachSingle(Visit visit) const {
    for (std::size_t i = 0; i < single.size(); ++i) visit(i);
  }
  template <class Visit>
  FOREREACH_INLINE void ForEachPair(Visit visit) const {
    for (std::size_t p = 0; p < pairs.size(); ++p) visit(p);
  }
  /** Likewise for n groups: of two pairs, and of four joined terms. */
  template <class Visit>
  FOREREACH_INLINE void ForEachTwoPairs(Visit visit) const {
    for (std::size_t g = 0; 2 * g < pairs.size(); ++g) visit(g);
  }
  template <class Visit>
  FOREREACH_INLINE void ForEachFourJoined(Visit visit) const {
    for (std::size_t g = 0; g * kLaneCount < joined.size(); ++g) visit(g);
  }

 private:
  constexpr void Join(const Single& diagonal) {
    for (Joined& term : joined) {
      if (term.output != diagonal.output || term.has_diagonal()) continue;
      if (term.first != diagonal.first && term.second != diagonal.first) continue;
      if (term.first != diagonal.first) std::swap(term.first, term.second);
      term.diagonal = diagonal.entry;
      return;
    }
    joined.push_back({diagonal.output, diagonal.first, diagonal.first, Joined::kNone, diagonal.entry, 0});
  }
  constexpr std::size_t PairOf(std::size_t i, std::size_t l) {
    const Pair pair{std::min(i, l), std::max(i, l)};
    const auto found = std::find(pairs.begin(), pairs.end(), pair);
    if (found != pairs.end()) return static_cast<std::size_t>(found - pairs.begin());
    pairs.push_back(pair);
    return pairs.size() - 1;
  }
};

/** The same for a program that is a constant: each visit is inlined, with a constant index. */
template <const Program& kProgram>
class ConstantTerms {
  static constexpr std::size_t kNumSingle = RemainderTerms(kProgram).single.size(),
                               kNumJoined = RemainderTerms(kProgram).joined.size(),
                               kNumPairs = RemainderTerms(kProgram).pairs.size();
  template <std::size_t N, class List>
  static constexpr auto Fixed(const List& list) {
    std::array<typename List::value_type, N> fixed{};
    for (std::size_t i = 0; i < N; ++i) fixed[i] = list[i];
    return fixed;
  }

 public:
  static constexpr std::size_t states = ToSize(kProgram.states), kMaxPairs = kNumPairs;
  static constexpr auto single = Fixed<kNumSingle>(RemainderTerms(kProgram).single);
  static constexpr auto joined = Fixed<kNumJoined>(RemainderTerms(kProgram).joined);
  static constexpr auto pairs = Fixed<kNumPairs>(RemainderTerms(kProgram).pairs);

  template <class Visit>
  FOREREACH_INLINE void ForEachSingle(Visit visit) const {
    ForEachConstant<kNumSingle>(visit);
  }
  template <class Visit>
  FOREREACH_INLINE void ForEachPair(Visit visit) const {
    ForEachConstant<kNumPairs>(visit);
  }
  template <class Visit>
  FOREREACH_INLINE void ForEachTwoPairs(Visit visit) const {
    ForEachConstant<(kNumPairs + 1) / 2>(visit);
  }
  template <class Visit>
  FOREREACH_INLINE void ForEachFourJoined(Visit visit) const {
    ForEachConstant<(kNumJoined + kLaneCount - 1) / kLaneCount>(visit);
  }
};

// kRemainderRelative exceeds the relative rounding error of the operations below, measured against the sum of the sizes
// of their terms. kRemainderTiny exceeds the error by underflow. Its product with a derivative is a normal number
// unless the derivative is tiny; processors multiply subnormal numbers slowly.
inline constexpr double kRemainderRelative = 0x1p-44, kRemainderTiny = 0x1p-1000;

inline double CountedError(double error) { return kCountsRounding ? error : 0; }

inline double Size(const PlainInterval& x) { return std::max(std::abs(x.lower), std::abs(x.upper)); }

// Stores a number for each state, and what is behind them up to a multiple of four.
template <class Terms>
FOREREACH_INLINE void StoreStates(const Terms& terms, const double (&numbers)[kMaxStates], double* to) {
  for (std::size_t k = 0; k < terms.states; k += kLaneCount) StoreLanes(LoadLanes(numbers + k), to + k);
}

template <class Terms>
FOREREACH_INLINE void EncloseSizes(const Terms& terms, const double* half_width, const PlainInterval* hessian,
                                   const double* error, Remainder& out) {
  double sums[kMaxStates] = {};
  terms.ForEachSingle([&](auto i) __attribute__((always_inline)) {
    const RemainderTerms::Single term = terms.single[i];
    const double weight = term.first == term.second ? 0.5 : 1;
    const double r = half_width[term.first], other = half_width[term.second];
    if (r == 0 || other == 0) return;  // exactly zero
    sums[term.output] += weight * Size(hessian[term.entry]) * (r * other + kRemainderTiny) * (1 + kRemainderRelative) +
                         CountedError(error[term.entry]);
  });
  constexpr double kZeros[kMaxStates] = {};
  StoreStates(terms, kZeros, out.center.data());
  StoreStates(terms, sums, out.half_width.data());
}

// The ends P, N of d_i d_l in [-N, P] for each pair of variables: P_0, N_0, P_1, N_1, ...
template <class Terms>
using ProductEnds = std::array<double, PaddedToLanes(2 * Terms::kMaxPairs)>;

template <class Terms>
FOREREACH_INLINE void EncloseProducts(const Terms& terms, const Zonotope& slice, const double* half_width,
                                      ProductEnds<Terms>& ends) {
  std::array<Lanes, PaddedToLanes(2 * Terms::kMaxPairs)> sums;
  const auto clear = [&](auto g) __attribute__((always_inline)) {
    for (std::size_t i = 0; i < kLaneCount; ++i) sums[4 * g + i] = AllLanes(0);
  };
  terms.ForEachTwoPairs(clear);
  for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount)
    terms.ForEachPair([&](auto p) __attribute__((always_inline)) {
      const RemainderTerms::Pair pair = terms.pairs[p];
      const auto row = [&](std::size_t k) { return slice.padded_row(static_cast<int>(k)).data() + j; };
      const Lanes a = LoadLanes(row(pair.first)) * AllLanes(half_width[pair.second]);
      const Lanes b = LoadLanes(row(pair.second)) * AllLanes(half_width[pair.first]);
      sums[2 * p] += Abs(a + b);
      sums[2 * p + 1] += Abs(a - b);
    });
  terms.ForEachTwoPairs([&](auto g) __attribute__((always_inline)) {
    const RemainderTerms::Pair one = terms.pairs[2 * g], two = terms.pairs[std::min(2 * g + 1, terms.pairs.size() - 1)];
    const double *r = half_width, *s = slice.slacks();
    const Lanes r_i{r[one.first], r[one.first], r[two.first], r[two.first]};
    const Lanes r_l{r[one.second], r[one.second], r[two.second], r[two.second]};
    const Lanes s_i{s[one.first], s[one.first], s[two.first], s[two.first]};
    const Lanes s_l{s[one.second], s[one.second], s[two.second], s[two.second]};
    const Lanes product = r_i * r_l, quarter = AllLanes(0.25) / product;
    const Lanes sum = SumEach(sums[4 * g], sums[4 * g + 1], sums[4 * g + 2], sums[4 * g + 3]) + (s_i * r_l + s_l * r_i);
    const LaneMask fits =
        (product > AllLanes(0x1p-400)) & (product < AllLanes(0x1p400));  // otherwise a factor could underflow
    StoreLanes(fits ? Min(product, sum * sum * quarter) : product, &ends[4 * g]);
  });
}

// max over 0 <= s <= r of 1/2 a s^2 + h t s, with h and t >= 0. Multiplies by a and h last, so that an underflow before
// is scaled like the margin that covers it.
FOREREACH_INLINE Lanes Peak(const Lanes& a, const Lanes& h, const Lanes& t, const Lanes& r) {
  const Lanes slope = h * t, top = slope / -a, s = -a * r > slope ? top : r;
  return a * (s * s * AllLanes(0.5)) + h * (t * s);
}

// get(term) of the joined terms first .. first + 3, and zero behind the last term.
template <class Terms, class Get>
FOREREACH_INLINE Lanes FourTerms(const Terms& terms, std::size_t first, Get get) {
  const auto at = [&](std::size_t i) __attribute__((always_inline)) {
    return i < terms.joined.size() ? get(terms.joined[i]) : 0.0;
  };
  return Lanes{at(first), at(first + 1), at(first + 2), at(first + 3)};
}

// The ranges of four joined terms 1/2 a d_i^2 + h d_i d_l, and bounds on their rounding errors.
struct TermRanges {
  Lanes lower, upper, rounding;
};

template <class Terms>
FOREREACH_INLINE TermRanges EncloseTerms(const Terms& terms, std::size_t first, const double* half_width,
                                         const PlainInterval* hessian, const double* error, const double* products) {
  const auto each = [&](auto get) __attribute__((always_inline)) { return FourTerms(terms, first, get); };
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

template <class Terms>
FOREREACH_INLINE void EncloseCentred(const Terms& terms, const Zonotope& slice, const double* half_width,
                                     const PlainInterval* hessian, const double* error, Remainder& out) {
  ProductEnds<Terms> products;
  EncloseProducts(terms, slice, half_width, products);
  double lower[kMaxStates] = {}, upper[kMaxStates] = {}, rounding[kMaxStates] = {};
  terms.ForEachFourJoined([&](auto g) __attribute__((always_inline)) {
    const std::size_t first = g * kLaneCount;
    const TermRanges ranges = EncloseTerms(terms, first, half_width, hessian, error, products.data());
    ForEachConstant<kLaneCount>([&](auto constant) __attribute__((always_inline)) {
      constexpr std::size_t kLane = constant;
      if (first + kLane >= terms.joined.size()) return;
      const std::size_t output = terms.joined[first + kLane].output;
      lower[output] += ranges.lower[kLane];
      upper[output] += ranges.upper[kLane];
      rounding[output] += ranges.rounding[kLane];
    });
  });
  for (std::size_t k = 0; k < terms.states; k += kLaneCount) {
    const Lanes low = LoadLanes(lower + k), high = LoadLanes(upper + k);
    StoreLanes((low + high) * AllLanes(0.5), out.center.data() + k);
    StoreLanes((high - low) * AllLanes(0.5) + LoadLanes(rounding + k), out.half_width.data() + k);
  }
}

/** NominalModel::EncloseRemainder: |rho_k(d) - out.center_k| <= out.half_width_k for every d and H_k as above, in real
arithmetic. If an entry of `hessian` is not finite, neither is the half-width of its output, unless one of its two
variables is a point. @param terms RemainderTerms or ConstantTerms of the program. @param half_width r, n entries:
inputs are points. @param hessian in the order of the program's. @param error of each term, StepError::remainder. Cost
O(second derivatives * m). */
template <class Terms>
FOREREACH_INLINE void EncloseBy(const Terms& terms, Method method, const Zonotope& slice, const double* half_width,
                                const PlainInterval* hessian, const double* error, Remainder& out) {
  switch (method) {
    case Method::kPaper: return EncloseSizes(terms, half_width, hessian, error, out);
    case Method::kCentred: return EncloseCentred(terms, slice, half_width, hessian, error, out);
  }
  out.half_width.fill(kInfinity);  // no method: no bound
}

template <const Program& kProgram>
FOREREACH_INLINE void EncloseConstant(Method method, const Zonotope& slice, const double* half_width,
                                      const PlainInterval* hessian, const double* error, Remainder& out) {
  EncloseBy(ConstantTerms<kProgram>(), method, slice, half_width, hessian, error, out);
}

}  // namespace forereach::internal

FOREREACH_ARITHMETIC_END
