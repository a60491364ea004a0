/** Repeats the decisions of a recorded log, on the log's clock: by the same gate (Replay), or by that of another task,
to see what that would have changed (Compare). */
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "forereach/decision_t.hpp"
#include "records/log_tasks.h"
#include "records/log_trust.h"
#include "records/result.h"
#include "records/shard.h"
#include "task/config.h"

namespace forereach {

struct ReplayResult {
  std::int64_t candidates = 0;   ///< Candidates in the log.
  std::int64_t agreed = 0;       ///< Decisions with the recorded outcome, step, cause and digests.
  std::int64_t withdrawals = 0;  ///< Withdrawals with the recorded steps, cause and obstacle.
  std::int64_t proposals = 0;    ///< Plans proposed in the place of a refused one, and certified again.
  /** Decisions that depend on the moment and not on the plan, which are not compared: displaced, out of time, not
  armed, obstacles unknown, in fault. Withdrawals without a judgement, and proposals under grounds that the log does not
  give. */
  std::int64_t circumstances = 0;
  std::int64_t corruptions = 0;  ///< Damaged places in the log.
  PassedOver passed_over;
  /** A line for each decision and withdrawal that differs, each proposal that is not certified, each candidate without
  a recorded decision, each recorded decision without a candidate, and each fault of a certified plan's seal. */
  std::vector<std::string> differences;
  /** What was recorded and what was decided again on the candidates that were asked for, a line each. */
  std::vector<std::string> shown;
};
FOREREACH_RESULT(ReplayResult, candidates, agreed, withdrawals, proposals, circumstances, corruptions, passed_over,
                 differences, shown)

/** Gives the candidates of consecutive logs to a new gate, each at the time of its recorded decision and with the
obstacles and executed transitions that the decision names by digest, and compares the results. Plans that were
withdrawn are judged again under the grounds that the withdrawal names, and so are plans that advice proposes. It also
checks the seals of certified plans (lcmtypes/seal.h). Where the certifier restarted or reloaded, replay starts with a
new gate. With bus.key only authentic messages count. Each decision is compared under the task of its config digest; a
decision of an unknown digest differs.
@param plan_digest the beginning of a candidate's digest, in hexadecimal: ReplayResult::shown has the decisions on such
candidates. Empty: on none.
@param names_files whether events are named with their log.
@param shard which of the decisions, certified plans, withdrawals and proposals are judged.
@throws LogError if a log cannot be read, KeyError if the key cannot, std::invalid_argument as Certifier does. */
[[nodiscard]] CaseResults<ReplayResult> Replay(const std::vector<std::string>& logs, LogTasks& tasks,
                                               const std::string& plan_digest, bool names_files, const Shard& shard);
/** The same, with every decision under one task. */
[[nodiscard]] CaseResults<ReplayResult> Replay(const std::vector<std::string>& logs, const Config& task,
                                               const std::string& plan_digest, bool names_files, const Shard& shard);
[[nodiscard]] inline ReplayResult Replay(const std::vector<std::string>& logs, const Config& task) {
  return Replay(logs, task, "", logs.size() > 1, {}).Sum();
}

/** Whether a decision depends on the moment and not on the plan, so that no replay can give it again. */
[[nodiscard]] bool IsCircumstance(const decision_t& decision);

/** Why a plan is not certified, as decision_t says it. */
struct WhyNot {
  std::int16_t outcome = 0, cause = 0;
  int obstacle = -1, step = -1;  ///< -1: none applies.
  auto operator<=>(const WhyNot&) const = default;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(WhyNot, outcome, cause, obstacle, step)

struct Comparison {
  std::int64_t candidates = 0;     ///< With a decision that was compared.
  std::int64_t certificates = 0;   ///< Recorded ones among them.
  std::int64_t circumstances = 0;  ///< Decisions that no replay gives again (IsCircumstance). They are not compared.
  std::int64_t without_candidate = 0, undecided = 0;
  /** By why they were refused: recorded abstentions that would have been certificates. */
  std::map<WhyNot, std::int64_t> gained;
  /** By why they would have been refused: recorded certificates that would have been lost. */
  std::map<WhyNot, std::int64_t> lost;
  /** Refused in both, for other reasons: recorded, and under the other task. Without steps. */
  std::map<std::pair<WhyNot, WhyNot>, std::int64_t> otherwise;
  std::int64_t refused_alike = 0;                     ///< For the same outcome, cause and obstacle.
  std::vector<std::string> lost_plans, gained_plans;  ///< All of them, in the order of the log, for people.
  std::int64_t corruptions = 0;
  PassedOver passed_over;

  [[nodiscard]] std::int64_t num_gained() const;
  [[nodiscard]] std::int64_t num_lost() const;
};
FOREREACH_RESULT(Comparison, candidates, certificates, circumstances, without_candidate, undecided, gained, lost,
                 otherwise, refused_alike, lost_plans, gained_plans, corruptions, passed_over)

/** Gives each recorded candidate to the gate of `task`, at the time of its recorded decision and with the obstacles and
transitions that were known then. Channels and key are those of `task`.
@param logs consecutive logs of one run. @param names_files whether events are named with their log.
@param shard which of the decisions are compared. @throws as Replay. */
[[nodiscard]] CaseResults<Comparison> Compare(const std::vector<std::string>& logs, const Config& task,
                                              bool names_files, const Shard& shard);
[[nodiscard]] inline Comparison Compare(const std::vector<std::string>& logs, const Config& task) {
  return Compare(logs, task, true, {}).Sum();
}

}  // namespace forereach
