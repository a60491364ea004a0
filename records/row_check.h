/** Compares the decisions and execution events that a database has of a log with those that the interpreter makes of
its events again. Gaps are not compared: how many messages are missing depends on what else reached the logger. */
#pragma once

#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "records/rows.h"

namespace forereach {

/** What is known of how the recorded rows came about. */
struct RowGrounds {
  std::int64_t end = std::numeric_limits<std::int64_t>::max();  ///< All rows of events with lower numbers are recorded.
  bool knows_order = true;           ///< The log and what was before it is whole: latencies follow from it.
  bool misses_candidates = false;    ///< The logger lost candidates after their receipt: it knew more latencies.
  std::set<std::string> lossy{};     ///< Channels of which the logger lost messages itself.
  std::set<std::int64_t> damaged{};  ///< Events that the log does not have as they were: their rows are not compared.
};

/** A sentence for each row of an event that differs, is recorded without such an event, or is not recorded:
"decisions, event 7: outcome certified, by its event abstain_safety".
@param recorded, derived in the order of their events. */
[[nodiscard]] std::vector<std::string> CompareRows(const Rows& recorded, const Rows& derived,
                                                   const RowGrounds& grounds);

}  // namespace forereach
