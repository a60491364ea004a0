/** The nonlinear Taylor remainder of one step: rho_k(d) = 1/2 d^T H_k d with d = z - c_Z, for all z in the query and all H
in the interval Hessian over its hull. As straight-line code for a program that is known at compile time. */
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "certifier/dynamics/expansion.h"
#include "certifier/numerics/directed.h"
#include "certifier/numerics/lanes.h"
#include "certifier/sets/zonotope.h"

namespace forereach {

/** How the remainder is bounded.
kPaper: |rho_k| <= 1/2 r^T B_k r, Eq. (qt-formula), with B_k the largest absolute values of the Hessian.
kCentred: rho_k in [lower, upper], whose middle moves the center. A diagonal term has d_i^2 in [0, r_i^2]. A mixed
  product lies in [-N, P],  P, N = (sum_j |g_ij / r_i +- g_lj / r_l|)^2 r_i r_l / 4,  since d_i d_l is a quarter of
  the difference of two squares; correlated generators make one of them small. Where a diagonal term and a mixed one
  share a variable, a second bound is the exact range of 1/2 a s^2 + b s t over |s| <= r_i, |t| <= r_l, which their sum
  overestimates; the better of the two counts. Never wider than kPaper, and as sound. */
enum class Method { kPaper, kCentred };

/** rho_k lies in center_k +- half_width_k. Zero where f0_k is affine. */
struct Remainder {
  std::array<double, kMaxStates> center, half_width;
};

namespace internal {

/** The second derivatives of states, as the remainder takes them: an input is a point, d = 0. */
struct RemainderTerms {
  // A second derivative, or, for kCentred, a mixed one together with a diagonal one of its first variable.
  struct Term {
    std::size_t output = 0, first = 0, second = 0, entry = 0;
    bool has_diagonal = false;
    std::size_t diagonal = 0;  // entry of (first, first)
    std::size_t pair = 0;      // of a mixed one: which of `pairs`
    [[nodiscard]] constexpr bool is_mixed() const { return first != second; }
  };
  // Two variables whose product occurs, in one output or more.
  struct Pair {
    std::size_t first = 0, second = 0;
  };
  std::array<Term, Program::kMaxSecond> single{}, joined{};
  std::size_t num_single = 0, num_joined = 0;
  std::array<Pair, Program::kMaxSecond> pairs{};
  std::size_t num_pairs = 0;

  constexpr explicit RemainderTerms(const Program& program) {
    for (int e = 0; e < program.num_second; ++e) {
      const Program::Second& entry = program.hessian[static_cast<std::size_t>(e)];
      if (entry.row >= program.states || entry.column >= program.states) continue;
      single[num_single++] = {static_cast<std::size_t>(entry.output), static_cast<std::size_t>(entry.row),
                              static_cast<std::size_t>(entry.column), static_cast<std::size_t>(e)};
    }
    for (std::size_t i = 0; i < num_single; ++i)
      if (single[i].is_mixed()) joined[num_joined++] = single[i];
    for (std::size_t i = 0; i < num_single; ++i)
      if (!single[i].is_mixed()) Join(single[i]);
    for (std::size_t i = 0; i < num_joined; ++i)
      if (joined[i].is_mixed()) joined[i].pair = PairOf(joined[i]);
  }

 private:
  constexpr void Join(const Term& diagonal) {
    for (std::size_t i = 0; i < num_joined; ++i) {
      Term& term = joined[i];
      if (term.output != diagonal.output || !term.is_mixed() || term.has_diagonal) continue;
      if (term.first != diagonal.first && term.second != diagonal.first) continue;
      if (term.first != diagonal.first) std::swap(term.first, term.second);
      term.has_diagonal = true;
      term.diagonal = diagonal.entry;
      return;
    }
    joined[num_joined++] = diagonal;
  }
  constexpr std::size_t PairOf(const Term& term) {
    const Pair pair{std::min(term.first, term.second), std::max(term.first, term.second)};
    std::size_t p = 0;
    while (p < num_pairs && (pairs[p].first != pair.first || pairs[p].second != pair.second)) ++p;
    if (p == num_pairs) pairs[num_pairs++] = pair;
    return p;
  }
};

template <const Program& kProgram>
inline constexpr RemainderTerms kRemainderTerms{kProgram};

// Above all relative rounding of the few operations below, whose results are compared with the sum of their terms' sizes.
inline constexpr double kRemainderRelative = 0x1p-44, kRemainderTiny = 0x1p-1060;

inline double CountedError(double error) { return kCountsRounding ? error : 0; }

inline double Size(const PlainInterval& x) { return std::max(std::abs(x.lower), std::abs(x.upper)); }

// [lower, upper] of a term, and the sum of the sizes it was made of.
struct TermRange {
  double lower, upper, size;
};

inline TermRange Diagonal(const PlainInterval& h, double r) {
  const double half_square = r * r / 2;
  return {half_square * std::min(0.0, h.lower), half_square * std::max(0.0, h.upper), half_square * Size(h)};
}

// max over 0 <= s <= r of 1/2 a s^2 + b s, b >= 0.
inline double Peak(double a, double b, double r) {
  return -a * r > b ? b * (b / (-2 * a)) : std::max(0.0, (a * r / 2 + b) * r);
}

// d_i d_l in [-negative, positive].
struct ProductRange {
  double negative, positive;
};

FOREREACH_INLINE ProductRange MixedProduct(const Zonotope& slice, std::size_t i, std::size_t l, double r_i, double r_l) {
  const double product = r_i * r_l;
  if (!(product > 0x1p-400)) return {product, product};  // the squares below could underflow
  const double* g_i = slice.padded_row(static_cast<int>(i)).data();
  const double* g_l = slice.padded_row(static_cast<int>(l)).data();
  Lanes sum = AllLanes(0), difference = AllLanes(0);
  for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount) {
    const Lanes a = LoadLanes(g_i + j) * AllLanes(r_l), b = LoadLanes(g_l + j) * AllLanes(r_i);
    sum += Abs(a + b);
    difference += Abs(a - b);
  }
  const double slack = slice.slack(static_cast<int>(i)) * r_l + slice.slack(static_cast<int>(l)) * r_i;
  const double plus = Sum(sum) + slack, minus = Sum(difference) + slack;
  return {std::min(product, minus * minus / (4 * product)), std::min(product, plus * plus / (4 * product))};
}

inline TermRange Mixed(const PlainInterval& h, const ProductRange& d, double product) {
  return {std::min(std::min(h.lower * d.positive, h.upper * d.positive), std::min(-h.lower * d.negative, -h.upper * d.negative)),
          std::max(std::max(h.lower * d.positive, h.upper * d.positive), std::max(-h.lower * d.negative, -h.upper * d.negative)),
          Size(h) * product};
}

template <const Program& kProgram>
FOREREACH_INLINE void EncloseSizes(const double* half_width, const PlainInterval* hessian, const double* error,
                                   Remainder& out) {
  std::array<double, static_cast<std::size_t>(kProgram.states)> sums{};
  ForEachConstant<kRemainderTerms<kProgram>.num_single>([&](auto i) __attribute__((always_inline)) {
    constexpr RemainderTerms::Term kTerm = kRemainderTerms<kProgram>.single[i];
    const double weight = kTerm.is_mixed() ? 1 : 0.5, r = half_width[kTerm.first], other = half_width[kTerm.second];
    if (r == 0 || other == 0) return;  // exactly zero
    sums[kTerm.output] += weight * Size(hessian[kTerm.entry]) * (r * other + kRemainderTiny) * (1 + kRemainderRelative) +
                          CountedError(error[kTerm.entry]);
  });
  ForEachConstant<sums.size()>([&](auto k) __attribute__((always_inline)) {
    out.center[k] = 0;
    out.half_width[k] = sums[k];
  });
}

template <const Program& kProgram>
FOREREACH_INLINE void EncloseCentred(const Zonotope& slice, const double* half_width, const PlainInterval* hessian,
                                     const double* error, Remainder& out) {
  constexpr const RemainderTerms& kTerms = kRemainderTerms<kProgram>;
  struct Sums {
    double lower = 0, upper = 0, size = 0, margin = 0;
  };
  std::array<Sums, static_cast<std::size_t>(kProgram.states)> sums;
  std::array<ProductRange, kTerms.num_pairs> products;
  ForEachConstant<kTerms.num_pairs>([&](auto p) __attribute__((always_inline)) {
    constexpr RemainderTerms::Pair kPair = kRemainderTerms<kProgram>.pairs[p];
    products[p] = MixedProduct(slice, kPair.first, kPair.second, half_width[kPair.first], half_width[kPair.second]);
  });
  ForEachConstant<kTerms.num_joined>([&](auto i) __attribute__((always_inline)) {
    constexpr RemainderTerms::Term kTerm = kRemainderTerms<kProgram>.joined[i];
    const double r = half_width[kTerm.first], other = half_width[kTerm.second];
    const PlainInterval &h = hessian[kTerm.entry], &a = hessian[kTerm.diagonal];
    Sums& sum = sums[kTerm.output];
    TermRange range{0, 0, 0};
    if (r == 0) return;  // exactly zero, and so is the mixed term where `other` is
    if (other != 0) {
      if constexpr (kTerm.is_mixed())
        range = Mixed(h, products[kTerm.pair], r * other);
      else
        range = Diagonal(h, r);
      sum.margin += CountedError(error[kTerm.entry]) + kRemainderTiny * Size(h);
    }
    if constexpr (kTerm.has_diagonal) {
      const TermRange diagonal = Diagonal(a, r);
      const double slope = other == 0 ? 0 : Size(h) * other;
      range = {std::max(range.lower + diagonal.lower, -Peak(-a.lower, slope, r)),
               std::min(range.upper + diagonal.upper, Peak(a.upper, slope, r)), range.size + diagonal.size};
      sum.margin += CountedError(error[kTerm.diagonal]) + kRemainderTiny * Size(a);
    }
    sum.lower += range.lower;
    sum.upper += range.upper;
    sum.size += range.size;
  });
  ForEachConstant<sums.size()>([&](auto k) __attribute__((always_inline)) {
    const auto& [lower, upper, size, margin] = sums[k];
    const double rounding = RoundingError(kRemainderRelative, size) + margin * (1 + kRemainderRelative);
    out.center[k] = (lower + upper) / 2;
    out.half_width[k] = (upper - lower) / 2 + rounding;
  });
}

template <const Program& kProgram>
FOREREACH_INLINE void EncloseBy(Method method, const Zonotope& slice, const double* half_width,
                                const PlainInterval* hessian, const double* error, Remainder& out) {
  if (method == Method::kPaper)
    EncloseSizes<kProgram>(half_width, hessian, error, out);
  else
    EncloseCentred<kProgram>(slice, half_width, hessian, error, out);
}

template <const Program& kProgram>
FOREREACH_AVX2 void EncloseRemainderAvx2(Method method, const Zonotope& slice, const double* half_width,
                                         const PlainInterval* hessian, const double* error, Remainder& out) {
  EncloseBy<kProgram>(method, slice, half_width, hessian, error, out);
}
template <const Program& kProgram>
FOREREACH_FLATTEN void EncloseRemainderBaseline(Method method, const Zonotope& slice, const double* half_width,
                                                const PlainInterval* hessian, const double* error, Remainder& out) {
  EncloseBy<kProgram>(method, slice, half_width, hessian, error, out);
}

}  // namespace internal

/** @param half_width r, n entries: inputs are points. @param hessian in the order of the program's.
@param error of each term, StepError::remainder.
Rounding is included. An entry that is not finite gives a half-width that is not. Cost O(second derivatives * m). */
template <const Program& kProgram>
void EncloseRemainder(Method method, const Zonotope& slice, const double* half_width, const PlainInterval* hessian,
                      const double* error, Remainder& out) noexcept {
  const auto enclose = active_instruction_set == InstructionSet::kAvx2 ? internal::EncloseRemainderAvx2<kProgram>
                                                                       : internal::EncloseRemainderBaseline<kProgram>;
  enclose(method, slice, half_width, hessian, error, out);
}

}  // namespace forereach
