#include "experiments/limits/smooth_residual.h"

#include <cmath>

namespace forereach::experiments {
namespace {

std::vector<Interval> Arguments(const ResidualSlopes& slopes, std::span<const double> parameters) {
  std::vector<Interval> arguments(static_cast<std::size_t>(slopes.num_variables()), Interval(0.0));
  arguments.insert(arguments.end(), parameters.begin(), parameters.end());
  return arguments;
}

std::vector<int> Occurring(const ResidualSlopes& slopes) {
  std::vector<int> active;
  for (int l = 0; l < slopes.num_variables(); ++l)
    for (int k = 0; k < slopes.num_states(); ++k)
      if (slopes.Occurs(k, l)) {
        active.push_back(l);
        break;
      }
  return active;
}

double AddSquareUp(double sum, const Interval& entry) {
  return AddUp(sum, MulUp(entry.Magnitude(), entry.Magnitude()));
}

// Bounds over one cell.
SmoothBounds BoundCell(const ResidualSlopes& slopes, std::span<const Interval> w, std::span<const int> active) {
  SmoothBounds cell;
  double first = 0, second = 0;
  for (int k = 0; k < slopes.num_states(); ++k)
    for (const int column : active) {
      if (!slopes.Occurs(k, column)) continue;
      const Jet jet = slopes.Enclose(k, column, w, active);
      cell.value = std::max(cell.value, jet.value.Magnitude());
      first = AddSquareUp(first, jet.slope);
      for (std::size_t i = 0; i < active.size(); ++i) second = AddSquareUp(second, jet.curvature[i]);
    }
  cell.slope = SqrtUp(first);
  cell.curvature = SqrtUp(second);
  return cell;
}

}  // namespace

SmoothBounds BoundSmoothness(const ResidualSlopes& slopes, std::span<const double> parameters,
                             std::span<const Interval> box, int cells) {
  const std::vector<int> active = Occurring(slopes);
  std::vector<Interval> w = Arguments(slopes, parameters);
  std::copy(box.begin(), box.end(), w.begin());
  std::vector<int> at(active.size(), 0);
  SmoothBounds bounds;
  for (;;) {
    for (std::size_t a = 0; a < active.size(); ++a) {
      const Interval& side = box[static_cast<std::size_t>(active[a])];
      const auto edge = [&](int i) {
        return i == 0 ? side.lower : i == cells ? side.upper : side.lower + (side.upper - side.lower) * i / cells;
      };
      w[static_cast<std::size_t>(active[a])] = {edge(at[a]), edge(at[a] + 1)};
    }
    const SmoothBounds cell = BoundCell(slopes, w, active);
    bounds.value = std::max(bounds.value, cell.value);
    bounds.slope = std::max(bounds.slope, cell.slope);
    bounds.curvature = std::max(bounds.curvature, cell.curvature);
    std::size_t a = 0;
    while (a < active.size() && at[a] == cells - 1) at[a++] = 0;
    if (a == active.size()) return bounds;
    ++at[a];
  }
}

Eigen::MatrixXd JacobianAt(const ResidualSlopes& slopes, std::span<const double> parameters,
                           std::span<const double> z) {
  std::vector<Interval> w = Arguments(slopes, parameters);
  std::copy(z.begin(), z.end(), w.begin());
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(slopes.num_states(), slopes.num_variables());
  for (int k = 0; k < slopes.num_states(); ++k)
    for (int l = 0; l < slopes.num_variables(); ++l)
      if (slopes.Occurs(k, l)) jacobian(k, l) = slopes.Enclose(k, l, w, std::array{l}).slope.Middle();
  return jacobian;
}

SmoothResidual ZeroResidual(int num_states, int num_variables) {
  return {[](std::span<const long double>, std::span<long double> r) { std::ranges::fill(r, 0.0L); },
          [=](std::span<const double>) { return Eigen::MatrixXd(Eigen::MatrixXd::Zero(num_states, num_variables)); },
          {}};
}

}  // namespace forereach::experiments
