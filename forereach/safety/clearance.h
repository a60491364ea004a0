/** Where the parts of the body are, and how far they are from obstacles, in plain arithmetic: for planning, simulation
and display, not for bounds. */
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "forereach/dynamics/model.h"
#include "forereach/dynamics/text_program.h"
#include "forereach/safety/body.h"
#include "forereach/safety/motion.h"
#include "forereach/safety/obstacle.h"

namespace forereach {

/** Whether a part is in the robot's frame. Otherwise P x says nothing about where the body is. */
[[nodiscard]] bool HasFrame(const Body& body);

/** Where the parts of a body are in the states of a model: those in the robot's frame by g_q(x) of body.h, those at
expressions by the values of these for the middles of the parameters. */
class BodyPlaces final {
 public:
  /** @param projection P, p-by-n. @pre Placement (placement.h) takes model, projection and body.
  @throws as MakeProgram (text_program.h) if an expression is wrong. */
  BodyPlaces(const NominalModel& model, Eigen::MatrixXd projection, const Body& body);

  /** The parts in the state x, as points and radius in the safety coordinates, metres. @param x n entries. */
  [[nodiscard]] std::vector<BodyPart> At(std::span<const double> x) const;

  /** Places the parts in the robot's frame at P x = position, metres, with this heading, radians, and leaves those at
  expressions as they are. @param parts of an At, is changed. */
  void MoveFrame(const Eigen::VectorXd& position, double heading, std::vector<BodyPart>& parts) const;

  /** Whether part i stands at expressions. */
  [[nodiscard]] bool IsAtExpressions(std::size_t i) const { return !body_.parts[i].places.empty(); }
  /** P x, metres, and the heading in x, radians; 0 if the body does not turn. */
  [[nodiscard]] Eigen::VectorXd Position(std::span<const double> x) const;
  [[nodiscard]] double Heading(std::span<const double> x) const;

 private:
  Eigen::MatrixXd projection_;
  Body body_;
  std::vector<BodyPart> unplaced_;           // one point for each of a part, without texts
  std::optional<TextFunction> coordinates_;  // of all parts at expressions
};

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
