#include "records/run_logs.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/core.h>

#include "forereach/numerics/parallel.h"
#include "records/log_directory.h"
#include "records/log_survey.h"
#include "task/config_error.h"

namespace forereach {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepest = 32;  // directories within directories

std::string DirectoryOf(const std::string& path) {
  const std::string directory = fs::path(path).parent_path().string();
  return directory.empty() ? "." : directory;
}

// By our logger, or by lcm-logger: lcmlog-2026-01-01.00.
bool IsNamedAsLog(const fs::path& path) {
  return path.extension() == ".lcmlog" || path.filename().string().starts_with("lcmlog-");
}

// One log of a directory without a database, or one that was named.
struct Log {
  std::string path;
  bool is_named;
  LogEnds ends{};
  std::string unreadable{};
};

class Finder final {
 public:
  explicit Finder(unsigned jobs) : jobs_(jobs) {}

  void Add(const std::string& input) {
    root_ = input;
    switch (KindOf(input)) {
      case FileKind::kDirectory:
        named_.is_many = true;
        Claim(input, input);
        if (AddDirectory(fs::path(input), 0) == 0)
          throw ConfigError("{}: neither a decision database nor event logs, *.lcmlog or lcmlog-*, in this directory",
                            input);
        break;
      case FileKind::kDatabase:
        named_.is_many = true;
        Claim(input, input);
        AddDatabase(input);
        break;
      default: Claim(input, input); logs_.push_back({input, true});
    }
  }

  NamedRuns Finish() {
    AddLogs();
    if (named_.runs.empty() && named_.missing.empty()) throw ConfigError("no run was named");
    return std::move(named_);
  }

 private:
  // False if the file was read already under another name. One that is named twice by the user is an error.
  bool Claim(const std::string& path, const std::string& input) {
    const auto identity = IdentityOf(path);
    if (!identity) return true;  // whoever reads it says why
    const auto [found, is_new] = inputs_.try_emplace({identity->device, identity->inode}, input);
    if (!is_new && found->second != input)
      throw LogError(fmt::format("{}: is named twice: {} has it, too", path, found->second));
    if (!is_new && path == input) throw LogError(fmt::format("{}: is named twice", path));
    return is_new;
  }

  // Returns the number of runs and logs found.
  std::size_t AddDirectory(const fs::path& directory, int depth) {
    std::vector<std::string> logs, links, directories;
    std::string database;
    std::error_code error;
    for (fs::directory_iterator file(directory, error), end; !error && file != end; file.increment(error)) {
      std::error_code ignored;
      const std::string path = file->path().string();
      if (file->is_directory(ignored) && !file->is_symlink(ignored))
        directories.push_back(path);
      else if (!file->is_regular_file(ignored))
        continue;
      else if (file->path().filename() == LogDirectory::kDatabase)
        database = path;
      else if (IsNamedAsLog(file->path()))
        (file->is_symlink(ignored) ? links : logs).push_back(path);
    }
    if (error) named_.missing.push_back(fmt::format("{}: {}", directory.string(), error.message()));
    const std::size_t before = named_.runs.size() + named_.missing.size();
    if (!database.empty() && Claim(database, root_)) AddDatabase(database);
    const auto is_known = [this](const std::string& log) { return !Claim(log, root_); };
    std::erase_if(logs, is_known);
    std::erase_if(links, is_known);  // a log goes by its own name, unless it has it elsewhere
    logs.insert(logs.end(), links.begin(), links.end());
    std::ranges::sort(logs);
    for (const std::string& log : logs) logs_.push_back({log, false});
    std::size_t found = logs.size();
    std::ranges::sort(directories);
    for (const std::string& each : directories)
      if (depth < kDeepest) found += AddDirectory(each, depth + 1);
    return found + named_.runs.size() + named_.missing.size() - before;
  }

  void AddDatabase(const std::string& path) {
    std::vector<RunRow> rows;
    try {
      rows = Database(path).Runs();
    } catch (const BadInput& error) {
      if (root_ == path) throw;  // it was named
      named_.missing.emplace_back(error.what());
      return;
    }
    const std::string directory = DirectoryOf(path);
    std::string last;
    for (RunRow& row : rows) {
      if (row.continues.empty() || row.continues != last)
        named_.runs.push_back({row.robot.empty() ? directory : row.robot, {}, path, {}});
      last = row.log_file;
      RunLogs& run = named_.runs.back();
      const std::string log = (fs::path(path).parent_path() / row.log_file).string();
      if (!fs::exists(log)) {
        named_.missing.push_back(fmt::format("{}: {}", row.log_file, WhyMissing(row)));
        run.missing.push_back(std::move(row));
      } else if (Claim(log, root_)) {
        run.logs.push_back(log);
      }
    }
  }

  // Those that no database lists.
  void AddLogs() {
    if (logs_.empty()) return;
    if (logs_.size() > 1)
      ForEachInParallel(logs_.size(), jobs_, [this](std::size_t i, std::size_t) {
        try {
          logs_[i].ends = EndsOf(logs_[i].path);
        } catch (const BadInput& error) {
          if (logs_[i].is_named) throw;
          logs_[i].unreadable = error.what();
        }
      });
    const Log* before = nullptr;
    LogEnds ends;
    std::vector<LogEnds> heads;  // of the runs whose logs were named
    for (const Log& log : logs_) {
      if (!log.unreadable.empty()) {
        named_.missing.push_back(log.unreadable);
        continue;
      }
      if (before && IsOfSameRun(*before, ends, log)) {
        named_.runs.back().logs.push_back(log.path);
      } else {
        RequireNoSuccessor(log, heads);
        if (before) named_.is_many = true;
        named_.runs.push_back({DirectoryOf(log.path), {log.path}, "", {}});
        ends = {};
        if (log.is_named) heads.push_back(log.ends);
      }
      ends.Extend(log.ends);
      before = &log;
    }
  }

  static bool IsOfSameRun(const Log& before, const LogEnds& ends, const Log& log) {
    if (before.is_named != log.is_named) return false;
    if (log.is_named) return Continues(ends, log.ends).value_or(true);
    return DirectoryOf(before.path) == DirectoryOf(log.path) && Continues(ends, log.ends).value_or(false) &&
           log.ends.utime.first >= ends.utime.last;
  }

  // Logs of one run that were named in the wrong order would be replayed without what came before.
  static void RequireNoSuccessor(const Log& log, const std::vector<LogEnds>& heads) {
    for (const LogEnds& head : heads)
      if (log.is_named && Continues(log.ends, head).value_or(false) && head.utime.first >= log.ends.utime.last)
        throw LogError(
            fmt::format("{}: does not follow the logs before it, which go on from it; name the files of one run in the "
                        "order of their names",
                        log.path));
  }

  const unsigned jobs_;
  NamedRuns named_;
  std::string root_;  // the input that is being added
  std::vector<Log> logs_;
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::string> inputs_;  // which input has a file
};

}  // namespace

NamedRuns RunsNamedBy(const std::vector<std::string>& inputs, unsigned jobs) {
  Finder finder(jobs);
  for (const std::string& input : inputs) finder.Add(input);
  return finder.Finish();
}

std::string NameOf(const RunLogs& run) { return run.logs.empty() ? run.database : run.logs.front(); }

std::int64_t BytesOf(const RunLogs& run) {
  std::int64_t bytes = 0;
  for (const std::string& log : run.logs) {
    std::error_code error;
    const auto size = fs::file_size(log, error);
    if (!error) bytes += static_cast<std::int64_t>(size);
  }
  return bytes;
}

std::string WhyMissing(const RunRow& run) {
  return run.log_deleted_utime ? "the log was deleted for the quota" : "the log is not in the database's directory";
}

}  // namespace forereach
