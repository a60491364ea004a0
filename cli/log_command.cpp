#include <ctime>
#include <iostream>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "lcmtypes/names.h"
#include "lcmtypes/printable.h"
#include "records/log_edit.h"
#include "task/json_text.h"

namespace forereach {
namespace {

constexpr int kPlacesShown = 20;

struct LogArguments {
  std::string action, output;
  std::vector<std::string> logs;
  LogSelection selection;
  bool json = false;
};

// In UTC, with microseconds. The clock of a hostile log may be anywhere.
std::string Date(std::int64_t utime) {
  const std::time_t seconds = utime / 1'000'000;
  std::tm date{};
  char text[32];
  if (!::gmtime_r(&seconds, &date) || std::strftime(text, sizeof text, "%FT%T", &date) == 0)
    return std::to_string(utime);
  return fmt::format("{}.{:06}", text, utime % 1'000'000);
}

// Says where a log is damaged, the first times, and counts in any case.
class DamageReport final {
 public:
  void operator()(const DamagedPlace& place) {
    if (++places_ > kPlacesShown) return;
    std::cerr << "forereach: " << Printable(place.log) << ": "
              << (place.is_cut ? "ends within a record: the last " : "damaged: ") << place.bytes << " bytes "
              << (place.is_cut ? "" : "are no record, ") << "from byte " << place.offset << " on" << std::endl;
  }
  ~DamageReport() {
    if (places_ > kPlacesShown) std::cerr << "forereach: and " << places_ - kPlacesShown << " places more" << std::endl;
  }

 private:
  std::int64_t places_ = 0;
};

int Finish(const LogEditResult& result, const std::string& what, std::ostream& out) {
  out << what << result.chosen << " of " << result.events << " events";
  if (result.damage.places > 0)
    out << "; " << result.damage.bytes << " bytes in " << result.damage.places << " damaged places are left out";
  if (result.cut_ends > 0) out << "; " << result.cut_ends << " logs end within a record";
  out << std::endl;
  return result.damage.places == 0 && result.cut_ends == 0 ? 0 : 1;
}

int List(const LogArguments& options) {
  LogUser user;
  DamageReport report;
  user.on_damage = [&](const DamagedPlace& place) { report(place); };
  if (!options.json)
    std::cout << "time                        event  channel           type                  plan  what\n";
  user.on_event = [&](const LogEvent& event, const std::optional<MessageSummary>& summary, const std::string& log) {
    const std::string_view type = summary ? summary->type : "unknown", what = summary ? summary->what : "";
    const std::optional<std::int64_t> plan = summary ? summary->plan_id : std::nullopt;
    if (options.json) {
      using Ordered = nlohmann::ordered_json;
      const Ordered line{{"log", Printable(log)},
                         {"event_number", event.number},
                         {"utime", event.utime},
                         {"channel", Printable(event.channel)},
                         {"type", summary ? Ordered(type) : Ordered(nullptr)},
                         {"plan_id", plan ? Ordered(*plan) : Ordered(nullptr)},
                         {"what", what.empty() ? Ordered(nullptr) : Ordered(what)},
                         {"bytes", event.data.size()}};
      std::cout << JsonText(line) << '\n';
      return;
    }
    std::cout << fmt::format("{} {:>6}  {:<17} {:<21}{:>4}  {}\n", Date(event.utime), event.number,
                             Printable(event.channel), type, plan ? std::to_string(*plan) : "-", what);
  };
  const LogEditResult result = ReadLogs(options.logs, options.selection, LogSequence::kAsNamed, user);
  return Finish(result, "log: ", options.json ? std::cerr : std::cout);
}

int Write(const LogArguments& options) {
  DamageReport report;
  const LogEditResult result = WriteLog(options.logs, options.selection,
                                        options.action == "merge" ? LogSequence::kByTime : LogSequence::kAsNamed,
                                        options.output, [&](const DamagedPlace& place) { report(place); });
  return Finish(result, fmt::format("log: wrote {}: ", options.output), std::cout);
}

int RunLog(LogArguments options) {
  const bool writes = options.action != "list";
  if (writes == options.output.empty())
    throw LogError(writes ? fmt::format("log {}: name the new log with --out FILE", options.action)
                          : "log list: writes no --out");
  if (writes && options.json) throw LogError(fmt::format("log {}: --json is for log list", options.action));
  options.selection.drops_others = options.action == "list" || options.action == "filter";
  return writes ? Write(options) : List(options);
}

std::vector<std::string> OutcomeNames() {
  std::vector<std::string> names;
  for (std::int16_t outcome = 1; OutcomeName(outcome) != OutcomeName(0); ++outcome)
    names.emplace_back(OutcomeName(outcome));
  return names;
}

}  // namespace

Command LogCommand() {
  const auto options = std::make_shared<LogArguments>();
  return {
      .name = "log",
      .footer =
          "list    a line for each event: time (UTC), number, channel, type, plan, and its outcome, kind or cause\n"
          "filter  the chosen events, in the order of the logs named, into a new log\n"
          "cut     the same; with --outcome it keeps what is not about a plan, so that the new log can be replayed\n"
          "merge   as cut, by time; events of one log keep their order\n\n"
          "Times, bytes and signatures stay as they are. Event numbers stay if one log is cut; those of several are "
          "counted anew.\nA TIME is microseconds since the Unix epoch, 2026-01-01T12:00:00 (UTC), or +SECONDS after "
          "the first event.\n\n"
          "Examples:\n"
          "  forereach log list run/log/events-*.lcmlog --channel PLAN_DECISION\n"
          "  forereach log filter run/log/events-*.lcmlog --outcome abstain_safety -o refused.lcmlog\n"
          "  forereach log cut run/log/events-20260101-120000-000000.lcmlog --from +10 --to +20 -o part.lcmlog\n"
          "  forereach log merge robot.lcmlog camera.lcmlog -o both.lcmlog",
      .options = {Required(OneOf({"list", "filter", "cut", "merge"}, {"action", &options->action, "", "What to do"})),
                  Required({"logs", &options->logs, "LOG", "LCM event logs"}),
                  {"--from", &options->selection.from, "TIME", "Events from this time on"},
                  {"--to", &options->selection.to, "TIME", "Events before this time"},
                  {"--channel", &options->selection.channels, "NAME", "Events of this channel; may be repeated"},
                  OneOf(OutcomeNames(), {"--outcome", &options->selection.outcome, "",
                                         "Candidates, decisions and certified plans of plans with this outcome only; "
                                         "cut and merge keep all other messages"}),
                  {"-o,--out", &options->output, "FILE", "The new log; list has none"},
                  JsonFlag(options->json, "For list: a JSON object a line")},
      .run = [options] { return RunLog(*options); }};
}

}  // namespace forereach
