#include "forereach/certify/problem.h"

#include <algorithm>

#include "forereach/dynamics/angles.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/residual/region_grid.h"

namespace forereach {

std::string FindCoupledRegion(const Problem& problem) {
  const Domain& domain = problem.domain;
  const auto name = [&](const std::string& constraints, std::size_t i, int variable) {
    return "domain." + constraints + "[" + std::to_string(i) + "] names " +
           problem.model->variable_names()[ToSize(variable)];
  };
  const RegionGrid grid(problem.declaration);
  for (const int l : grid.variables()) {
    // Moved along this variable alone, a point might leave the domain, outside of which no slope is declared (soundness
    // 3.20).
    for (std::size_t i = 0; i < domain.inequalities.size(); ++i)
      if (domain.inequalities[i].coefficients[l] != 0) return name("inequalities", i, l);
    for (std::size_t i = 0; i < domain.balls.size(); ++i)
      if (std::ranges::count(domain.balls[i].coordinates, l) > 0) return name("balls", i, l);
  }
  return {};
}

std::string FindTurningRegion(const Problem& problem) {
  const std::vector<Interval> ranges = problem.domain.Ranges();
  const std::vector<Region>& regions = problem.declaration.regions;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const Region& region = regions[i];
    const std::string key = region.disturbance.size() != 0   ? "disturbance"
                            : region.noise_bound.size() != 0 ? "noise_bound"
                            : region.bound.size() != 0       ? "bound"
                                                             : "";
    for (const auto& [l, box] : region.box) {
      const Interval& range = ranges[ToSize(l)];
      // kTurn.lower is below 2 pi.
      if (key.empty() || !problem.model->IsAngle(l) || SubUp(range.upper, range.lower) <= kTurn.lower) continue;
      return "regions[" + std::to_string(i) + "]." + key + " is bounded by " +
             problem.model->variable_names()[ToSize(l)] + ", an angle, of which the domain has [" +
             ToText(range.lower) + ", " + ToText(range.upper) +
             "], must be less than a turn: another number may be the same configuration";
    }
  }
  return {};
}

}  // namespace forereach
