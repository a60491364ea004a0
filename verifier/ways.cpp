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
  return std::ranges::any_of(declaration.regions, [&](const Region& region) {
    return (region.lipschitz.row(k).array() < declaration.lipschitz.row(k).array()).any();
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

}  // namespace forereach::verifier
