/** What it costs a residual to change from an observation to a box, by declared regions (Declaration::regions): each
order of the moves is tried, each way is cut at the sides of regions that it meets, and the slope of a piece
is looked up among the regions themselves. So is what else they bound, in each piece into which their sides cut a box.
The certifier's grid (residual/region_grid.h) shares nothing with this.

Where r_k depends only on variables that bound regions, ways along edges of a grid are tried, too: its ticks are those
of the certifier (soundness 3.20), a choice that claims nothing. What is found at its nodes is spread from all
observations at once, again with slopes from the regions themselves. */
#pragma once

#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "forereach/certify/problem.h"
#include "verifier/real.h"

namespace forereach::verifier {

class Ways final {
 public:
  using Box = std::vector<std::pair<double, double>>;  ///< of the variables of z, the lower end first

  /** @param problem must outlive this object. */
  explicit Ways(const Problem& problem);

  /** Whether some region that the domain's inside meets has slopes below L in row k. */
  [[nodiscard]] bool Narrow(int k) const;

  /** The cost of the cheapest way found in row k, of a Number that is double, rounded, or Real. Along the way, what has
  moved is anywhere in `to`. */
  template <class Number>
  [[nodiscard]] Number Cheapest(int k, const Eigen::VectorXd& from, const Box& to) const;

  /** The largest of these bounds on state k at a point of the box, or of what it touches; `everywhere` is that of
  points in no region. */
  [[nodiscard]] double Largest(Eigen::VectorXd Region::*bound, int k, double everywhere, Box box) const;

  /** Without what lies outside the domain's box. */
  void Cut(Box& box) const;

  /** The variables by which regions are bounded: none if r_k depends on others, too. */
  [[nodiscard]] std::vector<int> Axes(int k) const;

 private:
  friend class Nodes;
  template <class Number>
  [[nodiscard]] Number Move(int k, const std::vector<int>& move, const Box& at, const Box& to) const;
  template <class Number>
  [[nodiscard]] Number Along(int k, int variable, const Box& at, double end) const;
  [[nodiscard]] double LargestSlope(int k, int variable, const Box& box) const;
  template <class BoundOf>
  [[nodiscard]] double LargestOf(const BoundOf& bound_of, double everywhere, Box box) const;

  const Problem& problem_;
  std::vector<std::vector<double>> sides_;  // by variable, ascending
  std::vector<std::vector<int>> moves_;     // the variables that move together
};

/** Bounds on r_k at the nodes of a grid over its variables, and from these over a box. */
class Nodes final {
 public:
  /** @param ways must outlive this object. @pre ways.Axes(k) is not empty. */
  Nodes(const Ways& ways, int k);

  /** An observation: lower <= r_k(z) <= upper. It counts from the next Spread on. */
  void Add(const Eigen::VectorXd& z, const Real& lower, const Real& upper);
  void Spread();

  /** Along ways.Axes(k), zeros behind them. */
  using Slopes = std::array<double, Region::kMaxVariables>;
  /** The least and the largest that r_k(z) - sum of slope (z - center) can be over a box; box and center are ranges of
  all variables. */
  [[nodiscard]] std::pair<Real, Real> Over(std::span<const Real> box, const Slopes& slopes,
                                           std::span<const Real> center) const;
  /** The certifier's choice of slopes (soundness 3.20), which claims nothing; none if rounding may have decided it. */
  [[nodiscard]] std::optional<Slopes> SlopesOver(std::span<const Real> center, std::span<const Real> half_width) const;

 private:
  struct Axis {
    int variable;
    std::vector<double> ticks;
    double largest_slope;             // over the domain
    std::vector<Real> widths = {};    // of the strips between ticks
    std::size_t stride = 0;           // from a node to the next
    std::vector<double> slopes = {};  // by node: along the edge to the next
    std::vector<double> cells = {};   // by cell: within it
  };
  // Upper bounds on sign * r_k. Doubles near them tell what may be less; those that wait have not told their
  // neighbours.
  struct Side {
    std::vector<Real> values;
    std::vector<double> roughly;
    std::vector<std::pair<double, std::size_t>> waiting = {};
  };

  void Reach(Side& side, std::size_t node, const Real& value) const;
  void Spread(Side& side) const;
  // A cell is known by its least node.
  [[nodiscard]] std::vector<std::size_t> CornersOf(std::size_t cell) const;
  [[nodiscard]] double Slope(const Axis& along, std::size_t cell) const;
  [[nodiscard]] double SlopeOn(std::size_t a, std::size_t node) const;
  [[nodiscard]] static std::size_t TickOf(const Axis& axis, std::size_t node) {
    return node / axis.stride % axis.ticks.size();
  }

  const Ways& ways_;
  int k_;
  std::vector<Axis> axes_;
  std::array<Side, 2> sides_;
};

}  // namespace forereach::verifier
