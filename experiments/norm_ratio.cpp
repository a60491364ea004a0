#include "experiments/norm_ratio.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace forereach::experiments {

double NormRatio(const System& system, const Eigen::MatrixXd& lipschitz) {
  constexpr int kPoints = 5;
  Eigen::VectorXd lower(system.model->num_variables()), upper(lower.size());
  lower << system.domain.state.lower(), system.domain.input.lower();
  upper << system.domain.state.upper(), system.domain.input.upper();
  Eigen::MatrixXd largest = Eigen::MatrixXd::Zero(lipschitz.rows(), lipschitz.cols());
  std::vector<int> digits(static_cast<std::size_t>(lower.size()), 0);
  std::vector<double> z(digits.size());
  Linearization linearization;
  for (bool done = false; !done;) {
    for (std::size_t l = 0; l < z.size(); ++l) {
      const auto i = static_cast<Eigen::Index>(l);
      z[l] = lower[i] + (upper[i] - lower[i]) * digits[l] / (kPoints - 1);
    }
    system.model->Linearize(z, linearization);
    for (const MatrixEntry& entry : linearization.jacobian()) {
      double& known = largest(entry.row, entry.column);
      known = std::max({known, std::abs(entry.value.lower), std::abs(entry.value.upper)});
    }
    const auto next = std::ranges::find_if(digits, [](int digit) { return digit + 1 < kPoints; });
    done = next == digits.end();
    std::fill(digits.begin(), next, 0);
    if (!done) ++*next;
  }
  return (largest + lipschitz).norm() / lipschitz.norm();
}

}  // namespace forereach::experiments
