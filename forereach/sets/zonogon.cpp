#include "forereach/sets/zonogon.h"

#include <algorithm>
#include <cmath>

namespace forereach {
namespace {

// The generators turned into the upper half plane, by growing angle.
std::vector<Eigen::Vector2d> SortedGenerators(const Zonotope& set) {
  struct Edge {
    double angle;
    Eigen::Vector2d generator;
  };
  std::vector<Edge> edges;
  for (int j = 0; j < set.num_generators(); ++j) {
    Eigen::Vector2d g(set.generator(0, j), set.generator(1, j));
    if (g.isZero(0)) continue;
    if (g.y() < 0 || (g.y() == 0 && g.x() < 0)) g = -g;
    edges.push_back({std::atan2(g.y(), g.x()), g});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return a.angle < b.angle; });
  std::vector<Eigen::Vector2d> sorted;
  for (const Edge& edge : edges) sorted.push_back(edge.generator);
  return sorted;
}

// Half of the corners, as offsets from the center; the others are their negatives.
std::vector<Eigen::Vector2d> HalfOutline(const std::vector<Eigen::Vector2d>& sorted) {
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& g : sorted) corner -= g;
  std::vector<Eigen::Vector2d> corners{corner};
  for (const Eigen::Vector2d& g : sorted) corners.push_back(corner += 2 * g);
  return corners;
}

}  // namespace

std::vector<Eigen::Vector2d> Outline(const Zonotope& set) {
  const Eigen::Vector2d center(set.center(0), set.center(1));
  std::vector<Eigen::Vector2d> outline;
  const std::vector<Eigen::Vector2d> half = HalfOutline(SortedGenerators(set));
  if (half.size() == 1) return {center};
  for (std::size_t i = 0; i + 1 < half.size(); ++i) outline.push_back(center + half[i]);
  for (std::size_t i = 0; i + 1 < half.size(); ++i) outline.push_back(center - half[i]);
  return outline;
}

double RadiusUpper(const Zonotope& set) {
  double diagonal_square = 0;
  for (int k = 0; k < set.dim(); ++k) {
    const double half_width = set.HalfWidthUpper(k);
    diagonal_square = AddUp(diagonal_square, MulUp(half_width, half_width));
  }
  const double diagonal = SqrtUp(diagonal_square);
  if (set.dim() != 2) return diagonal;

  // R is attained at a corner. The corners found here follow the order of rounded angles; generators whose order is
  // wrong are parallel to within 1e-15, so a true corner lies within 2e-15 times the generators' total length of one
  // found. The diagonal bounds that length up to a factor 2, and each corner's own rounding is far smaller.
  double radius = 0;
  for (const Eigen::Vector2d& corner : HalfOutline(SortedGenerators(set)))
    radius = std::max(radius, SqrtUp(AddUp(MulUp(corner.x(), corner.x()), MulUp(corner.y(), corner.y()))));
  const double unsorted = MulUp(diagonal, 1e-13 * (1 + set.num_generators()));
  const double slack = AddUp(set.slack(0), set.slack(1));
  return std::min(diagonal, AddUp(radius, AddUp(unsorted, slack)));
}

}  // namespace forereach
