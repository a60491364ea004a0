#include "research/methods/calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "research/methods/envelope.h"

namespace forereach::research {
namespace {

constexpr RegionalOptions kRegional{
    .regional = {0.10, Center::kZero}, .jointly = true, .cut = Cut::kSteepest, .elsewhere = Elsewhere::kWidest};

std::vector<int> CoordinatesOf(Cut cut, const Setting& setting) {
  std::vector<int> active = ActiveCoordinates(setting.declaration);
  if (cut == Cut::kActive) return active;
  const std::vector<Interval> ranges = setting.domain.Ranges();
  if (cut == Cut::kAll) {
    active.resize(ranges.size());
    for (std::size_t l = 0; l < active.size(); ++l) active[l] = static_cast<int>(l);
    return active;
  }
  if (active.empty()) return active;
  return {*std::ranges::max_element(active, {}, [&](int l) {
    const Interval& range = ranges[static_cast<std::size_t>(l)];
    return setting.declaration.lipschitz.col(l).maxCoeff() * (range.upper - range.lower);
  })};
}

void Widen(const ResidualBox& box, ResidualBounds& bounds) noexcept {
  for (Eigen::Index k = 0; k < box.center.size(); ++k) {
    double &lower = bounds.lower[static_cast<std::size_t>(k)], &upper = bounds.upper[static_cast<std::size_t>(k)];
    lower = std::min(lower, box.center[k] - box.radius[k]);
    upper = std::max(upper, box.center[k] + box.radius[k]);
  }
}

}  // namespace

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

ResidualBox Calibrate(const Eigen::MatrixXd& residuals, const CalibrationOptions& options) {
  ResidualBox box{Eigen::VectorXd::Zero(residuals.cols()), Eigen::VectorXd(residuals.cols())};
  if (options.center == Center::kMean) box.center = residuals.colwise().mean().transpose();
  for (Eigen::Index k = 0; k < residuals.cols(); ++k) {
    const Eigen::VectorXd scores = (residuals.col(k).array() - box.center[k]).abs();
    box.radius[k] = ConformalQuantile({scores.begin(), scores.end()}, options.miscoverage);
  }
  return box;
}

std::unique_ptr<ResidualEnclosure> MakeGlobalCalibration(const Setting& setting, const CalibrationOptions& options) {
  const Observations observations = Observe(setting.model, setting.data);
  ResidualBox box = Calibrate(ObservedResiduals(observations), options);
  box.radius += RecordingError(observations);
  return std::make_unique<ConstantEnclosure>(std::move(box));
}

int RegionalCalibration::CellOf(const Axis& axis, double z) const noexcept {
  const double width = axis.range.upper - axis.range.lower, cells = options_.cells;
  if (!(width > 0)) return 0;
  return static_cast<int>(std::clamp(std::floor((z - axis.range.lower) / width * cells), 0.0, cells - 1));
}

RegionalCalibration::RegionalCalibration(const Setting& setting, const RegionalOptions& options) : options_(options) {
  const std::vector<Interval> ranges = setting.domain.Ranges();
  for (const int l : CoordinatesOf(options.cut, setting)) axes_.push_back({l, ranges[static_cast<std::size_t>(l)]});
  if (axes_.size() > kMostAxes)
    throw std::invalid_argument("regional calibration: " + std::to_string(axes_.size()) +
                                " coordinates to cut, must be at most " + std::to_string(kMostAxes));
  const Observations observations = Observe(setting.model, setting.data);
  const Eigen::MatrixXd residuals = ObservedResiduals(observations);
  const Eigen::VectorXd recording = RecordingError(observations);
  global_ = Calibrate(residuals, options.global);
  global_.radius += recording;
  largest_slopes_ = setting.declaration.lipschitz.rowwise().maxCoeff();
  if (options.elsewhere == Elsewhere::kDeclared) declared_ = MakeForeReach(setting);

  std::map<int, std::vector<int>> members;
  for (int i = 0; i < observations.size(); ++i) {
    int cell = 0;
    for (const Axis& axis : axes_) cell = cell * options.cells + CellOf(axis, observations.z(i, axis.coordinate));
    members[cell].push_back(i);
  }
  CalibrationOptions each = options.regional;
  if (options.jointly) each.miscoverage /= static_cast<double>(members.size());
  for (const auto& [cell, rows] : members) {
    ResidualBox box = Calibrate(residuals(rows, Eigen::all), each);
    if (!box.radius.allFinite()) continue;
    box.radius += recording;
    boxes_.emplace(cell, std::move(box));
  }
}

int RegionalCalibration::Steps(int cell, int other) const noexcept {
  int steps = 0;
  for (std::size_t a = 0; a < axes_.size(); ++a, cell /= options_.cells, other /= options_.cells)
    steps += std::abs(cell % options_.cells - other % options_.cells);
  return steps;
}

void RegionalCalibration::Join(int cell, const QuerySet& query, ResidualBounds& bounds) const noexcept {
  if (const auto own = boxes_.find(cell); own != boxes_.end()) return Widen(own->second, bounds);
  switch (options_.elsewhere) {
    case Elsewhere::kNearest:
    case Elsewhere::kWidest: {
      int most = std::numeric_limits<int>::max();
      if (options_.elsewhere == Elsewhere::kNearest)
        for (const auto& [other, box] : boxes_) most = std::min(most, Steps(cell, other));
      for (const auto& [other, box] : boxes_)
        if (Steps(cell, other) <= most) Widen(box, bounds);
      if (!boxes_.empty()) return;
      break;
    }
    case Elsewhere::kDeclared: {
      ResidualBounds declared;
      declared_->Enclose(query, declared);
      for (std::size_t k = 0; k < static_cast<std::size_t>(largest_slopes_.size()); ++k) {
        bounds.lower[k] = std::min(bounds.lower[k], declared.lower[k]);
        bounds.upper[k] = std::max(bounds.upper[k], declared.upper[k]);
      }
      return;
    }
    case Elsewhere::kUnbounded:
      for (std::size_t k = 0; k < static_cast<std::size_t>(largest_slopes_.size()); ++k)
        if (largest_slopes_[static_cast<Eigen::Index>(k)] > 0) {
          bounds.lower[k] = -kInfinity;
          bounds.upper[k] = kInfinity;
        }
      break;  // the others have the global bound
    case Elsewhere::kGlobal: break;
  }
  Widen(global_, bounds);
}

void RegionalCalibration::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  const std::size_t axes = axes_.size();
  std::array<int, kMostAxes> first{}, last{}, at{};
  for (std::size_t a = 0; a < axes; ++a) {
    const Interval hull = HullOf(query, axes_[a].coordinate);
    at[a] = first[a] = CellOf(axes_[a], hull.lower);
    last[a] = CellOf(axes_[a], hull.upper);
  }
  const auto n = static_cast<std::size_t>(global_.center.size());
  std::fill_n(bounds.lower.begin(), n, kInfinity);
  std::fill_n(bounds.upper.begin(), n, -kInfinity);
  bounds.capped = false;
  for (;;) {
    int cell = 0;
    for (std::size_t a = 0; a < axes; ++a) cell = cell * options_.cells + at[a];
    Join(cell, query, bounds);
    std::size_t a = 0;
    while (a < axes && at[a] == last[a]) {
      at[a] = first[a];
      ++a;
    }
    if (a == axes) return;
    ++at[a];
  }
}

std::unique_ptr<ResidualEnclosure> MakeGlobalCalibration(const Setting& setting) {
  return MakeGlobalCalibration(setting, {});
}

std::unique_ptr<ResidualEnclosure> MakeRegionalCalibration(const Setting& setting) {
  return std::make_unique<RegionalCalibration>(setting, kRegional);
}

}  // namespace forereach::research
