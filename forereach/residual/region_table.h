/** What observations say of one row of the residual, where that depends on no other variables than those by which
regions are bounded: bounds at the nodes of a grid, whose ticks are all sides of regions in the domain and even cuts
between them.

    r_k(node) <= min_i [ceiling_i + cost of the cheapest way from z_i to the node],   -r_k likewise with floor_i.

A way goes from z_i to a corner of its cell of the grid, then along edges. What lies on sides of cells lies in all of
them, so the least slope holds. A way may go around a corner of a steep region, which the moves of RegionGrid::CostUpper
do not, and over a box the tightest observation may be another one at each of its points. So bounds may rise or fall
across a box, by more than they lie apart: then they are tighter relative to a slope. In three variables strips are
wide, and an observation in the same strip as the box may say more by itself: Sources has those to try.

Rounding (docs/soundness.md, 3.20). Bounds at nodes are rounded up. A query runs in plain arithmetic, with the error of
its expressions added at the end. */
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "forereach/numerics/instruction_set.h"
#include "forereach/residual/region_grid.h"

namespace forereach {

class RegionTable final {
 public:
  /** Of the grid, unless regions have more, and along an axis. */
  static constexpr std::size_t kMostCells = std::size_t{1} << 15, kMostStrips = std::size_t{1} << 10;

  /** Whether there is a table for a row of RegionGrid::rows(), given by its index. */
  [[nodiscard]] static bool Fits(const RegionGrid& grid, std::size_t row) { return !grid.HasOtherSlopes(row); }

  /** @pre Fits; `grid` has these ends of the domain. Cost: some 100 ns a cell. */
  RegionTable(const RegionGrid& grid, std::size_t row, std::span<const double> domain_lower,
              std::span<const double> domain_upper);

  /** An observation: floor <= r_k(z) <= ceiling. It counts from Spread on; one outside the domain says nothing. */
  void Add(int id, std::span<const double> z, double floor, double ceiling);
  /** Cost: about 100 ns for each node whose bound is narrowed, however many observations narrow it. */
  void Spread();

  /** A slope along the axes, of RegionGrid::variables(), and where it is zero. */
  struct Tilt {
    std::array<double, RegionGrid::kMaxAxes> slope, center;
  };
  /** Bounds at every z in a box and the domain: on r_k(z), and on r_k(z) - sum_a slope_a (z_a - center_a). */
  struct Bounds {
    Interval plain = Interval::Entire(), tilted = Interval::Entire();
    Tilt tilt{};
  };

  /** Both in one pass. No heap, lock or exception. Cost: some 80 instructions for each cell that the box meets, 200 in
  three variables, with AVX2. @pre the tilt is zero or that of a box in the domain. */
  [[nodiscard]] Bounds Enclose(const RegionGrid::Box& box, const Tilt& tilt = {}) const noexcept;

  /** In three variables, Enclose. In one or two relative to the slope by which the middle of the bounds rises across
  the box, along each of its sides that is not far shorter than a strip: whole parts, of which the largest slope has
  250.7, so that who derives it again gets the same. @param center of the box, of all variables of z. Cost: that of
  Enclose, and of four points. */
  [[nodiscard]] Bounds EncloseTilted(const RegionGrid::Box& box, std::span<const double> center) const noexcept;

  static constexpr std::size_t kMostSources = 16;  // two bounds at each of 8 corners
  /** Of three variables: the observations that bound r_k at the corners of z's cell, each once; the rest is -1. */
  [[nodiscard]] std::array<int, kMostSources> Sources(std::span<const double> z) const noexcept;

 private:
  struct Axis {
    int variable;
    std::vector<double> ticks;
    std::size_t stride = 0;  // to the next node
    // By node: the largest slope along this axis on the face that begins there and spans this axis and those before
    // it, the least of the cells around; and the cost of the edge. Infinity where there is no cell.
    std::vector<double> slopes{}, costs{};
    double quantum = 0;      // of a tilt; 0: there is none
    double least_width = 0;  // of a box for a tilt
  };
  // The part of a box that lies between the ticks, and the strips that cover it.
  struct Part {
    double lower, upper;
    std::size_t first, last;
  };

  using Parts = std::array<Part, RegionGrid::kMaxAxes>;

  static bool Cover(const Axis& axis, const RegionGrid::Box& box, Part& part) noexcept;
  [[nodiscard]] bool Cover(const RegionGrid::Box& box, Parts& parts) const noexcept;
  [[nodiscard]] bool CoverPoint(std::span<const double> z, Parts& parts) const noexcept;
  [[nodiscard]] std::size_t Corner(const Parts& parts, std::size_t corner) const noexcept;
  [[nodiscard]] Tilt TiltOver(const Parts& parts, std::span<const double> center,
                              const RegionGrid::Box& box) const noexcept;
  [[nodiscard]] Bounds Over(const Parts& parts, const Tilt& tilt) const noexcept;
  template <std::size_t kAxes>
  [[nodiscard]] Bounds OverInline(const Parts& parts, const Tilt& tilt) const noexcept;
  struct Reached {
    double value;
    std::size_t node;
    int source;
  };
  void Spread(std::size_t side);

  std::vector<Axis> axes_;                     // of RegionGrid::variables(); along the last, nodes are neighbours
  std::vector<std::array<double, 2>> values_;  // of the nodes: upper bounds on r_k, and on -r_k
  std::vector<std::array<int, 2>> sources_{};  // of three variables, of each bound the observation
  std::array<std::vector<Reached>, 2> reached_{};
  double largest_way_ = 0, largest_value_ = 0;  // along a side of a cell; of the bounds, in size
  double error_ = 0;
  InstructionSet instructions_ = BestInstructionSet();
};

}  // namespace forereach
