#include "verifier/slopes.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace forereach::verifier {
namespace {

// With t = |tan delta|, x = beta v^2 t / l, E = x - beta mu g, c = dt kappa / l, phi the gate:
//   |d r_theta / d v|     = c t (phi(E) + 2 x phi'(E)),
//   |d r_theta / d delta| = c |v| (1 + t^2) (phi(E) + x phi'(E)).
// z = (x, y, theta, v, a, delta, jerk, steer_rate), p = (dt, l, kappa, mu, g, beta).
class HeadingSaturationSlopes final : public Slopes {
 public:
  static constexpr std::array<std::string_view, 6> kParameters{"dt",       "wheelbase", "understeer",
                                                               "friction", "gravity",   "gate_temperature"};

  std::vector<std::pair<int, int>> Entries() const override { return {{2, 3}, {2, 5}}; }

  Dual At(int, int column, std::span<const Dual> z, std::span<const Dual> p) const override {
    const Dual &v = z[3], t = abs(tan(z[5]));
    const Dual c = p[0] * p[2] / p[1], x = p[5] * sqr(v) * t / p[1], e = x - p[5] * p[3] * p[4];
    const Dual phi = Gate(e), slope = x * GateSlope(e);
    return column == 3 ? c * t * (phi + 2.0 * slope) : c * abs(v) * (1.0 + sqr(t)) * (phi + slope);
  }
};

// With s^2 = |v|^2 + delta_s, l = t log(1 + exp((s - k) / t)), p its derivative, nu = (s + eps) p - l:
//   d a_i / d v_j = l / (s + eps) M_ij + nu / (s (s + eps)^2) (M v)_i v_j,  M = [-gamma, -kappa; kappa, -gamma],
// times dt^2/2 for the positions, dt for the velocities. z = (px, py, vx, vy, ax, ay),
// p = (dt, gamma, kappa, k, t, eps, delta_s).
class VelocityKneeSlopes final : public Slopes {
 public:
  static constexpr std::array<std::string_view, 7> kParameters{
      "dt", "damping", "cross", "knee", "softplus_temperature", "regularizer", "smoothing"};

  std::vector<std::pair<int, int>> Entries() const override {
    return {{0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 2}, {2, 3}, {3, 2}, {3, 3}};
  }

  Dual At(int row, int column, std::span<const Dual> z, std::span<const Dual> p) const override {
    const Dual &dt = p[0], &gamma = p[1], &kappa = p[2], &vx = z[2], &vy = z[3];
    const Dual s = sqrt(sqr(vx) + sqr(vy) + p[6]), excess = s - p[3], reach = s + p[5];
    const Dual ramp = SoftRamp(excess, p[4]), nu = reach * SoftStep(excess, p[4]) - ramp;
    const bool first = row % 2 == 0, along = row % 2 == column - 2;
    const Dual m = along ? 0.0 - gamma : first ? 0.0 - kappa : kappa;
    const Dual mv = first ? 0.0 - gamma * vx - kappa * vy : kappa * vx - gamma * vy;
    const Dual slope = ramp / reach * m + nu / (s * sqr(reach)) * (mv * (column == 2 ? vx : vy));
    return (row < 2 ? sqr(dt) * 0.5 : dt) * slope;
  }
};

template <class Known>
bool HasParameters(const ParametricResidual& residual) {
  return std::ranges::equal(residual.parameters, Known::kParameters, {}, &ParametricResidual::Parameter::name);
}

}  // namespace

std::unique_ptr<Slopes> SlopesOf(const ParametricResidual& residual) {
  if (residual.name == "heading_saturation" && HasParameters<HeadingSaturationSlopes>(residual))
    return std::make_unique<HeadingSaturationSlopes>();
  if (residual.name == "velocity_knee" && HasParameters<VelocityKneeSlopes>(residual))
    return std::make_unique<VelocityKneeSlopes>();
  return nullptr;
}

}  // namespace forereach::verifier
