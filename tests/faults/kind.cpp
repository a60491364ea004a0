#include "tests/faults/kind.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>

#include "bus/process.h"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "tests/faults/demo_task.h"
#include "tests/messages.h"

namespace forereach {

Row& Kind::Begin(const std::string& fault, std::optional<int> tries) {
  std::cerr << fault << "\n";
  Row& row = rows_.emplace_back(Row{.fault = fault, .wanted = tries.value_or(options_.others)});
  progress_ = std::make_unique<Progress>("tries", static_cast<std::size_t>(row.wanted));
  return row;
}

void Kind::NotTried(const std::string& fault, const std::string& why) {
  rows_.emplace_back().fault = fault;
  Remark(rows_.back(), "not tried: " + why);
}

void Kind::Demand(Row& row, bool seen, const std::string& what) {
  if (seen) return;
  std::cerr << row.fault << ": FORBIDDEN: " << what << "\n";
  ++row.forbidden;
}

void Kind::DemandNothingForbidden(Row& row, Rig& rig) {
  for (const std::string& violation : rig.witness().TakeViolations()) Demand(row, false, violation);
  for (const std::string& ending : rig.TakeBadEndings()) Demand(row, false, ending);
}

void Kind::Tries(Row& row, Rig& rig, const std::function<void(int)>& hurt) {
  if (HealAtFirst(row, rig))
    for (int i = 0; i < row.wanted; ++i) Try(row, rig, [&] { hurt(i); });
  rig.EndAll();
  CountLost(row, rig);
  DemandNothingForbidden(row, rig);
  for (const std::string& amiss : rig.CheckRecords()) Demand(row, false, amiss);
}

void Kind::Try(Row& row, Rig& rig, const std::function<void()>& hurt) {
  ++row.tries;
  const std::int64_t before = rig.witness().unheard();
  hurt();
  DemandNothingForbidden(row, rig);
  const std::string why = rig.Heal();
  DemandNothingForbidden(row, rig);
  const std::int64_t unheard = rig.witness().unheard() - before;
  Demand(row, row.bus_loses || unheard <= 0,
         std::to_string(unheard) + " candidates counted, their decisions not heard");
  CountLost(row, rig);
  if (why.empty())
    ++row.recovered;
  else
    std::cerr << row.fault << ": " << why << "\n", Remark(row, why);
  progress_->Advance();
}

// The system has to be healthy before it can be hurt; if it is not, that is a try it has not recovered from.
bool Kind::HealAtFirst(Row& row, Rig& rig) {
  const std::string why = rig.Heal();
  DemandNothingForbidden(row, rig);
  if (why.empty()) return true;
  ++row.tries;
  Remark(row, "never began: " + why);
  return false;
}

void Kind::ObstacleTries(const std::string& fault, const std::function<void(Row&, Rig&, int)>& hurt) {
  Rig rig(DemoTaskOnTheBus(), {.seen = OfTheCourse()});
  rig.witness().SetWorld({ObstaclesDigest(OfTheCourse())});
  Row& row = Begin(fault);
  told_unknown_ = 0;
  Tries(row, rig, [&](int i) { hurt(row, rig, i); });
  if (told_unknown_ > 0) Remark(row, std::to_string(told_unknown_) + " candidates answered no_obstacles");
}

robot_state_t Kind::State(const Rig& rig) const {
  robot_state_t state = StateOf(WallClockUs());
  state.num_states = static_cast<std::int16_t>(rig.config().problem->model->num_states());
  return state;
}

robot_state_t Kind::StateOutside(Rig& rig) {
  robot_state_t state = State(rig);
  const certified_plan_t& certified = *rig.witness().last_certified();
  const int step = Below(certified.plan.num_steps), k = Below(state.num_states);
  state.mode = robot_state_t::EXECUTING;
  state.executing_plan_id = certified.plan.plan_id;
  state.executing_step = static_cast<std::int16_t>(step);
  std::copy_n(certified.slice_lower[step], state.num_states, state.state);
  constexpr double kEverything = std::numeric_limits<double>::infinity();
  const double by = Below(2) * 5.0;
  state.state[k] = Below(2) == 0 ? std::nextafter(certified.slice_lower[step][k] - by, -kEverything)
                                 : std::nextafter(certified.slice_upper[step][k] + by, kEverything);
  return state;
}

std::optional<fault_t> Kind::Provoke(Row& row, Rig& rig, std::int64_t sequence) {
  rig.witness().ForgetFault();
  robot_state_t state = StateOutside(rig);
  state.sequence = sequence;
  rig.bus().Publish(rig.config().bus.robot_state, state);
  static_cast<void>(rig.ListenUntil([&] { return rig.witness().fault().has_value(); }, kSaysSoon));
  DemandLatched(row, rig, fault_t::SLICE_LEFT);
  return rig.witness().fault();
}

void Kind::DemandLatched(Row& row, Rig& rig, std::int16_t cause) {
  const auto& fault = rig.witness().fault();
  Demand(row, fault && fault->cause == cause, "the certifier latched no " + std::string(FaultName(cause)));
  Demand(row, rig.witness().certificates_since_fault() == 0, "it certified before the reset");
}

void Kind::DemandStillLatched(Row& row, Rig& rig, const fault_t& fault) {
  const std::int64_t certificates = rig.witness().certificates();
  rig.witness().Forget();
  const auto says_it = [&] {
    const auto& said = rig.witness().fault();
    const auto& status = rig.witness().status();
    return said && said->cause == fault.cause && said->utime == fault.utime &&
           GetText(said->message) == GetText(fault.message) && status && status->state == certifier_status_t::FAULT;
  };
  Demand(row, rig.ListenUntil(says_it, kStarts), "the next certifier does not say the fault again");
  rig.Listen(milliseconds(1000));
  Demand(row, rig.witness().certificates() == certificates, "the next certifier certified before the reset");
}

std::optional<std::int16_t> Kind::CauseOfACandidate(Rig& rig) {
  candidate_plan_t candidate = CandidateFor(rig.config(), next_own_id_++, Eigen::Vector2d(0, 0), 6, milliseconds(400));
  SetText(candidate.source, "campaign");
  rig.bus().Publish(rig.config().bus.candidate, candidate);
  const Digest digest = PlanDigest(candidate);
  static_cast<void>(rig.ListenUntil([&] { return rig.witness().CauseOf(digest).has_value(); }, milliseconds(600)));
  return rig.witness().CauseOf(digest);
}

void Kind::DemandUnknown(Row& row, Rig& rig, const std::string& when) {
  const auto cause = CauseOfACandidate(rig);
  const bool rejected = cause == decision_t::CAUSE_NO_OBSTACLES || cause == decision_t::CAUSE_NOT_ARMED ||
                        cause == decision_t::CAUSE_FAULT;
  Demand(row, rejected, "a candidate was answered " + std::string(cause ? CauseName(*cause) : "nothing") + " " + when);
  if (cause == decision_t::CAUSE_NO_OBSTACLES) ++told_unknown_;
}

std::vector<Obstacle> Kind::OfTheCourse() {
  const ScratchDirectory scratch;
  return LoadConfig(scratch.Write("world.yaml", DemoTask())).obstacles;
}

std::vector<Obstacle> Kind::WithADriftingOne() {
  std::vector<Obstacle> seen = OfTheCourse();
  seen.push_back(Drifting(60, 14));
  return seen;
}

Obstacle Kind::Drifting(double x, double y) {
  ObstacleMotion motion;
  motion.stamp_us = WallClockUs();
  motion.velocity.y() = 0.02;
  motion.uncertainty = 0.1;
  return Obstacle::Circle(Eigen::Vector2d(x, y), 0.5).Moving(motion);
}

}  // namespace forereach
