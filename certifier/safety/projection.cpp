#include "certifier/safety/projection.h"

#include <stdexcept>
#include <string>

namespace forereach {

Projection::Projection(const Eigen::MatrixXd& matrix, int num_states) : dim_(static_cast<int>(matrix.rows())) {
  if (dim_ < 1 || dim_ > kMaxSafetyDim || matrix.cols() != num_states)
    throw std::invalid_argument("projection: " + std::to_string(matrix.rows()) + "-by-" +
                                std::to_string(matrix.cols()) + ", must be 1, 2 or 3 by " + std::to_string(num_states));
  if (!matrix.allFinite() || matrix.isZero(0)) throw std::invalid_argument("projection: must be finite and not zero");
  for (int k = 0; k < dim_; ++k)
    for (int l = 0; l < num_states; ++l)
      if (matrix(k, l) != 0) entries_.push_back({k, l, Interval(matrix(k, l))});
}

}  // namespace forereach
