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

std::vector<int> Ways::Plane(int k) const {
  const auto [lower, upper] = problem_.domain.Corners();
  Box domain;
  for (std::size_t l = 0; l < lower.size(); ++l) domain.emplace_back(lower[l], upper[l]);
  std::vector<int> plane;
  for (int l = 0; l < std::ssize(sides_); ++l)
    if (!sides_[ToSize(l)].empty())
      plane.push_back(l);
    else if (LargestSlope(k, l, domain) > 0)
      return {};
  return plane.size() > 2 ? std::vector<int>() : plane;
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
  const std::vector<int> plane = ways.Plane(k);
  const auto [lower, upper] = ways.problem_.domain.Corners();
  const auto count = [&] { return (axes_[0].ticks.size() - 1) * (axes_[1].ticks.size() - 1); };
  for (std::size_t parts = kMostStrips;; parts -= parts / 32 + 1) {
    for (std::size_t a = 0; a < plane.size(); ++a) {
      const auto l = ToSize(plane[a]);
      std::vector<double> ends{lower[l]};
      for (const double side : ways.sides_[l])
        if (lower[l] < side && side < upper[l] && side != ends.back()) ends.push_back(side);
      ends.push_back(upper[l]);
      axes_[a] = {plane[a], Divided(ends, parts)};
    }
    if (count() <= kMostCells || parts == 1) break;
  }
  Ways::Box domain;
  for (std::size_t l = 0; l < lower.size(); ++l) domain.emplace_back(lower[l], upper[l]);
  for (std::size_t a = 0; a < plane.size(); ++a) largest_slopes_[a] = ways.LargestSlope(k, plane[a], domain);
  const std::size_t nodes = axes_[0].ticks.size() * axes_[1].ticks.size();
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  sides_.fill({std::vector<Real>(nodes, Real(kUnbounded)), std::vector<double>(nodes, kUnbounded)});
  const std::size_t rows = axes_[0].ticks.size() - 1, columns = axes_[1].ticks.size() - 1;
  std::array<std::vector<double>, 2> cells;
  for (std::size_t a = 0; a < 2; ++a)
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t j = 0; j < columns; ++j)
        cells[a].push_back(Slope(a, {std::pair(i, i + 1), std::pair(j, j + 1)}));
  const auto in_cell = [&](std::size_t a, std::size_t i, std::size_t j) { return cells[a][i * columns + j]; };
  // An edge lies in the cells on both sides, or the one.
  for (std::size_t i = 0; i <= rows; ++i)
    for (std::size_t j = 0; j <= columns; ++j) {
      const std::size_t below = i == 0 ? 0 : i - 1, left = j == 0 ? 0 : j - 1;
      const std::size_t above = std::min(i, rows - 1), right = std::min(j, columns - 1);
      slopes_[0].push_back(i == rows ? 0 : std::min(in_cell(0, i, left), in_cell(0, i, right)));
      slopes_[1].push_back(j == columns ? 0 : std::min(in_cell(1, below, j), in_cell(1, above, j)));
    }
}

// Over the box between these ticks.
double Nodes::Slope(std::size_t axis, std::array<std::pair<std::size_t, std::size_t>, 2> ticks) const {
  if (axes_[axis].variable < 0) return 0;
  Ways::Box box(ways_.sides_.size());
  for (std::size_t a = 0; a < 2; ++a)
    if (axes_[a].variable >= 0)
      box[ToSize(axes_[a].variable)] = {axes_[a].ticks[ticks[a].first], axes_[a].ticks[ticks[a].second]};
  return ways_.LargestSlope(k_, axes_[axis].variable, box);
}

// The last strip that begins at or below.
std::size_t Nodes::StripOf(const Axis& axis, double at) const {
  return ToSize(std::upper_bound(axis.ticks.begin(), axis.ticks.end() - 1, at) - axis.ticks.begin()) - 1;
}

void Nodes::Reach(Side& side, std::size_t node, const Real& value) const {
  if (!CertainlyBelow(value, side.values[node])) return;
  side.values[node] = value;
  side.roughly[node] = value.ToDouble();
  side.waiting.emplace_back(-side.roughly[node], node);
  std::ranges::push_heap(side.waiting);
}

void Nodes::Add(const Eigen::VectorXd& z, const Real& lower, const Real& upper) {
  std::array<double, 2> at{};
  std::array<std::pair<std::size_t, std::size_t>, 2> strips;
  for (std::size_t a = 0; a < 2; ++a) {
    if (axes_[a].variable >= 0) at[a] = z[axes_[a].variable];
    if (!(axes_[a].ticks.front() <= at[a] && at[a] <= axes_[a].ticks.back())) return;
    const std::size_t strip = StripOf(axes_[a], at[a]);
    strips[a] = {strip, strip + 1};
  }
  const Real first(Slope(0, strips)), second(Slope(1, strips));
  for (const std::size_t i : {strips[0].first, strips[0].second})
    for (const std::size_t j : {strips[1].first, strips[1].second}) {
      const Real way =
          first * abs(Real(axes_[0].ticks[i]) - Real(at[0])) + second * abs(Real(axes_[1].ticks[j]) - Real(at[1]));
      const std::size_t node = i * axes_[1].ticks.size() + j;
      Reach(sides_[0], node, upper + way);
      Reach(sides_[1], node, way - lower);
    }
}

// The least first, as far as doubles tell: in another order the same is found.
void Nodes::Spread(Side& side) const {
  const std::array<std::size_t, 2> sizes{axes_[0].ticks.size(), axes_[1].ticks.size()};
  while (!side.waiting.empty()) {
    std::ranges::pop_heap(side.waiting);
    const auto [rank, node] = side.waiting.back();
    side.waiting.pop_back();
    if (-rank != side.roughly[node]) continue;
    const std::array<std::size_t, 2> at{node / sizes[1], node % sizes[1]};
    for (std::size_t a = 0; a < 2; ++a)
      for (const bool up : {false, true}) {
        if (up ? at[a] + 1 == sizes[a] : at[a] == 0) continue;
        const std::size_t stride = a == 0 ? sizes[1] : 1, next = up ? node + stride : node - stride,
                          first = up ? at[a] : at[a] - 1;
        const double begin = axes_[a].ticks[first], end = axes_[a].ticks[first + 1];
        const double slope = slopes_[a][std::min(node, next)], roughly = side.roughly[node] + slope * (end - begin);
        // Also where numbers are too large or too small for doubles to tell.
        if (const double known = side.roughly[next]; std::abs(roughly) > 1e-250 && known < 1e250 &&
                                                     roughly - known > kRoughly * (std::abs(roughly) + std::abs(known)))
          continue;
        Reach(side, next, side.values[node] + Real(slope) * (Real(end) - Real(begin)));
      }
  }
}

void Nodes::Spread() {
  for (Side& side : sides_) Spread(side);
}

std::pair<Real, Real> Nodes::Over(std::span<const Real> box, const Slopes& slopes, std::span<const Real> center) const {
  std::array<Real, 2> lower, upper, middle;
  std::array<std::pair<std::size_t, std::size_t>, 2> strips{};
  for (std::size_t a = 0; a < 2; ++a) {
    const auto& [variable, ticks] = axes_[a];
    if (variable < 0) continue;
    middle[a] = center[ToSize(variable)];
    lower[a] = max(Real(ticks.front()), box[ToSize(variable)].lower());
    upper[a] = min(Real(ticks.back()), box[ToSize(variable)].upper());
    for (std::size_t i = 0; i + 1 < ticks.size(); ++i) {
      if (CertainlyAtMost(Real(ticks[i]), lower[a])) strips[a].first = i;
      if (!CertainlyAtMost(upper[a], Real(ticks[i]))) strips[a].second = i;
    }
    strips[a].second = std::max(strips[a].first, strips[a].second);
  }
  std::array<std::optional<Real>, 2> most;
  const std::size_t stride = axes_[1].ticks.size();
  for (std::size_t i = strips[0].first; i <= strips[0].second; ++i)
    for (std::size_t j = strips[1].first; j <= strips[1].second; ++j) {
      const std::array<std::pair<std::size_t, std::size_t>, 2> cell{std::pair(i, i + 1), std::pair(j, j + 1)};
      const double first = Slope(0, cell), second = Slope(1, cell);
      const Real a(axes_[0].ticks[i]), b(axes_[0].ticks[i + 1]), c(axes_[1].ticks[j]), d(axes_[1].ticks[j + 1]);
      for (std::size_t s = 0; s < 2; ++s) {
        const double sign = s == 0 ? 1 : -1;
        const auto value = [&](std::size_t m, std::size_t n) {
          return sides_[s].values[(i + m) * stride + j + n] -
                 Real(sign) * (Real(slopes[0]) * ((m == 0 ? a : b) - middle[0]) +
                               Real(slopes[1]) * ((n == 0 ? c : d) - middle[1]));
        };
        const auto along = [&](std::size_t end) {
          return Most(value(0, end), value(1, end), first, sign * slopes[0], a, b, max(lower[0], a), min(upper[0], b));
        };
        const Real here = Most(along(0), along(1), second, sign * slopes[1], c, d, max(lower[1], c), min(upper[1], d));
        most[s] = most[s] ? max(*most[s], here) : here;
      }
    }
  return {-*most[1], *most[0]};
}

// By how much the middle of the bounds rises between two points, in parts of which the largest slope has 250.7.
std::optional<Nodes::Slopes> Nodes::SlopesOver(std::span<const Real> center, std::span<const Real> half_width) const {
  Slopes slopes{};
  for (std::size_t a = 0; a < 2; ++a) {
    const auto& [variable, ticks] = axes_[a];
    const double range = ticks.back() - ticks.front(), part = largest_slopes_[a] / kSlopes;
    if (!(part > 0) || !(range > 0) || !(largest_slopes_[a] * range < 0x1p900)) continue;
    const auto l = ToSize(variable);
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
