/** Point mass in the plane: p+ = p + dt v + dt^2/2 u, v+ = v + dt u. Affine, so its remainder is exactly zero. */
#pragma once

#include <array>
#include <span>

namespace forereach {

struct PointMass {
  static constexpr int kStates = 4, kInputs = 2;
  static constexpr const char* kName = "point_mass";
  static constexpr std::array<const char*, kStates> kStateNames{"px", "py", "vx", "vy"};  // m, m/s
  static constexpr std::array<const char*, kInputs> kInputNames{"ax", "ay"};              // m/s^2

  double dt;  ///< s

  /** The equations, once, for every scalar: z = (px, py, vx, vy, ax, ay). */
  template <class T>
  void operator()(std::span<const T> z, std::span<T> next) const {
    const T step(dt), half_square = step * step / T(2);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      next[axis] = z[axis] + step * z[axis + 2] + half_square * z[axis + 4];
      next[axis + 2] = z[axis + 2] + step * z[axis + 4];
    }
  }
};

}  // namespace forereach
