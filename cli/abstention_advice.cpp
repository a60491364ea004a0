#include "cli/abstention_advice.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "command_line/progress.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/extremal.h"
#include "forereach/certify/tube.h"
#include "forereach/numerics/parallel.h"
#include "forereach/numerics/text.h"
#include "forereach/safety/clearance.h"
#include "forereach/sets/zonogon.h"
#include "task/json_text.h"
#include "verifier/verifier.h"

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
      advice.missing = fmt::format("judged again by what is recorded: {}",
                                   Explain(again, certifier, judged.obstacles, judged.plan(), tube));
    if (with_inner) advice.inner = BoundFromWithin(judged, certifier, tube);
    return advice;
  } catch (const std::invalid_argument& error) {
    return {{}, {}, fmt::format("it cannot be judged again: {}", error.what()), {}};
  }
}

// By how much it missed what it was compared with; 0 if it was not judged.
double Shortfall(const RecordedAbstention& abstention) {
  const double shortfall = std::abs(abstention.decision.threshold - abstention.decision.margin);
  return std::isfinite(shortfall) ? shortfall : 0;
}

// How far the body is from the nearest obstacle in a state at sample t, in plain arithmetic; places at expressions
// count as the frame.
double DistanceIn(const Case& judged, const Eigen::VectorXd& x, int t) {
  const Problem& problem = *judged.problem;
  const Eigen::Vector2d at = problem.projection * x;
  const Eigen::Rotation2Dd turn(problem.body.heading < 0 ? 0 : x[problem.body.heading]);
  double least = std::numeric_limits<double>::infinity();
  for (BodyPart part : problem.body.parts) {
    if (!part.places.empty()) part = {.points = {Eigen::Vector3d::Zero()}, .radius = part.radius};
    for (Eigen::Vector3d& point : part.points) point.head<2>() = (at + turn * point.head<2>()).eval();
    for (const Obstacle& obstacle : judged.obstacles)
      least =
          std::min(least, ApproximateDistance(obstacle, part, judged.schedule.start_us + t * judged.schedule.step_us));
  }
  return least;
}

struct Approach {
  double distance;
  Eigen::Index column;
};

// The rollouts that come closest to an obstacle, at most three.
std::vector<Approach> ClosestOf(const Case& judged, const std::vector<Eigen::MatrixXd>& states) {
  std::vector<Approach> all;
  for (Eigen::Index column = 0; column < states[0].cols(); ++column) {
    all.push_back({std::numeric_limits<double>::infinity(), column});
    for (std::size_t t = 0; t < states.size(); ++t)
      all.back().distance =
          std::min(all.back().distance, DistanceIn(judged, states[t].col(column), static_cast<int>(t)));
  }
  std::ranges::sort(all, {}, &Approach::distance);
  all.resize(std::min<std::size_t>(all.size(), 3));
  return all;
}

double RadiusOf(const Problem& problem, const Zonotope& slice) {
  return RadiusUpper(Zonotope(problem.projection * slice.CenterVector(), problem.projection * slice.GeneratorMatrix()));
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
      not_enough.clauses.push_back(fmt::format("{}: then it is \"{}\"", each.what, each.then));
    }
  for (const auto& [kind, what] : first) enough.clauses.push_back(fmt::format("{}: {}", Name(kind), what));
  if (!smaller.empty())
    not_enough.clauses.push_back(fmt::format("if one of these were declared so many times as large: {}", smaller));
  std::vector<AdviceGroup> groups;
  if (const auto& remedy = advice.remedy)
    groups.push_back({remedy->turns ? "it would be judged" : "it might be judged", false, {remedy->what}});
  if (advice.inner) groups.push_back({"the inner bound", false, {Describe(*advice.inner)}});
  for (AdviceGroup* group : {&enough, &others, &not_enough})
    if (!group->clauses.empty()) groups.push_back(std::move(*group));
  return groups;
}

std::vector<std::vector<AbstentionAdvice>> AdviseAll(const std::vector<Abstentions>& runs, unsigned jobs,
                                                     double seconds, bool with_inner, const Shard& shard) {
  std::vector<std::vector<AbstentionAdvice>> advised(runs.size());
  std::vector<std::pair<std::size_t, std::size_t>> work;  // run, abstention
  std::map<const Config*, BrakingTails> tails;
  for (std::size_t run = 0; run < runs.size(); ++run) {
    const std::size_t count = runs[run].all.size();
    advised[run].assign(count, {});
    for (auto i = static_cast<std::size_t>(shard.index); i < count; i += static_cast<std::size_t>(shard.count))
      work.emplace_back(run, i);
    for (const auto& task : runs[run].tasks) tails[task.get()] = TailsOf(*task);
  }
  // Those that missed by least first: if time runs out, these were the likeliest to be turned.
  std::ranges::stable_sort(work, {}, [&](const auto& each) { return Shortfall(runs[each.first].all[each.second]); });
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  Progress progress("abstentions examined", work.size());
  ForEachInParallel(work.size(), jobs, [&](std::size_t k, std::size_t) {
    const auto [run, i] = work[k];
    const RecordedAbstention& abstention = runs[run].all[i];
    // One is searched in any case.
    if (k > 0 && std::chrono::duration<double>(Clock::now() - begin).count() > seconds)
      advised[run][i].missing = fmt::format(
          "not searched within {:g} s: `forereach advise` searches all, or write a longer --advice-seconds", seconds);
    else
      advised[run][i] = AdviceFor(abstention, tails.at(abstention.task), with_inner);
    progress.Advance();
  });
  return advised;
}

std::optional<InnerBound> BoundFromWithin(const Case& judged, const Certifier& certifier, const Tube& tube) {
  const Problem& problem = *judged.problem;
  const Declaration& declaration = problem.declaration;
  const Eigen::VectorXd center = judged.initial_set.CenterVector();
  Eigen::VectorXd half_width(center.size());
  for (Eigen::Index k = 0; k < center.size(); ++k)
    half_width[k] = judged.initial_set.Hull(static_cast<int>(k)).upper - center[k];
  // The corners of its hull are states of X0 only if X0 is a box.
  const bool is_box = ((judged.initial_set.GeneratorMatrix().array() != 0).colwise().count().array() <= 1).all();
  const auto varying = (declaration.lipschitz.array() > 0).rowwise().any().count();
  const Eigen::Index wide = (half_width.array() > 0).count();
  // What the inner bound is proven for (docs/soundness.md, 3.22), and few enough corners to try.
  if (!is_box || !declaration.affine.rows.empty() || !declaration.regions.empty() || declaration.HasErrorInZ() ||
      problem.projection.rows() != 2 || certifier.violation() || tube.length() == 0 ||
      problem.transitions.size() > kMostInnerObservations || std::max(varying, wide) > kMostInnerCoordinates)
    return std::nullopt;
  const ExtremalResiduals residuals(declaration,
                                    Observe(*problem.model, declaration, problem.transitions, problem.timing));
  // Slightly inside, so that the rounding of a corner does not lie outside.
  const Eigen::MatrixXd starts = CornersOf(center, (1 - 1e-12) * half_width);
  const std::vector<Eigen::MatrixXd> states = ExtremalRollouts(*problem.model, residuals, judged.plan(), starts);
  const int step = tube.length();
  InnerBound bound{step,
                   RadiusOf(problem, tube.slice(step)),
                   HalfSpread(problem.projection, states[static_cast<std::size_t>(step)]),
                   {}};
  const verifier::Verifier verifier(judged.problem, verifier::MethodOf(problem));
  for (const auto& [distance, column] : ClosestOf(judged, states)) {
    if (!(distance < 0)) break;
    verifier::Certificate claimed;
    claimed.initial_set.center = starts.col(column % starts.cols());
    claimed.initial_set.generators = Eigen::MatrixXd(center.size(), 0);
    claimed.controls = judged.controls;
    claimed.obstacles = judged.obstacles;
    claimed.schedule = judged.schedule;
    const auto failure = verifier.FindContact(claimed, residuals.UpperOf(static_cast<int>(column / starts.cols())));
    if (!failure) continue;
    bound.contact = fmt::format("at step {} it is not so that {}", failure->step, failure->what);
    break;
  }
  return bound;
}

std::string Describe(const InnerBound& bound) {
  std::string text = fmt::format("half-width at step {}: {} m; no sound tube is below {} m", bound.step,
                                 RoundedUp(bound.half_width), RoundedDown(bound.least));
  if (!bound.contact.empty())
    text += fmt::format(
        "; no sound method could certify this with these data: of a system that agrees with all of them, {}",
        bound.contact);
  return text;
}

AdviceOfRun& AdviceOfRun::operator+=(AdviceOfRun&& more) {
  std::ranges::move(more.advice, std::back_inserter(advice));
  return *this;
}

// What --json prints, and what people alone are shown. An infinite number is null.
void to_json(nlohmann::json& json, const AdviceOfRun& of_run) {
  json = nlohmann::json::array();
  for (const AbstentionAdvice& each : of_run.advice) {
    nlohmann::json& kept = json.emplace_back(each);
    for (std::size_t i = 0; i < each.advices.size(); ++i) kept["advice"][i]["smaller"] = each.advices[i].smaller;
  }
  json = ParseJson(JsonText(json));
}

namespace {

double NumberIn(const nlohmann::json& json) { return json.is_null() ? kInfinity : json.get<double>(); }

Advice AdviceOf(const nlohmann::json& json) {
  int change = 0;
  while (change < static_cast<int>(Change::kOutlier) && json.at("change") != Name(static_cast<Change>(change)))
    ++change;
  Advice advice;
  advice.change = static_cast<Change>(change);
  advice.what = json.at("what");
  advice.smaller = json.at("smaller");
  advice.amount = NumberIn(json.at("amount"));
  advice.turns = json.at("turns");
  advice.row = json.value("row", -1);
  advice.column = json.value("column", -1);
  advice.then = json.value("then", "");
  const auto place = json.value("place", std::vector<double>());
  advice.place = Eigen::Map<const Eigen::VectorXd>(place.data(), std::ssize(place));
  return advice;
}

}  // namespace

void from_json(const nlohmann::json& json, AdviceOfRun& of_run) {
  for (const nlohmann::json& kept : json) {
    AbstentionAdvice& advice = of_run.advice.emplace_back();
    for (const nlohmann::json& each : kept.at("advice")) advice.advices.push_back(AdviceOf(each));
    advice.missing = kept.value("missing", "");
    if (const auto remedy = kept.find("remedy"); remedy != kept.end())
      advice.remedy = Remedy{remedy->at("what"), remedy->at("turns"), remedy->value("key", ""),
                             remedy->contains("value") ? NumberIn(remedy->at("value")) : 0};
    if (const auto inner = kept.find("inner"); inner != kept.end())
      advice.inner = InnerBound{inner->at("step"), NumberIn(inner->at("half_width")), NumberIn(inner->at("least")),
                                inner->at("contact")};
  }
}

}  // namespace forereach
