#include "research/chunks/demonstrations.h"

#include <algorithm>
#include <cmath>

#include "forereach/numerics/parallel.h"

namespace forereach::research {
namespace {

enum : std::uint64_t { kForDemonstration = 0x64656d6f };

double Wheelbase() { return BicycleSystem().model->parameters()[1]; }
double Duration() { return kBlockSteps * BicycleSystem().model->parameters()[0]; }

Errand Off(Reference reference, const Eigen::VectorXd& most, Random& random) {
  Eigen::VectorXd state = reference.states.col(0);
  for (Eigen::Index k = 0; k < state.size(); ++k) state[k] += random.Uniform(-most[k], most[k]);
  return {state, std::move(reference)};
}

}  // namespace

Errand DrawErrand(Group group, Random& random) {
  Eigen::VectorXd start = Eigen::VectorXd::Zero(6);
  start[3] = random.Uniform(group == Group::kA ? 9 : 10, 15);
  const double lateral = random.Uniform(8, 13), side = group == Group::kB ? -1 : 1;
  if (group != Group::kA) start[5] = side * std::atan(lateral * Wheelbase() / (start[3] * start[3]));
  return Off(MakeReference(*BicycleSystem().model, start, kBlockSteps),
             Eigen::VectorXd{{0.2, 0.2, 0.05, 0.3, 0.2, 0.02}}, random);
}

Errand DrawCruise(Random& random) {
  Eigen::VectorXd start = Eigen::VectorXd::Zero(6);
  const double v = random.Uniform(0, kCruiseSpeed), least = std::max(-kCruiseAcceleration, -v / Duration());
  start[3] = v;
  start[4] = random.Uniform(least, std::min(kCruiseAcceleration, (kCruiseSpeed - v) / Duration()));
  const double steering = CruiseSteering(std::max(v, v + start[4] * Duration()), Wheelbase());
  start[5] = random.Uniform(-steering, steering);
  Errand errand = Off(MakeReference(*BicycleSystem().model, start, kBlockSteps),
                      Eigen::VectorXd{{0.1, 0.1, 0.02, 0.3, 0, 0}}, random);
  errand.state[4] = random.Uniform(-kCruiseAcceleration, kCruiseAcceleration);
  errand.state[5] = random.Uniform(-steering, steering);
  return errand;
}

const TrackingWeights& ExpertWeights() {
  static const TrackingWeights weights{Eigen::VectorXd{{1, 1, 10, 1, 0.5, 2}}, Eigen::VectorXd{{5, 5, 50, 5, 2, 10}},
                                       Eigen::VectorXd{{0.02, 0.5}}};
  return weights;
}

Eigen::MatrixXd Demonstrate(const Errand& errand) {
  static const Box inputs(Eigen::VectorXd{{-10, -1}}, Eigen::VectorXd{{10, 1}});
  return Track(*BicycleSystem().model, errand.state, errand.reference.states, ExpertWeights(), inputs);
}

Demonstrations MakeDemonstrations(int count, std::uint64_t seed, unsigned threads) {
  Demonstrations all{Eigen::MatrixXd(kFeatures, count), Eigen::MatrixXd(2 * kBlockSteps, count)};
  ForEachInParallel(static_cast<std::size_t>(count), threads, [&](std::size_t i, std::size_t) {
    Random random{kForDemonstration, seed, i};
    const Errand errand = i % 6 < 3 ? DrawErrand(kGroups[i % 6], random) : DrawCruise(random);
    const auto column = static_cast<Eigen::Index>(i);
    all.features.col(column) = Features(errand.state, errand.reference);
    all.blocks.col(column) = Demonstrate(errand).reshaped();
  });
  return all;
}

}  // namespace forereach::research
