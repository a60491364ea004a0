/** Checks of what a robot sends: its state, and executed transitions as a certifier learns them. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "forereach/certify/problem.h"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "lcmtypes/stream_order.h"
#include "task/gate_options.h"

namespace forereach {

/** Why a state is unusable at any time: num_states other than the model's, an entry that is not finite, errors that are
not one for each state, negative or not finite, an unknown mode. Empty if it is usable. It does not check the stamp
(stamp.h). */
[[nodiscard]] std::string FaultOf(const robot_state_t& state, int num_states);

/** Takes a state as the newest of its stream: true if it is usable, not from the future (stamp.h), and neither late nor
repeated. */
[[nodiscard]] bool TakeState(const robot_state_t& state, int num_states, std::int64_t now_us,
                             const GateOptions& options, StreamOrder& states);

/** Why a certifier does not take a state for known: an error of it is larger than the declared one, which its
certificates and its comparison with the slices rest on. Empty if none is. @pre FaultOf is empty. */
[[nodiscard]] std::string WiderThanDeclared(const robot_state_t& state, const Problem& problem);

struct ExecutedTransition {
  std::vector<double> z, next;  ///< (x, u) and x+
  double longer = 0;            ///< By how much the step lasted longer or shorter than dt, at most, s.
  double by_clock = 0;          ///< The same by its clock, also where `longer` is 0, since steps are on time.
  std::string refusal;          ///< What keeps it from being learned. Empty if nothing does.
};

/** Refuses sizes other than the model's, and a duration that does not count (CountedDuration). */
[[nodiscard]] ExecutedTransition FromMessage(const transition_t& message, const Problem& problem,
                                             const GateOptions& options);

/** Also refuses transitions that a certifier would not learn (certify/learned.h). For readers of logs, which have no
certifier. */
[[nodiscard]] ExecutedTransition Examine(const transition_t& message, const Problem& problem,
                                         const GateOptions& options);

}  // namespace forereach
