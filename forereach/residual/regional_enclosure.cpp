#include "forereach/residual/regional_enclosure.h"

#include <algorithm>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/sets/zonotope.h"

namespace forereach {
namespace {

// Bounds relative to a slope are taken if they and a share of what it changes over the slice are narrower than most of
// the others' width. The verifier has the same.
constexpr double kOfSlope = 0.53, kNarrower = 0.999;

std::span<const double> EntriesOfRow(const Eigen::VectorXd& entries) {
  return {entries.data(), ToSize(entries.size())};
}

RegionGrid::Box PlaceOf(std::span<const double> z, const RegionGrid& grid) {
  RegionGrid::Box at{};
  std::ranges::copy(z, at.lower.begin());
  std::ranges::copy(z, at.upper.begin());
  grid.Find(at);
  return at;
}

}  // namespace

RegionalEnclosure::RegionalEnclosure(const Declaration& declaration, const Observations& observations,
                                     std::span<const double> domain_lower, std::span<const double> domain_upper,
                                     const ResidualEnclosure& others)
    : grid_(declaration, domain_lower, domain_upper), regions_(declaration.regions), others_(others) {
  for (int k = 0; k < observations.num_states(); ++k) error_.push_back(declaration.ObservationError(k));
  const auto with_row = [&](int i, const auto& use) {
    const Eigen::VectorXd z = observations.z.row(i), lower = observations.lower.row(i),
                          upper = observations.upper.row(i);
    use(EntriesOfRow(z), EntriesOfRow(lower), EntriesOfRow(upper));
  };
  for (int i = 0; i < observations.size() && declaration.AnyRegionHas(&Region::bound); ++i)
    with_row(i, [&](auto z, auto lower, auto upper) { TestBounds(i, PlaceOf(z, grid_), lower, upper); });
  for (std::size_t i = 0; i < grid_.rows().size(); ++i) {
    tables_.emplace_back();
    if (RegionTable::Fits(grid_, i)) tables_.back().emplace(grid_, i, domain_lower, domain_upper);
  }
  // Any subset of the observations bounds the residual. All of them are held against each other by L (consistency.h).
  const int tried = std::min(observations.size(), kMostTried);
  for (int t = 0; t < tried; ++t) {
    const auto i = static_cast<int>(static_cast<std::int64_t>(t) * observations.size() / tried);
    with_row(i, [&](auto z, auto lower, auto upper) { AddTested({i, PlaceOf(z, grid_)}, z, lower, upper); });
  }
  SpreadAll();
}

void RegionalEnclosure::SpreadAll() {
  for (std::optional<RegionTable>& table : tables_)
    if (table) table->Spread();
}

void RegionalEnclosure::Add(int id, std::span<const double> z, std::span<const double> lower,
                            std::span<const double> upper) {
  const RegionGrid::Box at = PlaceOf(z, grid_);
  TestBounds(id, at, lower, upper);
  AddTested({id, at}, z, lower, upper);
  SpreadAll();
}

// What TestBounds has seen.
void RegionalEnclosure::AddTested(Kept one, std::span<const double> z, std::span<const double> lower,
                                  std::span<const double> upper) {
  for (std::size_t i = 0; i < grid_.rows().size(); ++i) {
    const auto k = ToSize(grid_.rows()[i]);
    one.floor.push_back(SubDown(lower[k], error_[k]));
    one.ceiling.push_back(AddUp(upper[k], error_[k]));
    if (tables_[i]) tables_[i]->Add(one.id, z, one.floor[i], one.ceiling[i]);
  }
  if (!violation_) Test(one);
  bool narrows = false;
  for (std::size_t i = 0; i < grid_.rows().size() && !narrows; ++i) {
    Interval known = Interval::Entire();
    for (const Kept& other : kept_) Narrow(i, other, one.at, known);
    narrows = one.floor[i] > known.lower || one.ceiling[i] < known.upper;
  }
  if (!narrows) return;
  // The oldest goes: a query has a bounded cost, whatever the robot reports.
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
      // Said as the pairwise test says it, of r~; both roundings are against a violation.
      const double errors = MulUp(2, error_[ToSize(grid_.rows()[i])]), difference = AddDown(apart, errors),
                   bound = AddUp(cost, errors);
      if (!(difference > bound)) continue;
      violation_ = Violation{other.id, one.id, grid_.rows()[i], difference, bound};
      return;
    }
}

// What an observation shows of the residual, against the bound where it is; the region named is one that says so.
void RegionalEnclosure::TestBounds(int id, const RegionGrid::Box& at, std::span<const double> lower,
                                   std::span<const double> upper) {
  for (std::size_t k = 0; k < error_.size() && !violation_; ++k) {
    const double bound = grid_.LargestBound(RegionBound::kResidual, k, at);
    const double least = std::max(SubDown(lower[k], error_[k]), SubDown(-upper[k], error_[k]));
    if (!(least > bound)) continue;
    const auto says = std::ranges::find_if(regions_, [&](const Region& region) {
      return region.bound.size() != 0 && region.bound[static_cast<Eigen::Index>(k)] == bound &&
             region.Contains(at.lower);
    });
    const int region = static_cast<int>(says - regions_.begin());
    violation_ = Violation{id, Violation::OfRegion(region), static_cast<int>(k), least, bound};
  }
}

void RegionalEnclosure::Narrow(std::size_t row, const Kept& one, const RegionGrid::Box& to,
                               Interval& bounds) const noexcept {
  const double floor = one.floor[row], ceiling = one.ceiling[row];
  if (!(floor > bounds.lower) && !(ceiling < bounds.upper)) return;
  const double enough = std::max(floor - bounds.lower, bounds.upper - ceiling);  // rounded: it only saves time
  const double cost = grid_.CostUpper(row, one.at, to, enough);
  bounds.lower = std::max(bounds.lower, SubDown(floor, cost));
  bounds.upper = std::min(bounds.upper, AddUp(ceiling, cost));
}

void RegionalEnclosure::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  others_.Enclose(query, bounds);
  const auto n = ToSize(query.slice.dim());
  std::array<double, kMaxVariables> center;
  RegionGrid::Box hull;
  for (std::size_t l = 0; l < n; ++l) {
    center[l] = query.slice.center(static_cast<int>(l));
    hull.lower[l] = SubDown(center[l], query.half_width[l]);
    hull.upper[l] = AddUp(center[l], query.half_width[l]);
  }
  for (std::size_t l = 0; l < query.input.size(); ++l)
    center[n + l] = hull.lower[n + l] = hull.upper[n + l] = query.input[l];
  grid_.Find(hull);
  for (std::size_t k = 0; k < n; ++k) {
    // A declared bound cuts what observations say (soundness 3.20), which only narrows it.
    const double bound = grid_.LargestBound(RegionBound::kResidual, k, hull);
    bounds.lower[k] = std::max(bounds.lower[k], -bound);
    bounds.upper[k] = std::min(bounds.upper[k], bound);
  }
  for (std::size_t i = 0; i < grid_.rows().size(); ++i) {
    const auto k = ToSize(grid_.rows()[i]);
    Interval known{bounds.lower[k], bounds.upper[k]};
    RegionTable::Bounds found;
    if (tables_[i]) {
      found = tables_[i]->EncloseTilted(hull, center);
      known = {std::max(known.lower, found.plain.lower), std::min(known.upper, found.plain.upper)};
      for (const int id : tables_[i]->Sources(center)) {
        if (id < 0) break;
        if (const Kept* one = Find(id)) Narrow(i, *one, hull, known);
      }
    } else {
      for (const Kept& one : kept_) Narrow(i, one, hull, known);
    }
    bounds.lower[k] = known.lower;
    bounds.upper[k] = known.upper;
    Tilt(query, k, found, bounds);
  }
}

// Relative to a slope where that is much narrower.
void RegionalEnclosure::Tilt(const QuerySet& query, std::size_t k, const RegionTable::Bounds& found,
                             ResidualBounds& bounds) const noexcept {
  const auto& slope = found.tilt.slope;
  if (std::ranges::count(slope, 0) == std::ssize(slope)) return;
  double width = found.tilted.upper - found.tilted.lower;
  for (std::size_t a = 0; a < grid_.variables().size(); ++a)
    if (slope[a] != 0) width += kOfSlope * 2 * std::abs(slope[a]) * query.half_width[ToSize(grid_.variables()[a])];
  if (!(width < kNarrower * (bounds.upper[k] - bounds.lower[k]))) return;
  const auto n = ToSize(query.slice.dim());
  if (!bounds.has_slope)
    for (std::size_t row = 0; row < n; ++row) std::fill_n(bounds.slope[row].begin(), n, 0.0);
  bounds.has_slope = true;
  bounds.lower[k] = found.tilted.lower;
  bounds.upper[k] = found.tilted.upper;
  for (std::size_t a = 0; a < grid_.variables().size(); ++a)
    if (slope[a] != 0) bounds.slope[k][ToSize(grid_.variables()[a])] = slope[a];
}

const RegionalEnclosure::Kept* RegionalEnclosure::Find(int id) const noexcept {
  const auto at = std::ranges::lower_bound(kept_, id, {}, &Kept::id);
  return at != kept_.end() && at->id == id ? &*at : nullptr;
}

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
