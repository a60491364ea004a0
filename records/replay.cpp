#include "records/replay.h"

#include <algorithm>
#include <deque>
#include <memory>
#include <utility>

#include "bus/bus_options.h"
#include "certifier/gate/gate.h"
#include "forereach/decision_t.hpp"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "records/timeline.h"

namespace forereach {
namespace {

std::string DescribeDecision(const decision_t& decision) {
  std::string text(OutcomeName(decision.outcome));
  text += ", cause " + std::string(CauseName(decision.cause));
  return text + ", step " + std::to_string(decision.step);
}

// Empty if they agree.
std::string Difference(const decision_t& recorded, const decision_t& replayed) {
  if (recorded.outcome != replayed.outcome || recorded.cause != replayed.cause || recorded.step != replayed.step)
    return "recorded " + DescribeDecision(recorded) + "; replayed " + DescribeDecision(replayed);
  const Grounds before = GroundsOf(recorded), after = GroundsOf(replayed);
  for (const auto& [name, digest] : kGrounds)
    if (before.*digest != after.*digest)
      return (digest == &Grounds::observations || digest == &Grounds::obstacles ? "other " : "another ") +
             std::string(name);
  return {};
}

class Replayer final : public TimelineUser {
 public:
  void OnStart(const Config& task) override {
    gate_ = std::make_unique<Gate>(task);
    plans_.clear();
  }

  void OnReload(const Config& task) override {
    const std::unique_ptr<Gate> before = std::exchange(gate_, std::make_unique<Gate>(task));
    gate_->Inherit(*before);
  }

  void OnObstacles(Bytes message, std::int64_t utime) override {
    static_cast<void>(gate_->UpdateObstacles(message, utime));
  }

  void OnTransition(const ExecutedTransition&, Bytes message) override { static_cast<void>(gate_->Learn(message)); }

  void OnDecision(const RecordedDecision& recorded) override {
    const decision_t& decision = recorded.decision;
    if (!recorded.candidate)
      return Differ(recorded.event, decision.plan_id, "decided, but its candidate is not in the log");
    const auto& [bytes, event, place] = *recorded.candidate;
    if (!recorded.is_of_known_task)
      return Differ(event, decision.plan_id,
                    "decided under another task, of config digest " + ToHex(GetDigest(decision.config_digest)) +
                        ", which is not kept next to the log");
    if (IsCircumstance(decision)) {
      static_cast<void>(gate_->Refuse(bytes, decision.utime, decision.cause, ""));
      ++result_.circumstances;
      return;
    }
    const std::string difference = Difference(decision, gate_->Decide(bytes, decision.utime).decision);
    if (difference.empty())
      ++result_.agreed;
    else
      Differ(event, decision.plan_id, difference);
  }

  void OnCertified(const RecordedPlan& recorded) override {
    for (const SealFault& fault : FindSealFaults(recorded.certified))
      Differ(recorded.event, recorded.certified.plan.plan_id,
             "the seal does not hold: " + fault.field + " is " + fault.found + ", it has to be " + fault.expected);
    if (plans_.size() == kPlans) plans_.pop_front();
    plans_.emplace_back(GetDigest(recorded.certified.certificate_digest), recorded.certified.plan);
  }

  void OnWithdrawn(const RecordedWithdrawal& recorded) override {
    const withdrawal_t& withdrawal = recorded.withdrawal;
    if (withdrawal.cause == withdrawal_t::NOT_JUDGED || withdrawal.cause == withdrawal_t::UNKNOWN_PLAN) {
      ++result_.circumstances;
      return;
    }
    const std::string difference = JudgeAgain(recorded);
    if (difference.empty())
      ++result_.withdrawals;
    else
      Differ(recorded.event, withdrawal.plan_id, difference);
  }

  ReplayResult Finish(const Timeline& timeline) {
    result_.candidates = timeline.candidates();
    result_.corruptions = timeline.damage().places;
    result_.passed_over = timeline.passed_over();
    timeline.undecided().ForEach(
        [this](const RecordedCandidate& candidate) { Differ(candidate.event, -1, "no decision recorded"); });
    return std::move(result_);
  }

 private:
  static constexpr std::size_t kPlans = 4096;  // more than a robot can have at one time

  // Empty if the plan's judgement is made again.
  [[nodiscard]] std::string JudgeAgain(const RecordedWithdrawal& recorded) {
    const withdrawal_t& withdrawal = recorded.withdrawal;
    if (!recorded.is_of_known_task) return "withdrawn under another task, which is not kept next to the log";
    const Grounds named = GroundsOf(withdrawal);
    for (const auto& [name, digest] : kGrounds)
      if (named.*digest != recorded.basis.grounds.*digest) return "withdrawn under other " + std::string(name);
    const auto plan = std::ranges::find(plans_, GetDigest(withdrawal.certificate_digest), &Plan::first);
    if (plan == plans_.end()) return "withdrawn, but its certified plan is not in the log";
    const Standing standing = gate_->JudgeAgain(plan->second, withdrawal.first_step);
    const Decision& verdict = standing.verdict;
    if (standing.steps == withdrawal.valid_steps && static_cast<int>(verdict.cause) == withdrawal.cause &&
        verdict.step == withdrawal.step && verdict.obstacle == withdrawal.obstacle)
      return {};
    return "withdrawn with " + std::to_string(withdrawal.valid_steps) + " steps that stand, cause " +
           std::string(WithdrawalName(withdrawal.cause)) + "; replayed " + std::to_string(standing.steps) +
           " steps, cause " + std::string(WithdrawalName(static_cast<std::int16_t>(verdict.cause)));
  }

  void Differ(const std::string& event, std::int64_t plan_id, const std::string& what) {
    result_.differences.push_back(event + ", plan " + std::to_string(plan_id) + ": " + what);
  }

  using Plan = std::pair<Digest, candidate_plan_t>;  // by its certificate

  std::unique_ptr<Gate> gate_;
  std::deque<Plan> plans_;  // the last ones
  ReplayResult result_;
};

}  // namespace

bool IsCircumstance(const decision_t& decision) {
  switch (decision.cause) {
    case decision_t::CAUSE_PAIRWISE:  // by what the certifier was told by its latch file: no pair of its own
      return decision.step < 0 && decision.first_observation < 0;
    case decision_t::CAUSE_QUEUE_FULL:
    case decision_t::CAUSE_OVERRUN:
    case decision_t::CAUSE_NOT_ARMED:
    case decision_t::CAUSE_FAULT:
    case decision_t::CAUSE_LATCH_UNWRITABLE:
    case decision_t::CAUSE_NO_OBSTACLES: return true;
    default: return false;
  }
}

ReplayResult Replay(const std::vector<std::string>& logs, const std::vector<Config>& tasks) {
  Replayer replayer;
  Timeline timeline(PointersTo(tasks), replayer);
  timeline.Read(logs, logs.size() > 1);
  return replayer.Finish(timeline);
}

}  // namespace forereach
