#include "research/methods/covering.h"

#include <algorithm>
#include <queue>
#include <vector>

namespace forereach::research {
namespace {

struct Cell {
  std::vector<Interval> box;
  double radius;  // min_i sup_{z in box} of the distance

  bool operator<(const Cell& other) const { return radius < other.radius; }
};

// min_i sup_{z in box} sum_l weight_l |z_l - z_il|, rounded up.
double RadiusUpper(std::span<const Interval> box, const Eigen::MatrixXd& points, const Eigen::VectorXd& weights) {
  double least = kInfinity;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    double distance = 0;
    for (std::size_t l = 0; l < box.size() && distance < least; ++l) {
      const auto column = static_cast<Eigen::Index>(l);
      if (weights[column] > 0)
        distance = AddUp(distance, MulUp(weights[column], box[l].DistanceUpper(points(i, column))));
    }
    least = std::min(least, distance);
  }
  return least;
}

std::vector<Interval> Middle(std::span<const Interval> box) {
  std::vector<Interval> middle;
  for (const Interval& side : box) middle.emplace_back(side.Middle());
  return middle;
}

std::size_t WidestSide(const Cell& cell, const Eigen::VectorXd& weights) {
  std::size_t widest = 0;
  double width = -1;
  for (std::size_t l = 0; l < cell.box.size(); ++l) {
    const double weighted = weights[static_cast<Eigen::Index>(l)] * (cell.box[l].upper - cell.box[l].lower);
    if (weighted > width) {
      width = weighted;
      widest = l;
    }
  }
  return widest;
}

}  // namespace

double CoveringRadiusUpper(std::span<const Interval> box, const Eigen::MatrixXd& points, const Eigen::VectorXd& weights,
                           double slack, int max_boxes) {
  std::priority_queue<Cell> cells;
  double reached = 0;  // about the largest distance seen; it decides only when to stop
  const auto add = [&](std::vector<Interval> sides) {
    reached = std::max(reached, RadiusUpper(Middle(sides), points, weights));
    const double radius = RadiusUpper(sides, points, weights);
    cells.push({std::move(sides), radius});
  };
  add({box.begin(), box.end()});
  while (static_cast<int>(cells.size()) < max_boxes && cells.top().radius > reached * (1 + slack)) {
    const Cell worst = cells.top();
    const std::size_t side = WidestSide(worst, weights);
    const double cut = worst.box[side].Middle();
    cells.pop();
    for (const Interval& half : {Interval(worst.box[side].lower, cut), Interval(cut, worst.box[side].upper)}) {
      std::vector<Interval> sides = worst.box;
      sides[side] = half;
      add(std::move(sides));
    }
  }
  return cells.top().radius;
}

}  // namespace forereach::research
