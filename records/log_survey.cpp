#include "records/log_survey.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/logger_status_t.hpp"
#include "lcmtypes/names.h"
#include "task/files.h"

namespace forereach {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void RefuseAsLog(const std::string& path, FileKind kind) {
  switch (kind) {
    case FileKind::kDirectory:
      throw LogError(path + ": is a directory; name the event logs in it, events-*.lcmlog of one run");
    case FileKind::kDatabase:
      throw LogError(
          path +
          ": is an SQLite database, not an LCM event log; name the event logs in its directory, events-*.lcmlog of "
          "one run");
    case FileKind::kJson:
      throw LogError(path +
                     ": is a JSON document, not an LCM event log; a decision of `forereach certify --json` is for "
                     "`forereach verify` alone");
    default: throw LogError(path + ": is no LCM event log: no event is in it; the logger's are named events-*.lcmlog");
  }
}

class Surveyor final {
 public:
  void Read(const std::string& log, LogOrder order) {
    const FileKind kind = KindOf(log);
    if (kind != FileKind::kEventLog && kind != FileKind::kEmpty && kind != FileKind::kOther) RefuseAsLog(log, kind);
    const std::int64_t events = survey_.events;
    before_.Extend(std::exchange(log_, {}));
    EventLogReader reader(log);
    ForEachEvent(reader, [this](const LogEvent& event) {
      log_.utime.Take(event.utime);
      Take(event.message());
    });
    if (kind == FileKind::kOther && survey_.events == events) RefuseAsLog(log, kind);  // else its beginning is damaged
    if (order == LogOrder::kOneRun) RequireSameRun(log);
    last_log_ = log;
  }

  LogSurvey Finish() { return std::move(survey_); }
  [[nodiscard]] const LogEnds& ends() const { return log_; }

 private:
  void Take(Bytes message) {
    ++survey_.events;
    if (const auto decision = Decoded<decision_t>(message)) {
      ++survey_.decisions;
      Record(GetDigest(decision->config_digest), GetDigest(decision->observations_digest));
    } else if (const auto certified = Decoded<certified_plan_t>(message)) {
      Record(GetDigest(certified->config_digest), GetDigest(certified->observations_digest));
    } else if (Decoded<candidate_plan_t>(message)) {
      ++survey_.candidates;
    } else if (const auto heartbeat = Decoded<certifier_status_t>(message)) {
      if (IsInCharge(*heartbeat)) log_.certifier.Take(heartbeat->sequence);
    } else if (const auto logger = Decoded<logger_status_t>(message)) {
      log_.logger.Take(logger->sequence);
    }
  }

  void Record(const Digest& config, const Digest& observations) {
    const auto found = survey_.configs.find(config);
    if (found == survey_.configs.end() && survey_.configs.size() >= LogSurvey::kMaxConfigs) return;
    if (found == survey_.configs.end()) survey_.order.push_back(config);
    LogSurvey::Recorded& recorded = found == survey_.configs.end() ? survey_.configs[config] : found->second;
    ++recorded.decisions;
    if (recorded.observations.size() < LogSurvey::kMaxObservations) recorded.observations.insert(observations);
  }

  void RequireSameRun(const std::string& log) const {
    if (Continues(before_, log_).value_or(true)) return;
    throw LogError(
        log + ": does not follow " + last_log_ +
        ": neither the certifier's nor the logger's heartbeats go on from one to the other; name the files of "
        "one run, in the order of their names, and other runs by themselves");
  }

  LogSurvey survey_;
  LogEnds before_, log_;  // of the logs before, and of the last one
  std::string last_log_;
};

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
  Surveyor surveyor;
  surveyor.Read(log, LogOrder::kAny);
  return surveyor.ends();
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
    throw LogError("log: cannot read " + path + ": not a regular file");
  const std::string bytes = ReadBeginning(path, 16);
  if (bytes.empty()) return FileKind::kEmpty;
  if (bytes == std::string_view("SQLite format 3\0", 16)) return FileKind::kDatabase;
  if (bytes.starts_with("\xED\xA1\xDA\x01")) return FileKind::kEventLog;
  const auto begin = bytes.find_first_not_of(" \t\r\n");
  return begin != std::string::npos && (bytes[begin] == '{' || bytes[begin] == '[') ? FileKind::kJson
                                                                                    : FileKind::kOther;
}

LogSurvey Survey(const std::vector<std::string>& logs, LogOrder order) {
  std::set<std::string> named;
  for (const std::string& log : logs)
    if (std::error_code error; !named.insert(fs::weakly_canonical(log, error).string()).second)
      throw LogError(log + ": is named twice");
  Surveyor surveyor;
  for (const std::string& log : logs) surveyor.Read(log, order);
  return surveyor.Finish();
}

LogSurvey SurveyRun(const std::vector<std::string>& logs) {
  LogSurvey survey = Survey(logs);
  if (survey.candidates == 0 && survey.decisions == 0 && survey.configs.empty())
    throw LogError(
        logs.front() + (logs.size() > 1 ? " and those behind it: " : ": ") +
        (survey.events == 0 ? "is empty" : fmt::format("holds {} events", survey.events)) +
        ", and neither a candidate nor a decision; nothing was proposed while it was recorded, or it is not of "
        "ForeReach");
  return survey;
}

}  // namespace forereach
