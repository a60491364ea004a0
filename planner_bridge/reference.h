/** What a policy of the bicycle is asked to follow, and how it is told. Definitions of our own. */
#pragma once

#include <Eigen/Core>

#include "certifier/dynamics/model.h"

namespace forereach {

/** The rollout of the nominal bicycle without controls: constant acceleration, constant steering angle. A line or an
arc, and feasible by construction. */
struct Reference {
  Eigen::MatrixXd states;  ///< 6-by-(T+1); the first is where it starts
};

/** @param start x, y, theta, v, a, delta. */
[[nodiscard]] Reference MakeReference(const NominalModel& bicycle, const Eigen::VectorXd& start, int steps);

/** How far references of a robot that drives to a goal go, and so what a policy for it has to be taught. */
inline constexpr double kCruiseSpeed = 10;        ///< m/s, at the start; 0 at least
inline constexpr double kCruiseAcceleration = 2;  ///< m/s^2, either sign
inline constexpr double kCruiseSteering = 0.3;    ///< rad, either sign
inline constexpr double kCruiseLateral = 6;       ///< m/s^2, v^2 tan(delta) / wheelbase at the faster end

/** The largest steering angle of such a reference. @param speed its largest, m/s. */
[[nodiscard]] double CruiseSteering(double speed, double wheelbase);

inline constexpr int kFeatures = 12;

/** The features: the robot's state, then the end of the reference, both seen from the reference's start (position
turned by -theta, heading less theta). So a policy acts the same wherever it is and however it stands. */
[[nodiscard]] Eigen::VectorXd Features(const Eigen::VectorXd& state, const Reference& reference);

/** The nominal states under a block of controls, one column more than the block. */
[[nodiscard]] Eigen::MatrixXd Rollout(const NominalModel& model, const Eigen::VectorXd& start,
                                      const Eigen::MatrixXd& controls);

}  // namespace forereach
