#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

#include <fmt/core.h>

#include "cli/abstention_advice.h"
#include "cli/commands.h"
#include "cli/each_run.h"
#include "lcmtypes/printable.h"
#include "page/gather.h"
#include "page/write.h"
#include "records/output_file.h"
#include "records/report.h"

namespace forereach {
namespace {

struct ReportArguments {
  ReportOptions report;
  unsigned jobs = AllCores();
  std::string out, before;
  double advice_seconds = 2;
  bool force = false;
};

constexpr std::size_t kMostAdvised = 300;

// A run that was read once, for its rows, its tubes and its advice.
struct PageRead : PagePass {
  explicit PageRead(const PageBounds& bounds) : PagePass(bounds) { others = {&abstentions}; }

  AbstentionReader abstentions{kMostAdvised};
};

// Forgets what the page has no room for.
void KeepLast(const std::vector<std::unique_ptr<PageRead>>& read, const PageBounds& bounds) {
  std::vector<PagePass*> passes;
  for (const auto& each : read) passes.push_back(each.get());
  KeepLast(passes, bounds);
  std::vector<std::int64_t> times;
  std::vector<DatedSet> sets;
  for (const auto& each : read) {
    if (!each) continue;
    for (const auto& [place, entry] : each->cases.entries())
      sets.emplace_back(entry.recorded.decision.utime, entry.recorded.basis.obstacles);
    for (const RecordedAbstention& abstention : each->abstentions.all()) {
      times.push_back(abstention.decision.utime);
      sets.emplace_back(times.back(), abstention.basis.obstacles);
    }
  }
  const std::int64_t kept = BeginOfKept(std::move(sets)),
                     begin = std::max(kept, BeginOfLast(std::move(times), kMostAdvised));
  for (const auto& each : read) {
    if (!each) continue;
    std::erase_if(each->cases.entries(),
                  [&](const auto& entry) { return entry.second.recorded.decision.utime < kept; });
    std::erase_if(each->abstentions.all(), [&](const auto& abstention) { return abstention.decision.utime < begin; });
  }
}

// The advice on the last decisions that are no certificates. Without a log or its task, there is none.
void AddAdvice(const ReportArguments& options, const std::vector<std::unique_ptr<PageRead>>& read, PageRun& page) {
  const auto chosen = ChooseAdvised(page, kMostAdvised);
  std::vector<Abstentions> runs(read.size());
  std::vector<std::vector<std::size_t>> rows(read.size());  // of the abstentions
  for (std::size_t run = 0; run < read.size(); ++run) {
    if (chosen[run].empty()) continue;
    std::map<std::string, std::size_t> row_of;  // by the event's name
    for (const std::size_t row : chosen[run]) row_of.emplace(EventNameOf(page.decisions[row]), row);
    runs[run] = read[run]->abstentions.Finish(read[run]->tasks);
    std::erase_if(runs[run].all, [&](const RecordedAbstention& each) { return !row_of.contains(each.event); });
    for (const RecordedAbstention& each : runs[run].all) rows[run].push_back(row_of.at(each.event));
  }
  const auto advised = AdviseAll(runs, options.jobs, options.advice_seconds);
  for (std::size_t run = 0; run < runs.size(); ++run)
    for (std::size_t i = 0; i < advised[run].size(); ++i) {
      PageAdvice& advice = page.advice.emplace_back();
      advice.decision = rows[run][i];
      advice.missing = advised[run][i].missing;
      for (AdviceGroup& group : GroupsOf(advised[run][i]))
        advice.groups.push_back({std::move(group.heading), group.is_folded, std::move(group.clauses)});
    }
}

// @param bounds without drawings, there is no advice either.
PageRun GatherRuns(const ReportArguments& options, const std::vector<std::string>& inputs, const PageBounds& bounds) {
  const ReportOptions& report = options.report;
  NamedRuns named = RunsNamedBy(inputs, options.jobs);
  const PageTasks tasks{report.config, report.key, RunTasks(report.config, report.key, named.is_many)};
  std::vector<std::unique_ptr<PageRead>> read(named.runs.size());
  std::mutex mutex;
  const RunLogs* first = named.runs.data();
  static_cast<void>(ForEachRun<bool>(named, options.jobs, "read", [&](const RunLogs& run, RunWork& work) {
    auto of_run = std::make_unique<PageRead>(bounds);
    ReadPass(run, tasks, bounds, work.threads, *of_run);
    const std::lock_guard lock(mutex);
    read[static_cast<std::size_t>(&run - first)] = std::move(of_run);
    if (named.is_many) KeepLast(read, bounds);
    return true;
  }));
  PageRun page = EmptyPage(inputs);
  NamedRuns drawn{{}, {}, named.is_many};
  for (std::size_t k = 0; k < read.size(); ++k) {
    if (!read[k]) continue;
    AddRows(page, std::move(read[k]->rows));
    drawn.runs.push_back(named.runs[k]);
  }
  std::erase(read, nullptr);
  AddMissing(page, named);
  std::size_t bytes = bounds.bytes;
  if (bytes == 0) return page;
  const auto chosen = ChooseDetails(page, bounds);
  first = drawn.runs.data();
  auto drawings = ForEachRun<PageRun>(drawn, options.jobs, "drawn", [&](const RunLogs& run, RunWork& work) {
    const auto k = static_cast<std::size_t>(&run - first);
    return chosen[k].empty() ? PageRun() : GatherDetails(*read[k], page, chosen[k], bytes, work.threads);
  });
  for (auto& of_run : drawings)
    if (of_run) AddDetails(page, std::move(*of_run), bytes);
  AddAdvice(options, read, page);
  AddMissing(page, {{}, drawn.missing, true});
  return page;
}

int WritePage(const ReportArguments& options) {
  RequireNewFile(options.out, options.force);  // before the logs are read
  const ReportOptions& report = options.report;
  const PageRun run = GatherRuns(options, report.logs, {});
  std::optional<PageRun> before;
  if (!options.before.empty())
    before = GatherRuns(options, {options.before}, {.certified = 0, .abstained = 0, .bytes = 0});
  WriteNewFile(options.out, PageHtml(run, before ? &*before : nullptr), options.force);
  std::cout << options.out << ": " << run.decisions.size() << " decisions, " << run.details.size()
            << " with their tube or why there is none";
  if (run.parts.size() > 1) std::cout << ", " << run.parts.size() << " runs";
  std::cout << "\n";
  for (const std::string& note : run.notes) std::cout << Printable(note) << "\n";
  return run.damage.places == 0 ? 0 : 1;
}

}  // namespace

Command ReportCommand() {
  const auto options = std::make_shared<ReportArguments>();
  ReportOptions& report = options->report;
  Command command{
      .name = "report",
      .footer =
          "With --out it writes a page for a browser: one HTML file that needs no network. See docs/analysis.md.\n\n"
          "Examples:\n  forereach report run/log/events-20260101-120000-000000.lcmlog --picture run/demo\n"
          "  forereach report run/log --out report.html\n"
          "  forereach report run --out season.html\n"
          "  forereach report run/log --before old/log/decisions.sqlite --out both.html\n"
          "  forereach report --database postgresql://fleet.example/forereach --out fleet.html",
      .options = {Required({"logs", &report.logs, "LOG|DATABASE|DIRECTORY",
                            fmt::format("{}; with --out also databases, directories and logs of several runs", kLogs)}),
                  {"--config", &report.config, "FILE", kTaskOfLogs},
                  Excluding(
                      "--out",
                      {"--picture", &report.picture, "FILE",
                       "Draw obstacles, tubes and driven path into a .svg or .png file, without an ending into both"}),
                  {"-o,--out", &options->out, "FILE.html",
                   "Write a page with figures, every decision and its tube, instead of the text"},
                  Needing("--out", {"--before", &options->before, "LOG|DATABASE|DIRECTORY",
                                    "Show its figures beside those of the others on the page"}),
                  Needing("--out", {"--advice-seconds", &options->advice_seconds, "S",
                                    "How long to search what would have turned abstentions, those that missed by least "
                                    "first; the page says which were not searched",
                                    NumberRange{0, 86400}}),
                  Needing("--out", {"--force", &options->force, "", "Overwrite the page if it exists"}),
                  JsonFlag(report.json)},
      .run = [options] {
        if (!options->out.empty()) return WritePage(*options);
        return Report(options->report, std::cout) ? 0 : 1;
      }};
  command.options.push_back(JobsOption(options->jobs));
  AddKeyOptions(command.options, report.key);
  return command;
}

}  // namespace forereach
