/** The robot's body and how far its motion may curve between two samples. Both are declared in the task file. */
#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

#include "forereach/dynamics/model_text.h"
#include "forereach/sets/eigen.h"

namespace forereach {

/** A convex part of the body: conv {points} + {y : |y|_2 <= radius}. Its points are fixed in the robot's own frame, or
they stand where expressions of the state say, as the joints of an arm do. */
struct BodyPart {
  std::vector<Eigen::Vector3d> points{Eigen::Vector3d::Zero()};  ///< In the frame, metres; unused entries are 0.
  double radius = 0;                                             ///< Metres, not negative.
  /** If there are any: instead of `points`, each point by its p safety coordinates in metres, expressions of the
  model's states, parameters and definitions. */
  std::vector<std::vector<ExpressionText>> places = {};

  [[nodiscard]] int num_points() const { return static_cast<int>(places.empty() ? points.size() : places.size()); }
  /** All coordinates of all places, one after the other. */
  [[nodiscard]] std::vector<ExpressionText> Coordinates() const {
    std::vector<ExpressionText> all;
    for (const auto& place : places) all.insert(all.end(), place.begin(), place.end());
    return all;
  }

  friend bool operator==(const BodyPart&, const BodyPart&) = default;
};

/** The body, the union of its parts. The place of a point q of the robot's frame in the state x is
    g_q(x) = P x + R(x_heading) q,
with P the problem's projection and R the rotation by an angle in the first two coordinates. Without a heading,
g_q(x) = P x + q. The default is the point P x. P may be zero if every part stands at expressions. */
struct Body {
  int heading = -1;  ///< The state that is the heading in radians; -1: the body does not turn.
  std::vector<BodyPart> parts{BodyPart{}};

  [[nodiscard]] bool HasPlaces() const {
    return std::ranges::any_of(parts, [](const BodyPart& part) { return !part.places.empty(); });
  }
  /** The coordinates of all parts, one part after the other. */
  [[nodiscard]] std::vector<ExpressionText> Coordinates() const {
    std::vector<ExpressionText> all;
    for (const BodyPart& part : parts) std::ranges::move(part.Coordinates(), std::back_inserter(all));
    return all;
  }

  friend bool operator==(const Body&, const Body&) = default;
};

/** The declared bounds on the true motion between two samples, which are at most `period` apart. With y(s) = P x(s):
    |y_k''| <= acceleration_k,    |theta'| <= turn_rate,    |theta''| <= turn_acceleration.
The first is also the bound on each coordinate of a place that expressions give. So y(s) lies in conv(P X_t u P X_{t+1})
+ [-e, e] with e_k = acceleration_k period^2 / 8, and the place of a body's point q deviates by |q| (turn_rate^2 +
turn_acceleration) period^2 / 8 more. docs/soundness.md has the proof. */
struct Between {
  Eigen::VectorXd acceleration;  ///< p entries, m/s^2, not negative.
  double turn_rate = 0;          ///< rad/s, not negative.
  double turn_acceleration = 0;  ///< rad/s^2, not negative.
  double period = 0;             ///< The longest time from one sample to the next, s (task/step_time.h).
};

}  // namespace forereach
