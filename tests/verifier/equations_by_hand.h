/** The equations of the compiled models with derivatives written by hand, to compare those of the verifier with. */
#pragma once

#include <span>
#include <vector>

#include "verifier/equations.h"
#include "verifier/ranges.h"

namespace forereach::verifier {

/** p+ = p + dt v + dt^2/2 u, v+ = v + dt u; z = (px, py, vx, vy, ax, ay). */
class PointMassEquations final : public Equations {
 public:
  explicit PointMassEquations(double dt) : dt_(dt) {}

  std::vector<Real> Value(std::span<const Real> z) const override {
    std::vector<Real> next(4);
    const Real step(dt_), half_square = step * step * Real(0.5);
    for (std::size_t i = 0; i < 2; ++i) {
      next[i] = z[i] + step * z[i + 2] + half_square * z[i + 4];
      next[i + 2] = z[i + 2] + step * z[i + 4];
    }
    return next;
  }
  std::vector<FirstDerivative> First(std::span<const Real>) const override {
    const Real step(dt_), half_square = step * step * Real(0.5);
    return {{0, 0, 1.0},         {0, 2, step}, {0, 4, half_square}, {1, 1, 1.0}, {1, 3, step},
            {1, 5, half_square}, {2, 2, 1.0},  {2, 4, step},        {3, 3, 1.0}, {3, 5, step}};
  }
  std::vector<SecondDerivative> Second(std::span<const Real>) const override { return {}; }
  std::vector<Real> Rate(std::span<const Real> z, const Real& h) const override {
    return {z[2] + h * z[4], z[3] + h * z[5], z[4], z[5]};
  }
  std::vector<Real> Flow(std::span<const Real> z) const override { return Rate(z, 0.0); }
  bool IsProportional(int k) const override { return k >= 2; }

 private:
  double dt_;
};

/** x+ = x + dt v cos(theta), y+ = y + dt v sin(theta), theta+ = theta + dt/l v tan(delta), v+ = v + dt a,
a+ = a + dt jerk, delta+ = delta + dt steer_rate; z = (x, y, theta, v, a, delta, jerk, steer_rate). */
class BicycleEquations final : public Equations {
 public:
  BicycleEquations(double dt, double wheelbase) : dt_(dt), wheelbase_(wheelbase) {}

  std::vector<Real> Value(std::span<const Real> z) const override {
    const Real step(dt_);
    const Real &theta = z[2], &v = z[3];
    return {z[0] + step * v * cos(theta),
            z[1] + step * v * sin(theta),
            theta + step / Real(wheelbase_) * v * tan(z[5]),
            v + step * z[4],
            z[4] + step * z[6],
            z[5] + step * z[7]};
  }
  std::vector<FirstDerivative> First(std::span<const Real> z) const override {
    const Real step(dt_), one(1.0), turn = step / Real(wheelbase_);
    const Real s = sin(z[2]), c = cos(z[2]), t = tan(z[5]);
    const Real& v = z[3];
    return {{0, 0, one},
            {0, 2, -(step * v * s)},
            {0, 3, step * c},
            {1, 1, one},
            {1, 2, step * v * c},
            {1, 3, step * s},
            {2, 2, one},
            {2, 3, turn * t},
            {2, 5, turn * v * (one + sqr(t))},
            {3, 3, one},
            {3, 4, step},
            {4, 4, one},
            {4, 6, step},
            {5, 5, one},
            {5, 7, step}};
  }
  std::vector<SecondDerivative> Second(std::span<const Real> z) const override {
    const Real step(dt_), one(1.0), turn = step / Real(wheelbase_);
    const Real s = sin(z[2]), c = cos(z[2]), t = tan(z[5]);
    const Real& v = z[3];
    const Real bent = t.IsFinite() ? TangentBend(t) : t;
    return {{0, 2, 2, -(step * v * c)}, {0, 2, 3, -(step * s)},           {1, 2, 2, -(step * v * s)},
            {1, 2, 3, step * c},        {2, 3, 5, turn * (one + sqr(t))}, {2, 5, 5, turn * v * bent}};
  }
  std::vector<Real> Rate(std::span<const Real> z, const Real&) const override {
    return {z[3] * cos(z[2]), z[3] * sin(z[2]), z[3] * tan(z[5]) / Real(wheelbase_), z[4], z[6], z[7]};
  }
  std::vector<Real> Flow(std::span<const Real> z) const override { return Rate(z, 0.0); }
  bool IsProportional(int) const override { return true; }

 private:
  double dt_, wheelbase_;
};

}  // namespace forereach::verifier
