/** What a task file says of the logger. */
#pragma once

#include <optional>
#include <string>

namespace forereach {

struct LoggerOptions {
  std::string directory = "log";
  int queue = 4096;                ///< Messages held for writing at most.
  double flush_ms = 200;           ///< A killed logger loses at most this much.
  double rotate_mb = 1024;         ///< Largest size of one log file, 10^6 bytes each.
  double rotate_minutes = 60;      ///< Longest time in one log file.
  std::optional<double> quota_mb;  ///< Largest size of all log files together; nothing: none is ever deleted.
  double min_free_mb = 256;        ///< With less free on the disk recording pauses.
  double unsigned_kb_per_s = 100;  ///< With keys: unsigned messages recorded at most, 10^3 bytes each.
};

}  // namespace forereach
