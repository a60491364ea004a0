/** The cells into which the sides of the declared regions cut the domain, and what it costs a residual to change from a
point to a box.

Along a path in the domain r_k changes by at most the path's cost, the integral of sum_l L_kl(z) |dz_l| with the slopes
of the cell that the path is in. CostUpper takes paths along the axes: each variable by which regions are bounded moves
on its own, and the others together, which is one move. A variable that has moved may be anywhere in the target, one
that has not is where it was, so the cells that a move may meet are known, and it costs at most

    sum over the strips across its way of (length of the way in the strip) (largest slope of those cells there).

The least over all orders of the moves is returned; docs/soundness.md, 3.20.

What else regions bound is a number in each cell. Over a box the largest of those counts whose cells it meets or as much
as touches. */
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "forereach/numerics/limits.h"
#include "forereach/residual/declaration.h"

namespace forereach {

/** What a region may bound beside slopes. */
enum class RegionBound { kDisturbance, kNoise, kResidual };

class RegionGrid final {
 public:
  static constexpr std::size_t kMaxAxes = Region::kMaxVariables;

  /** @param domain_lower, domain_upper d_z entries: only sides within cut. Without entries, all do. */
  explicit RegionGrid(const Declaration& declaration, std::span<const double> domain_lower = {},
                      std::span<const double> domain_upper = {});

  /** By which regions are bounded, ascending. */
  [[nodiscard]] const std::vector<int>& variables() const { return variables_; }
  /** Where the range of variables()[a] is cut, ascending. */
  [[nodiscard]] const std::vector<double>& cuts(std::size_t a) const { return cuts_[a]; }
  [[nodiscard]] std::size_t num_cells() const { return num_cells_; }
  /** "4 variables and 3 x 2 x 2 x 2 = 24 cells". */
  [[nodiscard]] std::string SizeText() const;
  /** The rows whose slopes some cell has below L, ascending. */
  [[nodiscard]] const std::vector<int>& rows() const { return rows_; }
  /** Whether a row of rows(), by its index, has a slope by a variable that no region bounds. */
  [[nodiscard]] bool HasOtherSlopes(std::size_t row) const { return !slopes_[row].others.empty(); }

  /** Along each axis the first and the last strip that a box meets. What has no width and lies on a cut is in one
  strip, and in the next one as well. */
  struct Place {
    std::array<std::uint16_t, kMaxAxes> first{}, last{};
    std::array<bool, kMaxAxes> on_cut{};
  };
  struct Box {
    std::array<double, kMaxVariables> lower, upper;  ///< of the variables of z
    Place place;
  };
  /** Sets box.place. A box outside the domain counts as if the outer strips went on. */
  void Find(Box& box) const noexcept;

  /** The largest slope of a row by variables()[a] in the cells that a box meets. @pre it has its place. */
  [[nodiscard]] double LargestSlope(std::size_t row, std::size_t a, const Box& box) const noexcept {
    return LargestSlope(slopes_[row].axes[a].slopes, box.place);
  }

  /** At least |r_k(z) - r_k(from)| for every z in `to`, for all residuals within L and the regions, rounded up.
  @param row of rows(), by its index. @param enough a cost from here on may be returned as infinity, which saves time.
  @pre both have their places. Cost: a few additions for each strip on the way, with
  the slopes of the cells that `to` meets there, in each of up to 32 moves. */
  [[nodiscard]] double CostUpper(std::size_t row, const Box& from, const Box& to,
                                 double enough = std::numeric_limits<double>::infinity()) const noexcept;

  /** The largest bound on state k of a step, a record or the residual at any z of the box: w^_k or sigma_k where no
  region says less, infinity for the residual. Its place is not read, and NaN counts as anywhere. */
  [[nodiscard]] double LargestBound(RegionBound which, std::size_t k, const Box& box) const noexcept;

 private:
  struct Column {
    int variable = -1;
    std::vector<double> slopes = {};  // by cell
  };
  struct Row {
    std::array<Column, kMaxAxes> axes;
    std::vector<Column> others;  // those with a slope
  };

  [[nodiscard]] double LargestSlope(const std::vector<double>& slopes, const Place& place) const noexcept;
  [[nodiscard]] double AlongAxis(const Row& row, std::size_t a, const Place& across, const Box& from,
                                 const Box& to) const noexcept;
  [[nodiscard]] double Ascent(const Row& row, std::size_t a, Place at, std::size_t strip, double from,
                              double to) const noexcept;
  [[nodiscard]] double OfOthers(const Row& row, const Place& at, const Box& from, const Box& to) const noexcept;

  std::vector<int> variables_;
  std::array<std::vector<double>, kMaxAxes> cuts_;
  std::array<std::size_t, kMaxAxes> stride_{};
  std::size_t num_cells_ = 1, num_axes_ = 0;
  std::string size_text_;
  std::vector<int> rows_;
  std::vector<Row> slopes_;
  struct Bounds {
    std::vector<double> everywhere, in_cells;  // by state; by state and cell, empty if no region says any
  };
  std::array<Bounds, 3> bounds_;  // by RegionBound
};

}  // namespace forereach
