/** Gathers what a page shows, from event logs, a decision database or a logger's directory. */
#pragma once

#include <string>
#include <vector>

#include "page/page_data.h"
#include "records/log_trust.h"

namespace forereach {

/** Bounds on the drawings of one page. */
struct DetailBounds {
  /** The last certified plans, and the last abstentions. */
  std::size_t certified = 2000, abstained = 2000;
  /** Numbers in all drawings: corners of tubes, and ten for each obstacle. */
  std::size_t numbers = 12'000'000;
};

/** Reads consecutive event logs of one run, or one database, or one directory with a database or with logs. Rows of a
database need no log; tubes, faults and withdrawals come from the logs beside it. Tubes are of candidates that this
program decides again as the record has it.
@param config the task file; empty: the tasks that the logger kept next to the logs.
@param bounds of the drawings; zeros for none.
@throws BadInput if nothing can be read, or for logs without their task. */
[[nodiscard]] PageRun GatherPage(const std::vector<std::string>& inputs, const std::string& config, const LogKey& key,
                                 const DetailBounds& bounds);

}  // namespace forereach
