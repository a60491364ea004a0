/** The picture of `methods`: coverage without data against recall with them. */
#pragma once

#include <string>
#include <vector>

#include "research/plot.h"
#include "research/table.h"

namespace forereach::research {

/** One method at one N. Without a coverage it completed no tube. */
struct MethodMark {
  int observations;
  Estimate coverage, recall;
};

struct MethodMarks {
  std::string name;
  std::vector<MethodMark> bicycle, papers_bicycle, point_mass, papers_point_mass;
};

/** The first method is drawn as a star. */
[[nodiscard]] Plot MethodsPlot(const std::vector<MethodMarks>& methods);

}  // namespace forereach::research
