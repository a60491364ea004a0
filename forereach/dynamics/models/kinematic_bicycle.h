/** Kinematic bicycle with jerk and steering rate as inputs, one explicit Euler step:

    x+ = x + dt v cos(theta),  y+ = y + dt v sin(theta),  theta+ = theta + dt / wheelbase v tan(delta),
    v+ = v + dt a,  a+ = a + dt jerk,  delta+ = delta + dt steer_rate.

Its equations in continuous time are
    x' = v cos(theta),  y' = v sin(theta),  theta' = v tan(delta) / wheelbase,  v' = a,  a' = jerk,  delta' =
steer_rate.

Units: m, m, rad, m/s, m/s^2, rad; inputs m/s^3 and rad/s. */
#pragma once

#include <array>
#include <cmath>
#include <span>

#include "forereach/numerics/compilation.h"

namespace forereach {

struct KinematicBicycle {
  static constexpr int kStates = 6, kInputs = 2;
  static constexpr const char* kName = "kinematic_bicycle";
  // m, m, rad, m/s, m/s^2, rad
  static constexpr std::array<const char*, kStates> kStateNames{"x", "y", "theta", "v", "a", "delta"};
  static constexpr std::array<const char*, kInputs> kInputNames{"jerk", "steer_rate"};  // m/s^3, rad/s
  static constexpr std::array<const char*, 2> kParameterNames{"dt", "wheelbase"};       // s, m

  double dt;         ///< s
  double wheelbase;  ///< m

  /** The equations for every scalar type. @param parameters dt, wheelbase.
  @param z (x, y, theta, v, a, delta, jerk, steer_rate). @param next the six states after the step. */
  template <class T>
  static constexpr void Step(std::span<const T> parameters, std::span<const T> z, std::span<T> next) {
    using std::cos, std::sin, std::tan;
    const T &dt = parameters[0], &wheelbase = parameters[1];
    const T &theta = z[2], &v = z[3], &a = z[4], &delta = z[5], &jerk = z[6], &steer_rate = z[7];
    next[0] = z[0] + dt * (v * cos(theta));
    next[1] = z[1] + dt * (v * sin(theta));
    next[2] = theta + dt / wheelbase * (v * tan(delta));
    next[3] = v + dt * a;
    next[4] = a + dt * jerk;
    next[5] = delta + dt * steer_rate;
  }

  /** The equations in continuous time: `rate` is x'. Arguments as for Step. */
  template <class T>
  static constexpr void Rate(std::span<const T> parameters, std::span<const T> z, std::span<T> rate) {
    using std::cos, std::sin, std::tan;
    const T &theta = z[2], &v = z[3];
    rate[0] = v * cos(theta);
    rate[1] = v * sin(theta);
    rate[2] = v * tan(z[5]) / parameters[1];
    rate[3] = z[4];
    rate[4] = z[6];
    rate[5] = z[7];
  }

  [[nodiscard]] std::array<double, 2> parameters() const { return {dt, wheelbase}; }

  template <class T>
  void operator()(std::span<const T> z, std::span<T> next) const {
    const std::array<T, 2> exact{T(dt), T(wheelbase)};
    Step<T>(exact, z, next);
  }
};

}  // namespace forereach
