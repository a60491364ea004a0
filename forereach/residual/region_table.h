/** What observations say of one row of the residual, where that depends on one or two variables by which regions are
bounded: bounds at the nodes of a grid, whose ticks are all sides of regions in the domain and even cuts between them.

    r_k(node) <= min_i [ceiling_i + cost of the cheapest way from z_i to the node],   -r_k likewise with floor_i.

A way goes from z_i to a corner of its cell of the grid, then along edges, which cost their length times the lesser
slope of the cells on both sides. It may go around a corner of a steep region, which the moves of RegionGrid::CostUpper
do not, and over a box the tightest observation may be another one at each of its points. So bounds may rise or fall
across a box, by more than they lie apart: then they are tighter relative to a slope.

Rounding (docs/soundness.md, 3.20). Bounds at nodes are rounded up. A query runs in plain arithmetic, with the error of
its expressions added at the end. */
#pragma once

#include <array>
#include <cstdint>
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
  [[nodiscard]] static bool Fits(const RegionGrid& grid, std::size_t row) {
    return grid.variables().size() <= 2 && !grid.HasOtherSlopes(row);
  }

  /** @pre Fits; `grid` has these ends of the domain. Cost: some 10 ns a cell. */
  RegionTable(const RegionGrid& grid, std::size_t row, std::span<const double> domain_lower,
              std::span<const double> domain_upper);

  /** Adds an observation: floor <= r_k(z) <= ceiling. One outside the domain says nothing. Cost: about 100 ns for each
  node whose bound it narrows. */
  void Add(std::span<const double> z, double floor, double ceiling);

  /** A slope along the axes, of RegionGrid::variables(), and where it is zero. */
  struct Tilt {
    std::array<double, 2> slope, center;
  };
  /** Bounds at every z in a box and the domain: on r_k(z), and on r_k(z) - sum_a slope_a (z_a - center_a). */
  struct Bounds {
    Interval plain = Interval::Entire(), tilted = Interval::Entire();
    Tilt tilt{};
  };

  /** Both in one pass. No heap, lock or exception. Cost: some 80 instructions for each cell that the box meets, with
  AVX2. @pre the tilt is zero or that of a box in the domain. */
  [[nodiscard]] Bounds Enclose(const RegionGrid::Box& box, const Tilt& tilt = {}) const noexcept;

  /** Relative to the slope by which the middle of the bounds rises across the box, along each of its sides that is not
  far shorter than a strip: whole parts, of which the largest slope has 250.7, so that who derives it again gets the
  same. @param center of the box, of all variables of z. Cost: that of Enclose, and of four points. */
  [[nodiscard]] Bounds EncloseTilted(const RegionGrid::Box& box, std::span<const double> center) const noexcept;

 private:
  struct Axis {
    int variable = -1;  // -1: none, and a single strip without width
    std::vector<double> ticks = {0, 0};
    std::vector<double> slopes{};  // by cell
    double quantum = 0;            // of a tilt; 0: there is none
    double least_width = 0;        // of a box for a tilt
  };
  // The part of a box that lies between the ticks, and the strips that cover it.
  struct Part {
    double lower, upper;
    std::size_t first, last;
  };

  using Parts = std::array<Part, 2>;

  static bool Cover(const Axis& axis, const RegionGrid::Box& box, Part& part) noexcept;
  [[nodiscard]] bool Cover(const RegionGrid::Box& box, Parts& parts) const noexcept {
    return Cover(axes_[0], box, parts[0]) && Cover(axes_[1], box, parts[1]);
  }
  [[nodiscard]] std::size_t CellAt(std::size_t i, std::size_t j) const { return i * (axes_[1].ticks.size() - 1) + j; }
  [[nodiscard]] std::size_t NodeAt(std::size_t i, std::size_t j) const { return i * axes_[1].ticks.size() + j; }
  [[nodiscard]] double Cost(std::size_t a, std::size_t i, std::size_t j) const;
  [[nodiscard]] Tilt TiltOver(const Parts& parts, std::span<const double> center,
                              const RegionGrid::Box& box) const noexcept;
  [[nodiscard]] Bounds Over(const Parts& parts, const Tilt& tilt) const noexcept;
  [[nodiscard]] inline Bounds OverInline(const Parts& parts, const Tilt& tilt) const noexcept;
  struct Reached {
    double value;
    std::uint32_t node;
  };
  void Spread(std::size_t side, const std::vector<Reached>& reached);

  std::array<Axis, 2> axes_;
  std::vector<std::array<double, 2>> values_;   // of the nodes: upper bounds on r_k, and on -r_k
  double largest_way_ = 0, largest_value_ = 0;  // along a side of a cell; of the bounds, in size
  double error_ = 0;
  InstructionSet instructions_ = BestInstructionSet();
};

}  // namespace forereach
