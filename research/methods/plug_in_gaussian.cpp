#include "research/methods/plug_in_gaussian.h"

#include <algorithm>

#include "research/methods/samples.h"

namespace forereach::research {

std::unique_ptr<ResidualEnclosure> MakePlugInGaussian(const Setting& setting, double deviations, Center center) {
  const Observations observations = Observe(setting.model, setting.data);
  const Eigen::MatrixXd residuals = ObservedResiduals(observations);
  ResidualBox box{Eigen::VectorXd::Zero(residuals.cols()), {}};
  if (center == Center::kMean) box.center = residuals.colwise().mean().transpose();
  const Eigen::VectorXd squares = (residuals.rowwise() - box.center.transpose()).colwise().squaredNorm().transpose();
  const double freedom = std::max(1.0, static_cast<double>(residuals.rows()) - 1);
  box.radius = deviations * (squares / freedom).cwiseSqrt() + RecordingError(observations);
  return std::make_unique<ConstantEnclosure>(std::move(box));
}

std::unique_ptr<ResidualEnclosure> MakePlugInGaussian(const Setting& setting) {
  return MakePlugInGaussian(setting, 1, Center::kMean);
}

}  // namespace forereach::research
