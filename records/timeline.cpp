#include "records/timeline.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "bus/bus_options.h"
#include "certifier/gate/stamp.h"
#include "forereach/certifier_status_t.hpp"
#include "lcmtypes/names.h"

namespace forereach {
namespace {

// How many entries at the front of `ahead` were taken before a decision: see "Grounds".
template <class Ahead, class DigestOfEntry>
std::ptrdiff_t CountTaken(const Ahead& ahead, const Digest& now, const Digest& named, std::int64_t candidate_place,
                          DigestOfEntry digest_of) {
  if (now == named) return 0;
  const auto same = std::ranges::find(ahead, named, digest_of);
  if (same != ahead.end()) return same - ahead.begin() + 1;
  return std::ranges::count_if(ahead, [&](const auto& entry) { return entry.place < candidate_place; });
}

}  // namespace

Transitions WithLearned(const Transitions& given, const LearnedTransitions& learned, std::size_t count) {
  const Eigen::Index before = given.z.rows(), size = before + static_cast<Eigen::Index>(count);
  Transitions all{Eigen::MatrixXd(size, given.z.cols()), Eigen::MatrixXd(size, given.x_next.cols())};
  all.num_learned = given.num_learned + static_cast<int>(count);
  all.z.topRows(before) = given.z, all.x_next.topRows(before) = given.x_next;
  all.longer = Eigen::VectorXd::Zero(size);
  all.longer.head(given.longer.size()) = given.longer;
  for (std::size_t i = 0; i < count; ++i) {
    const LearnedTransitions::Each each = learned[i];
    const Eigen::Index row = before + static_cast<Eigen::Index>(i);
    all.longer[row] = each.longer;
    all.z.row(row) = Eigen::Map<const Eigen::RowVectorXd>(each.z.data(), std::ssize(each.z));
    all.x_next.row(row) = Eigen::Map<const Eigen::RowVectorXd>(each.next.data(), std::ssize(each.next));
  }
  return all;
}

std::shared_ptr<const Problem> WithLearned(const std::shared_ptr<const Problem>& problem,
                                           const LearnedTransitions& learned, std::size_t count) {
  if (count == 0) return problem;
  auto known = std::make_shared<Problem>(*problem);
  known->transitions = WithLearned(problem->transitions, learned, count);
  return known;
}

std::shared_ptr<const Problem> Basis::problem() const { return WithLearned(task->problem, *learned, num_learned); }

Timeline::Timeline(const Config& first, TaskFinder find, std::optional<KeyRing> keys, std::vector<TimelineUser*> users,
                   const TimelineBounds& bounds)
    : find_(std::move(find)),
      users_(std::move(users)),
      most_learned_((*std::ranges::max_element(users_, {}, &TimelineUser::MostLearned))->MostLearned()),
      bounds_(bounds),
      channels_(first.bus),
      authenticator_(channels_, std::move(keys)),
      now_(&first),
      undecided_(bounds.undecided),
      decided_obstacles_(bounds.obstacles),
      logged_obstacles_(first),
      transition_sender_(Microseconds(first.gate.robot_timeout_ms)) {}

void Timeline::Read(const std::vector<std::string>& logs, bool names_files) {
  if (!has_begun_) Start();
  damage_ += ForEachEvent(logs, [&](const LogEvent& event, const std::string& log) {
    const std::string file = names_files ? std::filesystem::path(log).filename().string() + " " : "";
    Take(event, fmt::format("{}event {}", file, event.number));
  });
}

void Timeline::End() {
  while (const auto candidate = undecided_.TakeFirst()) Tell(&TimelineUser::OnUndecided, *candidate);
}

void Timeline::Take(const LogEvent& event, const std::string& name) {
  if (!has_begun_) Start();
  if (!authenticator_.IsAuthentic(event)) return;
  ++place_;
  Tell(&TimelineUser::OnEvent, event);
  if (event.channel == channels_.candidate) {
    ++candidates_;
    const auto oldest = undecided_.Add(KeyOfCandidates(event.message()),
                                       {{event.message().begin(), event.message().end()}, name, place_});
    if (oldest) Tell(&TimelineUser::OnUndecided, *oldest);
  } else if (event.channel == channels_.decision) {
    TakeDecision(event, name);
  } else if (event.channel == channels_.certified) {
    TakeCertified(event, name);
  } else if (event.channel == channels_.withdrawn) {
    TakeWithdrawal(event, name);
  } else if (event.channel == channels_.status) {
    TakeStatus(event);
  } else if (event.channel == channels_.obstacles) {
    TakeObstacles(event);
  } else if (event.channel == channels_.transition) {
    TakeTransition(event, name);
  }
}

// ---- Starts and reloads.

Timeline::Told Timeline::Heed(Count& count, const StreamPosition& message, const LogEvent& event) {
  const std::int64_t horizon = HorizonOf(event);
  const bool is_first = !count.order.newest();
  const Succession succession = count.order.Compare(message, horizon);
  if (succession == Succession::kLate || succession == Succession::kRepeated) return Told::kOld;
  count.order.Take(message, horizon);
  if (is_first) count.starts = starts_;
  if (succession == Succession::kNewer) return Told::kGoesOn;
  const bool was_told = count.starts < starts_;
  if (!was_told) ++starts_;
  count.starts = starts_;
  return was_told ? Told::kFollows : Told::kStarts;
}

void Timeline::TakeStatus(const LogEvent& event) {
  const auto status = Decoded<certifier_status_t>(event.message());
  if (!status || !IsInCharge(*status)) return;
  const bool is_first = !heartbeats_.order.newest();
  Told told = Heed(heartbeats_, {status->sequence, status->utime}, event);
  if (told == Told::kOld) return;
  if (is_first && status->sequence == 0 && starts_ == 0) {
    heartbeats_.starts = ++starts_;
    told = Told::kStarts;
  }
  const bool is_reload =
      std::exchange(version_, status->version) != status->version && !is_first && told == Told::kGoesOn;
  if (told != Told::kStarts && !is_reload) return;
  const bool is_known =
      std::exchange(reloaded_ahead_, false) && now_->grounds.config == GetDigest(status->config_digest);
  if (const Config* task = find_(GetDigest(status->config_digest))) now_ = task;
  if (told == Told::kStarts)
    Start();
  else if (!is_known)
    Reload();
}

void Timeline::Start() {
  has_begun_ = true;
  obstacles_ahead_.clear();
  kept_ahead_ = KeptObstacles(bounds_.obstacles);
  transition_sender_ = SoleSender(0);
  Follow(ObstaclesInForce(*now_));
  Tell(&TimelineUser::OnStart, *now_);
}

void Timeline::Reload() {
  while (!obstacles_ahead_.empty()) TakeNextObstacles();
  ObstaclesInForce after(*now_);
  after.Inherit(logged_obstacles_);
  Follow(std::move(after));
  Tell(&TimelineUser::OnReload, *now_);
}

// The task in force begins with these obstacles, and with nothing learned.
void Timeline::Follow(ObstaclesInForce obstacles) {
  transitions_ahead_.clear();
  transition_sender_.Follow(Microseconds(now_->gate.robot_timeout_ms));
  logged_obstacles_ = std::move(obstacles);
  obstacles_digest_ = logged_obstacles_.digest();
  obstacles_ = all_logged_ = std::make_shared<const std::vector<Obstacle>>(logged_obstacles_.all());
  logged_observations_ = observations_digest_ = now_->grounds.observations;
  // Of what was learned before, one list stays: a certified plan may come late after its decision.
  std::erase_if(decided_order_, [this](const Digest& plan) {
    const auto decided = decided_.find(plan);
    if (decided->second.basis.learned == learned_) return false;
    decided_obstacles_.Remove(*decided->second.basis.obstacles);
    decided_.erase(decided);
    return true;
  });
  learned_ = std::make_shared<LearnedTransitions>();
}

// A decision may tell of a reload before a heartbeat does.
void Timeline::FollowReload(const Config& task) {
  if (&task == now_) return;
  now_ = &task;
  Reload();
  reloaded_ahead_ = true;
}

// ---- What the certifier has heard.

void Timeline::TakeObstacles(const LogEvent& event) {
  const Digest before = logged_obstacles_.digest();
  const bool was_partial = logged_obstacles_.is_partial();
  if (!logged_obstacles_.Update(event.message(), event.utime, event.sender()).empty()) return;
  const Digest after = logged_obstacles_.digest();
  if (after != before) all_logged_ = std::make_shared<const std::vector<Obstacle>>(logged_obstacles_.all());
  if (after == before && !was_partial && !logged_obstacles_.is_partial()) return;  // one set is sent again and again
  obstacles_ahead_.push_back(
      {place_, event.utime, event.sender(), {event.message().begin(), event.message().end()}, after, all_logged_});
  kept_ahead_.Add(*all_logged_);
  while (obstacles_ahead_.size() > bounds_.ahead || (kept_ahead_.AreTooMany() && obstacles_ahead_.size() > 1))
    TakeNextObstacles();
}

void Timeline::TakeTransition(const LogEvent& event, const std::string& name) {
  transition_sender_.Hear(event.sender(), event.utime);
  if (!transition_sender_.WhyTwo(event.utime).empty()) return;
  const auto message = Decoded<transition_t>(event.message());
  if (!now_->gate.learns || !message) return;
  ExecutedTransition transition = Examine(*message, *now_->problem, now_->gate);
  if (!transition.refusal.empty()) return Tell(&TimelineUser::OnRefusedTransition, name, transition.refusal);
  logged_observations_ = ChainedDigest(logged_observations_, event.message());
  transitions_ahead_.push_back(
      {place_, std::move(transition), {event.message().begin(), event.message().end()}, logged_observations_});
  if (transitions_ahead_.size() > bounds_.ahead) LearnNext();
}

void Timeline::TakeNextObstacles() {
  const ObstaclesChange change = std::move(obstacles_ahead_.front());
  obstacles_ahead_.pop_front();
  kept_ahead_.Remove(*change.obstacles);
  obstacles_digest_ = change.after;
  obstacles_ = change.obstacles;
  Tell(&TimelineUser::OnObstacles, change.bytes, change.utime, change.sender);
}

void Timeline::LearnNext() {
  Transition next = std::move(transitions_ahead_.front());
  transitions_ahead_.pop_front();
  observations_digest_ = next.after;
  Tell(&TimelineUser::OnTransition, next.transition, next.bytes);
  if (learned_->size() < most_learned_) learned_->Add(next.transition.z, next.transition.next, next.transition.longer);
}

// ---- Decisions.

Basis Timeline::Current() const {
  Grounds grounds = now_->grounds;
  grounds.observations = observations_digest_;
  grounds.obstacles = obstacles_digest_;
  return {now_, grounds, obstacles_, learned_, learned_->size()};
}

Basis Timeline::Advance(const Grounds& named, std::int64_t candidate_place) {
  for (auto left =
           CountTaken(obstacles_ahead_, obstacles_digest_, named.obstacles, candidate_place, &ObstaclesChange::after);
       left > 0; --left)
    TakeNextObstacles();
  for (auto left = CountTaken(transitions_ahead_, observations_digest_, named.observations, candidate_place,
                              &Transition::after);
       left > 0; --left)
    LearnNext();
  return Current();
}

void Timeline::TakeDecision(const LogEvent& event, const std::string& name) {
  const auto decision = Decoded<decision_t>(event.message());
  if (!decision) return;
  if (Heed(decisions_, {decision->sequence, decision->utime}, event) == Told::kStarts) Start();
  const PlanKeys keys(*decision);
  const Digest& plan = keys.plan;
  RecordedDecision recorded{*decision, name, undecided_.Take(keys), true, {}};
  if (recorded.candidate) recorded.candidate->bytes = CandidateIn(recorded.candidate->bytes, plan);
  const Config* task = find_(GetDigest(decision->config_digest));
  recorded.is_of_known_task = task != nullptr;
  if (task) FollowReload(*task);
  recorded.basis =
      task ? Advance(GroundsOf(*decision), recorded.candidate ? recorded.candidate->place : -1) : Current();
  const auto [decided, is_new] = decided_.try_emplace(plan, Decided{recorded.basis, recorded.candidate.has_value()});
  if (is_new) decided_order_.push_back(plan), decided_obstacles_.Add(*recorded.basis.obstacles);
  if (recorded.candidate && decision->outcome == decision_t::CERTIFIED) {
    decided_obstacles_.Add(*recorded.basis.obstacles);
    decided_obstacles_.Remove(*decided->second.basis.obstacles);
    decided->second = {recorded.basis, true};
  }
  while (decided_order_.size() > kMostDecided || (decided_obstacles_.AreTooMany() && decided_order_.size() > 1)) {
    const auto first = decided_.find(decided_order_.front());
    decided_obstacles_.Remove(*first->second.basis.obstacles);
    decided_.erase(first);
    decided_order_.pop_front();
  }
  Tell(&TimelineUser::OnDecision, recorded);
}

void Timeline::TakeCertified(const LogEvent& event, const std::string& name) {
  const auto certified = Decoded<certified_plan_t>(event.message());
  if (!certified) {
    ++undecodable_;
    return;
  }
  if (Heed(certified_, {certified->sequence, certified->utime}, event) == Told::kStarts) Start();
  const PlanKeys keys(certified->plan);
  const Digest& plan = keys.plan;
  const Grounds named = GroundsOf(*certified);
  const Config* task = find_(named.config);
  RecordedPlan recorded{*certified, name, false, task != nullptr, {}};
  const RecordedCandidate* const waiting = undecided_.Find(keys);
  const auto decided = decided_.find(plan);
  recorded.has_candidate = waiting || (decided != decided_.end() && decided->second.has_candidate);
  if (decided != decided_.end() && !waiting) {
    recorded.basis = decided->second.basis;
  } else if (task) {
    FollowReload(*task);
    recorded.basis = Advance(named, waiting ? waiting->place : -1);
  } else {
    recorded.basis = Current();
  }
  Tell(&TimelineUser::OnCertified, recorded);
}

void Timeline::TakeWithdrawal(const LogEvent& event, const std::string& name) {
  const auto withdrawal = Decoded<withdrawal_t>(event.message());
  if (!withdrawal || !withdrawals_.IsFirst(*withdrawal)) return;
  RecordedWithdrawal recorded{*withdrawal, name, true, {}};
  const Grounds named = GroundsOf(*withdrawal);
  const Config* task = find_(named.config);
  recorded.is_of_known_task = task != nullptr;
  if (task) FollowReload(*task);
  recorded.basis = task ? Advance(named, -1) : Current();
  Tell(&TimelineUser::OnWithdrawn, recorded);
}

}  // namespace forereach
