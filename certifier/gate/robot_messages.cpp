#include "certifier/gate/robot_messages.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "certifier/gate/stamp.h"
#include "forereach/certify/learned.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/text.h"
#include "task/step_time.h"

namespace forereach {

std::string FaultOf(const robot_state_t& state, int num_states) {
  if (state.num_states != num_states) return fmt::format("{} states, the task has {}", state.num_states, num_states);
  if (!std::all_of(state.state, state.state + num_states, [](double value) { return std::isfinite(value); }))
    return "NaN or infinity in it";
  if (state.num_state_errors != 0 && state.num_state_errors != num_states)
    return fmt::format("{} errors of states, it has to have none or {}", state.num_state_errors, num_states);
  if (!std::all_of(state.state_error, state.state_error + state.num_state_errors,
                   [](double error) { return std::isfinite(error) && error >= 0; }))
    return "an error of a state is negative, NaN or infinite";
  if (state.mode < robot_state_t::STANDING || state.mode > robot_state_t::FINISHED)
    return fmt::format("unknown mode {}", state.mode);
  return {};
}

bool TakeState(const robot_state_t& state, int num_states, std::int64_t now_us, const GateOptions& options,
               StreamOrder& states) {
  // A state from the future would make all that follow look old.
  if (!FaultOf(state, num_states).empty() || CheckStamp(state.utime, now_us, options).freshness == Freshness::kFuture)
    return false;
  const StreamPosition position{state.sequence, state.utime};
  const std::int64_t horizon = StreamOrder::Horizon(now_us, Microseconds(options.max_ahead_ms));
  if (!IsNews(states.Compare(position, horizon))) return false;
  states.Take(position, horizon);
  return true;
}

std::string WiderThanDeclared(const robot_state_t& state, const Problem& problem) {
  if (!problem.declaration.DeclaresStateError()) return {};
  for (int k = 0; k < state.num_state_errors; ++k)
    if (const double most = problem.declaration.state_error[k]; !(state.state_error[k] <= most))
      return fmt::format("the error of {} is {}, and declaration.state_error is {}",
                         problem.model->state_names()[static_cast<std::size_t>(k)], ToText(state.state_error[k]),
                         ToText(most));
  return {};
}

namespace {

// How far the duration is from dt, in seconds, from above. A clock of microseconds is off by one at each end.
double LongerThanDt(std::int64_t duration_us, double dt) {
  const Interval duration = Interval(static_cast<double>(duration_us)) + Interval(-1, 1);
  return (duration / Interval(1e6) - Interval(dt)).Magnitude();
}

}  // namespace

ExecutedTransition FromMessage(const transition_t& message, const Problem& problem, const GateOptions& options) {
  const NominalModel& model = *problem.model;
  const int n = model.num_states(), m = model.num_inputs();
  ExecutedTransition transition;
  if (message.num_states != n || message.num_inputs != m) {
    transition.refusal =
        fmt::format("{} states and {} inputs, the task has {} and {}", message.num_states, message.num_inputs, n, m);
    return transition;
  }
  transition.z.assign(message.state, message.state + n);
  transition.z.insert(transition.z.end(), message.input, message.input + m);
  transition.next.assign(message.next_state, message.next_state + n);
  const double dt = StepOf(model), error = problem.timing.error;
  transition.by_clock = LongerThanDt(message.duration_us, dt);
  if (const auto counted = CountedDuration(problem, transition.by_clock, !StepErrorUs(options)))
    transition.longer = *counted;
  else
    transition.refusal =
        fmt::format("the step lasted {} us, further from model.dt, {} s, than {}", message.duration_us, ToText(dt),
                    error > 0 ? fmt::format("two errors of {} s", ToText(error))
                              : "steps on time do; robot.step_error_ms and the model let no more count");
  return transition;
}

ExecutedTransition Examine(const transition_t& message, const Problem& problem, const GateOptions& options) {
  ExecutedTransition transition = FromMessage(message, problem, options);
  Observations observed;
  if (transition.refusal.empty())
    transition.refusal = Explain(Observe(problem, transition.z, transition.next, transition.longer, observed));
  return transition;
}

}  // namespace forereach
