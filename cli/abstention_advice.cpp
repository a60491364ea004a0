#include "cli/abstention_advice.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "command_line/progress.h"
#include "forereach/certify/explain.h"
#include "forereach/numerics/parallel.h"

namespace forereach {

void to_json(nlohmann::json& json, const Advice& advice) {
  json = {{"change", Name(advice.change)}, {"what", advice.what}, {"amount", advice.amount}, {"turns", advice.turns}};
  if (advice.row >= 0) json["row"] = advice.row, json["column"] = advice.column;
  if (advice.place.size() > 0) json["place"] = std::vector(advice.place.begin(), advice.place.end());
  if (!advice.turns) json["then"] = advice.then;
}

void from_json(const nlohmann::json& json, Advice& advice) {
  int change = 0;
  while (change < static_cast<int>(Change::kOutlier) && json.at("change") != Name(static_cast<Change>(change)))
    ++change;
  advice.change = static_cast<Change>(change);
  json.at("what").get_to(advice.what);
  json.at("amount").get_to(advice.amount);
  json.at("turns").get_to(advice.turns);
  advice.row = json.value("row", -1);
  advice.column = json.value("column", -1);
  const auto place = json.value("place", std::vector<double>());
  advice.place = Eigen::Map<const Eigen::VectorXd>(place.data(), static_cast<Eigen::Index>(place.size()));
  advice.then = json.value("then", std::string());
}

void to_json(nlohmann::json& json, const Remedy& remedy) {
  json = {{"what", remedy.what}, {"turns", remedy.turns}};
  if (!remedy.key.empty()) json.update({{"key", remedy.key}, {"value", remedy.value}});
}

void from_json(const nlohmann::json& json, Remedy& remedy) {
  json.at("what").get_to(remedy.what);
  json.at("turns").get_to(remedy.turns);
  remedy.key = json.value("key", std::string());
  remedy.value = json.value("value", 0.0);
}

void to_json(nlohmann::json& json, const AbstentionAdvice& advice) {
  json = {{"advice", advice.advices}};
  if (!advice.missing.empty()) json["missing"] = advice.missing;
  if (advice.remedy) json["remedy"] = *advice.remedy;
}

void from_json(const nlohmann::json& json, AbstentionAdvice& advice) {
  json.at("advice").get_to(advice.advices);
  advice.missing = json.value("missing", std::string());
  if (json.contains("remedy")) advice.remedy = json.at("remedy").get<Remedy>();
}

namespace {

AbstentionAdvice AdviceFor(const RecordedAbstention& abstention, const BrakingTails& tails) {
  if (!abstention.missing.empty()) return {{}, {}, abstention.missing};
  if (!abstention.judged.problem) return {{}, RemedyFor(abstention), {}};
  try {
    const Certifier certifier(abstention.judged.problem);
    const Case& judged = abstention.judged;
    AbstentionAdvice advice{Advise(judged, certifier, {.tails = tails}), {}, {}};
    Tube tube;
    const Decision again = certifier.Certify(judged.plan(), judged.initial_set, judged.obstacles, tube);
    if (static_cast<std::int16_t>(again.outcome) != abstention.outcome)
      advice.missing =
          "judged again by what is recorded: " + Explain(again, *judged.problem, judged.obstacles, judged.plan(), tube);
    return advice;
  } catch (const std::invalid_argument& error) {
    return {{}, {}, std::string("it cannot be judged again: ") + error.what()};
  }
}

// By how much it missed what it was compared with; 0 if it was not judged.
double Shortfall(const RecordedAbstention& abstention) {
  const double shortfall = std::abs(abstention.decision.threshold - abstention.decision.margin);
  return std::isfinite(shortfall) ? shortfall : 0;
}

// Whether what was kept is of these abstentions. Places are used as they are.
bool Fits(const std::vector<AbstentionAdvice>& kept, const std::vector<RecordedAbstention>& all) {
  return std::ranges::equal(kept, all, [](const AbstentionAdvice& advice, const RecordedAbstention& abstention) {
    const auto& problem = abstention.judged.problem;
    if (!problem) return advice.advices.empty();
    return std::ranges::all_of(advice.advices, [&](const Advice& each) {
      return each.place.size() == 0 || (each.place.size() == problem->transitions.z.cols() && each.place.allFinite());
    });
  });
}

}  // namespace

bool AbstentionAdvice::turned() const {
  return std::ranges::any_of(advices, &Advice::turns) || (remedy && remedy->turns);
}

std::vector<AdviceGroup> GroupsOf(const AbstentionAdvice& advice) {
  AdviceGroup enough{"it would be certified", {}}, not_enough{"not enough alone", {}};
  for (const Advice& each : advice.advices)
    if (each.turns)
      enough.clauses.push_back(each.what);
    else
      not_enough.clauses.push_back(each.what + ": then it is \"" + each.then + "\"");
  std::vector<AdviceGroup> groups;
  if (const auto& remedy = advice.remedy)
    groups.push_back({remedy->turns ? "it would be judged" : "it might be judged", {remedy->what}});
  for (AdviceGroup* group : {&enough, &not_enough})
    if (!group->clauses.empty()) groups.push_back(std::move(*group));
  return groups;
}

std::vector<std::vector<AbstentionAdvice>> AdviseAll(const std::vector<Abstentions>& runs, unsigned jobs,
                                                     const FinishedRuns* finished, const std::vector<std::string>& keys,
                                                     double seconds) {
  std::vector<std::vector<AbstentionAdvice>> advised(runs.size());
  std::vector<std::atomic<std::size_t>> left(runs.size());
  std::vector<std::pair<std::size_t, std::size_t>> work;  // run, abstention
  std::map<const Config*, BrakingTails> tails;
  for (std::size_t run = 0; run < runs.size(); ++run) {
    const std::size_t count = runs[run].all.size();
    if (finished)
      if (auto kept = finished->FindAs<std::vector<AbstentionAdvice>>(keys[run]); kept && Fits(*kept, runs[run].all)) {
        advised[run] = std::move(*kept);
        continue;
      }
    advised[run].assign(count, {});
    left[run] = count;
    for (std::size_t i = 0; i < count; ++i) work.emplace_back(run, i);
    for (const auto& task : runs[run].tasks) tails[task.get()] = TailsOf(*task);
  }
  std::ranges::stable_sort(work, {}, [&](const auto& each) { return Shortfall(runs[each.first].all[each.second]); });
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  Progress progress("abstentions examined", work.size());
  ForEachInParallel(work.size(), jobs, [&](std::size_t k, std::size_t) {
    const auto [run, i] = work[k];
    const RecordedAbstention& abstention = runs[run].all[i];
    if (k > 0 && std::chrono::duration<double>(Clock::now() - begin).count() > seconds)
      advised[run][i].missing = fmt::format(
          "not searched within {:g} s: `forereach advise` searches all, or write a longer --advice-seconds", seconds);
    else
      advised[run][i] = AdviceFor(abstention, tails.at(abstention.task));
    if (--left[run] == 0 && finished) finished->Keep(keys[run], advised[run]);
    progress.Advance();
  });
  return advised;
}

}  // namespace forereach
