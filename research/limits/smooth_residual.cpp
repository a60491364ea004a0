#include "research/limits/smooth_residual.h"

namespace forereach::research {
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

constexpr double kRelativeGap = 0.005;

SmoothBounds Largest(const SmoothBounds& a, const SmoothBounds& b) {
  return {std::max(a.value, b.value), std::max(a.slope, b.slope), std::max(a.curvature, b.curvature)};
}

bool IsWithin(const SmoothBounds& a, const SmoothBounds& limit, double gap) {
  return a.value <= limit.value * (1 + gap) && a.slope <= limit.slope * (1 + gap) &&
         a.curvature <= limit.curvature * (1 + gap);
}

// Appends the 2^a parts of a cell, each of the a active sides cut in two.
void Halve(const std::vector<Interval>& cell, std::span<const int> active, std::vector<std::vector<Interval>>& parts) {
  for (unsigned part = 0; part < 1U << active.size(); ++part) {
    std::vector<Interval>& half = parts.emplace_back(cell);
    for (std::size_t a = 0; a < active.size(); ++a) {
      Interval& side = half[static_cast<std::size_t>(active[a])];
      const double middle = side.Middle();
      side = part >> a & 1 ? Interval(middle, side.upper) : Interval(side.lower, middle);
    }
  }
}

}  // namespace

SmoothBounds BoundSmoothness(const ResidualSlopes& slopes, std::span<const double> parameters,
                             std::span<const Interval> box, int halvings) {
  const std::vector<int> active = Occurring(slopes);
  using Cell = std::vector<Interval>;  // the arguments
  Cell whole = Arguments(slopes, parameters);
  std::copy(box.begin(), box.end(), whole.begin());
  std::vector<Cell> cells{whole};
  SmoothBounds seen, bounds;  // at points, of cells that are done
  for (int depth = 0; !cells.empty(); ++depth) {
    std::vector<Cell> open;
    for (const Cell& cell : cells) {
      Cell corner = cell;
      for (const int l : active)
        corner[static_cast<std::size_t>(l)] = Interval(cell[static_cast<std::size_t>(l)].upper);
      seen = Largest(seen, BoundCell(slopes, corner, active));
    }
    for (const Cell& cell : cells) {
      const SmoothBounds of_cell = BoundCell(slopes, cell, active);
      if (depth == halvings || IsWithin(of_cell, seen, kRelativeGap))
        bounds = Largest(bounds, of_cell);
      else
        Halve(cell, active, open);
    }
    cells = std::move(open);
  }
  return bounds;
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

}  // namespace forereach::research
