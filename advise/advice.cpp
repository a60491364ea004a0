#include "advise/advice.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/certify/way_clear.h"
#include "forereach/numerics/least.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/residual/consistency.h"
#include "forereach/residual/observations.h"
#include "task/config_error.h"
#include "task/motion.h"

namespace forereach {
namespace {

// Of a search for the least change that turns a plan: to within a 256th of where it begins.
constexpr int kHalvings = 8;

struct Judgement {
  Decision decision;
  std::string sentence;

  [[nodiscard]] bool certified() const { return decision.outcome == Outcome::kCertified; }
};

Judgement JudgeBy(const Certifier& certifier, const Case& judged, Tube& tube) {
  certifier.Require(judged.plan(), judged.initial_set, judged.obstacles);
  const Decision decision = certifier.Certify(judged.plan(), judged.initial_set, judged.obstacles, tube);
  return {decision, Explain(decision, certifier, judged.obstacles, judged.plan(), tube)};
}

// A change that no certifier accepts turns nothing.
Judgement Judge(const Case& judged, Tube& tube) {
  try {
    return JudgeBy(Certifier(judged.problem), judged, tube);
  } catch (const std::invalid_argument& error) {
    return {{}, error.what()};
  }
}

template <class Edit>
Case WithProblem(Case changed, Edit edit) {
  auto problem = std::make_shared<Problem>(*changed.problem);
  edit(*problem);
  changed.problem = std::move(problem);
  return changed;
}

std::string StateName(const NominalModel& model, int k) { return model.state_names()[ToSize(k)]; }
std::string VariableName(const NominalModel& model, int l) { return model.variable_names()[ToSize(l)]; }

std::string Text(const Eigen::VectorXd& direction) {
  std::string text;
  for (const double entry : direction) text += (text.empty() ? "(" : ", ") + RoundedDown(entry, 2);
  return text + ")";
}

// Bounds of a domain that have to be wider, each with what it has to reach.
class Widening {
 public:
  Widening(const Domain& domain, const Declaration& declaration)
      : before_(domain), domain_(domain), declaration_(declaration) {}

  void Reach(const DomainExit& exit, double value) {
    switch (exit.kind) {
      case DomainExit::Kind::kLower:
      case DomainExit::Kind::kUpper: SetRange(exit.index, exit.kind == DomainExit::Kind::kLower, value); break;
      case DomainExit::Kind::kInequality: domain_.inequalities[ToSize(exit.index)].bound = value; break;
      case DomainExit::Kind::kBall: domain_.balls[ToSize(exit.index)].radius = value; break;
      case DomainExit::Kind::kNone: return;
    }
    exits_.insert({exit.kind, exit.index});
  }

  // Brings the wider ranges of states back to what the tube reaches before its last slice.
  void TightenTo(const Tube& tube) {
    for (const auto& [kind, index] : exits_) {
      const bool lower = kind == DomainExit::Kind::kLower;
      if ((!lower && kind != DomainExit::Kind::kUpper) || index >= domain_.state.dim()) continue;
      double reached = lower ? kInfinity : -kInfinity;
      for (int t = 0; t < tube.length(); ++t)
        reached = lower ? std::min(reached, tube.hull(t, index).lower) : std::max(reached, tube.hull(t, index).upper);
      SetRange(index, lower, reached);
    }
  }

  [[nodiscard]] std::string Describe(const NominalModel& model) const {
    std::string text;
    for (const auto& [kind, index] : exits_) {
      text += text.empty() ? "" : ", ";
      const auto [lower, upper] = domain_.Corners();
      switch (kind) {
        case DomainExit::Kind::kLower:
          text += fmt::format("{} from {}{}", VariableName(model, index), RoundedDown(lower[ToSize(index)]),
                              HowMuch(before_.Corners().first[ToSize(index)] - lower[ToSize(index)], index));
          break;
        case DomainExit::Kind::kUpper:
          text += fmt::format("{} to {}{}", VariableName(model, index), RoundedUp(upper[ToSize(index)]),
                              HowMuch(upper[ToSize(index)] - before_.Corners().second[ToSize(index)], index));
          break;
        case DomainExit::Kind::kInequality:
          text += fmt::format("inequality {} to {}", index, RoundedUp(domain_.inequalities[ToSize(index)].bound));
          break;
        case DomainExit::Kind::kBall:
          text += fmt::format("ball {} to the radius {}", index, RoundedUp(domain_.balls[ToSize(index)].radius));
          break;
        case DomainExit::Kind::kNone: break;
      }
    }
    return text;
  }

  [[nodiscard]] const Domain& domain() const { return domain_; }
  void Set(const Domain& domain) { domain_ = domain; }
  [[nodiscard]] std::size_t count() const { return exits_.size(); }

 private:
  // And what the declaration says of the residual along this variable, since it has to be true there, too.
  [[nodiscard]] std::string HowMuch(double more, int index) const {
    const bool has_slopes =
        index < declaration_.lipschitz.cols() && (declaration_.lipschitz.col(index).array() != 0).any();
    return fmt::format(" (by {}{})", RoundedUp(more, 4),
                       has_slopes ? ", with the slopes in it" : ", still without a slope in it");
  }

  void SetRange(int index, bool is_lower, double value) {
    Box& box = index < domain_.state.dim() ? domain_.state : domain_.input;
    const Eigen::Index l = index < domain_.state.dim() ? index : index - domain_.state.dim();
    Eigen::VectorXd lower = box.lower(), upper = box.upper();
    (is_lower ? lower : upper)[l] = value;
    box = Box(lower, upper);
  }

  const Domain before_;
  Domain domain_;
  const Declaration& declaration_;
  std::set<std::pair<DomainExit::Kind, int>> exits_;
};

// Where the declaration and the observations leave the residual at z, in plain arithmetic.
struct Allowed {
  Eigen::VectorXd lower, upper;

  Allowed(const Problem& problem, const Observations& known, const Eigen::VectorXd& z) {
    const Eigen::MatrixXd distance =
        (known.z.rowwise() - z.transpose()).cwiseAbs() * problem.declaration.lipschitz.transpose();  // N-by-n
    Eigen::VectorXd error(known.num_states());
    for (Eigen::Index k = 0; k < error.size(); ++k) error[k] = problem.declaration.ObservationError(k);
    lower = (known.lower - distance).colwise().maxCoeff().transpose() - error;
    upper = (known.upper + distance).colwise().minCoeff().transpose() + error;
  }

  // The middle, then ends: all corners if few coordinates have two, otherwise the two outer ones.
  [[nodiscard]] std::vector<Eigen::VectorXd> Outcomes() const {
    // A little inside: an end that rounding puts outside would contradict the declaration.
    const Eigen::VectorXd middle = (lower + upper) / 2, half = (upper - lower) / 2 * (1 - 1e-6);
    std::vector<Eigen::Index> wide;
    for (Eigen::Index k = 0; k < half.size(); ++k)
      if (half[k] > 1e-12) wide.push_back(k);
    std::vector<Eigen::VectorXd> outcomes{middle};
    if (wide.empty()) return outcomes;
    if (wide.size() > 4) return {middle, middle - half, middle + half};
    for (std::size_t bits = 0; bits < std::size_t{1} << wide.size(); ++bits) {
      Eigen::VectorXd corner = middle;
      for (std::size_t i = 0; i < wide.size(); ++i) corner[wide[i]] += (bits >> i & 1 ? 1 : -1) * half[wide[i]];
      outcomes.push_back(corner);
    }
    return outcomes;
  }
};

// One more transition, from z to f0(z) + residual.
void AddObservation(Problem& problem, const Eigen::VectorXd& z, const Eigen::VectorXd& residual) {
  Transitions& all = problem.transitions;
  const Eigen::Index row = all.z.rows();
  Eigen::VectorXd next(residual.size());
  problem.model->Evaluate({z.data(), ToSize(static_cast<int>(z.size()))},
                          {next.data(), ToSize(static_cast<int>(next.size()))});
  all.z.conservativeResize(row + 1, Eigen::NoChange);
  all.x_next.conservativeResize(row + 1, Eigen::NoChange);
  all.z.row(row) = z.transpose();
  all.x_next.row(row) = (next + residual).transpose();
  // As one that a robot has reported: the errors that are declared of these count.
  ++all.num_learned;
  if (all.longer.size() > 0) {
    all.longer.conservativeResize(row + 1);
    all.longer[row] = 0;
  }
}

class Adviser {
 public:
  Adviser(const Case& abstained, const Certifier& certifier)
      : case_(abstained), certifier_(certifier), model_(*abstained.problem->model) {
    judgement_ = JudgeBy(certifier_, case_, tube_);
  }

  std::vector<Advice> Run(const AdviceOptions& options) {
    const Decision& decision = judgement_.decision;
    switch (decision.outcome) {
      case Outcome::kFalsified:
        if (decision.cause == Cause::kPairwise) {
          AdviseLargerSlopes();
          AdviseNoise();
        }
        AdviseOutlier(decision.first_observation);
        AdviseOutlier(decision.second_observation);
        break;
      case Outcome::kSafety:
        if (decision.cause == Cause::kObstacle)
          AdviseObstacles();
        else
          AdviseLimits();
        AdviseTighterTube(options);
        break;
      case Outcome::kDomain:
        if (decision.cause == Cause::kDomainExit) AdviseDomain();
        if (decision.cause == Cause::kNoStop) AdviseRest();
        if (decision.cause != Cause::kBetween) AdviseTighterTube(options);
        break;
      case Outcome::kCertified:
      case Outcome::kNone: break;
    }
    std::stable_partition(advices_.begin(), advices_.end(), [](const Advice& advice) { return advice.turns; });
    return std::move(advices_);
  }

 private:
  [[nodiscard]] Judgement Judged(const Case& changed) {
    return changed.problem == case_.problem ? JudgeBy(certifier_, changed, scratch_) : Judge(changed, scratch_);
  }
  [[nodiscard]] bool Turns(const Case& changed) { return Judged(changed).certified(); }

  // Every advice ends here: it turns the plan only if a certifier says so.
  void Add(Advice advice) {
    advice.turns = true;
    for (const Case& changed : advice.after) {
      const Judgement judgement = Judged(changed);
      if (judgement.certified()) continue;
      advice.turns = false;
      advice.then = judgement.sentence;
      break;
    }
    advices_.push_back(std::move(advice));
  }

  void AdviseTighterTube(const AdviceOptions& options) {
    AdviseInitialSet();
    AdviseHorizon();
    if (options.tails) AdviseTail(options.tails);
    AdviseSmallerDeclaration();
    if (options.most_observations > 0) AdviseObservation(options.most_observations);
  }

  // ---- S

  // The obstacles are tested one by one against one tube, so each has a least distance of its own.
  void AdviseObstacles() {
    const auto ways = FindWayClear(certifier_, case_.plan(), case_.obstacles, tube_);
    if (!ways || ways->empty()) return;
    Case changed = case_;
    changed.obstacles = Shifted(case_.obstacles, *ways);
    double farthest = 0;
    std::string what;
    for (const GivingWay& way : *ways) {
      const double distance = way.shift.norm();
      farthest = std::max(farthest, distance);
      what += fmt::format("{}{} by {} m, to the side of {} (first touched at step {})", what.empty() ? "" : ", ",
                          NameOf(case_.obstacles, way.obstacle), RoundedUp(distance, 4), Text(way.shift / distance),
                          way.step);
    }
    Add({.change = Change::kObstacles,
         .what = fmt::format("if it passed farther away, or these stood farther away: {}", what),
         .amount = farthest,
         .after = {changed}});
  }

  void AdviseLimits() {
    Case changed = case_;
    std::set<int> wider;
    for (std::size_t i = 0; i < case_.problem->limits.size(); ++i) {
      const Judgement judgement = Judged(changed);
      const Decision& decision = judgement.decision;
      if (decision.cause != Cause::kLimit) break;
      if (!std::isfinite(decision.margin)) return;
      changed = WithProblem(changed, [&](Problem& problem) {
        Limit& limit = problem.limits[ToSize(decision.coordinate)];
        if (const auto reach = certifier_.limits().Reach(decision.coordinate, case_.plan(), tube_)) {
          limit.at_least = std::min(limit.at_least, reach->lower);  // both sides: the other one may be exceeded, too
          limit.at_most = std::max(limit.at_most, reach->upper);
        }
      });
      wider.insert(decision.coordinate);
    }
    std::string what;
    for (const int i : wider) {
      const Limit &before = case_.problem->limits[ToSize(i)], &now = changed.problem->limits[ToSize(i)];
      what += (what.empty() ? "" : ", ") + now.name;
      if (now.at_least != before.at_least) what += fmt::format(" at least {}", RoundedDown(now.at_least));
      if (now.at_most != before.at_most) what += fmt::format(" at most {}", RoundedUp(now.at_most));
    }
    Add({.change = Change::kLimits,
         .what = fmt::format("if its limits were wider: {}", what),
         .amount = static_cast<double>(wider.size()),
         .after = {changed}});
  }

  // ---- D

  void AdviseDomain() {
    constexpr int kRounds = 400;
    Widening wider(case_.problem->domain, case_.problem->declaration);
    const auto changed = [&] { return WithProblem(case_, [&](Problem& problem) { problem.domain = wider.domain(); }); };
    for (int i = 0; i < kRounds; ++i) {
      const Decision decision = Judged(changed()).decision;
      if (decision.cause != Cause::kDomainExit || !std::isfinite(decision.exit.value)) break;
      const double beyond = (decision.exit.value - decision.exit.bound) / 4;  // the next slices reach farther
      wider.Reach(decision.exit, decision.exit.value + beyond);
    }
    if (Turns(changed())) {
      const Domain loose = wider.domain();
      wider.TightenTo(scratch_);
      if (!Turns(changed())) wider.Set(loose);
    }
    Add({.change = Change::kDomain,
         .what = fmt::format("if the domain, and with it the declaration, reached farther: {}", wider.Describe(model_)),
         .amount = static_cast<double>(wider.count()),
         .after = {changed()}});
  }

  void AdviseRest() {
    Case changed = case_;
    for (std::size_t i = 0; i < case_.problem->rest.size(); ++i) {
      const Decision decision = Judged(changed).decision;
      if (decision.cause != Cause::kNoStop) break;
      const Interval reached = scratch_.hull(scratch_.length(), decision.coordinate);  // both sides have to be inside
      changed = WithProblem(changed, [&](Problem& problem) {
        for (RestBound& bound : problem.rest)
          if (bound.coordinate == decision.coordinate)
            bound.tolerance = std::max({bound.tolerance, reached.upper, -reached.lower});
      });
    }
    std::string what;
    int count = 0;
    for (std::size_t i = 0; i < changed.problem->rest.size(); ++i) {
      const RestBound& bound = changed.problem->rest[i];
      if (bound.tolerance == case_.problem->rest[i].tolerance) continue;
      what += fmt::format("{}{} up to {}", what.empty() ? "" : ", ", StateName(model_, bound.coordinate),
                          RoundedUp(bound.tolerance));
      ++count;
    }
    Add({.change = Change::kRest,
         .what = fmt::format("if standing allowed {} at its end", what),
         .amount = static_cast<double>(count),
         .after = {changed}});
  }

  // ---- S and D: a tighter tube, or a shorter one

  void AdviseInitialSet() {
    const Eigen::MatrixXd generators = case_.initial_set.GeneratorMatrix();
    const auto smaller = [&](double less) {
      Case changed = case_;
      changed.initial_set = Zonotope(case_.initial_set.CenterVector(), (1 - less) * generators);
      return changed;
    };
    const auto less = Least(1, kHalvings, [&](double amount) { return Turns(smaller(amount)); });
    const double factor = 1 - less.value_or(1);
    Add({.change = Change::kInitialSet,
         .what = factor > 0 ? fmt::format("from an initial set of {} times its half-widths", RoundedDown(factor, 3))
                            : "from the center of its initial set alone",
         .amount = factor,
         .after = {smaller(less.value_or(1))}});
  }

  void AdviseHorizon() {
    Case changed = case_;
    // The longest first: what is certified of a plan need not be certified of its beginning, which may not end at rest.
    for (Eigen::Index steps = case_.controls.cols() - 1; steps > 0; --steps) {
      changed.controls = case_.controls.leftCols(steps);
      if (!Turns(changed)) continue;
      return Add({.change = Change::kHorizon,
                  .what = fmt::format("with its first {} steps alone", steps),
                  .amount = static_cast<double>(steps),
                  .after = {changed}});
    }
  }

  // The progress part cut off earlier and earlier, each time with the tails that its nominal end asks for.
  void AdviseTail(const BrakingTails& tails) {
    const Eigen::Index most = kMaxSteps, steps = case_.controls.cols();
    const Eigen::Index progress =
        case_.progress_steps < 0 ? steps : std::min<Eigen::Index>(case_.progress_steps, steps);
    if (progress == 0) return;
    const std::vector<Eigen::VectorXd> nominal = NominalStates(progress - 1);
    for (Eigen::Index begin = std::ssize(nominal) - 1; begin >= 0; --begin)
      for (const Eigen::MatrixXd& tail : tails(nominal[ToSize(begin)])) {
        if (tail.rows() != case_.controls.rows() || begin + tail.cols() < 1 || begin + tail.cols() > most) continue;
        Case changed = case_;
        changed.controls.resize(Eigen::NoChange, begin + tail.cols());
        changed.controls.leftCols(begin) = case_.controls.leftCols(begin);
        changed.controls.rightCols(tail.cols()) = tail;
        changed.progress_steps = static_cast<int>(begin);
        if (!Turns(changed)) continue;
        return Add({.change = Change::kTail,
                    .what = fmt::format("with a braking tail from step {} on, of {} steps", begin, tail.cols()),
                    .amount = static_cast<double>(begin),
                    .after = {changed}});
      }
  }

  // From the center of X_0, in plain arithmetic, as long as they are finite: 0 .. last.
  [[nodiscard]] std::vector<Eigen::VectorXd> NominalStates(Eigen::Index last) const {
    std::vector<Eigen::VectorXd> states{case_.initial_set.CenterVector()};
    Eigen::VectorXd z(model_.num_variables()), next(model_.num_states());
    for (Eigen::Index t = 0; t < last; ++t) {
      z << states.back(), case_.controls.col(t);
      model_.Evaluate({z.data(), ToSize(model_.num_variables())}, {next.data(), ToSize(model_.num_states())});
      if (!next.allFinite()) break;
      states.push_back(next);
    }
    return states;
  }

  // Numbers of the declaration that may be declared smaller, all by one factor.
  struct Smaller {
    Change change;
    std::string name;
    std::function<void(Declaration&, double factor)> scale;
    int row = -1, column = -1;
  };

  [[nodiscard]] std::vector<Smaller> SmallerSlopes() const {
    constexpr std::size_t kMostEntries = 24;  // of a dense matrix only all together
    const Eigen::MatrixXd& lipschitz = case_.problem->declaration.lipschitz;
    std::vector<Smaller> slopes;
    for (int k = 0; k < lipschitz.rows(); ++k)
      for (int l = 0; l < lipschitz.cols(); ++l)
        if (lipschitz(k, l) > 0)
          slopes.push_back(
              {Change::kSlopes, fmt::format("the slope of {} in {}", StateName(model_, k), VariableName(model_, l)),
               [k, l](Declaration& declaration, double factor) { declaration.lipschitz(k, l) *= factor; }, k, l});
    if (slopes.size() > kMostEntries) slopes.clear();
    if (slopes.size() != 1 && !lipschitz.isZero(0))
      slopes.push_back({Change::kSlopes, "all slopes",
                        [](Declaration& declaration, double factor) { declaration.lipschitz *= factor; }});
    return slopes;
  }

  void AdviseSmallerDeclaration() {
    std::vector<Smaller> all = SmallerSlopes();
    const auto add = [&](Change change, const std::string& name, Eigen::VectorXd Declaration::*bounds) {
      if (!(case_.problem->declaration.*bounds).isZero(0))
        all.push_back(
            {change, name, [bounds](Declaration& declaration, double factor) { declaration.*bounds *= factor; }});
    };
    add(Change::kDisturbance, "disturbance", &Declaration::disturbance);
    add(Change::kLessNoise, "noise_bound", &Declaration::noise_bound);
    add(Change::kStateError, "state_error", &Declaration::state_error);
    for (const Smaller& each : all) {
      const auto smaller = [&](double less) {
        return WithProblem(case_, [&](Problem& problem) { each.scale(problem.declaration, 1 - less); });
      };
      // Below some factor the observations contradict the declaration.
      const double most = Least(1, kHalvings, [&](double kept) {
                            return Judged(smaller(1 - kept)).decision.outcome != Outcome::kFalsified;
                          }).value_or(1);
      if (most == 1) continue;
      const double less = Least(1 - most, 7, [&](double amount) { return Turns(smaller(amount)); }).value_or(1 - most);
      const std::string factor = RoundedDown(1 - less, 4);
      Add({.change = each.change,
           .what = fmt::format("if {} were declared {} times as large", each.name, factor),
           .smaller = fmt::format("{} {}", each.name, factor),
           .amount = 1 - less,
           .row = each.row,
           .column = each.column,
           .after = {smaller(less)}});
    }
  }

  // The centers of some slices before the failure, with their controls.
  void AdviseObservation(int most) {
    const Observations known =
        Observe(model_, case_.problem->declaration, case_.problem->transitions, case_.problem->timing);
    const int n = model_.num_states(),
              steps = std::min<int>(tube_.length() + 1, static_cast<int>(case_.controls.cols()));
    std::optional<Advice> best;
    for (int i = 0; i < std::min(most, steps); ++i) {
      const int t = std::min(most, steps) == 1 ? 0 : i * (steps - 1) / (std::min(most, steps) - 1);
      Eigen::VectorXd z(model_.num_variables());
      z << tube_.slice(t).CenterVector(), case_.controls.col(t);
      if (!IsWithin(*case_.problem, {z.data(), ToSize(z.size())}, true)) continue;
      const Allowed allowed(*case_.problem, known, z);
      std::vector<Case> after;
      for (const Eigen::VectorXd& outcome : allowed.Outcomes())
        after.push_back(WithProblem(case_, [&](Problem& problem) { AddObservation(problem, z, outcome); }));
      if (!Turns(after.front())) continue;
      std::string what =
          fmt::format("if one more transition were observed at {} (step {}), where the declaration leaves",
                      DescribePlace(*case_.problem, z), t);
      bool is_first = true;
      for (int k = 0; k < n; ++k) {
        if (!(allowed.upper[k] - allowed.lower[k] > 1e-12)) continue;
        what += fmt::format("{}{} +-{}", is_first ? " " : ", ", StateName(model_, k),
                            RoundedUp((allowed.upper[k] - allowed.lower[k]) / 2, 3));
        is_first = false;
      }
      if (is_first) what += " nothing open";
      Advice advice{.change = Change::kObservation,
                    .what = what,
                    .amount = static_cast<double>(after.size()),
                    .place = z,
                    .after = std::move(after)};
      if (std::ranges::all_of(advice.after, [&](const Case& changed) { return Turns(changed); })) {
        advice.what += "; tried with its middle and its ends";
        return Add(std::move(advice));
      }
      if (!best) best = std::move(advice);
    }
    if (!best) return;
    best->what += "; it turns with the middle outcome, not with each of its ends";
    Add(std::move(*best));
  }

  // ---- F

  // Each row that has a violating pair, for itself: the test takes the rows in their order.
  template <class Widen>
  std::optional<double> ForEachContradictingRow(Declaration& declaration, const Observations& known, Widen widen,
                                                std::string& what) {
    double largest = 0;
    while (const auto violation = FindViolation(declaration, known)) {
      const int row = violation->coordinate;
      const Declaration before = declaration;
      const auto amount = LeastFrom(1e-3 * widen.unit(before, row, *violation), 0x1p40, kHalvings, [&](double tried) {
        declaration = before;
        widen.apply(declaration, row, tried);
        const auto other = FindViolation(declaration, known);
        return !other || other->coordinate > row;
      });
      if (!amount) return std::nullopt;
      declaration = before;
      widen.apply(declaration, row, *amount);
      largest = std::max(largest, *amount);
      what += (what.empty() ? "" : ", ") + widen.describe(StateName(model_, row), *amount);
    }
    return largest;
  }

  template <class Widen>
  void AdviseWiderDeclaration(Change change, const std::string& begin, Widen widen) {
    if (judgement_.decision.first_observation < 0) return;  // no pair is at fault
    const Observations known =
        Observe(model_, case_.problem->declaration, case_.problem->transitions, case_.problem->timing);
    Declaration declaration = case_.problem->declaration;
    std::string what;
    const auto largest = ForEachContradictingRow(declaration, known, widen, what);
    if (!largest || what.empty()) return;
    Add({.change = change,
         .what = begin + what,
         .amount = widen.amount(*largest),
         .after = {WithProblem(case_, [&](Problem& problem) { problem.declaration = declaration; })}});
  }

  void AdviseLargerSlopes() {
    struct Widen {
      static double unit(const Declaration&, int, const Violation&) { return 1; }
      static void apply(Declaration& declaration, int row, double more) { declaration.lipschitz.row(row) *= 1 + more; }
      static std::string describe(const std::string& state, double more) {
        return fmt::format("those of {} times {}", state, RoundedUp(1 + more, 4));
      }
      static double amount(double more) { return 1 + more; }
    };
    AdviseWiderDeclaration(Change::kLargerSlopes, "if larger slopes were declared: ", Widen{});
  }

  void AdviseNoise() {
    struct Widen {
      static double unit(const Declaration&, int, const Violation& violation) {
        return violation.difference - violation.bound;
      }
      static void apply(Declaration& declaration, int row, double more) { declaration.noise_bound[row] += more; }
      static std::string describe(const std::string& state, double more) {
        return fmt::format("{} {} more", state, RoundedUp(more, 4));
      }
      static double amount(double more) { return more; }
    };
    AdviseWiderDeclaration(Change::kNoise, "if larger noise bounds were declared: ", Widen{});
  }

  void AdviseOutlier(int observation) {
    if (observation < 0 || observation >= case_.problem->transitions.size()) return;
    const Case changed = WithProblem(case_, [&](Problem& problem) {
      Transitions& all = problem.transitions;
      if (all.IsLearned(observation)) --all.num_learned;
      const Eigen::Index behind = all.z.rows() - observation - 1;
      all.z.middleRows(observation, behind) = all.z.bottomRows(behind).eval();
      all.x_next.middleRows(observation, behind) = all.x_next.bottomRows(behind).eval();
      all.z.conservativeResize(all.z.rows() - 1, Eigen::NoChange);
      all.x_next.conservativeResize(all.x_next.rows() - 1, Eigen::NoChange);
      if (all.longer.size() > 0) {
        all.longer.segment(observation, behind) = all.longer.tail(behind).eval();
        all.longer.conservativeResize(all.longer.size() - 1);
      }
    });
    Add({.change = Change::kOutlier,
         .what = fmt::format("without observation {}", observation),
         .amount = static_cast<double>(observation),
         .after = {changed}});
  }

  const Case& case_;
  const Certifier& certifier_;
  const NominalModel& model_;
  Judgement judgement_;
  Tube tube_, scratch_;  // of the case, and of the last change
  std::vector<Advice> advices_;
};

}  // namespace

const char* Name(Change change) {
  switch (change) {
    case Change::kObstacles: return "obstacles";
    case Change::kInitialSet: return "initial_set";
    case Change::kHorizon: return "horizon";
    case Change::kTail: return "tail";
    case Change::kSlopes: return "slopes";
    case Change::kDisturbance: return "disturbance";
    case Change::kLessNoise: return "less_noise";
    case Change::kStateError: return "state_error";
    case Change::kObservation: return "observation";
    case Change::kDomain: return "domain";
    case Change::kRest: return "rest";
    case Change::kLimits: return "limits";
    case Change::kLargerSlopes: return "larger_slopes";
    case Change::kNoise: return "noise";
    case Change::kOutlier: return "outlier";
  }
  return "";
}

ChangeKind KindOf(Change change) {
  switch (change) {
    case Change::kObstacles: return ChangeKind::kMove;
    case Change::kHorizon:
    case Change::kTail: return ChangeKind::kSlowDown;
    case Change::kInitialSet:
    case Change::kObservation:
    case Change::kOutlier: return ChangeKind::kData;
    default: return ChangeKind::kDeclaration;
  }
}

const char* Name(ChangeKind kind) {
  switch (kind) {
    case ChangeKind::kMove: return "move";
    case ChangeKind::kSlowDown: return "slow down";
    case ChangeKind::kData: return "data";
    case ChangeKind::kDeclaration: return "declaration";
  }
  return "";
}

std::string DescribePlace(const Problem& problem, const Eigen::VectorXd& z) {
  std::string text;
  for (Eigen::Index l = 0; l < z.size(); ++l)
    if ((problem.declaration.lipschitz.col(l).array() != 0).any() || problem.declaration.affine.DependsOn(l))
      text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", VariableName(*problem.model, static_cast<int>(l)),
                          RoundedDown(z[l], 4));
  return text.empty() ? "any place" : text;
}

std::vector<Advice> Advise(const Case& abstained, const Certifier& certifier, const AdviceOptions& options) {
  return Adviser(abstained, certifier).Run(options);
}

std::vector<Place> RankPlaces(const std::vector<Case>& cases, const std::vector<Eigen::VectorXd>& places,
                              std::size_t most) {
  std::vector<Place> ranked;
  if (cases.empty()) return ranked;
  const Case& first = cases.front();
  const Observations known =
      Observe(*first.problem->model, first.problem->declaration, first.problem->transitions, first.problem->timing);
  Tube tube;
  const std::size_t count = std::min(most, places.size());
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::VectorXd& z = places[i * places.size() / count];
    const Eigen::VectorXd middle = Allowed(*first.problem, known, z).Outcomes().front();
    const Case observed = WithProblem(first, [&](Problem& problem) { AddObservation(problem, z, middle); });
    const Certifier certifier(observed.problem);
    Place place{z};
    for (const Case& each : cases) {
      Case with = each;
      with.problem = observed.problem;
      place.turned += JudgeBy(certifier, with, tube).certified();
    }
    ranked.push_back(std::move(place));
  }
  std::ranges::stable_sort(ranked, std::ranges::greater{}, &Place::turned);
  return ranked;
}

BrakingTails TailsOf(const Config& task) {
  std::shared_ptr<const RobotMotion> motion;
  try {
    motion = std::make_shared<const RobotMotion>(task, Braking::kPlanned);
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

}  // namespace forereach
