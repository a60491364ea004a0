#include "certifier/gate/sources.h"

#include <algorithm>

namespace forereach {

std::string Sources::NameOf(const candidate_plan_t& candidate) {
  return {reinterpret_cast<const char*>(candidate.source), sizeof candidate.source};
}

// Differences of plan_ids, which may be any numbers, are taken unsigned.
bool Sources::Source::Use(std::int64_t plan_id) {
  const auto apart = [](std::int64_t above, std::int64_t below) {
    return static_cast<std::uint64_t>(above) - static_cast<std::uint64_t>(below);
  };
  if (plan_id > highest) {
    const std::uint64_t shift = apart(plan_id, highest);
    used = shift < kWindow ? used << shift : std::bitset<kWindow>();
    used.set(0);
    highest = plan_id;
    return true;
  }
  const std::uint64_t below = apart(highest, plan_id);
  if (below >= kWindow || used.test(below)) return false;
  used.set(below);
  return true;
}

Sources::Admission Sources::Admit(const candidate_plan_t& candidate, std::int64_t now_us) {
  const std::string name = NameOf(candidate);
  auto known = sources_.find(name);
  if (known != sources_.end() && now_us - known->second.heard_us > forget_after_us_) {
    lost_before_ += known->second.lost();
    sources_.erase(known);
    known = sources_.end();
  }
  if (known == sources_.end()) {
    if (sources_.size() >= kMaxSources && !MakeRoom(now_us)) return Admission::kTooManySources;
    known = sources_.emplace(name, Source{}).first;
    known->second.highest = candidate.plan_id;
    known->second.used.set(0);
    known->second.StartCounting(std::max<std::int64_t>(candidate.sequence, 0));
  } else if (!known->second.Use(candidate.plan_id)) {
    return Admission::kUsed;
  }
  known->second.heard_us = now_us;
  return Admission::kNew;
}

bool Sources::MakeRoom(std::int64_t now_us) {
  const auto silent = std::ranges::find_if(
      sources_, [&](const auto& entry) { return now_us - entry.second.heard_us > forget_after_us_; });
  if (silent == sources_.end()) return false;
  lost_before_ += silent->second.lost();
  sources_.erase(silent);
  return true;
}

void Sources::Source::StartCounting(std::int64_t sequence) {
  first_sequence = last_sequence = sequence;
  came = 1;
}

// Candidates are not taken up in their order. A source that starts again counts from 0, or is far away.
void Sources::Hear(const candidate_plan_t& candidate) {
  constexpr std::int64_t kLeap = std::int64_t{1} << 32, kBehind = 1 << 16;
  const auto known = sources_.find(NameOf(candidate));
  if (known == sources_.end() || candidate.sequence < 0) return;
  Source& source = known->second;
  if (candidate.sequence == 0 || candidate.sequence < source.first_sequence - kBehind ||
      candidate.sequence - source.last_sequence > kLeap) {
    lost_before_ += source.lost();
    source.StartCounting(candidate.sequence);
    return;
  }
  source.first_sequence = std::min(source.first_sequence, candidate.sequence);
  source.last_sequence = std::max(source.last_sequence, candidate.sequence);
  ++source.came;
}

std::int64_t Sources::lost() const {
  std::int64_t lost = lost_before_;
  for (const auto& [name, source] : sources_) lost += source.lost();
  return lost;
}

std::int64_t Sources::HighestPlanId(const candidate_plan_t& candidate) const {
  const auto known = sources_.find(NameOf(candidate));
  return known == sources_.end() ? 0 : known->second.highest;
}

}  // namespace forereach
