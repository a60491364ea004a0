/** Beyond the paper: rows of the residual that are affine, with a rest and without (Declaration::affine), beside one L,
on the paper's systems, plans and data, and on a point mass whose residual is affine. */
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>

namespace forereach::research {

struct AffineStudyOptions {
  std::filesystem::path directory;  ///< Of results
  bool quick = false;               ///< The smallest N of each system, few plans: seconds
  std::string command;              ///< That the report names as its origin
};

/** Writes DIR/affine.md, also printed to `out`: what each declaration is worth, and how many observations refute it.
Cost: a minute. */
void RunAffine(const AffineStudyOptions& options, std::ostream& out);

}  // namespace forereach::research
