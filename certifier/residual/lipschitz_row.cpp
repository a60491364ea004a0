#include "certifier/residual/lipschitz_row.h"

namespace forereach {

LipschitzRow::LipschitzRow(const Declaration& declaration, int coordinate) {
  for (int l = 0; l < declaration.lipschitz.cols(); ++l)
    if (const double slope = declaration.lipschitz(coordinate, l); slope > 0) columns_.push_back({l, slope});
}

}  // namespace forereach
