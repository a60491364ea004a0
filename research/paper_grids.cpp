#include "research/paper_grids.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace forereach::research {
namespace {

// psi(E) = exp(-1/E) / E^2, given exp(-1/E); its maximum is at E = 1/2.
double Psi(double e, double gate) { return e > 0 ? gate / (e * e) : 0; }
const double kLargestPsi = 4 * std::exp(-2.0);

}  // namespace

PointMassGrid PaperPointMassGrid(const VelocityKnee& r, double largest_speed, int cells) {
  const double first = std::sqrt(r.smoothing), last = std::sqrt(largest_speed * largest_speed + r.smoothing);
  const double m = std::hypot(r.damping, r.cross);
  const auto w = [&](double s) { return (s * s - r.smoothing) / (s * (s + r.regularizer) * (s + r.regularizer)); };
  // w's maximum, the positive root of s^3 - eps s^2 - 3 delta s - eps delta, is next to eps.
  double root = r.regularizer;
  for (int i = 0; i < 50; ++i) {
    const double value = ((root - r.regularizer) * root - 3 * r.smoothing) * root - r.regularizer * r.smoothing;
    root -= value / ((3 * root - 2 * r.regularizer) * root - 3 * r.smoothing);
  }
  double diagonal = 0, cross = 0;
  for (int i = 0; i < cells; ++i) {
    const double a = first + (last - first) * i / cells, b = first + (last - first) * (i + 1) / cells;
    const double u = (b - r.knee) / r.softplus_temperature;
    const double ramp = Softplus(b - r.knee, r.softplus_temperature), p = 1 / (1 + std::exp(-u));
    const double g = ramp / (b + r.regularizer), nu = (b + r.regularizer) * p - ramp;
    const double largest_w = a <= root && root <= b ? w(root) : std::max(w(a), w(b));
    const double h = nu * largest_w;
    diagonal = std::max(diagonal, r.damping * g + (r.damping + m) / 2 * h);
    cross = std::max(cross, r.cross * g + (r.cross + m) / 2 * h);
  }
  return {r.dt * r.dt / 2 * diagonal, r.dt * r.dt / 2 * cross, r.dt * diagonal, r.dt * cross};
}

BicycleGrid PaperBicycleGrid(const HeadingSaturation& low, const HeadingSaturation& high, double largest_speed,
                             double largest_steering, int speed_cells, int steering_cells) {
  const double c = high.dt * high.understeer / low.wheelbase;
  const double beta = high.gate_temperature, bend_of = beta / low.wheelbase;
  std::vector<double> tangent(static_cast<std::size_t>(steering_cells) + 1);
  for (std::size_t j = 0; j < tangent.size(); ++j)
    tangent[j] = std::tan(largest_steering * static_cast<double>(j) / steering_cells);
  // E, the largest over the parameters where it is positive, and the least where that is.
  const auto largest_argument = [&](double v, double t) {
    return beta * (v * v * t / low.wheelbase - low.friction * low.gravity);
  };
  const auto least_argument = [&](double v, double t) {
    return low.gate_temperature * (v * v * t / high.wheelbase - high.friction * high.gravity);
  };
  BicycleGrid largest{0, 0};
  for (int i = 0; i < speed_cells; ++i) {
    const double v_low = largest_speed * i / speed_cells, v = largest_speed * (i + 1) / speed_cells;
    for (std::size_t j = 0; j + 1 < tangent.size(); ++j) {
      const double t = tangent[j + 1], e = largest_argument(v, t);
      if (!(e > 0)) continue;
      const double gate = std::exp(-1 / e), e_low = least_argument(v_low, tangent[j]);
      const double psi = e <= 0.5 ? Psi(e, gate) : e_low >= 0.5 ? Psi(e_low, SmoothGate(e_low)) : kLargestPsi;
      const double bend = bend_of * v * v * t * psi;
      largest.by_speed = std::max(largest.by_speed, c * t * (gate + 2 * bend));
      largest.by_steering = std::max(largest.by_steering, c * v * (1 + t * t) * (gate + bend));
    }
  }
  return largest;
}

}  // namespace forereach::research
