/** Runs experiments into a run directory and reports on them. */
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "research/experiment.h"
#include "research/origin.h"

namespace forereach::research {

struct RunOptions {
  std::vector<std::string> names;  ///< Of experiments, in the order of the report
  Scope scope;
  Effort effort{600, 300};  ///< The paper's: each system takes at most its own
  unsigned threads = 1;
  std::filesystem::path directory;  ///< Results; see RunDirectory
  std::filesystem::path report;     ///< The report in Markdown; empty: directory/report.md
  Origin origin;                    ///< That the report names
};

/** Every cell of the experiments that is not finished is run, then written:
    DIR/NAME.csv    of each experiment with cells: a line for each cell and group
    DIR/tables.csv  all tables
    DIR/report.md   the same for people; also printed to `out`
    DIR/plots/NAME.gp  the pictures' scripts; the pictures are in figures/ beside the report, which links them
For any number of threads the files are the same, but for the lines about the origin of the report.
@throws std::invalid_argument for an unknown name, std::runtime_error as RunDirectory does. */
void RunExperiments(const RunOptions& options, std::ostream& out);

}  // namespace forereach::research
