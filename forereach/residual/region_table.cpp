#include "forereach/residual/region_table.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"

namespace forereach {
namespace {

// Sums of what a tilt changes are far from the largest double.
constexpr double kLargestTilt = 0x1p900;
// Of a tilt; numbers that no plan, domain or region is likely to have in its own. The verifier has the same.
constexpr double kSlopes = 250.7, kSecant = 0.83, kLeastStrips = 0.31;

// Along an axis: its ends, all cuts, and even parts between them, at most 1 / parts of the whole way long.
std::vector<double> TicksOf(double lower, double upper, const std::vector<double>& cuts, std::size_t parts) {
  std::vector<double> ends{lower}, ticks;
  ends.insert(ends.end(), cuts.begin(), cuts.end());
  ends.push_back(upper);
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const double begin = ends[i], end = ends[i + 1];
    // By halves: the way may be longer than the largest double. The verifier has the same ticks (soundness 3.20).
    const double share = (end / 2 - begin / 2) / (upper / 2 - lower / 2) * static_cast<double>(parts);
    const int count = share > 1 ? static_cast<int>(std::ceil(share)) : 1;
    ticks.push_back(begin);
    for (int p = 1; p < count; ++p)
      ticks.push_back(std::clamp(begin * (1 - p * (1.0 / count)) + end * (p * (1.0 / count)), begin, end));
  }
  ticks.push_back(upper);
  return ticks;
}

// The largest value on [x, y] of min(p + up (t - a), q + down (b - t)), p and q at the ends of a cell's side. NaN in
// one of the terms behind the first leaves the others; in the first, it is the answer.
double Tent(double p, double q, double up, double down, double a, double b, double x, double y) noexcept {
  const double rising = p + up * ((up > 0 ? y : x) - a), falling = q + down * (b - (down > 0 ? x : y));
  if (!(up > 0 && down > 0)) return std::min(rising, falling);
  // Any share would do; with this one both terms are the same.
  const double share = up == down ? 0.5 : down / (up + down);
  const double crossing = share * p + (1 - share) * q + std::max(share * up, (1 - share) * down) * (b - a);
  return std::min(std::min(rising, falling), crossing);
}

}  // namespace

RegionTable::RegionTable(const RegionGrid& grid, std::size_t row, std::span<const double> domain_lower,
                         std::span<const double> domain_upper) {
  const std::vector<int>& variables = grid.variables();
  const auto cells = [&](std::size_t parts) {
    std::size_t count = 1;
    for (std::size_t a = 0; a < variables.size(); ++a) {
      const auto l = ToSize(variables[a]);
      axes_[a].variable = variables[a];
      axes_[a].ticks = TicksOf(domain_lower[l], domain_upper[l], grid.cuts(a), parts);
      count *= axes_[a].ticks.size() - 1;
    }
    return count;
  };
  for (std::size_t parts = kMostStrips; cells(parts) > kMostCells && parts > 1;) parts -= parts / 32 + 1;

  RegionGrid::Box cell{};
  for (std::size_t i = 0; i + 1 < axes_[0].ticks.size(); ++i)
    for (std::size_t j = 0; j + 1 < axes_[1].ticks.size(); ++j) {
      const std::array<std::size_t, 2> at{i, j};
      for (std::size_t a = 0; a < variables.size(); ++a) {
        cell.lower[ToSize(variables[a])] = axes_[a].ticks[at[a]];
        cell.upper[ToSize(variables[a])] = axes_[a].ticks[at[a] + 1];
      }
      grid.Find(cell);
      for (std::size_t a = 0; a < 2; ++a) {
        const double slope = a < variables.size() ? grid.LargestSlope(row, a, cell) : 0;
        axes_[a].slopes.push_back(slope);
        largest_way_ = std::max(largest_way_, MulUp(slope, SubUp(axes_[a].ticks[at[a] + 1], axes_[a].ticks[at[a]])));
      }
    }
  for (std::size_t a = 0; a < variables.size(); ++a) {
    Axis& axis = axes_[a];
    const double width = axis.ticks.back() - axis.ticks.front(), largest = std::ranges::max(axis.slopes);
    axis.quantum = largest * width < kLargestTilt ? largest / kSlopes : 0;
    axis.least_width = width / static_cast<double>(axis.ticks.size() - 1) * kLeastStrips;
  }
  for (std::vector<double>& values : values_) values.assign(axes_[0].ticks.size() * axes_[1].ticks.size(), kInfinity);
}

// False if no part of the box lies between the ticks.
bool RegionTable::Cover(const Axis& axis, const RegionGrid::Box& box, Part& part) noexcept {
  const std::vector<double>& ticks = axis.ticks;
  const bool is_axis = axis.variable >= 0;
  const double lower = is_axis ? box.lower[ToSize(axis.variable)] : 0,
               upper = is_axis ? box.upper[ToSize(axis.variable)] : 0;
  if (!(lower <= upper && lower <= ticks.back() && upper >= ticks.front())) return false;  // also of NaN
  part.lower = std::max(ticks.front(), lower);
  part.upper = std::min(ticks.back(), upper);
  // The last strip that begins at or below the part, and the last that begins below its upper end.
  const auto begins = ticks.begin(), ends = ticks.end() - 1;
  part.first = ToSize(std::upper_bound(begins, ends, part.lower) - begins) - 1;
  part.last = std::max(part.first + 1, ToSize(std::lower_bound(begins, ends, part.upper) - begins)) - 1;
  return true;
}

// Of the edge from node (i, j) up along an axis: it belongs to the cells on both sides, so the lesser slope holds.
double RegionTable::Cost(std::size_t a, std::size_t i, std::size_t j) const {
  const auto& [first, second] = axes_;
  const Axis& along = axes_[a];
  const std::size_t at = a == 0 ? j : i, strips = (a == 0 ? second : first).ticks.size() - 1;
  double slope = kInfinity;
  if (at < strips) slope = along.slopes[CellAt(i, j)];
  if (at > 0) slope = std::min(slope, along.slopes[a == 0 ? CellAt(i, j - 1) : CellAt(i - 1, j)]);
  const std::size_t tick = a == 0 ? i : j;
  return MulUp(slope, SubUp(along.ticks[tick + 1], along.ticks[tick]));
}

// Dijkstra: of two ways to a node the cheaper counts, each sum rounded up.
void RegionTable::Spread(std::vector<double>& values, std::vector<Reached> reached) {
  const auto is_farther = [](const Reached& a, const Reached& b) { return a.value > b.value; };
  std::priority_queue<Reached, std::vector<Reached>, decltype(is_farther)> queue(is_farther);
  const auto reach = [&](std::size_t node, double value) {
    if (!(value < values[node])) return;
    values[node] = value;
    largest_value_ = std::max(largest_value_, std::abs(value));
    queue.push({value, static_cast<std::uint32_t>(node)});
  };
  for (const Reached& one : reached) reach(one.node, one.value);
  const std::size_t rows = axes_[0].ticks.size(), columns = axes_[1].ticks.size();
  while (!queue.empty()) {
    const auto [value, node] = queue.top();
    queue.pop();
    if (value > values[node]) continue;
    const std::size_t i = node / columns, j = node % columns;
    if (i > 0) reach(node - columns, AddUp(value, Cost(0, i - 1, j)));
    if (i + 1 < rows) reach(node + columns, AddUp(value, Cost(0, i, j)));
    if (j > 0) reach(node - 1, AddUp(value, Cost(1, i, j - 1)));
    if (j + 1 < columns) reach(node + 1, AddUp(value, Cost(1, i, j)));
  }
}

void RegionTable::Add(std::span<const double> z, double floor, double ceiling) {
  RegionGrid::Box at;
  std::ranges::copy(z, at.lower.begin());
  std::ranges::copy(z, at.upper.begin());
  std::array<Part, 2> part;
  for (std::size_t a = 0; a < 2; ++a)
    if (!Cover(axes_[a], at, part[a])) return;
  const std::size_t i = part[0].first, j = part[1].first;
  const auto way = [&](std::size_t a, std::size_t tick) {
    const double away =
        std::max(SubUp(axes_[a].ticks[tick], part[a].lower), SubUp(part[a].lower, axes_[a].ticks[tick]));
    return MulUp(axes_[a].slopes[CellAt(i, j)], away);
  };
  for (std::size_t side = 0; side < 2; ++side) {
    std::vector<Reached> corners;
    for (const std::size_t p : {i, i + 1})
      for (const std::size_t q : {j, j + 1})
        corners.push_back({AddUp(side == 0 ? ceiling : -floor, AddUp(way(0, p), way(1, q))),
                           static_cast<std::uint32_t>(NodeAt(p, q))});
    Spread(values_[side], std::move(corners));
  }
  // Nine roundings at most, of terms that are no larger: docs/soundness.md, 3.20.
  error_ = AddUp(MulUp(16 * kUnitRoundoff, AddUp(largest_value_, MulUp(2, largest_way_))), 0x1p-1060);
}

// In the part of cell (i, j): along the first axis at both ends of the second, then along the second.
double RegionTable::LargestIn(const std::vector<double>& values, std::size_t i, std::size_t j, const Part& first,
                              const Part& second, const Tilt& tilt) const noexcept {
  const double *p = &axes_[0].ticks[i], *q = &axes_[1].ticks[j];
  const double lower = std::max(first.lower, p[0]), upper = std::min(first.upper, p[1]);
  const std::array<double, 2>&slope = tilt.slope, &center = tilt.center;
  const auto value = [&](std::size_t m, std::size_t n) {
    return values[NodeAt(i + m, j + n)] - (slope[0] * (p[m] - center[0]) + slope[1] * (q[n] - center[1]));
  };
  const double across = axes_[0].slopes[CellAt(i, j)], along = axes_[1].slopes[CellAt(i, j)];
  const auto largest = [&](std::size_t n) {
    return Tent(value(0, n), value(1, n), across - slope[0], across + slope[0], p[0], p[1], lower, upper);
  };
  return Tent(largest(0), largest(1), along - slope[1], along + slope[1], q[0], q[1], std::max(second.lower, q[0]),
              std::min(second.upper, q[1]));
}

Interval RegionTable::Enclose(const RegionGrid::Box& box, const Tilt& tilt) const noexcept {
  std::array<Part, 2> part;
  for (std::size_t a = 0; a < 2; ++a)
    if (!Cover(axes_[a], box, part[a])) return Interval::Entire();
  const Tilt opposite{{-tilt.slope[0], -tilt.slope[1]}, tilt.center};
  std::array<double, 2> largest{-kInfinity, -kInfinity};
  for (std::size_t i = part[0].first; i <= part[0].last; ++i)
    for (std::size_t j = part[1].first; j <= part[1].last; ++j)
      for (std::size_t side = 0; side < 2; ++side) {
        const double here = LargestIn(values_[side], i, j, part[0], part[1], side == 0 ? tilt : opposite);
        largest[side] =
            std::max(largest[side], here < kInfinity ? here : kInfinity);  // what is no number bounds nothing
      }
  double error = error_;
  for (std::size_t a = 0; a < 2; ++a) {
    const double width = axes_[a].ticks.back() - axes_[a].ticks.front();
    error = AddUp(error, MulUp(64 * kUnitRoundoff, MulUp(std::abs(tilt.slope[a]), width)));
  }
  return {-AddUp(largest[1], error), AddUp(largest[0], error)};
}

RegionTable::Tilt RegionTable::TiltOver(const RegionGrid::Box& box, std::span<const double> center) const noexcept {
  Tilt tilt{};
  RegionGrid::Box at;
  for (const Axis& axis : axes_)
    if (axis.variable >= 0)
      at.lower[ToSize(axis.variable)] = at.upper[ToSize(axis.variable)] = center[ToSize(axis.variable)];
  for (std::size_t a = 0; a < 2; ++a) {
    const auto& [variable, ticks, slopes, quantum, least_width] = axes_[a];
    if (!(quantum > 0)) continue;
    const auto l = ToSize(variable);
    if (!(box.upper[l] - box.lower[l] > least_width)) continue;
    tilt.center[a] = center[l];
    const double away = kSecant * 0.5 * (box.upper[l] - box.lower[l]);
    const auto middle_at = [&](double z) {
      at.lower[l] = at.upper[l] = z;
      const Interval bounds = Enclose(at);
      return 0.5 * bounds.lower + 0.5 * bounds.upper;
    };
    const double secant = (middle_at(center[l] + away) - middle_at(center[l] - away)) / (2 * away);
    at.lower[l] = at.upper[l] = center[l];
    if (std::isfinite(secant)) tilt.slope[a] = quantum * std::clamp(std::round(secant / quantum), -kSlopes, kSlopes);
  }
  return tilt;
}

}  // namespace forereach
