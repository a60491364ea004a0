#include "records/log_authenticator.h"

#include <algorithm>

#include <fmt/core.h>

namespace forereach {
namespace {

constexpr std::int64_t kUnderWayUs = 1'000'000;  // a message may have been, and clocks differ

}  // namespace

bool LogAuthenticator::IsAuthentic(const LogEvent& event) {
  if (!keys_ || !speakers_.contains(event.channel)) return true;
  if (!authenticator_)
    authenticator_.emplace(*keys_, channels_.name.empty() ? std::nullopt : std::optional(channels_.name), speakers_,
                           std::max<std::int64_t>(event.utime, 0) - kUnderWayUs);
  return authenticator_->Check(event.channel, event.data).first == Authenticity::kAuthentic;
}

std::string DescribeRefusals(const Refusals& refusals) {
  if (refusals.all() == 0) return "";
  return fmt::format("{} (unsigned {}, forged {}, replayed {}{})", refusals.all(), refusals.unsigned_ones,
                     refusals.forged, refusals.replayed,
                     refusals.foreign > 0 ? fmt::format(", of another bus {}", refusals.foreign) : "");
}

}  // namespace forereach
