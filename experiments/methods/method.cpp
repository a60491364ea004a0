#include "experiments/methods/method.h"

#include <array>

#include "experiments/methods/alanwar.h"
#include "experiments/methods/calibration.h"
#include "experiments/methods/cp_sls.h"
#include "experiments/methods/envelope.h"
#include "experiments/methods/gaussian_process.h"
#include "experiments/methods/plug_in_gaussian.h"

namespace forereach::experiments {

std::span<const Method> Methods() {
  using Make = std::unique_ptr<ResidualEnclosure> (*)(const Setting&);
  static const std::array<Method, 9> methods{{{"ForeReach", static_cast<Make>(MakeForeReach)},
                                              {"Global calibration", static_cast<Make>(MakeGlobalCalibration)},
                                              {"Regional calibration", MakeRegionalCalibration},
                                              {"Plug-in Gaussian", static_cast<Make>(MakePlugInGaussian)},
                                              {"GP (k=2)", MakeGaussianProcess2},
                                              {"GP (k=3)", MakeGaussianProcess3},
                                              {"Alanwar Alg. 6", MakeAlanwar},
                                              CpSlsMethods().front(),
                                              {"Scalar envelope", MakeScalarEnvelope}}};
  return methods;
}

}  // namespace forereach::experiments
