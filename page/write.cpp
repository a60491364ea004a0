#include "page/write.h"

#include <algorithm>
#include <map>
#include <utility>

#include "certifier/task/json_text.h"
#include "lcmtypes/printable.h"
#include "page/assets.h"
#include "page/columns.h"
#include "records/outlines.h"

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

// For a page, which has data between tags: no tag begins in it.
std::string ForPage(const Json& json) {
  const std::string text = JsonText(json);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) c == '<' ? safe += "\\u003c" : safe += c;
  return safe;
}

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
    bytes += Printable(of(row)) + "\n";
    return bytes.size();
  });
  return {{"type", "text"}, {"data", Packed(bytes)}, {"ends", std::move(ends)}};
}

// Digests are 64 hexadecimal digits; what is none becomes zeros.
std::string BytesOf(const std::string& hex) {
  const auto value = [](char c) { return '0' <= c && c <= '9' ? c - '0' : 'a' <= c && c <= 'f' ? c - 'a' + 10 : -1; };
  std::string bytes(32, '\0');
  if (hex.size() != 64 || std::ranges::any_of(hex, [&](char c) { return value(c) < 0; })) return bytes;
  for (std::size_t i = 0; i < 32; ++i) bytes[i] = static_cast<char>(value(hex[2 * i]) << 4 | value(hex[2 * i + 1]));
  return bytes;
}

template <class Row, class Of>
Json DigestColumn(const std::vector<Row>& rows, const Of& of) {
  std::string bytes;
  for (const Row& row : rows) bytes += BytesOf(of(row));
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
  for (const char* name : {"sequence", "coordinate", "first", "second", "message", "digest", "log", "event", "model",
                           "declaration", "observations", "obstacles"})
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

Json ObstacleJson(const Obstacle& obstacle) {
  Json json{{"radius", obstacle.radius()}};
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace) {
    json["normal"] = std::vector(obstacle.points()[0].begin(), obstacle.points()[0].end());
    json["offset"] = obstacle.offset();
  } else {
    std::vector<Eigen::Vector2d> corners;
    for (const Eigen::Vector3d& corner : obstacle.hull()) corners.push_back(corner.head<2>());
    Json points = Json::array();
    for (const Eigen::Vector2d& corner : HullOf(corners)) points.push_back({corner.x(), corner.y()});
    json["points"] = std::move(points);
  }
  if (const auto& motion = obstacle.motion())
    json["motion"] = {{"stamp", motion->stamp_us},          {"velocity", {motion->velocity.x(), motion->velocity.y()}},
                      {"uncertainty", motion->uncertainty}, {"growth", motion->growth},
                      {"growth_rate", motion->growth_rate}, {"from", motion->from_us},
                      {"until", motion->until_us}};
  return json;
}

Json ObstacleSetsJson(const std::vector<std::vector<Obstacle>>& sets) {
  Json all = Json::array();
  for (const std::vector<Obstacle>& set : sets) {
    Json json = Json::array();
    for (const Obstacle& obstacle : set) json.push_back(obstacle.dim() == 2 ? ObstacleJson(obstacle) : Json());
    all.push_back(std::move(json));
  }
  return all;
}

Json DetailJson(const PageDetail& detail) {
  Json executed = Json::array();
  for (const PageState& state : detail.executed) executed.push_back({state.step, state.x, state.y});
  return {{"row", detail.decision},
          {"missing", Printable(detail.missing)},
          {"task", detail.task},
          {"obstacles", detail.obstacles},
          {"start", detail.start_utime},
          {"step_us", detail.step_us},
          {"steps", detail.steps},
          {"binding", detail.binding},
          {"part", detail.part},
          {"hull", {detail.hull_lower, detail.hull_upper}},
          {"envelope", {detail.envelope_lower, detail.envelope_upper}},
          {"executed", std::move(executed)},
          {"units", detail.sketch.parts.size()},
          {"grid", {detail.sketch.x, detail.sketch.y, detail.sketch.quantum}}};
}

template <class Number>
Json Joined(const std::vector<PageDetail>& details, std::vector<Number> Sketch::*member) {
  std::vector<Number> all;
  for (const PageDetail& detail : details)
    all.insert(all.end(), (detail.sketch.*member).begin(), (detail.sketch.*member).end());
  return Column(all);
}

Json DrawingsJson(const PageRun& run) {
  Json details = Json::array();
  for (const PageDetail& detail : run.details) details.push_back(DetailJson(detail));
  const Json texts{{"details", std::move(details)}, {"obstacle_sets", ObstacleSetsJson(run.obstacle_sets)}};
  return {{"texts", Packed(JsonText(texts))},
          {"parts", Joined(run.details, &Sketch::parts)},
          {"corners", Joined(run.details, &Sketch::corners)},
          {"points", Joined(run.details, &Sketch::points)}};
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
            {"files", TextsJson(run.files)},
            {"notes", TextsJson(run.notes)},
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

std::string PolicyHash(const PageAsset& asset) { return "'sha256-" + Base64(BytesOf(std::string(asset.sha256))) + "'"; }

}  // namespace

std::string PageHtml(const PageRun& run, const PageRun* before) {
  Json data{{"run", RunJson(run, false)}};
  if (before) data["before"] = RunJson(*before, true);
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; base-uri 'none'; form-action 'none'; "
      "img-src data:; style-src ";
  html += PolicyHash(kPageStyle) + "; script-src " + PolicyHash(kChartScript) + " " + PolicyHash(kPageScript) + "\">\n";
  html +=
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>ForeReach "
      "report</title>\n<style>";
  html += kPageStyle.text;
  html += "</style>\n</head>\n";
  html += kPageBody.text;
  html += "<script type=\"application/json\" id=\"data\">" + ForPage(data) + "</script>\n<script>";
  html += kChartScript.text;
  html += "</script>\n<script>";
  html += kPageScript.text;
  html += "</script>\n</body>\n</html>\n";
  return html;
}

}  // namespace forereach
