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
  /** @param keys public ones are enough; nothing: every message is taken for authentic. Messages count that were signed
  for the bus `channels.name`, or without a name for the bus of the first authentic one. */
  LogAuthenticator(const BusOptions& channels, std::optional<KeyRing> keys)
      : channels_(channels), speakers_(channels.speakers()), keys_(std::move(keys)) {}

  /** Of the next event in the order of the log. On a signed channel neither unsigned and forged messages are authentic,
  nor those that came before or were signed more than a second before the first that was heard here. */
  [[nodiscard]] bool IsAuthentic(const LogEvent& event);

  /** Messages that were not. */
  [[nodiscard]] Refusals refusals() const { return authenticator_ ? authenticator_->refusals() : Refusals{}; }

 private:
  BusOptions channels_;
  Speakers speakers_;
  std::optional<KeyRing> keys_;
  std::optional<Authenticator> authenticator_;  // from the first message on a signed channel on
};

/** "3 (unsigned 1, forged 1, replayed 1)"; empty if there are none. */
[[nodiscard]] std::string DescribeRefusals(const Refusals& refusals);

}  // namespace forereach
