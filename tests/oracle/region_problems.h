/** Random regions, residuals within them, and random problems whose data come from one. */
#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "tests/oracle/problems.h"

namespace forereach {

/** Adds boxes with smaller slopes, zeros among them, in some of the variables, at most three; some of their sides are
whole shares of the domain |z_l| <= reach_l, some lie beyond it. */
inline void AddRegions(Random& random, Declaration& declaration, const Eigen::VectorXd& reach, int count,
                       std::vector<int> variables = {}) {
  if (variables.empty())
    for (int l = 0; l < static_cast<int>(reach.size()); ++l) variables.push_back(l);
  while (variables.size() > Region::kMaxVariables)
    variables.erase(variables.begin() + random.Below(static_cast<int>(variables.size())));
  const double share = random.Coin(0.4) ? 0 : random.Uniform(0, 1);
  for (int i = 0; i < count; ++i) {
    Region region{{}, declaration.lipschitz};
    for (const int l : variables) {
      if (!region.box.empty() && random.Coin(0.3)) continue;
      const auto any = [&] {
        return random.Coin(0.3) ? random.Integer(-2, 2) * reach[l] / 2 : reach[l] * random.Uniform(-1.2, 1.2);
      };
      const double lower = any(), upper = any();
      region.box.push_back({l, {std::min(lower, upper), lower == upper ? upper + reach[l] : std::max(lower, upper)}});
    }
    for (Eigen::Index k = 0; k < region.lipschitz.rows(); ++k)
      if (random.Coin(0.8)) region.lipschitz.row(k) *= random.Coin(0.3) ? 0 : share * random.Uniform(0, 1);
    declaration.regions.push_back(region);
  }
}

/** r(z) = min_s (v_s + way(s, z)), or its negative, on the grid of all sides of regions, some points and the ends of
the domain, with the cheapest way along the grid's edges; between its nodes multilinear. In a cell of the grid |D_l r|
is at most that of the cell's edges, which is what the regions around them allow: so r is within L and the regions, and
uses up what they allow. A Number is exact, or has 256 bits. */
template <class Number>
class RegionalFunction {
 public:
  /** @param variables those on which r_k depends, a grid in all of them. @param points a row each. */
  RegionalFunction(const Declaration& declaration, int k, std::vector<int> variables, const std::vector<double>& lower,
                   const std::vector<double>& upper, const Eigen::MatrixXd& points, double sign)
      : variables_(std::move(variables)), sign_(sign) {
    for (const int l : variables_) {
      const auto at = static_cast<std::size_t>(l);
      std::vector<double>& ticks = ticks_.emplace_back(std::vector<double>{lower[at], upper[at]});
      for (const Region& region : declaration.regions)
        for (const auto& [variable, range] : region.box)
          for (const double side : {range.lower, range.upper})
            if (variable == l && lower[at] < side && side < upper[at]) ticks.push_back(side);
      for (Eigen::Index i = 0; i < points.rows(); ++i) ticks.push_back(points(i, l));
      std::ranges::sort(ticks);
      ticks.erase(std::unique(ticks.begin(), ticks.end()), ticks.end());
      strides_.push_back(values_.size());
      values_.resize(values_.size() * ticks.size(), kFar);
    }
    for (std::size_t node = 0; node < values_.size(); ++node)
      for (std::size_t a = 0; a < variables_.size(); ++a) costs_.push_back(Cost(declaration, k, node, a));
  }

  void SetAnyNode(Random& random, const Number& value) {
    values_[static_cast<std::size_t>(random.Below(static_cast<int>(values_.size())))] = Number(sign_) * value;
  }
  /** At one of the points: at most `value`, or at least. */
  void Set(const Eigen::VectorXd& z, const Number& value) {
    std::size_t node = 0;
    for (std::size_t a = 0; a < variables_.size(); ++a)
      node += strides_[a] *
              static_cast<std::size_t>(std::ranges::lower_bound(ticks_[a], z[variables_[a]]) - ticks_[a].begin());
    const Number signed_value = Number(sign_) * value;
    values_[node] = std::min(values_[node], signed_value);
  }
  /** At all nodes in a region: at most `value` in size, on the side to which the function is extreme. */
  void SetWithin(const Region& region, const Number& value) {
    for (std::size_t node = 0; node < values_.size(); ++node)
      if (IsWithin(region, node)) values_[node] = std::min(values_[node], value);
  }
  /** The largest size in a region, which its sides' nodes have; 0 where the region is outside the domain. */
  [[nodiscard]] Number LargestWithin(const Region& region) const {
    Number largest(0.0);
    for (std::size_t node = 0; node < values_.size(); ++node)
      if (IsWithin(region, node)) largest = std::max({largest, values_[node], Number(-values_[node])});
    return largest;
  }
  /** After all values are set: Bellman and Ford. */
  void Spread() {
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t node = 0; node < values_.size(); ++node)
        for (std::size_t a = 0; a < variables_.size(); ++a) {
          if (Tick(node, a) + 1 == ticks_[a].size()) continue;
          const std::size_t next = node + strides_[a];
          const Number& cost = costs_[node * variables_.size() + a];
          for (const auto& [from, to] : {std::pair{node, next}, std::pair{next, node}})
            if (const Number through = values_[from] + cost; through < values_[to])
              values_[to] = through, changed = true;
        }
    }
  }

  Number operator()(const std::vector<Number>& z) const {
    std::vector<std::size_t> first;
    std::vector<Number> share;
    for (std::size_t a = 0; a < variables_.size(); ++a) {
      const std::vector<double>& ticks = ticks_[a];
      const Number& at = z[static_cast<std::size_t>(variables_[a])];
      std::size_t i = 0;
      while (i + 2 < ticks.size() && Number(ticks[i + 1]) < at) ++i;
      first.push_back(i);
      share.push_back((at - Number(ticks[i])) / (Number(ticks[i + 1]) - Number(ticks[i])));
    }
    Number sum(0.0);
    for (unsigned corner = 0; corner < 1U << variables_.size(); ++corner) {
      Number weight(sign_);
      std::size_t node = 0;
      for (std::size_t a = 0; a < variables_.size(); ++a) {
        const bool far = corner >> a & 1;
        weight = weight * (far ? share[a] : Number(Number(1.0) - share[a]));
        node += (first[a] + far) * strides_[a];
      }
      sum += weight * values_[node];
    }
    return sum;
  }

 private:
  inline static const Number kFar{1000.0};  // more than any way

  [[nodiscard]] bool IsWithin(const Region& region, std::size_t node) const {
    return std::ranges::all_of(region.box, [&](const Region::Side& side) {
      const auto a = static_cast<std::size_t>(std::ranges::find(variables_, side.variable) - variables_.begin());
      return side.range.Contains(ticks_[a][Tick(node, a)]);
    });
  }
  [[nodiscard]] std::size_t Tick(std::size_t node, std::size_t a) const {
    return node / strides_[a] % ticks_[a].size();
  }
  // Of the edge from a node to the next one along axis a: by the regions in which all of it lies.
  [[nodiscard]] Number Cost(const Declaration& declaration, int k, std::size_t node, std::size_t a) const {
    if (Tick(node, a) + 1 == ticks_[a].size()) return kFar;
    const int l = variables_[a];
    const double begin = ticks_[a][Tick(node, a)], end = ticks_[a][Tick(node, a) + 1];
    double slope = declaration.lipschitz(k, l);
    for (const Region& region : declaration.regions)
      if (std::ranges::all_of(region.box, [&](const Region::Side& side) {
            const auto b = static_cast<std::size_t>(std::ranges::find(variables_, side.variable) - variables_.begin());
            const double at = ticks_[b][Tick(node, b)];
            return side.range.Contains(at) && (b != a || side.range.Contains(end));
          }))
        slope = std::min(slope, region.lipschitz(k, l));
    return Number(slope) * (Number(end) - Number(begin));
  }

  std::vector<int> variables_;
  double sign_;
  std::vector<std::vector<double>> ticks_;
  std::vector<std::size_t> strides_;
  std::vector<Number> values_ = {kFar};
  std::vector<Number> costs_;
};

/** The variables by which the regions of a problem are bounded, and those of row k's slopes. */
inline std::vector<int> VariablesOf(const Declaration& declaration, int k) {
  std::vector<int> variables;
  for (int l = 0; l < static_cast<int>(declaration.lipschitz.cols()); ++l) {
    const bool bounds = std::ranges::any_of(declaration.regions, [&](const Region& region) {
      return std::ranges::count(region.box, l, &Region::Side::variable) > 0;
    });
    if (bounds || declaration.lipschitz(k, l) > 0) variables.push_back(l);
  }
  return variables;
}

/** AnyProblem with regions in one to three variables, larger slopes in these, at most one other slope in a row, none
beside three, and data from a residual within; some regions bound it, its records and, if `disturbed`, its disturbance.
*/
inline std::shared_ptr<Problem> AnyRegionalProblem(Random& random, bool bicycle, int count, bool disturbed) {
  const auto problem = AnyProblem(random, bicycle, count);
  problem->domain.balls.clear();
  const int n = problem->model->num_states(), d = problem->model->num_variables();
  Declaration& declaration = problem->declaration;
  const auto [lower, upper] = problem->domain.Corners();
  std::vector<int> chosen{bicycle ? 3 : 2};
  if (random.Coin()) chosen.push_back(random.Coin() ? chosen[0] + 1 : d - 1);
  if (chosen.size() == 2 && random.Coin()) chosen.insert(chosen.begin(), 0);
  for (int k = 0; k < n; ++k) {
    const int other = chosen.size() == 3 ? 0 : random.Below(d);
    for (int l = 0; l < d; ++l)
      if (l != other) declaration.lipschitz(k, l) = 0;
    for (const int l : chosen)
      if (random.Coin()) declaration.lipschitz(k, l) = random.Uniform(0, 0.05);
  }
  AddRegions(random, declaration, Eigen::Map<const Eigen::VectorXd>(upper.data(), d), random.Integer(1, 3), chosen);
  BoundInRegions(random, declaration, &Region::noise_bound, declaration.noise_bound);
  for (Region& region : declaration.regions)
    if (random.Coin()) region.bound.setConstant(n, kInfinity);
  for (int k = 0; k < n; ++k) {
    RegionalFunction<Real> truth(declaration, k, VariablesOf(declaration, k), lower, upper, problem->transitions.z,
                                 random.Sign());
    for (int s = random.Integer(1, 3); s > 0; --s) truth.SetAnyNode(random, Real(random.Uniform(-0.05, 0.05)));
    truth.Spread();
    for (Region& region : declaration.regions)
      if (region.bound.size() != 0 && random.Coin())
        region.bound[k] = NextUp(truth.LargestWithin(region).ToDouble()) * (random.Coin() ? 1 : 2);
    for (int i = 0; i < count; ++i) {
      const Eigen::VectorXd z = problem->transitions.z.row(i);
      const std::vector<Real> at(z.begin(), z.end());
      const double noise =
          NoiseAt(declaration, at, k) * (random.Coin(0.3) ? random.Sign() : random.Uniform(-1, 1)) * (1 - 1e-6);
      problem->transitions.x_next(i, k) =
          (NominalSuccessor(bicycle, at)[static_cast<std::size_t>(k)] + truth(at) + Real(noise)).ToDouble();
    }
  }
  if (disturbed) Disturb(random, *problem);
  return problem;
}

/** Of each state the largest or the least residual that data, L and regions admit, with what these bound. */
inline std::vector<RegionalFunction<Real>> AnyAdmissible(Random& random, const Problem& problem) {
  const bool bicycle = problem.model->num_states() == 6;
  const auto [lower, upper] = problem.domain.Corners();
  std::vector<RegionalFunction<Real>> all;
  for (int k = 0; k < problem.model->num_states(); ++k) {
    const double sign = random.Sign();
    RegionalFunction<Real>& residual = all.emplace_back(problem.declaration, k, VariablesOf(problem.declaration, k),
                                                        lower, upper, problem.transitions.z, sign);
    for (int i = 0; i < problem.transitions.size(); ++i) {
      const Eigen::VectorXd z = problem.transitions.z.row(i);
      const std::vector<Real> at(z.begin(), z.end());
      const double next = problem.transitions.x_next(i, k);
      const Real slack = Real(NextUp(std::abs(next))) - Real(std::abs(next)) +
                         Real(NoiseAt(problem.declaration, at, k)) + DisturbanceAt(problem, at, k);
      residual.Set(z, Real(next) - NominalSuccessor(bicycle, at)[static_cast<std::size_t>(k)] + Real(sign) * slack);
    }
    for (const Region& region : problem.declaration.regions)
      if (region.bound.size() != 0 && region.bound[k] < kInfinity) residual.SetWithin(region, Real(region.bound[k]));
    residual.Spread();
  }
  return all;
}

}  // namespace forereach
