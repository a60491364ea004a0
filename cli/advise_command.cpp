#include <algorithm>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <thread>

#include <nlohmann/json.hpp>

#include "advise/advice.h"
#include "certifier/certify/explain.h"
#include "certifier/numerics/parallel.h"
#include "certifier/numerics/text.h"
#include "certifier/task/json_text.h"
#include "cli/abstentions.h"
#include "cli/commands.h"
#include "cli/gate_advice.h"
#include "cli/key_options.h"
#include "cli/offline.h"
#include "cli/progress.h"
#include "lcmtypes/names.h"
#include "lcmtypes/printable.h"
#include "planner_bridge/motion.h"

namespace forereach {
namespace {

struct Options {
  std::vector<std::string> files;
  std::string config;
  LogKey key;
  bool json = false;
  unsigned jobs = std::max(1u, std::thread::hardware_concurrency());
};

struct Advised {
  std::vector<Advice> advices;
  std::optional<Remedy> remedy;
  std::string missing;

  [[nodiscard]] bool turned() const {
    return std::ranges::any_of(advices, &Advice::turns) || (remedy && remedy->turns);
  }
};

// Those of the task's planner; none if the task does not say how its robot brakes.
BrakingTails TailsOf(const Config& task) {
  std::shared_ptr<const RobotMotion> motion;
  try {
    motion = std::make_shared<RobotMotion>(task, Braking::kPlanned);
  } catch (const ConfigError&) {
    return {};
  }
  return [motion, steps = task.planner.tail_steps](const Eigen::VectorXd& state) {
    std::vector<Eigen::MatrixXd> tails;
    Eigen::MatrixXd controls;
    for (int tail = 0; tail < motion->num_tails(); ++tail)
      if (motion->Brake({state.data(), ToSize(state.size())}, tail, steps, controls)) tails.push_back(controls);
    return tails;
  };
}

Advised AdviceFor(const RecordedAbstention& abstention, const BrakingTails& tails) {
  if (!abstention.missing.empty()) return {{}, {}, abstention.missing};
  if (!abstention.judged.problem) return {{}, RemedyFor(abstention), {}};
  try {
    const Certifier certifier(abstention.judged.problem);
    const Case& judged = abstention.judged;
    Advised advised{Advise(judged, certifier, {.tails = tails}), {}, {}};
    Tube tube;
    const Decision again = certifier.Certify(judged.plan(), judged.initial_set, judged.obstacles, tube);
    if (static_cast<std::int16_t>(again.outcome) != abstention.outcome)
      advised.missing = "judged again by what is recorded: " + Explain(again, *judged.problem, judged.plan(), tube);
    return advised;
  } catch (const std::invalid_argument& error) {
    return {{}, {}, std::string("it cannot be judged again: ") + error.what()};
  }
}

// The places under the problem of the task's last abstention, which knows most.
std::vector<std::pair<std::string, int>> PlacesOf(const Abstentions& read, const std::vector<Advised>& advised) {
  std::vector<std::pair<std::string, int>> lines;
  for (const auto& task : read.tasks) {
    std::vector<Case> cases;
    std::vector<Eigen::VectorXd> places;
    for (std::size_t i = 0; i < read.all.size(); ++i) {
      if (read.all[i].task != task.get() || advised[i].advices.empty()) continue;
      cases.push_back(read.all[i].judged);
      for (const Advice& advice : advised[i].advices)
        if (advice.change == Change::kObservation) places.push_back(advice.place);
    }
    if (places.empty() || cases.size() < 2) continue;
    for (Case& each : cases) each.problem = cases.back().problem;
    for (const Place& place : RankPlaces(cases, places)) {
      if (place.turned == 0) break;
      lines.emplace_back(DescribePlace(*task->problem, place.z), place.turned);
    }
  }
  std::ranges::stable_sort(lines, std::ranges::greater{}, &std::pair<std::string, int>::second);
  return lines;
}

void PrintForPeople(const Abstentions& read, const std::vector<Advised>& advised) {
  for (std::size_t i = 0; i < read.all.size(); ++i) {
    const RecordedAbstention& abstention = read.all[i];
    const auto& [advices, remedy, missing] = advised[i];
    if (advices.empty() && !remedy && missing.empty()) continue;
    std::cout << Printable(abstention.name) << "\n  " << Printable(abstention.message) << "\n";
    if (!missing.empty()) std::cout << "  " << Printable(missing) << "\n";
    if (remedy)
      std::cout << (remedy->turns ? "  it would be judged\n    " : "  it might be judged\n    ") << remedy->what
                << "\n";
    bool is_first = true;
    for (const Advice& advice : advices) {
      if (!advice.turns) continue;
      std::cout << (is_first ? "  it would be certified\n" : "") << "    " << Printable(advice.what) << "\n";
      is_first = false;
    }
    is_first = true;
    for (const Advice& advice : advices) {
      if (advice.turns) continue;
      std::cout << (is_first ? "  not enough alone\n" : "") << "    " << Printable(advice.what) << ": then it is \""
                << Printable(advice.then) << "\"\n";
      is_first = false;
    }
  }
  const auto turned = std::ranges::count_if(advised, &Advised::turned);
  std::map<std::string, int> by_change;
  for (const Advised& each : advised) {
    std::set<Change> kinds;
    for (const Advice& advice : each.advices)
      if (advice.turns) kinds.insert(advice.change);
    for (const Change change : kinds) ++by_change[Name(change)];
  }
  for (const std::string& missing : read.missing) std::cout << Printable(missing) << "\n";
  std::cout << "advise: " << read.all.size() << " abstentions and rejections, " << turned
            << " have a change that turns them, verified by certifying again; " << read.certified << " were certified"
            << DescribePassedOver(read.passed_over) << "\n";
  for (const auto& [change, count] : by_change) std::cout << "  " << change << ": " << count << "\n";
  const auto places = PlacesOf(read, advised);
  if (!places.empty()) std::cout << "where one more observation would turn most of them\n";
  for (std::size_t i = 0; i < std::min<std::size_t>(places.size(), 10); ++i)
    std::cout << "  " << places[i].second << ": " << places[i].first << "\n";
  std::cout << std::flush;
}

nlohmann::json ToJson(const Advice& advice) {
  nlohmann::json document{
      {"change", Name(advice.change)}, {"what", advice.what}, {"amount", advice.amount}, {"turns", advice.turns}};
  if (advice.row >= 0) document["row"] = advice.row, document["column"] = advice.column;
  if (advice.place.size() > 0) document["place"] = std::vector(advice.place.begin(), advice.place.end());
  if (!advice.turns) document["then"] = advice.then;
  return document;
}

void PrintJson(const Abstentions& read, const std::vector<Advised>& advised) {
  nlohmann::json all = nlohmann::json::array();
  for (std::size_t i = 0; i < read.all.size(); ++i) {
    nlohmann::json advices = nlohmann::json::array();
    for (const Advice& advice : advised[i].advices) advices.push_back(ToJson(advice));
    nlohmann::json entry{{"name", read.all[i].name},
                         {"outcome", OutcomeName(read.all[i].outcome)},
                         {"message", read.all[i].message},
                         {"advice", advices}};
    if (!advised[i].missing.empty()) entry["missing"] = advised[i].missing;
    if (const auto& remedy = advised[i].remedy) {
      entry["remedy"] = {{"what", remedy->what}, {"turns", remedy->turns}};
      if (!remedy->key.empty()) entry["remedy"].update({{"key", remedy->key}, {"value", remedy->value}});
    }
    all.push_back(std::move(entry));
  }
  nlohmann::json places = nlohmann::json::array();
  for (const auto& [place, turned] : PlacesOf(read, advised)) places.push_back({{"place", place}, {"turned", turned}});
  std::cout << JsonText({{"abstentions", all},
                         {"certified", read.certified},
                         {"places", places},
                         {"missing", read.missing},
                         {"passed_over", ToJson(read.passed_over)}})
            << std::endl;
}

int RunAdvise(const Options& options) {
  const Abstentions read = ReadAbstentions(options.files, options.config, options.key, options.jobs);
  std::vector<Advised> advised(read.all.size());
  std::map<const Config*, BrakingTails> tails;
  for (const auto& task : read.tasks) tails[task.get()] = TailsOf(*task);
  {
    Progress progress("abstentions examined", read.all.size());
    ForEachInParallel(read.all.size(), options.jobs, [&](std::size_t i, std::size_t) {
      advised[i] = AdviceFor(read.all[i], tails.at(read.all[i].task));
      progress.Advance();
    });
  }
  options.json ? PrintJson(read, advised) : PrintForPeople(read, advised);
  return read.missing.empty() && std::ranges::all_of(advised, &Advised::turned) ? 0 : 1;
}

}  // namespace

Command AdviseCommand() {
  const auto options = std::make_shared<Options>();
  Command command{
      .name = kAdvise.name,
      .purpose = kAdvise.purpose,
      .footer =
          "Each change is the least of its kind, found by a search, and verified by certifying again with it. It is "
          "not\n"
          "true because it would help: a smaller slope or a wider domain has to be declared, and to hold.\n\n"
          "Examples:\n"
          "  forereach certify --json --config config/bicycle.yaml --plan config/plans/bicycle_safety.csv > "
          "decision.json\n"
          "  forereach advise decision.json\n"
          "  forereach advise run/log/events-20260101-120000-000000.lcmlog\n"
          "  forereach advise run/log",
      .options =
          {Required(
               {"files", &options->files, "DECISION|LOG|DATABASE|DIRECTORY",
                "The abstentions: a decision (the output of certify --json), or logs, databases and directories, as in "
                "forereach replay"}),
           {"--config", &options->config, "FILE", kTaskOfRecords},
           JobsOption(options->jobs),
           JsonFlag(options->json)},
      .run = [options] { return RunAdvise(*options); }};
  AddKeyOptions(command.options, options->key);
  return command;
}

}  // namespace forereach
