/** The plug-in Gaussian scale: the residuals are taken for draws of one normal law in each coordinate, whose mean and
standard deviation are those of the sample. */
#pragma once

#include <memory>

#include "experiments/methods/method.h"

namespace forereach::experiments {

/** The standard normal quantile of 1 - 0.10 / 2: two-sided, at the same miscoverage as calibration (calibration.h). The
paper names no level for this method. */
inline constexpr double kGaussianScale = 1.6448536269514722;

/** mean_k +- kGaussianScale s_k, with s_k^2 = sum_i (r~_ik - mean_k)^2 / (N - 1), 0 for N = 1.
Claims: a draw of that law lies inside with a probability of 0.90, were the fitted law the true one. Not sound: the law
is not that of the residual, and a normal law has no bounded support. */
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakePlugInGaussian(const Setting& setting);

}  // namespace forereach::experiments
