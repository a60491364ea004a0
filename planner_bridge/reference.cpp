#include "planner_bridge/reference.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

namespace forereach {
namespace {

Eigen::VectorXd SeenFrom(const Eigen::VectorXd& frame, const Eigen::VectorXd& state) {
  Eigen::VectorXd seen = state;
  seen.head<2>() = Eigen::Rotation2Dd(-frame[2]) * (state.head<2>() - frame.head<2>());
  seen[2] -= frame[2];
  return seen;
}

}  // namespace

Reference MakeReference(const NominalModel& bicycle, const Eigen::VectorXd& start, int steps) {
  return {Rollout(bicycle, start, Eigen::MatrixXd::Zero(bicycle.num_inputs(), steps))};
}

double CruiseSteering(double speed, double wheelbase) {
  return std::min(kCruiseSteering, std::atan2(kCruiseLateral * wheelbase, speed * speed));
}

Eigen::VectorXd Features(const Eigen::VectorXd& state, const Reference& reference) {
  const Eigen::VectorXd frame = reference.states.col(0), end = reference.states.rightCols<1>();
  Eigen::VectorXd features(kFeatures);
  features << SeenFrom(frame, state), SeenFrom(frame, end);
  return features;
}

Eigen::MatrixXd Rollout(const NominalModel& model, const Eigen::VectorXd& start, const Eigen::MatrixXd& controls) {
  const auto n = static_cast<std::size_t>(model.num_states()), m = static_cast<std::size_t>(model.num_inputs());
  Eigen::MatrixXd states(start.size(), controls.cols() + 1);
  states.col(0) = start;
  std::array<double, kMaxVariables> z;
  for (Eigen::Index t = 0; t < controls.cols(); ++t) {
    std::copy_n(controls.col(t).data(), m, std::copy_n(states.col(t).data(), n, z.begin()));
    model.Evaluate({z.data(), n + m}, {states.col(t + 1).data(), n});
  }
  return states;
}

}  // namespace forereach
