#include "certifier/gate/watch.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include <fmt/core.h>

#include "forereach/decision_t.hpp"
#include "forereach/fault_t.hpp"
#include "lcmtypes/freshness.h"
#include "lcmtypes/names.h"

namespace forereach {
namespace {

struct Response {
  std::int16_t cause, outcome = decision_t::REJECTED;
};

// Of candidates that come before the need is met.
constexpr std::array<Response, Watch::kNeeds> kResponses{
    {{decision_t::CAUSE_SECOND_CERTIFIER},
     {decision_t::CAUSE_LATCH_UNWRITABLE},
     {decision_t::CAUSE_NOT_ARMED},
     {decision_t::CAUSE_NOT_ARMED},
     {decision_t::CAUSE_NO_OBSTACLES, decision_t::ABSTAIN_OBSTACLES}}};

}  // namespace

Watch::Watch(const WatchOptions& options) : options_(options) { LookForRobot(); }

void Watch::Follow(const WatchOptions& options) {
  options_ = options;
  LookForRobot();
}

void Watch::Set(Need need, std::string why_not) { lacking_[static_cast<std::size_t>(need)] = std::move(why_not); }

void Watch::LookForRobot() {
  Set(Need::kRobotState, robot_seen_us_ || !options_.needs_robot_state ? "" : "waits for the robot's state");
}

void Watch::SeeRobot(std::int64_t now_us) {
  robot_seen_us_ = now_us;
  LookForRobot();
}

void Watch::SeeStamps(const std::optional<Arrival>& robot, const std::optional<Arrival>& obstacles) {
  std::string why;
  if (const auto& bounds = options_.clocks; bounds && robot) {
    if (why = WhyOff(*robot, bounds->OfRobot()); !why.empty())
      why = fmt::format("the robot's clock is {}", why);
    else if (obstacles && WhyOff(*obstacles, *bounds).empty())
      why = WhyApart(*robot, *obstacles, *bounds);
  }
  Set(Need::kClocks, std::move(why));
}

void Watch::RobotHasFinished() {
  robot_seen_us_.reset();
  LookForRobot();
}

std::optional<Watch::Fault> Watch::Advance(std::int64_t now_us, std::int64_t steady_us) {
  // Between two calls only the wall clock can be set: what this differs by is a jump, however long the pause was.
  const std::int64_t offset = now_us - steady_us, moved = offset - offset_us_.value_or(offset);
  offset_us_ = offset;
  Run(now_us, steady_us);
  std::optional<Fault> found;
  // Before the robot's silence, which is measured by the clock that has jumped.
  if (std::abs(moved) > options_.max_clock_jump_us) {
    found = {fault_t::CLOCK_JUMP, now_us,
             fmt::format("the wall clock moved by {}, at most {} are allowed", Milliseconds(moved, 0),
                         Milliseconds(options_.max_clock_jump_us, 0))};
  } else if (options_.needs_robot_state && robot_seen_us_ && now_us - *robot_seen_us_ > options_.robot_timeout_us) {
    found = {fault_t::ROBOT_STATE_LOST, now_us,
             fmt::format("the robot's state was last heard {} ago, at most {} are allowed{}",
                         Milliseconds(now_us, *robot_seen_us_), Milliseconds(options_.robot_timeout_us, 0),
                         pauses_.Explain(*robot_seen_us_, options_.robot_timeout_us))};
    // States whose stamps are off are refused, so the robot only seems silent.
    if (!Lacks(Need::kClocks).empty()) found->why += "; " + Lacks(Need::kClocks);
  }
  return found && Latch(*found) ? found : std::nullopt;
}

bool Watch::Latch(Fault fault) {
  // The first fault is the one that a person has to understand, unless it is one that lets the robot drive on.
  if (fault_ && (StopsTheRobot(fault_->cause) || !StopsTheRobot(fault.cause))) return false;
  fault_ = std::move(fault);
  return true;
}

bool Watch::Reset() {
  if (!fault_) return false;
  // What was heard of the robot before the reset says nothing of it now.
  fault_.reset();
  RobotHasFinished();
  return true;
}

Watch::State Watch::state() const {
  if (fault_) return State::kFault;
  return std::ranges::all_of(lacking_, &std::string::empty) ? State::kArmed : State::kDisarmed;
}

std::optional<Watch::Refusal> Watch::WhyNot() const {
  if (fault_) return Refusal{decision_t::CAUSE_FAULT, decision_t::REJECTED, fmt::format("fault: {}", fault_->why)};
  std::optional<Refusal> refusal;
  for (std::size_t need = 0; need < kNeeds; ++need) {
    if (lacking_[need].empty()) continue;
    if (!refusal)
      refusal = {kResponses[need].cause, kResponses[need].outcome, lacking_[need]};
    else
      refusal->why += "; " + lacking_[need];
  }
  return refusal;
}

}  // namespace forereach
