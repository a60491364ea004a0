/** Which messages of a log count: those that are authentic by the key of a command, which counts the others. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "bus/authentic.h"
#include "bus/bus_options.h"
#include "records/event_log.h"
#include "task/config.h"

namespace forereach {

/** The key from the command line. By default it is the bus.key of the task file. */
struct LogKey {
  std::string file;
  bool none = false;  ///< Accept every message without a check.

  void Override(BusOptions& options) const;
  /** For a task that the logger may have kept without its keys. @param given the path of the given task.
  @throws ConfigError if another one has a bus.key and the command line has neither a key nor `none`. */
  void Override(Config& task, const std::string& given) const;
};

/** The numbers of skipped messages. The robot's processes refused them too. */
struct PassedOver {
  Refusals not_authentic;        ///< Zero without a key (LogAuthenticator).
  std::int64_t undecodable = 0;  ///< Messages on the channel of certified plans that are not certified plans.

  PassedOver& operator+=(const PassedOver& more) {
    not_authentic += more.not_authentic;
    undecodable += more.undecodable;
    return *this;
  }
};

/** The numbers as the end of a sentence; empty if nothing was skipped. */
[[nodiscard]] std::string DescribePassedOver(const PassedOver& passed_over);
[[nodiscard]] nlohmann::json ToJson(const PassedOver& passed_over);
[[nodiscard]] nlohmann::json ToJson(const Refusals& refused);

/** Selects the authentic messages of a log. The log holds every message as it was received. A reader with the key
accepts the messages that the robot's processes accepted, and skips the others. */
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
