#include "logger/log_authenticator.h"

#include <algorithm>

#include <fmt/format.h>

namespace forereach {
namespace {

constexpr std::int64_t kUnderWayUs = 1'000'000;  // a message may have been, and clocks differ

}  // namespace

bool LogAuthenticator::IsAuthentic(const LogEvent& event) {
  if (!key_ || !signed_channels_.contains(event.channel)) return true;
  if (!authenticator_) authenticator_.emplace(*key_, std::max<std::int64_t>(event.utime, 0) - kUnderWayUs);
  return authenticator_->Check(event.channel, event.data).first == Authenticity::kAuthentic;
}

std::string InWords(const Refusals& refusals) {
  const auto& [unsigned_ones, forged, replayed] = refusals;
  const std::int64_t all = unsigned_ones + forged + replayed;
  if (all == 0) return "";
  return fmt::format("{} (unsigned {}, forged {}, replayed {})", all, unsigned_ones, forged, replayed);
}

}  // namespace forereach
