/** The distances D_i of a query set to the observations, Eq. (zonotope-set-distance), eight at a time, for the search
over an ObservationIndex (search.h). Each is a template over the type of eight in registers, P: Pack or WidePack.

A metric has
- coordinates(): those of an observation in this row;
- common(): the part of D_i that is the same for every observation;
- Block(block): D_i - common() for the eight observations of a block;
- Node(node, side): for each child, an upper bound on v_i - (D_i - common()) over the observations below it;
- kRefines: if true, Block gives a lower bound of D_i - common(), and Refine(block, lane, ...) gives the value.

All arithmetic is plain. The bounds of Node include a margin for its error, so they are never below a value computed for
an observation. Only lipschitz_envelope.cpp includes this file: every function must be inlined into an entry point that
is compiled for one instruction set. */
#pragma once

#include <algorithm>
#include <bit>
#include <span>

#include "forereach/numerics/lanes.h"
#include "forereach/numerics/size.h"
#include "forereach/residual/enclosure.h"
#include "forereach/residual/lipschitz_row.h"
#include "forereach/sets/zonotope.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace forereach::internal {

inline constexpr std::size_t kMaxChunks = kMaxGenerators / kPackSize;
static_assert(kMaxGenerators % kPackSize == 0, "the last eight of a row can be read");
alignas(64) inline constexpr std::array<double, kMaxGenerators> kNoGenerators{};

/** One variable of the query set Z_t = (<c, G> + [-s, s]) x {u}. An input has neither generators nor slack. */
struct Variable {
  double center, slack, half_width;
  const double* generators;

  Variable(const QuerySet& set, int l) {
    const int n = set.slice.dim();
    const bool is_state = l < n;
    center = is_state ? set.slice.center(l) : set.input[ToSize(l - n)];
    slack = is_state ? set.slice.slack(l) : 0;
    half_width = is_state ? set.half_width[ToSize(l)] : 0;
    generators = is_state ? set.slice.padded_row(l).data() : kNoGenerators.data();
  }
};

/** Reads a row of generators, eight at a time. Entries behind the last generator are zero. */
template <class P>
class Chunks {
 public:
  explicit Chunks(const Zonotope& slice) : padded_(slice.padded_size()) {}
  [[nodiscard]] std::size_t size() const { return (padded_ + kLaneCount) / kPackSize; }
  [[nodiscard]] FOREREACH_INLINE P Get(const double* row, std::size_t chunk) const {
    const std::size_t first = chunk * kPackSize;
    if (first + kPackSize <= padded_) return Packs<P>::Load(row + first);
    return Packs<P>::Join(LoadLanes(row + first), AllLanes(0));
  }

 private:
  std::size_t padded_;  // a multiple of four
};

/** The distance of x to each of eight intervals; zero inside. */
template <class P>
FOREREACH_INLINE P Gap(const P& lowest, const P& highest, const P& x) {
  return Max(Max(lowest - x, x - highest), P(Packs<P>::Fill(0)));
}

/** Rows with one to three columns: D_i = max_s (|A_s - alpha_is| + w_s), A_s = sum_l s_l L_kl c_l and
w_s = sum_j |sum_l s_l L_kl G_lj| + sum_l L_kl s_l, common = w_0. */
template <std::size_t kColumns, class P>
class PatternMetric {
  using Eights = Packs<P>;

 public:
  static constexpr bool kRefines = false;
  using InRegisters = P;

  /** @param margin at least twice the error bound of plain arithmetic in this row. */
  PatternMetric(const LipschitzRow& row, const QuerySet& set, double margin) {
    std::array<double, kColumns> weighted;
    std::array<typename Eights::Equal, kColumns> slope;
    std::array<const double*, kColumns> generators;
    double slack = 0;
    for (std::size_t l = 0; l < kColumns; ++l) {
      const LipschitzRow::Column& column = row.columns()[l];
      const Variable variable(set, column.variable);
      weighted[l] = column.slope * variable.center;
      slack += column.slope * variable.slack;
      slope[l] = Eights::Fill(column.slope);
      generators[l] = variable.generators;
    }
    std::array<P, kPatterns> spread;
    spread.fill(Eights::Fill(0));
    const Chunks<P> chunks(set.slice);
    for (std::size_t j = 0; j < chunks.size(); ++j) {
      std::array<P, kColumns> term;
      for (std::size_t l = 0; l < kColumns; ++l) term[l] = slope[l] * chunks.Get(generators[l], j);
      for (std::size_t s = 0; s < kPatterns; ++s) spread[s] = spread[s] + Abs(Signed(s, term));
    }
    const auto lanes = [](auto get) __attribute__((always_inline)) {  // a pattern in each
      const auto at = [&](std::size_t s) __attribute__((always_inline)) { return get(std::min(s, kPatterns - 1)); };
      return std::array{at(0), at(1), at(2), at(3)};
    };
    const auto sums =
        lanes([&](std::size_t s) __attribute__((always_inline)) { return Low(spread[s]) + High(spread[s]); });
    const auto centers = lanes([&](std::size_t s) { return Signed(s, weighted); });
    const Lanes spreads = SumEach(sums[0], sums[1], sums[2], sums[3]) + AllLanes(slack);
    common_ = spreads[0];
    const Lanes center{centers[0], centers[1], centers[2], centers[3]}, extra = spreads - AllLanes(common_);
    const Lanes below = center - extra + AllLanes(margin), above = -center - extra + AllLanes(margin);
    Lanes farthest = AllLanes(0);
    for (std::size_t s = 0; s < kPatterns; ++s) {
      center_[s] = Eights::Fill(center[s]);
      extra_[s] = Eights::Fill(extra[s]);
      from_below_[s] = Eights::Fill(below[s]);
      from_above_[s] = Eights::Fill(above[s]);
      farthest = Max(farthest, AllLanes(extra[s]));
    }
    anywhere_ = Eights::Repeat(AllLanes(margin) - farthest);
  }

  [[nodiscard]] static constexpr std::size_t coordinates() { return kPatterns; }
  [[nodiscard]] double common() const { return common_; }

  [[nodiscard]] FOREREACH_INLINE P Block(const Pack* block) const {
    P distance = Abs(center_[0] - Eights::Load(block[0]));
    for (std::size_t s = 1; s < kPatterns; ++s)
      distance = Max(distance, Abs(center_[s] - Eights::Load(block[s])) + extra_[s]);
    return distance;
  }

  [[nodiscard]] FOREREACH_INLINE P Node(const Pack* node, std::size_t side) const {
    node += side * (2 * kPatterns + 1);
    P bound = Eights::Load(node[2 * kPatterns]) + anywhere_;
    for (std::size_t s = 0; s < kPatterns; ++s)
      bound =
          Min(bound, Min(Eights::Load(node[2 * s]) + from_below_[s], Eights::Load(node[2 * s + 1]) + from_above_[s]));
    return bound;
  }

 private:
  static constexpr std::size_t kPatterns = std::size_t{1} << (kColumns - 1);

  template <class T>
  FOREREACH_INLINE static T Signed(std::size_t s, const std::array<T, kColumns>& terms) {
    T sum = terms[kColumns - 1];
    for (std::size_t l = 0; l + 1 < kColumns; ++l)
      sum = LipschitzRow::IsNegative(s, l) ? sum - terms[l] : sum + terms[l];
    return sum;
  }

  double common_;
  using Equal = typename Eights::Equal;
  std::array<Equal, kPatterns> center_, extra_;           // A_s, w_s - w_0
  std::array<Equal, kPatterns> from_below_, from_above_;  // A_s - extra_s and -A_s - extra_s, plus the margin
  Equal anywhere_;                                        // the margin - max_s extra_s
};

/** d_i = sum_l L_kl |c_l - z_il| in any number of columns. */
template <class P>
class CenterDistance {
 public:
  using InRegisters = P;
  using Eights = Packs<P>;

  CenterDistance(const LipschitzRow& row, const QuerySet& set) : columns_(row.columns().size()) {
    for (std::size_t l = 0; l < columns_; ++l) {
      const LipschitzRow::Column& column = row.columns()[l];
      center_[l] = Eights::Fill(column.slope * Variable(set, column.variable).center);
    }
  }

  [[nodiscard]] std::size_t columns() const { return columns_; }
  [[nodiscard]] std::size_t coordinates() const { return columns_; }
  /** L_kl (c_l - z_il) of one observation. */
  [[nodiscard]] double Component(const Pack* block, std::size_t lane, std::size_t l) const {
    return center_[l].all[0] - block[l].at(lane);
  }

  [[nodiscard]] FOREREACH_INLINE P Block(const Pack* block) const {
    P distance = Abs(center_[0] - Eights::Load(block[0]));
    for (std::size_t l = 1; l < columns_; ++l) distance = distance + Abs(center_[l] - Eights::Load(block[l]));
    return distance;
  }

  /** An upper bound on v_i - d_i, without a margin for rounding. */
  [[nodiscard]] FOREREACH_INLINE P Node(const Pack* node, std::size_t side) const {
    P bound = Eights::Load(node[side]);
    for (std::size_t l = 0; l < columns_; ++l)
      bound = bound - Gap<P>(Eights::Load(node[2 + 2 * l]), Eights::Load(node[3 + 2 * l]), center_[l]);
    return bound;
  }

 private:
  std::size_t columns_;
  std::array<typename Eights::Equal, kMaxVariables> center_;
};

/** Rows with too many columns for signs, over the interval hull: D_i = d_i + sum_l L_kl r_l, common = the sum. */
template <class P>
class HullMetric : public CenterDistance<P> {
  using Eights = Packs<P>;

 public:
  static constexpr bool kRefines = false;

  HullMetric(const LipschitzRow& row, const QuerySet& set, double margin)
      : CenterDistance<P>(row, set), margin_(Eights::Fill(margin)) {
    for (const LipschitzRow::Column& column : row.columns())
      common_ += column.slope * Variable(set, column.variable).half_width;
  }
  [[nodiscard]] double common() const { return common_; }
  [[nodiscard]] FOREREACH_INLINE P Node(const Pack* node, std::size_t side) const {
    return CenterDistance<P>::Node(node, side) + margin_;
  }

 private:
  double common_ = 0;
  typename Eights::Equal margin_;
};

/** Rows in between: Block and Node give d_i + a lower bound of the spreads w_s, which is not above D_i, and Refine
gives D_i = max_s |sum_l s_l v_il| + w_s, v_il = L_kl (c_l - z_il). Over all z in the hull, z_l - z_il has one sign
where |c_l - z_il| >= r_l: there the maximum has that sign, and only the signs of the other columns are tried. */
template <class P>
class SignMetric : public CenterDistance<P> {
  using Eights = Packs<P>;

 public:
  using CenterDistance<P>::columns, CenterDistance<P>::Component;
  static constexpr bool kRefines = true;
  static constexpr std::size_t kMaxColumns = 12;

  /** @param margin as PatternMetric's. @param errors for each column, at least the error of L_kl r_l plus that of
  v_il. */
  SignMetric(const LipschitzRow& row, const QuerySet& set, double margin, std::span<const double> errors)
      : CenterDistance<P>(row, set), chunks_(Chunks<P>(set.slice).size()) {
    const Chunks<P> chunks(set.slice);
    for (std::size_t l = 0; l < columns(); ++l) {
      const LipschitzRow::Column& column = row.columns()[l];
      const Variable variable(set, column.variable);
      reach_[l] = column.slope * variable.half_width + errors[l];
      hull_ += reach_[l];
      slack_ += column.slope * variable.slack;
      for (std::size_t j = 0; j < chunks_; ++j)
        weighted_[l][j] = Eights::Fill(column.slope) * chunks.Get(variable.generators, j);
    }
    least_ = Eights::Fill(LeastSpread() + slack_ - margin);
  }

  [[nodiscard]] double common() const { return 0; }
  [[nodiscard]] FOREREACH_INLINE P Block(const Pack* block) const { return CenterDistance<P>::Block(block) + least_; }
  [[nodiscard]] FOREREACH_INLINE P Node(const Pack* node, std::size_t side) const {
    return CenterDistance<P>::Node(node, side) - least_;
  }

  /** D_i of one observation, by 2^f patterns for f columns with a free sign. If `patterns` does not allow that many, it
  sets `capped` and returns the larger distance over the hull. */
  [[nodiscard]] double Refine(const Pack* block, std::size_t lane, int& patterns, bool& capped) const {
    Signs signs;
    signs.sums[0] = 0;
    for (std::size_t j = 0; j < chunks_; ++j) signs.along[0][j] = Eights::Fill(0);
    std::size_t free = 0, fixed = 0;
    for (std::size_t l = 0; l < columns(); ++l) {
      const double component = Component(block, lane, l);
      if (std::abs(component) > reach_[l])
        Extend(signs, 0, 0, l, component, std::copysign(1, component)), ++fixed;
      else
        signs.free[free] = l, signs.components[free++] = component;
    }
    if (fixed == 0 && free > 0)
      --free, Extend(signs, 0, 0, signs.free[free], signs.components[free], 1);  // s and -s give the same value
    if (patterns < 1 << free) {
      capped = true;
      double distance = hull_;
      for (std::size_t l = 0; l < columns(); ++l) distance += std::abs(Component(block, lane, l));
      return distance;
    }
    patterns -= 1 << free;
    return Farthest(signs, free);
  }

 private:
  // Depth t holds the sums over the fixed columns and the first t free ones, under the pattern being tried.
  struct Signs {
    std::array<std::size_t, kMaxColumns> free;
    std::array<double, kMaxColumns> components;
    std::array<double, kMaxColumns + 1> sums;
    std::array<std::array<P, kMaxChunks>, kMaxColumns + 1> along;
  };

  // Multiplies by the sign: a branch would be mispredicted half the time, and the product is exact.
  void Extend(Signs& signs, std::size_t from, std::size_t to, std::size_t l, double component, double sign) const {
    signs.sums[to] = signs.sums[from] + sign * component;
    const auto same = Eights::Fill(sign);
    for (std::size_t j = 0; j < chunks_; ++j) signs.along[to][j] = signs.along[from][j] + same * weighted_[l][j];
  }

  // Counts through the patterns. The last column changes fastest, so few sums are computed again.
  double Farthest(Signs& signs, std::size_t free) const {
    double farthest = 0;
    for (std::size_t pattern = 0; pattern < std::size_t{1} << free; ++pattern) {
      const auto same = pattern == 0 ? 0 : free - 1 - ToSize(std::countr_zero(pattern));
      for (std::size_t t = same; t < free; ++t)
        Extend(signs, t, t + 1, signs.free[t], signs.components[t], pattern >> (free - 1 - t) & 1 ? -1 : 1);
      P spread = Eights::Fill(0);
      for (std::size_t j = 0; j < chunks_; ++j) spread = spread + Abs(signs.along[free][j]);
      farthest = Max(farthest, std::abs(signs.sums[free]) + (SumLanes(spread) + slack_));
    }
    return farthest;
  }

  // |sum_l s_l g_l| >= 2 max_l |g_l| - sum_l |g_l|, for each generator.
  double LeastSpread() const {
    P least = Eights::Fill(0);
    for (std::size_t j = 0; j < chunks_; ++j) {
      P sum = Eights::Fill(0), largest = Eights::Fill(0);
      for (std::size_t l = 0; l < columns(); ++l) {
        const P term = Abs(weighted_[l][j]);
        sum = sum + term;
        largest = Max(largest, term);
      }
      least = least + Max(largest + largest - sum, P(Eights::Fill(0)));
    }
    return SumLanes(least);
  }

  std::size_t chunks_;
  double hull_ = 0, slack_ = 0;
  typename Eights::Equal least_;
  std::array<double, kMaxColumns> reach_;
  std::array<std::array<P, kMaxChunks>, kMaxColumns> weighted_;
};

}  // namespace forereach::internal

#pragma GCC diagnostic pop
