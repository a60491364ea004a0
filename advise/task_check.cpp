#include "advise/task_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <random>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "forereach/certify/certifier.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/learned.h"
#include "forereach/certify/rates.h"
#include "forereach/certify/tube.h"
#include "forereach/declare/flow.h"
#include "forereach/dynamics/unbounded.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/residual/consistency.h"
#include "forereach/residual/no_nominal_value.h"
#include "forereach/residual/observations.h"
#include "forereach/residual/recorded_successor.h"
#include "forereach/safety/clearance.h"
#include "forereach/safety/grid_map.h"
#include "planner_bridge/reference.h"
#include "records/decision_json.h"
#include "records/outlines.h"
#include "task/config.h"
#include "task/document.h"
#include "task/motion.h"
#include "task/wrapped_angle.h"

namespace forereach {
namespace {

constexpr Eigen::Index kMostCompared = 1500;   // transitions: a million pairs
constexpr int kSamples = 2000;                 // of the domain, for the length of a step
constexpr double kTight = 0.8, kLoose = 0.02;  // shares of the declaration that are worth a remark
constexpr double kShareBeyond = 0.05;          // of the data's range
constexpr double kSuspect = 1 - 1e-9;          // of what is declared: worth a rigorous test
constexpr std::size_t kMostLines = 20;         // that a finding lists

std::string Up(double x) { return RoundedUp(x, 4); }
std::string Down(double x) { return RoundedDown(x, 4); }
std::string Count(Eigen::Index n, const char* what) { return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s"); }

class Examination final {
 public:
  explicit Examination(const TaskCheckOptions& options)
      : options_(options),
        file_(options.config),
        config_(LoadConfig(file_, TransitionsFile::kIgnore)),
        problem_(*config_.problem),
        model_(*config_.problem->model),
        names_(model_.variable_names()) {
    problem_.rest.clear();  // both are examined apart
    problem_.limits.clear();
    result_.states = model_.state_names();
    result_.period = config_.period;
    result_.rests_on = HypothesesOf(config_);
  }

  TaskCheck Run() {
    ReadPlan();
    ExamineKeys();
    ReadTransitions();
    if (result_.transitions > 0) ExamineData();
    // Emptied where a finding says that no observations can be made of them.
    if (problem_.transitions.size() > 0) ExamineTube();
    ExamineGoal();
    ExamineRobotStart();
    ExamineStops();
    ExamineSteps();
    Draw();
    std::stable_partition(result_.findings.begin(), result_.findings.end(),
                          [](const TaskFinding& finding) { return !finding.is_remark; });
    return std::move(result_);
  }

 private:
  void Add(const std::string& key, std::string what, std::string advice, bool is_remark = false) {
    result_.findings.push_back({file_.Place(key), std::move(what), std::move(advice), is_remark});
  }
  void Remark(const std::string& key, std::string what, std::string advice) {
    Add(key, std::move(what), std::move(advice), true);
  }
  [[nodiscard]] std::string ObstacleKey(std::size_t i) const {
    return i < config_.num_listed ? fmt::format("task.obstacles[{}]", i) : "task.keep_in";
  }
  [[nodiscard]] std::string ObstacleText(std::size_t i) const {
    const std::string& name = config_.obstacles[i].name();
    return ObstacleKey(i) + (name.empty() ? "" : fmt::format(" ({})", name));
  }

  [[nodiscard]] const Box& BoxOf(std::size_t l) const {
    return l < ToSize(model_.num_states()) ? problem_.domain.state : problem_.domain.input;
  }
  [[nodiscard]] Eigen::Index IndexIn(std::size_t l) const {
    return static_cast<Eigen::Index>(l) - (l < ToSize(model_.num_states()) ? 0 : model_.num_states());
  }
  [[nodiscard]] double Lower(std::size_t l) const { return BoxOf(l).lower()[IndexIn(l)]; }
  [[nodiscard]] double Upper(std::size_t l) const { return BoxOf(l).upper()[IndexIn(l)]; }
  [[nodiscard]] std::string DomainKey(std::size_t l, const char* end) const {
    return std::string("domain.") + (l < ToSize(model_.num_states()) ? "state." : "input.") + end;
  }

  void ReadPlan() {
    if (!options_.plan.empty()) {
      controls_ = LoadPlan(options_.plan, model_);
    } else {
      const PlannerOptions& planner = config_.planner;
      const int steps =
          options_.steps > 0 ? options_.steps : std::min(kMaxSteps, planner.progress_steps + planner.tail_steps);
      const Box& box = problem_.domain.input;
      controls_ = box.lower().cwiseMax(Eigen::VectorXd::Zero(box.dim()).cwiseMin(box.upper())).replicate(1, steps);
    }
    result_.planned_steps = static_cast<int>(controls_.cols());
  }

  [[nodiscard]] Plan PlanOf(int steps) const {
    const auto inputs = static_cast<int>(controls_.rows());
    return {controls_.data(), inputs, steps, inputs, ScheduleFromZero(config_, steps)};
  }

  // Keys without which a command or process refuses the task.
  void ExamineKeys() {
    try {
      RequireForCertifying(config_);
    } catch (const ConfigError&) {
      Add("task.between", "missing: it is not said when a certificate has to hold",
          "write `between: samples`, or bounds with which it holds at all times: `between: {acceleration: [...]}`");
    }
    if (config_.gate.obstacles == ObstaclesSource::kUnsaid)
      Remark(
          "gate.obstacles", "missing: no certifier starts on a bus with this task",
          "write `gate: {obstacles: bus}` if a sender repeats the obstacles, or `task` if those of this file are all");
    if (config_.gate.obstacles == ObstaclesSource::kBus && !config_.gate.obstacles_lost_ms)
      Remark("gate.obstacles_lost_ms", "missing: no certifier starts on a bus with this task",
             "write how long a plan may go on while the obstacles are unknown, in ms, or `never`");
    if (config_.gate.obstacles == ObstaclesSource::kTask && config_.obstacles.empty())
      Remark("gate.obstacles", "is `task`, and task.obstacles has none: every plan is clear of obstacles",
             "list the obstacles, or write `bus`");
  }

  void ReadTransitions() {
    result_.data = config_.transitions;
    std::error_code error;
    if (!std::filesystem::exists(result_.data, error)) {
      Add("transitions", fmt::format("{} does not exist", result_.data),
          fmt::format("record steps of the robot, or make some with the simulated one: forereach-robot-sim --config {} "
                      "--make-transitions {} --seed 1 --count 400",
                      options_.config, result_.data));
      return;
    }
    all_ = LoadTransitions(result_.data, model_);
    result_.transitions = all_.size();
    problem_.transitions = all_;
    try {
      ValidateDurations(problem_);
    } catch (const std::invalid_argument& refused) {
      throw ConfigError("{}: dt_error: {}", result_.data, refused.what());
    }
  }

  // ---- Data against the domain and the declaration.

  void ExamineData() {
    const auto n = ToSize(model_.num_variables());
    for (std::size_t l = 0; l < n; ++l) {
      const auto column = all_.z.col(static_cast<Eigen::Index>(l));
      const bool matters = (problem_.declaration.lipschitz.col(static_cast<Eigen::Index>(l)).array() > 0).any() ||
                           problem_.declaration.affine.DependsOn(static_cast<Eigen::Index>(l));
      result_.coordinates.push_back({names_[l], Lower(l), Upper(l), column.minCoeff(), column.maxCoeff(), matters});
    }
    KeepThoseInside();
    for (std::size_t l = 0; l < n; ++l) ExamineRange(l);
    if (rows_.empty()) return;
    if (const auto wrapped = FindWrappedAngle(model_, problem_.transitions)) {
      Add("model", fmt::format("{}: {}", LineOf(rows_[ToSize(wrapped->row)]), wrapped->what), wrapped->advice);
      problem_.transitions = {};
      return;
    }
    try {
      const Observations observations = Observe(model_, problem_.declaration, problem_.transitions, problem_.timing);
      ExamineDeclaration(observations);
      ExamineRates();
      ExamineCurvature();
    } catch (const AmbiguousAngle& error) {
      Add("transitions", fmt::format("{}: {}", LineOf(rows_[ToSize(error.row())]), error.what()),
          "the angle's unit has to be rad; a row of another unit, a lost step or a wrong model shows like this");
      problem_.transitions = {};
    } catch (const NoNominalValue& error) {
      Add("transitions", fmt::format("{}: {}", LineOf(rows_[ToSize(error.row())]), error.text()),
          "take such states out of the domain and the data, or change the model's equations or parameters");
      problem_.transitions = {};
    }
  }

  [[nodiscard]] std::string LineOf(Eigen::Index row) const { return fmt::format("{}:{}", result_.data, row + 2); }

  void KeepThoseInside() {
    std::vector<Eigen::Index> outside(problem_.domain.inequalities.size() + problem_.domain.balls.size(), 0);
    std::vector<Eigen::Index> first = outside, near_the_edge;
    for (Eigen::Index i = 0; i < all_.z.rows(); ++i) {
      const Eigen::VectorXd z = all_.z.row(i);
      const std::vector<Interval> point(z.begin(), z.end());
      const DomainExit exit = FindExit(problem_.domain, point);
      if (exit.kind == DomainExit::Kind::kNone)
        (IsWithin(problem_, {z.data(), ToSize(z.size())}, false) ? rows_ : near_the_edge).push_back(i);
      const bool is_ball = exit.kind == DomainExit::Kind::kBall;
      // Those beyond a range are ExamineRange's, with their values.
      if (!is_ball && exit.kind != DomainExit::Kind::kInequality) continue;
      const std::size_t which = ToSize(exit.index) + (is_ball ? problem_.domain.inequalities.size() : 0);
      if (outside[which]++ == 0) first[which] = i;
    }
    for (std::size_t which = 0; which < outside.size(); ++which) {
      if (outside[which] == 0) continue;
      const std::size_t inequalities = problem_.domain.inequalities.size();
      const std::string key = which < inequalities ? fmt::format("domain.inequalities[{}]", which)
                                                   : fmt::format("domain.balls[{}]", which - inequalities);
      Add(key, fmt::format("{} outside, the first in {}", Count(outside[which], "transition"), LineOf(first[which])),
          kWiden);
    }
    if (!near_the_edge.empty())
      Add("declaration",
          fmt::format("{} left out, the first in {}: within state_error and input_error it may be outside the domain, "
                      "where nothing is declared",
                      Count(std::ssize(near_the_edge), "transition"), LineOf(near_the_edge.front())),
          "widen the domain, if the declaration holds there", !rows_.empty());
    problem_.transitions = {all_.z(rows_, Eigen::all), all_.x_next(rows_, Eigen::all)};
    if (all_.longer.size() > 0) problem_.transitions.longer = all_.longer(rows_);
  }

  void ExamineRange(std::size_t l) {
    const auto column = all_.z.col(static_cast<Eigen::Index>(l));
    Eigen::Index least = 0, largest = 0;
    column.minCoeff(&least);
    column.maxCoeff(&largest);
    if (const Eigen::Index below = (column.array() < Lower(l)).count(); below > 0)
      Add(DomainKey(l, "lower"),
          fmt::format("{}: {} below {}, the least is {} in {}", names_[l], Count(below, "transition"), ToText(Lower(l)),
                      ToText(column[least]), LineOf(least)),
          kWiden);
    if (const Eigen::Index above = (column.array() > Upper(l)).count(); above > 0)
      Add(DomainKey(l, "upper"),
          fmt::format("{}: {} above {}, the largest is {} in {}", names_[l], Count(above, "transition"),
                      ToText(Upper(l)), ToText(column[largest]), LineOf(largest)),
          kWiden);
  }

  // The pairs of transitions that contradict a row of the declaration.
  struct Contradictions {
    std::vector<Violation> worst;  // at most kMostLines, the worst first
    std::int64_t count = 0;
    std::vector<int> of_each;  // of each transition
    double excess = 0;         // the largest by which one is more than the declaration allows
    double near = 0;           // the largest of two transitions at nearly the same place, which no slopes explain
    double errors = 0;         // what the declaration allows besides slopes
    double factor = 0;         // on the row's slopes with which none contradicts it; infinite if there is none

    static std::pair<double, double> Rank(const Violation& pair) {
      return {pair.bound > 0 ? pair.difference / pair.bound : kInfinity, pair.difference};
    }
    void Add(const Violation& pair, bool is_near) {
      ++count, ++of_each[ToSize(pair.first)], ++of_each[ToSize(pair.second)];
      const double more = SubUp(pair.difference, pair.bound);
      excess = std::max(excess, more);
      if (is_near) near = std::max(near, more);
      const double slopes = SubDown(pair.bound, errors);
      factor = std::max(factor, slopes > 0 ? DivUp(SubUp(pair.difference, errors), slopes) : kInfinity);
      worst.insert(std::ranges::upper_bound(worst, Rank(pair), std::greater{}, Rank), pair);
      if (worst.size() > kMostLines) worst.pop_back();
    }
  };

  // For each column on which row k may depend, or all if it is constant: 1 / its standard deviation; 0 for the others.
  [[nodiscard]] Eigen::VectorXd ScalesOf(const Observations& observations, Eigen::Index k) const {
    const auto row = problem_.declaration.lipschitz.row(k);
    Eigen::VectorXd scales = Eigen::VectorXd::Zero(row.size());
    for (Eigen::Index l = 0; l < row.size(); ++l) {
      const Eigen::ArrayXd about = observations.z.col(l).array() - observations.z.col(l).mean();
      const double deviation = std::sqrt(about.square().mean());
      if ((row[l] > 0 || row.isZero(0)) && deviation > 0) scales[l] = 1 / deviation;
    }
    return scales;
  }

  void ExamineDeclaration(const Observations& observations) {
    const Eigen::Index stride = 1 + (observations.size() - 1) / kMostCompared;
    result_.all_pairs = stride == 1;
    contradictions_.resize(result_.states.size());
    for (std::size_t k = 0; k < result_.states.size(); ++k) {
      const auto c = static_cast<Eigen::Index>(k);
      const Eigen::VectorXd residual = (observations.lower.col(c) + observations.upper.col(c)) / 2,
                            hidden = (observations.upper.col(c) - observations.lower.col(c)) / 2,
                            bounds = problem_.declaration.lipschitz.row(c).transpose(),
                            scales = ScalesOf(observations, c);
      const double errors = 2 * problem_.declaration.ObservationError(c);
      if (problem_.declaration.affine.Contains(c)) continue;  // the certifier judges them, not pairs
      Contradictions& found = contradictions_[k];
      found.of_each.resize(ToSize(observations.size()));
      found.errors = errors;
      TaskCheck::Row row{result_.states[k], errors > 0 || (bounds.array() > 0).any(), 0, 0, 0};
      for (Eigen::Index i = 0; i < observations.size(); i += stride)
        for (Eigen::Index j = i + stride; j < observations.size(); j += stride) {
          const auto apart = (observations.z.row(i) - observations.z.row(j)).cwiseAbs().transpose();
          const double used =
              std::abs(residual[i] - residual[j]) / (errors + bounds.dot(apart) + hidden[i] + hidden[j]);
          if (used > row.used) row = {row.name, row.is_declared, used, FileLine(i), FileLine(j)};
          if (!(used > kSuspect)) continue;
          if (const auto pair = TestPair(problem_.declaration, observations, static_cast<int>(i), static_cast<int>(j),
                                         static_cast<int>(k)))
            found.Add(*pair, scales.dot(apart) < kNearby);
        }
      result_.rows.push_back(row);
    }
  }

  // Rows that exceed one bound, in one finding, worst first.
  struct Exceeding {
    std::string key, begin;  // what is exceeded, up to the number of rows
    double bound;
    std::string advice;  // before the least bound that would do
    bool is_remark;
  };

  void AddExceeding(const Exceeding& what, std::vector<std::pair<double, int>> exceeding) {  // value, line
    if (exceeding.empty()) return;
    std::ranges::stable_sort(exceeding, std::greater{}, &std::pair<double, int>::first);
    std::string lines;
    for (std::size_t i = 0; i < std::min(exceeding.size(), kMostLines); ++i) {
      const auto& [value, line] = exceeding[i];
      lines += fmt::format("{}line {}: {}", i == 0 ? "" : ", ", line, Down(value)) +
               (what.bound > 0 ? fmt::format(" ({} times)", Down(DivDown(value, what.bound))) : "");
    }
    if (exceeding.size() > kMostLines) lines += fmt::format(", and {} more", exceeding.size() - kMostLines);
    Add(what.key,
        fmt::format("{} in {} of {}{}: {}", what.begin, Count(std::ssize(exceeding), "transition"), result_.data,
                    what.is_remark ? "" : ", so nothing can be certified", lines),
        fmt::format("{} {} at least", what.advice, Up(exceeding.front().first)), what.is_remark);
  }

  // Rows in which a state changes faster than is declared.
  void ExamineRates() {
    const RateBounds rates(problem_);
    std::vector<Eigen::VectorXd> shown;
    for (Eigen::Index i = 0; i < problem_.transitions.size() && !rates.bounds().empty(); ++i) {
      const Eigen::VectorXd z = problem_.transitions.z.row(i), next = problem_.transitions.x_next.row(i);
      shown.push_back(rates.Shown({z.data(), ToSize(z.size())}, {next.data(), ToSize(next.size())},
                                  problem_.transitions.Longer(i), false));
    }
    for (const RateBounds::Bound& bound : rates.bounds()) {
      const auto b = &bound - rates.bounds().data();
      std::vector<std::pair<double, int>> exceeding;
      for (std::size_t i = 0; i < shown.size(); ++i)
        if (shown[i][b] > bound.rate) exceeding.emplace_back(shown[i][b], FileLine(static_cast<Eigen::Index>(i)));
      const std::string& name = result_.states[ToSize(bound.state)];
      AddExceeding({bound.key, fmt::format("{} changes faster than {} a second", name, ToText(bound.rate)), bound.rate,
                    fmt::format("look at these lines and at the bound's unit, which is that of {} per second. If the "
                                "lines are right, declare",
                                name),
                    false},
                   std::move(exceeding));
    }
  }

  // Rows that curve more than is declared if the velocity at their begin is what the equations say: a remark, since no
  // key declares that it is (docs/soundness.md, 1).
  void ExamineCurvature() {
    const std::unique_ptr<Flow> flow = problem_.between ? MakeFlow(model_) : nullptr;
    if (!flow) return;
    Flow::Derivatives derivatives;
    for (Eigen::Index k = 0; k < problem_.projection.rows(); ++k) {
      const double bound = problem_.between->acceleration[k];
      std::vector<std::pair<double, int>> exceeding;
      for (Eigen::Index i = 0; i < problem_.transitions.size(); ++i) {
        const Eigen::VectorXd z = problem_.transitions.z.row(i);
        const double longer = problem_.transitions.Longer(i);
        const Interval dt(SubDown(config_.period, longer), AddUp(config_.period, longer));
        const std::vector<Interval> box = TrueBox(z);
        flow->Enclose(box, derivatives);
        Interval off(0.0);  // y(t + dt) - y(t) - dt y'(t)
        for (int l = 0; l < model_.num_states(); ++l)
          if (const double p = problem_.projection(k, l); p != 0)
            off += Interval(p) * (TrueNext(i, l) - box[ToSize(l)] - dt * derivatives.first[ToSize(l)].value);
        const double least = std::max({off.lower, -off.upper, 0.0});
        const double shown = (Interval(2) * Interval(least) / (dt * dt)).lower;
        if (shown > bound) exceeding.emplace_back(shown, FileLine(i));
      }
      AddExceeding(
          {"task.between.acceleration",
           fmt::format("coordinate {} curves by more than {} m/s^2, if its velocity is what the equations say,", k,
                       ToText(bound)),
           bound, "look at these lines and at the bound's unit; if the equations' velocity is the robot's, declare",
           true},
          std::move(exceeding));
    }
  }

  [[nodiscard]] bool IsExact() const { return problem_.declaration.given_are_exact; }
  [[nodiscard]] std::vector<Interval> TrueBox(const Eigen::VectorXd& z) const {
    const std::span<const double> recorded(z.data(), ToSize(z.size()));
    return IsExact() ? std::vector<Interval>(recorded.begin(), recorded.end())
                     : problem_.declaration.BoxAround(recorded);
  }
  [[nodiscard]] Interval TrueNext(Eigen::Index i, int l) const {
    return EncloseSuccessor(problem_.declaration, l, problem_.transitions.x_next(i, l), model_.IsAngle(l), IsExact());
  }

  [[nodiscard]] int FileLine(Eigen::Index i) const { return static_cast<int>(rows_[ToSize(i)]) + 2; }

  void RemarkOnSlack() {
    std::string loose;
    double most = 0;
    for (const TaskCheck::Row& row : result_.rows) {
      if (!row.is_declared) continue;
      if (row.used > kTight)
        Remark(RowKey(row.name),
               fmt::format("{}: the data use {} % of what is declared (lines {} and {} of {}): a new transition may "
                           "contradict it, and stop the robot",
                           row.name, Up(100 * row.used), row.first, row.second, result_.data),
               "declare more than the data show, unless the bound is proven");
      if (row.used < kLoose) loose += (loose.empty() ? "" : ", ") + row.name, most = std::max(most, row.used);
    }
    if (most > 0)
      Remark("declaration.lipschitz",
             fmt::format("{}: the data use at most {} % of what is declared: if that is all there is, the tubes are "
                         "wider than they have to be",
                         loose, Up(100 * most)),
             "declare less, if you have a reason beyond these data");
  }

  [[nodiscard]] std::string RowKey(const std::string& state) const {
    const std::string key = "declaration.lipschitz";
    return file_.root()["declaration"]["lipschitz"].Has(state) ? key + "." + state : key;
  }

  // ---- The tube of the plan, and where it leads.

  void ExamineTube() {
    std::optional<Certifier> certifier;
    const Zonotope initial_set = Zonotope::Enclose(config_.initial_set);
    const Plan plan = PlanOf(result_.planned_steps);
    try {
      certifier.emplace(std::make_shared<const Problem>(problem_));
      certifier->Require(plan, initial_set, config_.obstacles);
    } catch (const std::invalid_argument& error) {
      Add("task", error.what(), "correct it");
      return;
    }
    if (certifier->violation()) {
      if (certifier->violation()->second != -1) ExplainViolation(*certifier);  // else ExamineRates did
      return;
    }
    RemarkOnSlack();
    if (const std::string flat = certifier->Unexcited(); !flat.empty())
      return Add("declaration.affine", fmt::format("{}, and nothing is certified without one", flat),
                 "record steps that vary it, or leave a column out on which the residual does not depend");
    Tube tube;
    const Decision decision = certifier->Certify(plan, initial_set, {}, tube);
    result_.tube = Explain(decision, *certifier, {}, plan, tube);
    for (int t = 0; t <= tube.length(); ++t) {
      const Zonotope& slice = tube.slice(t);
      std::vector<double>& widths = result_.half_widths.emplace_back();
      for (int k = 0; k < model_.num_states(); ++k) widths.push_back(slice.HalfWidthUpper(k));
    }
    ExamineEnd(decision, tube);
    ExamineSmoothing(decision, plan, tube);
    ExamineRest(*certifier, plan);
    ExamineLimits(plan, initial_set);
    ExamineStart(*certifier, initial_set);
    ExamineCoverage(tube);
    if (problem_.projection.rows() == 2) AddTube(*certifier, tube);
  }

  void ExplainPairs(std::size_t k, const Contradictions& found) {
    const std::string& name = result_.states[k];
    const Violation& worst = found.worst.front();
    const auto lines = [&](const Violation& pair) {
      return fmt::format("lines {} and {}", FileLine(pair.first), FileLine(pair.second));
    };
    std::string what = fmt::format(
        "{}: {} of {} differ in the model's error by {}, and the declaration allows {}: it is false, and nothing can "
        "be certified",
        name, lines(worst), result_.data, Down(worst.difference), Up(worst.bound));
    if (found.count > 1) {
      const auto most = std::ranges::max_element(found.of_each);
      const auto involved = std::ssize(found.of_each) - std::ranges::count(found.of_each, 0);
      what +=
          fmt::format(". It is contradicted by {} pairs{}{}: ", found.count, result_.all_pairs ? "" : " of a sample",
                      *most * involved < 4 * found.count  // twice the mean
                          ? ""
                          : fmt::format(", {} of them with line {}", *most, FileLine(most - found.of_each.begin())));
      for (const Violation& pair : found.worst)
        what += fmt::format("{}{}{}", &pair == &worst ? "" : ", ", lines(pair),
                            pair.bound > 0 ? fmt::format(" ({} times)", Down(DivDown(pair.difference, pair.bound)))
                                           : ": " + Down(pair.difference));
      if (found.count > std::ssize(found.worst))
        what += fmt::format(", and {} more", found.count - std::ssize(found.worst));
    }
    const auto c = static_cast<Eigen::Index>(k);
    const Declaration& declaration = problem_.declaration;
    const std::string noise =
        fmt::format("noise_bound of {} at least {}", name, Up(AddUp(declaration.noise_bound[c], found.excess / 2)));
    std::string advice = "look at these lines, and whether model.dt is the step of the data. If they are right, ";
    if (found.near > 0) {
      advice += fmt::format(
          "the robot does not always do the same at nearly the same place, which no slope explains: declare a "
          "disturbance of {} of at least {}, or what `forereach declare --from-data` proposes; only if the sensor errs "
          "by so much, {}",
          name, Up(AddUp(declaration.DisturbanceBound(c), found.near / 2)), noise);
    } else {
      advice += fmt::format("declare more: {}, or this row larger{}", noise,
                            found.factor < kInfinity ? fmt::format(" by a factor of {}", Up(found.factor)) : "");
    }
    Add(RowKey(name), what, advice);
  }

  // Of a pair, or of one step in a region, that contradicts the declaration.
  void ExplainViolation(const Certifier& certifier) {
    const Violation& violation = *certifier.violation();
    const auto k = ToSize(violation.coordinate);
    const std::string& name = result_.states[k];
    if (const int region = Violation::RegionOf(violation.second); region >= 0)
      return Add(
          fmt::format("declaration.regions[{}].bound.{}", region, name),
          fmt::format("line {} of {} shows a residual of at least {} in size, and {} is declared: one of these is "
                      "false, and nothing can be certified",
                      FileLine(violation.first), result_.data, Down(violation.difference), ToText(violation.bound)),
          "look at this line. If it is right, declare more, or end the box before it");
    if (problem_.declaration.affine.Contains(violation.coordinate)) {
      std::vector<int> lines;
      for (const int i : certifier.Contradicting()) lines.push_back(FileLine(i));
      return Add(
          "declaration.affine",
          fmt::format("{}: no affine residual agrees with lines {} of {}: {}. The declaration is false, and nothing "
                      "can be certified",
                      name, fmt::join(lines, ", "), result_.data,
                      violation.bound > 0
                          ? fmt::format("one of its slopes is {} at least, declaration.lipschitz says {} at most",
                                        Down(violation.difference), ToText(violation.bound))
                          : fmt::format("one is {} off what the others allow", Down(violation.difference))),
          "look at these lines, and whether model.dt is the step of the data. If they are right, bound this row "
          "by declaration.lipschitz, or declare more noise_bound");
    }
    const auto z = [&](int i) { return problem_.transitions.z.row(i); };
    const double by_slopes = 2 * problem_.declaration.ObservationError(violation.coordinate) +
                             problem_.declaration.lipschitz.row(violation.coordinate)
                                 .dot((z(violation.first) - z(violation.second)).cwiseAbs());
    if (violation.difference <= by_slopes)
      return Add(
          "declaration.regions",
          fmt::format("{}: lines {} and {} of {} differ in the model's error by {}, and on the cheapest way found "
                      "between them the regions allow {}: one of these is false, and nothing can be certified",
                      name, FileLine(violation.first), FileLine(violation.second), result_.data,
                      Down(violation.difference), Up(violation.bound)),
          "look at these lines. If they are right, declare more in the regions between them, or make these "
          "smaller: declaration.lipschitz alone allows the difference");
    if (contradictions_[k].count == 0)  // of a pair that is in no sample
      contradictions_[k].Add(violation, false);
    for (std::size_t row = 0; row < contradictions_.size(); ++row)
      if (contradictions_[row].count > 0) ExplainPairs(row, contradictions_[row]);
  }

  // A plan of its own has to be certified as a whole; without one, its progress part.
  [[nodiscard]] int StepsThatCount() const {
    return options_.plan.empty() ? std::min(result_.planned_steps, config_.planner.progress_steps)
                                 : result_.planned_steps;
  }

  void ExamineEnd(const Decision& decision, const Tube& tube) {
    if (decision.outcome == Outcome::kCertified) return;
    const bool is_remark = tube.length() >= StepsThatCount();
    std::string key = "domain", advice = options_.plan.empty() ? "" : "change the plan, or ";
    if (decision.cause == Cause::kNoFiniteEnclosure) {
      key = "model";
      advice +=
          "keep the domain and task.initial_set away from where the equations have no bound (docs/expressions.md, "
          "\"Kinks and poles\")";
    } else if (decision.cause == Cause::kBetween) {
      key = KeyOfRate(problem_, decision.coordinate);
      advice += "declare a larger rate, in the unit of the state per second";
    } else {
      if (decision.exit.kind == DomainExit::Kind::kLower || decision.exit.kind == DomainExit::Kind::kUpper)
        key =
            DomainKey(ToSize(decision.exit.index), decision.exit.kind == DomainExit::Kind::kLower ? "lower" : "upper");
      advice += fmt::format("widen the domain, if the declaration holds there{}", NarrowerTube(tube));
    }
    Add(key,
        fmt::format("the tube of {}, without obstacles, ends at step {}: {}", PlanName(), tube.length(), result_.tube),
        advice, is_remark);
  }

  // The widest slice is mostly the last.
  void ExamineSmoothing(const Decision& decision, const Plan& plan, const Tube& tube) {
    const int t = std::min(tube.length(), plan.num_steps - 1);
    std::vector<Interval> box;
    for (int k = 0; k < model_.num_states(); ++k) box.push_back(tube.hull(t, k));
    for (const double u : plan.input(t)) box.emplace_back(u);
    for (const SharpSmoothing& sharp : FindSharp(model_, box)) {
      const std::string argument = sharp.argument.empty() ? "its argument" : sharp.argument;
      Add("model",
          fmt::format("{} at line {}, column {} smooths the absolute value of {} within {}, and at step {} {} may be "
                      "anywhere in [{}, {}]: its second derivative there reaches {}, and the bound on it widens "
                      "the tube",
                      sharp.operation, sharp.line, sharp.column, argument, Up(sharp.width), t, argument,
                      Down(sharp.range.lower), Up(sharp.range.upper), Down(1 / sharp.width)),
          sharp.is_square ? fmt::format("write signed_square({0}) for {0} times it: the same without smoothing, with a "
                                        "second derivative of at most 2",
                                        sharp.argument.empty() ? "a" : sharp.argument)
                          : "smooth over a wider range, as far as the declaration of the residual allows; a number "
                            "times its own absolute value is signed_square",
          decision.outcome == Outcome::kCertified);
    }
  }

  [[nodiscard]] std::string PlanName() const {
    return options_.plan.empty() ? "the plan with the inputs closest to zero" : options_.plan;
  }

  // Which part of the residual's bounds is the widest, compared with the domain.
  [[nodiscard]] std::string NarrowerTube(const Tube& tube) const {
    if (tube.length() == 0) return "";
    std::size_t widest = 0;
    double share = 0, half = 0;
    for (std::size_t k = 0; k < result_.states.size(); ++k) {
      const double width = ResidualOver(tube, tube.length() - 1, static_cast<int>(k)).HalfWidthUpper();
      if (const double of = width / std::max(Upper(k) - Lower(k), 1e-300); of > share)
        widest = k, share = of, half = width;
    }
    return share == 0 ? ""
                      : fmt::format(
                            "; or make the tube narrower: there the error of {} in one step is only known up to {}, "
                            "from a declaration that is too wide, or from data that are too far away",
                            result_.states[widest], Up(half));
  }

  // From task.initial_set, or the planner's X0 where that is wider.
  void ExamineRest(const Certifier& certifier, const Plan& plan) {
    if (config_.problem->rest.empty()) return;
    const Box& given = config_.initial_set;
    const std::vector<double>& of_planner = config_.planner.initial_half_width;
    Eigen::VectorXd center = (given.lower() + given.upper()) / 2, most = (given.upper() - given.lower()) / 2;
    std::string from;
    for (Eigen::Index k = 0; !config_.planner.goal.empty() && k < std::min(most.size(), std::ssize(of_planner)); ++k) {
      const double half = of_planner[ToSize(k)] + config_.problem->declaration.VariableError(static_cast<int>(k));
      if (half > most[k] * (1 + 1e-9)) from = " from planner.initial_half_width and declaration.state_error";
      most[k] = std::max(most[k], half);
    }
    Tube tube;
    static_cast<void>(certifier.Certify(plan, Zonotope::Enclose(Box(center - most, center + most)), {}, tube));
    for (const RestBound& bound : config_.problem->rest) {
      const std::string name = result_.states[ToSize(bound.coordinate)];
      for (int t = 0; t <= tube.length(); ++t) {
        const double half = tube.slice(t).HalfWidthUpper(bound.coordinate);
        if (half <= bound.tolerance) continue;
        Add("task.rest",
            fmt::format("{} is known only up to {} after {}{}, and standing is at most {}: a plan of that length does "
                        "not provably end at rest",
                        name, Up(half), Count(t, "step"), from, ToText(bound.tolerance)),
            fmt::format("raise the bound of {}, if the robot's brakes take up what is left; or make the tube narrower",
                        name),
            t > StepsThatCount());
        break;
      }
    }
  }

  void ExamineLimits(const Plan& plan, const Zonotope& initial_set) {
    if (config_.problem->limits.empty()) return;
    auto problem = std::make_shared<Problem>(problem_);
    problem->limits = config_.problem->limits;
    const Certifier certifier(problem);
    Tube tube;
    const Decision decision = certifier.Certify(plan, initial_set, {}, tube);
    if (decision.cause == Cause::kLimit)
      Add(fmt::format("task.limits[{}]", decision.coordinate),
          fmt::format("the tube of {}: {}", PlanName(), Explain(decision, certifier, {}, plan, tube)),
          "change the start or the plan, raise the bound, or make the tube narrower",
          decision.step >= StepsThatCount());
  }

  void ExamineStart(const Certifier& certifier, const Zonotope& initial_set) {
    Tube tube;
    for (std::size_t i = 0; i < config_.obstacles.size(); ++i) {
      const Obstacle& obstacle = config_.obstacles[i];
      const Decision decision = certifier.Certify(PlanOf(1), initial_set, {&obstacle, 1}, tube);
      if (decision.outcome == Outcome::kSafety && decision.step == 0)
        Add(ObstacleKey(i),
            fmt::format("the robot {} at the start: the proven distance is {} m, and {} m are needed",
                        obstacle.name().empty() ? "may touch it" : MayTouch({&obstacle, 1}, 0), Down(decision.margin),
                        Up(decision.threshold)),
            "move task.initial_set or the obstacle, or make them smaller");
    }
  }

  // Where the plan leads to values on which the residual depends, and of which there are no data.
  void ExamineCoverage(const Tube& tube) {
    for (std::size_t l = 0; l < result_.coordinates.size(); ++l) {
      const TaskCheck::Coordinate& coordinate = result_.coordinates[l];
      if (!coordinate.matters) continue;
      double farthest = 0, place = coordinate.least;
      int step = 0;
      for (int t = 0; t < tube.length(); ++t) {
        const double value =
            l < ToSize(model_.num_states()) ? tube.slice(t).center(static_cast<int>(l)) : controls_(IndexIn(l), t);
        if (const double away = Beyond(coordinate, value); away > farthest) farthest = away, place = value, step = t;
      }
      RemarkOnData(coordinate, place, "transitions", fmt::format("at step {} {}", step, PlanName()),
                   "record steps there");
    }
  }

  [[nodiscard]] static double Beyond(const TaskCheck::Coordinate& data, double value) {
    return std::max(data.least - value, value - data.largest);
  }

  // If `value` of a coordinate on which the residual depends is beyond its data.
  void RemarkOnData(const TaskCheck::Coordinate& data, double value, const std::string& key, const std::string& what,
                    const char* advice) {
    if (!data.matters || !(Beyond(data, value) > kShareBeyond * (data.largest - data.least))) return;
    Remark(key,
           fmt::format("{}: {} is {} beyond the data, which lie in [{}, {}]: the further, the wider the tube",
                       data.name, what, Up(Beyond(data, value)), Down(data.least), Up(data.largest)),
           advice);
  }

  // ---- Goal, start, brakes, and the length of a step.

  void ExamineRobotStart() {
    const std::vector<double>& start = config_.robot.start;
    if (start.empty()) return;
    for (std::size_t k = 0; k < start.size(); ++k)
      if (!model_.IsAngle(static_cast<int>(k)) && !(Lower(k) <= start[k] && start[k] <= Upper(k)))
        Add("robot.start",
            fmt::format("{} begins at {}, and the domain is [{}, {}]: no plan is found from there", result_.states[k],
                        ToText(start[k]), ToText(Lower(k)), ToText(Upper(k))),
            "begin in the domain, or widen it, if the declaration holds there");
    const std::vector<double>& most = config_.planner.initial_half_width;
    const bool is_driven = !config_.planner.goal.empty() && (config_.robot.hold || model_.text() == nullptr);
    for (const int k : is_driven ? HeldStates(config_) : std::vector<int>())
      if (ToSize(k) < most.size() && !(std::abs(start[ToSize(k)]) <= most[ToSize(k)]))
        Remark("robot.start",
               fmt::format("{} begins at {}, and robot.hold names it: the simulated robot stands at its start, so "
                           "`forereach run` refuses it",
                           result_.states[ToSize(k)], ToText(start[ToSize(k)])),
               "begin with 0");
    const BodyPlaces places(model_, problem_.projection, problem_.body);
    const std::vector<BodyPart> parts = places.At({start.data(), start.size()});
    for (std::size_t i = 0; i < config_.obstacles.size(); ++i) {
      const Obstacle& obstacle = config_.obstacles[i];
      const auto touches = [&](const BodyPart& part) { return !(ApproximateDistance(obstacle, part) > 0); };
      if (!obstacle.motion() && std::ranges::any_of(parts, touches))
        Add("robot.start", fmt::format("the robot touches {} there", ObstacleText(i)),
            "begin where the robot is clear, or move the obstacle");
    }
  }

  void ExamineStops() {
    if (config_.laws.stop.empty() || config_.planner.source != "ompl") return;
    try {
      ExamineStop(RobotMotion(config_, Braking::kPlanned), "planner.stop", config_.planner.tail_steps,
                  " (planner.tail_steps): no plan is found from a robot that moves");
      if (!config_.laws.emergency_stop.empty())
        ExamineStop(RobotMotion(config_, Braking::kHardest), "planner.emergency_stop", kMaxSteps,
                    ": no stop is found for a robot whose plan is withdrawn");
    } catch (const ConfigError& error) {
      Remark("planner.stop", fmt::format("no planner starts with this task: {}", error.what()), "correct it");
    }
  }

  // Whether the robot stops from some state at least in which it does not rest, near or far from task.initial_set.
  // The seed is fixed, here and below, so that a task gets one answer.
  void ExamineStop(const RobotMotion& motion, const char* key, int most, const char* consequence) {
    std::mt19937_64 random(1);
    const Eigen::VectorXd center = (config_.initial_set.lower() + config_.initial_set.upper()) / 2;
    int samples = 0;
    for (int sample = 1; sample <= kSamples; ++sample) {
      std::array<double, kMaxVariables> z = StateAndInput(random, false);
      for (int k = 0; k < model_.num_states(); ++k)
        z[ToSize(k)] = center[k] + (z[ToSize(k)] - center[k]) * sample / kSamples;
      const std::span<const double> x(z.data(), ToSize(model_.num_states()));
      if (!problem_.domain.Contains({z.data(), ToSize(model_.num_variables())}) || motion.IsAtRest(x)) continue;
      ++samples;
      if (Stops(motion, x, most)) return;
    }
    if (samples > 0)
      Add(key,
          fmt::format("from none of {} states in the domain it brings the robot to rest inside the domain within {}{}",
                      samples, Count(most, "step"), consequence),
          "look whether the law has a value there and rest is in the domain; brake harder, allow more steps, or raise "
          "planner.at_rest");
  }

  [[nodiscard]] bool Stops(const RobotMotion& motion, std::span<const double> x, int most) const {
    Eigen::MatrixXd tail;
    for (int way = 0; way < motion.num_tails(); ++way) {
      if (!motion.Brake(x, way, most, tail)) continue;
      const Eigen::MatrixXd states = Rollout(model_, Eigen::Map<const Eigen::VectorXd>(x.data(), std::ssize(x)), tail);
      bool is_inside = true;
      for (Eigen::Index t = 0; t < tail.cols(); ++t) {
        Eigen::VectorXd z(model_.num_variables());
        z << states.col(t + 1), tail.col(t);
        is_inside = is_inside && problem_.domain.Contains({z.data(), ToSize(z.size())});
      }
      if (is_inside) return true;
    }
    return false;
  }

  // At random in the domain's ranges, or in a corner.
  [[nodiscard]] std::array<double, kMaxVariables> StateAndInput(std::mt19937_64& random, bool in_corner) const {
    std::uniform_real_distribution<double> uniform(0, 1);
    std::array<double, kMaxVariables> z{};
    for (std::size_t l = 0; l < ToSize(model_.num_variables()); ++l) {
      const double at = in_corner ? std::round(uniform(random)) : uniform(random);
      z[l] = Lower(l) + at * (Upper(l) - Lower(l));
    }
    return z;
  }

  void ExamineGoal() {
    const std::vector<double>& goal = config_.planner.goal;
    if (goal.empty()) return;
    const Eigen::Map<const Eigen::VectorXd> place(goal.data(), std::ssize(goal));
    for (Eigen::Index r = 0; r < problem_.projection.rows(); ++r) {
      Eigen::Index state = 0;
      const auto row = problem_.projection.row(r);
      if (row.cwiseAbs().sum() != 1 || row.maxCoeff(&state) != 1) continue;
      const auto k = ToSize(state);
      if (!(goal[ToSize(r)] >= Lower(k) && goal[ToSize(r)] <= Upper(k)))
        Add("planner.goal",
            fmt::format("{}: {} is outside [{}, {}] of the domain: no certified plan gets there", names_[k],
                        ToText(goal[ToSize(r)]), ToText(Lower(k)), ToText(Upper(k))),
            "move the goal, or widen the domain, if the declaration holds there");
      if (k < result_.coordinates.size())  // none without data
        RemarkOnData(result_.coordinates[k], goal[ToSize(r)], "planner.goal", ToText(goal[ToSize(r)]),
                     "record steps on the way there");
    }
    for (std::size_t i = 0; HasFrame(problem_.body) && i < config_.obstacles.size(); ++i)
      if (!config_.obstacles[i].motion() &&
          -ApproximateDistance(config_.obstacles[i], place) >= config_.planner.goal_radius)
        Add("planner.goal", fmt::format("{} covers the goal", ObstacleText(i)), "move one of them");
  }

  // The longest way of a point of the body in one nominal step, of those tried; a lower bound.
  [[nodiscard]] double LongestStep() const {
    const BodyPlaces places(model_, problem_.projection, problem_.body);
    std::mt19937_64 random(1);
    const auto n = ToSize(model_.num_states()), all = ToSize(model_.num_variables());
    double longest = 0;
    for (int sample = 0; sample < kSamples; ++sample) {
      // The longest steps are mostly in corners, and points at random are hardly ever near one.
      const std::array<double, kMaxVariables> z = StateAndInput(random, sample % 2 == 1);
      std::array<double, kMaxStates> next{};
      if (!problem_.domain.Contains({z.data(), all})) continue;
      model_.Evaluate({z.data(), all}, {next.data(), n});
      const std::vector<BodyPart> before = places.At({z.data(), n}), after = places.At({next.data(), n});
      for (std::size_t part = 0; part < before.size(); ++part)
        for (std::size_t point = 0; point < before[part].points.size(); ++point) {
          const double length = (after[part].points[point] - before[part].points[point]).norm();
          if (length > longest && std::isfinite(length)) longest = length;
        }
    }
    return longest;
  }

  [[nodiscard]] double LeastExtent(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) const {
    double extent = upper[0] - lower[0];
    for (Eigen::Index k = 1; k < problem_.projection.rows(); ++k) extent = std::min(extent, upper[k] - lower[k]);
    return extent;
  }

  // The least extent along an axis of the largest part; of a part at expressions, its diameter.
  [[nodiscard]] double BodyThickness() const {
    double thickness = 0;
    for (const BodyPart& part : problem_.body.parts) {
      thickness = std::max(thickness, 2 * part.radius);
      if (!part.places.empty()) continue;
      Eigen::Vector3d lower = part.points.front(), upper = lower;
      for (const Eigen::Vector3d& point : part.points) lower = lower.cwiseMin(point), upper = upper.cwiseMax(point);
      thickness = std::max(thickness, LeastExtent(lower, upper) + 2 * part.radius);
    }
    return thickness;
  }

  void ExamineSteps() {
    if (problem_.between) return;
    const double step = LongestStep(), body = BodyThickness();
    const auto may_pass = [&](double thickness, const std::string& what) {
      if (step <= thickness + body) return false;
      Add("task.between",
          fmt::format("the robot moves by up to {} m in one step of {} s, and {} is {} m thick: with "
                      "certificates at the samples only it may pass through between two of them",
                      Up(step), ToText(config_.period), what, Down(thickness)),
          "declare bounds on the motion between samples, `between: {acceleration: [...]}`; or a smaller step or speed");
      return true;
    };
    for (std::size_t i = 0; i < config_.num_listed; ++i) {  // behind a piece of the outside is more, but for a hole
      const Obstacle& obstacle = config_.obstacles[i];
      if (obstacle.kind() == Obstacle::Kind::kHalfSpace) continue;
      const double thickness = obstacle.grid()
                                   ? MapOf(obstacle).resolution
                                   : LeastExtent(obstacle.lower(), obstacle.upper()) + 2 * obstacle.radius();
      if (may_pass(thickness, ObstacleText(i))) return;
    }
    for (const KeepIn& keep_in : config_.keep_in)
      for (const Ring& hole : keep_in.area.holes) {
        const auto [left, right] = std::ranges::minmax(hole, {}, &PlanePoint::x);
        const auto [low, high] = std::ranges::minmax(hole, {}, &PlanePoint::y);
        if (may_pass(LeastExtent({left.x, low.y, 0}, {right.x, high.y, 0}), fmt::format("a hole of {}", keep_in.name)))
          return;
      }
  }

  // ---- The picture.

  void AddTube(const Certifier& certifier, const Tube& tube) {
    const int units = certifier.safety().NumUnits(tube);
    if (units == 0) return;
    for (std::vector<Picture::Polygon>& unit : Sweeps(certifier, tube, units - 1))
      std::ranges::move(unit, std::back_inserter(result_.picture.expected));
  }

  void Draw() {
    if (problem_.projection.rows() != 2) return;
    result_.is_planar = true;
    Picture& picture = result_.picture;
    picture.title = fmt::format("forereach check: {}", std::filesystem::path(options_.config).filename().string());
    picture.obstacles = config_.obstacles;
    for (Eigen::Index i = 0; i < all_.z.rows(); i += 1 + all_.z.rows() / kMostCompared)
      picture.observations.emplace_back(problem_.projection * all_.z.row(i).head(model_.num_states()).transpose());
    const Eigen::VectorXd center = (config_.initial_set.lower() + config_.initial_set.upper()) / 2;
    picture.bodies = BodyAt(problem_, center);
    if (config_.planner.goal.size() == 2)
      picture.goal = {{config_.planner.goal[0], config_.planner.goal[1]}, config_.planner.goal_radius};
    picture.path = {Eigen::Vector2d(problem_.projection * center)};
  }

  static constexpr const char* kWiden =
      "widen the domain, if the declaration holds there too; or leave these transitions out";

  const TaskCheckOptions options_;
  Document file_;
  const Config config_;
  Problem problem_;
  const NominalModel& model_;
  const std::vector<std::string> names_;
  Eigen::MatrixXd controls_;  // a column a step
  Transitions all_;
  std::vector<Eigen::Index> rows_;              // of all_, those in the domain
  std::vector<Contradictions> contradictions_;  // of each state
  TaskCheck result_;
};

}  // namespace

bool TaskCheck::HasFindings() const {
  return std::ranges::any_of(findings, [](const TaskFinding& finding) { return !finding.is_remark; });
}

TaskCheck CheckTask(const TaskCheckOptions& options) { return Examination(options).Run(); }

}  // namespace forereach
