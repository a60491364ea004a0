#include "simulator/target.h"

#include "tests/test.h"

#include "forereach/dynamics/models/named_residuals.h"
#include "forereach/dynamics/models/residuals.h"
#include "forereach/dynamics/text_model.h"
#include "forereach/residual/consistency.h"
#include "tests/oracle/exact.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::target_test {

// The paper's formulas are written out again below in exact.h's numbers of 256 bits, apart from the code under test.
using Reals = std::vector<Real>;

Reals BicycleResidual(const std::vector<double>& z) {
  const Real v = z[3], tan_delta = tan(Real(z[5])), wheelbase = 2.5;
  const Real excess = abs(v * v * tan_delta / wheelbase) - Real(0.9) * Real(9.81);
  Reals r(6);
  if (!(excess <= 0))
    r[2] = -(Real(0.1) * Real(0.32) / wheelbase * v * tan_delta * exp(Real(-1) / (Real(0.1) * excess)));
  return r;
}

Reals BicycleTarget(const std::vector<double>& z) {
  const Real dt = 0.1, v = z[3], theta = z[2];
  Reals next = BicycleResidual(z);
  next[0] = next[0] + z[0] + dt * v * cos(theta);
  next[1] = next[1] + z[1] + dt * v * sin(theta);
  next[2] = next[2] + theta + dt / Real(2.5) * v * tan(Real(z[5]));
  next[3] = next[3] + v + dt * z[4];
  next[4] = next[4] + z[4] + dt * z[6];
  next[5] = next[5] + z[5] + dt * z[7];
  return next;
}

Reals PointMassResidual(const std::vector<double>& z) {
  const Real dt = 0.15, vx = z[2], vy = z[3], gamma = 0.4, kappa = 0.3, beta = 0.14;
  const Real s = sqrt(vx * vx + vy * vy + Real(1e-12));
  const Real l = beta * log(Real(1) + exp((s - Real(0.9)) / beta));
  const Real g = l / (s + Real(0.15));
  const Real ax = g * (-gamma * vx - kappa * vy), ay = g * (kappa * vx - gamma * vy);
  const Real half = dt * dt / Real(2);
  return {half * ax, half * ay, dt * ax, dt * ay};
}

Reals PointMassTarget(const std::vector<double>& z) {
  const Real dt = 0.15, half = dt * dt / Real(2);
  Reals next = PointMassResidual(z);
  for (std::size_t axis : {0u, 1u}) {
    next[axis] = next[axis] + z[axis] + dt * z[axis + 2] + half * z[axis + 4];
    next[axis + 2] = next[axis + 2] + z[axis + 2] + dt * z[axis + 4];
  }
  return next;
}

Config Task(const Problem& problem, const ResidualText& residual) {
  return {.path = "task.yaml",
          .problem = std::make_shared<const Problem>(problem),
          .robot_residual = ResidualOf(*problem.model, residual)};
}

Config Bicycle() { return Task(PaperBicycle(), ResidualNamed("heading_saturation")); }

Config PointMassTask() { return Task(PaperPointMass(5.4, 2), ResidualNamed("velocity_knee")); }

std::vector<double> Step(const Target& target, const std::vector<double>& z, std::size_t n) {
  std::vector<double> next(n);
  target.Step(std::span(z).first(n), std::span(z).subspan(n), next);
  return next;
}

double Ulp(double x) { return std::nextafter(std::abs(x), std::numeric_limits<double>::infinity()) - std::abs(x); }

template <class Residual>
std::vector<double> EvaluateResidual(const Residual& residual, const std::vector<double>& z, std::size_t n) {
  std::vector<double> r(n);
  residual(std::span<const double>(z), std::span<double>(r));
  return r;
}

// Sums cancel where a successor comes close to zero: there the bound is that of the terms, in extended precision.
void ExpectOneRounding(const Config& config, Reals (*reference)(const std::vector<double>&), std::uint64_t seed) {
  SCOPED_TRACE(seed);
  const auto n = static_cast<std::size_t>(config.problem->model->num_states());
  const std::unique_ptr<Target> target = MakeTarget(config);
  const Transitions made = MakeTransitions(*target, *config.problem, seed, 20000);
  int exact = 0, beyond_one_ulp = 0;
  for (int i = 0; i < made.size(); ++i) {
    const Eigen::VectorXd row = made.z.row(i);
    const std::vector<double> z(row.begin(), row.end());
    const Reals expected = reference(z);
    for (std::size_t k = 0; k < n; ++k) {
      const double next = made.x_next(i, static_cast<Eigen::Index>(k));
      exact += next == expected[k].ToDouble();
      const double error = std::abs((expected[k] - Real(next)).ToDouble());
      beyond_one_ulp += error > Ulp(next);
      const double term = std::abs(z[k]) + std::abs(next - z[k]);
      ASSERT_LE(error, Ulp(next) / 2 + 0x1p-60 * term) << "row " << i << " coordinate " << k;
    }
  }
  const int total = made.size() * static_cast<int>(n);
  std::cout << exact << " of " << total << " successors correctly rounded, " << beyond_one_ulp << " beyond one ulp\n";
  EXPECT_GE(exact, total * 0.99) << "adding a residual to a rounded nominal successor gives three in four";
  EXPECT_LE(beyond_one_ulp, total / 10000);
}

TEST(Target, BicycleIsRoundedOnce) { ExpectOneRounding(Bicycle(), BicycleTarget, 1); }
TEST(Target, PointMassIsRoundedOnce) { ExpectOneRounding(PointMassTask(), PointMassTarget, 2); }

// Rates with stages, and a residual with definitions and a kink.
TEST(Target, TextModelIsRoundedOnce) {
  const ModelText text = TextModel({{"angle", "rate"}, {"rate", "torque - 9.81*sin(angle)"}}, {"torque"},
                                   {{"dt", 0.05, 0.05}}, {}, ModelText::Integrator::kRk4);
  const ResidualText friction{
      "friction", {{"c", 0.3, 0.3}}, {{"size", {"abs(rate)"}}}, {{"rate", {"-dt*c*rate*size"}}}};
  const auto reference = [](const std::vector<double>& z) {
    const Real dt = 0.05, half = dt / Real(2), torque = z[2];
    const auto rates = [&](const Reals& x) { return Reals{x[1], torque - Real(9.81) * sin(x[0])}; };
    const auto at = [&](const Real& length, const Reals& k) {
      return Reals{Real(z[0]) + length * k[0], Real(z[1]) + length * k[1]};
    };
    const Reals k1 = rates({z[0], z[1]}), k2 = rates(at(half, k1)), k3 = rates(at(half, k2)), k4 = rates(at(dt, k3));
    Reals next = {z[0], z[1]};
    for (const std::size_t k : {0u, 1u}) next[k] = next[k] + dt / Real(6) * (k1[k] + Real(2) * (k2[k] + k3[k]) + k4[k]);
    next[1] = next[1] - dt * Real(0.3) * Real(z[1]) * abs(Real(z[1]));
    return next;
  };
  ExpectOneRounding(Task(WorldOf(MakeTextModel(text), Within({3, 5}), Within({2})), friction), reference, 3);
}

// The bits of the compiled equations of model and residual, in the same order of operations.
template <class Nominal, class Residual>
void ExpectTheBitsOf(const Nominal& nominal, const Residual& residual, const Config& config) {
  const std::unique_ptr<Target> target = MakeTarget(config);
  const Transitions made = MakeTransitions(*target, *config.problem, 4, 20000);
  for (int i = 0; i < made.size(); ++i) {
    const Eigen::VectorXd row = made.z.row(i);
    const std::vector<long double> z(row.begin(), row.end());
    std::vector<long double> f0(Nominal::kStates), r = f0;
    nominal(std::span<const long double>(z), std::span(f0));
    residual(std::span<const long double>(z), std::span(r));
    for (std::size_t k = 0; k < f0.size(); ++k)
      ASSERT_EQ(made.x_next(i, static_cast<Eigen::Index>(k)), static_cast<double>(f0[k] + r[k]));
  }
}

TEST(Target, OfANamedResidualHasTheBitsOfTheCompiledOne) {
  ExpectTheBitsOf(KinematicBicycle{0.1, 2.5}, HeadingSaturation{0.1, 2.5}, Bicycle());
  ExpectTheBitsOf(PointMass{0.15}, VelocityKnee{0.15}, PointMassTask());
}

TEST(Target, WithoutResidualItIsTheNominalModel) {
  for (Config config : {Bicycle(), PointMassTask()}) {
    config.robot_residual.reset();
    const auto n = static_cast<std::size_t>(config.problem->model->num_states());
    const std::vector<double> z(static_cast<std::size_t>(config.problem->model->num_variables()), 0.3);
    std::vector<double> nominal(n);
    config.problem->model->Evaluate(z, nominal);
    EXPECT_EQ(Step(*MakeTarget(config), z, n), nominal);
  }
}

// x' = u = 1 with a residual of 1/4: in a step that is a tenth longer or shorter it is that of some power of the
// duration, from 1 to the integrator's order and one, and each of these is some seed's.
TEST(Target, LetsItsResidualGrowWithAPowerOfTheDuration) {
  using Integrator = ModelText::Integrator;
  for (const auto& [integrator, most] : {std::pair(Integrator::kEuler, 2), std::pair(Integrator::kRk4, 5)}) {
    Problem problem = WorldOf(MakeTextModel(TextModel({{"x", "u"}}, {"u"}, {{"dt", 0.5, 0.5}}, {}, integrator)),
                              Within({9}), Within({2}));
    problem.timing.error = 0.05;
    Config config = Task(problem, ResidualText{"push", {}, {}, {{"x", {"0.25*u"}}}});
    std::set<int> seen;
    for (int seed = 0; seed < 60; ++seed) {
      config.robot.disturbance_seed = seed;
      const std::unique_ptr<Target> target = MakeTarget(config);
      const auto grown = [&](double longer) {
        const std::array<double, 1> x{0}, u{1};
        std::array<double, 1> next, on_time;
        target->Step(x, u, on_time);
        target->Step(x, u, next, longer);
        return next[0] - on_time[0] - longer;
      };
      int power = 1;
      while (power <= most && std::abs(grown(0.05) - 0.25 * (std::pow(1.1, power) - 1)) > 1e-12) ++power;
      ASSERT_LE(power, most);
      EXPECT_NEAR(grown(-0.05), 0.25 * (std::pow(0.9, power) - 1), 1e-12);
      seen.insert(power);
    }
    EXPECT_EQ(static_cast<int>(seen.size()), most);
  }
}

TEST(Target, StepsWithInputAndOutputInOneArray) {
  const std::unique_ptr<Target> target = MakeTarget(Bicycle());
  const std::vector<double> z{1, 2, 0.3, 20, 0.5, 0.3, 1, -0.5};
  std::vector<double> x(z.begin(), z.begin() + 6);
  target->Step(x, std::span(z).subspan(6), x);
  EXPECT_EQ(x, Step(*target, z, 6));
}

TEST(HeadingSaturationTest, IsExactlyZeroBelowTheKneeAndOnlyTurnsLessAbove) {
  const HeadingSaturation residual{0.1, 2.5};
  const double knee_speed = std::sqrt(0.9 * 9.81 * 2.5 / std::tan(0.3));
  for (const double v : {0.0, 5.0, knee_speed * (1 - 1e-12)})
    EXPECT_EQ(EvaluateResidual(residual, {1, 2, 3, v, 1, 0.3, 1, 1}, 6), std::vector<double>(6, 0.0)) << v;
  for (const double v : {knee_speed * 1.2, 25.0}) {
    const std::vector<double> r = EvaluateResidual(residual, {1, 2, 3, v, 1, 0.3, 1, 1}, 6);
    EXPECT_LT(r[2], 0) << v;
    EXPECT_GT(r[2], -0.1 / 2.5 * 0.32 * v * std::tan(0.3)) << v;
    for (const std::size_t k : {0u, 1u, 3u, 4u, 5u}) EXPECT_EQ(r[k], 0);
  }
}

TEST(HeadingSaturationTest, IsOddInSteeringAndBlindToEverythingButSpeedAndSteering) {
  const HeadingSaturation residual{0.1, 2.5};
  for (const double v : {12.0, 18.0, 25.0}) {
    for (const double delta : {0.1, 0.25, 0.48}) {
      const double left = EvaluateResidual(residual, {0, 0, 0, v, 0, delta, 0, 0}, 6)[2];
      EXPECT_EQ(EvaluateResidual(residual, {0, 0, 0, v, 0, -delta, 0, 0}, 6)[2], -left);
      EXPECT_EQ(EvaluateResidual(residual, {9, -9, 1, v, 2, delta, 3, 1}, 6)[2], left);
    }
  }
}

TEST(HeadingSaturationTest, AgreesWithThePapersFormula) {
  std::mt19937_64 random(3);
  const HeadingSaturation residual{0.1, 2.5};
  int active = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const double v = 25.0 * static_cast<double>(random() >> 11) * 0x1p-53;
    const double delta = 0.48 * (static_cast<double>(random() >> 11) * 0x1p-52 - 1);
    const std::vector<double> z{0, 0, 0, v, 0, delta, 0, 0};
    const double expected = BicycleResidual(z)[2].ToDouble();
    // Close to the knee the gate's exponent amplifies rounding.
    EXPECT_NEAR(EvaluateResidual(residual, z, 6)[2], expected, 1e-12 * std::abs(expected) + 1e-16);
    active += expected != 0;
  }
  EXPECT_GT(active, 500);
}

TEST(VelocityKneeTest, AgreesWithThePapersFormula) {
  std::mt19937_64 random(4);
  const VelocityKnee residual{0.15};
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<double> z(6);
    for (double& entry : z) entry = 5.4 * (static_cast<double>(random() >> 11) * 0x1p-52 - 1);
    const Reals expected = PointMassResidual(z);
    const std::vector<double> r = EvaluateResidual(residual, z, 4);
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_NEAR(r[k], expected[k].ToDouble(), 1e-13 * (std::abs(z[2]) + std::abs(z[3])));
  }
}

TEST(VelocityKneeTest, IsOddInVelocityZeroAtRestAndSmallBelowTheKnee) {
  const VelocityKnee residual{0.15};
  EXPECT_EQ(EvaluateResidual(residual, {3, 4, 0, 0, 1, 1}, 4), std::vector<double>(4, 0.0));
  const std::vector<double> r = EvaluateResidual(residual, {0, 0, 2, -1, 0, 0}, 4);
  const std::vector<double> mirrored = EvaluateResidual(residual, {7, 7, -2, 1, 5, 5}, 4);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(mirrored[k], -r[k]);
  EXPECT_LT(r[2], 0) << "drag";
  EXPECT_LT(std::abs(EvaluateResidual(residual, {0, 0, 0.1, 0, 0, 0}, 4)[2]), 1e-3 * std::abs(r[2]));
}

TEST(Residuals, TheBuildingBlocksDoNotOverflow) {
  EXPECT_EQ(SmoothGate(0.0), 0);
  EXPECT_EQ(SmoothGate(-1.0), 0);
  EXPECT_EQ(SmoothGate(std::numeric_limits<double>::denorm_min()), 0);
  EXPECT_EQ(SmoothGate(1.0), std::exp(-1.0));
  EXPECT_EQ(Softplus(1000.0, 1.0), 1000);
  EXPECT_EQ(Softplus(-1000.0, 1.0), 0);
  EXPECT_DOUBLE_EQ(Softplus(0.0, 0.5), std::log(2.0) / 2);
}

TEST(MakeTargetTest, SaysWhatIsWrongWithTheConfig) {
  const auto failure = [](auto change) {
    Config config = Bicycle();
    change(*config.robot_residual);
    try {
      static_cast<void>(MakeTarget(config));
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(failure([](auto&) {}), "accepted");
  EXPECT_THAT(failure([](auto& residual) { residual.names.parameters.back().lower = NAN; }),
              HasSubstr("task.yaml: robot.residual: heading_saturation: the parameter gate_temperature"));
  EXPECT_THAT(failure([](auto& residual) { residual.values[0].text = "mu"; }), HasSubstr("mu"));
  EXPECT_THAT(failure([](auto& residual) { residual.values.pop_back(); }), HasSubstr("of kinematic_bicycle"));
  EXPECT_THAT(failure([](auto& residual) { residual = *PointMassTask().robot_residual; }),
              HasSubstr("velocity_knee: for other states"));
}

TEST(MakeTargetTest, ParametersReplaceThePapersValues) {
  Config config = Bicycle();
  const std::vector<double> z{0, 0, 0, 20, 0, 0.4, 0, 0};
  const double paper = Step(*MakeTarget(config), z, 6)[2];
  auto& parameters = config.robot_residual->names.parameters;
  const auto understeer = std::ranges::find(parameters, "understeer", &ModelText::Parameter::name);
  understeer->lower = understeer->upper = 0;
  const double nominal = Step(*MakeTarget(config), z, 6)[2];
  EXPECT_LT(paper, nominal);
  EXPECT_DOUBLE_EQ(nominal, 0.1 / 2.5 * 20 * std::tan(0.4));
}

TEST(MakeTransitionsTest, SamplesLieInTheNarrowedDomainAndAreThoseOfTheSeed) {
  const Config config = Bicycle();
  const std::unique_ptr<Target> target = MakeTarget(config);
  const std::vector<SampleRange> ranges{{"v", 7.25, 15.75}, {"delta", 0, 0.45}, {"jerk", 1, 1}};
  const Transitions made = MakeTransitions(*target, *config.problem, 5, 500, ranges);
  EXPECT_EQ(made.size(), 500);
  EXPECT_GE(made.z.col(3).minCoeff(), 7.25);
  EXPECT_LE(made.z.col(3).maxCoeff(), 15.75);
  EXPECT_LT(made.z.col(3).minCoeff(), 7.4);
  EXPECT_GT(made.z.col(3).maxCoeff(), 15.6);
  EXPECT_GE(made.z.col(5).minCoeff(), 0);
  EXPECT_TRUE((made.z.col(6).array() == 1).all());
  EXPECT_LT(made.z.col(0).minCoeff(), -35);
  const Transitions again = MakeTransitions(*target, *config.problem, 5, 500, ranges);
  EXPECT_FIELDS(made, (z, again.z), (x_next, again.x_next));
  EXPECT_NE(made.z, MakeTransitions(*target, *config.problem, 6, 500, ranges).z);
}

// The generator and its mapping to numbers are fixed by the standard and by this project, not by the library:
// the first output of mt19937_64 seeded with 5489 is 14514284786278117030.
TEST(MakeTransitionsTest, TheFirstSampleOfASeedIsTheSpecifiedOne) {
  const Config config = PointMassTask();
  const Transitions made = MakeTransitions(*MakeTarget(config), *config.problem, 5489, 1);
  const double fraction = static_cast<double>(14514284786278117030ull >> 11) * 0x1p-53;
  EXPECT_EQ(made.z(0, 0), -20 + 40 * fraction);
}

TEST(MakeTransitionsTest, KeepsToBallsAndInequalities) {
  Config config = PointMassTask();
  Problem problem = *config.problem;
  problem.domain.balls = {{{2, 3}, Eigen::VectorXd::Zero(2), 5.4}};
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(6);
  coefficients(0) = 1;
  problem.domain.inequalities = {{coefficients, 3}};
  const Transitions made = MakeTransitions(*MakeTarget(config), problem, 7, 400);
  EXPECT_LE(made.z.col(0).maxCoeff(), 3);
  EXPECT_LE(made.z.middleCols(2, 2).rowwise().norm().maxCoeff(), 5.4);
  EXPECT_GT(made.z.middleCols(2, 2).rowwise().norm().maxCoeff(), 5.2);

  problem.domain.inequalities = {{coefficients, -20.5}};
  EXPECT_THROW(static_cast<void>(MakeTransitions(*MakeTarget(config), problem, 7, 1)), std::invalid_argument);
}

TEST(MakeTransitionsTest, NoiseStaysWithinItsBoundAndOnItsChannels) {
  const Config config = PointMassTask();
  const std::unique_ptr<Target> target = MakeTarget(config);
  Eigen::VectorXd bound = Eigen::VectorXd::Zero(4);
  bound(2) = 0.25;
  const Transitions noisy = MakeTransitions(*target, *config.problem, 8, 400, {}, bound);
  double largest = 0;
  for (int i = 0; i < noisy.size(); ++i) {
    const Eigen::VectorXd row = noisy.z.row(i);
    const std::vector<double> next = Step(*target, {row.begin(), row.end()}, 4);
    for (int k : {0, 1, 3}) EXPECT_EQ(noisy.x_next(i, k), next[static_cast<std::size_t>(k)]);
    largest = std::max(largest, std::abs(noisy.x_next(i, 2) - next[2]));
  }
  EXPECT_LE(largest, 0.25 * (1 + 1e-15));
  EXPECT_GT(largest, 0.24);
}

class DisturbanceTest : public testing::TestWithParam<std::string> {};

// Declared for vx and, so small that a double does not show it, for vy.
TEST_P(DisturbanceTest, StaysWithinItsBoundAndReachesIt) {
  Config config = PointMassTask();
  Problem problem = *config.problem;
  config.robot_residual.reset();
  problem.declaration.lipschitz = Eigen::MatrixXd::Zero(4, 6);
  problem.declaration.noise_bound = Eigen::VectorXd::Zero(4);
  problem.declaration.disturbance = Eigen::Vector4d(0, 0, 0.25, 1e-300);
  config.robot.disturbance = GetParam();
  const std::unique_ptr<Target> target = MakeTarget(config);
  const auto make = [&](int seed) {
    config.robot.disturbance_seed = seed;
    Disturbance disturbance(problem.declaration, config.robot);
    return MakeTransitions(*target, problem, 8, 4000, {}, {}, &disturbance);
  };
  const Transitions made = make(3);
  double largest = 0;
  int changes = 0, highest = 0, run = 0;
  bool was_positive = true;
  for (int i = 0; i < made.size(); ++i) {
    const Eigen::VectorXd row = made.z.row(i);
    const std::vector<double> next = Step(*target, {row.begin(), row.end()}, 4);
    for (int k : {0, 1, 3}) EXPECT_EQ(made.x_next(i, k), next[static_cast<std::size_t>(k)]);
    const mpq_class moved = mpq_class(made.x_next(i, 2)) - mpq_class(next[2]);
    EXPECT_TRUE(-0.25 <= moved && moved <= 0.25) << i;
    largest = std::max(largest, std::abs(moved.get_d()));
    const bool is_positive = moved > 0;
    run = is_positive == was_positive ? run + 1 : 1;
    changes += is_positive != was_positive;
    highest = std::max(highest, run);
    was_positive = is_positive;
  }
  EXPECT_GT(largest, 0.2499);
  if (GetParam() == "adversarial") {
    EXPECT_GT(highest, Disturbance::kLongestHold);
    EXPECT_NEAR(changes, 4000 / 33, 60);
  } else {
    EXPECT_NEAR(changes, 2000, 150);
  }
  EXPECT_EQ(made.x_next, make(3).x_next);
  EXPECT_NE(made.x_next, make(4).x_next);
  EXPECT_FALSE(FindViolation(problem.declaration, Observe(*problem.model, made)));
}

// At each place by what the expression allows there, which is reached.
TEST_P(DisturbanceTest, StaysWithinABoundThatGrowsAndReachesIt) {
  Config config = PointMassTask();
  Problem problem = *config.problem;
  config.robot_residual.reset();
  problem.declaration.disturbance = {};
  problem.declaration.growing = Growing(*problem.model, {"0", "0", "0.25*(ax - vy)", "0"});
  config.robot.disturbance = GetParam();
  config.robot.disturbance_seed = 3;
  const std::unique_ptr<Target> target = MakeTarget(config);
  Disturbance disturbance(problem.declaration, config.robot);
  const Transitions made = MakeTransitions(*target, problem, 8, 2000, {}, {}, &disturbance);
  double largest = 0;
  for (int i = 0; i < made.size(); ++i) {
    const Eigen::VectorXd row = made.z.row(i);
    const std::vector<double> next = Step(*target, {row.begin(), row.end()}, 4);
    const mpq_class moved = mpq_class(made.x_next(i, 2)) - mpq_class(next[2]),
                    bound = abs(mpq_class(row[4]) - mpq_class(row[3])) / 4;
    EXPECT_LE(abs(moved), bound) << i;
    if (bound > 0.01) largest = std::max(largest, mpq_class(abs(moved) / bound).get_d());
    for (int k : {0, 1, 3}) EXPECT_EQ(made.x_next(i, k), next[static_cast<std::size_t>(k)]);
  }
  EXPECT_GT(largest, 0.99);
}

// Also where the true state is far smaller than its error, or far larger.
TEST_P(DisturbanceTest, MeasuresWithinTheStateErrorAndReachesIt) {
  Declaration declaration;
  declaration.state_error = Eigen::Vector4d(0.25, 0.03, 1e-300, 0);
  RobotOptions options;
  options.sensor_error = GetParam();
  const std::vector<double> truth{1e-9, 1234.5, 1, 0.5};
  std::vector<double> first, second;
  for (std::vector<double>* errors : {&first, &second}) {
    Disturbance sensor = Disturbance::OfMeasurements(declaration, options);
    for (int i = 0; i < 1000; ++i) {
      std::vector<double> measured = truth;
      sensor.Add(measured);
      for (std::size_t k = 0; k < 4; ++k) {
        const mpq_class error = mpq_class(measured[k]) - mpq_class(truth[k]);
        EXPECT_LE(abs(error), mpq_class(declaration.state_error[static_cast<Eigen::Index>(k)])) << k;
      }
      errors->push_back(measured[0] - truth[0]);
    }
  }
  EXPECT_EQ(first, second) << "one seed";
  const auto [least, largest] = std::ranges::minmax(first);
  EXPECT_LT(least, -0.24);
  EXPECT_GT(largest, 0.24);
  if (GetParam() == "adversarial")
    EXPECT_TRUE(std::ranges::all_of(first, [](double error) { return std::abs(error) > 0.2499; })) << "at a corner";
  options.sensor_error = "none";
  std::vector<double> exact = truth;
  Disturbance::OfMeasurements(declaration, options).Add(exact);
  EXPECT_EQ(exact, truth);
}

TEST_P(DisturbanceTest, ActsWithinTheInputErrorAndReachesIt) {
  Declaration declaration;
  declaration.state_error = Eigen::Vector2d(9, 9);
  declaration.input_error = Eigen::Vector3d(0.25, 0, 1e-300);
  RobotOptions options;
  options.input_error = GetParam();
  Disturbance inputs = Disturbance::OfInputs(declaration, options);
  const std::vector<double> of_plan{0.75, 2, 1e-290};
  std::vector<double> first;
  for (int i = 0; i < 1000; ++i) {
    std::vector<double> acts = of_plan;
    inputs.Add(acts);
    for (std::size_t l = 0; l < 3; ++l)
      EXPECT_LE(abs(mpq_class(acts[l]) - mpq_class(of_plan[l])),
                mpq_class(declaration.input_error[static_cast<Eigen::Index>(l)]))
          << l;
    first.push_back(acts[0] - of_plan[0]);
  }
  const auto [least, largest] = std::ranges::minmax(first);
  EXPECT_LT(least, -0.249);
  EXPECT_GT(largest, 0.249);
  if (GetParam() == "adversarial")
    EXPECT_TRUE(std::ranges::all_of(first, [](double error) { return std::abs(error) > 0.2499; })) << "at a corner";
}

INSTANTIATE_TEST_SUITE_P(Kinds, DisturbanceTest, testing::Values("random", "adversarial"));

TEST(MakeTransitionsTest, RefusesWhatIsNotInsideTheDomain) {
  const Config config = Bicycle();
  const std::unique_ptr<Target> target = MakeTarget(config);
  const auto make = [&](SampleRange range) {
    return [&, range] { static_cast<void>(MakeTransitions(*target, *config.problem, 1, 1, {range})); };
  };
  EXPECT_THAT(make({"speed", 0, 1}), ThrowsMessage<std::invalid_argument>(HasSubstr("no coordinate speed")));
  EXPECT_THAT(make({"v", 0, 25.5}), ThrowsMessage<std::invalid_argument>(HasSubstr("v in [0, 25.5]")));
  EXPECT_THAT(make({"v", 2, 1}), ThrowsMessage<std::invalid_argument>(HasSubstr("empty")));
  EXPECT_THAT(make({"v", NAN, 1}), ThrowsMessage<std::invalid_argument>(HasSubstr("empty")));
  EXPECT_NO_THROW(make({"v", 0, 25})());
  EXPECT_THROW(static_cast<void>(MakeTransitions(*target, *config.problem, 1, 1, {}, Eigen::VectorXd::Zero(2))),
               std::invalid_argument);
}

}  // namespace forereach::target_test
