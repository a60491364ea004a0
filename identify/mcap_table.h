/** MCAP files as tables: one row for each message of a channel, which MCAP calls a topic. */
#pragma once

#include "identify/log_table.h"

namespace forereach {

/** Fields of the messages of one channel: in JSON, or of ROS 2 (CDR with a schema in ros2msg). @param wanted as of a
ChannelTable. A message of another type than its channel's first one, or with another length than its type says, is
lost, as is what damage takes of the file. A number that a JSON object lacks is NaN.
@throws ConfigError if the file is none, columns are of two channels, or there is no message of it; if its messages are
encoded otherwise, its type has no such number, or none of its objects has. */
[[nodiscard]] LogTable ReadMcapLog(const std::string& path, const std::vector<std::string>& wanted);

}  // namespace forereach
