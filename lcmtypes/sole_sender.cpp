#include "lcmtypes/sole_sender.h"

#include <array>
#include <cstdio>

#include "lcmtypes/freshness.h"

namespace forereach {

std::string SenderText(std::uint64_t sender_id) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(sender_id));
  return text.data();
}

// Something heard in the future is heard: the clock was set back since.
bool SoleSender::IsHeard(const Heard& sender, std::int64_t now_us) const {
  return FreshnessOf(sender.last_us, now_us, timeout_us_, INT64_MAX) != Freshness::kStale;
}

void SoleSender::SetBack(std::int64_t now_us) {
  for (Heard& sender : heard_) {
    sender.since_us = std::min(sender.since_us, now_us);
    if (sender.last_us > now_us) sender.since_us = sender.last_us = now_us;
  }
}

SoleSender::Place SoleSender::Hear(SenderId sender, std::int64_t now_us) {
  if (!sender) return Place::kGoesOn;
  SetBack(now_us);
  const SenderId before = counts();
  const bool is_silent = heard_.empty() || !IsHeard(heard_.front(), now_us);
  if (const auto known = std::ranges::find(heard_, *sender, &Heard::id); known == heard_.end()) {
    if (heard_.size() == kMost)
      heard_.erase(std::ranges::min_element(heard_.begin() + 1, heard_.end(), {}, &Heard::last_us));
    heard_.push_back({*sender, now_us, now_us});
  } else {
    if (!IsHeard(*known, now_us)) known->since_us = now_us;
    known->last_us = now_us;
  }
  if (before == sender) return Place::kGoesOn;
  if (!is_silent) return Place::kOther;
  std::erase_if(heard_, [&](const Heard& each) { return each.id == before; });
  std::ranges::iter_swap(heard_.begin(), std::ranges::find(heard_, *sender, &Heard::id));
  return Place::kTakesOver;
}

std::string SoleSender::WhyTwo(std::int64_t now_us) const {
  const auto is_heard = [&](const Heard& sender) { return IsHeard(sender, now_us); };
  const auto one = std::ranges::find_if(heard_, is_heard);
  if (one == heard_.end()) return {};
  const auto other = std::find_if(one + 1, heard_.end(), is_heard);
  if (other == heard_.end()) return {};
  return "two senders are heard, " + SenderText(one->id) + " and " + SenderText(other->id) + ": one of them has to end";
}

std::string SoleSender::WhyNotAlone(std::int64_t now_us) const {
  if (std::string why = WhyTwo(now_us); !why.empty() || heard_.empty()) return why;
  const Heard& sender = heard_.front();
  if (FreshnessOf(sender.since_us, now_us, timeout_us_, INT64_MAX) == Freshness::kStale) return {};
  return "sender " + SenderText(sender.id) + " has been heard for " + Milliseconds(now_us, sender.since_us) +
         "; it counts after " + Milliseconds(timeout_us_, 0) + " alone";
}

}  // namespace forereach
