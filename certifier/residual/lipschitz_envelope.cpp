#include "certifier/residual/lipschitz_envelope.h"

#include <algorithm>
#include <cmath>

namespace forereach {
namespace {

constexpr std::size_t kBlock = 64;  // observations scanned at a time
constexpr std::size_t kMaxPatterns = std::size_t{1} << (LipschitzEnvelope::kMaxExactColumns - 1);

// s and -s give the same bound with |.|, so the last sign is always +1.
double Sign(std::size_t pattern, std::size_t column) { return pattern >> column & 1 ? -1 : 1; }

bool IsExact(std::size_t columns) { return columns <= LipschitzEnvelope::kMaxExactColumns; }

}  // namespace

// What does not depend on the observation. With a columns there are 2^(a-1) sign patterns s, and
// D_i = max_s |sum_l s_l L_kl (c_l - z_il)| + spread_s, spread_s >= |G^T W_k s|_1. Over the hull there is one pattern:
// D_i = sum_l L_kl |c_l - z_il| + spread.
struct LipschitzEnvelope::Query {
  std::array<double, kMaxVariables> center;  // c_l of each column
  std::array<double, kMaxPatterns> spread;
  std::size_t patterns;
};

LipschitzEnvelope::LipschitzEnvelope(const Declaration& declaration, const Observations& observations) {
  for (int k = 0; k < observations.num_states(); ++k) {
    Row row;
    const double sigma = declaration.noise_bound[k];
    for (int i = 0; i < observations.size(); ++i) {
      row.lower.push_back(SubDown(observations.lower(i, k), sigma));
      row.upper.push_back(AddUp(observations.upper(i, k), sigma));
    }
    for (int l = 0; l < observations.z.cols(); ++l) {
      const double slope = declaration.lipschitz(k, l);
      const Eigen::VectorXd z = observations.z.col(l);
      if (slope > 0) row.columns.push_back({l, slope, {z.begin(), z.end()}});
    }
    if (row.columns.empty()) {
      row.lower = {*std::max_element(row.lower.begin(), row.lower.end())};
      row.upper = {*std::min_element(row.upper.begin(), row.upper.end())};
    }
    uses_hull_distance_ |= !IsExact(row.columns.size());
    rows_.push_back(std::move(row));
  }
}

void LipschitzEnvelope::Enclose(const QuerySet& set, ResidualBounds& bounds) const noexcept {
  Query query;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Row& row = rows_[k];
    if (row.columns.empty()) {
      bounds.lower[k] = row.lower.front();
      bounds.upper[k] = row.upper.front();
    } else {
      Prepare(row, set, query);
      EncloseRow(row, query, bounds.lower[k], bounds.upper[k]);
    }
  }
}

void LipschitzEnvelope::Prepare(const Row& row, const QuerySet& set, Query& query) noexcept {
  const Zonotope& slice = set.slice;
  const std::size_t columns = row.columns.size();
  double hull_spread = 0, slack_spread = 0;  // sum_l L_kl r_l, sum_l L_kl s_l
  for (std::size_t l = 0; l < columns; ++l) {
    const int variable = row.columns[l].variable;
    if (variable < slice.dim()) {
      query.center[l] = slice.center(variable);
      const double slope = row.columns[l].slope;
      hull_spread = AddUp(hull_spread, MulUp(slope, set.half_width[static_cast<std::size_t>(variable)]));
      slack_spread = AddUp(slack_spread, MulUp(slope, slice.slack(variable)));
    } else {
      query.center[l] = set.input[static_cast<std::size_t>(variable - slice.dim())];
    }
  }
  if (!IsExact(columns)) {
    query.patterns = 1;
    query.spread[0] = hull_spread;
    return;
  }

  query.patterns = std::size_t{1} << (columns - 1);
  const auto m = static_cast<std::size_t>(slice.num_generators());
  const double underflow = static_cast<double>(m * columns) * std::numeric_limits<double>::denorm_min();
  const double error = AddUp(AddUp(DotErrorUpper(hull_spread, static_cast<int>(columns)), underflow), slack_spread);
  for (std::size_t s = 0; s < query.patterns; ++s) {
    std::array<double, kMaxGenerators> along{};
    for (std::size_t l = 0; l < columns; ++l) {
      if (row.columns[l].variable >= slice.dim()) continue;
      const double weight = Sign(s, l) * row.columns[l].slope;
      const std::span<const double> generators = slice.row(row.columns[l].variable);
      for (std::size_t j = 0; j < m; ++j) along[j] += weight * generators[j];
    }
    double sum = 0;
    for (std::size_t j = 0; j < m; ++j) sum += std::abs(along[j]);
    query.spread[s] = AddUp(SumUpper(sum, static_cast<int>(m)), error);
  }
}

double LipschitzEnvelope::DistanceUpper(const Row& row, const Query& query, std::size_t observation) noexcept {
  const std::size_t columns = row.columns.size();
  std::array<Interval, kMaxVariables> weighted;  // L_kl (c_l - z_il)
  for (std::size_t l = 0; l < columns; ++l)
    weighted[l] = Interval(row.columns[l].slope) * (Interval(query.center[l]) - row.columns[l].locations[observation]);

  double distance = 0;
  for (std::size_t s = 0; s < query.patterns; ++s) {
    Interval sum(0);
    for (std::size_t l = 0; l < columns; ++l) {
      if (IsExact(columns))
        sum += Sign(s, l) > 0 ? weighted[l] : -weighted[l];
      else
        sum += weighted[l].Magnitude();
    }
    const double candidate = AddUp(sum.Magnitude(), query.spread[s]);
    if (!(candidate <= distance)) distance = candidate;  // NaN, from sums that overflow, has to stay
    if (std::isnan(distance)) return kInfinity;
  }
  return distance;
}

void LipschitzEnvelope::EncloseRow(const Row& row, const Query& query, double& lower, double& upper) noexcept {
  const std::size_t count = row.lower.size(), columns = row.columns.size();
  const bool exact = IsExact(columns);
  std::size_t best_lower = 0, best_upper = 0;
  double highest = -kInfinity, lowest = kInfinity;
  for (std::size_t first = 0; first < count; first += kBlock) {
    const std::size_t size = std::min(kBlock, count - first);
    std::array<double, kBlock> distance{}, sum;
    for (std::size_t s = 0; s < query.patterns; ++s) {
      sum.fill(0);
      for (std::size_t l = 0; l < columns; ++l) {
        const double weight = Sign(s, l) * row.columns[l].slope, center = query.center[l];
        const double* z = row.columns[l].locations.data() + first;
        if (exact)
          for (std::size_t i = 0; i < size; ++i) sum[i] += weight * (center - z[i]);
        else
          for (std::size_t i = 0; i < size; ++i) sum[i] += weight * std::abs(center - z[i]);
      }
      for (std::size_t i = 0; i < size; ++i) {
        const double candidate = std::abs(sum[i]) + query.spread[s];
        distance[i] = distance[i] > candidate ? distance[i] : candidate;
      }
    }
    for (std::size_t i = 0; i < size; ++i) {
      const double from_below = row.lower[first + i] - distance[i], from_above = row.upper[first + i] + distance[i];
      if (from_below > highest) highest = from_below, best_lower = first + i;
      if (from_above < lowest) lowest = from_above, best_upper = first + i;
    }
  }
  lower = SubDown(row.lower[best_lower], DistanceUpper(row, query, best_lower));
  upper = AddUp(row.upper[best_upper], DistanceUpper(row, query, best_upper));
}

}  // namespace forereach
