#include "certifier/gate/sources.h"

#include <algorithm>
#include <cstdlib>

namespace forereach {

std::string Sources::NameOf(const candidate_plan_t& candidate) {
  return {reinterpret_cast<const char*>(candidate.source), sizeof candidate.source};
}

void Sources::Source::ForgetAllBut(std::int64_t plan_id) {
  highest = plan_id;
  used.reset();
  used.set(0);
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

void Sources::Inherit(const Sources& before) {
  sources_ = before.sources_;
  lost_before_ = before.lost_before_;
}

Sources::Admission Sources::Admit(const candidate_plan_t& candidate, std::int64_t now_us) {
  const std::string name = NameOf(candidate);
  auto known = sources_.find(name);
  if (known == sources_.end()) {
    if (sources_.size() >= kMaxSources && !MakeRoom(now_us)) return Admission::kTooManySources;
    known = sources_.emplace(name, Source{}).first;
    known->second.StartCounting(candidate.sequence, candidate.utime);
    known->second.ForgetAllBut(candidate.plan_id);
  } else if (IsSilent(known->second, now_us)) {
    known->second.ForgetAllBut(candidate.plan_id);
  } else if (!known->second.Use(candidate.plan_id)) {
    return Admission::kUsed;
  }
  known->second.heard_us = now_us;
  return Admission::kNew;
}

bool Sources::IsSilent(const Source& source, std::int64_t now_us) const {
  return std::abs(now_us - source.heard_us) > forget_after_us_;
}

bool Sources::MakeRoom(std::int64_t now_us) {
  const auto silent = std::ranges::find_if(sources_, [&](const auto& entry) { return IsSilent(entry.second, now_us); });
  if (silent == sources_.end()) return false;
  lost_before_ += silent->second.lost();
  sources_.erase(silent);
  return true;
}

void Sources::Source::StartCounting(std::int64_t sequence, std::int64_t utime) {
  first_sequence = last_sequence = std::max<std::int64_t>(sequence, 0);
  came = 1;
  newest_utime = utime;
}

void Sources::Hear(const candidate_plan_t& candidate, std::int64_t now_us) {
  constexpr std::int64_t kLeap = std::int64_t{1} << 32, kBehind = 1 << 16;
  const auto known = sources_.find(NameOf(candidate));
  if (known == sources_.end() || candidate.sequence < 0) return;
  Source& source = known->second;
  const std::int64_t utime = std::min(candidate.utime, now_us + forget_after_us_);  // else the newest for ever
  const bool later = utime > source.newest_utime;
  if ((later && candidate.sequence < source.last_sequence) || candidate.sequence < source.first_sequence - kBehind ||
      candidate.sequence - source.last_sequence > kLeap) {
    lost_before_ += source.lost();
    source.StartCounting(candidate.sequence, utime);
    return;
  }
  source.newest_utime = std::max(source.newest_utime, utime);
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
