// Fits: what made the transitions is found again, and what they do not show is said.
#include "identify/fit.h"

#include "tests/test.h"

#include "forereach/dynamics/text_model.h"
#include "forereach/numerics/size.h"
#include "tests/identify/seed.h"

namespace forereach::fit_test {

// A pendulum with damping: rates, by Runge and Kutta.
ModelText Pendulum(double length, double damping, double unused = 1) {
  return {.name = "pendulum",
          .states = {{"angle", "rad"}, {"rate", "rad/s"}},
          .inputs = {{"torque", "N m"}},
          .parameters = {{"dt", 0.05, 0.05},
                         {"length", length, length},
                         {"damping", damping, damping},
                         {"unused", unused, unused}},
          .equations = {{"rate", 1, 1}, {"torque - 9.81/length*sin(angle) - damping*rate + 0*unused", 2, 1}},
          .integrator = ModelText::Integrator::kRk4};
}

Transitions Drive(const ModelText& truth, unsigned seed, double noise, Eigen::Index count = 300) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto model = MakeTextModel(truth);
  Transitions data{Eigen::MatrixXd(count, 3), Eigen::MatrixXd(count, 2)};
  for (Eigen::Index i = 0; i < count; ++i) {
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
  EXPECT_NEAR(Only(one.parameters).after, 0.3, 0.05);
  const Fit with = FitParameters(Pendulum(0.8, 0), data, {"damping", "unused"});
  EXPECT_FIELDS(with.parameters[1], (deviation, kInfinity), (after, 1));
  EXPECT_TRUE(with.parameters[1].together.empty()) << "it has no effect";
  EXPECT_NEAR(with.parameters[0].deviation, one.parameters[0].deviation, 0.01 * one.parameters[0].deviation);
}

// x+ = a b x + c u, y+ = y + d: of a and b only the product is determined, and e cancels.
ModelText Products() {
  return {.name = "products",
          .states = {{"x", "m"}, {"y", "m"}},
          .inputs = {{"u", "m"}},
          .parameters = {{"dt", 0.1, 0.1}, {"a", 0.9, 0.9}, {"c", 1, 1}, {"b", 1, 1}, {"d", 0, 0}, {"e", 2, 2}},
          .equations = {{"a*b*x + c*u", 1, 1}, {"y + d + e - e", 2, 1}},
          .integrator = ModelText::Integrator::kNone};
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
  EXPECT_THAT(fit.parameters[0].together, ElementsAre("b"));
  EXPECT_THAT(fit.parameters[2].together, ElementsAre("a"));
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

// p+ = p, v+ = v + 0.1 gain a, from rest: four errors of 0.003 in v, and `place` is the error of p.
Transitions FourSteps(double place) {
  Transitions data{Eigen::MatrixXd::Zero(4, 3), Eigen::MatrixXd(4, 2)};
  data.z.col(2) << 1, 1, -1, -1;
  data.x_next << place, 0.093, -place, 0.087, place, -0.087, -place, -0.093;
  return data;
}

// p+ = p + 0.1 v, v+ = v + 0.1 (gain a + what is given).
ModelText Cart(const std::string& rate, double gain, double k) {
  return {.name = "cart",
          .states = {{"p", "m"}, {"v", "m/s"}},
          .inputs = {{"a", "m/s^2"}},
          .parameters = {{"dt", 0.1, 0.1}, {"gain", gain, gain}, {"k", k, k}},
          .equations = {{"p + dt*v", 1, 1}, {"v + dt*(gain*a" + rate + ")", 2, 1}},
          .integrator = ModelText::Integrator::kNone};
}

TEST(FitDeviation, IsOfTheStateThatShowsTheParameter) {
  for (const double place : {0.0, 1e-9, 0.003, 0.01, 100.0}) {
    const Fit fit = FitParameters(Cart("", 1, 0), FourSteps(place), {"gain"});
    EXPECT_NEAR(fit.parameters[0].deviation, std::sqrt(4 * 0.003 * 0.003 / 3) / 0.2, 1e-7) << place;
  }
}

TEST(FitDeviation, IsNoneWhenNoNumberIsLeftOver) {
  Transitions data{Eigen::MatrixXd(2, 3), Eigen::MatrixXd(2, 2)};
  data.z << 0, 1, 1, 0, 1.1, 0.9;
  data.x_next << 0.1, 1.13, 0.11, 1.15;
  const ModelText text = Cart(" - k*v", 1, 0.1);
  for (const FittedParameter& each : FitParameters(text, data, {"gain", "k"}).parameters)
    EXPECT_TRUE(std::isnan(each.deviation)) << each.name;
  const Fit one = FitParameters(text, data, {"gain"});
  EXPECT_TRUE(std::isfinite(one.parameters[0].deviation)) << "one number is left over";
  data.z.conservativeResize(3, 3);
  data.x_next.conservativeResize(3, 2);
  data.z.row(2) << 0, -1, 0.5;
  data.x_next.row(2) << -0.1, -0.93;
  for (const FittedParameter& each : FitParameters(text, data, {"gain", "k"}).parameters)
    EXPECT_TRUE(std::isfinite(each.deviation)) << each.name;
}

// x+ = a x + c u with noise 0.01, y+ = d y + c u with noise 1: a parameter of each state, and one of both. The errors
// of x at the start are 50 times its noise.
TEST(FitDeviation, IsTheSpreadOverManySetsOfData) {
  constexpr int kSets = 500, kRows = 40;
  const unsigned seed = SeedOf(11);
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  ModelText text = Products();
  text.equations = {{"a*x + c*u", 1, 1}, {"d*y + c*u", 2, 1}};
  Transitions data{Eigen::MatrixXd(kRows, 3), Eigen::MatrixXd(kRows, 2)};
  for (double& value : data.z.reshaped()) value = normal(random);
  const Eigen::Array3d truth(0.4, 1, 0);
  Eigen::Array3d squares = Eigen::Array3d::Zero(), variances = Eigen::Array3d::Zero();
  for (int set = 0; set < kSets; ++set) {
    for (Eigen::Index i = 0; i < kRows; ++i)
      data.x_next.row(i) << 0.4 * data.z(i, 0) + data.z(i, 2) + 0.01 * normal(random), data.z(i, 2) + normal(random);
    const Fit fit = FitParameters(text, data, {"a", "c", "d"});
    for (int p = 0; p < 3; ++p) {
      const FittedParameter& found = fit.parameters[ToSize(p)];
      squares[p] += std::pow(found.after - truth[p], 2);
      variances[p] += std::pow(found.deviation, 2);
    }
  }
  // The sum of kSets squares has the relative deviation sqrt(2 / kSets).
  const double enough = 4 * std::sqrt(2.0 / kSets);
  for (const int p : {1, 2}) EXPECT_NEAR(squares[p] / variances[p], 1, enough) << p;
  EXPECT_LT(squares[0] / variances[0], 1 + enough) << "the error of c in y shows in x, too, and is not taken off";
  EXPECT_GT(squares[0] / variances[0], 0.25);
}

TEST(FitDeviation, AgreesWithAJackknife) {
  const unsigned seed = SeedOf(12);
  SCOPED_TRACE("seed " + std::to_string(seed));
  const ModelText start = Pendulum(1.2, 0.1);
  Transitions all = Drive(Pendulum(0.8, 0.3), seed, 0, 150);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (Eigen::Index i = 0; i < all.x_next.rows(); ++i)
    all.x_next.row(i) += Eigen::RowVector2d(0.1 * uniform(random), 0.005 * uniform(random));
  const Fit fit = FitParameters(start, all, {"length", "damping"});
  const Eigen::Index count = all.x_next.rows(), rest = count - 1;
  Eigen::ArrayX2d without(count, 2);
  for (Eigen::Index left_out = 0; left_out < count; ++left_out) {
    Transitions others{all.z.topRows(rest), all.x_next.topRows(rest)};
    if (left_out < rest) {
      others.z.row(left_out) = all.z.row(rest);
      others.x_next.row(left_out) = all.x_next.row(rest);
    }
    const Fit each = FitParameters(start, others, {"length", "damping"});
    without.row(left_out) << each.parameters[0].after, each.parameters[1].after;
  }
  for (const Eigen::Index p : {0, 1}) {
    const double squares = (without.col(p) - without.col(p).mean()).square().sum();
    const double jackknife = std::sqrt(squares * static_cast<double>(rest) / static_cast<double>(count));
    EXPECT_NEAR(fit.parameters[ToSize(p)].deviation / jackknife, 1, 0.15) << p;
  }
}

// Five steps with gain 1 and, in v, a drag of 0.07.
Transitions DraggedSteps() {
  Transitions data{Eigen::MatrixXd::Zero(5, 3), Eigen::MatrixXd(5, 2)};
  data.z.rightCols(2) << 1, 1, 2, 1, 1, -1, 2, -1, 3, 0.5;
  data.x_next << 0.1, 1.093, 0.2, 2.086, 0.1, 0.893, 0.2, 1.886, 0.3, 3.029;
  return data;
}

std::string RefusalOf(const ModelText& text, const Transitions& data, const std::vector<std::string>& names) {
  try {
    (void)FitParameters(text, data, names);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Fit, RefusesToBeginWhereAParameterHasNoDerivative) {
  const Transitions data = DraggedSteps();
  EXPECT_THAT(RefusalOf(Cart(" - sqrt(k)*v", 1, 0), data, {"gain", "k"}),
              HasSubstr("no derivative by 'k' at 0; begin elsewhere"));
  EXPECT_THAT(RefusalOf(Cart(" - sqrt(k - 2)*v", 1, 2), data, {"gain", "k"}), HasSubstr("by 'k' at 2"));
  EXPECT_EQ(RefusalOf(Cart(" - sqrt(k)*v", 1, 0), data, {"gain"}), "") << "k is not fitted";
  for (const double k : {0.001, 0.1, 3.0}) {
    const Fit fit = FitParameters(Cart(" - sqrt(k)*v", 1, k), data, {"gain", "k"});
    EXPECT_NEAR(fit.parameters[1].after, 0.07 * 0.07, 1e-6) << "from " << k;
  }
}

TEST(Fit, RefusesToBeginWhereAParameterHasNoEffectNearby) {
  const Transitions data = DraggedSteps();
  for (const char* rate : {" - k^2*v", " - k^3*v", " - (1 - cos(k))*v"})
    EXPECT_THAT(RefusalOf(Cart(rate, 1, 0), data, {"gain", "k"}),
                HasSubstr("'k' has no effect near 0; begin elsewhere"))
        << rate;
  for (const double k : {0.001, 0.1, 3.0})
    EXPECT_NEAR(std::abs(FitParameters(Cart(" - k^2*v", 1, k), data, {"gain", "k"}).parameters[1].after),
                std::sqrt(0.07), 1e-6)
        << "from " << k;
  const Fit unused = FitParameters(Cart(" - 0.07*v + 0*k*v", 1, 0), data, {"gain", "k"});
  EXPECT_EQ(unused.parameters[1].deviation, kInfinity) << "it has no effect anywhere, which is no error";
}

// The factor of k is zero at the start, and the fit moves it.
TEST(Fit, BeginsWhereAnotherParameterHidesTheEffect) {
  Transitions data = DraggedSteps();
  for (Eigen::Index i = 0; i < 5; ++i) data.x_next(i, 1) = data.z(i, 1) + 0.1 * 2 * data.z(i, 2);
  const Fit fit = FitParameters(Cart(" + 0*v", 0, 0.1), data, {"gain", "k"});
  EXPECT_NEAR(fit.parameters[0].after, 2, 1e-6);
  EXPECT_EQ(fit.parameters[1].deviation, kInfinity);
  ModelText text = Cart("", 0, 1);
  text.equations[1] = {"v + dt*gain*k^2*a", 2, 1};
  EXPECT_EQ(RefusalOf(text, data, {"gain", "k"}), "");
}

TEST(Fit, RefusesAParameterThatRunsAway) {
  Transitions data = DraggedSteps();
  for (Eigen::Index i = 0; i < 5; ++i) data.x_next(i, 1) = data.z(i, 1) + 0.12 * data.z(i, 2);
  EXPECT_THAT(RefusalOf(Cart("*tanh(k)", 1, 0.5), data, {"k"}), HasSubstr("the transitions do not bound 'k'"))
      << "tanh never reaches 1.2";
  for (Eigen::Index i = 0; i < 5; ++i) data.x_next(i, 1) = data.z(i, 1) + 0.1 * data.z(i, 2) - 0.01 * data.z(i, 1);
  EXPECT_THAT(RefusalOf(Cart(" + exp(k)*v", 1, 0), data, {"gain", "k"}), HasSubstr("do not bound 'k'"))
      << "exp is never negative";
  EXPECT_EQ(RefusalOf(Cart(" - exp(k)*v", 1, 0), data, {"gain", "k"}), "");
  for (Eigen::Index i = 0; i < 5; ++i) data.x_next(i, 1) = data.z(i, 1) + 0.098 * data.z(i, 2);
  EXPECT_NEAR(FitParameters(Cart("*tanh(k)", 1, 0.5), data, {"k"}).parameters[0].after, std::atanh(0.98), 1e-6);
  const Fit far = FitParameters(Cart("", 1e-6, 0), data, {"gain"});
  EXPECT_NEAR(far.parameters[0].after, 0.98, 1e-6) << "a million times its start is no running away";
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
