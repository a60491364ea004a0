#include "lcmtypes/names.h"

#include "forereach/advice_change_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/withdrawal_t.hpp"

namespace forereach {

std::string_view OutcomeName(std::int16_t outcome) {
  switch (outcome) {
    case decision_t::CERTIFIED: return "certified";
    case decision_t::ABSTAIN_FALSIFIED: return "abstain_falsified";
    case decision_t::ABSTAIN_DOMAIN: return "abstain_domain";
    case decision_t::ABSTAIN_SAFETY: return "abstain_safety";
    case decision_t::REJECTED: return "rejected";
    case decision_t::ABSTAIN_DEADLINE: return "abstain_deadline";
    case decision_t::ABSTAIN_OBSTACLES: return "abstain_obstacles";
    default: return "unknown";
  }
}

std::string_view CauseName(std::int16_t cause) {
  switch (cause) {
    case decision_t::CAUSE_NONE: return "none";
    case decision_t::CAUSE_PAIRWISE: return "pairwise";
    case decision_t::CAUSE_DOMAIN_EXIT: return "domain_exit";
    case decision_t::CAUSE_NO_FINITE_ENCLOSURE: return "no_finite_enclosure";
    case decision_t::CAUSE_OBSTACLE: return "obstacle";
    case decision_t::CAUSE_NO_STOP: return "no_stop";
    case decision_t::CAUSE_LIMIT: return "limit";
    case decision_t::CAUSE_STALE: return "stale";
    case decision_t::CAUSE_FUTURE: return "future";
    case decision_t::CAUSE_DUPLICATE: return "duplicate";
    case decision_t::CAUSE_WRONG_LENGTH: return "wrong_length";
    case decision_t::CAUSE_TRAILING_BYTES: return "trailing_bytes";
    case decision_t::CAUSE_UNKNOWN_FINGERPRINT: return "unknown_fingerprint";
    case decision_t::CAUSE_WRONG_DIMENSION: return "wrong_dimension";
    case decision_t::CAUSE_NON_FINITE: return "non_finite";
    case decision_t::CAUSE_TOO_MANY_SOURCES: return "too_many_sources";
    case decision_t::CAUSE_TOO_LATE: return "too_late";
    case decision_t::CAUSE_QUEUE_FULL: return "queue_full";
    case decision_t::CAUSE_INTERNAL_ERROR: return "internal_error";
    case decision_t::CAUSE_DEADLINE: return "deadline";
    case decision_t::CAUSE_OVERRUN: return "overrun";
    case decision_t::CAUSE_NOT_ARMED: return "not_armed";
    case decision_t::CAUSE_FAULT: return "fault";
    case decision_t::CAUSE_SHADOW: return "shadow";
    case decision_t::CAUSE_NO_OBSTACLES: return "no_obstacles";
    case decision_t::CAUSE_SECOND_CERTIFIER: return "second_certifier";
    case decision_t::CAUSE_LATCH_UNWRITABLE: return "latch_unwritable";
    default: return "unknown";
  }
}

std::string_view EventName(std::int16_t kind) {
  switch (kind) {
    case execution_event_t::ACCEPTED: return "accepted";
    case execution_event_t::REFUSED: return "refused";
    case execution_event_t::STARTED: return "started";
    case execution_event_t::STEP_INSIDE: return "step_inside";
    case execution_event_t::STEP_OUTSIDE: return "step_outside";
    case execution_event_t::TAIL_BEGUN: return "tail_begun";
    case execution_event_t::STANDING: return "standing";
    case execution_event_t::GOAL_REACHED: return "goal_reached";
    case execution_event_t::CONTACT: return "contact";
    case execution_event_t::HALTED: return "halted";
    case execution_event_t::RESET: return "reset";
    case execution_event_t::WITHDRAWN: return "withdrawn";
    case execution_event_t::EMERGENCY_STOP: return "emergency_stop";
    case execution_event_t::OFF_SCHEDULE: return "off_schedule";
    case execution_event_t::LIMIT_EXCEEDED: return "limit_exceeded";
    case execution_event_t::ERROR_STOP: return "error_stop";
    default: return "unknown";
  }
}

bool StopsTheRobot(std::int16_t cause) {
  return cause == fault_t::SLICE_LEFT || cause == fault_t::DECLARATION_FALSIFIED || cause == fault_t::UNCERTIFIED_PLAN;
}

bool IsInCharge(const certifier_status_t& status) {
  return status.state != certifier_status_t::LISTENING && status.state != certifier_status_t::STANDBY;
}

std::string_view FaultName(std::int16_t cause) {
  switch (cause) {
    case fault_t::ROBOT_STATE_LOST: return "robot_state_lost";
    case fault_t::CLOCK_JUMP: return "clock_jump";
    case fault_t::SLICE_LEFT: return "slice_left";
    case fault_t::DECLARATION_FALSIFIED: return "declaration_falsified";
    case fault_t::UNCERTIFIED_PLAN: return "uncertified_plan";
    default: return "unknown";
  }
}

std::string_view FaultAdvice(std::int16_t cause) {
  switch (cause) {
    case fault_t::ROBOT_STATE_LOST: return "bring the robot's state messages back, then `forereach reset`";
    case fault_t::CLOCK_JUMP: return "set the clock right and keep it from jumping again, then `forereach reset`";
    case fault_t::SLICE_LEFT:
      return "find the false assumption (declaration, domain, noise bound or initial set), correct the task file, "
             "`forereach reload`, then `forereach reset`; after a reset alone it happens again";
    case fault_t::DECLARATION_FALSIFIED:
      return "a reset alone does not help, every candidate stays F: declare a larger bound in the task file, "
             "`forereach reload`, then `forereach reset`";
    case fault_t::UNCERTIFIED_PLAN:
      return "find the program that commands the robot without the guard, or the other certifier on this bus; then "
             "`forereach reset`";
    default: return "find the reason, then `forereach reset`";
  }
}

std::string_view WithdrawalName(std::int16_t cause) {
  switch (cause) {
    case withdrawal_t::FALSIFIED: return "falsified";
    case withdrawal_t::DOMAIN_EXIT: return "domain_exit";
    case withdrawal_t::NO_FINITE_ENCLOSURE: return "no_finite_enclosure";
    case withdrawal_t::OBSTACLE: return "obstacle";
    case withdrawal_t::NO_STOP: return "no_stop";
    case withdrawal_t::NOT_JUDGED: return "not_judged";
    case withdrawal_t::UNKNOWN_PLAN: return "unknown_plan";
    case withdrawal_t::LIMIT: return "limit";
    case withdrawal_t::OBSTACLES_LOST: return "obstacles_lost";
    default: return "unknown";
  }
}

std::string_view AdviceName(std::int16_t kind) {
  switch (kind) {
    case advice_change_t::OBSTACLE: return "obstacle";
    case advice_change_t::LIMIT: return "limit";
    case advice_change_t::DOMAIN: return "domain";
    default: return "unknown";
  }
}

std::string_view LevelName(std::int16_t level) {
  switch (level) {
    case certifier_status_t::OK: return "OK";
    case certifier_status_t::STALE: return "STALE";
    case certifier_status_t::ERROR: return "ERROR";
    default: return "unknown";
  }
}

std::string_view StateName(std::int16_t state) {
  switch (state) {
    case certifier_status_t::DISARMED: return "disarmed";
    case certifier_status_t::ARMED: return "armed";
    case certifier_status_t::FAULT: return "fault";
    case certifier_status_t::LISTENING: return "listening";
    case certifier_status_t::STANDBY: return "standby";
    default: return "unknown";
  }
}

std::string_view LatchName(std::int16_t latch) {
  switch (latch) {
    case certifier_status_t::LATCH_NONE: return "none";
    case certifier_status_t::LATCH_WRITTEN: return "written";
    case certifier_status_t::LATCH_UNWRITABLE: return "unwritable";
    default: return "unknown";
  }
}

std::string_view ObstaclesSourceName(std::int16_t source) {
  switch (source) {
    case certifier_status_t::OBSTACLES_TASK: return "task";
    case certifier_status_t::OBSTACLES_BUS: return "bus";
    default: return "unknown";
  }
}

}  // namespace forereach
