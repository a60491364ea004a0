// Fits: what made the transitions is found again, and what they do not show is said.
#include "identify/fit.h"

#include "tests/test.h"

#include "forereach/dynamics/text_model.h"
#include "forereach/numerics/size.h"
#include "tests/identify/seed.h"

namespace forereach::fit_test {

// A pendulum with damping: rates, by Runge and Kutta.
ModelText Pendulum(double length, double damping, double unused = 1) {
  ModelText text;
  text.name = "pendulum";
  text.states = {{"angle", "rad"}, {"rate", "rad/s"}};
  text.inputs = {{"torque", "N m"}};
  text.parameters = {
      {"dt", 0.05, 0.05}, {"length", length, length}, {"damping", damping, damping}, {"unused", unused, unused}};
  text.equations = {{"rate", 1, 1}, {"torque - 9.81/length*sin(angle) - damping*rate + 0*unused", 2, 1}};
  text.integrator = ModelText::Integrator::kRk4;
  return text;
}

Transitions Drive(const ModelText& truth, unsigned seed, double noise) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto model = MakeTextModel(truth);
  Transitions data{Eigen::MatrixXd(300, 3), Eigen::MatrixXd(300, 2)};
  for (Eigen::Index i = 0; i < 300; ++i) {
    Eigen::Vector3d z(2 * uniform(random), 3 * uniform(random), uniform(random));
    Eigen::Vector2d next;
    model->Evaluate({z.data(), 3}, {next.data(), 2});
    data.z.row(i) = z;
    data.x_next.row(i) = next.transpose() + noise * Eigen::RowVector2d(uniform(random), uniform(random));
  }
  return data;
}

TEST(Fit, FindsTheParametersThatMadeTheTransitions) {
  const unsigned first = SeedOf(1);
  for (unsigned trial = 0; trial < 5; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(first + trial));
    const double length = 0.6 + 0.2 * trial, damping = 0.1 * trial;
    const Transitions data = Drive(Pendulum(length, damping), first + trial, 0);
    const Fit fit = FitParameters(Pendulum(1, 0), data, {"length", "damping"});
    EXPECT_TRUE(fit.converged);
    EXPECT_EQ(fit.parameters[0].before, 1);
    EXPECT_NEAR(fit.parameters[0].after, length, 1e-7);
    EXPECT_NEAR(fit.parameters[1].after, damping, 1e-7);
    EXPECT_LT(fit.after.cwiseAbs().maxCoeff(), 1e-8);
  }
}

TEST(Fit, WithNoiseIsWithinSomeStandardErrors) {
  const unsigned first = SeedOf(1);
  for (unsigned trial = 0; trial < 5; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(first + trial));
    const Transitions data = Drive(Pendulum(0.8, 0.3), first + trial, 0.01);
    const Fit fit = FitParameters(Pendulum(1, 0.1), data, {"length", "damping"});
    const double truth[] = {0.8, 0.3};
    for (std::size_t p = 0; p < 2; ++p) {
      EXPECT_GT(fit.parameters[p].deviation, 0);
      EXPECT_LT(std::abs(fit.parameters[p].after - truth[p]), 6 * fit.parameters[p].deviation);
    }
    EXPECT_LT(fit.after.squaredNorm(), fit.before.squaredNorm());
  }
}

TEST(Fit, KeepsTheOtherParametersAndNamesAnUndeterminedOne) {
  const Transitions data = Drive(Pendulum(0.8, 0.3), SeedOf(3), 0.01);
  const Fit one = FitParameters(Pendulum(0.8, 0), data, {"damping"});
  ASSERT_EQ(one.parameters.size(), 1u);
  EXPECT_NEAR(one.parameters[0].after, 0.3, 0.05);
  const Fit with = FitParameters(Pendulum(0.8, 0), data, {"damping", "unused"});
  EXPECT_EQ(with.parameters[1].deviation, kInfinity);
  EXPECT_EQ(with.parameters[1].after, 1);
  EXPECT_TRUE(with.parameters[1].together.empty()) << "it has no effect";
  EXPECT_NEAR(with.parameters[0].deviation, one.parameters[0].deviation, 0.01 * one.parameters[0].deviation);
}

// x+ = a b x + c u, y+ = y + d: of a and b only the product is determined, and e cancels.
ModelText Products() {
  ModelText text;
  text.name = "products";
  text.states = {{"x", "m"}, {"y", "m"}};
  text.inputs = {{"u", "m"}};
  text.parameters = {{"dt", 0.1, 0.1}, {"a", 0.9, 0.9}, {"c", 1, 1}, {"b", 1, 1}, {"d", 0, 0}, {"e", 2, 2}};
  text.equations = {{"a*b*x + c*u", 1, 1}, {"y + d + e - e", 2, 1}};
  text.integrator = ModelText::Integrator::kNone;
  return text;
}

TEST(Fit, NamesThoseThatAreUndeterminedTogether) {
  std::mt19937 random(SeedOf(5));
  std::uniform_real_distribution<double> uniform(-1, 1);
  Transitions data{Eigen::MatrixXd(200, 3), Eigen::MatrixXd(200, 2)};
  for (Eigen::Index i = 0; i < 200; ++i) {
    const double x = uniform(random), y = uniform(random), u = uniform(random), error = 0.01 * uniform(random);
    data.z.row(i) << x, y, u;
    data.x_next.row(i) << 0.5 * x + 0.3 * u + error, y + 0.2 + error;
  }
  const Fit fit = FitParameters(Products(), data, {"a", "c", "b", "d", "e"});
  EXPECT_NEAR(fit.parameters[0].after * fit.parameters[2].after, 0.5, 0.01);
  EXPECT_THAT(fit.parameters[0].together, testing::ElementsAre("b"));
  EXPECT_THAT(fit.parameters[2].together, testing::ElementsAre("a"));
  for (const std::size_t undetermined : {0, 2, 4}) EXPECT_EQ(fit.parameters[undetermined].deviation, kInfinity);
  for (const std::size_t determined : {1, 3}) {
    EXPECT_LT(fit.parameters[determined].deviation, 0.01);
    EXPECT_GT(fit.parameters[determined].deviation, 1e-5);
    EXPECT_TRUE(fit.parameters[determined].together.empty());
  }
}

// Positions of a map's grid are millions of metres.
TEST(Fit, LargeValuesLeaveAParameterDetermined) {
  ModelText text = Products();
  text.equations[0] = {"x + dt*u*(1 + d)", 1, 1};
  Transitions data{Eigen::MatrixXd(200, 3), Eigen::MatrixXd(200, 2)};
  for (Eigen::Index i = 0; i < 200; ++i) {
    const double x = 5e6 + static_cast<double>(i), u = 1 + 0.01 * static_cast<double>(i);
    data.z.row(i) << x, 0, u;
    data.x_next.row(i) << x + 0.1 * u * 1.002, 0;
  }
  text.equations[1] = {"y", 2, 1};
  const Fit fit = FitParameters(text, data, {"d"});
  EXPECT_NEAR(fit.parameters[0].after, 0.002, 1e-6);
  EXPECT_LT(fit.parameters[0].deviation, 1e-6);
}

// Below its solution the model has no value, so its derivative there is from one side.
TEST(Fit, AtTheEdgeOfTheModelsDomainItTakesOneSide) {
  ModelText text = Products();
  text.parameters[4] = {"d", 0, 0};
  text.equations = {{"x + u*d + 0*sqrt(d)", 1, 1}, {"y", 2, 1}};
  std::mt19937 random(SeedOf(7));
  std::uniform_real_distribution<double> uniform(-1, 1);
  Transitions data{Eigen::MatrixXd(100, 3), Eigen::MatrixXd(100, 2)};
  for (Eigen::Index i = 0; i < 100; ++i) {
    const double x = uniform(random), u = uniform(random);
    data.z.row(i) << x, 0, u;
    data.x_next.row(i) << x - 0.05 * u + (i % 2 == 0 ? 0.1 : -0.1), 0;
  }
  const Fit fit = FitParameters(text, data, {"d"});
  EXPECT_EQ(fit.parameters[0].after, 0);
  EXPECT_NEAR(fit.parameters[0].deviation, 0.0175, 0.005) << "0.1 / (10 * 0.577)";
}

// The model has x exactly, up to rounding. That weighs nothing, and d is found from y.
TEST(Fit, TheRoundingOfAnExactStateWeighsNothing) {
  std::mt19937 random(SeedOf(6));
  std::uniform_real_distribution<double> uniform(-1, 1);
  ModelText text = Products();
  text.equations[0] = {"x + 0.1*u/3 + d*1e-16*u", 1, 1};
  Transitions data{Eigen::MatrixXd(200, 3), Eigen::MatrixXd(200, 2)};
  for (Eigen::Index i = 0; i < 200; ++i) {
    const double x = uniform(random), y = uniform(random), u = uniform(random);
    data.z.row(i) << x, y, u;
    data.x_next.row(i) << x + 0.1 / 3 * u, y + 0.2 + 0.01 * uniform(random);
  }
  const Fit fit = FitParameters(text, data, {"d"});
  EXPECT_TRUE(fit.converged);
  EXPECT_NEAR(fit.parameters[0].after, 0.2, 0.01);
  EXPECT_LT(fit.parameters[0].deviation, 0.01);
}

TEST(Fit, RefusesWhatItCannotFit) {
  const Transitions data = Drive(Pendulum(0.8, 0.3), SeedOf(3), 0);
  for (const auto& names : std::vector<std::vector<std::string>>{{}, {"dt"}, {"mass"}, {"length", "length"}})
    EXPECT_THROW((void)FitParameters(Pendulum(1, 0), data, names), std::invalid_argument);
  EXPECT_THROW((void)FitParameters(Pendulum(0, 0), data, {"length"}), std::invalid_argument) << "a division by zero";
  const Transitions none{Eigen::MatrixXd(0, 3), Eigen::MatrixXd(0, 2)};
  EXPECT_THROW((void)FitParameters(Pendulum(1, 0), none, {"length"}), std::invalid_argument);
}

}  // namespace forereach::fit_test
