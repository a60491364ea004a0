#include "research/run_directory.h"

#include <fstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "command_line/progress.h"
#include "forereach/numerics/parallel.h"
#include "forereach/numerics/text.h"
#include "research/statistics.h"
#include "task/files.h"
#include "task/json_text.h"

namespace forereach::research {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

std::string ReadFile(const fs::path& path) { return ReadWhole(path.string(), kLargestJsonFile); }

// The counts of a tally by name, for writing and reading alike.
template <class Tally, class Visit>
void VisitCounts(Tally& tally, const Visit& visit) {
  visit("plans", tally.plans);
  visit("safe", tally.safe);
  visit("certified", tally.certified);
  visit("certified_safe", tally.certified_safe);
  visit("falsified", tally.falsified);
  visit("domain", tally.domain);
  visit("safety", tally.safety);
  visit("vacuous", tally.vacuous);
  visit("covered", tally.covered);
  visit("prefix_covered", tally.prefix_covered);
  visit("undecided", tally.undecided);
  visit("domain_steps", tally.domain_steps);
  visit("safety_steps", tally.safety_steps);
  visit("areas", tally.areas);
  visit("answers", tally.answers);
  visit("distances", tally.distances);
  visit("budget_drift", tally.budgets.drift);
  visit("budget_tube", tally.budgets.tube);
  visit("budget_total", tally.budgets.total);
  visit("budget_least_mass", tally.budgets.least_mass);
  visit("budget_at_cap", tally.budgets.at_cap);
  visit("budget_complete", tally.budgets.complete);
}

Json ToJson(const Cell& cell, const CellResult& result) {
  Json json{{"system", cell.system->name},       {"method", cell.method.name}, {"declaration", cell.declared.name},
            {"observations", cell.observations}, {"noise", cell.noise},        {"order", cell.zonotope_order},
            {"layout", NameOf(cell.layout)},     {"seed", cell.seed},          {"groups", Json::object()}};
  for (const Tally& tally : result) {
    Json& group = json["groups"][std::string(1, tally.group)];
    VisitCounts(tally, [&](const char* name, const auto& value) { group[name] = value; });
  }
  return json;
}

CellResult FromJson(const Json& json) {
  CellResult result;
  for (std::size_t g = 0; g < result.size(); ++g) {
    result[g].group = NameOf(kGroups[g]);
    const Json& group = json.at("groups").at(std::string(1, result[g].group));
    VisitCounts(result[g], [&](const char* name, auto& value) { group.at(name).get_to(value); });
  }
  return result;
}

void RequireSame(const fs::path& file, const Json& begun, const char* field, int now) {
  const int then = begun.at(field).get<int>();
  if (then != now)
    throw std::runtime_error(file.string() + ": " + field + ": begun with " + std::to_string(then) + ", this run has " +
                             std::to_string(now) + "; give another --out, or delete this directory");
}

std::string StepList(const std::vector<int>& counts) {
  std::string text;
  for (std::size_t t = 0; t < counts.size(); ++t) {
    if (counts[t] == 0) continue;
    if (!text.empty()) text += ' ';
    text.append(std::to_string(t)).append(1, ':').append(std::to_string(counts[t]));
  }
  return text;
}

// ",part,low,high" of a count.
void AppendPart(int count, int of, std::string& text) {
  const std::optional<Range> range = WilsonRange(count, of);
  if (!range) {
    text += ",,,";
    return;
  }
  for (const double number : {static_cast<double>(count) / of, range->low, range->high})
    text.append(1, ',').append(ToText(number));
}

}  // namespace

void WriteFile(const fs::path& path, const std::string& text) {
  const fs::path part = path.string() + ".part";
  std::ofstream file(part, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  if (!file) throw std::runtime_error(part.string() + ": cannot be written");
  fs::rename(part, path);
}

RunDirectory::RunDirectory(fs::path path, const Effort& effort) : path_(std::move(path)), effort_(effort) {
  std::error_code error;
  fs::create_directories(path_ / "cells", error);
  if (error) throw std::runtime_error((path_ / "cells").string() + ": " + error.message());
  const fs::path file = path_ / "run.json";
  if (!fs::exists(file)) {
    WriteFile(file, JsonText(Json{{"scenarios", effort.scenarios}, {"rollouts", effort.rollouts}}, 2) + "\n");
    return;
  }
  try {
    const Json begun = ParseJson<Json>(ReadFile(file));
    RequireSame(file, begun, "scenarios", effort.scenarios);
    RequireSame(file, begun, "rollouts", effort.rollouts);
  } catch (const Json::exception& bad) {
    throw std::runtime_error(file.string() + ": " + bad.what());
  }
}

std::optional<CellResult> RunDirectory::Load(const Cell& cell) const {
  const fs::path file = path_ / "cells" / (cell.key() + ".json");
  if (!fs::exists(file)) return std::nullopt;
  try {
    return FromJson(ParseJson<Json>(ReadFile(file)));
  } catch (const Json::exception& bad) {
    throw std::runtime_error(file.string() + ": " + bad.what() + "; delete it to have the cell run again");
  }
}

void RunDirectory::Store(const Cell& cell, const CellResult& result) const {
  WriteFile(path_ / "cells" / (cell.key() + ".json"), JsonText(ToJson(cell, result), 1) + "\n");
}

std::vector<CellResult> RunAll(const std::vector<Cell>& cells, const RunDirectory& directory, unsigned threads) {
  std::vector<CellResult> results(cells.size());
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (std::optional<CellResult> known = directory.Load(cells[i]))
      results[i] = std::move(*known);
    else
      missing.push_back(i);
  }
  Progress progress("cells", missing.size());
  ForEachInParallel(missing.size(), threads, [&](std::size_t i, std::size_t) {
    const Cell& cell = cells[missing[i]];
    results[missing[i]] = RunCell(cell, directory.effort());
    directory.Store(cell, results[missing[i]]);
    progress.Advance();
  });
  return results;
}

std::string ToCsv(const std::vector<Cell>& cells, const std::vector<CellResult>& results) {
  std::string text =
      "system,method,declaration,observations,noise,order,layout,seed,group,plans,safe,certified,certified_safe,false_"
      "certificates,falsified,domain,safety,vacuous,covered,prefix_covered,undecided,domain_steps,safety_steps,recall,"
      "recall_low,recall_high,coverage,coverage_low,coverage_high\n";
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Cell& cell = cells[i];
    for (const Tally& tally : results[i]) {
      text += cell.system->name + "," + cell.method.name + "," + cell.declared.name + "," +
              std::to_string(cell.observations) + "," + ToText(cell.noise) + "," + std::to_string(cell.zonotope_order) +
              "," + NameOf(cell.layout) + "," + std::to_string(cell.seed) + "," + tally.group;
      for (const int count :
           {tally.plans, tally.safe, tally.certified, tally.certified_safe, tally.false_certificates(), tally.falsified,
            tally.domain, tally.safety, tally.vacuous, tally.covered, tally.prefix_covered, tally.undecided})
        text.append(1, ',').append(std::to_string(count));
      text.append(1, ',').append(StepList(tally.domain_steps));
      text.append(1, ',').append(StepList(tally.safety_steps));
      AppendPart(tally.certified_safe, tally.safe, text);
      AppendPart(tally.covered, tally.complete(), text);
      text.append(1, '\n');
    }
  }
  return text;
}

}  // namespace forereach::research
