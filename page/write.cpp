#include "page/write.h"

#include <algorithm>
#include <functional>
#include <map>
#include <utility>

#include "lcmtypes/printable.h"
#include "page/columns.h"
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

template <class Row, class Of>
Json NamesColumn(const std::vector<Row>& rows, const Of& of) {
  Dictionary dictionary;
  Json column = ColumnOf<std::uint32_t>(rows, [&](const Row& row) { return dictionary(of(row)); });
  column["names"] = dictionary.texts();
  return column;
}

// Texts that are mostly different: their bytes, and where each ends.
template <class Row, class Of>
Json TextColumn(const std::vector<Row>& rows, const Of& of) {
  std::string bytes;
  Json ends = ColumnOf<std::uint32_t>(rows, [&](const Row& row) {
    bytes += Printable(std::invoke(of, row)) + "\n";
    return bytes.size();
  });
  return {{"type", "text"}, {"data", Packed(bytes)}, {"ends", std::move(ends)}};
}

template <class Row, class Of>
Json DigestColumn(const std::vector<Row>& rows, const Of& of) {
  std::string bytes;
  for (const Row& row : rows) bytes += DigestBytes(of(row));
  return {{"type", "u8"}, {"data", Packed(bytes)}};
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

Json DecisionsJson(const PageRun& run) {
  const std::vector<DecisionRow>& rows = run.decisions;
  const auto of = [](auto member) { return [member](const DecisionRow& row) { return row.*member; }; };
  const auto ground = [](std::size_t i) { return [i](const DecisionRow& row) { return row.grounds[i]; }; };
  return {{"run", RunColumn(run, &PagePart::decisions, rows.size())},
          {"robot", RobotColumn(run)},
          {"utime", ColumnOf<std::int64_t>(rows, of(&DecisionRow::utime))},
          {"plan", ColumnOf<std::int64_t>(rows, of(&DecisionRow::plan_id))},
          {"sequence", ColumnOf<std::int64_t>(rows, of(&DecisionRow::sequence))},
          {"source", NamesColumn(rows, of(&DecisionRow::source))},
          {"outcome", NamesColumn(rows, of(&DecisionRow::outcome))},
          {"cause", NamesColumn(rows, of(&DecisionRow::cause))},
          {"step", ColumnOf<std::int32_t>(rows, of(&DecisionRow::step))},
          {"coordinate", ColumnOf<std::int32_t>(rows, of(&DecisionRow::coordinate))},
          {"obstacle", ColumnOf<std::int32_t>(rows, of(&DecisionRow::obstacle))},
          {"first", ColumnOf<std::int32_t>(rows, of(&DecisionRow::first_observation))},
          {"second", ColumnOf<std::int32_t>(rows, of(&DecisionRow::second_observation))},
          {"margin", ColumnOf<double>(rows, of(&DecisionRow::margin))},
          {"threshold", ColumnOf<double>(rows, of(&DecisionRow::threshold))},
          {"elapsed", ColumnOf<float>(rows, of(&DecisionRow::elapsed_us))},
          {"latency", ColumnOf<float>(rows, of(&DecisionRow::latency_us))},
          {"message", TextColumn(rows, of(&DecisionRow::message))},
          {"digest", DigestColumn(rows, of(&DecisionRow::plan_digest))},
          {"log", NamesColumn(rows, [](const DecisionRow& row) { return row.event.log_file; })},
          {"event", ColumnOf<std::int64_t>(rows, [](const DecisionRow& row) { return row.event.event_number; })},
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

Json EventsJson(const std::vector<EventRow>& rows) {
  return {{"utime", ColumnOf<std::int64_t>(rows, [](const EventRow& row) { return row.utime; })},
          {"plan", ColumnOf<std::int64_t>(rows, [](const EventRow& row) { return row.plan_id; })},
          {"kind", NamesColumn(rows, [](const EventRow& row) { return row.kind; })}};
}

Json GapsJson(const std::vector<GapRow>& rows) {
  return {{"utime", ColumnOf<std::int64_t>(rows, [](const GapRow& row) { return row.utime; })},
          {"lost", ColumnOf<std::int64_t>(rows, [](const GapRow& row) { return row.lost; })},
          {"reason", NamesColumn(rows, [](const GapRow& row) { return row.reason; })},
          {"channel", NamesColumn(rows, [](const GapRow& row) { return row.channel; })},
          {"source", NamesColumn(rows, [](const GapRow& row) { return row.source; })}};
}

Json FaultsJson(const std::vector<PageFault>& rows) {
  return {{"utime", ColumnOf<std::int64_t>(rows, [](const PageFault& row) { return row.utime; })},
          {"plan", ColumnOf<std::int64_t>(rows, [](const PageFault& row) { return row.plan_id; })},
          {"kind", NamesColumn(rows, [](const PageFault& row) { return row.cause; })},
          {"message", TextColumn(rows, [](const PageFault& row) { return row.message; })}};
}

Json WithdrawalsJson(const std::vector<PageWithdrawal>& rows) {
  return {{"utime", ColumnOf<std::int64_t>(rows, [](const PageWithdrawal& row) { return row.utime; })},
          {"plan", ColumnOf<std::int64_t>(rows, [](const PageWithdrawal& row) { return row.plan_id; })},
          {"steps", ColumnOf<std::int32_t>(rows, [](const PageWithdrawal& row) { return row.valid_steps; })},
          {"source", NamesColumn(rows, [](const PageWithdrawal& row) { return row.source; })},
          {"kind", NamesColumn(rows, [](const PageWithdrawal& row) { return row.cause; })},
          {"message", TextColumn(rows, [](const PageWithdrawal& row) { return row.message; })}};
}

Json TextsJson(const std::vector<std::string>& texts) {
  Json all = Json::array();
  for (const std::string& text : texts) all.push_back(Printable(text));
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
            {"notes", TextsJson(run.notes)},
            {"shadow", Printable(run.shadow)},
            {"tasks", TasksJson(run.tasks)},
            {"damaged_places", run.damage.places},
            {"count", run.decisions.size()},
            {"decisions", only_figures ? FiguresJson(run) : DecisionsJson(run)},
            {"events", EventsJson(run.events)},
            {"gaps", GapsJson(run.gaps)},
            {"faults", FaultsJson(run.faults)},
            {"withdrawals", WithdrawalsJson(run.withdrawals)}};
  json["events"]["run"] = RunColumn(run, &PagePart::events, run.events.size());
  json["gaps"]["run"] = RunColumn(run, &PagePart::gaps, run.gaps.size());
  json["faults"]["run"] = RunColumn(run, &PagePart::faults, run.faults.size());
  json["withdrawals"]["run"] = RunColumn(run, &PagePart::withdrawals, run.withdrawals.size());
  json["runs"] = RunsJson(run, only_figures);
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
