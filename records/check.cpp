#include "records/check.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "lcmtypes/printable.h"
#include "records/database.h"
#include "records/interpreter.h"
#include "records/kept_tasks.h"
#include "records/log_directory.h"
#include "records/log_survey.h"
#include "records/log_tasks.h"
#include "records/row_check.h"

namespace forereach {
namespace {

constexpr std::size_t kMaxListed = 20;

constexpr std::int64_t kBlock = EventNumbers::kBlock;

// The rows of one log file in a database, of which those around one event are in the memory.
class RecordedRows {
 public:
  RecordedRows(Database& database, std::string log_file) : database_(database), log_file_(std::move(log_file)) {}

  // Those of the events around this one.
  const Rows& Around(std::int64_t number) {
    if (std::exchange(block_, number / kBlock) != number / kBlock) {
      const std::int64_t first = *block_ * kBlock;
      rows_ = database_.ReadRange(log_file_, *block_ > 0 ? first : first - (kBlock - 1),
                                  *block_ < 0 ? first : first + (kBlock - 1));
      references_.clear();
      for (const auto& row : rows_.decisions) references_.emplace(row.event.event_number, row.event.digest);
      for (const auto& row : rows_.events) references_.emplace(row.event.event_number, row.event.digest);
      for (const auto& row : rows_.gaps) references_.emplace(row.event.event_number, row.event.digest);
      for (const auto& row : rows_.transitions) references_.emplace(row.event.event_number, row.event.digest);
    }
    return rows_;
  }
  // The digests with this number, or all of this block.
  const std::set<std::pair<std::int64_t, std::string>>& ReferencesAround(std::int64_t number) {
    static_cast<void>(Around(number));
    return references_;
  }
  // Calls `visit` with an event of each block that has some, in their order.
  void ForEachBlock(const std::function<void(std::int64_t)>& visit) {
    for (const std::int64_t block : database_.EventBlocks(log_file_, kBlock)) visit(block * kBlock);
  }

 private:
  Database& database_;
  const std::string log_file_;
  std::optional<std::int64_t> block_;
  Rows rows_;
  std::set<std::pair<std::int64_t, std::string>> references_;
};

// Which events of rows a log has.
class ReferenceCheck {
 public:
  explicit ReferenceCheck(RecordedRows& recorded) : recorded_(recorded) {}

  void Take(const LogEvent& event) {
    const auto& all = recorded_.ReferencesAround(event.number);
    auto reference = all.lower_bound({event.number, ""});
    if (reference == all.end() || reference->first != event.number) return;
    const std::string digest = ToHex(DigestOf(event));
    for (std::size_t place = 0; reference != all.end() && reference->first == event.number; ++reference, ++place) {
      if (same_.size() <= place) same_.resize(place + 1), other_.resize(place + 1);
      (reference->second == digest ? same_ : other_)[place].Insert(event.number);
    }
  }

  void Finish(LogCheck& check) {
    recorded_.ForEachBlock([&](std::int64_t around) {
      std::optional<std::int64_t> last;
      std::size_t place = 0;
      for (const auto& [number, digest] : recorded_.ReferencesAround(around)) {
        place = std::exchange(last, number) == number ? place + 1 : 0;
        const bool was_read = place < same_.size();
        if (was_read && same_[place].Contains(number))
          ++check.whole;
        else
          (was_read && other_[place].Contains(number) ? check.changed : check.missing).push_back(number);
      }
    });
  }

 private:
  RecordedRows& recorded_;
  std::vector<EventNumbers> same_, other_;  // of the first reference of each number, of the second, ...
};

// What a log file leaves to the next one of its run.
struct RowState {
  Interpreter interpreter;
  std::set<std::string> lossy;
};

class DirectoryCheck {
 public:
  DirectoryCheck(const std::string& path, const std::string& database, const std::string& config, const LogKey& key)
      : directory_(path), kept_(path), database_(database), config_(config), key_(key) {}

  [[nodiscard]] std::vector<LogCheck> CheckAll() {
    std::vector<LogCheck> checks;
    for (const RunRow& run : database_.Runs()) checks.push_back(Check(run));
    for (const std::string& log : database_.LogsWithoutRun())
      checks.push_back({.log_file = log,
                        .log = directory_.Bytes(log) ? LogCheck::Log::kUnknown : LogCheck::Log::kMissing,
                        .ended = false,
                        .missing = EventsOf(log)});
    for (const std::string& log : directory_.Logs())
      if (std::ranges::find(checks, log, &LogCheck::log_file) == checks.end())
        checks.push_back({.log_file = log, .log = LogCheck::Log::kUnknown, .ended = false});
    return checks;
  }

 private:
  std::vector<std::int64_t> EventsOf(const std::string& log) {
    RecordedRows recorded(database_, log);
    LogCheck check;
    ReferenceCheck(recorded).Finish(check);
    return check.missing;
  }

  LogCheck Check(const RunRow& run) {
    LogCheck check;
    check.log_file = run.log_file;
    check.ended = run.end_utime.has_value();
    for (const std::string& task : database_.ConfigDigests(run.log_file))
      std::ranges::move(kept_.FindDamage(task), std::back_inserter(check.damaged_tasks));
    RecordedRows recorded(database_, run.log_file);
    ReferenceCheck references(recorded);
    const bool is_there = directory_.Bytes(run.log_file).has_value();
    std::optional<Interpreter> interpreter;
    RowGrounds grounds = GroundsOf(run);
    RowComparison comparison(grounds);
    if (is_there) {
      const BusOptions channels = ChannelsOf(run, check);
      interpreter = InterpreterOf(run, channels, grounds);
      grounds.misses_candidates = grounds.lossy.contains(channels.candidate);
      EventLogReader reader(directory_.PathOf(run.log_file));
      ForEachEvent(reader, [&](const LogEvent& event) {
        references.Take(event);
        Rows derived;
        interpreter->Observe(event, derived);
        if (!derived.empty()) comparison.Take(derived, recorded.Around(event.number));
      });
      check.damage = reader.damage();
      check.cut_bytes = reader.size() - reader.offset();
    } else {
      check.log = run.log_deleted_utime ? LogCheck::Log::kDeleted : LogCheck::Log::kMissing;
    }
    references.Finish(check);
    if (!is_there) return check;
    grounds.knows_order &= check.damage.places == 0 && check.changed.empty() && check.missing.empty();
    for (const auto* events : {&check.changed, &check.missing}) grounds.damaged.insert(events->begin(), events->end());
    recorded.ForEachBlock([&](std::int64_t around) { comparison.TakeRecorded(recorded.Around(around)); });
    check.rows = comparison.Finish();
    if (grounds.knows_order) states_.emplace(run.log_file, RowState{*std::move(interpreter), grounds.lossy});
    return check;
  }

  // A logger that starts again knows less of the files before than the one that was killed.
  [[nodiscard]] RowGrounds GroundsOf(const RunRow& run) {
    RowGrounds grounds;
    if (!run.end_utime) grounds.end = run.events;
    grounds.knows_order = run.continues.empty() || (run.recovered.empty() && states_.contains(run.continues));
    for (const auto& [channel, lost] : database_.LossesWithoutEvents(run.log_file)) grounds.lossy.insert(channel);
    return grounds;
  }

  [[nodiscard]] BusOptions ChannelsOf(const RunRow& run, const LogCheck& check) const {
    if (!run.robot.empty() && key_.file.empty() && !key_.none)
      throw ConfigError(
          "{}: its logger had the keys of {}: name them with --key FILE (verify.pub is "
          "enough), or believe every message with --no-key",
          directory_.PathOf(run.log_file), run.robot);
    const LogKey key = run.robot.empty() ? LogKey{.file = "", .none = true} : key_;
    if (check.damaged_tasks.empty()) return forereach::ChannelsOf({directory_.PathOf(run.log_file)}, config_, key);
    Config task = config_.empty() ? Config() : LoadConfig(config_, TransitionsFile::kIgnore);
    key.Override(task, config_);
    return task.bus;
  }

  [[nodiscard]] Interpreter InterpreterOf(const RunRow& run, const BusOptions& channels, RowGrounds& grounds) {
    auto before = states_.extract(run.continues);
    if (!before) return {channels, run.log_file, PublicKeysOf(channels)};
    grounds.lossy.merge(before.mapped().lossy);
    before.mapped().interpreter.Continue(run.log_file);
    return std::move(before.mapped().interpreter);
  }

  const LogDirectory directory_;
  const KeptTasks kept_;
  Database database_;
  const std::string& config_;
  const LogKey& key_;
  std::map<std::string, RowState> states_;  // by log file
};

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
  add(std::ssize(check.rows), "rows other than their events say");
  add(check.damage.places, "damaged places");
  add(check.cut_bytes, "bytes of a cut tail");
  return text + (check.ended ? "" : ", not ended");
}

std::string More(std::size_t count) {
  return count > kMaxListed ? fmt::format(" and {} more", count - kMaxListed) : "";
}

void List(std::string& text, const std::vector<std::int64_t>& events, const char* what) {
  if (events.empty()) return;
  const auto shown = static_cast<std::ptrdiff_t>(std::min(events.size(), kMaxListed));
  text += fmt::format("  {}: event {}{}\n", what, fmt::join(events.begin(), events.begin() + shown, ", "),
                      More(events.size()));
}

void ListRows(std::string& text, const std::vector<std::string>& rows) {
  for (std::size_t i = 0; i < std::min(rows.size(), kMaxListed); ++i) text += fmt::format("  row: {}\n", rows[i]);
  if (rows.size() > kMaxListed) text += fmt::format("  row:{}\n", More(rows.size()));
}

}  // namespace

bool LogCheck::whole_log() const {
  if (log != Log::kThere) return log == Log::kDeleted;
  return changed.empty() && missing.empty() && rows.empty() && damaged_tasks.empty() && damage.places == 0 &&
         (cut_bytes == 0 || !ended);
}

std::vector<LogCheck> CheckLogs(const std::string& path, const std::string& config, const LogKey& key) {
  const std::string file = (std::filesystem::path(path) / LogDirectory::kDatabase).string();
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error))
    throw LogError(fmt::format("{}: is a file; name the logger's directory, in which it lies", path));
  if (!std::filesystem::is_directory(path, error)) throw LogError(fmt::format("{}: there is no such directory", path));
  if (!std::filesystem::is_regular_file(file, error))
    throw LogError(fmt::format("{}: is no logger's directory: no decision database: {}", path, file));
  if (KindOf(file) != FileKind::kDatabase) throw LogError(fmt::format("{}: is no decision database", file));
  return DirectoryCheck(path, file, config, key).CheckAll();
}

std::string ToText(const std::vector<LogCheck>& checks) {
  std::string text;
  for (const LogCheck& check : checks) {
    text += fmt::format("{}: {}\n", Printable(check.log_file), DescribeCheck(check));
    if (check.log != LogCheck::Log::kThere) continue;
    List(text, check.changed, "changed");
    List(text, check.missing, "missing");
    ListRows(text, check.rows);
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
                    {"rows", check.rows},
                    {"damaged_tasks", check.damaged_tasks},
                    {"damage", {{"places", check.damage.places}, {"bytes", check.damage.bytes}}},
                    {"cut_bytes", check.cut_bytes}});
  return list;
}

}  // namespace forereach
