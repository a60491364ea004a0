#include "records/compare.h"

#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "forereach/decision_t.hpp"
#include "lcmtypes/codec.h"
#include "records/gate_follower.h"
#include "records/replay.h"

namespace forereach {
namespace {

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
    if (!was && is) ++counts.gained[WhyNotOf(before)];
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
  void Lose(const RecordedDecision& recorded, const decision_t& after) {
    ++cases_.counts.lost[WhyNotOf(after)];
    if (cases_.told.size() < Comparison::kLostPlans)
      cases_.Tell().lost_plans.push_back(fmt::format("{}, plan {} of {}: {}", recorded.event, after.plan_id,
                                                     GetText(after.source), GetText(after.message)));
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

}  // namespace

std::int64_t Comparison::num_gained() const { return Sum(gained); }
std::int64_t Comparison::num_lost() const { return Sum(lost); }

CaseResults<Comparison> Compare(const std::vector<std::string>& logs, const Config& task, bool names_files,
                                const Shard& shard) {
  Comparer comparer(shard);
  Timeline timeline(task, {&comparer});
  timeline.Read(logs, names_files);
  timeline.End();
  return comparer.Finish(timeline);
}

Comparison& operator+=(Comparison& sum, const Comparison& other) {
  sum.candidates += other.candidates;
  sum.certificates += other.certificates;
  sum.circumstances += other.circumstances;
  sum.without_candidate += other.without_candidate;
  sum.undecided += other.undecided;
  for (const auto& [why, count] : other.gained) sum.gained[why] += count;
  for (const auto& [why, count] : other.lost) sum.lost[why] += count;
  for (const auto& [whys, count] : other.otherwise) sum.otherwise[whys] += count;
  sum.refused_alike += other.refused_alike;
  for (const std::string& plan : other.lost_plans)
    if (sum.lost_plans.size() < Comparison::kLostPlans) sum.lost_plans.push_back(plan);
  sum.corruptions += other.corruptions;
  sum.passed_over += other.passed_over;
  return sum;
}

}  // namespace forereach
