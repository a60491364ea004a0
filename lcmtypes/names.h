/** The names of the numbers in messages, for the command, the database and the reports. */
#pragma once

#include <cstdint>
#include <string_view>

#include "forereach/numerics/compilation.h"

namespace forereach {

class certifier_status_t;

/** "certified", "abstain_falsified", "abstain_domain", "abstain_safety", "rejected", "abstain_deadline",
"abstain_obstacles"; "unknown" for any other number. */
[[nodiscard]] std::string_view OutcomeName(std::int16_t outcome);

/** "none", "pairwise", "domain_exit", ... as decision_t's CAUSE_ constants; "unknown" for any other number. */
[[nodiscard]] std::string_view CauseName(std::int16_t cause);

/** "accepted", "refused", "started", ... as execution_event_t's constants; "unknown" for any other number. */
[[nodiscard]] std::string_view EventName(std::int16_t kind);

/** "robot_state_lost", ... as fault_t's constants; "unknown" for any other number. */
[[nodiscard]] std::string_view FaultName(std::int16_t cause);

/** The operator's action for a fault, as text that follows "what to do: ". It says so if a reset alone does not
help. */
[[nodiscard]] std::string_view FaultAdvice(std::int16_t cause);

/** True for faults that invalidate the executing plan's certificate: a robot stops. */
[[nodiscard]] bool StopsTheRobot(std::int16_t cause);

/** Whether the sender of a heartbeat decides: it neither listens for another certifier nor stands by. */
[[nodiscard]] bool IsInCharge(const certifier_status_t& status);

/** "falsified", "obstacle", ... as withdrawal_t's constants; "unknown" for any other number. */
[[nodiscard]] std::string_view WithdrawalName(std::int16_t cause);

/** "obstacle", "limit", "domain": the kind of advice_change_t; "unknown" for any other number. */
[[nodiscard]] std::string_view AdviceName(std::int16_t kind);

/** "OK", "STALE", "ERROR": the level of certifier_status_t; "unknown" for any other number. */
[[nodiscard]] std::string_view LevelName(std::int16_t level);

/** "disarmed", "armed", "fault", "listening", "standby": the state of certifier_status_t; "unknown" for any other
number. */
[[nodiscard]] std::string_view StateName(std::int16_t state);

/** "none", "written", "unwritable": the latch of certifier_status_t; "unknown" for any other number. */
[[nodiscard]] std::string_view LatchName(std::int16_t latch);

/** "task", "bus": the obstacles_source of certifier_status_t; "unknown" for any other number. */
[[nodiscard]] std::string_view ObstaclesSourceName(std::int16_t source);

}  // namespace forereach
