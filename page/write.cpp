#include "page/write.h"

#include <algorithm>
#include <functional>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "forereach/certify/explain.h"
#include "lcmtypes/printable.h"
#include "page/detail.h"
#include "page/document.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

// Texts by numbers, in the order of their first appearance.
class Dictionary {
 public:
  std::uint32_t operator()(const std::string& text) {
    const auto [found, is_new] = number_of_.try_emplace(text, static_cast<std::uint32_t>(texts_.size()));
    if (is_new) texts_.push_back(Printable(text));
    return found->second;
  }
  [[nodiscard]] const Json& texts() const { return texts_; }

 private:
  std::map<std::string, std::uint32_t> number_of_;
  Json texts_ = Json::array();
};

Json NamesColumn(const auto& rows, const auto& of) {
  Dictionary dictionary;
  Json column = ColumnOf<std::uint32_t>(rows, [&](const auto& row) { return dictionary(std::invoke(of, row)); });
  column["names"] = dictionary.texts();
  return column;
}

// Texts that are mostly different: their bytes, and where each ends.
Json TextColumn(const auto& rows, const auto& of) {
  Packer bytes;
  std::size_t end = 0;
  Json ends = ColumnOf<std::uint32_t>(rows, [&](const auto& row) {
    const std::string text = Printable(std::invoke(of, row)) + "\n";
    bytes.Add(text);
    return end += text.size();
  });
  return {{"type", "text"}, {"data", bytes.Finish()}, {"ends", std::move(ends)}};
}

Json DigestColumn(const auto& rows, const auto& of) {
  Packer bytes;
  for (const auto& row : rows) bytes.Add(BytesOf(std::invoke(of, row)));
  return {{"type", "u8"}, {"data", bytes.Finish()}};
}

// Of each row the place of its run. Rows behind those that are counted are the last run's.
Json RunColumn(const PageRun& run, std::size_t PagePart::*count, std::size_t rows) {
  std::vector<std::uint32_t> places;
  for (std::size_t k = 0; k < run.parts.size(); ++k)
    places.insert(places.end(), run.parts[k].*count, static_cast<std::uint32_t>(k));
  places.resize(rows, places.empty() ? 0 : places.back());
  return Column(places);
}

// The robot of each decision by its number, and the names.
Json RobotColumn(const PageRun& run) {
  Dictionary dictionary;
  std::vector<std::uint32_t> robots;
  for (const PagePart& part : run.parts) robots.insert(robots.end(), part.decisions, dictionary(part.robot));
  if (run.parts.empty()) static_cast<void>(dictionary(""));
  robots.resize(run.decisions.size(), robots.empty() ? 0 : robots.back());
  Json column = Column(robots);
  column["names"] = dictionary.texts();
  return column;
}

std::string ObstacleText(const PageDecision& row) {
  std::string name = row.obstacle < 0 ? "" : ObstacleNamedIn(row.message);
  return row.obstacle < 0 || !name.empty() ? name : std::to_string(row.obstacle);
}

Json DecisionsJson(const PageRun& run) {
  const auto& rows = run.decisions;
  using Row = PageDecision;
  const auto ground = [](std::size_t i) { return [i](const Row& row) { return ToHex(row.grounds[i]); }; };
  return {{"run", RunColumn(run, &PagePart::decisions, rows.size())},
          {"robot", RobotColumn(run)},
          {"utime", ColumnOf<std::int64_t>(rows, &Row::utime)},
          {"plan", ColumnOf<std::int64_t>(rows, &Row::plan_id)},
          {"sequence", ColumnOf<std::int64_t>(rows, &Row::sequence)},
          {"source", NamesColumn(rows, &Row::source)},
          {"outcome", NamesColumn(rows, &Row::outcome)},
          {"cause", NamesColumn(rows, &Row::cause)},
          {"step", ColumnOf<std::int32_t>(rows, &Row::step)},
          {"coordinate", ColumnOf<std::int32_t>(rows, &Row::coordinate)},
          {"obstacle", NamesColumn(rows, ObstacleText)},
          {"first", ColumnOf<std::int32_t>(rows, &Row::first_observation)},
          {"second", ColumnOf<std::int32_t>(rows, &Row::second_observation)},
          {"margin", ColumnOf<double>(rows, &Row::margin)},
          {"threshold", ColumnOf<double>(rows, &Row::threshold)},
          {"elapsed", ColumnOf<float>(rows, &Row::elapsed_us)},
          {"latency", ColumnOf<float>(rows, &Row::latency_us)},
          {"message", TextColumn(rows, &Row::message)},
          {"digest", DigestColumn(rows, &Row::plan_digest)},
          {"log", NamesColumn(rows, &Row::log_file)},
          {"event", ColumnOf<std::int64_t>(rows, &Row::event_number)},
          {"config", NamesColumn(rows, ground(0))},
          {"model", NamesColumn(rows, ground(1))},
          {"declaration", NamesColumn(rows, ground(2))},
          {"observations", NamesColumn(rows, ground(3))},
          {"obstacles", NamesColumn(rows, ground(4))}};
}

// What the figures need.
Json FiguresJson(const PageRun& run) {
  Json all = DecisionsJson(run);
  for (const char* name : {"sequence", "coordinate", "first", "second", "margin", "threshold", "message", "digest",
                           "log", "event", "model", "declaration", "observations", "obstacles"})
    all.erase(name);
  return all;
}

Json EventsJson(const PageRun& run) {
  const auto& rows = run.events;
  return {{"run", RunColumn(run, &PagePart::events, rows.size())},
          {"utime", ColumnOf<std::int64_t>(rows, &PageEvent::utime)},
          {"plan", ColumnOf<std::int64_t>(rows, &PageEvent::plan_id)},
          {"kind", NamesColumn(rows, &PageEvent::kind)}};
}

Json GapsJson(const PageRun& run) {
  const auto& rows = run.gaps;
  return {
      {"run", RunColumn(run, &PagePart::gaps, rows.size())},  {"utime", ColumnOf<std::int64_t>(rows, &PageGap::utime)},
      {"lost", ColumnOf<std::int64_t>(rows, &PageGap::lost)}, {"reason", NamesColumn(rows, &PageGap::reason)},
      {"channel", NamesColumn(rows, &PageGap::channel)},      {"source", NamesColumn(rows, &PageGap::source)}};
}

Json FaultsJson(const PageRun& run) {
  const auto& rows = run.faults;
  return {{"run", RunColumn(run, &PagePart::faults, rows.size())},
          {"utime", ColumnOf<std::int64_t>(rows, &PageFault::utime)},
          {"plan", ColumnOf<std::int64_t>(rows, &PageFault::plan_id)},
          {"kind", NamesColumn(rows, &PageFault::cause)},
          {"message", TextColumn(rows, &PageFault::message)}};
}

Json WithdrawalsJson(const PageRun& run) {
  const auto& rows = run.withdrawals;
  return {{"run", RunColumn(run, &PagePart::withdrawals, rows.size())},
          {"utime", ColumnOf<std::int64_t>(rows, &PageWithdrawal::utime)},
          {"plan", ColumnOf<std::int64_t>(rows, &PageWithdrawal::plan_id)},
          {"steps", ColumnOf<std::int32_t>(rows, &PageWithdrawal::valid_steps)},
          {"source", NamesColumn(rows, &PageWithdrawal::source)},
          {"kind", NamesColumn(rows, &PageWithdrawal::cause)},
          {"message", TextColumn(rows, &PageWithdrawal::message)}};
}

Json TextsJson(const std::vector<std::string>& texts) {
  Json all = Json::array();
  for (const std::string& text : texts) all.push_back(Printable(text));
  return all;
}

// With what the page has not, since there is more than it can hold.
Json NotesJson(const PageRun& run) {
  Json all = TextsJson(run.notes);
  const auto note = [&](const auto& rows, const char* what) {
    if (rows.left_out > 0)
      all.push_back(fmt::format("Of {} {} the last {} are on this page.",
                                rows.left_out + static_cast<std::int64_t>(rows.size()), what, rows.size()));
  };
  note(run.decisions, "decisions");
  note(run.events, "events of robots");
  note(run.gaps, "gaps");
  note(run.faults, "faults");
  note(run.withdrawals, "withdrawals");
  return all;
}

Json TasksJson(const std::vector<PageTask>& tasks) {
  Json all = Json::array();
  for (const PageTask& task : tasks)
    all.push_back({{"digest", task.config_digest},
                   {"name", Printable(task.name)},
                   {"states", TextsJson(task.states)},
                   {"inputs", TextsJson(task.inputs)},
                   {"holds", task.holds},
                   {"parts", task.parts}});
  return all;
}

// ---- Drawings.

Json ToJson(const PageAdvice& advice) {
  Json groups = Json::array();
  for (const PageAdvice::Group& group : advice.groups)
    groups.push_back({Printable(group.heading), group.is_folded, TextsJson(group.clauses)});
  return {{"row", advice.decision}, {"missing", Printable(advice.missing)}, {"groups", std::move(groups)}};
}

Json DrawingsJson(const PageRun& run) {
  Json details = Json::array();
  for (const PageDetail& detail : run.details) details.push_back(ToJson(detail));
  Json advice = Json::array();
  for (const PageAdvice& each : run.advice) advice.push_back(ToJson(each));
  const Json texts{{"details", std::move(details)}, {"advice", std::move(advice)}};
  return {{"texts", {{"type", "json"}, {"data", Packed(JsonText(texts))}}},
          {"svg", TextColumn(run.details, &PageDetail::svg)}};
}

Json RunsJson(const PageRun& run, bool only_figures) {
  Json all = Json::array();
  for (const PagePart& part : run.parts) {
    Json json{{"robot", Printable(part.robot)}};
    if (!only_figures)
      for (const auto& [log, command] : part.replays) json["replays"][Printable(log)] = Printable(command);
    all.push_back(std::move(json));
  }
  return all;
}

Json RunJson(const PageRun& run, bool only_figures) {
  Json json{{"name", Printable(run.name)},
            {"notes", NotesJson(run)},
            {"shadow", Printable(run.shadow)},
            {"tasks", TasksJson(run.tasks)},
            {"damaged_places", run.damage.places},
            {"count", run.decisions.size()},
            {"decisions", only_figures ? FiguresJson(run) : DecisionsJson(run)},
            {"events", EventsJson(run)},
            {"gaps", GapsJson(run)},
            {"faults", FaultsJson(run)},
            {"withdrawals", WithdrawalsJson(run)},
            {"runs", RunsJson(run, only_figures)}};
  if (!only_figures) json["drawings"] = DrawingsJson(run);
  return json;
}

}  // namespace

std::string PageHtml(const PageRun& run, const PageRun* before) {
  Json data{{"run", RunJson(run, false)}};
  if (before) data["before"] = RunJson(*before, true);
  return PageDocument{.title = "ForeReach report",
                      .body = kPageBody,
                      .styles = {&kPageStyle},
                      .scripts = {&kChartScript, &kSharedScript, &kPageScript}}
      .Html(std::move(data));
}

}  // namespace forereach
