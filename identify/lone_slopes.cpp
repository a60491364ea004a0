#include "identify/lone_slopes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "forereach/numerics/size.h"
#include "identify/noise_floor.h"

namespace forereach {
namespace {

constexpr int kMost = 2000;

// The place in `columns` of the one in which two observations essentially differ alone, or -1.
int LoneColumn(const Eigen::MatrixXd& scaled, Eigen::Index i, Eigen::Index j) {
  double most = 0, second = 0;
  int place = -1;
  for (Eigen::Index c = 0; c < scaled.rows(); ++c) {
    const double difference = std::abs(scaled(c, i) - scaled(c, j));
    if (difference > most) {
      second = most;
      most = difference;
      place = static_cast<int>(c);
    } else {
      second = std::max(second, difference);
    }
  }
  return second <= LoneSlope::kOthers * most ? place : -1;
}

}  // namespace

std::vector<LoneSlope> FindLoneSlopes(const Declaration& declaration, const Observations& observations, int coordinate,
                                      const std::vector<int>& columns) {
  const Eigen::RowVectorXd scales = ScalesOf(observations);
  std::vector<int> varied, rows;
  for (const int l : columns)
    if (scales[l] > 0) varied.push_back(l);
  const int count = std::min(observations.size(), kMost);
  for (int i = 0; i < count; ++i) rows.push_back(static_cast<int>(std::int64_t{i} * observations.size() / count));
  Eigen::MatrixXd scaled(std::ssize(varied), count);  // an observation a column
  for (Eigen::Index c = 0; c < scaled.rows(); ++c)
    scaled.row(c) = observations.z(rows, varied[ToSize(c)]).transpose() / scales[varied[ToSize(c)]];
  const double error = 2 * declaration.ObservationError(coordinate);
  std::vector<LoneSlope> found(ToSize(scales.size()));
  for (int j = 1; j < count; ++j)
    for (int i = 0; i < j; ++i) {
      const int place = LoneColumn(scaled, i, j);
      if (place < 0) continue;
      const int l = varied[ToSize(place)], first = rows[ToSize(i)], second = rows[ToSize(j)];
      LoneSlope& entry = found[ToSize(l)];
      ++entry.pairs;
      const auto above = [&](int a, int b) {
        return observations.lower(a, coordinate) - observations.upper(b, coordinate);
      };
      const double slope = (std::max(above(first, second), above(second, first)) - error) /
                           std::abs(observations.z(first, l) - observations.z(second, l));
      if (slope > entry.slope) entry.slope = slope, entry.first = first, entry.second = second;
    }
  return found;
}

}  // namespace forereach
