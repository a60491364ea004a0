/** A robot's state from the bus, as every receiver takes it. */
#pragma once

#include <string>

#include "forereach/robot_state_t.hpp"

namespace forereach {

/** Why a state is unusable at any time: num_states other than the model's, an entry that is not finite, an unknown
mode. Empty if it is usable. Its stamp is not looked at (stamp.h). */
[[nodiscard]] std::string FaultOf(const robot_state_t& state, int num_states);

}  // namespace forereach
