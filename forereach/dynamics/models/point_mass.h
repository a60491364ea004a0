/** Point mass in the plane: p+ = p + dt v + dt^2/2 u, v+ = v + dt u, with p in m, v in m/s and u in m/s^2. The model is
affine, so its remainder is exactly zero. It is the exact solution of p' = v, v' = u for a constant u. */
#pragma once

#include <array>
#include <span>

#include "forereach/numerics/compilation.h"

namespace forereach {

struct PointMass {
  static constexpr int kStates = 4, kInputs = 2;
  static constexpr const char* kName = "point_mass";
  static constexpr std::array<const char*, kStates> kStateNames{"px", "py", "vx", "vy"};  // m, m/s
  static constexpr std::array<const char*, kInputs> kInputNames{"ax", "ay"};              // m/s^2
  static constexpr std::array<const char*, 1> kParameterNames{"dt"};                      // s

  double dt;  ///< s

  /** The equations for every scalar type. @param parameters dt. @param z (px, py, vx, vy, ax, ay).
  @param next the four states after the step. */
  template <class T>
  static constexpr void Step(std::span<const T> parameters, std::span<const T> z, std::span<T> next) {
    const T& dt = parameters[0];
    const T half_square = dt * dt / T(2);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      next[axis] = z[axis] + dt * z[axis + 2] + half_square * z[axis + 4];
      next[axis + 2] = z[axis + 2] + dt * z[axis + 4];
    }
  }

  /** The equations in continuous time: `rate` is x'. Arguments as for Step. */
  template <class T>
  static constexpr void Rate(std::span<const T>, std::span<const T> z, std::span<T> rate) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      rate[axis] = z[axis + 2];
      rate[axis + 2] = z[axis + 4];
    }
  }

  [[nodiscard]] std::array<double, 1> parameters() const { return {dt}; }

  template <class T>
  void operator()(std::span<const T> z, std::span<T> next) const {
    const std::array<T, 1> exact{T(dt)};
    Step<T>(exact, z, next);
  }
};

}  // namespace forereach
