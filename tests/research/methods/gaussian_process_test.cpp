// Gaussian processes against one and two observations worked by hand, and the gradient against differences.
#include "research/methods/gaussian_process.h"

#include "tests/test.h"

#include "tests/research/methods/small_task.h"

namespace forereach::research::gaussian_process_test {

Eigen::VectorXd Scalar(double x) { return Eigen::VectorXd::Constant(1, x); }

TEST(GaussianProcess, OfOneObservation) {
  // k(0, 0) = 4, noise variance 1, y = 5: mean 4/5 * 5, variance 4 - 16/5.
  const GaussianProcess process(Eigen::MatrixXd::Zero(1, 1), Scalar(5), {Scalar(2), 2, 1});
  const auto [mean, deviation] = process.Predict(Scalar(0));
  EXPECT_NEAR(mean, 4, 1e-14);
  EXPECT_NEAR(deviation, std::sqrt(0.8), 1e-14);
  // One length-scale away the kernel is 4 exp(-1/2).
  const double k = 4 * std::exp(-0.5);
  const auto there = process.Predict(Scalar(2));
  EXPECT_NEAR(there.mean, k, 1e-14);
  EXPECT_NEAR(there.deviation, std::sqrt(4 - k * k / 5), 1e-14);
  // log N(5; 0, 5)
  EXPECT_NEAR(process.LogMarginalLikelihood(), -2.5 - std::log(5) / 2 - std::log(2 * std::numbers::pi) / 2, 1e-14);
}

TEST(GaussianProcess, FarFromTheDataIsThePrior) {
  const GaussianProcess process(Eigen::MatrixXd::Zero(1, 1), Scalar(5), {Scalar(1), 3, 0.1});
  const auto [mean, deviation] = process.Predict(Scalar(100));
  EXPECT_NEAR(mean, 0, 1e-14);
  EXPECT_NEAR(deviation, 3, 1e-14);
}

TEST(GaussianProcess, OfTwoObservations) {
  const Eigen::Vector2d x(0, 1), y(1, -2);
  const GaussianProcess process(x, y, {Scalar(1), 1, 0.5});
  const double c = std::exp(-0.5), a = 1.25, determinant = a * a - c * c, near = std::exp(-0.125);
  const auto [mean, deviation] = process.Predict(Scalar(0.5));
  EXPECT_NEAR(mean, near * ((a - c) * y[0] + (a - c) * y[1]) / determinant, 1e-14);
  EXPECT_NEAR(deviation, std::sqrt(1 - near * near * 2 * (a - c) / determinant), 1e-14);
}

TEST(GaussianProcess, GradientIsThatOfTheLikelihood) {
  TracedRandom random(3);
  const Eigen::MatrixXd x = random.Matrix(12, 2);
  const Eigen::VectorXd y = random.Vector(12);
  const Eigen::Vector4d at(0.3, -0.2, 0.1, -1);
  const auto process = [&](const Eigen::Vector4d& logarithms) {
    return GaussianProcess(x, y, {logarithms.head(2).array().exp(), std::exp(logarithms[2]), std::exp(logarithms[3])});
  };
  const Eigen::VectorXd gradient = process(at).LikelihoodGradient();
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector4d step = 1e-5 * Eigen::Vector4d::Unit(i);
    const double slope =
        (process(at + step).LogMarginalLikelihood() - process(at - step).LogMarginalLikelihood()) / 2e-5;
    EXPECT_NEAR(gradient[i], slope, 1e-6 * (1 + std::abs(slope))) << i;
  }
}

TEST(GaussianProcess, FitFindsALengthScaleAndPredictsBetweenTheData) {
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(30, -2, 2);
  const Eigen::VectorXd y = (3 * x.array()).sin();
  const GaussianProcess fit = FitGaussianProcess(x, y), first(x, y, {Scalar(1), 1, 0.1});
  EXPECT_GT(fit.LogMarginalLikelihood(), first.LogMarginalLikelihood() + 10);
  EXPECT_LT(fit.hyperparameters().length_scales[0], 1);
  EXPECT_NEAR(fit.Predict(Scalar(0.71)).mean, std::sin(3 * 0.71), 0.01);
}

TEST(GaussianProcessBand, ContainsAFunctionOnItsDataAndWidensWithK) {
  Task task = HandTask(0, 1);
  for (int i = -20; i <= 20; ++i) ObserveAt(task, 0, i * 0.1, std::sin(i * 0.1));
  const GaussianProcessBand two(task.setting(), 2, true), three(task.setting(), 3, true);
  for (const double vx : {-1.55, 0.05, 1.0}) {
    const ResidualBounds narrow = HandQuery(0, vx).Of(two), wide = HandQuery(0, vx).Of(three);
    EXPECT_LT(wide.lower[2], narrow.lower[2]);
    EXPECT_GT(wide.upper[2], narrow.upper[2]);
    EXPECT_LT(std::abs((narrow.lower[2] + narrow.upper[2]) / 2 - std::sin(vx)), 0.01);
    EXPECT_NEAR((wide.upper[2] - wide.lower[2]) / (narrow.upper[2] - narrow.lower[2]), 1.5, 1e-6);
    EXPECT_LE(narrow.lower[0], 0);
    EXPECT_GE(narrow.upper[0], 0);
  }
  // At the ends of a wide query the function is seen too.
  const ResidualBounds whole = HandQuery(0, 0, 0, 1.5).Of(two);
  EXPECT_LT(whole.lower[2], -0.98);
  EXPECT_GT(whole.upper[2], 0.98);
}

}  // namespace forereach::research::gaussian_process_test
