#include "forereach/residual/region_table.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/lanes.h"
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

// Four bounds at once: upper ones on r_k and on -r_k, then on both relative to a slope.
FOREREACH_INLINE Lanes Tilted(double rise) { return Lanes{0, 0, rise, -rise}; }
FOREREACH_INLINE Lanes AtNode(const std::array<double, 2>& values) {
  using Pair [[gnu::vector_size(16)]] = double;
  Pair pair;
  __builtin_memcpy(&pair, values.data(), sizeof pair);
  return __builtin_shufflevector(pair, pair, 0, 1, 0, 1);
}

// Of the part [lower, upper] of a cell's side [begin, end]: the largest value there of
// min(p + up (t - begin), q + down (end - t)), p and q at the side's ends.
struct Tent {
  double slope = -1;  // none yet
  Lanes up{}, down{}, share{}, rest{}, steepest{};
  Lanes rising{}, falling{}, top{};  // over the part

  FOREREACH_INLINE void SetSlope(double to, const Lanes& tilt) {
    const Lanes zero = AllLanes(0);
    slope = to;
    up = AllLanes(slope) - tilt;
    down = AllLanes(slope) + tilt;
    // Any share would do; with this one both terms of the maximum are the same.
    share = up == down ? AllLanes(0.5) : down / (up + down);
    rest = AllLanes(1) - share;
    const LaneMask crosses = (up > zero) & (down > zero);
    steepest = crosses ? Max(share * up, rest * down) : AllLanes(kInfinity);
  }
  FOREREACH_INLINE void SetPart(double begin, double end, double lower, double upper) {
    const Lanes zero = AllLanes(0);
    rising = up * (up > zero ? AllLanes(upper - begin) : AllLanes(lower - begin));
    falling = down * (down > zero ? AllLanes(end - lower) : AllLanes(end - upper));
    top = steepest * AllLanes(end - begin);
  }
  // NaN in one of the terms before the last leaves the others; in the last, it is the answer.
  FOREREACH_INLINE Lanes Largest(const Lanes& p, const Lanes& q) const {
    return Min(share * p + rest * q + top, Min(q + falling, p + rising));
  }
};

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
  values_.assign(axes_[0].ticks.size() * axes_[1].ticks.size(), {kInfinity, kInfinity});
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
void RegionTable::Spread(std::size_t side, const std::vector<Reached>& reached) {
  const auto is_farther = [](const Reached& a, const Reached& b) { return a.value > b.value; };
  std::priority_queue<Reached, std::vector<Reached>, decltype(is_farther)> queue(is_farther);
  const auto reach = [&](std::size_t node, double value) {
    if (!(value < values_[node][side])) return;
    values_[node][side] = value;
    largest_value_ = std::max(largest_value_, std::abs(value));
    queue.push({value, static_cast<std::uint32_t>(node)});
  };
  for (const Reached& one : reached) reach(one.node, one.value);
  const std::size_t rows = axes_[0].ticks.size(), columns = axes_[1].ticks.size();
  while (!queue.empty()) {
    const auto [value, node] = queue.top();
    queue.pop();
    if (value > values_[node][side]) continue;
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
  Parts part;
  if (!Cover(at, part)) return;
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
    Spread(side, corners);
  }
  // Nine roundings at most, of terms that are no larger: docs/soundness.md, 3.20.
  error_ = AddUp(MulUp(16 * kUnitRoundoff, AddUp(largest_value_, MulUp(2, largest_way_))), 0x1p-1060);
}

// In each cell along the first axis at both ends of the second, then along the second. Neighbours with the same slope
// have the same bounds where they meet.
RegionTable::Bounds RegionTable::OverInline(const Parts& parts, const Tilt& tilt) const noexcept {
  const Axis &first = axes_[0], &second = axes_[1];
  const Lanes tilt_across = Tilted(tilt.slope[0]), tilt_along = Tilted(tilt.slope[1]), infinity = AllLanes(kInfinity);
  Lanes largest = -infinity;
  Tent along;
  for (std::size_t i = parts[0].first; i <= parts[0].last; ++i) {
    const double begin = first.ticks[i], end = first.ticks[i + 1];
    const Lanes rise = tilt_across * AllLanes(begin - tilt.center[0]),
                rise_at_end = tilt_across * AllLanes(end - tilt.center[0]);
    Tent across;
    Lanes near{}, far{};
    const auto at = [&](std::size_t j) __attribute__((always_inline)) {
      const Lanes more = tilt_along * AllLanes(second.ticks[j] - tilt.center[1]);
      return across.Largest(AtNode(values_[NodeAt(i, j)]) - (rise + more),
                            AtNode(values_[NodeAt(i + 1, j)]) - (rise_at_end + more));
    };
    for (std::size_t j = parts[1].first; j <= parts[1].last; ++j) {
      const std::size_t cell = CellAt(i, j);
      near = far;
      if (first.slopes[cell] != across.slope) {
        across.SetSlope(first.slopes[cell], tilt_across);
        across.SetPart(begin, end, std::max(parts[0].lower, begin), std::min(parts[0].upper, end));
        near = at(j);
      }
      far = at(j + 1);
      if (second.slopes[cell] != along.slope) along.SetSlope(second.slopes[cell], tilt_along);
      const double left = second.ticks[j], right = second.ticks[j + 1];
      along.SetPart(left, right, std::max(parts[1].lower, left), std::min(parts[1].upper, right));
      const Lanes here = along.Largest(near, far);
      largest = Max(here < infinity ? here : infinity, largest);  // what is no number bounds nothing
    }
  }
  double error = error_;
  for (std::size_t a = 0; a < 2; ++a) {
    const double width = axes_[a].ticks.back() - axes_[a].ticks.front();
    error = AddUp(error, MulUp(64 * kUnitRoundoff, MulUp(std::abs(tilt.slope[a]), width)));
  }
  return {{-AddUp(largest[1], error_), AddUp(largest[0], error_)},
          {-AddUp(largest[3], error), AddUp(largest[2], error)},
          tilt};
}

RegionTable::Bounds RegionTable::Over(const Parts& parts, const Tilt& tilt) const noexcept {
  return Dispatch<&RegionTable::OverInline>(instructions_, *this, parts, tilt);
}

RegionTable::Bounds RegionTable::Enclose(const RegionGrid::Box& box, const Tilt& tilt) const noexcept {
  Parts parts;
  return Cover(box, parts) ? Over(parts, tilt) : Bounds{};
}

RegionTable::Bounds RegionTable::EncloseTilted(const RegionGrid::Box& box,
                                               std::span<const double> center) const noexcept {
  Parts parts;
  return Cover(box, parts) ? Over(parts, TiltOver(parts, center, box)) : Bounds{};
}

RegionTable::Tilt RegionTable::TiltOver(const Parts& parts, std::span<const double> center,
                                        const RegionGrid::Box& box) const noexcept {
  // Of the part along an axis, the point nearest to z.
  const auto point = [&](std::size_t a, double z) {
    const Part& part = parts[a];
    const double at = std::clamp(z, part.lower, part.upper);
    std::size_t strip = part.first;
    while (strip < part.last && axes_[a].ticks[strip + 1] <= at) ++strip;
    return Part{at, at, strip, strip};
  };
  Parts middle = parts;
  for (std::size_t a = 0; a < 2; ++a)
    if (axes_[a].variable >= 0) middle[a] = point(a, center[ToSize(axes_[a].variable)]);
  Tilt tilt{};
  for (std::size_t a = 0; a < 2; ++a) {
    const Axis& axis = axes_[a];
    if (!(axis.quantum > 0)) continue;
    const auto l = ToSize(axis.variable);
    if (!(box.upper[l] - box.lower[l] > axis.least_width)) continue;
    tilt.center[a] = center[l];
    const double away = kSecant * 0.5 * (box.upper[l] - box.lower[l]);
    const auto middle_at = [&](double z) {
      Parts at = middle;
      at[a] = point(a, z);
      const Interval bounds = Over(at, {}).plain;
      return 0.5 * bounds.lower + 0.5 * bounds.upper;
    };
    const double secant = (middle_at(center[l] + away) - middle_at(center[l] - away)) / (2 * away);
    if (std::isfinite(secant))
      tilt.slope[a] = axis.quantum * std::clamp(std::round(secant / axis.quantum), -kSlopes, kSlopes);
  }
  return tilt;
}

}  // namespace forereach
