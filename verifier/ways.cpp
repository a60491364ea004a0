#include "verifier/ways.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "forereach/numerics/size.h"
#include "verifier/real.h"

namespace forereach::verifier {
namespace {

double Larger(double a, double b) { return std::max(a, b); }
Real Larger(const Real& a, const Real& b) { return max(a, b); }
double Lesser(double a, double b) { return std::min(a, b); }
Real Lesser(const Real& a, const Real& b) { return min(a, b); }

}  // namespace

Ways::Ways(const Problem& problem) : problem_(problem), sides_(ToSize(problem.model->num_variables())) {
  for (const Region& region : problem.declaration.regions)
    for (const auto& [variable, range] : region.box)
      sides_[ToSize(variable)].insert(sides_[ToSize(variable)].end(), {range.lower, range.upper});
  std::vector<int> others;
  for (int l = 0; l < std::ssize(sides_); ++l) {
    std::ranges::sort(sides_[ToSize(l)]);
    if (sides_[ToSize(l)].empty())
      others.push_back(l);
    else
      moves_.push_back({l});
  }
  moves_.push_back(others);
}

bool Ways::Narrow(int k) const {
  const Declaration& declaration = problem_.declaration;
  const auto corners = problem_.domain.Corners();
  const auto meets = [&](const Region::Side& side) {
    const auto l = ToSize(side.variable);
    return side.range.lower < corners.second[l] && corners.first[l] < side.range.upper;
  };
  return std::ranges::any_of(declaration.regions, [&](const Region& region) {
    return (region.lipschitz.row(k).array() < declaration.lipschitz.row(k).array()).any() &&
           std::ranges::all_of(region.box, meets);
  });
}

void Ways::Cut(Box& box) const {
  const auto [lower, upper] = problem_.domain.Corners();
  for (std::size_t l = 0; l < box.size(); ++l)
    box[l] = {std::max(box[l].first, lower[l]), std::min(box[l].second, upper[l])};
}

template <class Number>
Number Ways::Cheapest(int k, const Eigen::VectorXd& from, const Box& to) const {
  std::vector<std::size_t> order(moves_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::optional<Number> least;
  do {
    Box at;
    for (const double value : from) at.emplace_back(value, value);
    Number sum = 0;
    for (const std::size_t move : order) {
      sum += Move<Number>(k, moves_[move], at, to);
      for (const int l : moves_[move]) at[ToSize(l)] = to[ToSize(l)];
    }
    least = least ? Lesser(*least, sum) : sum;
  } while (std::next_permutation(order.begin(), order.end()));
  return *least;
}

template double Ways::Cheapest<double>(int, const Eigen::VectorXd&, const Box&) const;
template Real Ways::Cheapest<Real>(int, const Eigen::VectorXd&, const Box&) const;

template <class Number>
Number Ways::Move(int k, const std::vector<int>& move, const Box& at, const Box& to) const {
  Number sum = 0;
  for (const int l : move)
    if (problem_.declaration.lipschitz(k, l) > 0)
      sum += Larger(Along<Number>(k, l, at, to[ToSize(l)].first), Along<Number>(k, l, at, to[ToSize(l)].second));
  return sum;
}

// From where the variable is to `end`.
template <class Number>
Number Ways::Along(int k, int variable, const Box& at, double end) const {
  Box piece = at;
  auto& [lower, upper] = piece[ToSize(variable)];
  const double last = std::max(lower, end);
  lower = std::min(lower, end);
  const std::vector<double>& sides = sides_[ToSize(variable)];
  Number sum = 0;
  while (lower < last) {
    const auto next = std::upper_bound(sides.begin(), sides.end(), lower);
    upper = next == sides.end() ? last : std::min(*next, last);
    sum += Number(LargestSlope(k, variable, piece)) * (Number(upper) - Number(lower));
    lower = upper;
  }
  return sum;
}

double Ways::LargestSlope(int k, int variable, const Box& box) const {
  return LargestOf([=](const Region& region) { return region.lipschitz(k, variable); },
                   problem_.declaration.lipschitz(k, variable), box);
}

double Ways::Largest(Eigen::VectorXd Region::*bound, int k, double everywhere, Box box) const {
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  for (auto& [lower, upper] : box)
    lower = std::nextafter(lower, -kUnbounded), upper = std::nextafter(upper, kUnbounded);
  Cut(box);
  return LargestOf([=](const Region& region) { return (region.*bound).size() == 0 ? kUnbounded : (region.*bound)[k]; },
                   everywhere, std::move(box));
}

// By halves at a side that crosses the box, until none does: then a region contains all of it or no inner point.
template <class BoundOf>
double Ways::LargestOf(const BoundOf& bound_of, double everywhere, Box box) const {
  for (std::size_t l = 0; l < box.size(); ++l) {
    const auto [lower, upper] = box[l];
    const auto side = std::upper_bound(sides_[l].begin(), sides_[l].end(), lower);
    if (side == sides_[l].end() || !(*side < upper)) continue;
    Box above = box;
    box[l].second = above[l].first = *side;
    return std::max(LargestOf(bound_of, everywhere, std::move(box)), LargestOf(bound_of, everywhere, std::move(above)));
  }
  for (const Region& region : problem_.declaration.regions)
    if (std::ranges::all_of(region.box, [&](const Region::Side& side) {
          const auto& [lower, upper] = box[ToSize(side.variable)];
          return side.range.lower <= lower && upper <= side.range.upper;
        }))
      everywhere = std::min(everywhere, bound_of(region));
  return everywhere;
}

std::vector<int> Ways::Axes(int k) const {
  const auto [lower, upper] = problem_.domain.Corners();
  Box domain;
  for (std::size_t l = 0; l < lower.size(); ++l) domain.emplace_back(lower[l], upper[l]);
  std::vector<int> axes;
  for (int l = 0; l < std::ssize(sides_); ++l)
    if (!sides_[ToSize(l)].empty())
      axes.push_back(l);
    else if (LargestSlope(k, l, domain) > 0)
      return {};
  return axes;
}

namespace {

// How far roundings may move what is computed in doubles, relative to the larger of the numbers.
constexpr double kRoughly = 0x1p-40;
constexpr std::size_t kMostCells = 32768, kMostStrips = 1024;

// Even parts between neighbours of `ends`, each at most the `parts`-th of the whole.
std::vector<double> Divided(const std::vector<double>& ends, std::size_t parts) {
  const double whole = ends.back() / 2 - ends.front() / 2;
  std::vector<double> ticks;
  for (std::size_t i = 1; i < ends.size(); ++i) {
    const double share = (ends[i] / 2 - ends[i - 1] / 2) / whole * static_cast<double>(parts);
    const int count = share > 1 ? static_cast<int>(std::ceil(share)) : 1;
    for (int p = 0; p < count; ++p)
      ticks.push_back(p == 0 ? ends[i - 1]
                             : std::clamp(ends[i - 1] * (1 - p * (1.0 / count)) + ends[i] * (p * (1.0 / count)),
                                          ends[i - 1], ends[i]));
  }
  ticks.push_back(ends.back());
  return ticks;
}

// The most that min(p + (slope - less) (t - a), q + (slope + less) (b - t)) is for t in [x, y].
Real Most(const Real& p, const Real& q, double slope, double less, const Real& a, const Real& b, const Real& x,
          const Real& y) {
  const Real up = Real(slope) - Real(less), down = Real(slope) + Real(less);
  if (less >= slope) return min(p + up * (x - a), q + down * (b - x));
  if (-less >= slope) return min(p + up * (y - a), q + down * (b - y));
  const Real crossing = (down * p + up * q + up * down * (b - a)) / (up + down);
  return min(min(p + up * (y - a), q + down * (b - x)), crossing);
}

// Whether rounding may have decided otherwise.
constexpr double kNear = 0x1p-23;
// Parts of the largest slope: a declared one is hardly ever half a part off.
constexpr double kSlopes = 250.7;

}  // namespace

Nodes::Nodes(const Ways& ways, int k) : ways_(ways), k_(k) {
  const auto [lower, upper] = ways.problem_.domain.Corners();
  Ways::Box domain;
  for (std::size_t l = 0; l < lower.size(); ++l) domain.emplace_back(lower[l], upper[l]);
  for (std::size_t parts = kMostStrips;; parts -= parts / 32 + 1) {
    std::size_t cells = 1;
    axes_.clear();
    for (const int variable : ways.Axes(k)) {
      const auto l = ToSize(variable);
      std::vector<double> ends{lower[l]};
      for (const double side : ways.sides_[l])
        if (lower[l] < side && side < upper[l] && side != ends.back()) ends.push_back(side);
      ends.push_back(upper[l]);
      axes_.push_back({variable, Divided(ends, parts), ways.LargestSlope(k, variable, domain)});
      cells *= axes_.back().ticks.size() - 1;
    }
    if (cells <= kMostCells || parts == 1) break;
  }
  std::size_t nodes = 1;
  for (Axis& axis : axes_) axis.stride = std::exchange(nodes, nodes * axis.ticks.size());
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  sides_.fill({std::vector<Real>(nodes, Real(kUnbounded)), std::vector<double>(nodes, kUnbounded)});
  for (Axis& axis : axes_)
    for (std::size_t i = 1; i < axis.ticks.size(); ++i)
      axis.widths.push_back(Real(axis.ticks[i]) - Real(axis.ticks[i - 1]));
  for (Axis& axis : axes_) axis.slopes = axis.cells = std::vector<double>(nodes, kUnbounded);
  for (std::size_t cell = 0; cell < nodes; ++cell) {
    if (std::ranges::any_of(axes_, [&](const Axis& axis) { return TickOf(axis, cell) + 1 == axis.ticks.size(); }))
      continue;
    // An edge lies in every cell around it: the least slope holds.
    const std::vector<std::size_t> corners = CornersOf(cell);
    for (Axis& axis : axes_) {
      const double slope = axis.cells[cell] = Slope(axis, cell);
      for (const std::size_t node : corners)
        if (TickOf(axis, node) == TickOf(axis, cell)) axis.slopes[node] = std::min(axis.slopes[node], slope);
    }
  }
}

std::vector<std::size_t> Nodes::CornersOf(std::size_t cell) const {
  std::vector<std::size_t> corners{cell};
  for (const Axis& axis : axes_)
    for (std::size_t i = corners.size(); i-- > 0;) corners.push_back(corners[i] + axis.stride);
  return corners;
}

// On the face that spans the axes up to this one: the least of the cells around.
double Nodes::SlopeOn(std::size_t a, std::size_t node) const {
  std::vector<std::size_t> cells{node};
  for (std::size_t b = a + 1; b < axes_.size(); ++b) {
    const std::size_t tick = TickOf(axes_[b], node);
    std::vector<std::size_t> around;
    for (const std::size_t cell : cells) {
      if (tick > 0) around.push_back(cell - axes_[b].stride);
      if (tick + 1 < axes_[b].ticks.size()) around.push_back(cell);
    }
    cells = std::move(around);
  }
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t cell : cells) least = std::min(least, axes_[a].cells[cell]);
  return least;
}

double Nodes::Slope(const Axis& along, std::size_t cell) const {
  Ways::Box box(ways_.sides_.size());
  for (const Axis& axis : axes_) {
    const std::size_t tick = TickOf(axis, cell);
    box[ToSize(axis.variable)] = {axis.ticks[tick], axis.ticks[tick + 1]};
  }
  return ways_.LargestSlope(k_, along.variable, box);
}

void Nodes::Reach(Side& side, std::size_t node, const Real& value) const {
  if (!CertainlyBelow(value, side.values[node])) return;
  side.values[node] = value;
  side.roughly[node] = value.ToDouble();
  side.waiting.emplace_back(-side.roughly[node], node);
  std::ranges::push_heap(side.waiting);
}

void Nodes::Add(const Eigen::VectorXd& z, const Real& lower, const Real& upper) {
  std::size_t cell = 0;
  for (const Axis& axis : axes_) {
    const std::vector<double>& ticks = axis.ticks;
    const double at = z[axis.variable];
    if (!(ticks.front() <= at && at <= ticks.back())) return;
    // The last strip that begins at or below.
    cell += axis.stride * ToSize(std::upper_bound(ticks.begin() + 1, ticks.end() - 1, at) - ticks.begin() - 1);
  }
  for (const std::size_t node : CornersOf(cell)) {
    Real way;
    std::size_t begin = cell;  // of a move along the last axis first, then on the sides of the cell
    for (std::size_t a = axes_.size(); a-- > 0;) {
      const Axis& axis = axes_[a];
      const std::size_t tick = TickOf(axis, node);
      way += Real(SlopeOn(a, begin)) * abs(Real(axis.ticks[tick]) - Real(z[axis.variable]));
      begin += (tick - TickOf(axis, cell)) * axis.stride;
    }
    Reach(sides_[0], node, upper + way);
    Reach(sides_[1], node, way - lower);
  }
}

// The least first, as far as doubles tell: in another order the same is found.
void Nodes::Spread(Side& side) const {
  while (!side.waiting.empty()) {
    std::ranges::pop_heap(side.waiting);
    const auto [rank, node] = side.waiting.back();
    side.waiting.pop_back();
    if (-rank != side.roughly[node]) continue;
    for (const Axis& axis : axes_)
      for (const bool up : {false, true}) {
        const std::size_t at = TickOf(axis, node), first = up ? at : at - 1;
        if (up ? at + 1 == axis.ticks.size() : at == 0) continue;
        const std::size_t next = up ? node + axis.stride : node - axis.stride;
        const double slope = axis.slopes[std::min(node, next)],
                     roughly = side.roughly[node] + slope * (axis.ticks[first + 1] - axis.ticks[first]);
        // Also where numbers are too large or too small for doubles to tell.
        if (const double known = side.roughly[next]; std::abs(roughly) > 1e-250 && known < 1e250 &&
                                                     roughly - known > kRoughly * (std::abs(roughly) + std::abs(known)))
          continue;
        Reach(side, next, side.values[node] + Real(slope) * axis.widths[first]);
      }
  }
}

void Nodes::Spread() {
  for (Side& side : sides_) Spread(side);
}

std::pair<Real, Real> Nodes::Over(std::span<const Real> box, const Slopes& slopes, std::span<const Real> center) const {
  std::vector<std::pair<Real, Real>> part;
  std::vector<std::size_t> cells{0};  // that the box meets
  for (const auto& axis : axes_) {
    const auto l = ToSize(axis.variable);
    part.emplace_back(max(Real(axis.ticks.front()), box[l].lower()), min(Real(axis.ticks.back()), box[l].upper()));
    std::size_t first = 0, last = 0;
    for (std::size_t i = 0; i + 1 < axis.ticks.size(); ++i) {
      if (CertainlyAtMost(Real(axis.ticks[i]), part.back().first)) first = i;
      if (!CertainlyAtMost(part.back().second, Real(axis.ticks[i]))) last = i;
    }
    std::vector<std::size_t> met;
    for (const std::size_t cell : cells)
      for (std::size_t i = first; i <= std::max(first, last); ++i) met.push_back(cell + i * axis.stride);
    cells = std::move(met);
  }
  std::array<std::optional<Real>, 2> most;
  for (const std::size_t cell : cells) {
    for (std::size_t s = 0; s < 2; ++s) {
      const double sign = s == 0 ? 1 : -1;
      // Where the first axes run over the part of the cell, the others being at a node.
      const auto most_over = [&](const auto& self, std::size_t axes, std::size_t node) -> Real {
        if (axes == 0) {
          Real value = sides_[s].values[node];
          for (std::size_t a = 0; a < axes_.size(); ++a)
            value -= Real(sign) * Real(slopes[a]) *
                     (Real(axes_[a].ticks[TickOf(axes_[a], node)]) - center[ToSize(axes_[a].variable)]);
          return value;
        }
        const std::size_t a = axes - 1, tick = TickOf(axes_[a], cell);
        const Real begin(axes_[a].ticks[tick]), end(axes_[a].ticks[tick + 1]);
        return Most(self(self, a, node), self(self, a, node + axes_[a].stride), SlopeOn(a, node), sign * slopes[a],
                    begin, end, max(part[a].first, begin), min(part[a].second, end));
      };
      const Real here = most_over(most_over, axes_.size(), cell);
      most[s] = most[s] ? max(*most[s], here) : here;
    }
  }
  return {-*most[1], *most[0]};
}

// By how much the middle of the bounds rises between two points, in parts of which the largest slope has 250.7.
std::optional<Nodes::Slopes> Nodes::SlopesOver(std::span<const Real> center, std::span<const Real> half_width) const {
  Slopes slopes{};
  if (axes_.size() > 2) return slopes;  // m = 0 (3.20)
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    const std::vector<double>& ticks = axes_[a].ticks;
    const double range = ticks.back() - ticks.front(), part = axes_[a].largest_slope / kSlopes;
    if (!(part > 0) || !(range > 0) || !(axes_[a].largest_slope * range < 0x1p900)) continue;
    const auto l = ToSize(axes_[a].variable);
    const double width = 2 * half_width[l].ToDouble(), least = range / static_cast<double>(ticks.size() - 1) * 0.31;
    if (std::abs(width - least) <= kNear * least) return std::nullopt;
    if (!(width > least)) continue;
    const Real away = Real(0.83) * half_width[l];
    const auto middle_at = [&](const Real& place) {
      std::vector<Real> at(center.begin(), center.end());
      at[l] = place;
      const auto [lower, upper] = Over(at, {}, center);
      return Real(0.5) * (lower + upper);
    };
    const Real rise = middle_at(center[l] + away) - middle_at(center[l] - away);
    const double parts = (rise / (Real(2.0) * away)).ToDouble() / part;
    if (!rise.IsFinite() || !std::isfinite(parts)) continue;
    if (std::abs(parts) < kSlopes && std::abs(std::abs(parts - std::floor(parts)) - 0.5) < kNear) return std::nullopt;
    slopes[a] = part * std::clamp(std::round(parts), -kSlopes, kSlopes);
  }
  return slopes;
}

}  // namespace forereach::verifier
