#include "task/config.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "forereach/certify/learned.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/reach/step_offsets.h"
#include "forereach/residual/no_nominal_value.h"
#include "forereach/residual/observations.h"
#include "task/config_text.h"
#include "task/csv.h"
#include "task/document.h"
#include "task/draft.h"
#include "task/step_time.h"

namespace forereach {
namespace {

std::vector<std::string> TransitionColumns(const NominalModel& model) {
  std::vector<std::string> columns = model.variable_names();
  for (const std::string& state : model.state_names()) columns.push_back(state + "_next");
  return columns;
}

constexpr const char* kDurationColumn = "dt_error";

Transitions ReadTransitions(const std::string& path, const NominalModel& model, const std::string& named_by) {
  const std::vector<std::string> columns = TransitionColumns(model);
  const Eigen::MatrixXd rows = ReadCsv(
      path, columns, named_by, "; `forereach import` makes transitions of a log with other columns", kDurationColumn);
  if (rows.rows() == 0) throw ConfigError("{}:2: no transitions; at least one is needed", path);
  Transitions read{rows.leftCols(model.num_variables()), rows.middleCols(model.num_variables(), model.num_states())};
  if (rows.cols() == std::ssize(columns)) return read;
  read.longer = rows.rightCols<1>();
  const Range allowed{0, TooFarOff(model), false, true};
  for (Eigen::Index i = 0; i < read.longer.size(); ++i)
    if (const double longer = read.longer[i]; !allowed.Contains(longer))
      throw ConfigError("{}:{}: {}: {} is outside {}, from 0 up to half of model.dt", path, i + 2, kDurationColumn,
                        ToText(longer), allowed.text());
  return read;
}

// The durations of steps, if they are not all dt, say something only where it is known how states move with time.
void RequireDurations(const std::string& path, const Problem& problem) try {
  ValidateDurations(problem);
} catch (const std::invalid_argument& error) {
  throw ConfigError("{}: {}: {}", path, kDurationColumn, error.what());
}

// What a transition violates, in the words of the task file.
std::string Describe(const DomainExit& exit, const Domain& domain, const NominalModel& model) {
  using Kind = DomainExit::Kind;
  const std::vector<std::string> names = model.variable_names();
  if (exit.kind == Kind::kLower || exit.kind == Kind::kUpper) {
    const Eigen::Index l = exit.index, n = model.num_states();
    const Box& box = l < n ? domain.state : domain.input;
    const Eigen::Index k = l < n ? l : l - n;
    return fmt::format("{}: {} is outside {} of domain.{}", names[ToSize(l)], ToText(exit.value),
                       Range{box.lower()[k], box.upper()[k], false, false}.text(), l < n ? "state" : "input");
  }
  std::string involved;
  const auto involve = [&](Eigen::Index l) { involved += (involved.empty() ? "" : ", ") + names[ToSize(l)]; };
  const std::string limit = fmt::format("{} is outside (-inf, {}] of domain.", ToText(exit.value), ToText(exit.bound));
  if (exit.kind == Kind::kBall) {
    for (const int l : domain.balls[ToSize(exit.index)].coordinates) involve(l);
    return fmt::format("{}: distance {}balls[{}]", involved, limit, exit.index);
  }
  const Eigen::VectorXd& coefficients = domain.inequalities[ToSize(exit.index)].coefficients;
  for (Eigen::Index l = 0; l < coefficients.size(); ++l)
    if (coefficients[l] != 0) involve(l);
  return fmt::format("{}: sum {}inequalities[{}]", involved, limit, exit.index);
}

void RequireInside(const std::string& path, const Transitions& transitions, const Domain& domain,
                   const NominalModel& model) {
  std::array<Interval, kMaxVariables> point;
  const auto size = ToSize(model.num_variables());
  for (Eigen::Index i = 0; i < transitions.z.rows(); ++i) {
    for (Eigen::Index l = 0; l < transitions.z.cols(); ++l) point[ToSize(l)] = Interval(transitions.z(i, l));
    const DomainExit exit = FindExit(domain, {point.data(), size});
    if (exit.kind != DomainExit::Kind::kNone)
      throw ConfigError("{}:{}: {}", path, i + 2, Describe(exit, domain, model));
  }
}

// Of the transitions, those whose true z is in the domain within the declared errors. The others may belong to places
// where nothing is declared. Returns the rows that stay.
std::vector<int> KeepThoseWithin(const std::string& path, Problem& problem) {
  const Transitions& all = problem.transitions;
  std::vector<int> rows;
  for (int i = 0; i < all.size(); ++i) {
    const Eigen::VectorXd z = all.z.row(i);
    if (IsWithin(problem, {z.data(), ToSize(z.size())}, false)) rows.push_back(i);
  }
  if (rows.empty())
    throw ConfigError(
        "{}: no transition is inside the domain with all of declaration.state_error and "
        "declaration.input_error; at least one is needed",
        path);
  if (std::ssize(rows) < all.size()) {
    Transitions kept{all.z(rows, Eigen::all), all.x_next(rows, Eigen::all)};
    if (all.longer.size() > 0) kept.longer = all.longer(rows);
    problem.transitions = std::move(kept);
  }
  return rows;
}

// Where the nominal model has no value, or the turns of an angle cannot be told, the transition says nothing, and
// something is wrong with it.
void RequireObservable(const std::string& path, const std::vector<int>& rows, const Problem& problem) try {
  static_cast<void>(Observe(*problem.model, problem.declaration, problem.transitions, problem.timing));
} catch (const AmbiguousAngle& error) {
  throw ConfigError("{}:{}: {}", path, rows[ToSize(error.row())] + 2, error.what());
} catch (const NoNominalValue& error) {
  throw ConfigError(
      "{}:{}: {}; change the model's equations or parameters, or take the state out of the domain and the data", path,
      rows[ToSize(error.row())] + 2, error.text());
}

// What a task that defines rest need not say again.
void FillStanding(TaskDraft& draft) {
  constexpr double kShareOfRest = 0.1;  // of the nominal state, since the tube around it has to be at rest
  const NominalModel& model = *draft.problem.model;
  Config& config = draft.config;
  if (!config.robot.hold && model.text() != nullptr && !draft.rest.empty()) {
    config.robot.hold.emplace();
    for (const RestBound& bound : draft.rest)
      config.robot.hold->push_back(model.state_names()[ToSize(bound.coordinate)]);
  }
  if (config.laws.at_rest || draft.rest.empty()) return;
  config.laws.at_rest = draft.rest;
  for (RestBound& bound : *config.laws.at_rest) bound.tolerance *= kShareOfRest;
}

// The errors that StepOffsets allows, with the key's name.
void RequireSteps(const Document& file, const Problem& problem) try {
  static_cast<void>(StepOffsets(*problem.model, problem.timing));
} catch (const std::invalid_argument& error) {
  file.Fail("robot.step_error_ms", error.what());
}

Transitions TransitionsOf(const Transitions& data, const NominalModel& model) {
  const auto require = [&](const char* what, const Eigen::MatrixXd& given, int columns) {
    if (given.rows() == 0 || given.rows() != data.z.rows() || given.cols() != columns)
      throw ConfigError("data: {} has {} rows and {} columns, has to have {} rows, at least 1, and {} columns", what,
                        given.rows(), given.cols(), data.z.rows(), columns);
    if (!given.allFinite()) throw ConfigError("data: {} has a number that is not finite", what);
  };
  require("z", data.z, model.num_variables());
  require("x_next", data.x_next, model.num_states());
  return data;
}

Config Load(Document& file, TransitionsFile transitions, const NamedFiles& instead, const Transitions* data = nullptr) {
  TaskDraft draft;
  draft.model_file.path = instead.model;
  file.Read(draft);
  FillStanding(draft);
  auto& [config, problem, scope, transitions_path, rest, model_file] = draft;
  const NominalModel& model = *problem.model;
  for (const int k : problem.declaration.affine.rows)
    for (int l = 0; l < model.num_variables(); ++l)
      if (problem.declaration.affine.DependsOn(k, l) && problem.declaration.lipschitz(k, l) == 0 &&
          problem.declaration.VariableError(l) > 0)
        file.Fail("declaration.affine",
                  fmt::format("{} is known up to an error (state_error, input_error), which the unknown slope of {} "
                              "multiplies: declare a bound on that slope as declaration.lipschitz.{}.{}",
                              model.variable_names()[ToSize(l)], model.state_names()[ToSize(k)],
                              model.state_names()[ToSize(k)], model.variable_names()[ToSize(l)]));
  if (!instead.transitions.empty()) transitions_path = instead.transitions;
  if (data) transitions_path = "data";
  if (!instead.policy.empty() && !config.planner.policy.empty()) config.planner.policy = instead.policy;
  if (transitions == TransitionsFile::kRead) {
    problem.transitions =
        data ? TransitionsOf(*data, model) : ReadTransitions(transitions_path, model, file.Place("transitions"));
    RequireInside(transitions_path, problem.transitions, problem.domain, model);
    RequireDurations(transitions_path, problem);
  }
  config.path = file.path();
  config.transitions = transitions_path;
  // Before rows are left out: the observations' digest is that of the file.
  config.grounds = GroundsOf(TaskDigest(file.text(), model_file.bytes), problem, config.obstacles);
  if (transitions == TransitionsFile::kRead) {
    const int all = problem.transitions.size();
    config.rows = KeepThoseWithin(transitions_path, problem);
    RequireObservable(transitions_path, config.rows, problem);
    config.left_out = all - problem.transitions.size();
  }
  config.gate.longest_step_ms = std::max(config.robot.step_period_ms, config.gate.longest_step_ms);
  problem.timing.error = StepErrorSeconds(config);
  RequireSteps(file, problem);
  const bool knows_time = config.gate.max_clock_error_ms.has_value();
  if (knows_time && config.gate.step_error_ms == kAnyTime)
    file.Fail("robot.step_error_ms",
              "any, and with gate.max_clock_error_ms obstacles move: a certificate has to know when the steps are");
  if (problem.between) problem.between->period = LongestPeriod(config);
  if (problem.between || knows_time || StepErrorUs(config.gate)) config.gate.step_us = StepUs(config);
  if (config.gate.step_us != 0 && std::llround(config.robot.step_period_ms * 1e3) != config.gate.step_us)
    file.Fail("robot.step_period_ms",
              fmt::format("is {}, and has to be model.dt, {} ms: task.between and a clock are about steps of this time",
                          ToText(config.robot.step_period_ms), ToText(config.period * 1e3)));
  config.problem = std::make_shared<const Problem>(std::move(problem));
  return std::move(config);
}

}  // namespace

Config LoadConfig(Document& file, TransitionsFile transitions) { return Load(file, transitions, {}); }

Config LoadConfig(const std::string& path, TransitionsFile transitions) {
  Document file(path);
  return LoadConfig(file, transitions);
}

Config LoadConfig(const std::string& path, const NamedFiles& instead) {
  Document file(path);
  return Load(file, TransitionsFile::kRead, instead);
}

Config ConfigOfText(const std::string& path, const std::string& text, const Transitions* data) {
  Document file = Document::OfText(path, text);
  return Load(file, TransitionsFile::kRead, {}, data);
}

NamedFiles FilesNamedBy(const std::string& path) {
  Document file(path);
  TaskDraft draft;
  file.Read(draft);
  return {draft.transitions, draft.config.planner.policy, draft.model_file.path};
}

void RequireForCertifying(const Config& config) {
  if (config.says_between || config.problem->method == Method::kPaper) return;
  throw ConfigError(
      "{}: task.between: missing. Write under `task:` the line `between: {{acceleration: [...]}}` with bounds on the "
      "true motion from one sample to the next, which `forereach declare --between` proposes: a certificate holds at "
      "all times. Or write `between: samples`: it holds at its sample instants only",
      config.path);
}

void RequireForCertifyingOnBus(const Config& config) {
  RequireForCertifying(config);
  if (config.gate.obstacles == ObstaclesSource::kUnsaid)
    throw ConfigError(
        "{}: gate.obstacles: missing. `bus`: the obstacles are those of this file and those of the last "
        "OBSTACLES message; nothing is certified before the first message or while there are none. `task`: "
        "the obstacles are those of this file",
        config.path);
  if (config.gate.obstacles == ObstaclesSource::kBus && !config.gate.obstacles_lost_ms)
    throw ConfigError(
        "{}: gate.obstacles_lost_ms: missing. With `gate.obstacles: bus`, plans under way are withdrawn, "
        "which is an emergency stop, once the obstacles have been unknown for this many milliseconds. "
        "`never`: the robot executes its plan to the end, through whatever has come there",
        config.path);
  if (config.gate.needs_robot_state && !config.problem->declaration.DeclaresStateError())
    throw ConfigError(
        "{}: declaration.state_error: missing. Write under `declaration:` how far the true state may be "
        "from the one that the robot measures, `state_error: {{STATE: BOUND, ...}}` in the unit of each "
        "state; one that is not named is exact. Write `state_error: {{}}` if you mean 0 for all",
        config.path);
  if (config.gate.needs_robot_state && !config.gate.step_error_ms)
    throw ConfigError(
        "{}: robot.step_error_ms: missing. Write under `robot:` how far the boundaries of steps may be from their "
        "times, in ms, which `forereach doctor` measures: the guard ends a plan that is further off. Or write "
        "`step_error_ms: any`: nobody looks at a clock, and certificates hold for steps that are on time",
        config.path);
  const auto moving = std::ranges::find_if(config.obstacles, [](const Obstacle& o) { return o.motion().has_value(); });
  if (moving != config.obstacles.end())
    throw ConfigError(
        "{}: task.obstacles[{}].motion: its times begin with the plan, so it is for `forereach certify`. On a bus, "
        "write `gate: {{obstacles: bus}}`, and send the obstacle of a file of its own with `forereach obstacles`",
        config.path, moving - config.obstacles.begin());
}

std::vector<int> HeldStates(const Config& config) {
  const NominalModel& model = *config.problem->model;
  const NamedModel* const named = FindNamed(model);
  if (!config.robot.hold && named == nullptr)
    throw ConfigError(
        "{}: robot.hold: missing: it names the states that are zero while the robot stands, and a model as "
        "text does not say which; by default they are those of task.rest, which is missing, too",
        config.path);
  const std::vector<std::string> names =
      config.robot.hold ? *config.robot.hold : std::vector<std::string>(named->standing.begin(), named->standing.end());
  std::vector<int> held;
  for (int k = 0; k < model.num_states(); ++k)
    if (std::ranges::find(names, model.state_names()[ToSize(k)]) != names.end()) held.push_back(k);
  return held;
}

Transitions LoadTransitions(const std::string& path, const NominalModel& model) {
  return ReadTransitions(path, model, "");
}

void SaveTransitions(const std::string& path, const NominalModel& model, const Transitions& transitions) {
  std::vector<std::string> columns = TransitionColumns(model);
  Eigen::MatrixXd rows(transitions.size(), std::ssize(columns));
  rows << transitions.z, transitions.x_next;
  if (!transitions.longer.isZero(0)) {
    if (std::ranges::count(columns, kDurationColumn) > 0)
      throw ConfigError("{}: the model has a variable of the name {}: give it another", path, kDurationColumn);
    columns.emplace_back(kDurationColumn);
    rows.conservativeResize(Eigen::NoChange, std::ssize(columns));
    rows.rightCols<1>() = transitions.longer;
  }
  WriteCsv(path, columns, rows);
}

Eigen::MatrixXd LoadPlan(const std::string& path, const NominalModel& model) {
  const Eigen::MatrixXd rows = ReadCsv(path, model.input_names());
  if (rows.rows() < 1 || rows.rows() > kMaxSteps)
    throw ConfigError("{}:{}: {} steps are outside [1, {}]", path, std::min<Eigen::Index>(rows.rows(), kMaxSteps) + 2,
                      rows.rows(), kMaxSteps);
  return rows.transpose();
}

void SavePlan(const std::string& path, const NominalModel& model, const Eigen::MatrixXd& controls) {
  WriteCsv(path, model.input_names(), controls.transpose());
}

}  // namespace forereach
