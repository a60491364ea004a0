#include "forereach/certify/extremal.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace forereach {

ExtremalResiduals::ExtremalResiduals(const Declaration& declaration, const Observations& observations)
    : declaration_(declaration), observations_(observations), constant_(observations.num_states()) {
  for (int k = 0; k < observations.num_states(); ++k) {
    const double sigma = declaration.noise_bound[k];
    // A row without slopes is one number: the middle of what all observations leave of it.
    constant_[k] =
        ((observations.lower.col(k).maxCoeff() - sigma) + (observations.upper.col(k).minCoeff() + sigma)) / 2;
    if (declaration.lipschitz.row(k).maxCoeff() > 0) varying_.push_back(k);
  }
}

std::vector<bool> ExtremalResiduals::UpperOf(int choice) const {
  std::vector<bool> upper(static_cast<std::size_t>(observations_.num_states()));
  for (std::size_t j = 0; j < varying_.size(); ++j) upper[static_cast<std::size_t>(varying_[j])] = choice >> j & 1;
  return upper;
}

void ExtremalResiduals::Evaluate(int choice, const Eigen::VectorXd& z, std::vector<long double>& residual) const {
  residual.assign(constant_.begin(), constant_.end());
  for (std::size_t j = 0; j < varying_.size(); ++j) {
    const int k = varying_[j];
    const bool upper = choice >> j & 1;
    long double best = std::numeric_limits<long double>::infinity();  // of the upper, or of the lower negated
    for (Eigen::Index i = 0; i < observations_.z.rows(); ++i) {
      // McShane's extensions: the least and the largest admissible residual, of which rollouts are inner bounds
      // (soundness 3.22).
      long double value = upper ? observations_.upper(i, k) : -observations_.lower(i, k);
      value += declaration_.noise_bound[k];
      for (Eigen::Index l = 0; l < z.size(); ++l)
        if (const long double slope = declaration_.lipschitz(k, l); slope > 0)
          value += slope * std::abs(static_cast<long double>(z[l]) - observations_.z(i, l));
      best = std::min(best, value);
    }
    residual[static_cast<std::size_t>(k)] = upper ? best : -best;
  }
}

std::vector<Eigen::MatrixXd> ExtremalRollouts(const NominalModel& model, const ExtremalResiduals& residuals,
                                              const Plan& plan, const Eigen::MatrixXd& starts) {
  const Eigen::Index n = starts.rows(), columns = starts.cols() * residuals.count();
  std::vector<Eigen::MatrixXd> states(static_cast<std::size_t>(plan.num_steps) + 1, Eigen::MatrixXd(n, columns));
  Eigen::VectorXd z(n + plan.num_inputs), next(n);
  std::vector<long double> residual;
  for (Eigen::Index column = 0; column < columns; ++column) {
    states[0].col(column) = starts.col(column % starts.cols());
    const int choice = static_cast<int>(column / starts.cols());
    for (std::size_t t = 0; t + 1 < states.size(); ++t) {
      const std::span<const double> input = plan.input(static_cast<int>(t));
      z.head(n) = states[t].col(column);
      std::copy(input.begin(), input.end(), z.begin() + n);
      model.Evaluate({z.data(), static_cast<std::size_t>(z.size())}, {next.data(), static_cast<std::size_t>(n)});
      residuals.Evaluate(choice, z, residual);
      for (Eigen::Index k = 0; k < n; ++k)
        states[t + 1](k, column) = static_cast<double>(next[k] + residual[static_cast<std::size_t>(k)]);
    }
  }
  return states;
}

double HalfSpread(const Eigen::MatrixXd& projection, const Eigen::MatrixXd& states) {
  const Eigen::MatrixXd projected = projection * states;
  double largest = 0;
  for (Eigen::Index i = 0; i < projected.cols(); ++i)
    largest = std::max(largest, (projected.colwise() - projected.col(i)).colwise().norm().maxCoeff());
  return largest / 2;
}

Eigen::MatrixXd CornersOf(const Eigen::VectorXd& center, const Eigen::VectorXd& half_width) {
  std::vector<Eigen::Index> wide;
  for (Eigen::Index k = 0; k < half_width.size(); ++k)
    if (half_width[k] > 0) wide.push_back(k);
  const Eigen::Index corners = Eigen::Index{1} << wide.size();
  Eigen::MatrixXd states = center.replicate(1, corners + 1);
  for (Eigen::Index corner = 0; corner < corners; ++corner)
    for (std::size_t w = 0; w < wide.size(); ++w)
      states(wide[w], corner + 1) += (corner >> w & 1 ? 1 : -1) * half_width[wide[w]];
  return states;
}

}  // namespace forereach
