#include "research/methods/samples.h"

#include "forereach/sets/zonotope.h"

namespace forereach::research {

Eigen::MatrixXd ObservedResiduals(const Observations& observations) {
  return (observations.lower + observations.upper) / 2;
}

Eigen::VectorXd RecordingError(const Observations& observations) {
  return (observations.upper - observations.lower).colwise().maxCoeff().transpose() / 2;
}

std::vector<int> ActiveCoordinates(const Declaration& declaration) {
  std::vector<int> active;
  for (int l = 0; l < declaration.lipschitz.cols(); ++l)
    if (declaration.lipschitz.col(l).maxCoeff() > 0) active.push_back(l);
  return active;
}

Interval HullOf(const QuerySet& query, int l) noexcept {
  const int n = query.slice.dim();
  if (l >= n) return query.input[static_cast<std::size_t>(l - n)];
  const double center = query.slice.center(l), half_width = query.half_width[static_cast<std::size_t>(l)];
  return {SubDown(center, half_width), AddUp(center, half_width)};
}

Eigen::VectorXd CenterOf(const QuerySet& query) {
  const auto n = static_cast<Eigen::Index>(query.slice.dim());
  Eigen::VectorXd center(n + static_cast<Eigen::Index>(query.input.size()));
  for (Eigen::Index l = 0; l < n; ++l) center[l] = query.slice.center(static_cast<int>(l));
  for (std::size_t j = 0; j < query.input.size(); ++j) center[n + static_cast<Eigen::Index>(j)] = query.input[j];
  return center;
}

void ConstantEnclosure::Enclose(const QuerySet&, ResidualBounds& bounds) const noexcept {
  for (Eigen::Index k = 0; k < box_.center.size(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    bounds.lower[i] = box_.center[k] - box_.radius[k];
    bounds.upper[i] = box_.center[k] + box_.radius[k];
  }
  bounds.capped = false;
}

}  // namespace forereach::research
