#include "planner_bridge/policy_proposer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "forereach/numerics/size.h"
#include "planner_bridge/reference.h"

namespace forereach {
namespace {

constexpr Eigen::Index kTheta = 2, kV = 3, kA = 4, kDelta = 5;

const std::vector<std::string> kCarStates{"x", "y", "theta", "v", "a", "delta"};

// 0 without such a parameter.
double WheelbaseOf(const NominalModel& model) {
  const auto found = std::ranges::find(model.parameter_names(), "wheelbase");
  return found == model.parameter_names().end() ? 0
                                                : model.parameters()[ToSize(found - model.parameter_names().begin())];
}

void Require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument("planner.policy: " + what);
}

Policy Fitting(const Problem& problem, const PlannerOptions& options, Policy policy) {
  RequireGoalAndSteps(problem, options);
  const std::string model = problem.model->description();
  Require(policy.model == model, "is for the model " + policy.model + ", the task's is " + model);
  Require(problem.model->state_names() == kCarStates && WheelbaseOf(*problem.model) > 0,
          "there are policies for cars only: states x, y, theta, v, a, delta, and a parameter wheelbase");
  Require(problem.projection == Eigen::MatrixXd::Identity(2, problem.model->num_states()),
          "a policy goes to a point (x, y), task.projection has to be [x, y]");
  Require(policy.num_features() == kFeatures,
          fmt::format("has {} features, has to have {}", policy.num_features(), kFeatures));
  Require(policy.num_inputs == problem.model->num_inputs(), fmt::format("has {} inputs", policy.num_inputs));
  Require(options.progress_steps <= policy.num_steps(),
          fmt::format("its blocks have {} steps, planner.progress_steps is {}", policy.num_steps(),
                      options.progress_steps));
  return policy;
}

}  // namespace

PolicyProposer::PolicyProposer(const Config& config, Policy policy)
    : problem_(config.problem),
      limits_(*problem_->model, problem_->limits),
      options_(config.planner),
      policy_(Fitting(*problem_, options_, std::move(policy))),
      motion_(config, Braking::kPlanned),
      wheelbase_(WheelbaseOf(*problem_->model)),
      duration_(policy_.num_steps() * motion_.dt()) {}

// The angle of the arc from the robot's pose through the goal; then the fan.
double PolicyProposer::Steering(const Eigen::VectorXd& state, double most, int attempt) const {
  const Eigen::Vector2d to_goal = Eigen::Map<const Eigen::Vector2d>(options_.goal.data()) - state.head<2>();
  const double bearing = std::atan2(to_goal.y(), to_goal.x()) - state[kTheta];
  const double arc = std::atan(wheelbase_ * 2 * std::sin(bearing) / std::max(to_goal.norm(), 1e-3));
  const double direct = std::cos(bearing) < 0 ? std::copysign(most, std::sin(bearing)) : std::clamp(arc, -most, most);
  if (attempt == 0) return direct;
  std::array<double, kFan> fan;
  for (std::size_t i = 0; i < kFan; ++i) fan[i] = most * (2.0 * static_cast<double>(i) / (kFan - 1) - 1);
  std::ranges::stable_sort(fan, {}, [&](double angle) { return std::abs(angle - direct); });
  return fan[static_cast<std::size_t>(attempt - 1)];
}

Eigen::VectorXd PolicyProposer::ReferenceStart(const Eigen::VectorXd& state, int attempt) const {
  Eigen::VectorXd start = state;
  start[kV] = std::clamp(state[kV], 0.0, kCruiseSpeed);
  const double end = std::min(options_.cruise_speed, kCruiseSpeed);
  start[kA] = std::clamp((end - start[kV]) / duration_, -kCruiseAcceleration, kCruiseAcceleration);
  const double fastest = std::max(start[kV], start[kV] + start[kA] * duration_);
  start[kDelta] = Steering(state, CruiseSteering(fastest, wheelbase_), attempt);
  return start;
}

std::optional<Proposal> PolicyProposer::Propose(const PlanRequest& request) {
  const NominalModel& model = *problem_->model;
  if (request.state.size() != model.num_states() || !request.state.allFinite() || request.attempt > kFan)
    return std::nullopt;
  const Reference reference = MakeReference(model, ReferenceStart(request.state, request.attempt), policy_.num_steps());
  Eigen::MatrixXd progress = policy_.Act(Features(request.state, reference)).leftCols(options_.progress_steps);
  if (!progress.allFinite()) return std::nullopt;  // weights are finite, their sums need not be
  const Box& inputs = problem_->domain.input;
  for (auto column : progress.colwise()) column = column.cwiseMax(inputs.lower()).cwiseMin(inputs.upper());

  const Eigen::VectorXd end = Rollout(model, request.state, progress).rightCols<1>();
  Eigen::MatrixXd tail;
  if (!motion_.Brake({end.data(), static_cast<std::size_t>(end.size())}, 0, options_.tail_steps, tail))
    return std::nullopt;
  Proposal proposal{Eigen::MatrixXd(progress.rows(), progress.cols() + tail.cols()), options_.progress_steps, {}};
  proposal.controls << progress, tail;
  proposal.states = Rollout(model, request.state, proposal.controls);
  if (!proposal.states.allFinite() || !KeepsAllLimits(proposal)) return std::nullopt;
  return proposal;
}

bool PolicyProposer::KeepsAllLimits(const Proposal& proposal) const {
  const std::vector<double> no_margin(limits_.size(), 0.0);
  for (Eigen::Index t = 0; t < proposal.states.cols(); ++t) {
    const auto x = proposal.states.col(t);
    std::span<const double> u;
    if (t < proposal.controls.cols())
      u = {proposal.controls.col(t).data(), static_cast<std::size_t>(proposal.controls.rows())};
    if (!limits_.Keep({x.data(), static_cast<std::size_t>(x.size())}, u, no_margin)) return false;
  }
  return true;
}

}  // namespace forereach
