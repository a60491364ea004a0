#include "forereach/certify/problem.h"

#include <algorithm>

#include "forereach/numerics/size.h"
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
    for (std::size_t i = 0; i < domain.inequalities.size(); ++i)
      if (domain.inequalities[i].coefficients[l] != 0) return name("inequalities", i, l);
    for (std::size_t i = 0; i < domain.balls.size(); ++i)
      if (std::ranges::count(domain.balls[i].coordinates, l) > 0) return name("balls", i, l);
  }
  return {};
}

}  // namespace forereach
