#include "forereach/residual/regional_enclosure.h"

#include <algorithm>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/sets/zonotope.h"

namespace forereach {
namespace {

std::span<const double> EntriesOfRow(const Eigen::VectorXd& entries) {
  return {entries.data(), ToSize(entries.size())};
}

}  // namespace

RegionalEnclosure::RegionalEnclosure(const Declaration& declaration, const Observations& observations,
                                     std::span<const double> domain_lower, std::span<const double> domain_upper,
                                     const ResidualEnclosure& others)
    : grid_(declaration, domain_lower, domain_upper), others_(others) {
  for (const int k : grid_.rows()) error_.push_back(declaration.ObservationError(k));
  const int tried = std::min(observations.size(), kMostTried);
  for (int t = 0; t < tried; ++t) {
    const auto i = static_cast<int>(static_cast<std::int64_t>(t) * observations.size() / tried);
    const Eigen::VectorXd z = observations.z.row(i), lower = observations.lower.row(i),
                          upper = observations.upper.row(i);
    Add(i, EntriesOfRow(z), EntriesOfRow(lower), EntriesOfRow(upper));
  }
}

void RegionalEnclosure::Add(int id, std::span<const double> z, std::span<const double> lower,
                            std::span<const double> upper) {
  Kept one{id, {}, {}, {}};
  std::ranges::copy(z, one.at.lower.begin());
  std::ranges::copy(z, one.at.upper.begin());
  grid_.Find(one.at);
  for (std::size_t i = 0; i < grid_.rows().size(); ++i) {
    const auto k = ToSize(grid_.rows()[i]);
    one.floor.push_back(SubDown(lower[k], error_[i]));
    one.ceiling.push_back(AddUp(upper[k], error_[i]));
  }
  if (!violation_) Test(one);
  bool narrows = false;
  for (std::size_t i = 0; i < grid_.rows().size() && !narrows; ++i) {
    const Interval known = Bound(i, one.at, Interval::Entire());
    narrows = one.floor[i] > known.lower || one.ceiling[i] < known.upper;
  }
  if (!narrows) return;
  if (kept_.size() == kMostKept) kept_.erase(kept_.begin());
  kept_.push_back(std::move(one));
}

// floor = r~ - eps rounded down, so a floor above a ceiling by more than the path's cost is a contradiction.
void RegionalEnclosure::Test(const Kept& one) {
  for (std::size_t i = 0; i < grid_.rows().size(); ++i)
    for (const Kept& other : kept_) {
      const double apart = std::max(SubDown(one.floor[i], other.ceiling[i]), SubDown(other.floor[i], one.ceiling[i]));
      if (!(apart > 0)) continue;
      const double cost = grid_.CostUpper(i, other.at, one.at);
      const double errors = MulUp(2, error_[i]), difference = AddDown(apart, errors), bound = AddUp(cost, errors);
      if (!(difference > bound)) continue;
      violation_ = Violation{other.id, one.id, grid_.rows()[i], difference, bound};
      return;
    }
}

// `bounds` narrowed by what is kept.
Interval RegionalEnclosure::Bound(std::size_t row, const RegionGrid::Box& to, Interval bounds) const noexcept {
  for (const Kept& one : kept_) {
    const double floor = one.floor[row], ceiling = one.ceiling[row];
    if (!(floor > bounds.lower) && !(ceiling < bounds.upper)) continue;
    const double enough = std::max(floor - bounds.lower, bounds.upper - ceiling);  // rounded: it only saves time
    const double cost = grid_.CostUpper(row, one.at, to, enough);
    bounds.lower = std::max(bounds.lower, SubDown(floor, cost));
    bounds.upper = std::min(bounds.upper, AddUp(ceiling, cost));
  }
  return bounds;
}

void RegionalEnclosure::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  others_.Enclose(query, bounds);
  const auto n = ToSize(query.slice.dim());
  RegionGrid::Box hull;
  for (std::size_t l = 0; l < n; ++l) {
    const double center = query.slice.center(static_cast<int>(l));
    hull.lower[l] = SubDown(center, query.half_width[l]);
    hull.upper[l] = AddUp(center, query.half_width[l]);
  }
  for (std::size_t l = 0; l < query.input.size(); ++l) hull.lower[n + l] = hull.upper[n + l] = query.input[l];
  grid_.Find(hull);
  for (std::size_t i = 0; i < grid_.rows().size(); ++i) {
    const auto k = ToSize(grid_.rows()[i]);
    const Interval narrower = Bound(i, hull, {bounds.lower[k], bounds.upper[k]});
    bounds.lower[k] = narrower.lower;
    bounds.upper[k] = narrower.upper;
  }
}

bool RegionalEnclosure::Keeps(int id) const { return std::ranges::find(kept_, id, &Kept::id) != kept_.end(); }

std::optional<Violation> FindRegionalViolation(const Declaration& declaration, const Observations& observations,
                                               std::span<const double> domain_lower,
                                               std::span<const double> domain_upper) {
  if (declaration.regions.empty()) return std::nullopt;
  class Nothing final : public ResidualEnclosure {
    void Enclose(const QuerySet&, ResidualBounds&) const noexcept override {}
  } nothing;
  return RegionalEnclosure(declaration, observations, domain_lower, domain_upper, nothing).violation();
}

}  // namespace forereach
