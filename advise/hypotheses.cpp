#include "advise/hypotheses.h"

#include <algorithm>

#include <fmt/format.h>

#include "forereach/certify/learned.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/step_rate.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "task/step_time.h"

namespace forereach {
namespace {

// "x 0.03, y 0.03": what is not zero.
std::string NamedBounds(const std::vector<std::string>& names, const Eigen::VectorXd& bounds) {
  std::string text;
  for (Eigen::Index k = 0; k < bounds.size(); ++k)
    if (bounds[k] != 0)
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", names[ToSize(static_cast<int>(k))], ToText(bounds[k]));
  return text;
}

// The same of the disturbance, with its expressions.
std::string Disturbances(const std::vector<std::string>& names, const Declaration& declaration) {
  std::string text;
  for (Eigen::Index k = 0; k < std::ssize(names); ++k)
    if (const std::string bound = declaration.DisturbanceText(k); bound != "0")
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", names[ToSize(k)], bound);
  return text;
}

std::string NamesOf(const std::vector<std::string>& names, const std::vector<int>& chosen) {
  std::string text;
  for (const int i : chosen) text += (text.empty() ? "" : ", ") + names[ToSize(i)];
  return text;
}

// Who may find what is declared of states false.
std::string WhoRefutesStateError(const Config& config) {
  const Declaration& declaration = config.problem->declaration;
  if (!declaration.DeclaresStateError())
    return "nobody: declaration.state_error is not given, so states are taken as exact";
  if (!declaration.given_are_exact) return "declared; transitions that contradict each other refute it";
  return config.gate.learns ? "declared; learned transitions that contradict others refute it"
                            : "declared, and refuted by nobody: the file's transitions are exact, and none is learned";
}

void AddRatesAndTurns(const Config& config, std::vector<Hypothesis>& all) {
  const NominalModel& model = *config.problem->model;
  const Eigen::VectorXd& bound = config.problem->timing.rate_bound;
  std::string rates, angles;
  for (Eigen::Index k = 0; k < bound.size(); ++k)
    if (bound[k] < kInfinity)
      rates += fmt::format("{}{} {}", rates.empty() ? "" : ", ", model.state_names()[ToSize(static_cast<int>(k))],
                           ToText(bound[k]));
  if (!rates.empty())
    all.push_back({fmt::format("no state changes faster, a second, than {}", rates),
                   "declared (model.rate_bound); `forereach declare --between --rates` proves it of the equations. "
                   "A transition that shows more falsifies it (F), a plan that needs more is not certified (D)"});
  for (const int k : model.angles()) angles += (angles.empty() ? "" : ", ") + model.state_names()[ToSize(k)];
  if (!angles.empty())
    all.push_back({fmt::format("no step turns {} by three quarters of a turn or more beyond the model", angles),
                   "declared (model.angles); a transition that seems off by more than a quarter of a turn is refused"});
}

// What is assumed of a residual in a step that is off its time, where some state's rate is that of the equations.
void AddGrowth(const Config& config, std::vector<Hypothesis>& all) {
  const Problem& problem = *config.problem;
  const StepTiming& timing = problem.timing;
  bool follows_equations = false;
  for (int k = 0; k < problem.model->num_states(); ++k)
    follows_equations = follows_equations || (std::ranges::count(timing.set_at_steps, k) == 0 &&
                                              !(timing.rate_bound.size() > 0 && timing.rate_bound[k] < kInfinity));
  const bool is_off = timing.error > 0 || !problem.transitions.longer.isZero(0) ||
                      (config.gate.learns && !StepErrorUs(config.gate) && KnowsDurations(problem));
  if (!is_off || !follows_equations) return;
  all.push_back(
      {fmt::format("in a step of duration h what the model does not know differs from that of dt by at most "
                   "((1 + |h - dt|/dt)^{} - 1) of its bounds",
                   RateOf(*problem.model)->power()),
       "declared by robot.step_error_ms: no part of the residual is larger than their sum and cancelled at dt; "
       "model.rate_bound instead says nothing of it"});
}

void AddTimes(const Config& config, std::vector<Hypothesis>& all) {
  const StepTiming& timing = config.problem->timing;
  if (const auto error = StepErrorUs(config.gate); error && *error > 0)
    all.push_back({fmt::format("each step begins within {} ms of its time, by the plan's start and by its first step",
                               ToText(static_cast<double>(*error) / 1e3)),
                   "the guard, which ends the plan at one that does not"});
  else
    all.push_back(
        {"steps are on time", error ? "the guard, which ends the plan at one that is not"
                                    : "nobody: robot.step_error_ms is not given, or any, so no clock is looked at"});
  all.push_back({"recorded steps lasted model.dt, give or take their column dt_error",
                 "`forereach import`, which writes it by the stamps; otherwise nobody"});
  AddGrowth(config, all);
  std::string set;
  for (const int k : timing.set_at_steps)
    set += (set.empty() ? "" : ", ") + config.problem->model->state_names()[ToSize(k)];
  if (!set.empty())
    all.push_back({fmt::format("software sets {} at the steps' boundaries", set), "declared (model.set_at_steps)"});
  if (const auto clocks = config.gate.max_clock_error_ms)
    all.push_back(
        {fmt::format("the clocks of the robot and of the obstacles' sender differ by at most {} ms", ToText(*clocks)),
         "the certifier, which holds every stamp against its arrival"});
}

void AddObstacles(const Config& config, std::vector<Hypothesis>& all) {
  const GateOptions& gate = config.gate;
  if (gate.obstacles != ObstaclesSource::kBus) {
    all.push_back({"no obstacle is there but those of the task, and they move as it says", "declared"});
    return;
  }
  std::string lost = "never withdrawn";
  if (gate.obstacles_lost_ms && *gate.obstacles_lost_ms != kNeverLost)
    lost = fmt::format("withdrawn after {} ms", ToText(*gate.obstacles_lost_ms));
  all.push_back({"every obstacle is in the task or in the last message of perception, and moves as these say",
                 fmt::format("perception; after {} ms without it nothing is certified, and plans under way are {}",
                             ToText(gate.obstacles_timeout_ms), lost)});
}

}  // namespace

std::vector<Hypothesis> HypothesesOf(const Config& config) {
  const Problem& problem = *config.problem;
  const NominalModel& model = *problem.model;
  const Declaration& declaration = problem.declaration;
  std::vector<Hypothesis> all{
      {declaration.state_error.isZero(0) ? "a measured state is the true one"
                                         : fmt::format("a measured state is off the true one by at most {}",
                                                       NamedBounds(model.state_names(), declaration.state_error)),
       WhoRefutesStateError(config)},
      {"the first state lies in X0",
       "the guard, which starts a plan only if all of the measured state +- its error does"},
      {declaration.input_error.isZero(0)
           ? "the robot applies the plan's controls, one a step"
           : fmt::format("the robot applies the plan's controls, one a step, off by at most {}",
                         NamedBounds(model.input_names(), declaration.input_error)),
       declaration.input_error.isZero(0) ? "the guard, which hands out no others"
                                         : "the guard, which hands out no others, and declaration.input_error"}};
  AddTimes(config, all);
  if (StepErrorUs(config.gate))
    all.push_back({"the robot's clock runs true while a plan is executed",
                   "declared; the guard sees that it was set only if a step is off its time then"});
  AddRatesAndTurns(config, all);
  if (const bool is_declared = !config.robot.emergency_stop.empty();
      is_declared || config.gate.obstacles == ObstaclesSource::kBus)
    all.push_back({fmt::format("after a withdrawal, which no certificate covers, the robot stops {}",
                               is_declared ? "as robot.emergency_stop says" : "at once"),
                   "declared"});
  const std::string falsify = fmt::format("declared; transitions of the file {}that contradict it falsify it (F)",
                                          config.gate.learns ? "and of the bus " : "");
  const auto& [rows, columns, rest] = declaration.affine;
  if (!rows.empty())
    all.push_back(
        {fmt::format("the residual of {} is affine in {}{}, on the whole domain", NamesOf(model.state_names(), rows),
                     NamesOf(model.variable_names(), columns), rest.isZero(0) ? "" : " up to declaration.affine.rest"),
         falsify});
  if (std::ssize(rows) < model.num_states())
    all.push_back({rows.empty() ? "the residual changes by no more than declaration.lipschitz, on the whole domain"
                                : "that of the other states changes by no more than declaration.lipschitz, likewise",
                   falsify});
  if (!declaration.regions.empty())
    all.push_back({fmt::format("in {} boxes it changes by less, or less is uncertain, as declaration.regions says",
                               declaration.regions.size()),
                   falsify});
  if (!declaration.noise_bound.isZero(0))
    all.push_back({fmt::format("recorded successors are off by at most {}",
                               NamedBounds(model.state_names(), declaration.noise_bound)),
                   "declared; transitions refute it likewise"});
  if (declaration.given_are_exact)
    all.push_back({"the transitions of the file are exact", "declared (declaration.transitions_are)"});
  if (declaration.IsDisturbed())
    all.push_back({fmt::format("each step is disturbed by at most {}", Disturbances(model.state_names(), declaration)),
                   "declared; transitions refute it likewise"});
  if (problem.body != Body()) all.push_back({"the robot lies within the parts of task.body", "declared"});
  if (problem.between)
    all.push_back(
        {"between two samples the motion keeps the bounds of task.between",
         "declared; `forereach declare --between` proves it of the equations. Transitions that turn faster than "
         "turn_rate falsify it (F), a plan that does is not certified (D)"});
  AddObstacles(config, all);
  all.push_back({"a state that leaves its slice shows that one of these is false",
                 "the guard, which halts, and the certifier, which latches it"});
  return all;
}

}  // namespace forereach
