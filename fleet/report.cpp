#include "fleet/report.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "lcmtypes/printable.h"
#include "task/json_text.h"

namespace forereach {
namespace {

constexpr int kMostRows = 1000;  // of a table

constexpr const char* kGroups = R"sql(
  WITH groups AS MATERIALIZED (
    SELECT robot, log_file, declaration_digest, outcome, cause, event_utime / 86400000000 AS day, count(*) AS n,
           min(event_number) AS event, min(event_utime) AS first, max(event_utime) AS last
    FROM decisions GROUP BY 1, 2, 3, 4, 5, 6),
  withdrawn AS MATERIALIZED (
    SELECT robot, log_file, count(*) AS n, min(event_number) AS event FROM execution_events WHERE kind = 'withdrawn'
    GROUP BY 1, 2),
  runs_of AS (
    SELECT robot, log_file, sum(n) AS n, coalesce(sum(n) FILTER (WHERE outcome = 'certified'), 0) AS certified,
           coalesce(sum(n) FILTER (WHERE outcome = 'abstain_falsified'), 0) AS contradictions,
           min(first) AS first, max(last) AS last
    FROM groups GROUP BY 1, 2),
  declared AS (
    SELECT robot, declaration_digest, sum(n) AS n, coalesce(sum(n) FILTER (WHERE outcome = 'certified'), 0) AS certified,
           coalesce(sum(n) FILTER (WHERE outcome = 'abstain_falsified'), 0) AS contradictions, max(last) AS last,
           max(last) = max(max(last)) OVER (PARTITION BY robot) AS in_force
    FROM groups GROUP BY 1, 2)
)sql";

// Each gives rows of values in the order of its columns.
struct TableQuery {
  const char* title;
  std::vector<std::string> columns;
  const char* sql;
};

const std::vector<TableQuery>& Queries() {
  static const std::vector<TableQuery> queries{
      {"Robots",
       {"robot", "decisions", "certified %", "contradictions", "withdrawals", "runs", "log"},
       R"sql(SELECT r.robot, sum(r.n), round(100 * sum(certified) / sum(r.n), 1), sum(contradictions),
             coalesce(sum(w.n), 0), count(*), (array_agg(r.log_file ORDER BY certified / r.n))[1]
             FROM runs_of r LEFT JOIN withdrawn w USING (robot, log_file) GROUP BY 1 ORDER BY 3, 1)sql"},
      {"Causes",
       {"outcome", "cause", "decisions", "%", "robots", "robot", "log", "event"},
       R"sql(SELECT outcome, cause, sum(n), round(100 * sum(n) / sum(sum(n)) OVER (), 1), count(DISTINCT robot),
             (array_agg(robot ORDER BY n DESC, robot, log_file))[1],
             (array_agg(log_file ORDER BY n DESC, robot, log_file))[1],
             (array_agg(event ORDER BY n DESC, robot, log_file))[1] FROM groups GROUP BY 1, 2 ORDER BY 3 DESC, 1, 2)sql"},
      {"Contradictions",
       {"declaration", "decisions", "robot", "log", "event"},
       R"sql(SELECT left(declaration_digest, 12), sum(n), robot, log_file, min(event) FROM groups
             WHERE outcome = 'abstain_falsified' GROUP BY declaration_digest, robot, log_file ORDER BY 2 DESC, 3, 4)sql"},
      {"Withdrawals",
       {"withdrawals", "robot", "log", "event"},
       R"sql(SELECT n, robot, log_file, event FROM withdrawn ORDER BY 1 DESC, 2, 3)sql"},
      {"Declarations",
       {"declaration", "in force on", "robots", "decisions", "certified %", "contradictions", "until", "robot"},
       R"sql(SELECT left(declaration_digest, 12), count(*) FILTER (WHERE in_force), count(*), sum(n),
             round(100 * sum(certified) / sum(n), 1), sum(contradictions),
             to_char(to_timestamp(max(last) / 1000000) AT TIME ZONE 'UTC', 'YYYY-MM-DD HH24:MI'), min(robot)
             FROM declared GROUP BY declaration_digest ORDER BY 2 DESC, 4 DESC, 1)sql"},
      {"Days",
       {"day", "robots", "decisions", "certified %", "contradictions"},
       R"sql(SELECT to_char(to_timestamp(day * 86400) AT TIME ZONE 'UTC', 'YYYY-MM-DD'), count(DISTINCT robot), sum(n),
             round(100 * coalesce(sum(n) FILTER (WHERE outcome = 'certified'), 0) / sum(n), 1),
             coalesce(sum(n) FILTER (WHERE outcome = 'abstain_falsified'), 0)
             FROM groups WHERE day BETWEEN 0 AND 100000 GROUP BY day ORDER BY day DESC)sql"},
      {"Runs",
       {"robot", "log", "decisions", "certified %", "contradictions"},
       R"sql(SELECT robot, log_file, n, round(100 * certified / n, 1), contradictions FROM runs_of
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
    for (std::size_t i = 0; i < query.columns.size(); ++i) {
      names.push_back(fmt::format("c{}", i));
      texts.push_back(fmt::format("coalesce(c{}::TEXT, '')", i));
    }
    sql += fmt::format("{} (SELECT {}, json_build_array({})::TEXT FROM ({}) AS t({}) LIMIT {})",
                       tables.empty() ? "" : " UNION ALL", tables.size(), fmt::join(texts, ", "), query.sql,
                       fmt::join(names, ", "), kMostRows);
    tables.push_back({query.title, query.columns, {}});
  }
  for (const Store::Values& row : store.Query(sql)) {
    std::vector<std::string>& cells = tables.at(std::stoul(row.at(0).value())).rows.emplace_back();
    for (const auto& cell : ParseJson(row.at(1).value())) cells.push_back(FromStoredText(cell.get<std::string>()));
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

std::string FleetHtml(const std::vector<FleetTable>& tables, const std::string& runs) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>ForeReach: the fleet</title>\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
      "<style>body{font:15px sans-serif;margin:2em}table{border-collapse:collapse}td,th{padding:.2em "
      ".8em;text-align:left;border-bottom:1px solid #ccc}</style></head><body>\n<h1>The fleet</h1>\n";
  for (const FleetTable& table : tables) {
    const std::size_t robot = Find(table.columns, "robot"), log = Find(table.columns, "log");
    html += fmt::format("<h2>{}</h2>\n<table><tr>", table.title);
    for (const std::string& column : table.columns) html += fmt::format("<th>{}</th>", column);
    html += "</tr>\n";
    for (const auto& row : table.rows) {
      html += "<tr>";
      for (std::size_t i = 0; i < row.size(); ++i)
        if (i == log && !runs.empty())
          html += fmt::format("<td><a href=\"{}/{}/{}.html\">{}</a></td>", Escaped(runs), InAddress(row[robot]),
                              InAddress(row[log]), Escaped(Printable(row[i])));
        else
          html += fmt::format("<td>{}</td>", Escaped(Printable(row[i])));
      html += "</tr>\n";
    }
    html += "</table>\n";
    if (table.rows.size() == kMostRows) html += fmt::format("<p>The first {} rows.</p>\n", kMostRows);
  }
  return html + "</body></html>\n";
}

}  // namespace forereach
