#include "research/methods/method.h"

#include <array>

#include "research/methods/alanwar.h"
#include "research/methods/calibration.h"
#include "research/methods/cp_sls.h"
#include "research/methods/envelope.h"
#include "research/methods/gaussian_process.h"
#include "research/methods/plug_in_gaussian.h"

namespace forereach::research {

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

}  // namespace forereach::research
