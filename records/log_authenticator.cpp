#include "records/log_authenticator.h"

namespace forereach {

bool LogAuthenticator::IsAuthentic(const LogEvent& event) {
  if (!keys_ || !speakers_.contains(event.channel)) return true;
  if (!authenticator_)
    authenticator_.emplace(*keys_, channels_.name.empty() ? std::nullopt : std::optional(channels_.name), speakers_,
                           std::nullopt);
  return authenticator_->Check(event.channel, event.data, event.utime).first == Authenticity::kAuthentic;
}

}  // namespace forereach
