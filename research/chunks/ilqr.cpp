#include "research/chunks/ilqr.h"

#include <algorithm>
#include <array>
#include <vector>

#include <Eigen/Cholesky>

#include "planner_bridge/reference.h"

namespace forereach::research {
namespace {

constexpr int kIterations = 60;
constexpr double kEnough = 1e-9;        // of the cost, gained by an iteration
constexpr double kSmallestStep = 1e-4;  // of a Newton step

/** u = feedforward + gain (x - x_nominal). */
struct Law {
  Eigen::VectorXd feedforward;
  Eigen::MatrixXd gain;
};

struct Trajectory {
  Eigen::MatrixXd states, controls;
  double cost;
};

// The nominal model's Jacobian at z; what the linearization encloses, to its middle.
Eigen::MatrixXd JacobianAt(const NominalModel& model, const Eigen::VectorXd& state, const Eigen::VectorXd& control) {
  std::array<double, kMaxVariables> z;
  std::copy(control.begin(), control.end(), std::copy(state.begin(), state.end(), z.begin()));
  Linearization linearization;
  model.Linearize({z.data(), static_cast<std::size_t>(model.num_variables())}, linearization);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(model.num_states(), model.num_variables());
  for (const MatrixEntry& entry : linearization.jacobian())
    jacobian(entry.row, entry.column) = (entry.value.lower + entry.value.upper) / 2;
  return jacobian;
}

// The Newton step about a trajectory, from its end to its start.
std::vector<Law> StepBack(const NominalModel& model, const Trajectory& at, const Eigen::MatrixXd& reference,
                          const TrackingWeights& weights) {
  const Eigen::Index n = at.states.rows(), m = at.controls.rows(), steps = at.controls.cols();
  std::vector<Law> laws(static_cast<std::size_t>(steps));
  Eigen::MatrixXd value = weights.last_state.asDiagonal();
  Eigen::VectorXd slope = weights.last_state.cwiseProduct(at.states.col(steps) - reference.col(steps));
  for (Eigen::Index t = steps - 1; t >= 0; --t) {
    const Eigen::MatrixXd jacobian = JacobianAt(model, at.states.col(t), at.controls.col(t));
    Eigen::MatrixXd q = jacobian.transpose() * value * jacobian;
    q.diagonal().head(n) += weights.state;
    q.diagonal().tail(m) += weights.input;
    Eigen::VectorXd p = jacobian.transpose() * slope;
    p.head(n) += weights.state.cwiseProduct(at.states.col(t) - reference.col(t));
    p.tail(m) += weights.input.cwiseProduct(at.controls.col(t));
    const Eigen::LLT<Eigen::MatrixXd> of_controls(q.bottomRightCorner(m, m));
    Law& law = laws[static_cast<std::size_t>(t)];
    law.feedforward = -of_controls.solve(p.tail(m));
    law.gain = -of_controls.solve(q.bottomLeftCorner(m, n));
    slope = p.head(n) + q.topRightCorner(n, m) * law.feedforward;
    value = q.topLeftCorner(n, n) + q.topRightCorner(n, m) * law.gain;
    value = ((value + value.transpose()) / 2).eval();
  }
  return laws;
}

// A share of the step, in closed loop.
Trajectory Apply(const NominalModel& model, const Trajectory& at, const std::vector<Law>& laws, double share,
                 const Eigen::MatrixXd& reference, const TrackingWeights& weights, const Box& inputs) {
  Trajectory next = at;
  for (Eigen::Index t = 0; t < at.controls.cols(); ++t) {
    const Law& law = laws[static_cast<std::size_t>(t)];
    const Eigen::VectorXd change = share * law.feedforward + law.gain * (next.states.col(t) - at.states.col(t));
    next.controls.col(t) = (at.controls.col(t) + change).cwiseMax(inputs.lower()).cwiseMin(inputs.upper());
    next.states.col(t + 1) = Rollout(model, next.states.col(t), next.controls.col(t)).col(1);
  }
  next.cost = TrackingCost(next.states, next.controls, reference, weights);
  return next;
}

}  // namespace

double TrackingCost(const Eigen::MatrixXd& states, const Eigen::MatrixXd& controls, const Eigen::MatrixXd& reference,
                    const TrackingWeights& weights) {
  const Eigen::Index steps = controls.cols();
  const Eigen::MatrixXd squares = (states - reference).cwiseAbs2();
  return (weights.state.dot(squares.leftCols(steps).rowwise().sum()) +
          weights.input.dot(controls.cwiseAbs2().rowwise().sum()) + weights.last_state.dot(squares.col(steps))) /
         2;
}

Eigen::MatrixXd Track(const NominalModel& model, const Eigen::VectorXd& start, const Eigen::MatrixXd& reference,
                      const TrackingWeights& weights, const Box& inputs) {
  Trajectory best{{}, Eigen::MatrixXd::Zero(model.num_inputs(), reference.cols() - 1), 0};
  best.states = Rollout(model, start, best.controls);
  best.cost = TrackingCost(best.states, best.controls, reference, weights);
  for (int i = 0; i < kIterations; ++i) {
    const std::vector<Law> laws = StepBack(model, best, reference, weights);
    const double before = best.cost;
    for (double share = 1; share >= kSmallestStep && best.cost >= before; share /= 2)
      if (Trajectory next = Apply(model, best, laws, share, reference, weights, inputs); next.cost < before)
        best = std::move(next);
    if (!(best.cost < before * (1 - kEnough))) break;
  }
  return best.controls;
}

}  // namespace forereach::research
