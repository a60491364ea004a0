/** What the certificates of a task rest on, and who sees to it: the table of docs/soundness.md, section 1, with the
task's numbers. */
#pragma once

#include <string>
#include <vector>

#include "task/config.h"

namespace forereach {

struct Hypothesis {
  std::string what;       ///< A clause.
  std::string upheld_by;  ///< Who or what, and how.
};

[[nodiscard]] std::vector<Hypothesis> HypothesesOf(const Config& config);

}  // namespace forereach
