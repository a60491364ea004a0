#include "records/shadow.h"

#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "certifier/gate/upheld.h"
#include "lcmtypes/names.h"

namespace forereach {
namespace {

constexpr std::size_t kMostStates = 4 * kMaxSteps;  // of one plan; a robot that repeats itself fills no memory

std::string CausesText(const std::map<std::string, std::int64_t>& causes) {
  std::string text;
  for (const auto& [cause, count] : causes) text += fmt::format("{}{} {}", text.empty() ? " (" : ", ", cause, count);
  return text.empty() ? text : text + ")";
}

bool IsLeft(const robot_state_t& state, const Tube& tube, const Upheld& upheld, const Angles& angles) {
  for (int k = 0; k < state.num_states; ++k) {
    const double error =
        state.num_state_errors > 0 ? state.state_error[k] : upheld.state_error[static_cast<std::size_t>(k)];
    const Interval hull = tube.hull(state.executing_step, k);
    if (Conform(state.state[k], error, hull.lower, hull.upper, angles[static_cast<std::size_t>(k)]) ==
        Conformance::kLeft)
      return true;
  }
  return false;
}

}  // namespace

std::int64_t ShadowSummary::refusals() const {
  return std::accumulate(refused.begin(), refused.end(), std::int64_t{0},
                         [](std::int64_t sum, const auto& entry) { return sum + entry.second; });
}

std::string ToText(const ShadowSummary& summary) {
  if (!summary.any()) return "";
  std::string text;
  const auto line = [&text](std::string_view name, const std::string& value) {
    text += fmt::format("{:<26}{}\n", name, value);
  };
  line("SHADOW", "the gate certified nothing, and the robot did not obey it");
  line("  would be certified",
       fmt::format("{}; driven {}: {} left a slice ({} of {} states), {} contacts", summary.certified,
                   summary.driven_certified.plans, summary.plans_left, summary.states_left, summary.states,
                   summary.driven_certified.contacts) +
           (summary.not_compared > 0 ? fmt::format("; {} not compared", summary.not_compared) : ""));
  line("  would be refused",
       fmt::format("{}{}; driven {}: {} contacts", summary.refusals(), CausesText(summary.refused),
                   summary.driven_refused.plans, summary.driven_refused.contacts));
  line("  not judged", std::to_string(summary.not_judged));
  line("  other contacts", std::to_string(summary.other_contacts));
  return text;
}

std::string ToSentence(const ShadowSummary& summary) {
  if (!summary.any()) return "";
  return fmt::format(
      "Shadow mode: the gate certified nothing, and the robot did not obey it. It would have certified {} plans and "
      "refused {}. Of the first the robot drove {}, left a slice of {} and had {} contacts; of the others it drove {} "
      "and had {} contacts.",
      summary.certified, summary.refusals(), summary.driven_certified.plans, summary.plans_left,
      summary.driven_certified.contacts, summary.driven_refused.plans, summary.driven_refused.contacts);
}

nlohmann::json ToJson(const ShadowSummary& summary) {
  if (!summary.any()) return nullptr;
  return {{"would_be_certified", summary.certified},
          {"would_be_refused", summary.refused},
          {"not_judged", summary.not_judged},
          {"driven_certified",
           {{"plans", summary.driven_certified.plans},
            {"left", summary.plans_left},
            {"states", summary.states},
            {"states_left", summary.states_left},
            {"not_compared", summary.not_compared},
            {"contacts", summary.driven_certified.contacts}}},
          {"driven_refused", {{"plans", summary.driven_refused.plans}, {"contacts", summary.driven_refused.contacts}}},
          {"other_contacts", summary.other_contacts}};
}

void ShadowTally::OnDecision(const RecordedDecision& recorded) {
  const decision_t& decision = recorded.decision;
  const bool is_certified = decision.cause == decision_t::CAUSE_SHADOW;
  if (!is_certified && !(recorded.is_of_known_task && recorded.basis.task->gate.shadow)) return;
  if (decision.outcome == decision_t::REJECTED && !is_certified) return static_cast<void>(++summary_.not_judged);
  if (is_certified)
    ++summary_.certified;
  else
    ++summary_.refused[std::string(CauseName(decision.cause))];
  // The same id again: what was driven so far was driven under the decision before.
  if (decision.plan_id == driven_) EndPlan();
  obstacles_.Add(*recorded.basis.obstacles);
  if (const auto known = plans_.find(decision.plan_id); known != plans_.end()) {
    obstacles_.Remove(*known->second.recorded.basis.obstacles);
    known->second = Plan{CaseOf(recorded), is_certified};
  } else {
    plans_.emplace(decision.plan_id, Plan{CaseOf(recorded), is_certified});
    order_.push_back(decision.plan_id);
  }
  while (order_.size() > kMostPlans || (obstacles_.AreTooMany() && order_.size() > 1)) {
    if (order_.front() == driven_) EndPlan();
    const auto first = plans_.find(order_.front());
    obstacles_.Remove(*first->second.recorded.basis.obstacles);
    plans_.erase(first);
    order_.pop_front();
  }
}

void ShadowTally::OnEvent(const LogEvent& event) {
  if (event.channel == channels_.robot_state) {
    if (const auto state = Decoded<robot_state_t>(event.message())) Follow(*state);
  } else if (event.channel == channels_.event) {
    const auto execution = Decoded<execution_event_t>(event.message());
    if (!execution || execution->kind != execution_event_t::CONTACT) return;
    ShadowSummary::Driven* const driven = DrivenNow();
    ++(driven ? driven->contacts : summary_.other_contacts);
  }
}

void ShadowTally::Follow(const robot_state_t& state) {
  const bool executes = state.mode == robot_state_t::EXECUTING && plans_.contains(state.executing_plan_id);
  if (!executes || state.executing_plan_id != driven_) EndPlan();
  if (!executes) return;
  Plan& plan = plans_.at(state.executing_plan_id);
  if (driven_ < 0) {
    driven_ = state.executing_plan_id;
    is_driven_certified_ = plan.is_certified;
    ++DrivenNow()->plans;
  }
  const bool is_usable = plan.is_certified && plan.recorded.missing.empty() && state.executing_step >= 0 &&
                         state.executing_step <= plan.recorded.candidate->num_steps &&
                         FaultOf(state, plan.recorded.candidate->num_states).empty();
  if (is_usable && plan.states.size() < kMostStates) plan.states.push_back(state);
}

ShadowSummary::Driven* ShadowTally::DrivenNow() {
  if (driven_ < 0) return nullptr;
  return is_driven_certified_ ? &summary_.driven_certified : &summary_.driven_refused;
}

// Its slices are made again, together with those of others.
void ShadowTally::EndPlan() {
  if (driven_ < 0) return;
  Plan& plan = plans_.at(std::exchange(driven_, -1));
  if (!plan.is_certified) return;
  if (!plan.recorded.missing.empty()) return static_cast<void>(++summary_.not_compared);
  drives_[next_place_].states = std::exchange(plan.states, {});
  Put(plan.recorded, next_place_++);
}

void ShadowTally::Look(const JudgedCandidate& judged, const Certifier& certifier, const Decision& again,
                       const Tube& tube) {
  Drive& drive = drives_.at(judged.place);
  drive.is_compared = again.outcome == Outcome::kCertified;
  if (!drive.is_compared) return;
  const NominalModel& model = *certifier.problem().model;
  const Upheld upheld = UpheldUnder(certifier.problem(), {});
  const Angles angles = AnglesOf(model.angles(), model.num_states());
  for (const robot_state_t& state : drive.states) drive.left += IsLeft(state, tube, upheld, angles) ? 1 : 0;
}

void ShadowTally::Take(const JudgedCandidate& judged) {
  const auto found = drives_.find(judged.place);
  const Drive& drive = found->second;
  if (!drive.is_compared) ++summary_.not_compared;
  if (drive.is_compared) summary_.states += std::ssize(drive.states);
  summary_.states_left += drive.left;
  summary_.plans_left += drive.left > 0 ? 1 : 0;
  drives_.erase(found);
}

ShadowSummary ShadowTally::Finish() {
  EndPlan();
  CertifyAgain();
  return summary_;
}

}  // namespace forereach
