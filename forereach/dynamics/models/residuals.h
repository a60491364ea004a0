/** The residuals r(z) = f*(z) - f0(z) of the paper's target systems, Eq. (dynamics), compiled: experiments evaluate
them more often than an interpreted text allows (named_residuals.h has the same equations). Each is a template over the
scalar type, like a model (kinematic_bicycle.h): Evaluate takes parameters and coordinates and sets the residual. A
scalar type has the arithmetic operators, comparison, and the functions used below, found by argument-dependent lookup.
A type without comparison overloads SmoothGate and Softplus (saturation.h). */
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "forereach/dynamics/models/kinematic_bicycle.h"
#include "forereach/dynamics/models/point_mass.h"
#include "forereach/dynamics/saturation.h"
#include "forereach/numerics/compilation.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

/** Saturation of lateral forces: the car turns less than the kinematic bicycle. Over z = (x, y, theta, v, a, delta,
jerk, steer_rate), only the heading has a nonzero residual, Eq. (bicycle-residual-heading): r_theta = -(dt understeer /
wheelbase) v tan(delta) SmoothGate(E), E = gate_temperature (|v^2 tan(delta) / wheelbase| - friction gravity). The
residual is exactly zero while the lateral acceleration is below friction * gravity. It is odd in delta. */
struct HeadingSaturation {
  using Nominal = KinematicBicycle;
  static constexpr const char* kName = "heading_saturation";
  static constexpr std::array<const char*, 6> kParameterNames{"dt",       "wheelbase", "understeer",
                                                              "friction", "gravity",   "gate_temperature"};

  double dt;                      ///< s
  double wheelbase;               ///< m
  double understeer = 0.32;       ///< kappa_us, fraction of the heading rate lost in full saturation
  double friction = 0.9;          ///< mu
  double gravity = 9.81;          ///< m/s^2
  double gate_temperature = 0.1;  ///< beta_bic, s^2/m

  [[nodiscard]] std::array<double, 6> parameters() const {
    return {dt, wheelbase, understeer, friction, gravity, gate_temperature};
  }

  template <class T>
  static void Evaluate(std::span<const T> parameters, std::span<const T> z, std::span<T> residual) {
    using std::abs, std::tan;
    const T &dt = parameters[0], &wheelbase = parameters[1], &understeer = parameters[2], &friction = parameters[3],
            &gravity = parameters[4], &gate_temperature = parameters[5];
    const T &v = z[3], turn = tan(z[5]);
    const T lateral = abs(v * v * turn / wheelbase);  // m/s^2
    const T gate = SmoothGate(gate_temperature * (lateral - friction * gravity));
    for (T& r : residual) r = T(0);
    residual[2] = -(dt * understeer / wheelbase) * v * turn * gate;
  }

  template <class T>
  void operator()(std::span<const T> z, std::span<T> residual) const {
    const std::array<T, 6> exact{T(dt), T(wheelbase), T(understeer), T(friction), T(gravity), T(gate_temperature)};
    Evaluate<T>(exact, z, residual);
  }
};

/** Drag and a lateral force that increase above a speed, the knee. Over z = (px, py, vx, vy, ax, ay),
Eqs. (pointmass-residual-accel), (pointmass-discrete-residual):
    s = sqrt(|v|^2 + smoothing),
    g = Softplus(s - knee, softplus_temperature) / (s + regularizer),
    a_r = g M v,  M = [-damping, -cross; cross, -damping],  r = (dt^2/2 a_r, dt a_r).
The residual is odd in v. Below the knee it is small but not zero. */
struct VelocityKnee {
  using Nominal = PointMass;
  static constexpr const char* kName = "velocity_knee";
  static constexpr std::array<const char*, 7> kParameterNames{
      "dt", "damping", "cross", "knee", "softplus_temperature", "regularizer", "smoothing"};

  double dt;                           ///< s
  double damping = 0.4;                ///< gamma, 1/s
  double cross = 0.3;                  ///< kappa, 1/s
  double knee = 0.9;                   ///< v_knee, m/s
  double softplus_temperature = 0.14;  ///< beta_pm, m/s
  double regularizer = 0.15;           ///< epsilon, m/s
  double smoothing = 1e-12;            ///< delta_s, m^2/s^2

  [[nodiscard]] std::array<double, 7> parameters() const {
    return {dt, damping, cross, knee, softplus_temperature, regularizer, smoothing};
  }

  template <class T>
  static void Evaluate(std::span<const T> parameters, std::span<const T> z, std::span<T> residual) {
    using std::sqrt;
    const T &step = parameters[0], &damping = parameters[1], &cross = parameters[2], &knee = parameters[3],
            &softplus_temperature = parameters[4], &regularizer = parameters[5], &smoothing = parameters[6];
    const T &vx = z[2], &vy = z[3];
    const T speed = sqrt(vx * vx + vy * vy + smoothing);
    const T gain = Softplus(speed - knee, softplus_temperature) / (speed + regularizer);
    const std::array<T, 2> acceleration{gain * (-(damping * vx) - cross * vy), gain * (cross * vx - damping * vy)};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      residual[axis] = step * step / T(2) * acceleration[axis];
      residual[axis + 2] = step * acceleration[axis];
    }
  }

  template <class T>
  void operator()(std::span<const T> z, std::span<T> residual) const {
    const std::array<T, 7> exact{T(dt),          T(damping),  T(cross), T(knee), T(softplus_temperature),
                                 T(regularizer), T(smoothing)};
    Evaluate<T>(exact, z, residual);
  }
};

}  // namespace forereach

FOREREACH_ARITHMETIC_END
