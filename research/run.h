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

/** @name A run on several machines, by scripts/fleet: each shard is a file, and merged they print what the run prints.
 */
///@{
/** Runs the cells whose number in the run is `index` modulo `count`; FILE.cells has the finished ones. */
void RunShard(const RunOptions& options, int index, int count, const std::filesystem::path& file);
/** RunExperiments of the shards' run, with their cells in `directory`; empty: that of such a run.
@param options of which the names, scope, effort and command are the shards'. @throws std::runtime_error naming the file
that is no shard of the first one's run, or what of the run is missing. */
void MergeShards(const std::vector<std::string>& files, RunOptions options, std::ostream& out);
///@}

/** Where a run keeps its results if nothing else is said. */
[[nodiscard]] std::filesystem::path DefaultDirectory(bool quick);

}  // namespace forereach::research
