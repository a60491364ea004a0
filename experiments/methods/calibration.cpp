#include "experiments/methods/calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace forereach::experiments {

double ConformalQuantile(std::vector<double> scores, double alpha) {
  if (!(0 < alpha && alpha < 1))
    throw std::invalid_argument("miscoverage: " + std::to_string(alpha) + " is outside (0, 1)");
  const double count = static_cast<double>(scores.size());
  const double rank = std::ceil((count + 1) * (1 - alpha));
  if (!(rank <= count)) return kInfinity;
  const auto nth = scores.begin() + static_cast<std::ptrdiff_t>(rank) - 1;
  std::nth_element(scores.begin(), nth, scores.end());
  return *nth;
}

ResidualBox Calibrate(const Eigen::MatrixXd& residuals, double alpha) {
  ResidualBox box{residuals.colwise().mean().transpose(), Eigen::VectorXd(residuals.cols())};
  for (Eigen::Index k = 0; k < residuals.cols(); ++k) {
    const Eigen::VectorXd scores = (residuals.col(k).array() - box.center[k]).abs();
    box.radius[k] = ConformalQuantile({scores.begin(), scores.end()}, alpha);
  }
  return box;
}

std::unique_ptr<ResidualEnclosure> MakeGlobalCalibration(const Setting& setting) {
  const Observations observations = Observe(setting.model, setting.data);
  ResidualBox box = Calibrate(ObservedResiduals(observations));
  box.radius += RecordingError(observations);
  return std::make_unique<ConstantEnclosure>(std::move(box));
}

int RegionalCalibration::Axis::CellOf(double z) const noexcept {
  const double width = range.upper - range.lower;
  if (!(width > 0)) return 0;
  return static_cast<int>(std::clamp(std::floor((z - range.lower) / width * kCells), 0.0, kCells - 1.0));
}

RegionalCalibration::RegionalCalibration(const Setting& setting) {
  const std::vector<Interval> ranges = setting.domain.Ranges();
  for (const int l : ActiveCoordinates(setting.declaration)) axes_.push_back({l, ranges[static_cast<std::size_t>(l)]});
  if (axes_.size() > 12)
    throw std::invalid_argument("regional calibration: " + std::to_string(axes_.size()) +
                                " coordinates to cut, must be at most 12");
  const Observations observations = Observe(setting.model, setting.data);
  const Eigen::MatrixXd residuals = ObservedResiduals(observations);
  const Eigen::VectorXd recording = RecordingError(observations);
  global_ = Calibrate(residuals);
  global_.radius += recording;

  std::map<int, std::vector<int>> members;
  for (int i = 0; i < observations.size(); ++i) {
    int cell = 0;
    for (const Axis& axis : axes_) cell = cell * kCells + axis.CellOf(observations.z(i, axis.coordinate));
    members[cell].push_back(i);
  }
  for (const auto& [cell, rows] : members) {
    ResidualBox box = Calibrate(residuals(rows, Eigen::all));
    if (!box.radius.allFinite()) continue;
    box.radius += recording;
    boxes_.emplace(cell, std::move(box));
  }
}

const ResidualBox& RegionalCalibration::BoxOf(int cell) const noexcept {
  const auto found = boxes_.find(cell);
  return found == boxes_.end() ? global_ : found->second;
}

void RegionalCalibration::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  const std::size_t axes = axes_.size();
  std::array<int, 12> first{}, last{}, at{};
  for (std::size_t a = 0; a < axes; ++a) {
    const Interval hull = HullOf(query, axes_[a].coordinate);
    at[a] = first[a] = axes_[a].CellOf(hull.lower);
    last[a] = axes_[a].CellOf(hull.upper);
  }
  const auto n = static_cast<std::size_t>(global_.center.size());
  std::fill_n(bounds.lower.begin(), n, kInfinity);
  std::fill_n(bounds.upper.begin(), n, -kInfinity);
  bounds.capped = false;
  for (;;) {
    int cell = 0;
    for (std::size_t a = 0; a < axes; ++a) cell = cell * kCells + at[a];
    const ResidualBox& box = BoxOf(cell);
    for (std::size_t k = 0; k < n; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      bounds.lower[k] = std::min(bounds.lower[k], box.center[i] - box.radius[i]);
      bounds.upper[k] = std::max(bounds.upper[k], box.center[i] + box.radius[i]);
    }
    std::size_t a = 0;
    while (a < axes && at[a] == last[a]) {
      at[a] = first[a];
      ++a;
    }
    if (a == axes) return;
    ++at[a];
  }
}

std::unique_ptr<ResidualEnclosure> MakeRegionalCalibration(const Setting& setting) {
  return std::make_unique<RegionalCalibration>(setting);
}

}  // namespace forereach::experiments
