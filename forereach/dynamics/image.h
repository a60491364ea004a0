/** The linear part of a step, Eq. (propagation): the generators fl(J G) of the image of a slice <c, G> + [-s, s] under
the Jacobian J, and a slack that covers rounding and s.

For a program that is a constant this is straight-line code, for one that was read from a text loops over its entries.
One pass over the generators, four at a
time, also computes the sums that the next step needs (ImageSums). */
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "forereach/dynamics/expansion.h"
#include "forereach/dynamics/rounding.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/size.h"
#include "forereach/sets/zonotope.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach::internal {

/** The states' part of row k of the Jacobian: entries first .. first + count - 1 of the program's. */
struct RowSpan {
  int first = 0, count = 0;
};

constexpr RowSpan RowOf(const Program& program, int k) {
  RowSpan row;
  for (int e = 0; e < program.num_first; ++e) {
    const Program::First& entry = program.jacobian[ToSize(e)];
    if (entry.row != k || entry.column >= program.states) continue;
    if (row.count++ == 0) row.first = e;
  }
  return row;
}

template <const Program& kProgram, std::size_t E>
FOREREACH_INLINE Lanes Weighted(const Lanes* columns, const Lanes* factors) {
  constexpr Program::First entry = kProgram.jacobian[E];
  if constexpr (entry.is_one)
    return columns[entry.column];
  else
    return factors[E] * columns[entry.column];
}

template <const Program& kProgram, std::size_t K>
FOREREACH_INLINE Lanes RowImage(const Lanes* columns, const Lanes* factors) {
  constexpr RowSpan kRow = RowOf(kProgram, static_cast<int>(K));
  constexpr auto kFirst = ToSize(kRow.first);
  if constexpr (kRow.count == 0) {
    return AllLanes(0);
  } else {
    Lanes sum = Weighted<kProgram, kFirst>(columns, factors);
    [&]<std::size_t... E>(std::index_sequence<E...>) __attribute__((always_inline)) {
      ((sum += Weighted<kProgram, kFirst + 1 + E>(columns, factors)), ...);
    }
    (std::make_index_sequence<ToSize(kRow.count - 1)>());
    return sum;
  }
}

/** Stores Sum(rows[i]) at to[i], with zeros up to a multiple of four. */
template <std::size_t N>
FOREREACH_INLINE void StoreSums(const Lanes (&rows)[N], double* to) {
  const auto at = [&](std::size_t i) __attribute__((always_inline)) { return i < N ? rows[i] : AllLanes(0); };
  for (std::size_t i = 0; i < N; i += kLaneCount) StoreLanes(SumEach(at(i), at(i + 1), at(i + 2), at(i + 3)), to + i);
}

template <const Program& kProgram, std::size_t... K>
FOREREACH_INLINE void MapRows(const Expansion& expansion, const Zonotope& slice, Zonotope& next, ImageSums& sums,
                              std::index_sequence<K...>) {
  std::array<Lanes, ToSize(kProgram.num_first)> factors;
  for (std::size_t e = 0; e < ToSize(kProgram.num_first); ++e) factors[e] = AllLanes(expansion.jacobian[e]);
  Lanes row_sums[sizeof...(K)] = {(static_cast<void>(K), AllLanes(0))...};
  const std::size_t size = slice.padded_size();
  for (std::size_t j = 0; j < size; j += kLaneCount) {
    // Reads every row before it writes any: an output may depend on several rows.
    const Lanes columns[] = {LoadLanes(slice.padded_row(static_cast<int>(K)).data() + j)...};
    const auto row = [&]<std::size_t Row>(std::integral_constant<std::size_t, Row>) __attribute__((always_inline)) {
      const Lanes image = RowImage<kProgram, Row>(columns, factors.data());
      StoreLanes(image, ArraysOf(next).mutable_row(static_cast<int>(Row)) + j);
      row_sums[Row] += Abs(image);
    };
    (row(std::integral_constant<std::size_t, K>()), ...);
  }
  StoreSums(row_sums, sums.row.data());
}

/** (|J| s)_k + image_k in plain arithmetic. The exact value is at most 1 + 2^-44 times the result. */
template <const Program& kProgram, std::size_t K>
FOREREACH_INLINE double RowSlack(const Expansion& expansion, const StepError& error, const Zonotope& slice) {
  constexpr RowSpan kRow = RowOf(kProgram, static_cast<int>(K));
  double slack = kCountsRounding ? error.image[K] : 0;
  const auto add = [&]<std::size_t E>(std::integral_constant<std::size_t, E>) __attribute__((always_inline)) {
    constexpr Program::First entry = kProgram.jacobian[ToSize(kRow.first) + E];
    const double s = slice.slack(entry.column);
    if constexpr (entry.is_one)
      slack += s;
    else
      slack += std::abs(expansion.jacobian[ToSize(kRow.first) + E]) * s;
  };
  [&]<std::size_t... E>(std::index_sequence<E...>) __attribute__((always_inline)) {
    (add(std::integral_constant<std::size_t, E>()), ...);
  }
  (std::make_index_sequence<ToSize(kRow.count)>());
  return slack;
}

template <const Program& kProgram, std::size_t... K>
FOREREACH_INLINE void MapAndSum(const Expansion& expansion, const StepError& error, const Zonotope& slice,
                                Zonotope& next, ImageSums& sums, std::index_sequence<K...> rows) {
  ArraysOf(next).Reset(slice.dim(), slice.num_generators());
  MapRows<kProgram>(expansion, slice, next, sums, rows);
  StoreAll({RowSlack<kProgram, K>(expansion, error, slice)...}, ArraysOf(next).mutable_slacks());
}

/** NominalModel::Map for one program: sets the generators of `next` to fl(J G) and its slack to
s' = fl(|J| s + error.image), with J = expansion.jacobian. For every matrix J' that `error` covers, |b|_inf <= 1 and
|b'|_inf <= 1,
    |J' (G b + diag(s) b') - fl(J G) b| <= (1 + 2^-44) s'.
Does not change the center of `next`. Sets `sums` to those of fl(J G). Cost: a product for each nonzero of J and each
generator. @pre `error` was made for half-widths that are not below the slice's. */
template <const Program& kProgram>
FOREREACH_INLINE void Map(const Expansion& expansion, const StepError& error, const Zonotope& slice, Zonotope& next,
                          ImageSums& sums) {
  MapAndSum<kProgram>(expansion, error, slice, next, sums, std::make_index_sequence<ToSize(kProgram.states)>());
}

/** The same for a program that was read from a text, with the same bits. `rows` are its RowSpans, one for each state.
 */
FOREREACH_INLINE void MapByRows(const Program& program, const RowSpan* rows, const Expansion& expansion,
                                const StepError& error, const Zonotope& slice, Zonotope& next, ImageSums& sums) {
  const auto states = ToSize(program.states);
  ArraysOf(next).Reset(slice.dim(), slice.num_generators());
  Lanes row_sums[PaddedToLanes(kMaxStates)];
  for (Lanes& sum : row_sums) sum = AllLanes(0);
  const std::size_t size = slice.padded_size();
  for (std::size_t j = 0; j < size; j += kLaneCount) {
    Lanes columns[kMaxStates];
    for (std::size_t k = 0; k < states; ++k) columns[k] = LoadLanes(slice.padded_row(static_cast<int>(k)).data() + j);
    for (std::size_t k = 0; k < states; ++k) {
      Lanes image = AllLanes(0);
      for (int i = 0; i < rows[k].count; ++i) {
        const auto e = ToSize(rows[k].first + i);
        const Program::First& entry = program.jacobian[e];
        const Lanes column = columns[entry.column];
        const Lanes product = entry.is_one ? column : AllLanes(expansion.jacobian[e]) * column;
        image = i == 0 ? product : image + product;
      }
      StoreLanes(image, ArraysOf(next).mutable_row(static_cast<int>(k)) + j);
      row_sums[k] += Abs(image);
    }
  }
  for (std::size_t k = 0; k < states; k += kLaneCount)
    StoreLanes(SumEach(row_sums[k], row_sums[k + 1], row_sums[k + 2], row_sums[k + 3]), sums.row.data() + k);
  for (std::size_t k = 0; k < states; ++k) {
    double slack = kCountsRounding ? error.image[k] : 0;
    for (int i = 0; i < rows[k].count; ++i) {
      const auto e = ToSize(rows[k].first + i);
      const Program::First& entry = program.jacobian[e];
      const double s = slice.slack(entry.column);
      slack += entry.is_one ? s : std::abs(expansion.jacobian[e]) * s;
    }
    ArraysOf(next).mutable_slacks()[k] = slack;
  }
  for (std::size_t k = states; k < PaddedToLanes(states); ++k) ArraysOf(next).mutable_slacks()[k] = 0;
}

}  // namespace forereach::internal

FOREREACH_ARITHMETIC_END
