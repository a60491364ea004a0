/** Random problems some of whose residual's rows are affine, and affine residuals that their data admit. */
#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "tests/oracle/problems.h"

namespace forereach {

/** (M_k, b_k) by rows, in the columns of the declaration, and g. */
struct AffineTruth {
  std::vector<std::vector<Real>> rows;
  Ramps rest;
};

inline Real AffineValue(const std::vector<Real>& theta, const std::vector<int>& columns, const std::vector<Real>& z) {
  Real sum = theta.back();
  for (std::size_t j = 0; j < columns.size(); ++j) sum += theta[j] * z[static_cast<std::size_t>(columns[j])];
  return sum;
}

/** The bounds that observation i sets on row k's residual, one unit in the last place of the successor included. */
inline std::pair<Real, Real> AffineBounds(const Problem& problem, int i, int k) {
  const bool bicycle = problem.model->num_states() == 6;
  const Eigen::VectorXd z = problem.transitions.z.row(i);
  const double next = problem.transitions.x_next(i, k);
  const Real seen = Real(next) - NominalSuccessor(bicycle, {z.begin(), z.end()})[static_cast<std::size_t>(k)];
  const Real slack = Real(NextUp(std::abs(next))) - Real(std::abs(next)) + Real(problem.declaration.noise_bound[k]) +
                     DisturbanceAt(problem, {z.begin(), z.end()}, k);
  return {seen - slack, seen + slack};
}

/** Declares one to three rows of AnyProblem's affine, in one to four columns, and replaces what the transitions show of
them by an affine residual with noise. @param rests if any, the rows are affine up to a rest in some variables, which
the residual has and may use up. */
inline AffineTruth MakeAffine(Random& random, Problem& problem, Random* rests = nullptr) {
  const bool bicycle = problem.model->num_states() == 6;
  const int n = problem.model->num_states(), variables = problem.model->num_variables();
  AffineRows& affine = problem.declaration.affine;
  const auto choose = [&](int most, int of) {
    std::vector<int> all(static_cast<std::size_t>(of));
    for (int l = 0; l < of; ++l) all[static_cast<std::size_t>(l)] = l;
    while (static_cast<int>(all.size()) > most) all.erase(all.begin() + random.Below(static_cast<int>(all.size())));
    return all;
  };
  affine.rows = choose(random.Integer(1, 3), n);
  affine.columns = choose(random.Integer(1, 4), variables);
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(n, variables);
  for (const int k : affine.rows)
    for (int l = 0; rests && l < variables; ++l)
      if (rests->Coin(0.4)) slopes(k, l) = std::ldexp(0.02, -rests->Integer(0, 6));
  if (rests) affine.rest = slopes;
  Random none(0);
  AffineTruth truth{{}, Ramps(rests ? *rests : none, slopes)};
  for (const int k : affine.rows) {
    problem.declaration.lipschitz.row(k).setZero();
    problem.declaration.noise_bound[k] =
        random.Coin(0.2) ? 0 : std::ldexp(random.Uniform(0.5, 1), -random.Integer(8, 14));
    std::vector<Real>& theta = truth.rows.emplace_back();
    for (std::size_t j = 0; j <= affine.columns.size(); ++j) theta.emplace_back(random.Uniform(-0.02, 0.02));
    for (int i = 0; i < problem.transitions.size(); ++i) {
      const Eigen::VectorXd z = problem.transitions.z.row(i);
      const std::vector<Real> at(z.begin(), z.end());
      const double noise =
          problem.declaration.noise_bound[k] * (random.Coin(0.3) ? random.Sign() : random.Uniform(-1, 1));
      problem.transitions.x_next(i, k) = (NominalSuccessor(bicycle, at)[static_cast<std::size_t>(k)] +
                                          AffineValue(theta, affine.columns, at) + truth.rest(at, k) + Real(noise))
                                             .ToDouble();
    }
  }
  return truth;
}

/** Declares of each slope that it is at most twice what MakeAffine makes it, in regions, too. */
inline void DeclareSlopes(Problem& problem) {
  for (const int k : problem.declaration.affine.rows)
    for (int l = 0; l < problem.model->num_variables(); ++l)
      if (problem.declaration.affine.DependsOn(k, l)) problem.declaration.lipschitz(k, l) = 0.04;
  for (Region& region : problem.declaration.regions) region.lipschitz = problem.declaration.lipschitz;
}

/** The same as a robot records it (Recorded), with the slopes declared. */
inline std::shared_ptr<Problem> RecordedAffine(Random& random, const Problem& truth) {
  const auto problem = Recorded(random, truth);
  DeclareSlopes(*problem);
  return problem;
}

/** Parameters of row k on the edge of what the data of `problem` admit beside a rest, or within it: from the truth some
steps along random directions, each as far as the data allow. They keep the slopes that are declared in `told`. */
inline std::vector<Real> AdmissibleParameters(Random& random, const Problem& told, const Problem& problem, int k,
                                              std::vector<Real> theta, const Ramps& rest) {
  const std::vector<Real> truth = theta;
  const std::vector<int>& columns = problem.declaration.affine.columns;
  std::vector<std::pair<Real, Real>> bounds;
  for (int i = 0; i < problem.transitions.size(); ++i) {
    const Eigen::VectorXd row = problem.transitions.z.row(i);
    const Real at = rest({row.begin(), row.end()}, k);
    const auto& [lower, upper] = AffineBounds(problem, i, k);
    bounds.emplace_back(lower - at, upper - at);
  }
  for (int steps = random.Integer(0, 8); steps > 0; --steps) {
    std::vector<Real> direction;
    for (std::size_t j = 0; j < theta.size(); ++j) direction.emplace_back(random.Uniform(-1, 1));
    std::optional<Real> farthest;
    for (int i = 0; i < problem.transitions.size(); ++i) {
      const Eigen::VectorXd row = problem.transitions.z.row(i);
      const std::vector<Real> z(row.begin(), row.end());
      const Real value = AffineValue(theta, columns, z), along = AffineValue(direction, columns, z);
      const auto& [lower, upper] = bounds[static_cast<std::size_t>(i)];
      if (along > Real(0) && (!farthest || (upper - value) / along < *farthest)) farthest = (upper - value) / along;
      if (along < Real(0) && (!farthest || (lower - value) / along < *farthest)) farthest = (lower - value) / along;
    }
    if (!farthest) break;
    const Real step =
        *farthest * (steps == 1 && random.Coin(0.3) ? Real(random.Uniform(0, 1)) : Real(1.0) - Real(0x1p-60));
    for (std::size_t j = 0; j < theta.size(); ++j) theta[j] += step * direction[j];
  }
  for (std::size_t j = 0; j < columns.size(); ++j)
    if (const double most = told.declaration.lipschitz(k, columns[j]);
        most > 0 && abs(theta[j]) + Real(told.declaration.affine.Rest(k, columns[j])) > Real(most))
      return truth;
  return theta;
}

/** A row i of the affine ones that the data of `problem` admit: such parameters with the true rest, or with the
farthest one, from above or below, that agrees with what they leave of the data. */
class AdmissibleRow {
 public:
  AdmissibleRow(Random& random, Random& rests, const Problem& told, const Problem& problem, std::size_t i,
                const AffineTruth& truth)
      : affine_(problem.declaration.affine),
        k_(affine_.rows[i]),
        rest_(truth.rest),
        theta_(AdmissibleParameters(random, told, problem, k_, truth.rows[i], rest_)),
        which_(affine_.rest.size() == 0 ? 0 : rests.Below(3)) {
    for (int j = 0; j < problem.transitions.size(); ++j) {
      const Eigen::VectorXd z = problem.transitions.z.row(j);
      const auto& [lower, upper] = AffineBounds(problem, j, k_);
      places_.emplace_back(z.begin(), z.end());
      left_.push_back((which_ == 1 ? upper : lower) - AffineValue(theta_, affine_.columns, places_.back()));
    }
  }

  Real operator()(const std::vector<Real>& z) const {
    Real rest = rest_(z, k_);
    for (std::size_t j = 0; j < places_.size() && which_ > 0; ++j) {
      Real apart;
      for (std::size_t l = 0; l < z.size(); ++l)
        apart += Real(affine_.Rest(k_, static_cast<Eigen::Index>(l))) * abs(z[l] - places_[j][l]);
      const Real end = which_ == 1 ? left_[j] + apart : left_[j] - apart;
      if (j == 0 || (which_ == 1 ? end < rest : end > rest)) rest = end;
    }
    return AffineValue(theta_, affine_.columns, z) + rest;
  }

 private:
  AffineRows affine_;
  int k_;
  Ramps rest_;
  std::vector<Real> theta_;
  int which_;  // 0: the true rest, 1: from above, 2: from below
  std::vector<std::vector<Real>> places_;
  std::vector<Real> left_;
};

}  // namespace forereach
