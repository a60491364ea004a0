/** Writes recorded runs for other programs: tables, arrays of tubes, and MCAP files. docs/export.md describes the
formats.

Memory does not grow with the logs. Nothing in a log names a file that is written. */
#pragma once

#include <cstdint>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "records/event_log.h"
#include "records/log_trust.h"
#include "records/result.h"
#include "records/run_logs.h"
#include "records/shard.h"

namespace forereach {

enum class ExportFormat { kCsv, kJsonLines, kNpz, kMcap };

/** Their names, in the order of ExportFormat. */
inline const std::vector<std::string> kExportFormats{"csv", "jsonl", "npz", "mcap"};

/** The names of the files that a run's export consists of. */
[[nodiscard]] const std::vector<std::string>& ExportFiles(ExportFormat format);

struct ExportOptions {
  ExportFormat format = ExportFormat::kCsv;
  std::string config;  ///< The task file; empty: the one that the logger kept next to the logs, or none.
  LogKey key;
  bool names_robot = false;  ///< The channels of an MCAP file are "ROBOT/CHANNEL". Rows have it in any case.
};

struct ExportResult {
  std::int64_t decisions = 0, without_candidate = 0, executions = 0, withdrawals = 0, gaps = 0;
  std::int64_t tubes = 0;     ///< Of certified plans; npz.
  std::int64_t messages = 0;  ///< mcap.
  /** Certified plans whose counts are beyond their type's bounds; messages that are no messages of ForeReach's. */
  std::int64_t left_out = 0;
  LogDamage damage;
  PassedOver passed_over;
  bool has_messages = false;       ///< Whether a message or a row of ForeReach's was there.
  std::vector<std::string> files;  ///< That were written, in the order of ExportFiles.
};
// What several runs have in common: not the files.
FOREREACH_RESULT(ExportResult, decisions, without_candidate, executions, withdrawals, gaps, tubes, messages, left_out,
                 damage, passed_over, has_messages)

/** Writes the files of one run. Of a log that is gone its database has the rows.
@param files where to, in the order of ExportFiles; existing ones are replaced.
@param on_bytes is told of the bytes that have been read; may be empty.
@throws BadInput if a log cannot be read or a file cannot be written. */
[[nodiscard]] ExportResult ExportRun(const RunLogs& run, const ExportOptions& options,
                                     const std::vector<std::string>& files,
                                     const std::function<void(std::int64_t)>& on_bytes = {});

/** The same of a shard of the run's cases (its messages for mcap, otherwise its records): writes to one file what was
made of each, as CBOR: [number of the run, of the case, what...]. The result has no files. */
[[nodiscard]] CaseResults<ExportResult> ExportShard(const RunLogs& run, std::int64_t number,
                                                    const ExportOptions& options, const Shard& shard,
                                                    const std::string& file,
                                                    const std::function<void(std::int64_t)>& on_bytes = {});

/** Reads the file of a shard behind its first line: what ExportShard has made of each run, and "}". */
class ShardPieces final {
 public:
  explicit ShardPieces(const std::string& path);
  /** The next piece if it is of this case; otherwise null. @throws BadInput if it is no piece. */
  [[nodiscard]] nlohmann::json Take(std::int64_t run, std::int64_t number);
  /** The number of the case of the next piece; the largest number if that is of another run, or there is none.
  @throws BadInput if it is no piece, or its case is before `first`. */
  [[nodiscard]] std::int64_t Next(std::int64_t run, std::int64_t first);

 private:
  void Read();
  [[noreturn]] void Refuse() const;

  const std::string path_;
  std::ifstream in_;
  nlohmann::json next_;
};

/** Writes the files of one run out of the pieces of all its shards, in the order of their numbers. The result has no
more than the pieces tell. Cost: that of the pieces, whatever `cases` is. @throws BadInput. */
[[nodiscard]] ExportResult ExportPieces(const std::string& robot, std::int64_t number, std::int64_t cases,
                                        const ExportOptions& options, std::vector<ShardPieces>& shards,
                                        const std::vector<std::string>& files);

/** Joins the files of several runs, in their order, to a new one: tables have one line of names, the first one's.
@pre format is kCsv or kJsonLines. @throws OutputError if the file exists or cannot be written. */
void JoinTables(ExportFormat format, const std::vector<std::string>& parts, const std::string& path);

}  // namespace forereach
