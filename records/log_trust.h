/** Which messages of a log a command believes: the key to judge them by, and those that it passed over. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "bus/authentic.h"
#include "certifier/task/config.h"

namespace forereach {

/** The command line's say in the key: by default that of the task file's bus.key. */
struct LogKey {
  std::string file;
  bool none = false;  ///< Everything is believed, whoever sent it.

  void Override(BusOptions& options) const;
  /** Of a task that the logger kept, beside which there is no key. @throws ConfigError if it has one and the command
  line does not say which. */
  void Override(std::vector<Config>& tasks, const std::string& given) const;
};

/** Numbers of skipped messages, which the robot's processes refused too. */
struct PassedOver {
  Refusals not_authentic;        ///< Where there is a key (records/log_authenticator.h).
  std::int64_t undecodable = 0;  ///< On the channel of certified plans, and none.
};

/** As the end of a sentence, empty if nothing was. */
[[nodiscard]] std::string DescribePassedOver(const PassedOver& passed_over);
[[nodiscard]] nlohmann::json ToJson(const PassedOver& passed_over);

}  // namespace forereach
