#include "lcmtypes/names.h"

#include "forereach/certifier_status_t.hpp"
#include "forereach/fault_t.hpp"

namespace forereach {

bool StopsTheRobot(std::int16_t cause) {
  return cause == fault_t::SLICE_LEFT || cause == fault_t::DECLARATION_FALSIFIED || cause == fault_t::UNCERTIFIED_PLAN;
}

bool IsInCharge(const certifier_status_t& status) {
  return status.state != certifier_status_t::LISTENING && status.state != certifier_status_t::STANDBY;
}

std::string_view FaultAdvice(std::int16_t cause) {
  switch (cause) {
    case fault_t::ROBOT_STATE_LOST: return "bring the robot's state messages back, then `forereach reset`";
    case fault_t::CLOCK_JUMP: return "set the clock right and keep it from jumping again, then `forereach reset`";
    case fault_t::SLICE_LEFT:
      return "find the false assumption (declaration, domain, noise bound, state error or initial set), correct the "
             "task file, `forereach reload`, then `forereach reset`; after a reset alone it happens again";
    case fault_t::DECLARATION_FALSIFIED:
      return "a reset alone does not help, every candidate stays F: declare a larger bound, or larger errors of what "
             "is recorded, in the task file, `forereach reload`, then `forereach reset`";
    case fault_t::UNCERTIFIED_PLAN:
      return "find the program that commands the robot without the guard, or the other certifier on this bus; then "
             "`forereach reset`";
    default: return "find the reason, then `forereach reset`";
  }
}

}  // namespace forereach
