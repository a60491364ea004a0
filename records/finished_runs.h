/** The results of runs that a command has finished, in a directory, so that an interrupted command goes on there.

A result belongs to what it was made of: the names and bytes of the run's logs, its rows in a database, the tasks that
are kept beside them, the command with its options, and the program itself. When any of these changes, the run is read
again. A file appears whole or not at all, and a damaged one counts as none. The directory may be deleted at any time.
*/
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "records/run_logs.h"

namespace forereach {

/** The digest of the running program, in hexadecimal digits. */
[[nodiscard]] std::string DigestOfProgram();

/** Names what a run is made of, and a job, in hexadecimal digits. Cost: one pass over its logs. @throws BadInput if one
cannot be read. */
[[nodiscard]] std::string KeyOf(const RunLogs& run, const std::string& job);

class FinishedRuns final {
 public:
  /** @param directory made if necessary. @param job the command, and the content of everything else on which a result
  depends. @throws OutputError if the directory cannot be made. */
  FinishedRuns(std::string directory, const std::string& job);
  /** Removes the directory if nothing was kept. */
  ~FinishedRuns();
  FinishedRuns(const FinishedRuns&) = delete;
  FinishedRuns& operator=(const FinishedRuns&) = delete;

  /** Names the run's results. @throws BadInput if a log cannot be read. */
  [[nodiscard]] std::string KeyOf(const RunLogs& run) const { return forereach::KeyOf(run, job_); }

  /** The result that was kept last under this key, if there is one. */
  [[nodiscard]] std::optional<nlohmann::json> Find(const std::string& key) const;
  /** The same as a Result (nlohmann's from_json); nothing if it is not what this program writes. */
  template <class Result>
  [[nodiscard]] std::optional<Result> FindAs(const std::string& key) const {
    const auto kept = Find(key);
    if (!kept) return std::nullopt;
    try {
      return kept->template get<Result>();
    } catch (const nlohmann::json::exception&) {
      return std::nullopt;
    }
  }
  /** Keeps a result. Any number of threads may keep, each another key. @throws OutputError. */
  void Keep(const std::string& key, const nlohmann::json& result) const;

 private:
  [[nodiscard]] std::string PathOf(const std::string& key) const;

  const std::string directory_;
  std::string job_;
};

}  // namespace forereach
