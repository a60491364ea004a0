#include "identify/noise_floor.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"

namespace forereach {
namespace {

// The Gamma test compares each with each.
constexpr int kNeighbours = 10, kMostObservations = 2000;

// Among observations that agree in all columns: the one with the largest floor and the one with the least ceiling.
void FindRepeated(const Observations& observations, int k, const std::vector<int>& columns, NoiseFloor& floor) {
  const Eigen::MatrixXd& z = observations.z;
  std::vector<int> order(ToSize(observations.size()));
  std::iota(order.begin(), order.end(), 0);
  const auto before = [&](int i, int j) {
    for (const int l : columns)
      if (z(i, l) != z(j, l)) return z(i, l) < z(j, l);
    return false;
  };
  std::ranges::sort(order, before);
  for (auto begin = order.begin(); begin != order.end();) {
    const auto end = std::find_if(begin, order.end(), [&](int i) { return before(*begin, i); });
    const int highest = *std::max_element(
        begin, end, [&](int i, int j) { return observations.lower(i, k) < observations.lower(j, k); });
    const int lowest = *std::min_element(
        begin, end, [&](int i, int j) { return observations.upper(i, k) < observations.upper(j, k); });
    const double difference = SubDown(observations.lower(highest, k), observations.upper(lowest, k));
    if (difference / 2 > floor.repeated) {
      floor.repeated = difference / 2;
      floor.pair = ObservedPair{highest, lowest, difference};
    }
    begin = end;
  }
}

double GammaTest(const Observations& observations, int k, const std::vector<int>& columns) {
  const std::vector<int> rows = EvenRows(observations.size(), kMostObservations);
  const int count = static_cast<int>(rows.size());
  if (count <= kNeighbours || columns.empty()) return 0;
  const Eigen::RowVectorXd scales = ScalesOf(observations);
  Eigen::MatrixXd places(static_cast<Eigen::Index>(columns.size()), count);
  Eigen::VectorXd residuals(count);
  for (int i = 0; i < count; ++i) {
    const int row = rows[ToSize(i)];
    for (std::size_t c = 0; c < columns.size(); ++c)
      places(static_cast<Eigen::Index>(c), i) =
          scales[columns[c]] > 0 ? observations.z(row, columns[c]) / scales[columns[c]] : 0;
    residuals[i] = (observations.lower(row, k) + observations.upper(row, k)) / 2;
  }
  Eigen::ArrayXd distance = Eigen::ArrayXd::Zero(kNeighbours), difference = distance;
  std::vector<std::pair<double, int>> others(ToSize(count));
  for (int i = 0; i < count; ++i) {
    const Eigen::VectorXd squares = (places.colwise() - places.col(i)).colwise().squaredNorm();
    for (int j = 0; j < count; ++j) others[ToSize(j)] = {j == i ? kInfinity : squares[j], j};
    std::partial_sort(others.begin(), others.begin() + kNeighbours, others.end());
    for (int p = 0; p < kNeighbours; ++p) {
      distance[p] += others[ToSize(p)].first / count;
      difference[p] += std::pow(residuals[others[ToSize(p)].second] - residuals[i], 2) / (2.0 * count);
    }
  }
  const double mean = distance.mean(), spread = (distance - mean).square().sum();
  const double slope = spread > 0 ? ((distance - mean) * difference).sum() / spread : 0;
  // The line at distance 0; by chance it may be below zero there.
  return std::sqrt(std::max(0.0, difference.mean() - slope * mean));
}

}  // namespace

Eigen::RowVectorXd ScalesOf(const Observations& observations) {
  const Eigen::MatrixXd& z = observations.z;
  Eigen::RowVectorXd scales(z.cols());
  for (Eigen::Index l = 0; l < z.cols(); ++l) {
    // Exactly: the mean of equal numbers may be off by a rounding, and would give them a scale.
    const bool constant = (z.col(l).array() == z(0, l)).all();
    const Eigen::ArrayXd about = z.col(l).array() - z.col(l).mean();
    scales[l] = constant ? 0 : std::sqrt(about.square().mean());
  }
  return scales;
}

std::vector<int> EvenRows(int count, int most) {
  std::vector<int> rows(ToSize(std::min(count, most)));
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i] = static_cast<int>(static_cast<std::int64_t>(i) * count / std::ssize(rows));
  return rows;
}

NoiseFloor FindNoiseFloor(const Observations& observations, int coordinate, const std::vector<int>& columns) {
  NoiseFloor floor;
  FindRepeated(observations, coordinate, columns, floor);
  floor.deviation = GammaTest(observations, coordinate, columns);
  return floor;
}

}  // namespace forereach
