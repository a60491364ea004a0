#include "fleet/report.h"

#include <algorithm>
#include <array>
#include <set>
#include <sstream>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forereach/numerics/size.h"
#include "lcmtypes/printable.h"
#include "task/json_text.h"

namespace forereach {
namespace {

constexpr int kMostRows = 1000;  // of a table

constexpr const char* kGroups = R"sql(
  WITH groups AS MATERIALIZED (
    SELECT robot, log_file, declaration_digest, outcome, cause, event_utime / 86400000000 AS day, shadow, count(*) AS n,
           min(event_number) AS event, min(event_utime) AS first, max(event_utime) AS last
    FROM decisions GROUP BY 1, 2, 3, 4, 5, 6, 7),
  withdrawn AS MATERIALIZED (
    SELECT robot, log_file, count(*) AS n, min(event_number) AS event FROM execution_events WHERE kind = 'withdrawn'
    GROUP BY 1, 2),
  runs_of AS (
    SELECT robot, log_file, sum(n) AS n, coalesce(sum(n) FILTER (WHERE outcome = 'certified'), 0) AS certified,
           coalesce(sum(n) FILTER (WHERE shadow = 1), 0) AS shadow,
           coalesce(sum(n) FILTER (WHERE outcome = 'abstain_falsified'), 0) AS contradictions
    FROM groups GROUP BY 1, 2),
  declared AS (
    SELECT robot, declaration_digest, sum(n) AS n, coalesce(sum(n) FILTER (WHERE outcome = 'certified'), 0) AS certified,
           coalesce(sum(n) FILTER (WHERE outcome = 'abstain_falsified'), 0) AS contradictions, max(last) AS last,
           max(last) = max(max(last)) OVER (PARTITION BY robot) AS in_force
    FROM groups GROUP BY 1, 2),
  days_of AS (
    SELECT robot, day, round(100 * coalesce(sum(n) FILTER (WHERE outcome = 'certified'), 0) / sum(n), 1) AS share,
           row_number() OVER (PARTITION BY robot ORDER BY day DESC) AS back
    FROM groups WHERE day BETWEEN 0 AND 100000 GROUP BY 1, 2),
  trends AS (
    SELECT robot, string_agg(share::TEXT, ' ' ORDER BY day) AS trend FROM days_of WHERE back <= 30 GROUP BY 1)
)sql";

constexpr const char* kTrend = "certified % by day";
constexpr const char* kShadow = "shadow";  // decisions that were made in shadow mode

// Whose numbers lead to runs.
constexpr std::array<std::string_view, 9> kNumbers = {
    "decisions", "certified %", kShadow, "contradictions", "withdrawals", "runs", "%", "robots", "in force on"};

// Each gives rows of values in the order of its columns, and all runs of a row, or null.
struct TableQuery {
  const char* title;
  std::vector<std::string> columns;
  const char* sql;
};

const std::vector<TableQuery>& Queries() {
  static const std::vector<TableQuery> queries{
      {"Robots",
       {"robot", "decisions", "certified %", kShadow, "contradictions", "withdrawals", "runs", kTrend, "log"},
       R"sql(SELECT r.robot, sum(r.n), round(100 * sum(certified) / sum(r.n), 1), sum(shadow), sum(contradictions),
             coalesce(sum(w.n), 0), count(*), min(trend), (array_agg(r.log_file ORDER BY certified / r.n))[1],
             jsonb_agg(DISTINCT jsonb_build_array(r.robot, r.log_file))
             FROM runs_of r LEFT JOIN withdrawn w USING (robot, log_file) LEFT JOIN trends USING (robot)
             GROUP BY 1 ORDER BY 3, 1)sql"},
      {"Causes",
       {"outcome", "cause", "decisions", "%", "robots", "robot", "log", "event"},
       R"sql(SELECT outcome, cause, sum(n), round(100 * sum(n) / sum(sum(n)) OVER (), 1), count(DISTINCT robot),
             (array_agg(robot ORDER BY n DESC, robot, log_file))[1],
             (array_agg(log_file ORDER BY n DESC, robot, log_file))[1],
             (array_agg(event ORDER BY n DESC, robot, log_file))[1],
             jsonb_agg(DISTINCT jsonb_build_array(robot, log_file)) FROM groups GROUP BY 1, 2 ORDER BY 3 DESC, 1, 2)sql"},
      {"Contradictions",
       {"declaration", "decisions", "robot", "log", "event"},
       R"sql(SELECT left(declaration_digest, 12), sum(n), robot, log_file, min(event), NULL::JSONB FROM groups
             WHERE outcome = 'abstain_falsified' GROUP BY declaration_digest, robot, log_file ORDER BY 2 DESC, 3, 4)sql"},
      {"Withdrawals",
       {"withdrawals", "robot", "log", "event"},
       R"sql(SELECT n, robot, log_file, event, NULL::JSONB FROM withdrawn ORDER BY 1 DESC, 2, 3)sql"},
      {"Declarations",
       {"declaration", "in force on", "robots", "decisions", "certified %", "contradictions", "until", "robot"},
       R"sql(SELECT left(declaration_digest, 12), count(*) FILTER (WHERE in_force), count(*), sum(n),
             round(100 * sum(certified) / sum(n), 1), sum(contradictions),
             to_char(to_timestamp(max(last) / 1000000) AT TIME ZONE 'UTC', 'YYYY-MM-DD HH24:MI'), min(robot),
             (SELECT jsonb_agg(DISTINCT jsonb_build_array(g.robot, g.log_file)) FROM groups g
              WHERE g.declaration_digest = declared.declaration_digest)
             FROM declared GROUP BY declaration_digest ORDER BY 2 DESC, 4 DESC, 1)sql"},
      {"Days",
       {"day", "robots", "decisions", "certified %", "contradictions"},
       R"sql(SELECT to_char(to_timestamp(day * 86400) AT TIME ZONE 'UTC', 'YYYY-MM-DD'), count(DISTINCT robot), sum(n),
             round(100 * coalesce(sum(n) FILTER (WHERE outcome = 'certified'), 0) / sum(n), 1),
             coalesce(sum(n) FILTER (WHERE outcome = 'abstain_falsified'), 0),
             jsonb_agg(DISTINCT jsonb_build_array(robot, log_file))
             FROM groups WHERE day BETWEEN 0 AND 100000 GROUP BY day ORDER BY day DESC)sql"},
      {"Runs",
       {"robot", "log", "decisions", "certified %", kShadow, "contradictions"},
       R"sql(SELECT robot, log_file, n, round(100 * certified / n, 1), shadow, contradictions, NULL::JSONB FROM runs_of
             ORDER BY contradictions DESC, 4, 1, 2)sql"}};
  return queries;
}

std::string Escaped(const std::string& text) {
  std::string html;
  for (const char c : text) {
    const auto* const name = c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : c == '"' ? "&quot;" : nullptr;
    name ? html += name : html += c;
  }
  return html;
}

// A name as a part of an address.
std::string InAddress(const std::string& name) {
  std::string address;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.')
      address += c;
    else
      address += fmt::format("%{:02X}", static_cast<unsigned char>(c));
  return address;
}

std::size_t Find(const std::vector<std::string>& columns, const std::string& name) {
  return static_cast<std::size_t>(std::ranges::find(columns, name) - columns.begin());
}

}  // namespace

// One statement, so that all tables are of one moment and share the passes. A row comes as a list in JSON.
std::vector<FleetTable> ReadFleet(Store& store) {
  std::vector<FleetTable> tables;
  std::string sql = kGroups;
  for (const TableQuery& query : Queries()) {
    std::vector<std::string> names, texts;
    const std::string first_runs = fmt::format("jsonb_path_query_array(runs, '$[0 to {}]')", FleetTable::kMostRuns - 1);
    for (std::size_t i = 0; i < query.columns.size(); ++i) {
      names.push_back(fmt::format("c{}", i));
      texts.push_back(fmt::format("coalesce(c{}::TEXT, '')", i));
    }
    sql += fmt::format("{} (SELECT {}, json_build_array({})::TEXT, {}::TEXT FROM ({}) AS t({}, runs) LIMIT {})",
                       tables.empty() ? "" : " UNION ALL", tables.size(), fmt::join(texts, ", "), first_runs, query.sql,
                       fmt::join(names, ", "), kMostRows);
    tables.push_back({query.title, query.columns, {}, {}});
  }
  for (const Store::Values& row : store.Query(sql)) {
    FleetTable& table = tables.at(std::stoul(row.at(0).value()));
    std::vector<std::string>& cells = table.rows.emplace_back();
    for (const auto& cell : ParseJson(row.at(1).value())) cells.push_back(FromStoredText(cell.get<std::string>()));
    auto& runs = table.runs.emplace_back();
    for (const auto& run : ParseJson(row.at(2).value_or("[]")))
      runs.emplace_back(FromStoredText(run.at(0).get<std::string>()), FromStoredText(run.at(1).get<std::string>()));
  }
  return tables;
}

std::string ToText(const std::vector<FleetTable>& tables) {
  std::string text;
  for (const FleetTable& table : tables) {
    std::vector<std::size_t> widths;
    for (const std::string& column : table.columns) widths.push_back(column.size());
    for (const auto& row : table.rows)
      for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], Printable(row[i]).size());
    const auto add = [&](const std::vector<std::string>& row) {
      std::string line = " ";
      for (std::size_t i = 0; i < row.size(); ++i) line += fmt::format(" {:<{}}", Printable(row[i]), widths[i]);
      text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
    };
    text += table.title + "\n";
    add(table.columns);
    for (const auto& row : table.rows) add(row);
  }
  return text;
}

nlohmann::json ToJson(const std::vector<FleetTable>& tables) {
  nlohmann::json json = nlohmann::json::object();
  for (const FleetTable& table : tables) json[table.title] = {{"columns", table.columns}, {"rows", table.rows}};
  return json;
}

namespace {

std::string PageOf(const std::string& runs, const std::string& robot, const std::string& log) {
  return fmt::format("{}/{}/{}.html", Escaped(runs), InAddress(robot), InAddress(log));
}

// Shares by day, as a line.
std::string Sparkline(const std::string& shares) {
  std::istringstream words(shares);
  std::string points;
  int days = 0;
  for (double share = 0; words >> share; ++days) points += fmt::format("{},{:.0f} ", 4 * days, 16 - 0.15 * share);
  return fmt::format(
      "<svg width=\"{}\" height=\"17\"><title>{}</title><polyline points=\"{}\" fill=\"none\" "
      "stroke=\"#0072B2\"/></svg>",
      4 * days, Escaped(shares), points);
}

// One row, and the list of its runs where they are several.
void AddRow(const FleetTable& table, std::size_t number, const std::string& runs, std::string& rows,
            std::string& lists) {
  const std::vector<std::string>& row = table.rows[number];
  const std::size_t robot = Find(table.columns, "robot"), log = Find(table.columns, "log");
  const auto& counted = table.runs[number];
  std::string numbers;  // where they lead to
  if (runs.empty()) {
  } else if (counted.size() > 1) {
    const std::string name = fmt::format("{}-{}", table.title, number);
    numbers = "#" + name;
    lists += fmt::format("<p class=\"runs\" id=\"{}\">{}:", name, Escaped(Printable(row[0])));
    for (const auto& [of, file] : counted)
      lists += fmt::format(" <a href=\"{}\">{} {}</a>", PageOf(runs, of, file), Escaped(Printable(of)),
                           Escaped(Printable(file)));
    lists += ToSize(FleetTable::kMostRuns) == counted.size() ? " and perhaps more</p>\n" : "</p>\n";
  } else if (counted.size() == 1) {
    numbers = PageOf(runs, counted[0].first, counted[0].second);
  } else if (log < row.size()) {
    numbers = PageOf(runs, row[robot], row[log]);
  }
  rows += "<tr>";
  for (std::size_t i = 0; i < row.size(); ++i) {
    const std::string& column = table.columns[i];
    const std::string text = column == kTrend ? Sparkline(row[i]) : Escaped(Printable(row[i]));
    const std::string address = runs.empty() ? ""
                                : i == log   ? PageOf(runs, row[robot], row[log])
                                : std::ranges::find(kNumbers, column) != std::end(kNumbers) ? numbers
                                                                                            : "";
    rows += address.empty() ? fmt::format("<td>{}</td>", text)
                            : fmt::format("<td><a href=\"{}\">{}</a></td>", address, text);
  }
  rows += "</tr>\n";
}

// Whose decisions some table counts in shadow mode.
std::string ShadowsIn(const std::vector<FleetTable>& tables) {
  std::set<std::string> names;
  for (const FleetTable& table : tables) {
    const std::size_t robot = Find(table.columns, "robot"), shadow = Find(table.columns, kShadow);
    for (const auto& row : table.rows)
      if (robot < row.size() && shadow < row.size() && row[shadow] != "0") names.insert(Escaped(Printable(row[robot])));
  }
  if (names.empty()) return "<p>No gate was in shadow mode.</p>\n";
  return fmt::format(
      "<p><b>In shadow mode: {}.</b> Column <i>{}</i> counts decisions in that mode, which certify nothing; cause "
      "<i>shadow</i> are plans that would have been certified.</p>\n",
      fmt::join(names, " "), kShadow);
}

}  // namespace

std::string FleetHtml(const std::vector<FleetTable>& tables, const std::string& runs) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>ForeReach: the fleet</title>\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
      "<style>body{font:15px sans-serif;margin:2em}table{border-collapse:collapse}td,th{padding:.2em "
      ".8em;text-align:left;border-bottom:1px solid #ccc}"
      ".runs{display:none}.runs:target{display:block}</style></head><body>\n<h1>The fleet</h1>\n";
  html += runs.empty() ? "<p>With <code>--runs</code>, numbers lead to the pages of runs.</p>\n"
                       : fmt::format(
                             "<p>Numbers lead to the pages of the runs that they count. The page of a run is made by "
                             "<code>forereach report LOG --out {}/ROBOT/LOG.html</code>, with the log's name.</p>\n",
                             Escaped(runs));
  html += ShadowsIn(tables);
  for (const FleetTable& table : tables) {
    html += fmt::format("<h2>{}</h2>\n<table><tr>", table.title);
    for (const std::string& column : table.columns) html += fmt::format("<th>{}</th>", column);
    html += "</tr>\n";
    std::string lists;
    for (std::size_t i = 0; i < table.rows.size(); ++i) AddRow(table, i, runs, html, lists);
    html += "</table>\n" + lists;
    if (table.rows.size() == kMostRows) html += fmt::format("<p>The first {} rows.</p>\n", kMostRows);
  }
  return html + "</body></html>\n";
}

}  // namespace forereach
