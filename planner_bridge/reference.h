/** References and features of the bicycle's policies. The paper does not define them; these are our definitions. */
#pragma once

#include <Eigen/Core>

#include "forereach/dynamics/model.h"

namespace forereach {

/** The rollout of the nominal bicycle with zero inputs: constant acceleration and constant steering angle. It is a line
or an arc and feasible by construction. */
struct Reference {
  Eigen::MatrixXd states;  ///< 6-by-(T+1); the first column is the start
};

/** @param start x, y, theta, v, a, delta. */
[[nodiscard]] Reference MakeReference(const NominalModel& bicycle, const Eigen::VectorXd& start, int steps);

/** The range of references of a robot that drives to a goal. A policy has to be trained on this range. */
inline constexpr double kCruiseSpeed = 10;        ///< m/s, largest speed at the start; the smallest is 0
inline constexpr double kCruiseAcceleration = 2;  ///< m/s^2, either sign
inline constexpr double kCruiseSteering = 0.3;    ///< rad, either sign
inline constexpr double kCruiseLateral = 6;       ///< m/s^2, v^2 tan(delta) / wheelbase at the faster end

/** The largest steering angle of such a reference, rad. @param speed its largest speed, m/s. @param wheelbase m. */
[[nodiscard]] double CruiseSteering(double speed, double wheelbase);

inline constexpr int kFeatures = 12;

/** The features: the robot's state, then the end of the reference, both relative to the reference's start (position
rotated by -theta, heading minus theta). So the policy's action does not depend on position and heading. */
[[nodiscard]] Eigen::VectorXd Features(const Eigen::VectorXd& state, const Reference& reference);

/** The nominal states under a block of controls, n-by-(T+1) for m-by-T controls. */
[[nodiscard]] Eigen::MatrixXd Rollout(const NominalModel& model, const Eigen::VectorXd& start,
                                      const Eigen::MatrixXd& controls);

}  // namespace forereach
