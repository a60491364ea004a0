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

// Cells that follow each other along the last axis.
template <std::size_t kAll>
struct CellRow {
  const std::array<double, 2>* values;
  std::array<const double*, kAll> slopes{};
  std::array<std::size_t, kAll> strides{};
  std::array<Lanes, kAll> tilt{};
  // Of the cell: its sides, the parts that are asked for, and what the tilt takes off at their ends.
  std::array<std::array<double, 2>, kAll> side{}, part{};
  std::array<std::array<Lanes, 2>, kAll> taken{};
  std::array<Tent, kAll> tents{};

  FOREREACH_INLINE void Enter(std::size_t a, const double* ticks, double lower, double upper) {
    side[a] = {ticks[0], ticks[1]};
    part[a] = {std::max(lower, ticks[0]), std::min(upper, ticks[1])};
    if (tents[a].slope >= 0) tents[a].SetPart(ticks[0], ticks[1], part[a][0], part[a][1]);
  }
  // Along an axis from a node, of what is `near` and `far`.
  FOREREACH_INLINE Lanes Between(std::size_t a, std::size_t node, const Lanes& near, const Lanes& far) {
    Tent& tent = tents[a];
    if (const double slope = slopes[a][node]; slope != tent.slope) {
      tent.SetSlope(slope, tilt[a]);
      tent.SetPart(side[a][0], side[a][1], part[a][0], part[a][1]);
    }
    return tent.Largest(near, far);
  }
  // Where the first axes run from a node, and the tilt takes `off` there.
  template <std::size_t kAxes>
  FOREREACH_INLINE Lanes Over(std::size_t node, const Lanes& off) {
    if constexpr (kAxes == 0) {
      return AtNode(values[node]) - off;
    } else {
      constexpr std::size_t a = kAxes - 1;
      const Lanes near = Over<a>(node, off + taken[a][0]), far = Over<a>(node + strides[a], off + taken[a][1]);
      return Between(a, node, near, far);
    }
  }
};

}  // namespace

RegionTable::RegionTable(const RegionGrid& grid, std::size_t row, std::span<const double> domain_lower,
                         std::span<const double> domain_upper) {
  const auto cells = [&](std::size_t parts) {
    axes_.clear();
    std::size_t count = 1;
    for (const int variable : grid.variables()) {
      const auto l = ToSize(variable);
      axes_.push_back({variable, TicksOf(domain_lower[l], domain_upper[l], grid.cuts(axes_.size()), parts)});
      count *= axes_.back().ticks.size() - 1;
    }
    return count;
  };
  for (std::size_t parts = kMostStrips; cells(parts) > kMostCells && parts > 1;) parts -= parts / 32 + 1;

  std::size_t nodes = 1;
  for (std::size_t a = axes_.size(); a-- > 0; nodes *= axes_[a].ticks.size()) axes_[a].stride = nodes;
  values_.assign(nodes, {kInfinity, kInfinity});
  if (axes_.size() == 3) sources_.assign(nodes, {-1, -1});
  RegionGrid::Box cell{}, domain{};
  for (std::size_t node = 0; node < nodes; ++node) {
    bool is_cell = true;
    for (const Axis& axis : axes_) {
      const std::size_t tick = node / axis.stride % axis.ticks.size();
      is_cell &= tick + 1 < axis.ticks.size();
      if (!is_cell) break;
      cell.lower[ToSize(axis.variable)] = axis.ticks[tick];
      cell.upper[ToSize(axis.variable)] = axis.ticks[tick + 1];
    }
    if (is_cell) grid.Find(cell);
    for (std::size_t a = 0; a < axes_.size(); ++a) {
      const auto l = ToSize(axes_[a].variable);
      axes_[a].slopes.push_back(is_cell ? grid.LargestSlope(row, a, cell) : kInfinity);
      if (is_cell)
        largest_way_ = std::max(largest_way_, MulUp(axes_[a].slopes.back(), SubUp(cell.upper[l], cell.lower[l])));
    }
  }
  std::ranges::copy(domain_lower, domain.lower.begin());
  std::ranges::copy(domain_upper, domain.upper.begin());
  grid.Find(domain);
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    Axis& axis = axes_[a];
    // What lies on the sides of cells lies in all around it: the least slope holds. Before a first tick there is none.
    const auto spread = [&](std::vector<double>& slopes, const Axis& other) {
      for (std::size_t node = nodes; node-- > other.stride;)
        slopes[node] = std::min(slopes[node], slopes[node - other.stride]);
    };
    for (std::size_t after = a + 1; after < axes_.size(); ++after) spread(axis.slopes, axes_[after]);
    axis.costs = axis.slopes;
    for (std::size_t before = 0; before < a; ++before) spread(axis.costs, axes_[before]);
    for (std::size_t node = 0; node < nodes; ++node)
      if (const std::size_t tick = node / axis.stride % axis.ticks.size(); tick + 1 < axis.ticks.size())
        axis.costs[node] = MulUp(axis.costs[node], SubUp(axis.ticks[tick + 1], axis.ticks[tick]));
    const double width = axis.ticks.back() - axis.ticks.front(), largest = grid.LargestSlope(row, a, domain);
    axis.quantum = axes_.size() < 3 && largest * width < kLargestTilt ? largest / kSlopes : 0;
    axis.least_width = width / static_cast<double>(axis.ticks.size() - 1) * kLeastStrips;
  }
}

// False if no part of the box lies between the ticks.
bool RegionTable::Cover(const Axis& axis, const RegionGrid::Box& box, Part& part) noexcept {
  const std::vector<double>& ticks = axis.ticks;
  const double lower = box.lower[ToSize(axis.variable)], upper = box.upper[ToSize(axis.variable)];
  if (!(lower <= upper && lower <= ticks.back() && upper >= ticks.front())) return false;  // also of NaN
  part.lower = std::max(ticks.front(), lower);
  part.upper = std::min(ticks.back(), upper);
  // The last strip that begins at or below the part, and the last that begins below its upper end.
  const auto begins = ticks.begin(), ends = ticks.end() - 1;
  part.first = ToSize(std::upper_bound(begins, ends, part.lower) - begins) - 1;
  part.last = std::max(part.first + 1, ToSize(std::lower_bound(begins, ends, part.upper) - begins)) - 1;
  return true;
}

bool RegionTable::Cover(const RegionGrid::Box& box, Parts& parts) const noexcept {
  for (std::size_t a = 0; a < axes_.size(); ++a)
    if (!Cover(axes_[a], box, parts[a])) return false;
  return true;
}

bool RegionTable::CoverPoint(std::span<const double> z, Parts& parts) const noexcept {
  RegionGrid::Box at;
  std::ranges::copy(z, at.lower.begin());
  std::ranges::copy(z, at.upper.begin());
  return Cover(at, parts);
}

// Of the first cell of the parts: at the upper ends along the axes whose bits are set.
std::size_t RegionTable::Corner(const Parts& parts, std::size_t corner) const noexcept {
  std::size_t node = 0;
  for (std::size_t a = 0; a < axes_.size(); ++a) node += (parts[a].first + (corner >> a & 1)) * axes_[a].stride;
  return node;
}

void RegionTable::Add(int id, std::span<const double> z, double floor, double ceiling) {
  Parts at;
  if (!CoverPoint(z, at)) return;
  for (std::size_t corner = 0; corner < std::size_t{1} << axes_.size(); ++corner) {
    // Along the last axis within the cell, then on its sides.
    double way = 0;
    std::size_t node = Corner(at, 0);
    for (std::size_t a = axes_.size(); a-- > 0;) {
      const std::size_t up = corner >> a & 1;
      const double tick = axes_[a].ticks[at[a].first + up], z_a = at[a].lower;
      way = AddUp(way, MulUp(axes_[a].slopes[node], std::max(SubUp(tick, z_a), SubUp(z_a, tick))));
      node += up * axes_[a].stride;
    }
    reached_[0].push_back({AddUp(ceiling, way), node, id});
    reached_[1].push_back({AddUp(-floor, way), node, id});
  }
}

// Dijkstra: of two ways to a node the cheaper counts, each sum rounded up.
void RegionTable::Spread(std::size_t side) {
  const auto is_farther = [](const Reached& a, const Reached& b) { return a.value > b.value; };
  std::priority_queue<Reached, std::vector<Reached>, decltype(is_farther)> queue(is_farther);
  const auto reach = [&](const Reached& one) {
    const auto& [value, node, source] = one;
    if (!(value < kInfinity && value < values_[node][side])) return;  // no edge leads beyond the last node
    values_[node][side] = value;
    if (!sources_.empty()) sources_[node][side] = source;
    largest_value_ = std::max(largest_value_, std::abs(value));
    queue.push(one);
  };
  for (const Reached& one : reached_[side]) reach(one);
  reached_[side].clear();
  while (!queue.empty()) {
    const auto [value, node, source] = queue.top();
    queue.pop();
    if (value > values_[node][side]) continue;
    for (const Axis& axis : axes_) {
      reach({AddUp(value, axis.costs[node]), node + axis.stride, source});
      if (node >= axis.stride) reach({AddUp(value, axis.costs[node - axis.stride]), node - axis.stride, source});
    }
  }
}

void RegionTable::Spread() {
  for (const std::size_t side : {0, 1}) Spread(side);
  // 13 roundings at most, of terms that are no larger: docs/soundness.md, 3.20.
  error_ = AddUp(MulUp(32 * kUnitRoundoff, AddUp(largest_value_, MulUp(3, largest_way_))), 0x1p-1060);
}

std::array<int, RegionTable::kMostSources> RegionTable::Sources(std::span<const double> z) const noexcept {
  std::array<int, kMostSources> sources;
  sources.fill(-1);
  auto end = sources.begin();
  if (Parts at; !sources_.empty() && CoverPoint(z, at))
    for (std::size_t corner = 0; corner < std::size_t{1} << axes_.size(); ++corner)
      for (const int source : sources_[Corner(at, corner)])
        if (source >= 0 && std::find(sources.begin(), end, source) == end) *end++ = source;
  return sources;
}

// On the faces at both ends of a cell along the last axis, then along it. A face is the same for both of its cells.
template <std::size_t kAxes>
RegionTable::Bounds RegionTable::OverInline(const Parts& parts, const Tilt& tilt) const noexcept {
  constexpr std::size_t kAlong = kAxes - 1;
  const Lanes infinity = AllLanes(kInfinity);
  CellRow<kAxes> row{values_.data()};
  std::array<std::size_t, kAxes> at;
  for (std::size_t a = 0; a < kAxes; ++a) {
    row.slopes[a] = axes_[a].slopes.data();
    row.strides[a] = axes_[a].stride;
    row.tilt[a] = Tilted(tilt.slope[a]);
    at[a] = parts[a].first;
  }
  const auto taken_at = [&](std::size_t a, std::size_t tick) __attribute__((always_inline)) {
    return row.tilt[a] * AllLanes(axes_[a].ticks[tick] - tilt.center[a]);
  };
  Lanes largest = -infinity;
  for (bool is_last = false; !is_last;) {
    std::size_t node = parts[kAlong].first;
    for (std::size_t a = 0; a < kAlong; ++a) {
      node += at[a] * row.strides[a];
      row.taken[a] = {taken_at(a, at[a]), taken_at(a, at[a] + 1)};
      row.Enter(a, &axes_[a].ticks[at[a]], parts[a].lower, parts[a].upper);
    }
    Lanes far = row.template Over<kAlong>(node, taken_at(kAlong, parts[kAlong].first));
    for (std::size_t tick = parts[kAlong].first; tick <= parts[kAlong].last; ++tick, ++node) {
      const Lanes near = far;
      far = row.template Over<kAlong>(node + 1, taken_at(kAlong, tick + 1));
      row.Enter(kAlong, &axes_[kAlong].ticks[tick], parts[kAlong].lower, parts[kAlong].upper);
      const Lanes here = row.Between(kAlong, node, near, far);
      largest = Max(here < infinity ? here : infinity, largest);  // what is no number bounds nothing
    }
    std::size_t next = kAlong;
    while (next > 0 && at[next - 1] == parts[next - 1].last) --next, at[next] = parts[next].first;
    is_last = next == 0;
    if (!is_last) ++at[next - 1];
  }
  double error = error_;
  for (std::size_t a = 0; a < kAxes; ++a) {
    const double width = axes_[a].ticks.back() - axes_[a].ticks.front();
    error = AddUp(error, MulUp(64 * kUnitRoundoff, MulUp(std::abs(tilt.slope[a]), width)));
  }
  return {{-AddUp(largest[1], error_), AddUp(largest[0], error_)},
          {-AddUp(largest[3], error), AddUp(largest[2], error)},
          tilt};
}

RegionTable::Bounds RegionTable::Over(const Parts& parts, const Tilt& tilt) const noexcept {
  switch (axes_.size()) {
    case 1: return Dispatch<&RegionTable::OverInline<1>>(instructions_, *this, parts, tilt);
    case 2: return Dispatch<&RegionTable::OverInline<2>>(instructions_, *this, parts, tilt);
    default: return Dispatch<&RegionTable::OverInline<3>>(instructions_, *this, parts, tilt);
  }
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
  for (std::size_t a = 0; a < axes_.size(); ++a) middle[a] = point(a, center[ToSize(axes_[a].variable)]);
  Tilt tilt{};
  for (std::size_t a = 0; a < axes_.size(); ++a) {
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
