/** Beyond the paper: a bound on the residual for each region of the domain (Declaration::regions) beside one L, on the
paper's systems, plans and data. */
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>

#include "research/systems.h"

namespace forereach::research {

/** The point mass without the ball around its speeds: no region may be bounded by what a ball names. */
[[nodiscard]] const System& PointMassInABox();

struct RegionalStudyOptions {
  std::filesystem::path directory;  ///< Of results
  bool quick = false;               ///< Exact parameters, the smallest and the largest N, few plans: seconds
  std::string command;              ///< That the report names as its origin
};

/** Writes DIR/regional.md, also printed to `out`: recall, half-width, build and query time. Cost: some minutes. */
void RunRegional(const RegionalStudyOptions& options, std::ostream& out);

}  // namespace forereach::research
