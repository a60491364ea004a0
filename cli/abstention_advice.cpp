#include "cli/abstention_advice.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
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

void to_json(nlohmann::json& json, const Remedy& remedy) {
  json = {{"what", remedy.what}, {"turns", remedy.turns}};
  if (!remedy.key.empty()) json.update({{"key", remedy.key}, {"value", remedy.value}});
}

void to_json(nlohmann::json& json, const AbstentionAdvice& advice) {
  json = {{"advice", advice.advices}};
  if (!advice.missing.empty()) json["missing"] = advice.missing;
  if (advice.remedy) json["remedy"] = *advice.remedy;
  if (const auto& inner = advice.inner)
    json["inner"] = {
        {"step", inner->step}, {"half_width", inner->half_width}, {"least", inner->least}, {"contact", inner->contact}};
}

namespace {

AbstentionAdvice AdviceFor(const RecordedAbstention& abstention, const BrakingTails& tails, bool with_inner) {
  if (!abstention.missing.empty()) return {{}, {}, abstention.missing, {}};
  if (!abstention.was_judged()) return {{}, RemedyFor(abstention), {}, {}};
  try {
    const Case judged = abstention.Judged();
    const Certifier certifier(judged.problem);
    AbstentionAdvice advice{Advise(judged, certifier, {.tails = tails}), {}, {}, {}};
    for (Advice& each : advice.advices) each.after.clear();  // each has a problem of its own
    Tube tube;
    const Decision again = certifier.Certify(judged.plan(), judged.initial_set, judged.obstacles, tube);
    if (static_cast<std::int16_t>(again.outcome) != abstention.outcome)
      advice.missing =
          "judged again by what is recorded: " + Explain(again, *judged.problem, judged.obstacles, judged.plan(), tube);
    if (with_inner) advice.inner = BoundFromWithin(judged, certifier, tube);
    return advice;
  } catch (const std::invalid_argument& error) {
    return {{}, {}, std::string("it cannot be judged again: ") + error.what(), {}};
  }
}

// By how much it missed what it was compared with; 0 if it was not judged.
double Shortfall(const RecordedAbstention& abstention) {
  const double shortfall = std::abs(abstention.decision.threshold - abstention.decision.margin);
  return std::isfinite(shortfall) ? shortfall : 0;
}

}  // namespace

bool AbstentionAdvice::turned() const {
  return std::ranges::any_of(advices, &Advice::turns) || (remedy && remedy->turns);
}

std::vector<AdviceGroup> GroupsOf(const AbstentionAdvice& advice) {
  AdviceGroup enough{"it would be certified"}, others{"other changes that certify it", true},
      not_enough{"not enough alone", true};
  std::map<ChangeKind, std::string> first;
  std::string smaller;  // what is declared smaller and not enough, in one clause
  for (const Advice& each : advice.advices)
    if (each.turns) {
      const auto [of_kind, is_first] = first.try_emplace(KindOf(each.change), each.what);
      if (!is_first) others.clauses.push_back(each.what);
    } else if (!each.smaller.empty()) {
      smaller += (smaller.empty() ? "" : ", ") + each.smaller;
    } else {
      not_enough.clauses.push_back(each.what + ": then it is \"" + each.then + "\"");
    }
  for (const auto& [kind, what] : first) enough.clauses.push_back(std::string(Name(kind)) + ": " + what);
  if (!smaller.empty())
    not_enough.clauses.push_back("if one of these were declared so many times as large: " + smaller);
  std::vector<AdviceGroup> groups;
  if (const auto& remedy = advice.remedy)
    groups.push_back({remedy->turns ? "it would be judged" : "it might be judged", false, {remedy->what}});
  if (advice.inner) groups.push_back({"the inner bound", false, {Describe(*advice.inner)}});
  for (AdviceGroup* group : {&enough, &others, &not_enough})
    if (!group->clauses.empty()) groups.push_back(std::move(*group));
  return groups;
}

std::vector<std::vector<AbstentionAdvice>> AdviseAll(const std::vector<Abstentions>& runs, unsigned jobs,
                                                     double seconds, bool with_inner) {
  std::vector<std::vector<AbstentionAdvice>> advised(runs.size());
  std::vector<std::pair<std::size_t, std::size_t>> work;  // run, abstention
  std::map<const Config*, BrakingTails> tails;
  for (std::size_t run = 0; run < runs.size(); ++run) {
    const std::size_t count = runs[run].all.size();
    advised[run].assign(count, {});
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
      advised[run][i] = AdviceFor(abstention, tails.at(abstention.task), with_inner);
    progress.Advance();
  });
  return advised;
}

}  // namespace forereach
