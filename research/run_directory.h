/** Where a run keeps what it has finished, so that it can be stopped and go on: a JSON file for each cell, written
whole under another name, then renamed. A cell whose file is there is never run again.

    DIR/run.json          the effort of this run
    DIR/cells/KEY.json    one for each cell (cell.h) */
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "research/cell.h"

namespace forereach::research {

class RunDirectory final {
 public:
  /** Makes the directory, or goes on with one. @throws std::runtime_error naming file, field and both values if it was
  begun with another effort, or naming the file if it cannot be read or written. */
  RunDirectory(std::filesystem::path path, const Effort& effort);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const Effort& effort() const { return effort_; }
  /** None if it has not been run. @throws std::runtime_error naming the file if it is not what Store wrote. */
  [[nodiscard]] std::optional<CellResult> Load(const Cell& cell) const;
  /** Any number of threads may store, each another cell. @throws std::runtime_error naming the file. */
  void Store(const Cell& cell, const CellResult& result) const;

 private:
  std::filesystem::path path_;
  Effort effort_;
};

/** Writes a file whole, then renames it. @throws std::runtime_error naming it. */
void WriteFile(const std::filesystem::path& path, const std::string& text);

/** The results of all cells, in their order: those that are finished are read, the others are run, each by one thread.
So results do not depend on the number of threads. Shows progress on standard error. @param threads at least 1. */
[[nodiscard]] std::vector<CellResult> RunAll(const std::vector<Cell>& cells, const RunDirectory& directory,
                                             unsigned threads);

/** One line for each cell and group, with a header line. Counts, the steps of D and S as "step:count" lists,
and recall and coverage with their Wilson intervals over the plans of the cell; empty where there are no plans. */
[[nodiscard]] std::string ToCsv(const std::vector<Cell>& cells, const std::vector<CellResult>& results);

}  // namespace forereach::research
