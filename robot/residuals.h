/** How the paper's real systems differ from their nominal models: r(z) = f*(z) - f0(z), each written once for every
scalar. A scalar needs +, -, *, /, comparison, and the functions named below found by argument-dependent lookup;
one that does not compare overloads SmoothGate and Softplus. */
#pragma once

#include <array>
#include <cmath>
#include <span>

namespace forereach {

/** exp(-1/e) for e > 0, else 0. All derivatives vanish at 0. */
template <class T>
T SmoothGate(const T& e) {
  using std::exp;
  return e > T(0) ? exp(T(-1) / e) : T(0);
}

/** log(1 + exp(x)), without overflow. */
template <class T>
T Softplus(const T& x) {
  using std::exp, std::log1p;
  return x > T(0) ? x + log1p(exp(-x)) : log1p(exp(x));
}

/** Lateral forces saturate: the car turns less than the kinematic bicycle. Over z = (x, y, theta, v, a, delta, jerk,
steer_rate) its only nonzero output is the heading, Eq. (bicycle-residual-heading):
    r_theta = -(dt understeer / wheelbase) v tan(delta) SmoothGate(E),
    E = gate_temperature (|v^2 tan(delta) / wheelbase| - friction gravity).
Exactly zero while the lateral acceleration stays below friction * gravity. Odd in delta. */
struct HeadingSaturation {
  static constexpr const char* kName = "heading_saturation";

  double dt;                      ///< s
  double wheelbase;               ///< m
  double understeer = 0.32;       ///< kappa_us, fraction of the heading rate lost in full saturation
  double friction = 0.9;          ///< mu
  double gravity = 9.81;          ///< m/s^2
  double gate_temperature = 0.1;  ///< beta_bic, s^2/m

  template <class T>
  void operator()(std::span<const T> z, std::span<T> residual) const {
    using std::abs, std::tan;
    const T &v = z[3], turn = tan(z[5]);
    const T lateral = abs(v * v * turn / T(wheelbase));  // m/s^2
    const T gate = SmoothGate(T(gate_temperature) * (lateral - T(friction) * T(gravity)));
    for (T& r : residual) r = T(0);
    residual[2] = -(T(dt) * T(understeer) / T(wheelbase)) * v * turn * gate;
  }
};

/** Drag and a sideways force that set in above a speed. Over z = (px, py, vx, vy, ax, ay),
Eqs. (pointmass-residual-accel), (pointmass-discrete-residual):
    s = sqrt(|v|^2 + smoothing),
    g = softplus_temperature Softplus((s - knee) / softplus_temperature) / (s + regularizer),
    a_r = g M v,  M = [-damping, -cross; cross, -damping],  r = (dt^2/2 a_r, dt a_r).
Odd in v; small below the knee, but not zero. */
struct VelocityKnee {
  static constexpr const char* kName = "velocity_knee";

  double dt;                           ///< s
  double damping = 0.4;                ///< gamma, 1/s
  double cross = 0.3;                  ///< kappa, 1/s
  double knee = 0.9;                   ///< v_knee, m/s
  double softplus_temperature = 0.14;  ///< beta_pm, m/s
  double regularizer = 0.15;           ///< epsilon, m/s
  double smoothing = 1e-12;            ///< delta_s, m^2/s^2

  template <class T>
  void operator()(std::span<const T> z, std::span<T> residual) const {
    using std::sqrt;
    const T &vx = z[2], &vy = z[3];
    const T speed = sqrt(vx * vx + vy * vy + T(smoothing));
    const T excess = T(softplus_temperature) * Softplus((speed - T(knee)) / T(softplus_temperature));
    const T gain = excess / (speed + T(regularizer));
    const std::array<T, 2> acceleration{gain * (-(T(damping) * vx) - T(cross) * vy),
                                        gain * (T(cross) * vx - T(damping) * vy)};
    const T step(dt);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      residual[axis] = step * step / T(2) * acceleration[axis];
      residual[axis + 2] = step * acceleration[axis];
    }
  }
};

}  // namespace forereach
