#include "certifier/gate/robot_state_message.h"

#include <algorithm>
#include <cmath>

namespace forereach {

std::string FaultOf(const robot_state_t& state, int num_states) {
  if (state.num_states != num_states)
    return std::to_string(state.num_states) + " states, the task has " + std::to_string(num_states);
  if (!std::all_of(state.state, state.state + num_states, [](double value) { return std::isfinite(value); }))
    return "NaN or infinity in it";
  if (state.mode < robot_state_t::STANDING || state.mode > robot_state_t::FINISHED)
    return "unknown mode " + std::to_string(state.mode);
  return {};
}

}  // namespace forereach
