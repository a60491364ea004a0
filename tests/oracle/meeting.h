/** Whether a part of a body meets an obstacle at one moment, for doubles and for numbers of 256 bits. Independent of
the certifier's and the planner's geometry. */
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "forereach/safety/obstacle.h"
#include "tests/oracle/exact.h"

namespace forereach {

template <class Scalar>
using Point3 = std::array<Scalar, 3>;

template <class Scalar>
Scalar Dot(const Point3<Scalar>& a, const Point3<Scalar>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class Scalar>
Point3<Scalar> Minus(const Point3<Scalar>& a, const Point3<Scalar>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
template <class Scalar>
Point3<Scalar> Plus(const Point3<Scalar>& a, const Scalar& factor, const Point3<Scalar>& b) {
  return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}

/** The point of a face (1 to 4 points) next to the origin, if it lies in the face: by Gram and Schmidt. */
template <class Scalar>
bool NearestOfFace(const std::vector<Point3<Scalar>>& face, const Scalar& flat, Point3<Scalar>& nearest) {
  const std::size_t count = face.size() - 1;
  std::array<Point3<Scalar>, 3> edge, axis;
  std::array<std::array<Scalar, 3>, 3> part{};  // of axis j in edge i
  std::array<Scalar, 3> along{}, weight{};
  nearest = face[0];
  for (std::size_t i = 0; i < count; ++i) {
    edge[i] = axis[i] = Minus(face[i + 1], face[0]);
    for (std::size_t j = 0; j < i; ++j) {
      part[i][j] = Dot(edge[i], axis[j]) / Dot(axis[j], axis[j]);
      axis[i] = Plus(axis[i], -part[i][j], axis[j]);
    }
    if (!(Dot(axis[i], axis[i]) > flat * Dot(edge[i], edge[i]))) return false;  // a smaller face has the point
    along[i] = -Dot(face[0], axis[i]) / Dot(axis[i], axis[i]);
    nearest = Plus(nearest, along[i], axis[i]);
  }
  Scalar total(0.0);
  for (std::size_t i = count; i-- > 0;) {
    weight[i] = along[i];
    for (std::size_t j = i + 1; j < count; ++j) weight[i] = weight[i] - part[j][i] * weight[j];
    if (weight[i] < Scalar(0.0)) return false;
    total = total + weight[i];
  }
  return total <= Scalar(1.0);
}

/** The square of the distance between the hulls of two sets of points in `dim` dimensions, zero if they overlap. The
distance is attained by two points of them, so it is never too small, but for rounding. */
template <class Scalar>
Scalar SquareDistance(const std::vector<Point3<Scalar>>& a, const std::vector<Point3<Scalar>>& b, int dim,
                      double tolerance) {
  const Scalar flat(tolerance);
  std::vector<Point3<Scalar>> simplex{Minus(a[0], b[0])};
  Point3<Scalar> nearest = simplex[0];
  for (int step = 0; step < 100; ++step) {
    const auto extreme = [&](const std::vector<Point3<Scalar>>& points, bool lowest) {
      std::size_t best = 0;
      for (std::size_t i = 1; i < points.size(); ++i) {
        const Scalar gain = Dot(nearest, Minus(points[i], points[best]));
        if (lowest ? gain < Scalar(0.0) : Scalar(0.0) < gain) best = i;
      }
      return points[best];
    };
    const Point3<Scalar> next = Minus(extreme(a, true), extreme(b, false));
    const Scalar square = Dot(nearest, nearest);
    if (square - Dot(nearest, next) <= flat * Dot(next, next)) return square;
    simplex.push_back(next);
    std::vector<Point3<Scalar>> best_face;
    for (unsigned members = 1; members < 1U << simplex.size(); ++members) {
      std::vector<Point3<Scalar>> face;
      for (std::size_t i = 0; i < simplex.size(); ++i)
        if (members >> i & 1U) face.push_back(simplex[i]);
      Point3<Scalar> candidate;
      if (!NearestOfFace(face, flat, candidate)) continue;
      if (!best_face.empty() && !(Dot(candidate, candidate) < Dot(nearest, nearest))) continue;
      nearest = candidate;
      best_face = face;
    }
    simplex = best_face;
    if (simplex.size() == static_cast<std::size_t>(dim) + 1) return Scalar(0.0);
  }
  return Dot(nearest, nearest);
}

/** True if conv {points} + {y : |y|_2 <= radius} meets the obstacle moved by `shift` and grown by what `radius` holds
besides the part's own: radius has to contain the obstacle's too. */
template <class Scalar>
bool Meets(const Obstacle& obstacle, const Point3<Scalar>& shift, const std::vector<Point3<Scalar>>& points,
           const Scalar& radius, double tolerance) {
  using std::sqrt;
  std::vector<Point3<Scalar>> seen;
  for (const Point3<Scalar>& point : points) seen.push_back(Minus(point, shift));
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace) {
    Point3<Scalar> normal{Scalar(0.0), Scalar(0.0), Scalar(0.0)};
    for (int k = 0; k < obstacle.dim(); ++k) normal[static_cast<std::size_t>(k)] = Scalar(obstacle.points()[0][k]);
    for (const Point3<Scalar>& point : seen)
      if (Scalar(obstacle.offset()) <= Dot(normal, point) + radius * sqrt(Dot(normal, normal))) return true;
    return false;
  }
  std::vector<Point3<Scalar>> core;
  for (const Eigen::Vector3d& point : obstacle.hull())
    core.push_back({Scalar(point[0]), Scalar(point[1]), Scalar(point[2])});
  return SquareDistance(core, seen, obstacle.dim(), tolerance) <= radius * radius;
}

}  // namespace forereach
