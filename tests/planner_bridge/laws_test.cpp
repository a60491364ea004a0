// Braking and steering by the laws of a task.
#include "tests/test.h"

#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/text_model.h"
#include "task/motion.h"
#include "tests/planner_bridge/tasks.h"

namespace forereach::laws_test {

std::span<const double> Span(const Eigen::VectorXd& x) { return {x.data(), static_cast<std::size_t>(x.size())}; }

// A unicycle whose model has a definition that uses an input.
Config Unicycle() {
  ModelText text{.name = "unicycle",
                 .states = {{"x", "m"}, {"y", "m"}, {"theta", "rad"}, {"v", "m/s"}, {"omega", "rad/s"}},
                 .inputs = {{"a", "m/s^2"}, {"alpha", "rad/s^2"}},
                 .parameters = {{"dt", 0.1, 0.1}, {"gain", 0.5, 1.5}},
                 .definitions = {{"change", {"dt*a"}}, {"twice", {"2*v"}}},
                 .equations = {{"x + dt*v*cos(theta)"},
                               {"y + dt*v*sin(theta)"},
                               {"theta + dt*omega"},
                               {"v + change"},
                               {"omega + dt*alpha"}}};
  Config config;
  config.path = "unicycle";
  config.problem = std::make_shared<const Problem>(WorldOf(MakeTextModel(text),
                                                           Box(Vec({-10, -10, -4, -0.1, -2}), Vec({10, 10, 4, 2, 2})),
                                                           Box(Vec({-1, -3}), Vec({0.5, 3}))));
  config.laws.stop = {{{"-v/dt"}, {"-omega/dt"}}};
  config.laws.at_rest = std::vector<RestBound>{{3, 1e-3}, {4, 1e-3}};
  config.robot.hold = std::vector<std::string>{"v", "omega"};
  return config;
}

Eigen::VectorXd Successor(const NominalModel& model, const Eigen::VectorXd& x, const Eigen::VectorXd& u) {
  Eigen::VectorXd z(x.size() + u.size()), next(x.size());
  z << x, u;
  model.Evaluate(Span(z), {next.data(), static_cast<std::size_t>(next.size())});
  return next;
}

TEST(Laws, ATailEndsAtRestInsideTheInputDomain) {
  const Config config = Unicycle();
  const RobotMotion motion(config, Braking::kPlanned);
  std::mt19937 random(1);
  SCOPED_TRACE("seed 1");
  for (int i = 0; i < 200; ++i) {
    std::uniform_real_distribution<double> one(-1, 1);
    Eigen::VectorXd x = Vec({0, 0, 3 * one(random), 2 * one(random), 2 * one(random)});
    Eigen::MatrixXd controls;
    ASSERT_TRUE(motion.Brake(Span(x), 0, 100, controls));
    for (int t = 0; t < controls.cols(); ++t) {
      EXPECT_FALSE(motion.IsAtRest(Span(x))) << "a tail is not longer than it has to be";
      EXPECT_TRUE(config.problem->domain.input.Contains(controls.col(t)));
      x = Successor(*config.problem->model, x, controls.col(t));
    }
    EXPECT_TRUE(motion.IsAtRest(Span(x)));
    EXPECT_NEAR(x(3), 0, 1e-9) << "the law is exact";
    EXPECT_NEAR(x(4), 0, 1e-9);
  }
}

TEST(Laws, ATailThatNeedsMoreStepsThanAllowedIsRefused) {
  const RobotMotion motion(Unicycle(), Braking::kPlanned);
  const Eigen::VectorXd x = Vec({0, 0, 0, 1, 0});  // by 0.1 m/s in each step
  Eigen::MatrixXd controls;
  EXPECT_TRUE(motion.Brake(Span(x), 0, 10, controls));
  EXPECT_EQ(controls.cols(), 10);
  EXPECT_FALSE(motion.Brake(Span(x), 0, 9, controls));
  EXPECT_TRUE(motion.Brake(Span(Vec({1, 1, 1, 1e-3, -1e-3})), 0, 0, controls));
  EXPECT_EQ(controls.cols(), 0);
  EXPECT_FALSE(motion.Brake(Span(Vec({1, 1, 1, 1.001e-3, 0})), 0, 0, controls));
}

TEST(Laws, ALawWithoutAValueGivesNoTail) {
  Config config = Unicycle();
  config.laws.stop = {{{"sqrt(v - 0.5) - 1"}, {"0"}}};
  Eigen::MatrixXd controls;
  EXPECT_FALSE(RobotMotion(config, Braking::kPlanned).Brake(Span(Vec({0, 0, 0, 1, 0})), 0, 100, controls));
}

TEST(Laws, ATailHasTheLargestLengthWhereNoRestIsDefined) {
  Config config = Unicycle();
  config.laws.at_rest.emplace();
  const RobotMotion motion(config, Braking::kPlanned);
  Eigen::MatrixXd controls;
  EXPECT_TRUE(motion.Brake(Span(Vec({0, 0, 0, 0, 0})), 0, 17, controls));
  EXPECT_EQ(controls.cols(), 17);
  EXPECT_FALSE(motion.IsAtRest(Span(Vec({0, 0, 0, 0, 0}))));
}

TEST(Laws, EachStopLawGivesATailOfItsOwn) {
  Config config = Unicycle();
  config.laws.stop.push_back({{"-v/dt"}, {"(0.5*v - omega)/dt"}});
  config.laws.emergency_stop = {{{"-v/dt"}, {"0"}}};
  const RobotMotion planned(config, Braking::kPlanned), hardest(config, Braking::kHardest);
  EXPECT_EQ(planned.num_tails(), 2);
  EXPECT_EQ(hardest.num_tails(), 1);
  Eigen::MatrixXd controls;
  ASSERT_TRUE(planned.Brake(Span(Vec({0, 0, 0, 1, 0})), 1, 30, controls));
  EXPECT_EQ(controls(1, 0), 3) << "clipped from 5";
  ASSERT_TRUE(hardest.Brake(Span(Vec({0, 0, 0, 1, 0})), 0, 30, controls));
  EXPECT_TRUE(controls.row(1).isZero(0));
}

TEST(Laws, ABackOffIsWhatItsLawDoesAndThenATail) {
  Config config = Unicycle();
  EXPECT_FALSE(RobotMotion(config, Braking::kPlanned).has_back_off());
  config.laws.back_off = {{"(-0.5 - v)/dt"}, {"theta"}};
  const RobotMotion motion(config, Braking::kPlanned);
  ASSERT_TRUE(motion.has_back_off());
  Eigen::MatrixXd controls;
  ASSERT_TRUE(motion.BackOff(Span(Vec({0, 0, 2, 0, 0})), 3, 30, controls));
  ASSERT_EQ(controls.cols(), 3 + 6);
  EXPECT_TRUE(controls.row(0).head(3).isConstant(-1)) << "clipped";
  EXPECT_TRUE(controls.row(0).tail(6).isApproxToConstant(0.5, 1e-9)) << controls;
  EXPECT_EQ(controls(1, 0), 2) << "of theta";
  EXPECT_FALSE(motion.BackOff(Span(Vec({0, 0, 2, 0, 0})), 3, 2, controls)) << "no tail is so short";
}

TEST(Laws, HintsReadTheDesiredSpeedAndHeading) {
  Config config = Unicycle();
  EXPECT_FALSE(RobotMotion(config, Braking::kPlanned).has_hints());
  config.laws.definitions = {{"turn", {"desired_heading - theta"}}, {"late", {"twice*gain"}}};
  config.laws.hints = {{"desired_speed - late"}, {"turn - desired_climb"}};
  const RobotMotion motion(config, Braking::kPlanned);
  ASSERT_TRUE(motion.has_hints());
  Eigen::VectorXd u(2);
  motion.Pursue(Span(Vec({0, 0, 0.5, 0.4, 0})), {1.5, 1.2, 0.25}, {u.data(), 2});
  EXPECT_NEAR(u(0), 0.4, 1e-15) << "with the middle of gain";
  EXPECT_NEAR(u(1), 0.75, 1e-15);
  motion.Pursue(Span(Vec({0, 0, 0.5, 0.4, 0})), {10, 1.4, 0}, {u.data(), 2});
  EXPECT_EQ(u, Vec({0.5, 3})) << "clipped";
}

TEST(Laws, SpeedIsThatOfThePositionAndHoldingKeepsThePlace) {
  const RobotMotion motion(Unicycle(), Braking::kPlanned);
  EXPECT_NEAR(motion.Speed(Span(Vec({3, 1, 0.7, 1.25, 1}))), 1.25, 1e-12);
  EXPECT_NEAR(motion.Speed(Span(Vec({3, 1, 0.7, -0.1, 1}))), 0.1, 1e-12);
  EXPECT_EQ(motion.dt(), 0.1);
  Eigen::VectorXd x = Vec({1, 2, 3, 0.5, 0.25});
  motion.Hold({x.data(), 5});
  EXPECT_EQ(x, Vec({1, 2, 3, 0, 0}));
}

TEST(Laws, AnExploredControlLiesBetweenTheStopLawAndAGivenControl) {
  const RobotMotion motion(Unicycle(), Braking::kPlanned);
  const Eigen::VectorXd x = Vec({0, 0, 0, 0.05, 0});  // the law: -0.5, 0
  Eigen::VectorXd u = Vec({0.5, -3});
  motion.Explore(Span(x), 0, {u.data(), 2});
  EXPECT_TRUE(u.isApprox(Vec({-0.5, 0})));
  u = Vec({0.5, -3});
  motion.Explore(Span(x), 1, {u.data(), 2});
  EXPECT_TRUE(u.isApprox(Vec({0.5, -3})));
}

TEST(Laws, WithHintsAGivenControlIsExploredUnchanged) {
  Config config = Unicycle();
  config.laws.hints = {{"desired_speed - v"}, {"desired_heading - theta"}};
  const RobotMotion motion(config, Braking::kPlanned);
  Eigen::VectorXd u = Vec({-1, 3});
  motion.Explore(Span(Vec({0, 0, 0.5, 0.2, 0})), 0.5, {u.data(), 2});
  EXPECT_EQ(u, Vec({-1, 3}));
}

TEST(Laws, SpeedIsTheExpressionOfTheTask) {
  Config config = Unicycle();
  config.laws.speed = ExpressionText{"v + 0*twice"};
  EXPECT_EQ(RobotMotion(config, Braking::kPlanned).Speed(Span(Vec({3, 1, 0.7, -0.125, 1}))), -0.125);
}

TEST(Laws, WhatALawMayNotUseIsAnError) {
  const Config config = Unicycle();
  const auto refusal = [&](const std::string& law) -> std::string {
    return Thrown<ExpressionError>([&] {
      static_cast<void>(MakeStopLaw(*config.problem->model, config.laws, {{law}, {"0"}}));
    });
  };
  EXPECT_EQ(refusal("twice*gain*theta + dt"), "");
  EXPECT_THAT(refusal("-a"), HasSubstr("a is not a name that is known here"));
  EXPECT_THAT(refusal("change"), HasSubstr("change is not a name that is known here"));
  EXPECT_THAT(refusal("desired_speed"), HasSubstr("desired_speed is not a name that is known here"));
  EXPECT_THAT(refusal("v +"), HasSubstr("found the end"));

  Laws laws = config.laws;
  laws.definitions = {{"turn", {"desired_heeding - theta"}}};
  EXPECT_THROW(static_cast<void>(MakeStopLaw(*config.problem->model, laws, laws.stop[0])), ExpressionError);
  laws.definitions = {{"alpha", {"v"}}};
  EXPECT_THAT([&] { static_cast<void>(MakeStopLaw(*config.problem->model, laws, laws.stop[0])); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("the name alpha is used twice")));
}

TEST(Laws, AMissingLawIsAnErrorThatNamesIt) {
  const auto missing = [](void (*spoil)(Config&)) -> std::string {
    Config config = Unicycle();
    spoil(config);
    return Thrown<ConfigError>([&] { static_cast<void>(RobotMotion(config, Braking::kPlanned)); });
  };
  EXPECT_THAT(missing([](Config& config) { config.laws.stop.clear(); }),
              HasSubstr("unicycle: planner.stop: missing: how the robot brakes"));
  EXPECT_THAT(missing([](Config& config) { config.laws.at_rest.reset(); }), HasSubstr("planner.at_rest: missing"));
  EXPECT_THAT(missing([](Config& config) { config.robot.hold.reset(); }), HasSubstr("robot.hold: missing"));
}

}  // namespace forereach::laws_test
