#include "planner_bridge/planner_node.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <ostream>
#include <utility>

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bus/log.h"
#include "certifier/gate/advice_message.h"
#include "certifier/gate/candidate_message.h"
#include "certifier/gate/stamp.h"
#include "clients/planner_client.h"
#include "forereach/numerics/directed.h"
#include "forereach/sets/zonotope.h"
#include "lcmtypes/names.h"
#include "planner_bridge/reference.h"
#include "task/json_text.h"
#include "task/step_time.h"

namespace forereach {
namespace {

constexpr double kStuckWithin = 0.1;  // s at cruise speed, the way of a robot that is stuck
constexpr double kSamePlace = 1;      // s at cruise speed, between dead ends that count as one
constexpr int kBackOffs = 3;          // candidates of a round that backs off

Eigen::VectorXd HalfWidth(const Config& config) {
  const std::vector<double>& given = config.planner.initial_half_width;
  const int n = config.problem->model->num_states();
  if (std::ssize(given) != n)
    throw ConfigError("{}: planner.initial_half_width: {} entries, it has to have {}", config.path, given.size(), n);
  return Eigen::Map<const Eigen::VectorXd>(given.data(), n);
}

}  // namespace

PlannerNode::PlannerNode(const Config& config, Bus& bus, std::ostream& out)
    : config_(config),
      out_(out),
      period_us_(Microseconds(config.robot.step_period_ms)),
      half_width_(HalfWidth(config)),
      residual_(config.problem),
      proposer_(MakeProposer(config)),
      hardest_(config, Braking::kHardest),
      obstacles_(config),
      messages_(config_, bus, kSource,
                {[this](const robot_state_t& state, std::int64_t now_us) { OnRobotState(state, now_us); },
                 [this](const decision_t& decision, std::int64_t now_us) { OnDecision(decision, now_us); },
                 [this](const withdrawal_t& withdrawal, std::int64_t now_us) { OnWithdrawn(withdrawal, now_us); },
                 HandlerOfAdvice()}) {
  bus.Subscribe(config_.bus.obstacles, [this](const Received& received) { OnObstacles(received); });
}

void PlannerNode::Tick(std::int64_t now_us) {
  if (!round_ || round_->awaited_plan >= 0) return;
  // The certifier certifies nothing while it does not know them.
  if (!obstacles_.WhyUnknown(now_us).empty()) return EndRound(false);
  if (round_->unadvised && now_us < round_->advice_until) return;
  LearnWithoutAdvice();
  SearchOnce(now_us);
}

PlannerMessages::Handler<advice_t> PlannerNode::HandlerOfAdvice() {
  if (!config_.gate.advises && !config_.planner.repairs) return {};
  return [this](const advice_t& advice, std::int64_t) { OnAdvice(advice); };
}

void PlannerNode::OnRobotState(const robot_state_t& state, std::int64_t now_us) {
  if (finished_) return;
  Follow(state);
  const bool knows_obstacles = obstacles_.WhyUnknown(now_us).empty();
  if (!knows_obstacles) place_.resize(0);  // this time does not count
  if (!arrived_ && !finished_ && !round_ && !waiting_start_ && knows_obstacles && NextPlanIsDue(state))
    BeginRound(state, config_.planner.lead_steps, false);
}

Eigen::VectorXd PlannerNode::PlaceOf(const robot_state_t& state) const {
  return config_.problem->projection * Eigen::Map<const Eigen::VectorXd>(state.state, state.num_states);
}

bool PlannerNode::IsAtGoal(const robot_state_t& state) const {
  const std::vector<double>& goal = config_.planner.goal;
  return (PlaceOf(state) - Eigen::Map<const Eigen::VectorXd>(goal.data(), std::ssize(goal))).norm() <=
         config_.planner.goal_radius;
}

// Updates the earlier plans from the state: the executing plan, and the starts that have passed.
void PlannerNode::Follow(const robot_state_t& state) {
  Estimate(state);
  last_state_ = state;
  finished_ = state.mode == robot_state_t::FINISHED;
  arrived_ = arrived_ || IsAtGoal(state);
  // A plan that would start in the past is refused by everybody.
  if (round_ && (arrived_ || finished_ || round_->start.utime <= state.utime)) EndRound(false);
  if (waiting_start_ && *waiting_start_ <= state.utime) waiting_start_.reset();
  if (state.mode == robot_state_t::EXECUTING)
    plans_.erase(plans_.begin(), plans_.lower_bound(state.executing_plan_id));
  else if (!round_ && !waiting_start_)
    plans_.clear();
  std::erase_if(withdrawn_, [this](const auto& withdrawn) { return !plans_.contains(withdrawn.first); });
}

// The state that the controls make of the estimate before, moved into measured +- error. So earlier measurements count,
// too. It proves nothing of the true state: a guard compares measured +- error with X0 when a plan starts.
void PlannerNode::Estimate(const robot_state_t& state) {
  const Eigen::VectorXd measured = Eigen::Map<const Eigen::VectorXd>(state.state, state.num_states);
  const bool is_next = last_state_.num_states > 0 && state.utime - last_state_.utime == period_us_;
  const bool moved = last_state_.mode == robot_state_t::EXECUTING;
  const auto plan = moved ? plans_.find(last_state_.executing_plan_id) : plans_.end();
  const std::int64_t step = last_state_.executing_step;
  if (!is_next || (moved && (plan == plans_.end() || step < 0 || step >= plan->second.num_steps))) {
    estimate_ = measured;
    return;
  }
  if (moved) Advance(plan->second, step, estimate_);
  Eigen::VectorXd off = estimate_ - measured;
  for (const int k : config_.problem->model->angles()) off[k] = std::remainder(off[k], 2 * std::numbers::pi);
  const Eigen::VectorXd error = ErrorOf(state);
  estimate_ = measured + off.cwiseMax(-error).cwiseMin(error);
}

void PlannerNode::Advance(const candidate_plan_t& plan, std::int64_t step, Eigen::VectorXd& x) const {
  const auto n = static_cast<std::size_t>(x.size()), m = static_cast<std::size_t>(plan.num_inputs);
  std::array<double, kMaxVariables> z;
  std::copy_n(plan.control[step], m, std::copy_n(x.data(), n, z.begin()));
  residual_.Predict({z.data(), n + m}, {x.data(), n});
}

// For how long it has stood at this place, if it stands. One that moves may still get away.
std::int64_t PlannerNode::StandsFor(const robot_state_t& state) {
  const Eigen::VectorXd place = PlaceOf(state);
  if (place_.size() > 0 && (place - place_).norm() > kStuckWithin * config_.planner.cruise_speed) place_.resize(0);
  if (!IsAtRest(state)) return 0;
  if (place_.size() == 0) {
    place_ = place;
    there_since_ = state.utime;
  }
  return state.utime - there_since_;
}

// Whether holding changes the state by no more than a candidate's X0 allows. A robot that is still coming to rest will
// be somewhere else when the candidate starts.
bool PlannerNode::IsAtRest(const robot_state_t& state) const {
  const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(state.state, state.num_states);
  Eigen::VectorXd held = x;
  proposer_->motion().Hold({held.data(), static_cast<std::size_t>(held.size())});
  return ((x - held).cwiseAbs().array() <= HalfWidthFor(state).array()).all();
}

bool PlannerNode::NextPlanIsDue(const robot_state_t& state) const {
  if (state.mode == robot_state_t::STANDING) return IsAtRest(state);
  const auto plan = plans_.find(state.executing_plan_id);
  return plan != plans_.end() && 0 <= state.executing_step && state.executing_step < plan->second.num_steps &&
         (withdrawn_.contains(plan->first) ||
          state.executing_step + config_.planner.lead_steps >= plan->second.progress_steps);
}

// Simulates from the estimate through the controls that will be applied before the start. A plan that starts
// where the executing one ends takes over before the robot holds still. An angle gets the turns that bring it nearest
// to the middle of the domain.
std::optional<Eigen::VectorXd> PlannerNode::PredictStart(const robot_state_t& state, std::int64_t lead_steps) const {
  Eigen::VectorXd x = estimate_;
  const bool executing = state.mode == robot_state_t::EXECUTING;
  const candidate_plan_t* plan = executing ? &plans_.at(state.executing_plan_id) : nullptr;
  const std::int64_t first = state.executing_step, start = first + lead_steps;
  for (std::int64_t step = first; executing && step < std::min<std::int64_t>(start, plan->num_steps); ++step)
    Advance(*plan, step, x);
  if (!executing || start > plan->num_steps) proposer_->motion().Hold({x.data(), static_cast<std::size_t>(x.size())});
  for (const int k : config_.problem->model->angles()) {  // room to turn either way
    const Box& domain = config_.problem->domain.state;
    const double middle = domain.lower()[k] / 2 + domain.upper()[k] / 2;
    x[k] = middle + std::remainder(x[k] - middle, 2 * std::numbers::pi);
  }
  if (!x.allFinite()) return std::nullopt;
  return x;
}

Eigen::VectorXd PlannerNode::ErrorOf(const robot_state_t& state) const {
  if (state.num_state_errors > 0) return Eigen::Map<const Eigen::VectorXd>(state.state_error, state.num_states);
  Eigen::VectorXd error(state.num_states);
  for (Eigen::Index k = 0; k < error.size(); ++k) error[k] = config_.problem->declaration.VariableError(k);
  return error;
}

// By what a guard asks for: all of the measured state at the start, +- its error, inside X0.
Eigen::VectorXd PlannerNode::HalfWidthFor(const robot_state_t& state) const {
  Eigen::VectorXd half_width = ErrorOf(state);
  for (Eigen::Index k = 0; k < half_width.size(); ++k) half_width[k] = AddUp(half_width_[k], half_width[k]);
  return half_width;
}

void PlannerNode::BeginRound(const robot_state_t& state, std::int64_t lead_steps, bool stops) {
  const std::optional<Eigen::VectorXd> center = PredictStart(state, lead_steps);
  if (!center) return;
  ++(stops ? stopping_rounds_ : rounds_);
  round_ = Round{{state.utime + lead_steps * period_us_, *center, HalfWidthFor(state)},
                 Lessons(config_.planner, config_.problem->limits.size()),
                 stops};
  if (stops || !proposer_->motion().has_back_off()) return;
  const std::int64_t stands_us = StandsFor(state);
  if (stands_us < kStuckUs || (stands_us < kWaitsUs && HasRoomFurtherBack(0))) return;
  ++back_off_rounds_;
  there_since_ = state.utime;
  round_->back_off_steps = StepsBack();
}

// Whether it could drive on from where it stands after so many steps back.
bool PlannerNode::HasRoomFurtherBack(int steps) const {
  const Eigen::MatrixXd& projection = config_.problem->projection;
  Eigen::MatrixXd controls;
  const std::span<const double> state(round_->start.center.data(),
                                      static_cast<std::size_t>(round_->start.center.size()));
  if (!proposer_->motion().BackOff(state, std::max(steps, 1), config_.planner.tail_steps, controls)) return false;
  const Eigen::VectorXd end = Rollout(*config_.problem->model, round_->start.center, controls).rightCols(1);
  const Eigen::VectorXd way = projection * (round_->start.center - end);
  if (!(way.norm() > 0)) return false;
  PlanRequest request = RequestOf(*round_);
  if (steps > 0) request.state = end;
  return proposer_->HasRoom(request, way.normalized());
}

// For how long it backs off from its place: as long as it takes until it can drive on, and longer each time.
int PlannerNode::StepsBack() {
  const PlannerOptions& options = config_.planner;
  const bool again = stuck_at_ && (place_ - *stuck_at_).norm() <= kSamePlace * options.cruise_speed;
  doublings_ = again ? doublings_ + 1 : 0;
  stuck_at_ = place_;
  const int most = kMaxSteps - options.tail_steps;
  int steps = std::min(options.progress_steps, most);
  // Near the same place it was not enough the last time.
  for (int i = 0; i < doublings_ && 2 * steps <= most; ++i) steps *= 2;
  const int least = steps;
  while (steps + options.progress_steps <= most && !HasRoomFurtherBack(steps)) steps += options.progress_steps;
  return HasRoomFurtherBack(steps) ? steps : least;
}

// ---- Withdrawals.

void PlannerNode::OnWithdrawn(const withdrawal_t& withdrawal, std::int64_t now_us) {
  const auto plan = plans_.find(withdrawal.plan_id);
  if (plan == plans_.end()) return;  // it is over
  const int valid_steps = std::max<int>(withdrawal.valid_steps, 0);
  const auto [known, is_first] = withdrawn_.try_emplace(withdrawal.plan_id, valid_steps);
  if (!is_first && valid_steps >= known->second) return;  // a repetition
  known->second = valid_steps;
  ++withdrawals_;
  if (waiting_start_ && waiting_plan_ == withdrawal.plan_id) waiting_start_.reset();
  const bool executes = last_state_.mode == robot_state_t::EXECUTING && last_state_.executing_plan_id == plan->first &&
                        0 <= last_state_.executing_step && last_state_.executing_step < plan->second.num_steps;
  if (executes && !finished_ && !TakesOver(valid_steps)) BeginStop(valid_steps, now_us);
}

// Whether a certified plan starts while the executing one stands.
bool PlannerNode::TakesOver(int valid_steps) const {
  return waiting_start_ &&
         *waiting_start_ <= last_state_.utime + (valid_steps - last_state_.executing_step) * period_us_;
}

// Steps from the last state to the first boundary for which a candidate that is sent now can be decided on. A part of
// the time is for the way there and back.
std::int64_t PlannerNode::StepsToAStop(std::int64_t now_us) const {
  const std::int64_t earliest = now_us + 2 * Microseconds(config_.gate.decision_budget_ms) - last_state_.utime;
  return std::max<std::int64_t>((earliest + period_us_ - 1) / period_us_, 1);
}

void PlannerNode::BeginStop(int valid_steps, std::int64_t now_us) {
  if (round_) EndRound(false);
  const std::int64_t lead_steps = StepsToAStop(now_us);
  if (last_state_.executing_step + lead_steps > valid_steps) return;  // the guard stops the robot before
  waiting_start_.reset();
  BeginRound(last_state_, lead_steps, true);
}

void PlannerNode::LogLostRounds() const {
  std::string causes;
  for (const auto* by_cause : {&abstained_, &rejected_})
    for (const auto& [cause, count] : *by_cause) causes += fmt::format(", {} {}", cause, count);
  logging::Warn(
      "{} rounds in a row without a certificate; since the start {} searches, {} without a plan{}. {}", kLostRounds,
      searches_, fruitless_searches_, causes,
      2 * fruitless_searches_ > searches_
          ? "No plan stays in the domain and ends at rest: planner.stop has to bring the robot to rest within "
            "planner.tail_steps, by feedback if it falls without"
          : "`forereach check` says what keeps plans from certificates, `forereach advise` what would turn these");
}

void PlannerNode::EndRound(bool certified) {
  if (round_->awaited_plan >= 0) ++unanswered_;
  if (certified) {
    waiting_start_ = round_->start.utime;
    lost_in_a_row_ = 0;
  } else {
    ++fruitless_rounds_;
    if (round_->searches > 0 && ++lost_in_a_row_ == kLostRounds) LogLostRounds();
    // From the same place the hints give the plan that was refused.
    refused_center_ = round_->start.center;
  }
  round_.reset();
}

void PlannerNode::SearchOnce(std::int64_t now_us) {
  const std::int64_t takes_us =
      round_->stops ? Microseconds(config_.gate.decision_budget_ms) : Microseconds(config_.planner.time_limit_ms);
  std::deque<Proposal>& found = round_->found;
  if ((found.empty() && round_->searches == MostCandidates()) || now_us + takes_us >= round_->start.utime) {
    if (!SendRepair(now_us)) EndRound(false);
    return;
  }
  if (found.empty()) {
    ++round_->searches;
    ++searches_;
    std::ranges::move(Propose(), std::back_inserter(found));
  }
  if (found.empty()) {
    ++fruitless_searches_;
    round_->lessons.Ease();
    return;
  }
  SendNext(now_us);
}

void PlannerNode::SendNext(std::int64_t now_us) {
  std::deque<Proposal>& found = round_->found;
  std::vector<PlannerMessages::Controls> plans;
  for (const Proposal& proposal : found) plans.push_back({proposal.controls, proposal.progress_steps});
  const int sent = Send(plans, AsksForRepairs(), now_us);
  found.erase(found.begin(), sent > 0 ? found.begin() + sent : found.end());
}

// As many of them as one message has room for.
int PlannerNode::Send(const std::vector<PlannerMessages::Controls>& plans, bool asks_for_repair, std::int64_t now_us) {
  const std::vector<candidate_plan_t> sent = messages_.Send(round_->start, plans, asks_for_repair, now_us);
  if (sent.empty()) return 0;
  round_->awaited_plan = sent.front().plan_id;
  round_->awaited = std::ssize(sent);
  for (const candidate_plan_t& candidate : sent) plans_[candidate.plan_id] = candidate;
  return static_cast<int>(sent.size());
}

// If the certifier can still decide on it. It asks for no other.
bool PlannerNode::SendRepair(std::int64_t now_us) {
  const std::optional<advice_t> repair = std::exchange(round_->repair, std::nullopt);
  if (!repair || now_us + Microseconds(config_.gate.decision_budget_ms) > round_->start.utime) return false;
  const candidate_plan_t& plan = repair->proposal;
  const Eigen::MatrixXd controls = ControlsOf(plan);
  if (Send({{controls, plan.progress_steps}}, false, now_us) == 0) return false;
  ++repairs_;
  return true;
}

// Not of a stop or a way back: there the planner has others.
bool PlannerNode::AsksForRepairs() const {
  return config_.planner.repairs && !round_->stops && round_->back_off_steps == 0;
}

int PlannerNode::MostCandidates() const {
  if (round_->stops) return hardest_.num_tails();
  return round_->back_off_steps > 0 ? kBackOffs : config_.planner.candidates;
}

std::vector<Proposal> PlannerNode::Propose() {
  if (!round_->stops && round_->back_off_steps == 0) return proposer_->ProposeMany(RequestOf(*round_));
  const std::span<const double> state(round_->start.center.data(),
                                      static_cast<std::size_t>(round_->start.center.size()));
  const std::optional<Proposal> one = round_->back_off_steps > 0 ? BackOffFrom(state) : StopFrom(state);
  return one ? std::vector{*one} : std::vector<Proposal>{};
}

std::optional<Proposal> PlannerNode::BackOffFrom(std::span<const double> state) const {
  Proposal proposal;
  proposal.progress_steps = std::max(round_->back_off_steps >> (round_->searches - 1), 1);
  if (!proposer_->motion().BackOff(state, proposal.progress_steps, config_.planner.tail_steps, proposal.controls))
    return std::nullopt;
  return proposal;
}

std::optional<Proposal> PlannerNode::StopFrom(std::span<const double> state) const {
  Proposal proposal;
  if (!hardest_.Brake(state, round_->searches - 1, kMaxSteps, proposal.controls) || proposal.controls.cols() == 0)
    return std::nullopt;
  return proposal;
}

PlanRequest PlannerNode::RequestOf(const Round& round) const {
  PlanRequest request{
      round.start.center,
      round.lessons.clearance(),
      round.lessons.DomainMargin(round.start.half_width, config_.problem->projection),
      static_cast<std::uint32_t>(config_.planner.seed) * kSeedSpread + static_cast<std::uint32_t>(searches_),
      round.searches - 1,
      {round.start.utime, period_us_, ScheduleErrorUs(config_.gate)},
      round.lessons.limit_margin(),
      round.lessons.obstacle_clearance(),
      round.searches == 1 && !(refused_center_ && *refused_center_ == round.start.center)};
  if (config_.planner.certifies)
    request.initial_set =
        std::make_shared<const Zonotope>(Zonotope::FromBox(round.start.center, round.start.half_width));
  return request;
}

void PlannerNode::OnDecision(const decision_t& decision, std::int64_t now_us) {
  if (!round_ || round_->awaited_plan < 0 || decision.plan_id < round_->awaited_plan ||
      decision.plan_id - round_->awaited_plan >= round_->awaited) {
    ++ignored_;
    return;
  }
  const std::int64_t first = std::exchange(round_->awaited_plan, -1);
  // One decision answers a batch: its other plans are never certified.
  std::erase_if(plans_, [&](const auto& plan) {
    return first <= plan.first && plan.first - first < round_->awaited && plan.first != decision.plan_id;
  });
  Learn(decision, now_us);
}

void PlannerNode::Learn(const decision_t& decision, std::int64_t now_us) {
  if (decision.outcome == decision_t::CERTIFIED) {
    ++certified_;
    waiting_plan_ = decision.plan_id;
    return EndRound(true);
  }
  plans_.erase(decision.plan_id);
  auto& counts = decision.outcome == decision_t::REJECTED ? rejected_ : abstained_;
  ++counts[std::string(CauseName(decision.cause))];
  // No candidate can be certified until the certifier's state changes.
  if (decision.cause == decision_t::CAUSE_NOT_ARMED || decision.cause == decision_t::CAUSE_NO_OBSTACLES ||
      decision.cause == decision_t::CAUSE_FAULT || decision.cause == decision_t::CAUSE_LATCH_UNWRITABLE ||
      decision.outcome == decision_t::ABSTAIN_FALSIFIED)
    return EndRound(false);
  round_->unadvised = decision;
  round_->advice_until = now_us;
  const bool is_repaired = AsksForRepairs() && (decision.outcome == decision_t::ABSTAIN_DOMAIN ||
                                                decision.outcome == decision_t::ABSTAIN_SAFETY);
  if (is_repaired || (config_.gate.advises && IsAdvisedOn(decision.cause) && !round_->stops))
    round_->advice_until += 2 * Microseconds(config_.gate.decision_budget_ms);
}

// Its numbers only say what the next candidate keeps away from, or are a candidate like all: false ones cost time, and
// can have nothing executed.
void PlannerNode::OnAdvice(const advice_t& advice) {
  const bool is_on_last = round_ && round_->unadvised &&
                          GetDigest(advice.plan_digest) == GetDigest(round_->unadvised->plan_digest) &&
                          GetDigest(advice.obstacles_digest) == obstacles_.digest();
  if (!is_on_last || !Heed(advice)) ++ignored_;
}

// With a proposal, or none, the abstention is learned from as without advice, and at once.
bool PlannerNode::Heed(const advice_t& advice) {
  if (AsksForRepairs() && advice.num_changes == 0) {
    if (advice.changed != 0 && !TakeRepair(advice)) return false;
    round_->advice_until = 0;
    return true;
  }
  if (!round_->lessons.Heed(advice)) return false;
  ++advised_;
  round_->unadvised.reset();
  return true;
}

bool PlannerNode::TakeRepair(const advice_t& advice) {
  const candidate_plan_t& plan = advice.proposal;
  if (!HasSizes(plan, *config_.problem->model) || plan.progress_steps < 0 || plan.progress_steps > plan.num_steps ||
      !(advice.nearness[0] >= 0))
    return false;
  if (!round_->repair || advice.nearness[0] < round_->repair->nearness[0]) round_->repair = advice;
  return true;
}

void PlannerNode::LearnWithoutAdvice() {
  if (!round_->unadvised) return;
  const decision_t decision = *std::exchange(round_->unadvised, std::nullopt);
  Decision learned;
  learned.outcome = static_cast<Outcome>(decision.outcome);
  learned.cause = static_cast<Cause>(decision.cause);
  learned.coordinate = decision.coordinate;
  learned.margin = decision.margin;
  learned.threshold = decision.threshold;
  round_->lessons.Learn(learned);
}

void PlannerNode::OnObstacles(const Received& received) {
  if (!obstacles_.Update(received.bytes, received.utime, received.sender).empty()) {
    ++ignored_;
    return;
  }
  if (obstacles_.digest() == planned_among_) return;  // the message before said the same
  proposer_->SetObstacles(obstacles_.all());
  planned_among_ = obstacles_.digest();
}

void PlannerNode::Stop() { out_ << Summary() << std::endl; }

std::string PlannerNode::Summary() const {
  return JsonText(nlohmann::ordered_json{{"proposed", messages_.sent()},
                                         {"certified", certified_},
                                         {"abstained", abstained_},
                                         {"rejected", rejected_},
                                         {"advised", advised_},
                                         {"repairs", repairs_},
                                         {"unanswered", unanswered_},
                                         {"withdrawn", withdrawals_},
                                         {"rounds", rounds_},
                                         {"stopping_rounds", stopping_rounds_},
                                         {"back_off_rounds", back_off_rounds_},
                                         {"rounds_without_certificate", fruitless_rounds_},
                                         {"searches_without_result", fruitless_searches_},
                                         {"messages_ignored", ignored_ + messages_.ignored()},
                                         {"messages_not_sent", messages_.not_sent()}});
}

}  // namespace forereach
