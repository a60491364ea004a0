#include "planner_bridge/policy_proposer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "forereach/numerics/size.h"
#include "planner_bridge/reference.h"

namespace forereach {
namespace {

constexpr double kSlowest = 0.3;  // of the cruise speed, that a sample may aim at
constexpr Eigen::Index kTheta = 2, kV = 3, kA = 4, kDelta = 5;

const std::vector<std::string> kCarStates{"x", "y", "theta", "v", "a", "delta"};

// 0 without such a parameter.
double WheelbaseOf(const NominalModel& model) {
  const auto found = std::ranges::find(model.parameter_names(), "wheelbase");
  return found == model.parameter_names().end() ? 0
                                                : model.parameters()[ToSize(found - model.parameter_names().begin())];
}

void Require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument(fmt::format("planner.policy: {}", what));
}

Policy Fitting(const Problem& problem, const PlannerOptions& options, Policy policy) {
  RequireGoalAndSteps(problem, options);
  const std::string model = problem.model->description();
  Require(policy.model == model, fmt::format("is for the model {}, the task's is {}", policy.model, model));
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

// The acceleration that leads from one speed to another in a block, as far as references accelerate.
double PolicyProposer::Acceleration(const Eigen::VectorXd& state, double speed) const {
  const double begin = std::clamp(state[kV], 0.0, kCruiseSpeed), end = std::min(speed, kCruiseSpeed);
  return std::clamp((end - begin) / duration_, -kCruiseAcceleration, kCruiseAcceleration);
}

double PolicyProposer::MostSteering(const Eigen::VectorXd& state, double speed) const {
  const double begin = std::clamp(state[kV], 0.0, kCruiseSpeed);
  return CruiseSteering(std::max(begin, begin + Acceleration(state, speed) * duration_), wheelbase_);
}

PolicyProposer::Aim PolicyProposer::AimOf(const Eigen::VectorXd& state, int attempt) const {
  const double speed = options_.cruise_speed;
  return {Steering(state, MostSteering(state, speed), attempt), speed};
}

Eigen::VectorXd PolicyProposer::ReferenceStart(const Eigen::VectorXd& state, const Aim& aim) const {
  Eigen::VectorXd start = state;
  start[kV] = std::clamp(state[kV], 0.0, kCruiseSpeed);
  start[kA] = Acceleration(state, aim.speed);
  start[kDelta] = aim.steering;
  return start;
}

bool PolicyProposer::CanServe(const PlanRequest& request) const {
  return request.state.size() == problem_->model->num_states() && request.state.allFinite();
}

std::optional<Proposal> PolicyProposer::Propose(const PlanRequest& request) {
  if (!CanServe(request) || request.attempt > kFan) return std::nullopt;
  const auto progress = Progress(request.state, AimOf(request.state, request.attempt));
  return progress ? WithTail(request.state, *progress, 0) : std::nullopt;
}

std::vector<Proposal> PolicyProposer::ProposeMany(const PlanRequest& request) {
  if (options_.policy_samples == 1) return Proposer::ProposeMany(request);
  if (!CanServe(request)) return {};
  const int tails = motion_.num_tails(), samples = options_.policy_samples;
  // Each block with each way to brake, and at least as many blocks as there are aims.
  const int blocks = std::max((samples + tails - 1) / tails, std::min(samples, 1 + kFan));
  std::mt19937_64 random(request.seed);
  const auto draw = [&](double least, double most) {
    return least + (most - least) * (static_cast<double>(random() >> 11) * 0x1p-53);  // the same with every library
  };
  std::vector<std::optional<Eigen::MatrixXd>> progress;
  for (int i = 0; i < blocks; ++i) {
    if (i <= kFan && request.attempt == 0) {
      progress.push_back(Progress(request.state, AimOf(request.state, i)));
      continue;
    }
    const double speed = draw(kSlowest, 1) * options_.cruise_speed, most = MostSteering(request.state, speed);
    progress.push_back(Progress(request.state, {draw(-most, most), speed}));
  }
  std::vector<Proposal> all;
  for (int i = 0; i < samples; ++i) {
    const auto& block = progress[static_cast<std::size_t>(i % blocks)];
    if (auto proposal = block ? WithTail(request.state, *block, i / blocks) : std::nullopt)
      all.push_back(*std::move(proposal));
  }
  return all;
}

std::optional<Eigen::MatrixXd> PolicyProposer::Progress(const Eigen::VectorXd& state, const Aim& aim) const {
  const Reference reference = MakeReference(*problem_->model, ReferenceStart(state, aim), policy_.num_steps());
  Eigen::MatrixXd progress = policy_.Act(Features(state, reference)).leftCols(options_.progress_steps);
  if (!progress.allFinite()) return std::nullopt;  // weights are finite, their sums need not be
  const Box& inputs = motion_.controls();
  for (auto column : progress.colwise()) column = column.cwiseMax(inputs.lower()).cwiseMin(inputs.upper());
  return progress;
}

std::optional<Proposal> PolicyProposer::WithTail(const Eigen::VectorXd& state, const Eigen::MatrixXd& progress,
                                                 int way) const {
  const NominalModel& model = *problem_->model;
  const Eigen::VectorXd end = Rollout(model, state, progress).rightCols<1>();
  Eigen::MatrixXd tail;
  if (!motion_.Brake({end.data(), static_cast<std::size_t>(end.size())}, way, options_.tail_steps, tail))
    return std::nullopt;
  Proposal proposal{Eigen::MatrixXd(progress.rows(), progress.cols() + tail.cols()), options_.progress_steps, {}};
  proposal.controls << progress, tail;
  proposal.states = Rollout(model, state, proposal.controls);
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
