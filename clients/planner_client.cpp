#include "clients/planner_client.h"

#include <algorithm>
#include <deque>
#include <stdexcept>
#include <utility>

#include <fmt/core.h>

#include "certifier/gate/candidate_message.h"
#include "certifier/gate/stamp.h"
#include "clients/opened_bus.h"
#include "clients/planner_messages.h"
#include "forereach/numerics/limits.h"

namespace forereach {
namespace {

template <class Message>
void Keep(std::deque<Message>& waiting, const Message& message) {
  waiting.push_back(message);
  // For a caller who never asks for them.
  if (waiting.size() > PlannerClient::kMostWaiting) waiting.pop_front();
}

void RequireThat(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument(what);
}

void RequireStart(const CandidateStart& start, int num_states) {
  RequireThat(start.center.size() == num_states && start.half_width.size() == num_states,
              fmt::format("initial set: {} and {} entries, the model has {} states", start.center.size(),
                          start.half_width.size(), num_states));
  RequireThat(start.center.allFinite() && start.half_width.allFinite() && (start.half_width.array() >= 0).all(),
              "initial set: its numbers must be finite, and its half-widths not negative");
}

void RequireControls(const Eigen::MatrixXd& controls, int num_inputs, std::optional<int> progress) {
  RequireThat(controls.rows() == num_inputs,
              fmt::format("plan: {} inputs, the model has {}", controls.rows(), num_inputs));
  RequireThat(controls.cols() >= 1 && controls.cols() <= kMaxSteps,
              fmt::format("plan: {} steps, must be 1 to {}", controls.cols(), kMaxSteps));
  RequireThat(controls.allFinite(), "plan: a control is not a number that is finite, must be finite");
  RequireThat(!progress || (*progress >= 0 && *progress <= controls.cols()),
              fmt::format("progress_steps: {}, must be 0 to the steps of the plan", progress.value_or(0)));
}

}  // namespace

struct PlannerClient::Core {
  Core(OpenedBus open, const std::string& source)
      : opened(std::move(open)),
        messages(opened.config(), opened.bus(), source,
                 {[this](const robot_state_t& message, std::int64_t) { state = message; },
                  [this](const decision_t& message, std::int64_t) { Keep(decisions, message); },
                  [this](const withdrawal_t& message, std::int64_t) { Keep(withdrawals, message); },
                  [this](const advice_t& message, std::int64_t) { Hear(message); }}) {
    RequireThat(!source.empty() && source.size() < sizeof(candidate_plan_t::source),
                "source: must be a name of 1 to 31 characters");
  }

  void Hear(const advice_t& message) {
    const candidate_plan_t& plan = message.proposal;
    // ControlsOf reads the plan by its own sizes, so they are looked at first.
    const bool has_plan = HasSizes(plan, *opened.config().problem->model) && plan.progress_steps >= 0 &&
                          plan.progress_steps <= plan.num_steps;
    if (message.changed == 0)
      Keep(advice, message);
    else if (has_plan)
      Keep(repairs, message);
  }

  template <class Messages>
  Messages Taken(Messages& waiting, double timeout_s, const std::function<bool()>& done) {
    RequireThat(timeout_s >= 0, "timeout: must be a number of seconds that is not negative");
    opened.Listen(WallClockUs() + static_cast<std::int64_t>(std::min(timeout_s, 1e9) * 1e6), done);
    return std::exchange(waiting, {});
  }
  template <class Message>
  std::vector<Message> All(std::deque<Message>& waiting, double timeout_s) {
    const auto taken = Taken(waiting, timeout_s, [&] { return !waiting.empty(); });
    return {taken.begin(), taken.end()};
  }

  const OpenedBus opened;
  std::deque<decision_t> decisions;
  std::deque<withdrawal_t> withdrawals;
  std::deque<advice_t> advice, repairs;
  std::optional<robot_state_t> state;
  // The last: its handlers write what stands above.
  PlannerMessages messages;
};

PlannerClient::PlannerClient(const ClientOptions& options, const std::string& source)
    : core_(std::make_unique<Core>(OpenedBus(options, Role::kPlanner), source)) {}

PlannerClient::PlannerClient(const Config& task, const ClientOptions& instead, const std::string& source,
                             const std::function<void(const std::function<void()>&)>& around)
    : core_(std::make_unique<Core>(OpenedBus(task, Role::kPlanner, instead, around), source)) {}

PlannerClient::~PlannerClient() = default;

const Problem& PlannerClient::problem() const { return *core_->opened.config().problem; }
const std::vector<Obstacle>& PlannerClient::obstacles() const { return core_->opened.config().obstacles; }
std::int64_t PlannerClient::step_us() const { return Microseconds(core_->opened.config().robot.step_period_ms); }
bool PlannerClient::is_signed() const { return core_->opened.config().bus.keys.has_value(); }

std::int64_t PlannerClient::Propose(const Eigen::MatrixXd& controls, const CandidateStart& start,
                                    const CandidateRequest& request) {
  return ProposeMany({&controls, 1}, start, request).front();
}

std::vector<std::int64_t> PlannerClient::ProposeMany(std::span<const Eigen::MatrixXd> controls,
                                                     const CandidateStart& start, const CandidateRequest& request) {
  static_cast<void>(core_->opened.bus());  // of this thread
  const NominalModel& model = *problem().model;
  RequireStart(start, model.num_states());
  std::vector<PlannerMessages::Controls> plans;
  std::size_t numbers = 0;
  for (const Eigen::MatrixXd& plan : controls) {
    RequireControls(plan, model.num_inputs(), request.progress_steps);
    plans.push_back({plan, request.progress_steps.value_or(static_cast<int>(plan.cols()))});
    numbers += static_cast<std::size_t>(plan.size());
  }
  RequireThat(!plans.empty(), "Us: has no plan");
  // Send would leave out what has no room; whoever calls this wants all of them sent.
  RequireThat(plans.size() == 1 || (plans.size() <= kMaxBatch && numbers <= kMaxBatchNumbers),
              fmt::format("Us: at most {} plans and {} numbers fit into one message", kMaxBatch, kMaxBatchNumbers));
  const auto sent = core_->messages.Send(start, plans, request.repair, WallClockUs());
  if (sent.size() < plans.size()) throw std::runtime_error("the bus does not take the candidates");
  std::vector<std::int64_t> plan_ids;
  for (const candidate_plan_t& candidate : sent) plan_ids.push_back(candidate.plan_id);
  return plan_ids;
}

std::vector<decision_t> PlannerClient::Decisions(double timeout_s) { return core_->All(core_->decisions, timeout_s); }
std::vector<withdrawal_t> PlannerClient::Withdrawals(double timeout_s) {
  return core_->All(core_->withdrawals, timeout_s);
}
std::vector<advice_t> PlannerClient::Advice(double timeout_s) { return core_->All(core_->advice, timeout_s); }
std::vector<advice_t> PlannerClient::Repairs(double timeout_s) { return core_->All(core_->repairs, timeout_s); }
std::optional<robot_state_t> PlannerClient::RobotState(double timeout_s) {
  return core_->Taken(core_->state, timeout_s, [this] { return core_->state.has_value(); });
}

Eigen::MatrixXd ControlsOf(const candidate_plan_t& plan) {
  return Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>(plan.control[0], plan.num_inputs, plan.num_steps,
                                                                    Eigen::OuterStride<>(kMaxInputs));
}

}  // namespace forereach
