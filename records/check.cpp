#include "records/check.h"

#include <algorithm>
#include <filesystem>
#include <iterator>

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "lcmtypes/printable.h"
#include "records/database.h"
#include "records/kept_tasks.h"
#include "records/log_directory.h"
#include "records/log_survey.h"

namespace forereach {
namespace {

constexpr std::size_t kMaxListed = 20;

enum class Seen : std::uint8_t { kNot, kOther, kSame };

void CheckEvents(EventLogReader& reader, const std::vector<LogReference>& references, std::vector<Seen>& seen) {
  ForEachEvent(reader, [&](const LogEvent& event) {
    auto row = std::ranges::lower_bound(references, event.number, {}, &LogReference::event_number);
    if (row == references.end() || row->event_number != event.number) return;
    const std::string digest = ToHex(DigestOf(event));
    for (; row != references.end() && row->event_number == event.number; ++row) {
      Seen& found = seen[static_cast<std::size_t>(row - references.begin())];
      found = std::max(found, row->digest == digest ? Seen::kSame : Seen::kOther);
    }
  });
}

LogCheck Check(Database& database, const LogDirectory& directory, const RunRow& run) {
  LogCheck check;
  check.log_file = run.log_file;
  check.ended = run.end_utime.has_value();
  const KeptTasks kept(directory.path());
  for (const std::string& task : database.ConfigDigests(run.log_file))
    std::ranges::move(kept.FindDamage(task), std::back_inserter(check.damaged_tasks));
  const std::vector<LogReference> references = database.References(run.log_file);
  std::vector<Seen> seen(references.size(), Seen::kNot);
  if (directory.Bytes(run.log_file)) {
    EventLogReader reader(directory.PathOf(run.log_file));
    CheckEvents(reader, references, seen);
    check.damage = reader.damage();
    check.cut_bytes = reader.size() - reader.offset();
  } else {
    check.log = run.log_deleted_utime ? LogCheck::Log::kDeleted : LogCheck::Log::kMissing;
  }
  for (std::size_t i = 0; i < references.size(); ++i)
    if (seen[i] == Seen::kSame)
      ++check.whole;
    else
      (seen[i] == Seen::kOther ? check.changed : check.missing).push_back(references[i].event_number);
  return check;
}

std::string DescribeCheck(const LogCheck& check) {
  if (check.log == LogCheck::Log::kDeleted)
    return fmt::format("deleted for the quota, {} events of rows went with it", check.missing.size());
  if (check.log == LogCheck::Log::kMissing) return fmt::format("missing, {} rows have no event", check.missing.size());
  if (check.log == LogCheck::Log::kUnknown) return "no run is its, the next start of the logger takes it";
  std::string text = fmt::format("{} events of rows whole", check.whole);
  const auto add = [&text](std::int64_t count, const char* what) {
    if (count > 0) text += fmt::format(", {} {}", count, what);
  };
  add(std::ssize(check.changed), "changed");
  add(std::ssize(check.missing), "missing");
  add(check.damage.places, "damaged places");
  add(check.cut_bytes, "bytes of a cut tail");
  return text + (check.ended ? "" : ", not ended");
}

void List(std::string& text, const std::vector<std::int64_t>& events, const char* what) {
  if (events.empty()) return;
  const auto shown = std::min(events.size(), kMaxListed);
  text += fmt::format("  {}: event {}{}\n", what,
                      fmt::join(events.begin(), events.begin() + static_cast<std::ptrdiff_t>(shown), ", "),
                      events.size() > shown ? fmt::format(" and {} more", events.size() - shown) : "");
}

}  // namespace

bool LogCheck::whole_log() const {
  if (log != Log::kThere) return log == Log::kDeleted;
  return changed.empty() && missing.empty() && damaged_tasks.empty() && damage.places == 0 &&
         (cut_bytes == 0 || !ended);
}

std::vector<LogCheck> CheckLogs(const std::string& path) {
  const std::string file = (std::filesystem::path(path) / LogDirectory::kDatabase).string();
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error))
    throw LogError(path + ": is a file; name the logger's directory, in which it lies");
  if (!std::filesystem::is_directory(path, error)) throw LogError(path + ": there is no such directory");
  if (!std::filesystem::is_regular_file(file, error))
    throw LogError(path + ": is no logger's directory: no decision database: " + file);
  if (KindOf(file) != FileKind::kDatabase) throw LogError(file + ": is no decision database");
  const LogDirectory directory(path);
  Database database(file);
  std::vector<LogCheck> checks;
  for (const RunRow& run : database.Runs()) checks.push_back(Check(database, directory, run));
  for (const std::string& log : directory.Logs()) {
    if (std::ranges::find(checks, log, &LogCheck::log_file) != checks.end()) continue;
    checks.push_back({.log_file = log, .log = LogCheck::Log::kUnknown, .ended = false});
  }
  return checks;
}

std::string ToText(const std::vector<LogCheck>& checks) {
  std::string text;
  for (const LogCheck& check : checks) {
    text += fmt::format("{}: {}\n", Printable(check.log_file), DescribeCheck(check));
    if (check.log != LogCheck::Log::kThere) continue;
    List(text, check.changed, "changed");
    List(text, check.missing, "missing");
    for (const std::string& damage : check.damaged_tasks) text += fmt::format("  task: {}\n", Printable(damage));
  }
  const auto faults = std::ranges::count_if(checks, [](const LogCheck& check) { return !check.whole_log(); });
  return text + fmt::format("{} logs, {} not as recorded\n", checks.size(), faults);
}

nlohmann::json ToJson(const std::vector<LogCheck>& checks) {
  nlohmann::json list = nlohmann::json::array();
  for (const LogCheck& check : checks)
    list.push_back({{"log", check.log_file},
                    {"state", check.log == LogCheck::Log::kThere     ? "there"
                              : check.log == LogCheck::Log::kDeleted ? "deleted"
                              : check.log == LogCheck::Log::kUnknown ? "unknown"
                                                                     : "missing"},
                    {"ended", check.ended},
                    {"as_recorded", check.whole_log()},
                    {"whole", check.whole},
                    {"changed", check.changed},
                    {"missing", check.missing},
                    {"damaged_tasks", check.damaged_tasks},
                    {"damage", {{"places", check.damage.places}, {"bytes", check.damage.bytes}}},
                    {"cut_bytes", check.cut_bytes}});
  return list;
}

}  // namespace forereach
