/** What the rows of all robots say together: shares, causes, contradictions, declarations, trend. */
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "fleet/store.h"

namespace forereach {

/** Each row names a run, where its numbers come from one: its robot, its log and an event in it. */
struct FleetTable {
  static constexpr int kMostRuns = 50;

  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
  /** Where a row's numbers come from several runs: robot and log of each, of more than kMostRuns the first so many. */
  std::vector<std::vector<std::pair<std::string, std::string>>> runs = {};
};

/** Cost: one pass over the decisions, and one over the execution events, by the server. @throws StoreError. */
[[nodiscard]] std::vector<FleetTable> ReadFleet(Store& store);

[[nodiscard]] std::string ToText(const std::vector<FleetTable>& tables);
[[nodiscard]] nlohmann::json ToJson(const std::vector<FleetTable>& tables);
/** One document that needs no network and has no scripts.
@param runs where the pages of runs are: numbers lead to RUNS/ROBOT/LOG.html, or to a list of them; empty: to nothing.
*/
[[nodiscard]] std::string FleetHtml(const std::vector<FleetTable>& tables, const std::string& runs);

}  // namespace forereach
