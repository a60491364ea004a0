/** Outlines of what a picture shows of a body and of obstacles that move, in plain arithmetic: for display, not for
bounds. */
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "forereach/certify/certifier.h"
#include "forereach/dynamics/text_program.h"
#include "records/svg.h"

namespace forereach {

/** The convex hull, counter-clockwise, of points in the plane, each with a disc of this radius: 16 corners. */
[[nodiscard]] Svg::Points HullOf(const std::vector<Eigen::Vector2d>& points, double radius = 0);

/** What the robot sweeps in each unit of a tube (forereach/certify/safety.h) up to `last`: a polygon for each part. For
a point at the samples it is the projected slice. @pre p = 2. */
[[nodiscard]] std::vector<std::vector<Svg::Points>> Sweeps(const Certifier& certifier, const Tube& tube, int last);

/** The body in many states: what its texts mean is read once. */
class BodyOutlines final {
 public:
  /** @param problem must outlive it. @pre p = 2. */
  explicit BodyOutlines(const Problem& problem);

  /** The parts of the body in the state x. Nothing for a point. */
  [[nodiscard]] std::vector<Svg::Points> At(const Eigen::VectorXd& x) const;

 private:
  const Problem& problem_;
  std::vector<std::vector<TextFunction>> places_;  // of each part
};

/** The same of one state. */
[[nodiscard]] inline std::vector<Svg::Points> BodyAt(const Problem& problem, const Eigen::VectorXd& x) {
  return BodyOutlines(problem).At(x);
}

/** Where an obstacle is at a time: its core, how far that has moved, and the radius around it. */
struct ObstaclePlace {
  Svg::Points points;
  Eigen::Vector2d shift;
  double radius;
};
/** Nothing for a half-space, and at a time at which it is nowhere. Of a grid, the hull of its cells. @pre p = 2. */
[[nodiscard]] std::optional<ObstaclePlace> PlaceOf(const Obstacle& obstacle, double time_us);

/** An obstacle that moves, grown, each half second from a time for two seconds, as far as it is there. Nothing for one
that stands and for a half-space. @pre p = 2. */
[[nodiscard]] std::vector<Svg::Points> PredictionOf(const Obstacle& obstacle, std::int64_t from_us);

/** Draws an obstacle and its name, if it has one; of a grid its blocks in the frame. One that moves is drawn as it is
at each of the times, one a second of the drawing's own clock, and if there is one time as it is then. Nothing for an
obstacle of another dimension.
@param frame half-planes are much larger than it. */
void DrawObstacle(const Obstacle& obstacle, const std::vector<double>& times_us, const Eigen::AlignedBox2d& frame,
                  std::string_view name, Svg& svg);

}  // namespace forereach
