/** The options of commands that read logs with a key. */
#pragma once

#include <vector>

#include "command_line/command_line.h"
#include "records/log_trust.h"

namespace forereach {

/** --key and --no-key. */
inline void AddKeyOptions(std::vector<Option>& options, LogKey& key) {
  options.push_back({"--key", &key.file, "PATH",
                     "Directory of keys, verify.pub or any key file: messages of a log that its roles did not "
                     "sign are passed over; by default the task file's bus.key"});
  options.push_back({.name = "--no-key",
                     .variable = &key.none,
                     .help = "Believe every message of a log, whoever sent it",
                     .excludes = "--key"});
}

}  // namespace forereach
