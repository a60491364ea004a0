#include "certifier/gate/sources.h"

#include <cstdlib>

namespace forereach {
namespace {

StreamPosition PositionOf(const candidate_plan_t& candidate) { return {candidate.sequence, candidate.utime}; }

// Of plan_ids, which may be any numbers, unsigned. @pre above >= below.
std::uint64_t Apart(std::int64_t above, std::int64_t below) {
  return static_cast<std::uint64_t>(above) - static_cast<std::uint64_t>(below);
}

}  // namespace

std::string Sources::NameOf(const candidate_plan_t& candidate) {
  return {reinterpret_cast<const char*>(candidate.source), sizeof candidate.source};
}

std::int64_t Sources::Horizon(std::int64_t now_us) const { return StreamOrder::Horizon(now_us, forget_after_us_); }

void Sources::Source::ForgetAllBut(std::int64_t plan_id) {
  highest = plan_id;
  used.reset();
  used.set(0);
}

bool Sources::Source::Uses(std::int64_t plan_id) const {
  // Below the window nothing is remembered, so it counts as used: a guard must not get one number for two plans.
  const std::uint64_t below = Apart(highest, plan_id);
  return plan_id <= highest && (below >= kWindow || used.test(below));
}

bool Sources::Source::Use(std::int64_t plan_id) {
  if (Uses(plan_id)) return false;
  if (plan_id > highest) {
    const std::uint64_t shift = Apart(plan_id, highest);
    used = shift < kWindow ? used << shift : std::bitset<kWindow>();
    highest = plan_id;
  }
  used.set(Apart(highest, plan_id));
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
    // Names are free: a flood of them must neither grow the memory nor push out a planner that is heard.
    if (sources_.size() >= kMaxSources && !MakeRoom(now_us)) return Admission::kTooManySources;
    known = sources_.emplace(name, Source{}).first;
    known->second.StartCounting(PositionOf(candidate), Horizon(now_us));
    known->second.ForgetAllBut(candidate.plan_id);
  } else if (IsSilent(known->second, now_us)) {
    known->second.ForgetAllBut(candidate.plan_id);
  } else if (!known->second.Use(candidate.plan_id)) {
    return Admission::kUsed;
  }
  known->second.heard_us = now_us;
  return Admission::kNew;
}

bool Sources::IsUsed(const candidate_plan_t& candidate, std::int64_t now_us) const {
  const auto known = sources_.find(NameOf(candidate));
  return known != sources_.end() && !IsSilent(known->second, now_us) && known->second.Uses(candidate.plan_id);
}

bool Sources::IsSilent(const Source& source, std::int64_t now_us) const {
  // Either way: a clock that was set back must not keep a source forever.
  return std::abs(now_us - source.heard_us) > forget_after_us_;
}

bool Sources::MakeRoom(std::int64_t now_us) {
  const auto silent = std::ranges::find_if(sources_, [&](const auto& entry) { return IsSilent(entry.second, now_us); });
  if (silent == sources_.end()) return false;
  lost_before_ += silent->second.lost();
  sources_.erase(silent);
  return true;
}

void Sources::Source::StartCounting(const StreamPosition& position, std::int64_t horizon_us) {
  order = {};
  order.Take({std::max<std::int64_t>(position.sequence, 0), position.utime}, horizon_us);
  first_sequence = last_sequence();
  came = 1;
}

void Sources::Hear(const candidate_plan_t& candidate, std::int64_t now_us) {
  constexpr std::int64_t kLeap = std::int64_t{1} << 32, kBehind = 1 << 16;
  const auto known = sources_.find(NameOf(candidate));
  if (known == sources_.end() || candidate.sequence < 0) return;
  Source& source = known->second;
  const StreamPosition position = PositionOf(candidate);
  const Succession succession = source.order.Compare(position, Horizon(now_us));
  // A leap that no loss explains is a restart or nonsense; counted as loss it would spoil the count for good.
  if (succession == Succession::kRestarted || position.sequence < source.first_sequence - kBehind ||
      position.sequence - source.last_sequence() > kLeap) {
    lost_before_ += source.lost();
    source.StartCounting(position, Horizon(now_us));
    return;
  }
  if (succession == Succession::kNewer) source.order.Take(position, Horizon(now_us));
  source.first_sequence = std::min(source.first_sequence, position.sequence);
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
