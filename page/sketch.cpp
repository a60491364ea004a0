#include "page/sketch.h"

#include <algorithm>
#include <cmath>

#include "forereach/numerics/directed.h"

namespace forereach {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kMostCount = 255;

double DistanceToChord(const Vector2d& point, const Vector2d& from, const Vector2d& to) {
  const Vector2d chord = to - from;
  const double length = chord.norm();
  if (length == 0) return (point - from).norm();
  return std::abs(chord.x() * (point - from).y() - chord.y() * (point - from).x()) / length;
}

struct Extent {
  Vector2d lower = Vector2d::Constant(kInfinity), upper = Vector2d::Constant(-kInfinity);

  void Add(const Picture::Polygon& polygon) {
    for (const Vector2d& point : polygon) lower = lower.cwiseMin(point), upper = upper.cwiseMax(point);
  }
  [[nodiscard]] double size() const { return (upper - lower).maxCoeff(); }
};

}  // namespace

Picture::Polygon Simplified(const Picture::Polygon& polygon, double tolerance) {
  if (polygon.size() <= 3) return polygon;
  Picture::Polygon kept{polygon.front()};
  std::size_t last = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    bool is_near = true;
    for (std::size_t k = last + 1; k <= i && is_near; ++k)
      is_near = DistanceToChord(polygon[k], polygon[last], polygon[i + 1]) <= tolerance;
    if (is_near) continue;
    kept.push_back(polygon[i]);
    last = i;
  }
  kept.push_back(polygon.back());
  return kept.size() < 3 ? polygon : kept;
}

std::optional<Sketch> MakeSketch(const std::vector<std::vector<Picture::Polygon>>& units) {
  Extent all;
  for (const auto& unit : units)
    for (const Picture::Polygon& polygon : unit) {
      if (!std::ranges::all_of(polygon, [](const Vector2d& point) { return point.allFinite(); })) return std::nullopt;
      all.Add(polygon);
    }
  if (!(all.size() >= 0 && all.size() < 1e9)) return std::nullopt;
  Sketch sketch;
  sketch.x = (all.lower.x() + all.upper.x()) / 2;
  sketch.y = (all.lower.y() + all.upper.y()) / 2;
  sketch.quantum = std::max(all.size(), 1e-9) / Sketch::kGrid;
  for (const auto& unit : units) {
    if (unit.size() > kMostCount) return std::nullopt;
    sketch.parts.push_back(static_cast<std::uint8_t>(unit.size()));
    for (const Picture::Polygon& polygon : unit) {
      Extent extent;
      extent.Add(polygon);
      const Picture::Polygon outline = Simplified(polygon, Sketch::kTolerance * extent.size());
      if (outline.size() > kMostCount) return std::nullopt;
      sketch.corners.push_back(static_cast<std::uint8_t>(outline.size()));
      int last_x = 0, last_y = 0;
      for (const Vector2d& point : outline) {
        const int x = static_cast<int>(std::lround((point.x() - sketch.x) / sketch.quantum));
        const int y = static_cast<int>(std::lround((point.y() - sketch.y) / sketch.quantum));
        sketch.points.push_back(static_cast<std::int16_t>(x - last_x));
        sketch.points.push_back(static_cast<std::int16_t>(y - last_y));
        last_x = x, last_y = y;
      }
    }
  }
  return sketch;
}

}  // namespace forereach
