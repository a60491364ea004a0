/** The enclosure of a residual that changes less in some regions of the domain (Declaration::regions):
    max_i [r~_ik - eps_k - D_i(z)] <= r_k(z) <= min_i [r~_ik + eps_k + D_i(z)]   for every z in the hull of Z,
with D_i(z) the cost of a path from observation i. A row that a table fits (region_table.h) looks up the largest of
these bounds over the hull, and takes them relative to a slope where they are narrower so. A row without a table takes
for D_i the largest cost over the hull (RegionGrid::CostUpper); a row with a table in three variables does so, too, for
RegionTable::Sources. They are intersected with the bounds on |r_k| of the regions that the hull meets, and with those
of another enclosure, which knows L alone: that sees the zonotope, this one its hull.

Work. Any subset of the observations gives sound bounds. Tables know each that is added. Kept for the rest, and for
contradictions, are those that narrow a bound at their own location when they are added, and of these the last
kMostKept; of more than kMostTried given at once, so many are added, evenly. */
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "forereach/residual/consistency.h"
#include "forereach/residual/declaration.h"
#include "forereach/residual/enclosure.h"
#include "forereach/residual/observations.h"
#include "forereach/residual/region_grid.h"
#include "forereach/residual/region_table.h"

namespace forereach {

class RegionalEnclosure final : public ResidualEnclosure {
 public:
  static constexpr std::size_t kMostKept = 512;
  static constexpr int kMostTried = 4096;

  /** @param domain_lower, domain_upper as of LipschitzEnvelope. @param others must outlive this object, and sets no
  slope. @pre declaration.Validate passed; every path along the axes between points of the domain stays in it if it
  moves the variables of the regions one after the other, and the others together. */
  RegionalEnclosure(const Declaration& declaration, const Observations& observations,
                    std::span<const double> domain_lower, std::span<const double> domain_upper,
                    const ResidualEnclosure& others);

  /** Cost, in each row of RegionGrid::rows(): RegionTable::EncloseTilted, or RegionGrid::CostUpper for each observation
  that is kept and may narrow a bound; with three variables both, for up to RegionTable::kMostSources of them. */
  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override;

  /** Adds an observation, and tests it against those that are kept; the rest is not to be called meanwhile. Cost:
  RegionGrid::CostUpper for each of these, and RegionTable::Spread: tens of milliseconds where it narrows all of a
  table.
  @param id above all earlier ones.
  @param lower, upper n entries: enclosures of the observed residual. */
  void Add(int id, std::span<const double> z, std::span<const double> lower, std::span<const double> upper);

  /** The first pair found that contradicts the regions: |r~_ik - r~_jk| >= difference > bound >= D + 2 eps_k, in real
  arithmetic. Another pair may be missed: some are not kept, and some paths are shorter than those along the axes. Or
  the first observation found that contradicts a region's bound by itself; none of these is missed. */
  [[nodiscard]] const std::optional<Violation>& violation() const { return violation_; }
  [[nodiscard]] const RegionGrid& grid() const { return grid_; }
  [[nodiscard]] bool Keeps(int id) const { return Find(id) != nullptr; }

 private:
  struct Kept {
    int id;
    RegionGrid::Box at;
    std::vector<double> floor = {}, ceiling = {};  // r~ -+ eps rounded outward, of grid_.rows()
  };

  [[nodiscard]] const Kept* Find(int id) const noexcept;
  void SpreadAll();
  void AddTested(Kept one, std::span<const double> z, std::span<const double> lower, std::span<const double> upper);
  void Tilt(const QuerySet& query, std::size_t k, const RegionTable::Bounds& found,
            ResidualBounds& bounds) const noexcept;
  void Narrow(std::size_t row, const Kept& one, const RegionGrid::Box& to, Interval& bounds) const noexcept;
  void Test(const Kept& one);
  void TestBounds(int id, const RegionGrid::Box& at, std::span<const double> lower, std::span<const double> upper);

  RegionGrid grid_;
  std::vector<Region> regions_;
  std::vector<double> error_;  // eps, of each state
  const ResidualEnclosure& others_;
  std::vector<std::optional<RegionTable>> tables_;  // of grid_.rows()
  std::vector<Kept> kept_;
  std::optional<Violation> violation_;
};

/** The regions' part of FindViolation (consistency.h): whether these observations contradict the regions. Looks at all
pairs of those that RegionalEnclosure keeps. */
[[nodiscard]] std::optional<Violation> FindRegionalViolation(const Declaration& declaration,
                                                             const Observations& observations,
                                                             std::span<const double> domain_lower,
                                                             std::span<const double> domain_upper);

}  // namespace forereach
