/** Writes recorded runs for other programs: tables, arrays of tubes, and MCAP files. docs/export.md describes the
formats.

Memory does not grow with the logs. Nothing in a log names a file that is written. */
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "records/event_log.h"
#include "records/log_trust.h"

namespace forereach {

struct ExportOptions {
  /** Event logs of one run in their order; or one decision database, or the directory of one, with all its runs. */
  std::vector<std::string> inputs;
  std::string config;  ///< The task file; empty: the one that the logger kept next to the logs, or none.
  LogKey key;
  std::string format;  ///< One of kExportFormats.
  std::string output;  ///< A new file; for "csv" a directory without files of these names.
};

inline const std::vector<std::string> kExportFormats{"csv", "jsonl", "npz", "mcap"};

struct ExportResult {
  std::int64_t decisions = 0, without_candidate = 0, executions = 0, withdrawals = 0, gaps = 0;
  std::int64_t tubes = 0;     ///< Of certified plans; npz.
  std::int64_t messages = 0;  ///< mcap.
  /** Certified plans whose counts are beyond their type's bounds; messages that are no messages of ForeReach's. */
  std::int64_t left_out = 0;
  LogDamage damage;
  PassedOver passed_over;
  std::vector<std::string> missing;  ///< Logs that the database names and that are not there, with the reason.
};

/** @param on_bytes is told of the bytes that have been read; may be empty.
@throws BadInput if an input cannot be read, or the output exists or cannot be written. Then no output is left behind,
except an empty directory. */
[[nodiscard]] ExportResult Export(const ExportOptions& options, std::function<void(std::int64_t)> on_bytes = {});

}  // namespace forereach
