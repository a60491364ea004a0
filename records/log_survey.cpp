#include "records/log_survey.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>

#include "certifier/task/files.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "forereach/certified_plan_v2_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/logger_status_t.hpp"
#include "lcmtypes/heartbeat.h"

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
    const std::int64_t before = survey_.events;
    certifier_.Begin();
    logger_.Begin();
    EventLogReader reader(log);
    ForEachEvent(reader, [this](const LogEvent& event) { Take(event.message()); });
    if (kind == FileKind::kOther && survey_.events == before) RefuseAsLog(log, kind);  // else its beginning is damaged
    if (order == LogOrder::kOneRun) RequireSameRun(log);
    last_log_ = log;
  }

  LogSurvey Finish() { return std::move(survey_); }

 private:
  // The sequence of one kind of heartbeats, in this file and in those before.
  struct Heartbeats {
    std::optional<std::int64_t> before, first, last;
    void Begin() {
      if (last) before = last;
      first.reset();
    }
    void Take(std::int64_t sequence) {
      if (!first) first = sequence;
      last = sequence;
    }
    [[nodiscard]] bool known() const { return before && first; }
    [[nodiscard]] bool go_on() const { return known() && *first > *before; }
  };

  void Take(Bytes message) {
    ++survey_.events;
    if (const auto decision = Decoded<decision_t>(message)) {
      ++survey_.decisions;
      Record(GetDigest(decision->config_digest), GetDigest(decision->observations_digest));
    } else if (const auto certified = Decoded<certified_plan_v2_t>(message)) {
      Record(GetDigest(certified->config_digest), GetDigest(certified->observations_digest));
    } else if (const auto old = Decoded<certified_plan_t>(message)) {
      Record(GetDigest(old->config_digest), GetDigest(old->observations_digest));
    } else if (Decoded<candidate_plan_t>(message)) {
      ++survey_.candidates;
    } else if (const auto heartbeat = ReadHeartbeat(message)) {
      if (heartbeat->in_charge) certifier_.Take(heartbeat->sequence);
    } else if (const auto logger = Decoded<logger_status_t>(message)) {
      logger_.Take(logger->sequence);
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
    if ((!certifier_.known() && !logger_.known()) || certifier_.go_on() || logger_.go_on()) return;
    throw LogError(
        log + ": does not follow " + last_log_ +
        ": neither the certifier's nor the logger's heartbeats go on from one to the other; name the files of "
        "one run, in the order of their names, and other runs by themselves");
  }

  LogSurvey survey_;
  Heartbeats certifier_, logger_;
  std::string last_log_;
};

}  // namespace

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
        (survey.events == 0 ? "is empty" : "holds " + std::to_string(survey.events) + " events") +
        ", and neither a candidate nor a decision; nothing was proposed while it was recorded, or it is not of "
        "ForeReach");
  return survey;
}

}  // namespace forereach
