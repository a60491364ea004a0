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
  void OnDecision(const RecordedDecision& recorded) override {
    const decision_t& before = recorded.decision;
    if (!recorded.candidate) {
      ++result_.without_candidate;
      return;
    }
    const std::vector<std::uint8_t>& bytes = recorded.candidate->bytes;
    if (IsCircumstance(before)) {
      static_cast<void>(gate().Refuse(bytes, before.utime, before.cause, ""));
      ++result_.circumstances;
      return;
    }
    const decision_t after = gate().Decide(bytes, before.utime).decision;
    const bool was = before.outcome == decision_t::CERTIFIED, is = after.outcome == decision_t::CERTIFIED;
    ++result_.candidates;
    result_.certificates += was;
    if (!was && is) ++result_.gained[WhyNotOf(before)];
    if (was && !is) Lose(recorded, after);
    if (!was && !is) Refuse(before, after);
  }

  Comparison Finish(const Timeline& timeline) {
    timeline.undecided().ForEach([this](const RecordedCandidate&) { ++result_.undecided; });
    result_.corruptions = timeline.damage().places;
    result_.passed_over = timeline.passed_over();
    return std::move(result_);
  }

 private:
  void Lose(const RecordedDecision& recorded, const decision_t& after) {
    ++result_.lost[WhyNotOf(after)];
    if (result_.lost_plans.size() < Comparison::kLostPlans)
      result_.lost_plans.push_back(fmt::format("{}, plan {} of {}: {}", recorded.event, after.plan_id,
                                               GetText(after.source), GetText(after.message)));
  }
  void Refuse(const decision_t& before, const decision_t& after) {
    WhyNot then = WhyNotOf(before), now = WhyNotOf(after);
    then.step = now.step = -1;
    if (then == now)
      ++result_.refused_alike;
    else
      ++result_.otherwise[{then, now}];
  }

  Comparison result_;
};

}  // namespace

std::int64_t Comparison::num_gained() const { return Sum(gained); }
std::int64_t Comparison::num_lost() const { return Sum(lost); }

Comparison Compare(const std::vector<std::string>& logs, const Config& task, bool names_files) {
  Comparer comparer;
  Timeline timeline(task, {&comparer});
  timeline.Read(logs, names_files);
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
