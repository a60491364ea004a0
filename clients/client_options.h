/** Where a client finds its task, and what the command line has in place of it. */
#pragma once

#include <string>

namespace forereach {

struct ClientOptions {
  std::string task;      ///< The path of the task file.
  std::string key = "";  ///< The key file of the role, or a directory with it; empty: the task's bus.key.
  std::string url = "";  ///< Of the bus; empty: the task's bus.url.
};

}  // namespace forereach
