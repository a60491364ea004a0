/** Selects the authentic messages of a log. The log holds every message as it was received. A reader with the key
accepts the messages that the robot's processes accepted, and skips the others. */
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "bus/authentic.h"
#include "bus/bus_options.h"
#include "records/event_log.h"

namespace forereach {

class LogAuthenticator final {
 public:
  /** @param keys public keys suffice. Without keys every message counts as authentic.
  Messages must be signed for the bus `channels.name`, or if that is empty for the bus of the first authentic one. */
  LogAuthenticator(const BusOptions& channels, std::optional<KeyRing> keys)
      : channels_(channels), speakers_(channels.speakers()), keys_(std::move(keys)) {}

  /** Whether the next event of the log is authentic. On a signed channel a message is not authentic if it is unsigned
  or forged, if its counter was used before, or if it was signed more than kClockErrorUs before the first message here
  or ahead of the logger's clock (bus/authentic.h). */
  [[nodiscard]] bool IsAuthentic(const LogEvent& event);

  /** The messages that were not authentic. */
  [[nodiscard]] Refusals refusals() const { return authenticator_ ? authenticator_->refusals() : Refusals{}; }

 private:
  BusOptions channels_;
  Speakers speakers_;
  std::optional<KeyRing> keys_;
  std::optional<Authenticator> authenticator_;  // from the first message on a signed channel on
};

}  // namespace forereach
