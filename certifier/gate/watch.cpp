#include "certifier/gate/watch.h"

#include <cstdlib>

#include "certifier/gate/stamp.h"
#include "forereach/fault_t.hpp"
#include "lcmtypes/names.h"

namespace forereach {
void Watch::SeeRobot(std::int64_t now_us) { robot_seen_us_ = now_us; }

void Watch::RobotHasFinished() { robot_seen_us_.reset(); }

std::optional<Watch::Fault> Watch::Advance(std::int64_t now_us, std::int64_t steady_us) {
  const std::int64_t offset = now_us - steady_us, moved = offset - offset_us_.value_or(offset);
  offset_us_ = offset;
  std::optional<Fault> found;
  if (std::abs(moved) > options_.max_clock_jump_us) {
    found = {fault_t::CLOCK_JUMP, now_us,
             "the wall clock moved by " + Milliseconds(moved, 0) + ", at most " + Milliseconds(options_.max_clock_jump_us, 0) +
                 " are allowed"};
  } else if (options_.needs_robot_state && robot_seen_us_ && now_us - *robot_seen_us_ > options_.robot_timeout_us) {
    found = {fault_t::ROBOT_STATE_LOST, now_us,
             "the robot's state was last heard " + Milliseconds(now_us, *robot_seen_us_) + " ago, at most " +
                 Milliseconds(options_.robot_timeout_us, 0) + " are allowed"};
  }
  return found && Latch(*found) ? found : std::nullopt;
}

bool Watch::Latch(Fault fault) {
  if (fault_ && (StopsTheRobot(fault_->cause) || !StopsTheRobot(fault.cause))) return false;
  fault_ = std::move(fault);
  return true;
}

bool Watch::Reset() {
  if (!fault_) return false;
  fault_.reset();
  robot_seen_us_.reset();
  return true;
}

Watch::State Watch::state() const {
  if (fault_) return State::kFault;
  return robot_seen_us_ || !options_.needs_robot_state ? State::kArmed : State::kDisarmed;
}

}  // namespace forereach
