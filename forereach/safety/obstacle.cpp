#include "forereach/safety/obstacle.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "forereach/numerics/require.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/safety/occupancy_grid.h"

namespace forereach {
namespace {

Eigen::Vector3d Padded(const Eigen::VectorXd& point) {
  Eigen::Vector3d padded = Eigen::Vector3d::Zero();
  padded.head(point.size()) = point;
  return padded;
}

int SafetyDim(const char* what, const Eigen::VectorXd& point) {
  Require(1 <= point.size() && point.size() <= kMaxSafetyDim,
          std::string(what) + ": dimension " + std::to_string(point.size()) + " is not 1, 2 or 3");
  Require(point.allFinite(), std::string(what) + ": not finite");
  return static_cast<int>(point.size());
}

// Distance from the origin to the hull of planar points given as offsets, negative inside, by plain arithmetic: the
// largest value over unit directions of the smallest support.
double HullDistance(const std::vector<Eigen::Vector2d>& offsets) {
  const auto lowest = [&](const Eigen::Vector2d& direction) {
    double value = kInfinity;
    for (const Eigen::Vector2d& point : offsets) value = std::min(value, direction.dot(point));
    return value;
  };
  double best = -kInfinity;
  const auto consider = [&](const Eigen::Vector2d& direction) {
    if (direction.norm() > 0) best = std::max(best, lowest(direction.normalized()));
  };
  for (const Eigen::Vector2d& a : offsets) {
    consider(a);
    for (const Eigen::Vector2d& b : offsets) consider({a.y() - b.y(), b.x() - a.x()});
  }
  return best;
}

bool IsLetter(char c) { return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z'); }
bool IsInNames(char c) {
  return IsLetter(c) || ('0' <= c && c <= '9') || std::string_view("_-.:/").find(c) != std::string_view::npos;
}

}  // namespace

std::string WhyNoName(std::string_view text) {
  if (text.empty() || text.size() > kMaxObstacleName)
    return "has " + std::to_string(text.size()) + " characters, must have 1 to " + std::to_string(kMaxObstacleName);
  // Names reach terminals, pages and logs: no character of theirs means anything there.
  if (IsLetter(text.front()) && std::ranges::all_of(text, IsInNames)) return {};
  return "must begin with a letter and have only letters, digits and _-.:/";
}

void Obstacle::SetHull(std::vector<Eigen::Vector3d> hull) {
  hull_ = std::move(hull);
  lower_ = upper_ = hull_.front();
  for (const Eigen::Vector3d& point : hull_) {
    lower_ = lower_.cwiseMin(point);
    upper_ = upper_.cwiseMax(point);
  }
}

Obstacle Obstacle::Circle(const Eigen::VectorXd& center, double radius) {
  Require(center.size() == 2, "circle: center has " + std::to_string(center.size()) + " entries, must have 2");
  Require(radius >= 0 && radius < kInfinity, "circle: radius " + ToText(radius) + " is negative or not finite");
  Obstacle circle(Kind::kCircle, SafetyDim("circle: center", center));
  circle.radius_ = radius;
  circle.points_ = {center};
  circle.SetHull({Padded(center)});
  return circle;
}

Obstacle Obstacle::AxisBox(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  Obstacle box(Kind::kBox, SafetyDim("box: lower", lower));
  Require(SafetyDim("box: upper", upper) == box.dim_, "box: lower and upper have different sizes");
  for (Eigen::Index k = 0; k < lower.size(); ++k)
    Require(lower[k] <= upper[k], "box: lower " + ToText(lower[k]) + " is above upper " + ToText(upper[k]));
  box.points_ = {lower, upper};
  std::vector<Eigen::Vector3d> hull;
  for (int corner = 0; corner < 1 << box.dim_; ++corner) {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    for (int k = 0; k < box.dim_; ++k) point[k] = corner >> k & 1 ? upper[k] : lower[k];
    hull.push_back(point);
  }
  box.SetHull(std::move(hull));
  return box;
}

Obstacle Obstacle::Polygon(const std::vector<Eigen::VectorXd>& vertices) {
  Require(
      3 <= vertices.size() && vertices.size() <= kMaxObstaclePoints,
      "polygon: " + std::to_string(vertices.size()) + " vertices, must be 3 to " + std::to_string(kMaxObstaclePoints));
  Obstacle polygon(Kind::kPolygon, 2);
  polygon.points_ = vertices;
  std::vector<Eigen::Vector3d> hull;
  for (const Eigen::VectorXd& vertex : vertices) {
    Require(SafetyDim("polygon: vertex", vertex) == 2, "polygon: a vertex must have 2 entries");
    hull.push_back(Padded(vertex));
  }
  polygon.SetHull(std::move(hull));
  return polygon;
}

Obstacle Obstacle::HalfSpace(const Eigen::VectorXd& normal, double offset) {
  Obstacle half_space(Kind::kHalfSpace, SafetyDim("half_plane: normal", normal));
  Require(!normal.isZero(0), "half_plane: normal is zero");
  Require(std::isfinite(offset), "half_plane: offset is not finite");
  half_space.points_ = {normal};
  half_space.offset_ = offset;
  return half_space;
}

Obstacle Obstacle::Grid(std::shared_ptr<const OccupancyGrid> grid) {
  Obstacle obstacle(Kind::kGrid, 2);
  obstacle.grid_ = std::move(grid);
  obstacle.lower_ = {kInfinity, kInfinity, 0};
  obstacle.upper_ = -obstacle.lower_;
  for (const Obstacle& block : obstacle.convex()) {
    obstacle.lower_ = obstacle.lower_.cwiseMin(block.lower_);
    obstacle.upper_ = obstacle.upper_.cwiseMax(block.upper_);
  }
  return obstacle;
}

std::span<const Obstacle> Obstacle::convex() const {
  return grid_ ? grid_->blocks() : std::span<const Obstacle>(this, 1);
}

Obstacle Obstacle::Moving(const ObstacleMotion& motion) const {
  Require(!grid_, "motion: a grid stands");
  Require(motion.velocity.allFinite(), "motion: velocity is not finite");
  for (int k = dim_; k < kMaxSafetyDim; ++k)
    Require(motion.velocity[k] == 0, "motion: velocity has an entry " + std::to_string(k) + ", the obstacle has " +
                                         std::to_string(dim_) + " dimensions");
  const auto require_size = [](const char* what, double size) {
    Require(size >= 0 && size < kInfinity,
            std::string("motion: ") + what + " " + ToText(size) + " is negative or not finite");
  };
  require_size("uncertainty", motion.uncertainty);
  require_size("growth", motion.growth);
  require_size("growth_rate", motion.growth_rate);
  // So that no difference of two times overflows.
  Require(-Schedule::kLatest <= motion.stamp_us && motion.stamp_us <= Schedule::kLatest,
          "motion: stamp " + std::to_string(motion.stamp_us) + " is not within 2^60 us of the epoch");
  Require(motion.from_us <= motion.until_us, "motion: the window [" + std::to_string(motion.from_us) + ", " +
                                                 std::to_string(motion.until_us) + "] us is empty");
  Obstacle moving = *this;
  moving.motion_ = motion;
  return moving;
}

Obstacle Obstacle::Named(std::string_view name) const {
  const std::string why = name.empty() ? std::string() : WhyNoName(name);
  Require(why.empty(), "name: " + why);
  Obstacle named = *this;
  named.name_ = name;
  return named;
}

std::string NameOf(std::span<const Obstacle> obstacles, int index, int block) {
  if (block >= 0) return obstacles[ToSize(index)].grid()->NameOf(block) + " of " + NameOf(obstacles, index);
  const bool is_named = 0 <= index && index < std::ssize(obstacles) && !obstacles[ToSize(index)].name().empty();
  return is_named ? obstacles[ToSize(index)].name() : "obstacle " + std::to_string(index);
}

std::string MayTouch(std::span<const Obstacle> obstacles, int index, int block) {
  const std::string name = NameOf(obstacles, index, block);
  return name.starts_with(kOutside) ? "may leave " + name.substr(kOutside.size()) : "may touch " + name;
}

double ApproximateDistance(const Obstacle& obstacle, const Eigen::VectorXd& y) {
  switch (obstacle.kind()) {
    case Obstacle::Kind::kCircle: return (y - obstacle.points()[0]).norm() - obstacle.radius();
    case Obstacle::Kind::kHalfSpace: {
      const Eigen::VectorXd& normal = obstacle.points()[0];
      return (obstacle.offset() - normal.dot(y)) / normal.norm();
    }
    case Obstacle::Kind::kBox: {
      const Eigen::ArrayXd outside = (obstacle.points()[0] - y).array().max((y - obstacle.points()[1]).array());
      const double inside = outside.maxCoeff();
      return inside < 0 ? inside : outside.max(0).matrix().norm();
    }
    case Obstacle::Kind::kPolygon: {
      std::vector<Eigen::Vector2d> offsets;
      for (const Eigen::VectorXd& vertex : obstacle.points()) offsets.emplace_back(vertex - y);
      return HullDistance(offsets);
    }
    case Obstacle::Kind::kGrid:
      return obstacle.grid()->LeastDistance({{y[0], y[1], 0}, {}},
                                            [&](const Obstacle& block) { return ApproximateDistance(block, y); });
  }
  throw std::logic_error("obstacle: kind " + std::to_string(static_cast<int>(obstacle.kind())) + " is unknown");
}

}  // namespace forereach
