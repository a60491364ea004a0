#include "records/run_logs.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include "certifier/task/config_error.h"
#include "records/log_directory.h"
#include "records/log_survey.h"

namespace forereach {

std::optional<std::string> DatabaseOf(const std::string& path) {
  const FileKind kind = KindOf(path);
  if (kind == FileKind::kDatabase) return path;
  if (kind != FileKind::kDirectory) return std::nullopt;
  std::string database = (std::filesystem::path(path) / LogDirectory::kDatabase).string();
  if (!std::filesystem::is_regular_file(database))
    throw ConfigError(path + ": is a directory; name the event logs in it, since it has no decision database");
  return database;
}

std::vector<RunLogs> RunsOf(Database& database) {
  const std::filesystem::path directory = std::filesystem::path(database.path()).parent_path();
  std::vector<RunLogs> runs;
  std::string last;
  for (RunRow& run : database.Runs()) {
    if (run.continues.empty() || run.continues != last) runs.emplace_back();
    last = run.log_file;
    const std::string log = (directory / run.log_file).string();
    if (std::filesystem::exists(log))
      runs.back().logs.push_back(log);
    else
      runs.back().missing.push_back(std::move(run));
  }
  return runs;
}

std::string WhyMissing(const RunRow& run) {
  return run.log_deleted_utime ? "the log was deleted for the quota" : "the log is not in the database's directory";
}

std::optional<std::string> DatabaseAmong(const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs)
    if (auto database = DatabaseOf(input)) {
      if (inputs.size() > 1)
        throw ConfigError(input + ": a database or a directory is named by itself, without others");
      return database;
    }
  return std::nullopt;
}

NamedRuns RunsNamedBy(const std::vector<std::string>& inputs) {
  const std::optional<std::string> path = DatabaseAmong(inputs);
  if (!path) return {{inputs}, {}, false};
  NamedRuns named{{}, {}, true};
  Database database(*path);
  for (RunLogs& run : RunsOf(database)) {
    for (const RunRow& missing : run.missing) named.missing.push_back(missing.log_file + ": " + WhyMissing(missing));
    if (!run.logs.empty()) named.runs.push_back(std::move(run.logs));
  }
  return named;
}

std::int64_t BytesOf(const NamedRuns& named) {
  std::int64_t bytes = 0;
  for (const std::vector<std::string>& run : named.runs)
    for (const std::string& log : run) {
      std::error_code error;
      const auto size = std::filesystem::file_size(log, error);
      if (!error) bytes += static_cast<std::int64_t>(size);
    }
  return bytes;
}

}  // namespace forereach
