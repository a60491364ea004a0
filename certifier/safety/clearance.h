/** Where the parts of the body are, and how far they are from obstacles, in plain arithmetic: for planning, simulation
and display, not for bounds. */
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "certifier/safety/body.h"
#include "certifier/safety/motion.h"
#include "certifier/safety/obstacle.h"

namespace forereach {

/** The parts of the body in the safety coordinates: each point q is at position + R(heading) q.
@param position p entries, metres. @param heading radians; unused if the body does not turn. */
[[nodiscard]] std::vector<BodyPart> PlaceBody(const Body& body, const Eigen::VectorXd& position, double heading);

/** The same in the state x. @param projection P, p-by-n. @param x n entries. */
[[nodiscard]] std::vector<BodyPart> PlaceBody(const Body& body, const Eigen::MatrixXd& projection,
                                              std::span<const double> x);

/** How far a point of this part may be from the chord between its places at two samples, metres: the length of e and
|q| (w^2 + alpha) period^2 / 8 (body.h). */
[[nodiscard]] double Deviation(const Between& between, const BodyPart& part);

/** The distance in metres from a part to the obstacle; not positive if they meet. If even the part's points surround a
point of the obstacle's core, it is minus both radii. A motion is ignored. For a part of one point and no radius it is
ApproximateDistance of the point. Cost: a few passes over the points of both. */
[[nodiscard]] double ApproximateDistance(const Obstacle& obstacle, const BodyPart& part);

/** The same at a time in microseconds, of a moving obstacle with its growth then; infinite outside its window. */
[[nodiscard]] double ApproximateDistance(const Obstacle& obstacle, const BodyPart& part, std::int64_t time_us);

/** The least distance between the obstacle and the hull of a part's places, while the part moves in a straight line
from sample `first` to sample `last` of the schedule; infinite if the obstacle is nowhere in that time. The obstacle has
the largest growth of that time, and all clock errors are allowed for. @param from, to the part at these samples, with
the same number of points. */
[[nodiscard]] double ApproximateDistance(const Obstacle& obstacle, const BodyPart& from, const BodyPart& to,
                                         const Schedule& schedule, int first, int last);

}  // namespace forereach
