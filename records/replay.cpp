#include "records/replay.h"

#include <algorithm>
#include <deque>
#include <memory>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "bus/bus_options.h"
#include "certifier/gate/gate.h"
#include "certifier/gate/stamp.h"
#include "forereach/advice_t.hpp"
#include "forereach/decision_t.hpp"
#include "lcmtypes/codec.h"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "records/timeline.h"

namespace forereach {
namespace {

// A gate that knows what the recorded one knew.
class GateFollower : public TimelineUser {
 public:
  [[nodiscard]] std::size_t MostLearned() const override { return 0; }
  void OnStart(const Config& task) override { gate_ = std::make_unique<Gate>(task); }
  void OnReload(const Config& task) override {
    const std::unique_ptr<Gate> before = std::exchange(gate_, std::make_unique<Gate>(task));
    gate_->Inherit(*before);
  }
  void OnObstacles(Bytes message, std::int64_t utime, SenderId sender) override {
    static_cast<void>(gate_->UpdateObstacles(message, utime, sender));
  }
  void OnTransition(const ExecutedTransition&, Bytes message) override { static_cast<void>(gate_->Learn(message)); }

 protected:
  // @pre OnStart was called.
  [[nodiscard]] Gate& gate() { return *gate_; }

 private:
  std::unique_ptr<Gate> gate_;
};

std::string DescribeDecision(const decision_t& decision) {
  std::string text(OutcomeName(decision.outcome));
  text += fmt::format(", cause {}", CauseName(decision.cause));
  return fmt::format("{}, step {}", text, decision.step);
}

// Empty if they agree.
std::string Difference(const decision_t& recorded, const decision_t& replayed) {
  if (recorded.outcome != replayed.outcome || recorded.cause != replayed.cause || recorded.step != replayed.step)
    return fmt::format("recorded {}; replayed {}", DescribeDecision(recorded), DescribeDecision(replayed));
  const Grounds before = GroundsOf(recorded), after = GroundsOf(replayed);
  for (const auto& [name, digest] : kGrounds)
    if (before.*digest != after.*digest)
      return (digest == &Grounds::observations || digest == &Grounds::obstacles ? "other " : "another ") +
             std::string(name);
  return {};
}

class Replayer final : public GateFollower {
 public:
  Replayer(std::string plan_digest, const Shard& shard) : plan_digest_(std::move(plan_digest)), shard_(shard) {}

  void OnStart(const Config& task) override {
    GateFollower::OnStart(task);
    plans_.clear();
    not_learned_.clear();
    advice_ = task.bus.advice;
  }
  void OnReload(const Config& task) override {
    GateFollower::OnReload(task);
    not_learned_.clear();
  }
  void OnRefusedTransition(const std::string& event, const std::string& why) override {
    if (not_learned_.empty()) not_learned_ = fmt::format("{}: {}", event, why);
  }

  // Which plan a search proposes depends on the time that it had; that it is certified does not.
  void OnEvent(const LogEvent& event) override {
    if (event.channel != advice_) return;
    const auto advice = Decoded<advice_t>(event.message());
    if (!advice || advice->changed == 0 || !result_.Next(shard_)) return;
    if (GroundsOf(*advice) != gate().grounds()) {
      ++result_.counts.circumstances;
      return;
    }
    const Upheld upheld = UpheldUnder(gate().certifier().problem(), gate().options());
    const Decision verdict = gate().JudgeAgain(advice->proposal, upheld, 0).verdict;
    if (verdict.outcome == Outcome::kCertified)
      ++result_.counts.proposals;
    else
      Differ(fmt::format("event {}", event.number), advice->plan_id,
             fmt::format("what is proposed in its place is not certified: {}, step {}",
                         CauseName(static_cast<std::int16_t>(verdict.cause)), verdict.step));
  }

  void OnDecision(const RecordedDecision& recorded) override {
    if (!result_.Next(shard_)) return Pass(recorded);
    const decision_t& decision = recorded.decision;
    if (!recorded.candidate)
      return Differ(recorded.event, decision.plan_id, "decided, but its candidate is not in the log");
    const auto& [bytes, event, place] = *recorded.candidate;
    if (!recorded.is_of_known_task)
      return Differ(event, decision.plan_id,
                    fmt::format("decided under another task, of config digest {}, which is not kept next to the log",
                                ToHex(GetDigest(decision.config_digest))));
    if (IsCircumstance(decision)) {
      static_cast<void>(gate().Refuse(bytes, decision.utime, decision.cause, ""));
      ++result_.counts.circumstances;
      Show(recorded.event, "recorded", decision, ", which depends on the moment");
      return;
    }
    const decision_t again = DecideAgain(bytes, decision);
    std::string difference = Difference(decision, again);
    if (!difference.empty() && recorded.basis.grounds.observations != GroundsOf(decision).observations)
      difference += not_learned_.empty()
                        ? "; transitions that had been learned are not in the log, which begins later or lacks messages"
                        : fmt::format(
                              "; it rests on transitions that this release does not learn, or the log lacks some: {}; "
                              "the release that recorded the log can replay it",
                              not_learned_);
    Show(recorded.event, "recorded", decision);
    Show(recorded.event, "replayed", again);
    if (difference.empty())
      ++result_.counts.agreed;
    else
      Differ(event, decision.plan_id, difference);
  }

  void OnCertified(const RecordedPlan& recorded) override {
    const certified_plan_t& certified = recorded.certified;
    const Upheld upheld = UpheldBy(certified);
    if (result_.Next(shard_)) CheckSeal(recorded, upheld);
    if (plans_.size() == kPlans) plans_.pop_front();
    plans_.push_back({GetDigest(certified.certificate_digest), upheld, certified.plan});
  }

  void OnWithdrawn(const RecordedWithdrawal& recorded) override {
    if (!result_.Next(shard_)) return;
    const withdrawal_t& withdrawal = recorded.withdrawal;
    const auto& cause = withdrawal.cause;
    if (cause == withdrawal_t::NOT_JUDGED || cause == withdrawal_t::UNKNOWN_PLAN ||
        cause == withdrawal_t::OBSTACLES_LOST) {
      ++result_.counts.circumstances;
      return;
    }
    const std::string difference = JudgeAgain(recorded);
    if (difference.empty())
      ++result_.counts.withdrawals;
    else
      Differ(recorded.event, withdrawal.plan_id, difference);
  }

  void OnUndecided(const RecordedCandidate& candidate) override {
    if (result_.Next(shard_)) Differ(candidate.event, -1, "no decision recorded");
  }

  CaseResults<ReplayResult> Finish(const Timeline& timeline) {
    result_.of_run.candidates = timeline.candidates();
    result_.of_run.corruptions = timeline.damage().places;
    result_.of_run.passed_over = timeline.passed_over();
    return std::move(result_);
  }

 private:
  static constexpr std::size_t kPlans = 4096;  // more than a robot can have at one time

  // Another shard judges it. The gate knows that it was used, as if it was judged here.
  void Pass(const RecordedDecision& recorded) {
    if (recorded.candidate && recorded.is_of_known_task)
      static_cast<void>(gate().Refuse(recorded.candidate->bytes, recorded.decision.utime, decision_t::CAUSE_FAULT, ""));
  }

  // How much time there was for pieces is not in the log. An abstention says that it was not enough.
  [[nodiscard]] decision_t DecideAgain(Bytes bytes, const decision_t& recorded) {
    if (recorded.outcome != decision_t::ABSTAIN_SAFETY || gate().options().max_pieces == 1)
      return gate().Decide(bytes, recorded.utime).decision;
    std::int64_t now = recorded.utime;
    const std::int64_t late = recorded.utime + Microseconds(gate().options().decision_budget_ms) / 2 + 1;
    return gate().Decide(bytes, [&] { return std::exchange(now, late); }).decision;
  }

  void CheckSeal(const RecordedPlan& recorded, const Upheld& upheld) {
    const certified_plan_t& certified = recorded.certified;
    for (const SealFault& fault : FindSealFaults(certified))
      Differ(
          recorded.event, certified.plan.plan_id,
          fmt::format("the seal does not hold: {} is {}, it has to be {}", fault.field, fault.found, fault.expected));
    const Config& task = *recorded.basis.task;
    for (const UpheldDifference& difference : FindDifferences(UpheldUnder(*task.problem, task.gate), upheld))
      Differ(recorded.event, certified.plan.plan_id,
             fmt::format("{} is {}, it is {} in the task", difference.field, difference.found, difference.expected));
  }

  // Empty if the plan's judgement is made again.
  [[nodiscard]] std::string JudgeAgain(const RecordedWithdrawal& recorded) {
    const withdrawal_t& withdrawal = recorded.withdrawal;
    if (!recorded.is_of_known_task) return "withdrawn under another task, which is not kept next to the log";
    const Grounds named = GroundsOf(withdrawal);
    for (const auto& [name, digest] : kGrounds)
      if (named.*digest != recorded.basis.grounds.*digest) return fmt::format("withdrawn under other {}", name);
    const auto plan = std::ranges::find(plans_, GetDigest(withdrawal.certificate_digest), &Plan::certificate);
    if (plan == plans_.end()) return "withdrawn, but its certified plan is not in the log";
    const Standing standing = gate().JudgeAgain(plan->plan, plan->upheld, withdrawal.first_step);
    const Decision& verdict = standing.verdict;
    if (standing.steps == withdrawal.valid_steps && static_cast<int>(verdict.cause) == withdrawal.cause &&
        verdict.step == withdrawal.step && verdict.obstacle == withdrawal.obstacle)
      return {};
    return fmt::format("withdrawn with {} steps that stand, cause {}; replayed {} steps, cause {}",
                       withdrawal.valid_steps, WithdrawalName(withdrawal.cause), standing.steps,
                       WithdrawalName(static_cast<std::int16_t>(verdict.cause)));
  }

  void Differ(const std::string& event, std::int64_t plan_id, const std::string& what) {
    result_.Tell().differences.push_back(fmt::format("{}, plan {}: {}", event, plan_id, what));
  }

  void Show(const std::string& event, const std::string& how, const decision_t& decision,
            const std::string& remark = "") {
    if (plan_digest_.empty() || !ToHex(GetDigest(decision.plan_digest)).starts_with(plan_digest_)) return;
    result_.Tell().shown.push_back(fmt::format("{}, plan {}: {} {}{}: {}", event, decision.plan_id, how,
                                               DescribeDecision(decision), remark, GetText(decision.message)));
  }

  struct Plan {
    Digest certificate;
    Upheld upheld;
    candidate_plan_t plan;
  };

  const std::string plan_digest_;
  const Shard shard_;
  std::string advice_;       // the channel
  std::string not_learned_;  // the first transition that was refused since the last start or reload, and why
  std::deque<Plan> plans_;   // the last ones
  CaseResults<ReplayResult> result_;
};

WhyNot WhyNotOf(const decision_t& decision) {
  return {decision.outcome, decision.cause, decision.obstacle, decision.step};
}

template <class Key>
std::int64_t Sum(const std::map<Key, std::int64_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), std::int64_t{0},
                         [](std::int64_t sum, const auto& entry) { return sum + entry.second; });
}

class Comparer final : public GateFollower {
 public:
  explicit Comparer(const Shard& shard) : shard_(shard) {}

  void OnDecision(const RecordedDecision& recorded) override {
    const bool is_mine = cases_.Next(shard_);
    Comparison& counts = cases_.counts;
    const decision_t& before = recorded.decision;
    if (!recorded.candidate) {
      counts.without_candidate += is_mine;
      return;
    }
    const std::vector<std::uint8_t>& bytes = recorded.candidate->bytes;
    if (!is_mine || IsCircumstance(before)) {  // the gate knows that it was used
      static_cast<void>(gate().Refuse(bytes, before.utime, is_mine ? before.cause : decision_t::CAUSE_FAULT, ""));
      counts.circumstances += is_mine;
      return;
    }
    const decision_t after = gate().Decide(bytes, before.utime).decision;
    const bool was = before.outcome == decision_t::CERTIFIED, is = after.outcome == decision_t::CERTIFIED;
    ++counts.candidates;
    counts.certificates += was;
    if (!was && is) Gain(recorded);
    if (was && !is) Lose(recorded, after);
    if (!was && !is) Refuse(before, after);
  }

  void OnUndecided(const RecordedCandidate&) override { cases_.counts.undecided += cases_.Next(shard_); }

  CaseResults<Comparison> Finish(const Timeline& timeline) {
    cases_.of_run.corruptions = timeline.damage().places;
    cases_.of_run.passed_over = timeline.passed_over();
    return std::move(cases_);
  }

 private:
  static std::string NameOfPlan(const RecordedDecision& recorded) {
    return fmt::format("{}, plan {} of {}", recorded.event, recorded.decision.plan_id,
                       GetText(recorded.decision.source));
  }
  void Gain(const RecordedDecision& recorded) {
    ++cases_.counts.gained[WhyNotOf(recorded.decision)];
    cases_.Tell().gained_plans.push_back(NameOfPlan(recorded));
  }
  void Lose(const RecordedDecision& recorded, const decision_t& after) {
    ++cases_.counts.lost[WhyNotOf(after)];
    cases_.Tell().lost_plans.push_back(fmt::format("{}: {}", NameOfPlan(recorded), GetText(after.message)));
  }
  void Refuse(const decision_t& before, const decision_t& after) {
    WhyNot then = WhyNotOf(before), now = WhyNotOf(after);
    then.step = now.step = -1;
    if (then == now)
      ++cases_.counts.refused_alike;
    else
      ++cases_.counts.otherwise[{then, now}];
  }

  const Shard shard_;
  CaseResults<Comparison> cases_;
};

// What it finds in the logs under this task or these.
auto Follow(auto& follower, auto& tasks, const std::vector<std::string>& logs, bool names_files) {
  Timeline timeline(tasks, {&follower});
  timeline.Read(logs, names_files);
  timeline.End();
  return follower.Finish(timeline);
}

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

CaseResults<ReplayResult> Replay(const std::vector<std::string>& logs, LogTasks& tasks, const std::string& plan_digest,
                                 bool names_files, const Shard& shard) {
  Replayer replayer(plan_digest, shard);
  return Follow(replayer, tasks, logs, names_files);
}

CaseResults<ReplayResult> Replay(const std::vector<std::string>& logs, const Config& task,
                                 const std::string& plan_digest, bool names_files, const Shard& shard) {
  Replayer replayer(plan_digest, shard);
  return Follow(replayer, task, logs, names_files);
}

std::int64_t Comparison::num_gained() const { return Sum(gained); }
std::int64_t Comparison::num_lost() const { return Sum(lost); }

CaseResults<Comparison> Compare(const std::vector<std::string>& logs, const Config& task, bool names_files,
                                const Shard& shard) {
  Comparer comparer(shard);
  return Follow(comparer, task, logs, names_files);
}

}  // namespace forereach
