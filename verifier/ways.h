/** What it costs a residual to change from an observation to a box, by declared regions (Declaration::regions), with no
table: each order of the moves is tried, each way is cut at the sides of regions that it meets, and the slope of a piece
is looked up among the regions themselves. So is what else they bound, in each piece into which their sides cut a box.
The certifier's grid (residual/region_grid.h) shares nothing with this. */
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "forereach/certify/problem.h"

namespace forereach::verifier {

class Ways final {
 public:
  using Box = std::vector<std::pair<double, double>>;  ///< of the variables of z, the lower end first

  /** @param problem must outlive this object. */
  explicit Ways(const Problem& problem);

  /** Whether some region has slopes below L in row k. */
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

 private:
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

}  // namespace forereach::verifier
