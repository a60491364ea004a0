/** The experiment on a real car: tables, pictures and a task of what its logs say about declarations. */
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

namespace forereach::research {

struct RealOptions {
  std::filesystem::path data;       ///< The folder of the drives that are learned from, each left out in its turn
  std::vector<std::string> others;  ///< Files of drives by which what was learned from all is judged
  std::filesystem::path directory;  ///< Of results
  bool quick = false;               ///< Fewer rows in the tables
  std::string command;              ///< That the report names as its origin
};

/** Writes
    DIR/real.md, real.csv                     the tables, also printed to `out`; a line of the CSV for each trial
    DIR/figures/real-*.svg, plots/real-*.gp   the pictures
    DIR/real-task.yaml, real-model.yaml, real-transitions.csv  what was learned, for every other command
The same files from the same data. @throws ConfigError if data cannot be read or hold too little; the message says where
to get them. Cost: about two minutes for three drives of one and a half. */
void RunReal(const RealOptions& options, std::ostream& out);

}  // namespace forereach::research
