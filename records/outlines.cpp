#include "records/outlines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

#include <Eigen/Geometry>

#include "forereach/numerics/size.h"
#include "forereach/sets/zonogon.h"

namespace forereach {
namespace {

using Eigen::Vector2d;

constexpr int kCornersOfDisc = 16;

}  // namespace

// The corners of the convex hull, by Andrew's monotone chain.
Picture::Polygon HullOf(const std::vector<Vector2d>& points, double radius) {
  Picture::Polygon all;
  for (const Vector2d& point : points) {
    if (radius == 0) all.push_back(point);
    for (int i = 0; radius > 0 && i < kCornersOfDisc; ++i) {
      const double angle = 2 * M_PI * i / kCornersOfDisc;
      all.push_back(point + radius * Vector2d(std::cos(angle), std::sin(angle)));
    }
  }
  if (all.size() < 2) return all;
  std::ranges::sort(all, {}, [](const Vector2d& a) { return std::pair(a.x(), a.y()); });
  Picture::Polygon hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = hull.size();
    for (const Vector2d& point : all) {
      while (hull.size() >= base + 2) {
        const Vector2d edge = hull.back() - hull[hull.size() - 2], next = point - hull.back();
        if (edge.x() * next.y() - edge.y() * next.x() > 0) break;
        hull.pop_back();
      }
      hull.push_back(point);
    }
    hull.pop_back();
    std::ranges::reverse(all);
  }
  return hull;
}

std::vector<std::vector<Picture::Polygon>> Sweeps(const Certifier& certifier, const Tube& tube, int last) {
  const Placement& placement = certifier.safety().placement();
  std::vector<Zonotope> places(ToSize(placement.num_points()));
  const auto sample = std::make_unique<Placement::Sample>();
  // The corners of the places of each part's points at a sample.
  const auto corners_at = [&](int t) {
    placement.Observe(tube.slice(t), tube.half_width(t), *sample);
    placement.Enclose(*sample, places.data());
    std::vector<std::vector<Vector2d>> corners;
    for (const Placement::Part& part : placement.parts()) {
      std::vector<Vector2d>& of_part = corners.emplace_back();
      for (int i = part.first; i < part.first + part.count; ++i)
        std::ranges::move(Outline(places[ToSize(i)]), std::back_inserter(of_part));
    }
    return corners;
  };
  std::vector<std::vector<Picture::Polygon>> sweeps;
  const int units = std::min(last + 1, certifier.safety().NumUnits(tube));
  auto corners = corners_at(0);
  for (int t = 0; t < units; ++t) {
    auto next = t < tube.length() ? corners_at(t + 1) : corners;
    std::vector<Picture::Polygon>& unit = sweeps.emplace_back();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Placement::Part& part = placement.parts()[i];
      double turn = 0;
      for (int k = part.first; k < part.first + part.count; ++k) turn = std::max(turn, placement.turn(k));
      if (placement.sweeps()) std::ranges::copy(next[i], std::back_inserter(corners[i]));
      unit.push_back(HullOf(corners[i], part.radius + turn));
    }
    corners = std::move(next);
  }
  return sweeps;
}

BodyOutlines::BodyOutlines(const Problem& problem) : problem_(problem) {
  for (const BodyPart& part : problem.body.parts) {
    std::vector<TextFunction>& functions = places_.emplace_back();
    for (const auto& place : part.places) functions.emplace_back(NamesOf(*problem.model), place);
  }
}

std::vector<Picture::Polygon> BodyOutlines::At(const Eigen::VectorXd& x) const {
  if (problem_.body == Body{}) return {};
  const Vector2d position = problem_.projection * x;
  const Eigen::Rotation2Dd turn(problem_.body.heading < 0 ? 0 : x[problem_.body.heading]);
  std::vector<Picture::Polygon> parts;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const BodyPart& part = problem_.body.parts[i];
    std::vector<Vector2d> points;
    if (part.places.empty())
      for (const Eigen::Vector3d& point : part.points) points.push_back(position + turn * point.head<2>());
    for (const TextFunction& function : places_[i]) {
      std::vector<double> z(x.begin(), x.end());
      z.resize(ToSize(function.num_variables()));
      std::array<long double, 2> at;
      function.Evaluate(z, at);
      points.emplace_back(static_cast<double>(at[0]), static_cast<double>(at[1]));
    }
    parts.push_back(HullOf(points, part.radius));
  }
  return parts;
}

std::vector<Picture::Polygon> PredictionOf(const Obstacle& obstacle) {
  constexpr std::int64_t kStepUs = 500'000, kLastUs = 2'000'000;
  if (!obstacle.motion() || obstacle.kind() == Obstacle::Kind::kHalfSpace) return {};
  const ObstacleMotion& motion = *obstacle.motion();
  std::vector<Picture::Polygon> outlines;
  for (std::int64_t after = 0; after <= kLastUs; after += kStepUs) {
    const std::int64_t time = motion.stamp_us + after;
    if (time < motion.from_us || motion.until_us < time) continue;
    const double tau = static_cast<double>(after) * 1e-6;
    std::vector<Vector2d> points;
    for (const Eigen::Vector3d& point : obstacle.hull()) points.push_back((point + motion.velocity * tau).head<2>());
    outlines.push_back(HullOf(
        points, obstacle.radius() + motion.uncertainty + motion.growth * tau + motion.growth_rate * tau * tau / 2));
  }
  return outlines;
}

Picture::Polygon CornersOf(const Obstacle& obstacle) {
  std::vector<Vector2d> corners;
  for (const Eigen::Vector3d& corner : obstacle.hull()) corners.push_back(corner.head<2>());
  return HullOf(corners);
}

void AddObstacle(const Obstacle& obstacle, Picture& picture) {
  const auto& points = obstacle.points();
  switch (obstacle.kind()) {
    case Obstacle::Kind::kCircle: picture.circles.push_back({points[0], obstacle.radius()}); break;
    case Obstacle::Kind::kBox:
    case Obstacle::Kind::kPolygon: picture.polygons.push_back(CornersOf(obstacle)); break;
    case Obstacle::Kind::kHalfSpace: picture.half_planes.push_back({points[0], obstacle.offset()}); break;
  }
  std::ranges::move(PredictionOf(obstacle), std::back_inserter(picture.predictions));
}

}  // namespace forereach
