#include "forereach/sets/eigen.h"

namespace forereach::internal {

const char FOREREACH_EIGEN = 0;

}  // namespace forereach::internal
