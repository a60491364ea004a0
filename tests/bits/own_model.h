/** A user's own nominal model: a unicycle with drag. Every operation that a model may use occurs in it. */
#pragma once

#include <array>
#include <cmath>
#include <span>

struct Unicycle {
  static constexpr int kStates = 5, kInputs = 2;
  static constexpr const char* kName = "unicycle_with_drag";
  static constexpr std::array<const char*, kStates> kStateNames{"x", "y", "theta", "v", "lean"};  // m, m, rad, m/s, rad
  static constexpr std::array<const char*, kInputs> kInputNames{"acceleration", "turn"};          // m/s^2, rad/s
  static constexpr std::array<const char*, 3> kParameterNames{"dt", "drag", "length"};            // s, 1/s, m

  double dt, drag, length;

  template <class T>
  static constexpr void Step(std::span<const T> parameters, std::span<const T> z, std::span<T> next) {
    using std::cos, std::sin, std::tan;
    const T &dt = parameters[0], &drag = parameters[1], &length = parameters[2];
    const T &theta = z[2], &v = z[3], &lean = z[4], &acceleration = z[5], &turn = z[6];
    next[0] = z[0] + dt * (v * cos(theta));
    next[1] = z[1] + dt * (v * sin(theta));
    next[2] = theta + dt * turn + dt / length * (v * tan(lean));
    next[3] = v + dt * (acceleration - drag * v / (T(1) + lean * lean));
    next[4] = lean - -(dt * (v * turn) / T(8));
  }

  [[nodiscard]] std::array<double, 3> parameters() const { return {dt, drag, length}; }
};
