/** Replays the candidates of a recorded log under another task, and compares the decisions: what that task would have
changed. */
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "records/log_trust.h"
#include "records/shard.h"
#include "task/config.h"

namespace forereach {

/** Why a plan is not certified, as decision_t says it. */
struct WhyNot {
  std::int16_t outcome = 0, cause = 0;
  int obstacle = -1, step = -1;  ///< -1: none applies.
  auto operator<=>(const WhyNot&) const = default;
};

struct Comparison {
  std::int64_t candidates = 0;     ///< With a decision that was compared.
  std::int64_t certificates = 0;   ///< Recorded ones among them.
  std::int64_t circumstances = 0;  ///< Decisions that no replay gives again (records/replay.h). They are not compared.
  std::int64_t without_candidate = 0, undecided = 0;
  /** By why they were refused: recorded abstentions that would have been certificates. */
  std::map<WhyNot, std::int64_t> gained;
  /** By why they would have been refused: recorded certificates that would have been lost. */
  std::map<WhyNot, std::int64_t> lost;
  /** Refused in both, for other reasons: recorded, and under the other task. Without steps. */
  std::map<std::pair<WhyNot, WhyNot>, std::int64_t> otherwise;
  std::int64_t refused_alike = 0;       ///< For the same outcome, cause and obstacle.
  std::vector<std::string> lost_plans;  ///< The first kLostPlans of them, for people.
  std::int64_t corruptions = 0;
  PassedOver passed_over;

  static constexpr std::size_t kLostPlans = 20;

  [[nodiscard]] std::int64_t num_gained() const;
  [[nodiscard]] std::int64_t num_lost() const;
};

/** Gives each recorded candidate to the gate of `task`, at the time of its recorded decision and with the obstacles and
transitions that were known then. Channels and key are those of `task`.
@param logs consecutive logs of one run. @param names_files whether events are named with their log.
@param shard which of the decisions are compared. @throws as Replay. */
[[nodiscard]] CaseResults<Comparison> Compare(const std::vector<std::string>& logs, const Config& task,
                                              bool names_files, const Shard& shard);
[[nodiscard]] inline Comparison Compare(const std::vector<std::string>& logs, const Config& task) {
  return Compare(logs, task, true, {}).Sum();
}

/** Adds up the comparisons of several runs or cases. */
Comparison& operator+=(Comparison& sum, const Comparison& other);

}  // namespace forereach
