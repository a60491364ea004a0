#include "research/norm_ratio.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace forereach::research {

Eigen::MatrixXd LargestSlopes(const System& system) {
  constexpr int kPoints = 5;
  const std::vector<Interval> ranges = system.domain.Ranges();
  Eigen::MatrixXd largest = Eigen::MatrixXd::Zero(system.deployed.rows(), system.deployed.cols());
  std::vector<int> digits(ranges.size(), 0);
  std::vector<double> z(digits.size());
  Linearization linearization;
  for (bool done = false; !done;) {
    for (std::size_t l = 0; l < z.size(); ++l)
      z[l] = ranges[l].lower + (ranges[l].upper - ranges[l].lower) * digits[l] / (kPoints - 1);
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
  return largest;
}

double NormRatio(const System& system, const Eigen::MatrixXd& lipschitz) {
  return (LargestSlopes(system) + lipschitz).norm() / lipschitz.norm();
}

}  // namespace forereach::research
