/** CommonRoad's single-track drift model with the parameters of vehicle 2, a BMW 320i: a car of nine states whose tyres
follow Pacejka's magic formula with combined slip, and whose wheels turn by themselves.

Source: M. Althoff, G. Würsching, "CommonRoad: Vehicle Models" (version 2020a), single-track drift model (STD), tyre
parameters from the ADAMS handbook; the equations and values are those of the program that is published with the paper,
`vehicle_dynamics_std`, `tire_model` and `parameters_vehicle2`. */
#pragma once

#include <Eigen/Core>

namespace forereach::research {

/** x and y of the center of gravity, m; steering angle delta, rad; speed v, m/s; yaw angle psi, rad; yaw rate omega,
rad/s; slip angle beta at the center of gravity, rad; angular speeds of the front and the rear wheels, rad/s. */
using DriftState = Eigen::Matrix<double, 9, 1>;
enum DriftCoordinate { kDriftX, kDriftY, kDelta, kSpeed, kPsi, kOmega, kBeta, kFrontWheel, kRearWheel };

/** Rate of the steering angle, rad/s, and acceleration, m/s^2: the latter is a torque at the wheels, split as the
brakes and the engine split it. */
using DriftInput = Eigen::Vector2d;

/** m */
inline constexpr double kWheelRadius = 0.344;

/** The state with wheels that roll without slip. */
[[nodiscard]] DriftState Rolling(double speed, double delta = 0);

/** The time derivative. Steering and acceleration are limited as the model limits them. Below about 0.2 m/s it turns
into the kinematic model. */
[[nodiscard]] DriftState DriftRate(const DriftState& state, const DriftInput& input);

/** The state after dt with a constant input: the classical Runge-Kutta method in equal steps. */
[[nodiscard]] DriftState Drift(DriftState state, const DriftInput& input, double dt, int steps);

}  // namespace forereach::research
