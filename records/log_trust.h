/** The key with which a command checks the messages of a log, and the number of messages that it skipped. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "bus/authentic.h"
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
  Refusals not_authentic;        ///< Zero without a key (records/log_authenticator.h).
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

}  // namespace forereach
