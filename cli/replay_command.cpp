#include <algorithm>
#include <iostream>
#include <map>
#include <optional>
#include <span>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/each_run.h"
#include "cli/shards.h"
#include "lcmtypes/names.h"
#include "lcmtypes/printable.h"
#include "records/log_tasks.h"
#include "records/replay.h"
#include "records/result.h"
#include "task/json_text.h"

namespace forereach {
namespace {

struct ReplayArguments {
  std::vector<std::string> logs;
  std::string config, plan_digest;
  LogKey key;
  bool json = false, other_task = false, compare = false;
  unsigned jobs = AllCores();
  ShardOptions shard;
};

// Of a run in which nothing was found. Of several runs, those with nothing to replay are passed over.
void RequirePlans(const NamedRuns& named, const RunLogs& run, const LogKey& key) {
  if (!named.is_many) RunTasks("", key, false).Of(run.logs).RequirePlans();
}

Config OtherTask(const ReplayArguments& options) {
  Config task = LoadConfig(options.config);
  options.key.Override(task, options.config);
  return task;
}

// Lines about a run, with its robot's name if there are several runs.
void NameRobot(const NamedRuns& named, const RunLogs& run, std::vector<std::string>& lines) {
  if (!named.is_many) return;
  for (std::string& line : lines) line = fmt::format("{}: {}", run.robot, line);
}

void PrintMissing(const NamedRuns& named) {
  for (const std::string& missing : named.missing) std::cout << Printable(missing) << "\n";
}

void PrintJson(const ReplayResult& result, const NamedRuns& named) {
  nlohmann::json document = result;
  document["passed_over"] = ToJson(result.passed_over);
  if (named.is_many) {
    document["runs"] = named.runs.size();
    document["missing"] = named.missing;
  }
  std::cout << JsonText(document) << std::endl;
}

void PrintForPeople(const ReplayResult& result, const NamedRuns& named) {
  PrintMissing(named);
  for (const std::string& line : result.shown) std::cout << Printable(line) << "\n";
  for (const std::string& difference : result.differences) std::cout << Printable(difference) << "\n";
  std::cout << "replay: " << result.candidates << " candidates, " << result.agreed << " decisions agree, "
            << result.differences.size() << " differ";
  if (result.withdrawals > 0) std::cout << ", " << result.withdrawals << " withdrawals agree";
  if (result.proposals > 0) std::cout << ", " << result.proposals << " proposals are certified";
  if (result.circumstances > 0)
    std::cout << ", " << result.circumstances
              << " were refused for what no replay gives again (queue, time, not armed, no obstacles, fault)";
  if (result.corruptions > 0) std::cout << "; the log is damaged in " << result.corruptions << " places";
  if (named.is_many) std::cout << "; " << named.runs.size() << " runs";
  if (!named.missing.empty()) std::cout << "; " << named.missing.size() << " logs or runs could not be replayed";
  std::cout << DescribePassedOver(result.passed_over) << std::endl;
}

int PrintReplay(ResultsOfRuns<ReplayResult> results, const NamedRuns& named, bool json) {
  ReplayResult sum;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!results[i]) continue;
    ReplayResult of_run = std::move(*results[i]).Sum();
    NameRobot(named, named.runs[i], of_run.differences);
    NameRobot(named, named.runs[i], of_run.shown);
    sum += std::move(of_run);
  }
  json ? PrintJson(sum, named) : PrintForPeople(sum, named);
  // A log without candidates agrees with everything, and shows nothing.
  return sum.differences.empty() && sum.corruptions == 0 && sum.candidates > 0 && named.missing.empty() ? 0 : 1;
}

int RunReplay(const ReplayArguments& options) {
  const Shard shard = options.shard.Get();
  NamedRuns named = RunsNamedBy(options.logs, options.jobs);
  const std::optional<Config> other = options.other_task ? std::optional(OtherTask(options)) : std::nullopt;
  const RunTasks own(other ? "" : options.config, options.key, named.is_many);
  const auto replay = [&](const RunLogs& run, RunWork&) -> CaseResults<ReplayResult> {
    if (run.logs.empty()) return {};
    const bool names_files = named.is_many || run.logs.size() > 1;
    if (other) {
      auto result = Replay(run.logs, *other, options.plan_digest, names_files, shard);
      if (result.of_run.candidates == 0 && result.cases == 0) RequirePlans(named, run, options.key);
      return result;
    }
    LogTasks tasks = own.Of(run.logs);
    if (!tasks.has_plans() && named.is_many) return {};  // nothing to replay
    tasks.RequirePlans();
    return Replay(run.logs, tasks, options.plan_digest, names_files, shard);
  };
  auto results = ForEachRun<CaseResults<ReplayResult>>(named, options.jobs, "replayed", replay);
  if (options.shard.is_given())
    return WriteShard(options.shard,
                      {"replay", (other ? "other " : "") + options.plan_digest, options.config, options.key}, named,
                      results);
  return PrintReplay(std::move(results), named, options.json);
}

// ---- --compare.

using ByRobot = std::map<std::string, Comparison>;

std::string Describe(const WhyNot& why) {
  std::string text = fmt::format("{}, {}", OutcomeName(why.outcome), CauseName(why.cause));
  if (why.obstacle >= 0) text += fmt::format(", obstacle {}", why.obstacle);
  if (why.step >= 0) text += fmt::format(", step {}", why.step);
  return text;
}

// The most frequent first.
template <class Key>
std::vector<std::pair<Key, std::int64_t>> ByCount(const std::map<Key, std::int64_t>& counts) {
  std::vector<std::pair<Key, std::int64_t>> sorted(counts.begin(), counts.end());
  std::ranges::stable_sort(sorted, std::ranges::greater{}, [](const auto& entry) { return entry.second; });
  return sorted;
}

std::string GainsAndLosses(const Comparison& compared) {
  const std::int64_t lost = compared.num_lost();
  return fmt::format("{} of {} abstentions and rejections would have been certificates, {} of the {} certificates lost",
                     compared.num_gained(), compared.candidates - compared.certificates,
                     lost == 0 ? "and none" : fmt::format("and {}", lost), compared.certificates);
}

// The JSON has all.
void PrintFirst(const std::vector<std::string>& plans) {
  constexpr std::size_t kMost = 20;
  for (const std::string& plan : std::span(plans).first(std::min(kMost, plans.size())))
    std::cout << "    " << Printable(plan) << "\n";
  if (plans.size() > kMost) std::cout << "    and " << plans.size() - kMost << " more\n";
}

void PrintForPeople(const Comparison& compared, const ByRobot& robots, const NamedRuns& named,
                    const std::string& config) {
  PrintMissing(named);
  if (!compared.gained.empty()) std::cout << "abstentions that would have been certificates, by what was recorded\n";
  for (const auto& [why, count] : ByCount(compared.gained)) std::cout << "  " << count << ": " << Describe(why) << "\n";
  PrintFirst(compared.gained_plans);
  if (!compared.lost.empty()) std::cout << "certificates that would have been lost, by why\n";
  for (const auto& [why, count] : ByCount(compared.lost)) std::cout << "  " << count << ": " << Describe(why) << "\n";
  PrintFirst(compared.lost_plans);
  if (!compared.otherwise.empty()) std::cout << "refused in both, for another reason\n";
  for (const auto& [whys, count] : ByCount(compared.otherwise))
    std::cout << "  " << count << ": " << Describe(whys.first) << "; then " << Describe(whys.second) << "\n";
  if (robots.size() > 1)
    for (const auto& [robot, of_robot] : robots)
      std::cout << Printable(robot) << ": " << GainsAndLosses(of_robot) << "\n";
  std::cout << "compare: had " << config << " been declared, " << GainsAndLosses(compared);
  if (compared.circumstances > 0)
    std::cout << "; " << compared.circumstances
              << " were refused for what no replay gives again (queue, time, not armed, no obstacles, fault)";
  if (const std::int64_t unpaired = compared.without_candidate + compared.undecided; unpaired > 0)
    std::cout << "; " << unpaired << " candidates or decisions are alone in the log";
  if (compared.corruptions > 0) std::cout << "; the log is damaged in " << compared.corruptions << " places";
  if (!named.missing.empty()) std::cout << "; " << named.missing.size() << " logs or runs could not be compared";
  std::cout << DescribePassedOver(compared.passed_over) << std::endl;
}

using OrderedJson = nlohmann::ordered_json;

OrderedJson ToJson(const WhyNot& why) {
  const auto index = [](int value) { return value < 0 ? OrderedJson(nullptr) : OrderedJson(value); };
  return {{"outcome", OutcomeName(why.outcome)},
          {"cause", CauseName(why.cause)},
          {"obstacle", index(why.obstacle)},
          {"step", index(why.step)}};
}

OrderedJson ToJson(const std::map<WhyNot, std::int64_t>& counts) {
  OrderedJson all = OrderedJson::array();
  for (const auto& [why, count] : ByCount(counts)) {
    OrderedJson entry = ToJson(why);
    entry["count"] = count;
    all.push_back(std::move(entry));
  }
  return all;
}

void PrintJson(const Comparison& compared, const ByRobot& robots, const NamedRuns& named, const std::string& config) {
  OrderedJson otherwise = OrderedJson::array(), by_robot = OrderedJson::array();
  for (const auto& [whys, count] : ByCount(compared.otherwise))
    otherwise.push_back({{"recorded", ToJson(whys.first)}, {"then", ToJson(whys.second)}, {"count", count}});
  for (const auto& [robot, of_robot] : robots)
    by_robot.push_back({{"robot", robot},
                        {"candidates", of_robot.candidates},
                        {"certificates", of_robot.certificates},
                        {"gained", of_robot.num_gained()},
                        {"lost", of_robot.num_lost()}});
  std::cout << JsonText(OrderedJson{{"config", config},
                                    {"candidates", compared.candidates},
                                    {"certificates", compared.certificates},
                                    {"gained", compared.num_gained()},
                                    {"lost", compared.num_lost()},
                                    {"gained_by", ToJson(compared.gained)},
                                    {"lost_by", ToJson(compared.lost)},
                                    {"gained_plans", compared.gained_plans},
                                    {"lost_plans", compared.lost_plans},
                                    {"refused_alike", compared.refused_alike},
                                    {"refused_otherwise", otherwise},
                                    {"by_robot", by_robot},
                                    {"circumstances", compared.circumstances},
                                    {"without_candidate", compared.without_candidate},
                                    {"undecided", compared.undecided},
                                    {"corruptions", compared.corruptions},
                                    {"runs", named.runs.size()},
                                    {"missing", named.missing},
                                    {"passed_over", ParseJson<OrderedJson>(JsonText(ToJson(compared.passed_over)))}})
            << std::endl;
}

int PrintComparison(ResultsOfRuns<Comparison> results, const NamedRuns& named, const std::string& config, bool json) {
  Comparison sum;
  ByRobot robots;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!results[i]) continue;
    Comparison of_run = std::move(*results[i]).Sum();
    for (auto* const plans : {&of_run.lost_plans, &of_run.gained_plans}) NameRobot(named, named.runs[i], *plans);
    robots[named.runs[i].robot] += of_run;
    sum += of_run;
  }
  json ? PrintJson(sum, robots, named, config) : PrintForPeople(sum, robots, named, config);
  return sum.num_lost() == 0 && sum.candidates > 0 && sum.corruptions == 0 && named.missing.empty() ? 0 : 1;
}

int RunCompare(const ReplayArguments& options) {
  const Shard shard = options.shard.Get();
  NamedRuns named = RunsNamedBy(options.logs, options.jobs);
  const Config task = OtherTask(options);
  const auto compare = [&](const RunLogs& run, RunWork&) -> CaseResults<Comparison> {
    if (run.logs.empty()) return {};
    auto result = Compare(run.logs, task, named.is_many || run.logs.size() > 1, shard);
    if (result.cases == 0) RequirePlans(named, run, options.key);
    return result;
  };
  auto results = ForEachRun<CaseResults<Comparison>>(named, options.jobs, "compared", compare);
  if (options.shard.is_given())
    return WriteShard(options.shard, {"compare", "", options.config, options.key}, named, results);
  return PrintComparison(std::move(results), named, options.config, options.json);
}

}  // namespace

int PrintMergedReplay(const Shards& shards, bool json) {
  return PrintReplay(shards.Results<ReplayResult>(), shards.named(), json);
}

int PrintMergedComparison(const Shards& shards, bool json) {
  return PrintComparison(shards.Results<Comparison>(), shards.named(), shards.config(), json);
}

Command ReplayCommand() {
  const auto options = std::make_shared<ReplayArguments>();
  Command command{
      .name = "replay",
      .footer =
          "With --compare: exit 0 if no certificate would have been lost, otherwise 1.\n\n"
          "Examples:\n  forereach replay run/log/events-20260101-120000-000000.lcmlog\n"
          "  forereach replay run/log/events-20260101-120000-000000.lcmlog --other-task --config config/demo.yaml\n"
          "  forereach replay run/log --compare --config config/demo.yaml\n"
          "  forereach replay run/log --shard 2/7 --out part2.json",
      .options = {Required({"logs", &options->logs, "LOG|DATABASE|DIRECTORY", kRuns}),
                  {"--config", &options->config, "FILE", kTaskOfLogs},
                  Needing("--config",
                          {"--other-task", &options->other_task, "",
                           "Replay it through the gate of another task, given by --config, and show its decisions"}),
                  Excluding("--other-task",
                            Needing("--config",
                                    {"--compare", &options->compare, "",
                                     "Replay it through the gate of another task, given by --config, and count what it "
                                     "would have changed: certificates gained and lost, by cause, obstacle and step"})),
                  {"--plan-digest", &options->plan_digest, "HEX",
                   "Also print what was recorded and what is decided again on the candidates whose digest begins so"},
                  JsonFlag(options->json)},
      .run = [options] { return options->compare ? RunCompare(*options) : RunReplay(*options); }};
  command.options.push_back(JobsOption(options->jobs));
  options->shard.AddTo(command.options);
  AddKeyOptions(command.options, options->key);
  return command;
}

}  // namespace forereach
