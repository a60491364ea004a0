/** The plug-in Gaussian scale: the residuals are taken for draws of one normal law in each coordinate, whose mean and
standard deviation are those of the sample. */
#pragma once

#include <memory>

#include "research/methods/calibration.h"

namespace forereach::research {

/** center_k +- deviations s_k, with s_k^2 = sum_i (r~_ik - center_k)^2 / (N - 1), 0 for N = 1.
Claims: a draw of that law lies inside with the probability of so many deviations, were the fitted law the true one.
Not sound: the law is not that of the residual, and a normal law has no bounded support. */
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakePlugInGaussian(const Setting& setting, double deviations,
                                                                    Center center);

/** As among Methods(): one standard deviation around the mean, the "scale" itself. The paper names no factor; of those
tried (research/readings.cpp) this one has its coverage. */
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakePlugInGaussian(const Setting& setting);

}  // namespace forereach::research
