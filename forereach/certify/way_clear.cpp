#include "forereach/certify/way_clear.h"

#include <algorithm>
#include <cmath>

#include "forereach/certify/tube.h"
#include "forereach/numerics/least.h"
#include "forereach/numerics/size.h"
#include "forereach/safety/obstacle_index.h"
#include "forereach/safety/occupancy_grid.h"

namespace forereach {
namespace {

constexpr double kLeastDepth = 1e-6;  // m, where the search begins
constexpr double kFarthest = 1e6;     // of these, where it ends

class WayClearSearch final {
 public:
  WayClearSearch(const Certifier& certifier, const Plan& plan, Tube& tube, const SearchEffort& effort)
      : certifier_(certifier), plan_(plan), tube_(tube), effort_(effort) {}

  // The first step at which the obstacle may be touched, if there is one.
  [[nodiscard]] std::optional<Decision> Touch(const Obstacle& obstacle) const {
    const ObstacleView only(&obstacle, 1);
    const Decision alone = obstacle.grid()
                               ? certifier_.JudgeSafety(plan_, {only.all(), ObstacleIndex(only.all())}, tube_)
                               : certifier_.JudgeSafety(plan_, only, tube_);
    return alone.cause == Cause::kObstacle ? std::optional(alone) : std::nullopt;
  }

  [[nodiscard]] bool GoesOn() { return goes_on_ = goes_on_ && effort_.goes_on(); }

  std::optional<Eigen::VectorXd> LeastShift(const Obstacle& obstacle, const Decision& touch) {
    // Where it begins and how far it goes proves nothing: a shift counts only once Touch has judged it.
    const double depth = std::max(touch.threshold - touch.margin, kLeastDepth);
    const double farthest = FarthestOf(obstacle, depth);
    std::optional<double> least;
    Eigen::VectorXd shift;
    const Obstacle& touched = obstacle.convex()[ToSize(std::max(touch.block, 0))];
    for (const Eigen::VectorXd& direction : DirectionsAway(touched, touch.step)) {
      const auto amount = LeastFrom(depth, least.value_or(farthest), effort_.halvings, [&](double distance) {
        return GoesOn() && !Touch(Shifted(obstacle, distance * direction));
      });
      if (!goes_on_) return std::nullopt;
      if (!amount || (least && *amount >= *least)) continue;
      least = amount;
      shift = *amount * direction;
    }
    return least ? std::optional(shift) : std::nullopt;
  }

 private:
  // A grid is made anew for each shift, and stays where its origin may be. Clear of all of it, it is clear.
  [[nodiscard]] static double FarthestOf(const Obstacle& obstacle, double depth) {
    if (!obstacle.grid()) return kFarthest * depth;
    const GridMap& map = MapOf(obstacle);
    return std::min(2 * (depth + map.resolution * (map.width + map.height)),
                    0.99e9 - std::max(std::abs(map.origin[0]), std::abs(map.origin[1])));
  }

  [[nodiscard]] std::vector<Eigen::VectorXd> DirectionsAway(const Obstacle& obstacle, int step) const {
    if (obstacle.kind() == Obstacle::Kind::kHalfSpace) return {obstacle.points()[0].normalized()};
    const Projection& projection = certifier_.projection();
    const int p = projection.dim();
    Zonotope place;
    projection.Enclose(tube_.slice(step), tube_.half_width(step), place);
    std::vector<Eigen::VectorXd> directions;
    const Eigen::VectorXd outward = (obstacle.lower() + obstacle.upper()).head(p) / 2 - place.CenterVector();
    if (outward.norm() > 0) directions.push_back(outward.normalized());
    // Some direction has to be left when the place lies around the obstacle's middle.
    for (int k = 0; k < p; ++k)
      for (const double sign : {-1.0, 1.0}) directions.push_back(sign * Eigen::VectorXd::Unit(p, k));
    return directions;
  }

  const Certifier& certifier_;
  const Plan& plan_;
  Tube& tube_;
  const SearchEffort& effort_;
  bool goes_on_ = true;
};

}  // namespace

std::optional<std::vector<GivingWay>> FindWayClear(const Certifier& certifier, const Plan& plan,
                                                   std::span<const Obstacle> obstacles, Tube& tube,
                                                   const SearchEffort& effort) {
  WayClearSearch search(certifier, plan, tube, effort);
  std::vector<GivingWay> ways;
  for (std::size_t o = 0; o < obstacles.size(); ++o) {
    if (!search.GoesOn()) return std::nullopt;
    const std::optional<Decision> touch = search.Touch(obstacles[o]);
    if (!touch) continue;
    std::optional<Eigen::VectorXd> shift = search.LeastShift(obstacles[o], *touch);
    if (!shift) return std::nullopt;
    ways.push_back({static_cast<int>(o), touch->step, std::move(*shift)});
  }
  return ways;
}

Obstacle Shifted(const Obstacle& obstacle, const Eigen::VectorXd& by) {
  const auto make = [&]() -> Obstacle {
    const auto& points = obstacle.points();
    switch (obstacle.kind()) {
      case Obstacle::Kind::kCircle: return Obstacle::Circle(points[0] + by, obstacle.radius());
      case Obstacle::Kind::kBox: return Obstacle::AxisBox(points[0] + by, points[1] + by);
      case Obstacle::Kind::kPolygon: {
        std::vector<Eigen::VectorXd> vertices;
        for (const Eigen::VectorXd& vertex : points) vertices.push_back(vertex + by);
        return Obstacle::Polygon(vertices);
      }
      case Obstacle::Kind::kGrid:
        return Obstacle::Grid(std::make_shared<const OccupancyGrid>(obstacle.grid()->Shifted(by)));
      case Obstacle::Kind::kHalfSpace: break;
    }
    return Obstacle::HalfSpace(points[0], obstacle.offset() + points[0].dot(by));
  };
  const Obstacle shifted = make().Named(obstacle.name());
  return obstacle.motion() ? shifted.Moving(*obstacle.motion()) : shifted;
}

std::vector<Obstacle> Shifted(std::span<const Obstacle> obstacles, const std::vector<GivingWay>& ways) {
  std::vector<Obstacle> shifted(obstacles.begin(), obstacles.end());
  for (const GivingWay& way : ways) shifted[ToSize(way.obstacle)] = Shifted(shifted[ToSize(way.obstacle)], way.shift);
  return shifted;
}

}  // namespace forereach
