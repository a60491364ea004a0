/** What observations show of their own error eps = sigma + w^, apart from any Lipschitz bound. */
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "forereach/residual/observations.h"
#include "identify/smallest_row.h"

namespace forereach {

struct NoiseFloor {
  /** Half the largest difference of the residuals of two observations that agree in all columns: eps_k is at least
  that, rounded down, if the residual is a function of these columns. Zero without such a pair. */
  double repeated = 0;
  std::optional<ObservedPair> pair;  ///< It, with the whole difference.
  /** The estimate of the error's standard deviation by the Gamma test (Stefansson, Koncar & Jones 1997): half the mean
  square difference of the residuals of p-th nearest neighbours, p = 1..10, as a line over the mean square distance, at
  distance 0. Distances are scaled by the columns' standard deviations. An estimate, not a bound. */
  double deviation = 0;
};

/** @param columns of z on which the residual depends. The Gamma test takes at most 2000 observations, evenly chosen. */
[[nodiscard]] NoiseFloor FindNoiseFloor(const Observations& observations, int coordinate,
                                        const std::vector<int>& columns);

/** The standard deviation of each column of z; 0 for a column that is constant. */
[[nodiscard]] Eigen::RowVectorXd ScalesOf(const Observations& observations);
/** Of `count` rows at most `most`, evenly chosen. */
[[nodiscard]] std::vector<int> EvenRows(int count, int most);

}  // namespace forereach
