#include <algorithm>
#include <iostream>
#include <map>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/abstention_advice.h"
#include "cli/commands.h"
#include "cli/each_run.h"
#include "cli/shards.h"
#include "lcmtypes/names.h"
#include "lcmtypes/printable.h"
#include "records/decision_record.h"
#include "records/log_survey.h"
#include "task/json_text.h"

namespace forereach {
namespace {

struct AdviseArguments {
  std::vector<std::string> files;
  std::string config;
  LogKey key;
  bool json = false, all = false, inner = false;
  unsigned jobs = AllCores();
  std::optional<double> seconds;
  ShardOptions shard;
};

constexpr std::size_t kMostExamined = 3000;  // of a run

// Of one decision, or of runs: their logs, abstentions and advice.
struct Advised {
  NamedRuns named;
  std::vector<Abstentions> runs;
  std::vector<std::vector<AbstentionAdvice>> advice;

  // Calls visit(abstention, its advice) for all, in their order.
  template <class Visit>
  void ForEach(const Visit& visit) const {
    for (std::size_t run = 0; run < runs.size(); ++run)
      for (std::size_t i = 0; i < advice[run].size(); ++i) visit(runs[run].all[i], advice[run][i]);
  }
};

// The places under the problem of a task's last abstention, which knows most.
std::vector<std::pair<std::string, int>> PlacesOf(const Advised& all) {
  struct OfTask {
    const Config* task;
    std::vector<const RecordedAbstention*> abstentions;
    std::vector<Eigen::VectorXd> places;
  };
  std::vector<OfTask> tasks;
  all.ForEach([&](const RecordedAbstention& abstention, const AbstentionAdvice& advice) {
    if (advice.advices.empty()) return;
    auto of_task =
        std::ranges::find_if(tasks, [&](const OfTask& each) { return each.task->grounds == abstention.task->grounds; });
    if (of_task == tasks.end()) of_task = tasks.insert(tasks.end(), OfTask{abstention.task, {}, {}});
    of_task->abstentions.push_back(&abstention);
    for (const Advice& each : advice.advices)
      if (each.change == Change::kObservation) of_task->places.push_back(each.place);
  });
  std::vector<std::pair<std::string, int>> lines;
  for (const auto& [task, abstentions, places] : tasks) {
    // Of one abstention its own advice says it.
    if (places.empty() || abstentions.size() < 2) continue;
    const auto problem = abstentions.back()->Judged().problem;
    std::vector<Case> cases;
    for (const RecordedAbstention* each : abstentions) {
      cases.push_back(each->judged);
      cases.back().problem = problem;
      if (each->basis.obstacles) cases.back().obstacles = *each->basis.obstacles;
    }
    for (const Place& place : RankPlaces(cases, places)) {
      if (place.turned == 0) break;
      lines.emplace_back(DescribePlace(*task->problem, place.z), place.turned);
    }
  }
  std::ranges::stable_sort(lines, std::ranges::greater{}, &std::pair<std::string, int>::second);
  return lines;
}

void PrintForPeople(const RecordedAbstention& abstention, const AbstentionAdvice& advice, bool all) {
  const std::vector<AdviceGroup> groups = GroupsOf(advice);
  if (groups.empty() && advice.missing.empty()) return;
  std::cout << Printable(abstention.name) << "\n  " << Printable(abstention.message) << "\n";
  if (!advice.missing.empty()) std::cout << "  " << Printable(advice.missing) << "\n";
  for (const AdviceGroup& group : groups) {
    std::cout << "  " << group.heading;
    if (group.is_folded && !all) {
      std::cout << ": " << group.clauses.size() << "; --all shows them\n";
      continue;
    }
    std::cout << "\n";
    for (const std::string& clause : group.clauses) std::cout << "    " << Printable(clause) << "\n";
  }
}

struct Totals {
  std::size_t abstentions = 0, turned = 0;
  std::int64_t certified = 0;
  PassedOver passed_over{};
  std::map<std::string, int> by_change;  // abstentions that it turns
};

Totals TotalsOf(const Advised& all) {
  Totals totals;
  for (const Abstentions& run : all.runs) {
    totals.certified += run.certified;
    totals.passed_over += run.passed_over;
  }
  all.ForEach([&](const RecordedAbstention&, const AbstentionAdvice& advice) {
    ++totals.abstentions;
    totals.turned += advice.turned() ? 1 : 0;
    std::set<std::string> changes;
    for (const Advice& each : advice.advices)
      if (each.turns) changes.insert(Name(each.change));
    for (const std::string& change : changes) ++totals.by_change[change];
  });
  return totals;
}

void PrintForPeople(const Advised& all, const Totals& totals, bool unfolds) {
  all.ForEach([&](const RecordedAbstention& abstention, const AbstentionAdvice& advice) {
    PrintForPeople(abstention, advice, unfolds);
  });
  for (const std::string& missing : all.named.missing) std::cout << Printable(missing) << "\n";
  std::cout << "advise: " << totals.abstentions << " abstentions and rejections, " << totals.turned
            << " have a change that turns them, verified by certifying again; " << totals.certified
            << " were certified, if the declaration is true" << DescribePassedOver(totals.passed_over) << "\n";
  for (const auto& [change, count] : totals.by_change) std::cout << "  " << change << ": " << count << "\n";
  const auto places = PlacesOf(all);
  if (!places.empty()) std::cout << "where one more observation would turn most of them\n";
  for (std::size_t i = 0; i < std::min<std::size_t>(places.size(), 10); ++i)
    std::cout << "  " << places[i].second << ": " << places[i].first << "\n";
  std::cout << std::flush;
}

void PrintJson(const Advised& all, const Totals& totals) {
  nlohmann::json abstentions = nlohmann::json::array(), places = nlohmann::json::array();
  all.ForEach([&](const RecordedAbstention& abstention, const AbstentionAdvice& advice) {
    nlohmann::json entry = advice;
    entry.update(
        {{"name", abstention.name}, {"outcome", OutcomeName(abstention.outcome)}, {"message", abstention.message}});
    abstentions.push_back(std::move(entry));
  });
  for (const auto& [place, turned] : PlacesOf(all)) places.push_back({{"place", place}, {"turned", turned}});
  std::cout << JsonText({{"abstentions", abstentions},
                         {"certified", totals.certified},
                         {"places", places},
                         {"missing", all.named.missing},
                         {"passed_over", ToJson(totals.passed_over)}})
            << std::endl;
}

// Without advice.
Advised ReadRuns(const AdviseArguments& options) {
  Advised all{RunsNamedBy(options.files, options.jobs), {}, {}};
  NamedRuns& named = all.named;
  const RunTasks tasks(options.config, options.key, named.is_many);
  auto read = ForEachRun<Abstentions>(named, options.jobs, "read", [&](const RunLogs& run, RunWork&) {
    if (run.logs.empty()) return Abstentions{};
    Abstentions of_run = ReadAbstentions(run, tasks, named.is_many || run.logs.size() > 1, kMostExamined);
    for (RecordedAbstention& each : of_run.all)
      if (named.is_many) each.name = fmt::format("{}: {}", run.robot, each.name);
    return of_run;
  });
  for (auto& of_run : read) all.runs.push_back(of_run ? std::move(*of_run) : Abstentions{});
  std::int64_t count = 0, left_out = 0;
  for (const Abstentions& run : all.runs) count += std::ssize(run.all), left_out += run.left_out;
  if (left_out > 0)
    named.missing.push_back(fmt::format("of {} abstentions and rejections the last {} of each run are examined",
                                        count + left_out, kMostExamined));
  if (std::ranges::all_of(all.runs, [](const Abstentions& run) { return run.tasks.empty(); }))
    throw ConfigError("{}: {}", options.files[0], named.missing.empty() ? "no decisions" : named.missing[0]);
  return all;
}

Advised ReadDecision(const AdviseArguments& options) {
  if (options.shard.is_given())
    throw ConfigError("{}: --shard divides logs, and this is a single decision", options.files[0]);
  Advised all;
  all.runs.push_back(AbstentionOf(options.files[0], options.config));
  return all;
}

int PrintAdvised(const Advised& all, bool json, bool unfolds) {
  const Totals totals = TotalsOf(all);
  json ? PrintJson(all, totals) : PrintForPeople(all, totals, unfolds);
  return all.named.missing.empty() && totals.turned == totals.abstentions ? 0 : 1;
}

// The advice that is a shard's. Merge reads the logs again for the rest: that takes no search.
int WriteAdvised(const AdviseArguments& options, Advised all) {
  ResultsOfRuns<AdviceOfRun> results;
  for (std::vector<AbstentionAdvice>& advice : all.advice) {
    auto& of_run = results.emplace_back().emplace();
    for (AbstentionAdvice& each : advice)
      if (of_run.Next(options.shard.Get())) of_run.Tell().advice.push_back(std::move(each));
  }
  return WriteShard(options.shard,
                    {.name = "advise",
                     .options = options.inner ? "inner" : "",
                     .config = options.config,
                     .key = options.key,
                     .arguments = {{"files", options.files},
                                   {"all", options.all},
                                   {"key", options.key.file},
                                   {"no_key", options.key.none}}},
                    all.named, results);
}

int RunAdvise(const AdviseArguments& options) {
  const Shard shard = options.shard.Get();
  const bool is_document = options.files.size() == 1 && KindOf(options.files[0]) == FileKind::kJson;
  Advised all = is_document ? ReadDecision(options) : ReadRuns(options);
  all.advice = AdviseAll(all.runs, options.jobs, options.seconds.value_or(kInfinity), options.inner, shard);
  if (options.shard.is_given()) return WriteAdvised(options, std::move(all));
  return PrintAdvised(all, options.json, options.all);
}

}  // namespace

int PrintMergedAdvice(const Shards& shards, bool json) {
  const nlohmann::json& arguments = shards.arguments();
  AdviseArguments options;
  arguments.at("files").get_to(options.files);
  options.config = shards.config();
  options.key = {.file = arguments.at("key"), .none = arguments.at("no_key")};
  Advised all = ReadRuns(options);
  shards.RequireSameRuns(all.named);
  for (auto& of_run : shards.Results<AdviceOfRun>()) all.advice.push_back(std::move(of_run.value()).Sum().advice);
  return PrintAdvised(all, json, arguments.at("all"));
}

Command AdviseCommand() {
  const auto options = std::make_shared<AdviseArguments>();
  Command command{
      .name = "advise",
      .footer =
          R"(Each change is the least of its kind, found by a search, and verified by certifying again with it. It is not
true because it would help: a smaller slope or a wider domain has to be declared, and to hold.

Examples:
  forereach certify --json --config config/bicycle.yaml --plan config/plans/bicycle_safety.csv > decision.json
  forereach advise decision.json
  forereach advise run/log/events-20260101-120000-000000.lcmlog
  forereach advise run/log
  forereach advise run/log --shard 2/7 --out part2.json
  forereach advise season --advice-seconds 600)",
      .options = {Required({"files", &options->files, "DECISION|LOG|DATABASE|DIRECTORY",
                            "The abstentions: a decision (the output of certify --json), or logs, databases and "
                            "directories, as in forereach replay"}),
                  {"--config", &options->config, "FILE", kTaskOfRecords},
                  Excluding("--shard",
                            {"--advice-seconds", &options->seconds, "S",
                             "How long to search, the abstentions that missed by least first; the others are said not "
                             "to be searched. By default all are",
                             NumberRange{0, 86400}}),
                  {"--inner", &options->inner, "",
                   "Also how wide every sound tube is, and whether a system that agrees with all data touches"},
                  {"--all", &options->all, "", "Show every change, not the first of each kind alone"},
                  JobsOption(options->jobs),
                  JsonFlag(options->json)},
      .run = [options] { return RunAdvise(*options); }};
  options->shard.AddTo(command.options);
  AddKeyOptions(command.options, options->key);
  return command;
}

}  // namespace forereach
