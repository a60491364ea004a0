/** What a certificate has to hold for: residuals that data and declaration admit, and initial states. */
#pragma once

#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "tests/oracle/problems.h"

namespace forereach {

/** An admissible residual: any function between the McShane extensions of the data from below and above that satisfies
the declaration, as do both, a mixture of both, and a third function cut off by them. */
class AdmissibleResidual {
 public:
  AdmissibleResidual(Random& random, const Problem& problem)
      : declaration_(problem.declaration), z_(problem.transitions.z), own_(random, problem.declaration.lipschitz) {
    const bool bicycle = problem.model->num_states() == 6;
    for (int i = 0; i < problem.transitions.size(); ++i) {
      const Eigen::VectorXd z = z_.row(i);
      const auto nominal = NominalSuccessor(bicycle, {z.begin(), z.end()});
      std::vector<Real> lower, upper;
      for (std::size_t k = 0; k < nominal.size(); ++k) {
        const auto coordinate = static_cast<Eigen::Index>(k);
        const double next = problem.transitions.x_next(i, coordinate);
        const Real slack = Real(NextUp(std::abs(next))) - Real(std::abs(next)) +
                           Real(declaration_.noise_bound[coordinate]) +
                           DisturbanceAt(problem, {z.begin(), z.end()}, coordinate);
        lower.push_back(Real(next) - nominal[k] - slack);
        upper.push_back(Real(next) - nominal[k] + slack);
      }
      lower_.push_back(lower);
      upper_.push_back(upper);
    }
    for (Eigen::Index k = 0; k < declaration_.lipschitz.rows(); ++k) kind_.push_back(random.Below(4));
    mix_ = random.Uniform(0, 1);
  }

  Real operator()(const std::vector<Real>& z, int k) const {
    Real from_below, from_above;
    for (std::size_t i = 0; i < lower_.size(); ++i) {
      Real distance = 0;
      for (Eigen::Index l = 0; l < z_.cols(); ++l)
        if (declaration_.lipschitz(k, l) != 0)
          distance += Real(declaration_.lipschitz(k, l)) *
                      abs(z[static_cast<std::size_t>(l)] - z_(static_cast<Eigen::Index>(i), l));
      const auto row = static_cast<std::size_t>(k);
      const Real low = lower_[i][row] - distance, high = upper_[i][row] + distance;
      if (i == 0 || low > from_below) from_below = low;
      if (i == 0 || high < from_above) from_above = high;
    }
    switch (kind_[static_cast<std::size_t>(k)]) {
      case 0: return from_below;
      case 1: return from_above;
      case 2: return from_below + Real(mix_) * (from_above - from_below);
      default: {
        const Real own = own_(z, k);
        return own < from_below ? from_below : own > from_above ? from_above : own;
      }
    }
  }

 private:
  Declaration declaration_;
  Eigen::MatrixXd z_;
  Ramps own_;
  std::vector<std::vector<Real>> lower_, upper_;
  std::vector<int> kind_;
  double mix_;
};

/** A point of a set, often a corner. */
inline std::vector<Real> PointOf(Random& random, const Zonotope& set) {
  std::vector<Real> x(set.center().begin(), set.center().end());
  const bool corner = random.Coin(0.7);
  for (int j = 0; j < set.num_generators(); ++j) {
    const Real weight(corner ? random.Sign() : random.Uniform(-1, 1));
    for (int k = 0; k < set.dim(); ++k) x[static_cast<std::size_t>(k)] += weight * Real(set.generator(k, j));
  }
  return x;
}

/** Whether no axis, and none of twenty random directions, separates x from a set. */
inline bool IsNotOutside(Random& random, const Zonotope& slice, const std::vector<Real>& x) {
  const int n = slice.dim();
  for (int trial = 0; trial < 2 * n + 20; ++trial) {
    Eigen::VectorXd d = random.Vector(n);
    if (trial < 2 * n) d = (trial % 2 ? -1 : 1) * Eigen::VectorXd::Unit(n, trial / 2);
    Real along;
    for (int k = 0; k < n; ++k) along += Real(d[k]) * x[static_cast<std::size_t>(k)];
    if (!(along <= Real(slice.SupportUpper(View(d))))) return false;
  }
  return true;
}

/** Follows the plan of a query from any point of its initial set under any inputs (drawn from `records`), disturbances
and offsets (from `winds`) that the problem allows. @param residual r_k(z), as it is called. @return the first t of
0..steps at which holds(t, x_t) is false; -1 if there is none. */
template <class Residual, class Holds>
int FirstFailure(Random& random, Random& winds, Random& records, const Problem& problem, const Query& query, int steps,
                 const Residual& residual, const Holds& holds) {
  std::vector<Real> x = PointOf(random, query.initial_set);
  Real offset;
  for (int t = 0;; ++t) {
    if (!holds(t, x)) return t;
    if (t == steps) return -1;
    std::vector<Real> z = x;
    for (int l = 0; l < query.controls.rows(); ++l) z.push_back(ActedInput(records, problem, l, query.controls(l, t)));
    const Real before = std::exchange(offset, AnyOffset(winds, problem));
    x = Rolled(winds, problem, residual, z, offset - before);
  }
}

/** A certifier that knows the first transitions of a problem and has learned the others. */
inline std::unique_ptr<Certifier> HasLearned(const Problem& problem, int first) {
  const Transitions& all = problem.transitions;
  const auto known = std::make_shared<Problem>(problem);
  known->transitions = {all.z.topRows(first), all.x_next.topRows(first)};
  auto certifier = std::make_unique<Certifier>(known);
  for (int i = first; i < all.size(); ++i) {
    const Eigen::VectorXd z = all.z.row(i), next = all.x_next.row(i);
    if (certifier->Learn(View(z), View(next)) != Learned::kAdded) throw std::logic_error("a transition is not added");
  }
  return certifier;
}

}  // namespace forereach
