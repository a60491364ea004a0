#include "experiments/table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "experiments/paper_values.h"

namespace forereach::experiments {
namespace {

std::string Fixed(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

// "+0.012", "-0.012", and "0.000" for what rounds to it.
std::string Signed(double value, int decimals) {
  const std::string size = Fixed(std::abs(value), decimals);
  if (size.find_first_not_of("0.") == std::string::npos) return size;
  return (value < 0 ? "-" : "+") + size;
}

int DecimalsOf(const Row& row) { return row.paper ? row.paper->decimals : row.decimals; }

std::string Ours(const Row& row) {
  if (!row.ours.mean) return "none";
  std::string text = Fixed(*row.ours.mean, DecimalsOf(row));
  return row.ours.seeds > 1 ? text + " ± " + Fixed(row.ours.deviation, DecimalsOf(row)) : text;
}

std::string Papers(const Row& row) {
  if (!row.paper) return "";
  const std::string text = Fixed(row.paper->value, row.paper->decimals);
  return row.paper->deviation < 0 ? text : text + " ± " + Fixed(row.paper->deviation, row.paper->decimals);
}

std::string Difference(const Row& row) {
  return row.paper && row.ours.mean ? Signed(*row.ours.mean - row.paper->value, row.paper->decimals) : "";
}

std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

std::optional<PaperValue> PaperOrNone(std::string_view key) {
  const auto found = std::ranges::find(kPaperValues, key, &PaperValue::key);
  return found == std::end(kPaperValues) ? std::nullopt : std::optional(*found);
}

const PaperValue& Paper(std::string_view key) {
  const auto found = std::ranges::find(kPaperValues, key, &PaperValue::key);
  if (found == std::end(kPaperValues)) throw std::invalid_argument("paper: no value " + std::string(key));
  return *found;
}

Estimate EstimateOf(const std::vector<std::optional<double>>& of_each_seed) {
  double sum = 0, squares = 0;
  int seeds = 0;
  for (const auto& value : of_each_seed)
    if (value) sum += *value, ++seeds;
  if (seeds == 0) return {};
  const double mean = sum / seeds;
  for (const auto& value : of_each_seed)
    if (value) squares += (*value - mean) * (*value - mean);
  return {mean, seeds > 1 ? std::sqrt(squares / (seeds - 1)) : 0, seeds};
}

std::string Verdict(const Row& row) {
  if (!row.paper) return "";
  if (!row.ours.mean) return row.reason.empty() ? "no plan to measure it on" : row.reason;
  if (Fixed(*row.ours.mean, row.paper->decimals) == Fixed(row.paper->value, row.paper->decimals)) return "same";
  constexpr double kPaperSeeds = 10;
  if (row.paper->deviation >= 0 && row.ours.seeds > 1) {
    const double error = std::sqrt(row.paper->deviation * row.paper->deviation / kPaperSeeds +
                                   row.ours.deviation * row.ours.deviation / row.ours.seeds);
    if (std::abs(*row.ours.mean - row.paper->value) <= 2 * error) return "within the seeds' spread";
  }
  return row.reason.empty() ? "scenario bounds are ours" : row.reason;
}

std::string ToMarkdown(const Table& table) {
  std::string text = "## " + table.title + "\n" + table.about + "\n\n";
  text += "| | paper | from | ours | difference | where they differ |\n|---|---|---|---|---|---|\n";
  for (const Row& row : table.rows)
    text += "| " + row.what + " | " + Papers(row) + " | " + std::string(row.paper ? row.paper->where : "") + " | " +
            Ours(row) + " | " + Difference(row) + " | " + Verdict(row) + " |\n";
  return text;
}

std::string ToCsv(const std::vector<Table>& tables) {
  std::string text = "table,what,paper,ours,deviation,difference,word\n";
  for (const Table& table : tables)
    for (const Row& row : table.rows) {
      const int decimals = std::max(DecimalsOf(row), 6);
      text += Quoted(table.title) + "," + Quoted(row.what) + "," +
              (row.paper ? Fixed(row.paper->value, row.paper->decimals) : "") + "," +
              (row.ours.mean ? Fixed(*row.ours.mean, decimals) : "") + "," +
              (row.ours.seeds > 1 ? Fixed(row.ours.deviation, decimals) : "") + "," + Difference(row) + "," +
              Quoted(Verdict(row)) + "\n";
    }
  return text;
}

}  // namespace forereach::experiments
