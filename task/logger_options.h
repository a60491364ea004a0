/** The options of the logger, from `logger` in a task file. */
#pragma once

#include <optional>
#include <string>

namespace forereach {

struct LoggerOptions {
  std::string directory = "log";
  int queue = 4096;                ///< The largest number of messages that wait to be written.
  double flush_ms = 200;           ///< A killed logger loses at most the messages of this time.
  double rotate_mb = 1024;         ///< The largest size of one log file, in 10^6 bytes.
  double rotate_minutes = 60;      ///< The longest time span of one log file.
  std::optional<double> quota_mb;  ///< The largest size of all log files. Without a value no file is ever deleted.
  double min_free_mb = 256;        ///< Recording pauses if the disk has less free space, in 10^6 bytes.
  double unsigned_kb_per_s = 100;  ///< With keys: the largest rate of recorded unsigned messages, in 10^3 bytes per s.
};

}  // namespace forereach
