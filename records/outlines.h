/** Outlines of what a picture shows of a body and of obstacles that move, in plain arithmetic: for display, not for
bounds. */
#pragma once

#include <vector>

#include "forereach/certify/certifier.h"
#include "forereach/dynamics/text_program.h"
#include "records/picture.h"

namespace forereach {

/** The convex hull, counter-clockwise, of points in the plane, each with a disc of this radius: 16 corners. */
[[nodiscard]] Picture::Polygon HullOf(const std::vector<Eigen::Vector2d>& points, double radius = 0);

/** What the robot sweeps in each unit of a tube (forereach/certify/safety.h) up to `last`: a polygon for each part. For
a point at the samples it is the projected slice. @pre p = 2. */
[[nodiscard]] std::vector<std::vector<Picture::Polygon>> Sweeps(const Certifier& certifier, const Tube& tube, int last);

/** The body in many states: what its texts mean is read once. */
class BodyOutlines final {
 public:
  /** @param problem must outlive it. @pre p = 2. */
  explicit BodyOutlines(const Problem& problem);

  /** The parts of the body in the state x. Nothing for a point. */
  [[nodiscard]] std::vector<Picture::Polygon> At(const Eigen::VectorXd& x) const;

 private:
  const Problem& problem_;
  std::vector<std::vector<TextFunction>> places_;  // of each part
};

/** The same of one state. */
[[nodiscard]] inline std::vector<Picture::Polygon> BodyAt(const Problem& problem, const Eigen::VectorXd& x) {
  return BodyOutlines(problem).At(x);
}

/** An obstacle that moves, grown, each half second from its stamp for two seconds, as far as it is there. Nothing for
one that stands and for a half-space. @pre p = 2. */
[[nodiscard]] std::vector<Picture::Polygon> PredictionOf(const Obstacle& obstacle);

/** The corners of an obstacle's core. @pre p = 2, and it is no half-space. */
[[nodiscard]] Picture::Polygon CornersOf(const Obstacle& obstacle);

/** Adds an obstacle's shape and its prediction to a picture. @pre p = 2. */
void AddObstacle(const Obstacle& obstacle, Picture& picture);

}  // namespace forereach
