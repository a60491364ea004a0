#include "certifier/gate/transition_message.h"

#include <algorithm>
#include <cmath>

namespace forereach {

ExecutedTransition FromMessage(const transition_t& message, const Problem& problem) {
  const int n = problem.model->num_states(), m = problem.model->num_inputs();
  ExecutedTransition transition;
  if (message.num_states != n || message.num_inputs != m) {
    transition.refusal = std::to_string(message.num_states) + " states and " + std::to_string(message.num_inputs) +
                         " inputs, the task has " + std::to_string(n) + " and " + std::to_string(m);
    return transition;
  }
  transition.z.assign(message.state, message.state + n);
  transition.z.insert(transition.z.end(), message.input, message.input + m);
  transition.next.assign(message.next_state, message.next_state + n);
  const auto finite = [](double value) { return std::isfinite(value); };
  if (!std::ranges::all_of(transition.z, finite) || !std::ranges::all_of(transition.next, finite))
    transition.refusal = "NaN or infinity in it";
  else if (!problem.domain.Contains(transition.z))
    transition.refusal = "it lies outside the certification domain";
  return transition;
}

}  // namespace forereach
