/** Plans of one's own choice of method, size, seeds and horizon, written out one by one: `research/run plans`. */
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "research/cell.h"

namespace forereach::research {

struct PlansOptions {
  std::string system = "bicycle", method = "ForeReach";
  int observations = 400;  ///< N
  int horizon = 12;        ///< T, 4 to 40
  int first_seed = 0, seeds = 10;
  Effort effort{600, 300};
  unsigned threads = 1;
  std::filesystem::path directory;
};

/** A column of a file, or where its name is in capitals one for each state or input: STATE, INPUT, STATE_half_width. */
struct Column {
  const char *name, *meaning;
};
struct File {
  const char* name;
  std::vector<Column> columns;
};
/** What RunPlans writes beside the transitions; research/methods.md has the same tables. */
[[nodiscard]] const std::vector<File>& FilesOfPlans();

/** Groups A to C in the paper's corridor layout under the deployed declaration, without noise. Writes into `directory`:
    scenarios.csv, controls.csv, outcomes.csv, intervals.csv   with the columns of FilesOfPlans
    transitions-SEED.csv                                        the data of each seed, as `forereach fit` reads them
and prints the intervals. The same for any number of threads. CP-SLS-MPC's budget stays that of 12 steps.
@throws std::invalid_argument naming a system or method that there is not, std::runtime_error naming a file. */
void RunPlans(const PlansOptions& options, std::ostream& out);

}  // namespace forereach::research
