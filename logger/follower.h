/** Sends the logger's rows to the fleet's store, in a process of its own: no network can delay the logger. */
#pragma once

#include <string>

namespace forereach {

/** Starts `forereach ingest DIRECTORY --follow` (forereach-fleet). When the calling thread ends, however, it sends what
was written and ends, too.
@param robot whose rows they are if the logger has no keys; may be empty.
@throws ConfigError if forereach-fleet is not installed. */
void StartFollower(const std::string& directory, const std::string& database, const std::string& robot);

}  // namespace forereach
