/** The linear part of a step: the image of a slice's generators under the Jacobian, as straight-line code for a program
that is known at compile time. One pass over the generators, four at a time, also finds what the next step needs. */
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "certifier/dynamics/expansion.h"
#include "certifier/dynamics/rounding.h"
#include "certifier/numerics/lanes.h"
#include "certifier/sets/zonotope.h"

namespace forereach {

/** What is known of an image beside its generators. */
struct ImageSums {
  std::array<double, kMaxStates> row;  ///< sum_j |(J G)_kj|, plain
  ColumnScores scores;
};

namespace internal {

/** The states' part of row k of the Jacobian: entries first .. first + count - 1 of the program's. */
struct RowSpan {
  int first = 0, count = 0;
};

template <const Program& kProgram>
constexpr RowSpan RowOf(int k) {
  RowSpan row;
  for (int e = 0; e < kProgram.num_first; ++e) {
    const Program::First& entry = kProgram.jacobian[static_cast<std::size_t>(e)];
    if (entry.row != k || entry.column >= kProgram.states) continue;
    if (row.count++ == 0) row.first = e;
  }
  return row;
}

template <const Program& kProgram, std::size_t E>
FOREREACH_INLINE Lanes Weighted(const double* const* rows, std::size_t j, const Lanes* factors) {
  constexpr Program::First entry = kProgram.jacobian[E];
  const Lanes g = LoadLanes(rows[entry.column] + j);
  if constexpr (kProgram.IsOne(entry.node))
    return g;
  else
    return factors[E] * g;
}

template <const Program& kProgram, std::size_t K, std::size_t... E>
FOREREACH_INLINE Lanes RowImage(const double* const* rows, std::size_t j, const Lanes* factors,
                                std::index_sequence<E...>) {
  constexpr std::size_t kFirst = static_cast<std::size_t>(RowOf<kProgram>(static_cast<int>(K)).first);
  Lanes sum = AllLanes(0);
  bool first = true;
  ((sum = first ? Weighted<kProgram, kFirst + E>(rows, j, factors) : sum + Weighted<kProgram, kFirst + E>(rows, j, factors),
    first = false),
   ...);
  return sum;
}

/** Stores numbers four at a time, zeros behind the last. */
template <std::size_t N>
FOREREACH_INLINE void StoreAll(const double (&numbers)[N], double* to) {
  const auto at = [&](std::size_t i) __attribute__((always_inline)) { return i < N ? numbers[i] : 0.0; };
  for (std::size_t i = 0; i < N; i += kLaneCount) StoreLanes(Lanes{at(i), at(i + 1), at(i + 2), at(i + 3)}, to + i);
}

template <const Program& kProgram, std::size_t... K>
FOREREACH_INLINE void MapRows(const Expansion& expansion, const Zonotope& slice, Zonotope& next, ImageSums& sums,
                              std::index_sequence<K...>) {
  const double* const from[] = {slice.padded_row(static_cast<int>(K)).data()...};
  double* const to[] = {next.mutable_row(static_cast<int>(K))...};
  std::array<Lanes, Program::kMaxFirst> factors;
  for (std::size_t e = 0; e < static_cast<std::size_t>(kProgram.num_first); ++e) factors[e] = AllLanes(expansion.jacobian[e]);
  Lanes row_sums[sizeof...(K)] = {(static_cast<void>(K), AllLanes(0))...};
  for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount) {
    Lanes column_sum = AllLanes(0), largest = AllLanes(0);
    const auto row = [&]<std::size_t Row>(std::integral_constant<std::size_t, Row>) __attribute__((always_inline)) {
      const Lanes image = RowImage<kProgram, Row>(
          from, j, factors.data(),
          std::make_index_sequence<static_cast<std::size_t>(RowOf<kProgram>(static_cast<int>(Row)).count)>());
      StoreLanes(image, to[Row] + j);
      const Lanes size = Abs(image);
      row_sums[Row] += size;
      column_sum += size;
      largest = Max(largest, size);
    };
    (row(std::integral_constant<std::size_t, K>()), ...);
    sums.scores.Set(j, column_sum, largest);
  }
  sums.scores.Finish(static_cast<std::size_t>(slice.num_generators()));
  StoreAll({Sum(row_sums[K])...}, sums.row.data());
}

/** (|J| s)_k + image_k: an upper bound but for a relative 2^-44 of itself. */
template <const Program& kProgram, std::size_t K>
FOREREACH_INLINE double RowSlack(const Expansion& expansion, const StepError& error, const Zonotope& slice) {
  if constexpr (!kCountsRounding) return 0;
  constexpr RowSpan kRow = RowOf<kProgram>(static_cast<int>(K));
  double slack = error.image[K];
  const auto add = [&]<std::size_t E>(std::integral_constant<std::size_t, E>) __attribute__((always_inline)) {
    constexpr Program::First entry = kProgram.jacobian[static_cast<std::size_t>(kRow.first) + E];
    const double s = slice.slack(entry.column);
    if constexpr (kProgram.IsOne(entry.node))
      slack += s;
    else
      slack += std::abs(expansion.jacobian[static_cast<std::size_t>(kRow.first) + E]) * s;
  };
  [&]<std::size_t... E>(std::index_sequence<E...>) __attribute__((always_inline)) {
    (add(std::integral_constant<std::size_t, E>()), ...);
  }(std::make_index_sequence<static_cast<std::size_t>(kRow.count)>());
  return slack;
}

template <const Program& kProgram, std::size_t... K>
FOREREACH_INLINE void Map(const Expansion& expansion, const StepError& error, const Zonotope& slice,
                          Zonotope& next, ImageSums& sums, std::index_sequence<K...> rows) {
  next.Reset(slice.dim(), slice.num_generators());
  MapRows<kProgram>(expansion, slice, next, sums, rows);
  StoreAll({RowSlack<kProgram, K>(expansion, error, slice)...}, next.mutable_slacks());
}

template <const Program& kProgram>
FOREREACH_AVX2 void MapAvx2(const Expansion& expansion, const StepError& error, const Zonotope& slice,
                            Zonotope& next, ImageSums& sums) noexcept {
  Map<kProgram>(expansion, error, slice, next, sums,
                std::make_index_sequence<static_cast<std::size_t>(kProgram.states)>());
}
template <const Program& kProgram>
FOREREACH_FLATTEN void MapBaseline(const Expansion& expansion, const StepError& error, const Zonotope& slice,
                                   Zonotope& next, ImageSums& sums) noexcept {
  Map<kProgram>(expansion, error, slice, next, sums,
                std::make_index_sequence<static_cast<std::size_t>(kProgram.states)>());
}

}  // namespace internal

/** Sets the generators of `next` to fl(J G), J = expansion.jacobian, and its slack to |J| s + error.image, s the slice's
slack: a bound, but for a relative 2^-44, on what this leaves out, for every slice and matrix J' that `error` is for:
    |J' (G b + diag(s) b') - fl(J G) b| <= slack,   |b|_inf <= 1, |b'|_inf <= 1.
The center of `next` is left alone. */
template <const Program& kProgram>
void MapGenerators(const Expansion& expansion, const StepError& error, const Zonotope& slice,
                   Zonotope& next, ImageSums& sums) noexcept {
  if (active_instruction_set == InstructionSet::kAvx2)
    internal::MapAvx2<kProgram>(expansion, error, slice, next, sums);
  else
    internal::MapBaseline<kProgram>(expansion, error, slice, next, sums);
}

}  // namespace forereach
