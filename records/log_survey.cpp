#include "records/log_survey.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "forereach/certifier_status_t.hpp"
#include "forereach/logger_status_t.hpp"
#include "lcmtypes/names.h"
#include "task/files.h"

namespace forereach {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void RefuseAsLog(const std::string& path, FileKind kind) {
  switch (kind) {
    case FileKind::kDirectory:
      throw LogError(fmt::format("{}: is a directory; name the event logs in it, events-*.lcmlog of one run", path));
    case FileKind::kDatabase:
      throw LogError(
          fmt::format("{}: is an SQLite database, not an LCM event log; name the event logs in its directory, "
                      "events-*.lcmlog of one run",
                      path));
    case FileKind::kJson:
      throw LogError(
          fmt::format("{}: is a JSON document, not an LCM event log; a decision of `forereach certify --json` is for "
                      "`forereach verify` alone",
                      path));
    default:
      throw LogError(
          fmt::format("{}: is no LCM event log: no event is in it; the logger's are named events-*.lcmlog", path));
  }
}

void RequireLog(const std::string& path) {
  const FileKind kind = KindOf(path);
  if (kind == FileKind::kEventLog || kind == FileKind::kEmpty) return;
  if (kind != FileKind::kOther) RefuseAsLog(path, kind);
  EventLogReader reader(path);  // its beginning may be damaged
  LogEvent event;
  LogStatus status;
  while ((status = reader.Next(event)) == LogStatus::kCorrupt) continue;
  if (status != LogStatus::kEvent) RefuseAsLog(path, kind);
}

void Take(const LogEvent& event, LogEnds& ends) {
  ends.utime.Take(event.utime);
  if (const auto heartbeat = Decoded<certifier_status_t>(event.message())) {
    if (IsInCharge(*heartbeat)) ends.certifier.Take(heartbeat->sequence);
  } else if (const auto logger = Decoded<logger_status_t>(event.message())) {
    ends.logger.Take(logger->sequence);
  }
}

// Events from `begin` until the reader has passed `end`, or, at the beginning, until both senders were heard.
LogEnds Read(const std::string& log, std::int64_t begin, std::int64_t end) {
  LogEnds ends;
  EventLogReader reader(log);
  if (begin > 0) reader.SkipTo(begin);
  LogEvent event;
  for (LogStatus status; reader.offset() < end &&
                         ((status = reader.Next(event)) == LogStatus::kEvent || status == LogStatus::kCorrupt);) {
    if (status == LogStatus::kEvent) Take(event, ends);
    if (begin == 0 && ends.certifier.first && ends.logger.first) break;
  }
  return ends;
}

}  // namespace

void LogEnds::Range::Take(std::int64_t value) {
  if (!first) first = value;
  last = value;
}

void LogEnds::Extend(const LogEnds& behind) {
  for (Range LogEnds::*range : {&LogEnds::utime, &LogEnds::certifier, &LogEnds::logger}) {
    if (!(behind.*range).first) continue;
    (this->*range).Take(*(behind.*range).first);
    (this->*range).Take(*(behind.*range).last);
  }
}

LogEnds EndsOf(const std::string& log) {
  RequireLog(log);
  LogEnds ends = Read(log, 0, kEndBytes);
  const std::int64_t size = EventLogReader(log).size();
  for (std::int64_t bytes = 1 << 18;; bytes *= 2) {
    LogEnds last = Read(log, std::max<std::int64_t>(size - bytes, 1), size);
    const bool is_whole =
        last.utime.last && (last.certifier.last || !ends.certifier.first) && (last.logger.last || !ends.logger.first);
    if (!is_whole && bytes < size) continue;
    for (LogEnds::Range LogEnds::*range : {&LogEnds::certifier, &LogEnds::logger})
      if (!(ends.*range).first) last.*range = {};  // its count may have begun anew in between
    ends.Extend(last);
    return ends;
  }
}

std::optional<bool> Continues(const LogEnds& before, const LogEnds& log) {
  std::optional<bool> continues;
  for (const LogEnds::Range LogEnds::*range : {&LogEnds::certifier, &LogEnds::logger})
    if ((before.*range).last && (log.*range).first)
      continues = continues.value_or(false) || *(log.*range).first > *(before.*range).last;
  return continues;
}

FileKind KindOf(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return FileKind::kDirectory;
  if (fs::exists(path, error) && !fs::is_regular_file(path, error))
    throw LogError(fmt::format("log: cannot read {}: not a regular file", path));
  const std::string bytes = ReadBeginning(path, 16);
  if (bytes.empty()) return FileKind::kEmpty;
  if (bytes == std::string_view("SQLite format 3\0", 16)) return FileKind::kDatabase;
  if (bytes.starts_with("\xED\xA1\xDA\x01")) return FileKind::kEventLog;
  const auto begin = bytes.find_first_not_of(" \t\r\n");
  return begin != std::string::npos && (bytes[begin] == '{' || bytes[begin] == '[') ? FileKind::kJson
                                                                                    : FileKind::kOther;
}

void RequireLogs(const std::vector<std::string>& logs) {
  std::set<std::string> named;
  for (const std::string& log : logs) {
    if (std::error_code error; !named.insert(fs::weakly_canonical(log, error).string()).second)
      throw LogError(fmt::format("{}: is named twice", log));
    RequireLog(log);
  }
}

}  // namespace forereach
