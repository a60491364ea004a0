#include <algorithm>
#include <iostream>
#include <iterator>
#include <map>
#include <optional>
#include <thread>

#include <nlohmann/json.hpp>

#include "certifier/numerics/parallel.h"
#include "certifier/task/json_text.h"
#include "cli/commands.h"
#include "cli/key_options.h"
#include "cli/offline.h"
#include "cli/progress.h"
#include "lcmtypes/names.h"
#include "lcmtypes/printable.h"
#include "records/compare.h"
#include "records/log_survey.h"
#include "records/log_tasks.h"
#include "records/replay.h"
#include "records/run_logs.h"

namespace forereach {
namespace {

struct Options {
  std::vector<std::string> logs;
  std::string config;
  LogKey key;
  bool json = false, other_task = false, compare = false;
  unsigned jobs = std::max(1u, std::thread::hardware_concurrency());
};

// Of a directory's runs, those with nothing to replay are passed over.
bool HasPlans(const std::vector<std::string>& logs) {
  const LogSurvey survey = Survey(logs, LogOrder::kAny);
  return survey.candidates > 0 || survey.decisions > 0 || !survey.configs.empty();
}

// One result for each run, in their order; where a run cannot be read, nothing, and the reason is in `missing`.
template <class Result, class OneRun>
std::vector<Result> ForEachRun(NamedRuns& named, unsigned jobs, const OneRun& one) {
  std::vector<std::optional<Result>> results(named.runs.size());
  std::vector<std::string> reasons(named.runs.size());
  Progress progress("runs replayed", named.runs.size());
  ForEachInParallel(named.runs.size(), jobs, [&](std::size_t i, std::size_t) {
    try {
      if (!named.of_database || HasPlans(named.runs[i])) results[i] = one(named.runs[i]);
    } catch (const BadInput& error) {
      if (!named.of_database) throw;
      reasons[i] = error.what();
    }
    progress.Advance();
  });
  for (const std::string& reason : reasons)
    if (!reason.empty()) named.missing.push_back(reason);
  std::vector<Result> all;
  for (std::optional<Result>& result : results)
    if (result) all.push_back(std::move(*result));
  return all;
}

Config OtherTask(const Options& options) {
  std::vector<Config> task;
  task.push_back(LoadConfig(options.config));
  options.key.Override(task, options.config);
  return std::move(task.front());
}

ReplayResult Sum(std::vector<ReplayResult> results) {
  ReplayResult sum;
  for (ReplayResult& each : results) {
    sum.candidates += each.candidates;
    sum.agreed += each.agreed;
    sum.withdrawals += each.withdrawals;
    sum.circumstances += each.circumstances;
    sum.corruptions += each.corruptions;
    sum.passed_over.not_authentic += each.passed_over.not_authentic;
    sum.passed_over.undecodable += each.passed_over.undecodable;
    std::ranges::move(each.differences, std::back_inserter(sum.differences));
  }
  return sum;
}

int RunReplay(const Options& options) {
  NamedRuns named = RunsNamedBy(options.logs);
  const std::optional<Config> other = options.other_task ? std::optional(OtherTask(options)) : std::nullopt;
  const ReplayResult result =
      Sum(ForEachRun<ReplayResult>(named, options.jobs, [&](const std::vector<std::string>& logs) {
        if (!other) return Replay(logs, TasksOf(logs, options.config, options.key));
        static_cast<void>(SurveyRun(logs));
        return Replay(logs, {*other});
      }));
  if (options.json) {
    nlohmann::json document{{"candidates", result.candidates},   {"agreed", result.agreed},
                            {"withdrawals", result.withdrawals}, {"circumstances", result.circumstances},
                            {"corruptions", result.corruptions}, {"passed_over", ToJson(result.passed_over)},
                            {"differences", result.differences}};
    if (named.of_database) document["missing"] = named.missing;
    std::cout << JsonText(document) << std::endl;
  } else {
    for (const std::string& missing : named.missing) std::cout << Printable(missing) << "\n";
    for (const std::string& difference : result.differences) std::cout << Printable(difference) << "\n";
    std::cout << "replay: " << result.candidates << " candidates, " << result.agreed << " decisions agree, "
              << result.differences.size() << " differ";
    if (result.withdrawals > 0) std::cout << ", " << result.withdrawals << " withdrawals agree";
    if (result.circumstances > 0)
      std::cout << ", " << result.circumstances
                << " were refused for what no replay gives again (queue, time, not armed, no obstacles, fault)";
    if (result.corruptions > 0) std::cout << "; the log is damaged in " << result.corruptions << " places";
    if (!named.missing.empty()) std::cout << "; " << named.missing.size() << " logs or runs could not be replayed";
    std::cout << DescribePassedOver(result.passed_over) << std::endl;
  }
  return result.differences.empty() && result.corruptions == 0 && result.candidates > 0 && named.missing.empty() ? 0
                                                                                                                 : 1;
}

// ---- --compare.

std::string Describe(const WhyNot& why) {
  std::string text = std::string(OutcomeName(why.outcome)) + ", " + std::string(CauseName(why.cause));
  if (why.obstacle >= 0) text += ", obstacle " + std::to_string(why.obstacle);
  if (why.step >= 0) text += ", step " + std::to_string(why.step);
  return text;
}

// The most frequent first.
template <class Key>
std::vector<std::pair<Key, std::int64_t>> ByCount(const std::map<Key, std::int64_t>& counts) {
  std::vector<std::pair<Key, std::int64_t>> sorted(counts.begin(), counts.end());
  std::ranges::stable_sort(sorted, std::ranges::greater{}, [](const auto& entry) { return entry.second; });
  return sorted;
}

void PrintForPeople(const Comparison& compared, const NamedRuns& named, const std::string& config) {
  for (const std::string& missing : named.missing) std::cout << Printable(missing) << "\n";
  if (!compared.gained.empty()) std::cout << "abstentions that would have been certificates, by what was recorded\n";
  for (const auto& [why, count] : ByCount(compared.gained)) std::cout << "  " << count << ": " << Describe(why) << "\n";
  if (!compared.lost.empty()) std::cout << "certificates that would have been lost, by why\n";
  for (const auto& [why, count] : ByCount(compared.lost)) std::cout << "  " << count << ": " << Describe(why) << "\n";
  for (const std::string& plan : compared.lost_plans) std::cout << "    " << Printable(plan) << "\n";
  if (!compared.otherwise.empty()) std::cout << "refused in both, for another reason\n";
  for (const auto& [whys, count] : ByCount(compared.otherwise))
    std::cout << "  " << count << ": " << Describe(whys.first) << "; then " << Describe(whys.second) << "\n";
  const std::int64_t lost = compared.num_lost();
  std::cout << "compare: had " << config << " been declared, " << compared.num_gained() << " of "
            << compared.candidates - compared.certificates
            << " abstentions and rejections would have been certificates, "
            << (lost == 0 ? "and none" : "and " + std::to_string(lost)) << " of the " << compared.certificates
            << " certificates lost";
  if (compared.circumstances > 0)
    std::cout << "; " << compared.circumstances
              << " were refused for what no replay gives again (queue, time, not armed, no obstacles, fault)";
  if (const std::int64_t unpaired = compared.without_candidate + compared.undecided; unpaired > 0)
    std::cout << "; " << unpaired << " candidates or decisions are alone in the log";
  if (compared.corruptions > 0) std::cout << "; the log is damaged in " << compared.corruptions << " places";
  std::cout << DescribePassedOver(compared.passed_over) << std::endl;
}

nlohmann::ordered_json ToJson(const WhyNot& why) {
  const auto index = [](int value) {
    return value < 0 ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(value);
  };
  return {{"outcome", OutcomeName(why.outcome)},
          {"cause", CauseName(why.cause)},
          {"obstacle", index(why.obstacle)},
          {"step", index(why.step)}};
}

void PrintJson(const Comparison& compared, const NamedRuns& named, const std::string& config) {
  using Json = nlohmann::ordered_json;
  const auto list = [](const std::map<WhyNot, std::int64_t>& counts) {
    Json all = Json::array();
    for (const auto& [why, count] : ByCount(counts)) {
      Json entry = ToJson(why);
      entry["count"] = count;
      all.push_back(std::move(entry));
    }
    return all;
  };
  Json otherwise = Json::array();
  for (const auto& [whys, count] : ByCount(compared.otherwise))
    otherwise.push_back({{"recorded", ToJson(whys.first)}, {"then", ToJson(whys.second)}, {"count", count}});
  std::cout << JsonText(Json{{"config", config},
                             {"candidates", compared.candidates},
                             {"certificates", compared.certificates},
                             {"gained", compared.num_gained()},
                             {"lost", compared.num_lost()},
                             {"gained_by", list(compared.gained)},
                             {"lost_by", list(compared.lost)},
                             {"lost_plans", compared.lost_plans},
                             {"refused_alike", compared.refused_alike},
                             {"refused_otherwise", otherwise},
                             {"circumstances", compared.circumstances},
                             {"without_candidate", compared.without_candidate},
                             {"undecided", compared.undecided},
                             {"corruptions", compared.corruptions},
                             {"missing", named.missing},
                             {"passed_over", Json::parse(JsonText(ToJson(compared.passed_over)))}})
            << std::endl;
}

int RunCompare(const Options& options) {
  NamedRuns named = RunsNamedBy(options.logs);
  const Config task = OtherTask(options);
  Comparison sum;
  for (const Comparison& each : ForEachRun<Comparison>(named, options.jobs, [&](const std::vector<std::string>& logs) {
         static_cast<void>(SurveyRun(logs));
         return Compare(logs, task);
       }))
    sum += each;
  options.json ? PrintJson(sum, named, options.config) : PrintForPeople(sum, named, options.config);
  return sum.num_lost() == 0 && sum.candidates > 0 && sum.corruptions == 0 && named.missing.empty() ? 0 : 1;
}

}  // namespace

Command ReplayCommand() {
  const auto options = std::make_shared<Options>();
  Command command{
      .name = kReplay.name,
      .purpose = kReplay.purpose,
      .footer =
          "With --compare: exit 0 if no certificate would have been lost, otherwise 1.\n\n"
          "Examples:\n  forereach replay run/log/events-20260101-120000-000000.lcmlog\n"
          "  forereach replay run/log\n"
          "  forereach replay run/log/events-20260101-120000-000000.lcmlog --other-task --config "
          "config/demo.yaml\n"
          "  forereach replay run/log --compare --config config/demo.yaml",
      .options = {Required({"logs", &options->logs, "LOG|DATABASE|DIRECTORY",
                            "LCM event log; several if the run was recorded in several, in their order; or a decision "
                            "database with its logs beside it, or the directory of both, for all runs"}),
                  {"--config", &options->config, "FILE", kTaskOfLogs},
                  {.name = "--other-task",
                   .variable = &options->other_task,
                   .help = "Replay it through the gate of another task, given by --config, and show its decisions",
                   .needs = "--config"},
                  {.name = "--compare",
                   .variable = &options->compare,
                   .help =
                       "Replay it through the gate of another task, given by --config, and count what it would have "
                       "changed: certificates gained and lost, by cause, obstacle and step",
                   .needs = "--config",
                   .excludes = "--other-task"},
                  JobsOption(options->jobs),
                  JsonFlag(options->json)},
      .run = [options] { return options->compare ? RunCompare(*options) : RunReplay(*options); }};
  AddKeyOptions(command.options, options->key);
  return command;
}

}  // namespace forereach
