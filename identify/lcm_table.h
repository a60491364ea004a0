/** LCM event logs of others as tables: one row for each message of a channel. */
#pragma once

#include "identify/lcm_types.h"
#include "identify/log_table.h"

namespace forereach {

/** Fields of the messages of one channel. @param wanted as of a ChannelTable. A message of another type or length than
its channel's first one is lost, as is what damage takes of the log.
@throws ConfigError if columns are of two channels or the log has no message of it, if no type has its fingerprint or
the type no such number; LogError if the log cannot be read. */
[[nodiscard]] LogTable ReadLcmLog(const std::string& path, const std::vector<std::string>& wanted,
                                  const LcmTypes& types);

}  // namespace forereach
