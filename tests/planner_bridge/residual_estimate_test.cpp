#include "planner_bridge/residual_estimate.h"

#include "tests/test.h"

#include "tests/planner_bridge/tasks.h"

namespace forereach::residual_estimate_test {

// The bicycle's task with transitions at the given speeds, whose heading residual is `residual` of the speed.
template <class Residual>
std::shared_ptr<const Problem> WithResidual(const std::vector<double>& speeds, Residual residual) {
  auto problem = std::make_shared<Problem>(*Bicycle().problem);
  problem->transitions.z = Eigen::MatrixXd::Zero(std::ssize(speeds), 8);
  problem->transitions.x_next = Eigen::MatrixXd::Zero(std::ssize(speeds), 6);
  for (int i = 0; i < std::ssize(speeds); ++i) {
    std::array<double, 8> z{};
    std::array<double, 6> next;
    z[3] = speeds[static_cast<std::size_t>(i)];
    problem->model->Evaluate(z, next);
    next[2] += residual(z[3]);
    for (int l = 0; l < 8; ++l) problem->transitions.z(i, l) = z[static_cast<std::size_t>(l)];
    for (int k = 0; k < 6; ++k) problem->transitions.x_next(i, k) = next[static_cast<std::size_t>(k)];
  }
  return problem;
}

double PredictedHeading(const ResidualEstimate& estimate, double speed) {
  std::array<double, 8> z{};
  std::array<double, 6> next;
  z[3] = speed;
  estimate.Predict(z, next);
  EXPECT_NEAR(next[0], 0.1 * speed, 1e-12);
  return next[2];
}

TEST(ResidualEstimate, AtAnObservationItIsWhatWasObserved) {
  const ResidualEstimate estimate(WithResidual({1, 2, 3, 4, 5, 6}, [](double v) { return 0.01 * v; }));
  for (const double v : {1.0, 3.0, 6.0}) EXPECT_NEAR(PredictedHeading(estimate, v), 0.01 * v, 1e-12);
}

TEST(ResidualEstimate, InterpolatesBetweenObservations) {
  const ResidualEstimate estimate(WithResidual({1, 2, 3, 4, 5, 6}, [](double v) { return 0.01 * v; }));
  EXPECT_NEAR(PredictedHeading(estimate, 3.5), 0.035, 1e-12);
  EXPECT_GT(PredictedHeading(estimate, 3.8), PredictedHeading(estimate, 3.5));
}

TEST(ResidualEstimate, PredictsFromASingleObservation) {
  const ResidualEstimate estimate(WithResidual({2}, [](double) { return 0.25; }));
  EXPECT_NEAR(PredictedHeading(estimate, 9), 0.25, 1e-12);
}

TEST(ResidualEstimate, OfAnAffineRowItIsTheFunctionThatFits) {
  auto problem = std::make_shared<Problem>(*WithResidual({1, 2, 3}, [](double v) { return 0.2 + 0.01 * v; }));
  problem->declaration.lipschitz.row(2).setZero();
  problem->declaration.affine = {{2}, {3, 5}};
  EXPECT_NEAR(PredictedHeading(ResidualEstimate(problem), 9), 0.29, 1e-12);
}

TEST(ResidualEstimate, AConstantCoordinateTakesTheMean) {
  auto problem = std::make_shared<Problem>(*WithResidual({1, 2}, [](double) { return 0.0; }));
  problem->transitions.x_next(0, 4) += 0.1;
  problem->transitions.x_next(1, 4) += 0.3;
  std::array<double, 8> z{};
  std::array<double, 6> next;
  ResidualEstimate(problem).Predict(z, next);
  EXPECT_NEAR(next[4], 0.2, 1e-12);
}

}  // namespace forereach::residual_estimate_test
