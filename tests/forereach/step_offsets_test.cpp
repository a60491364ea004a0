// Which errors of steps a problem may declare, and what a step adds for them.
#include "forereach/reach/step_offsets.h"

#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/text_model.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::step_offsets_test {

using Integrator = ModelText::Integrator;

// x' = v for 0.125 s, and u sets v at once.
std::shared_ptr<const NominalModel> Cart() {
  return MakeTextModel(TextModel({{"x", "x + dt*v"}, {"v", "v + u"}}, {"u"}, {{"dt", 0.125, 0.125}}));
}

void ExpectRefusedTiming(const NominalModel& model, const StepTiming& timing, const std::string& what) {
  EXPECT_THAT([&] { StepOffsets(model, timing); }, ThrowsMessage<std::invalid_argument>(HasSubstr(what)));
}

TEST(StepOffsets, AreRefusedWhereTheyAreOutOfRange) {
  const auto model = MakePointMass(0.125);
  EXPECT_NO_THROW(StepOffsets(*model, {.error = std::nextafter(0.0625, 0.0)}));
  ExpectRefusedTiming(*model, {.error = 0.0625}, "is not below half of the step");
  ExpectRefusedTiming(*model, {.error = -0x1p-30}, "negative");
  ExpectRefusedTiming(*model, {.error = kInfinity}, "not finite");
  ExpectRefusedTiming(*model, {.error = std::nan("")}, "not finite");
  ExpectRefusedTiming(*model, {.error = 0.01, .set_at_steps = {4}}, "4 is no state");
  ExpectRefusedTiming(*model, {.error = 0.01, .rate_bound = Vec({1, 2})}, "2 entries, must be 4");
  ExpectRefusedTiming(*model, {.error = 0.01, .rate_bound = Vec({1, 1, -1, 1})}, "negative");
  ExpectRefusedTiming(*model, {.error = 0.01, .rate_bound = Vec({1, 1, std::nan(""), 1})}, "rate bound");
}

TEST(StepOffsets, NeedToKnowHowEachStateMovesWithTime) {
  const auto model = Cart();
  EXPECT_NO_THROW(StepOffsets(*model, {}));
  ExpectRefusedTiming(*model, {.error = 0.01}, "how v moves with time");
  EXPECT_NO_THROW(StepOffsets(*model, {.error = 0.01, .set_at_steps = {1}}));
  EXPECT_NO_THROW(StepOffsets(*model, {.error = 0.01, .rate_bound = Vec({kInfinity, 3})}));
}

StepTiming Off() { return {.error = 0.01}; }

std::shared_ptr<const NominalModel> Equation(const std::string& of_x, Integrator integrator = Integrator::kNone) {
  return MakeTextModel(TextModel({{"x", of_x}, {"v", integrator == Integrator::kNone ? "v + dt*u" : "u"}}, {"u"},
                                 {{"dt", 0.125, 0.125}, {"c", 0.5, 0.5}}, {}, integrator));
}

// A number that was identified for steps of dt says nothing of others, whatever stands beside it.
TEST(StepOffsets, AreRefusedWhereANumberHoldsForOneDurationOnly) {
  for (const char* baked : {"c*x + dt*u", "c*x + (dt - dt)", "c*x + 1e-300*dt", "x + dt*((c - 1)*x/dt)",
                            "x + c*v + dt*u", "x + dt*log(dt)*v", "x + dt*v/(v*dt)"})
    ExpectRefusedTiming(*Equation(baked), Off(), "do not leave it as it is");
  for (const char* said : {"x + dt*v", "v*dt + (x - dt*c*sin(x))", "x + dt*(v + dt/2*u)", "x + dt*(v + dt*dt*u/c)",
                           "x + v*c*(1 - exp(-dt/c))", "x + v/(2 + c)*(sin(x + v*dt) - sin(x))", "x + dt*dt/dt*v",
                           "x + dt*cos(x + dt*v)", "(x + dt*v)*exp(-dt*c)"})
    EXPECT_NO_THROW(StepOffsets(*Equation(said), Off())) << said;
  for (const Integrator integrator : {Integrator::kEuler, Integrator::kMidpoint, Integrator::kRk4}) {
    EXPECT_NO_THROW(StepOffsets(*Equation("tan(x)/(1 + v^2)", integrator), Off()));
    EXPECT_NO_THROW(StepOffsets(*Equation("v + dt/2*u", integrator), Off()));
    ExpectRefusedTiming(*Equation("(c - 1)*x/dt", integrator), Off(), "do not leave it as it is");
  }
  EXPECT_NO_THROW(StepOffsets(*Equation("c*x + dt*u"), {.error = 0.01, .set_at_steps = {0}}));
  EXPECT_NO_THROW(StepOffsets(*Equation("c*x + dt*u"), {.error = 0.01, .rate_bound = Vec({3, kInfinity})}));
}

// x' = v, v' = u = 10 in steps of 1/10 s by Euler: half of u h^2 is the residual of x, which in steps of 0.149 s is
// 2.2 times that of dt, and in proportion would be 1.5 times it.
TEST(StepOffsets, CoverAResidualThatGrowsAsTheIntegratorsErrorDoes) {
  const auto reach = [](Integrator integrator) {
    const auto model = MakeTextModel(TextModel({{"x", "v"}, {"v", "u"}}, {"u"}, {{"dt", 0.1, 0.1}}, {}, integrator));
    Problem problem = WorldOf(model, Within(Vec({5, 20})), Within(Vec({10})));
    problem.projection = Eigen::MatrixXd::Identity(1, 2);
    problem.declaration.lipschitz(0, 2) = 0.005;
    problem.transitions = {Eigen::MatrixXd::Zero(1, 3), Eigen::MatrixXd::Zero(1, 2)};
    problem.transitions.z(0, 2) = 10;
    problem.transitions.x_next.row(0) << (integrator == Integrator::kEuler ? 0.05 : 0.1), 1;
    problem.timing.error = 0.049;
    const Certifier certifier(std::make_shared<Problem>(problem));
    const Eigen::MatrixXd controls = Eigen::MatrixXd::Constant(1, 2, 10);
    Tube tube;
    EXPECT_EQ(
        certifier.Certify({controls.data(), 1, 2, 1}, Zonotope::FromBox(Vec({0, 0}), Vec({0, 0})), {}, tube).outcome,
        Outcome::kCertified);
    return std::pair(tube.hull(1, 0), tube.hull(2, 0));
  };
  const auto [first, second] = reach(Integrator::kEuler);
  EXPECT_GE(first.upper, 5 * 0.149 * 0.149);
  EXPECT_LE(first.upper, 5 * 0.149 * 0.149 + 1e-9);
  EXPECT_LE(first.lower, 5 * 0.051 * 0.051);
  EXPECT_GE(second.upper, 5 * 0.249 * 0.249);
  // Of a midpoint step, exact up to u h^2 / 2 = 0.05, the residual is 0.05 here: it may grow with the third power.
  const double nominal = 5 * 0.149 * 0.149, residual = 0.05 * std::pow(1.49, 3);
  EXPECT_GE(reach(Integrator::kMidpoint).first.upper, nominal + residual);
  EXPECT_GE(reach(Integrator::kRk4).first.upper, nominal + 0.05 * std::pow(1.49, 5));
}

// x+ = x + u / 8, and u may be off by 1/2.
Problem Driven(const Eigen::VectorXd& input_error) {
  Problem problem = WorldOf(MakeTextModel(TextModel({{"x", "x + dt*u"}}, {"u"}, {{"dt", 0.125, 0.125}})),
                            Within(Vec({5})), Within(Vec({2})));
  problem.projection = Eigen::MatrixXd::Identity(1, 1);
  problem.transitions = {Eigen::MatrixXd::Zero(1, 2), Eigen::MatrixXd::Zero(1, 1)};
  problem.declaration.given_are_exact = true;
  problem.declaration.input_error = input_error;
  return problem;
}

struct Driving {
  Decision decision;
  Interval reached;
};

Driving Drive(const Problem& problem, double u, double half_width = 0) {
  const Certifier certifier(std::make_shared<Problem>(problem));
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Constant(1, 8, u);
  Tube tube;
  const Decision decision =
      certifier.Certify({controls.data(), 1, 8, 1}, Zonotope::FromBox(Vec({0}), Vec({half_width})), {}, tube);
  return {decision, tube.hull(tube.length(), 0)};
}

TEST(ActedInputs, ThatAreOffThePlansMoveTheRobotInEveryStep) {
  const auto [decision, reached] = Drive(Driven(Vec({0.5})), 1);
  EXPECT_EQ(decision.outcome, Outcome::kCertified);
  EXPECT_GE(reached.upper, 1.5);
  EXPECT_LE(reached.upper, 1.5 + 1e-12);
  EXPECT_LE(reached.lower, 0.5);
  EXPECT_GE(reached.lower, 0.5 - 1e-12);
  Problem sloped = Driven(Vec({0.5}));
  sloped.declaration.lipschitz(0, 1) = 0.25;  // of the residual at u = 1, and once more for the error
  EXPECT_GE(Drive(sloped, 1).reached.upper, 1.5 + 8 * 0.25 * 1.5);
  EXPECT_LE(Drive(sloped, 1).reached.upper, 1.5 + 8 * 0.25 * 1.5 + 1e-11);
}

// In steps that are off their times the last end may be off by E at the highest speed that acts, and each step's error
// of the input by 2 E more.
TEST(ActedInputs, ThatAreOffCountInStepsThatAreOffTheirTimes) {
  Problem problem = Driven(Vec({0.5}));
  problem.timing.error = 0x1p-6;
  const double upper = Drive(problem, 1).reached.upper;
  EXPECT_GE(upper, 1.5 * (1 + 0x1p-6));
  EXPECT_LE(upper, 1.5 + 0x1p-6 + 8 * 2 * 0x1p-6 * 0.5 + 1e-12);
}

TEST(ActedInputs, LieInTheDomainWithTheirErrors) {
  const Problem problem = Driven(Vec({0.5}));
  for (const double sign : {1.0, -1.0}) {
    EXPECT_EQ(Drive(problem, sign * 1.5).decision.outcome, Outcome::kCertified) << "exactly at the edge";
    EXPECT_FIELDS(Drive(problem, sign * std::nextafter(1.5, 2)).decision, (outcome, Outcome::kDomain), (coordinate, 1));
  }
  Problem cut = problem;
  cut.domain.inequalities.push_back({Vec({0, 1}), 1.25});
  EXPECT_EQ(Drive(cut, 0.75).decision.outcome, Outcome::kCertified);
  EXPECT_EQ(Drive(cut, std::nextafter(0.75, 1)).decision.outcome, Outcome::kDomain);
}

TEST(ActedInputs, KeepLimitsWithTheirErrors) {
  Problem problem = Driven(Vec({0.5}));
  problem.limits = {{"speed", {"2*u", 1, 1}, -kInfinity, 3}};
  EXPECT_EQ(Drive(problem, 1).decision.outcome, Outcome::kCertified);
  EXPECT_EQ(Drive(problem, 1 + 0x1p-50).decision.cause, Cause::kLimit);
}

TEST(ActedInputs, WithoutErrorsChangeNoBit) {
  const Driving exact = Drive(Driven({}), 1, 0.1), zeros = Drive(Driven(Vec({0})), 1, 0.1);
  EXPECT_FIELDS(exact.reached, (lower, zeros.reached.lower), (upper, zeros.reached.upper));
  EXPECT_NE(Drive(Driven(Vec({0x1p-40})), 1, 0.1).reached.upper, exact.reached.upper);
}

// x+ = x + u^2 where |u| may be 1 + 1/2: the slope counts at its largest, and where it has no bound nothing is said.
TEST(ActedInputs, CountByTheLargestSlopeAmongThem) {
  const auto one_step = [](const char* equation, double u) {
    Problem problem = Driven(Vec({0.5}));
    problem.model = MakeTextModel(TextModel({{"x", equation}}, {"u"}, {{"dt", 0.125, 0.125}}));
    const Certifier certifier(std::make_shared<Problem>(problem));
    Tube tube;
    const Decision decision = certifier.Certify({&u, 1, 1, 1}, Zonotope::FromBox(Vec({0}), Vec({0})), {}, tube);
    return Driving{decision, tube.hull(tube.length(), 0)};
  };
  const Driving squared = one_step("x + u^2", 1);
  EXPECT_GE(squared.reached.upper, 1 + 3 * 0.5);
  EXPECT_LE(squared.reached.upper, 1 + 3 * 0.5 + 1e-12);
  const double absolute = one_step("x + abs(u)", 0).reached.upper;
  EXPECT_GE(absolute, 0.5);
  EXPECT_LE(absolute, 0.5 + 1e-12);
  EXPECT_EQ(one_step("x + sqrt(u + 1)", -0.5).decision.cause, Cause::kNoFiniteEnclosure);
}

// A cart at 2 m/s: its position is off by 2 m/s times the last offset, however many steps there were, and v only by
// what is declared of its rate, which does add up.
TEST(StepOffsets, AddUpOnlyWhereNothingSaysHowTheyAreRelated) {
  Problem problem = WorldOf(Cart(), Within(Vec({99, 9})), Within(Vec({1})));
  problem.projection = Eigen::MatrixXd::Identity(1, 2);
  problem.transitions = {Eigen::MatrixXd::Zero(1, 3), Eigen::MatrixXd::Zero(1, 2)};
  problem.timing = {.error = 0x1p-6, .set_at_steps = {1}};
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(1, 8);
  const Plan plan{controls.data(), 1, 8, 1};
  const Zonotope start = Zonotope::FromBox(Vec({0, 2}), Vec({0, 0}));
  const auto half_width = [&](int t, int k) {
    const Certifier certifier(std::make_shared<Problem>(problem));
    Tube tube;
    const Decision decision = certifier.Certify(plan, start, {}, tube);
    EXPECT_EQ(decision.outcome, Outcome::kCertified);
    EXPECT_THAT(Explain(decision, problem), EndsWith("; steps up to 0.015625 s off their times"));
    return tube.half_width(t)[ToSize(k)];
  };
  EXPECT_EQ(half_width(0, 0), 0);
  for (const int t : {1, 2, 8}) {
    EXPECT_NEAR(half_width(t, 0), 2 * 0x1p-6, 1e-11) << t;
    EXPECT_NEAR(half_width(t, 1), 0, 1e-11) << t;
  }
  problem.timing = {.error = 0x1p-6, .rate_bound = Vec({2, 0})};
  for (const int t : {1, 2, 8}) EXPECT_NEAR(half_width(t, 0), (2 * t - 1) * 2 * 0x1p-6, 1e-11) << t;
}

// v' = u from 0 to 1: v after two steps is what the second one lasted, whose ends are both off; x then is that of v =
// 0.
TEST(StepOffsets, CountHowTheRateChangesFromStepToStep) {
  Problem problem = WorldOf(Equation("v", Integrator::kEuler), Within(Vec({9, 9})), Within(Vec({1})));
  problem.projection = Eigen::MatrixXd::Identity(1, 2);
  problem.transitions = {Eigen::MatrixXd::Zero(1, 3), Eigen::MatrixXd::Zero(1, 2)};
  problem.timing.error = 0x1p-6;
  const Certifier certifier(std::make_shared<Problem>(problem));
  const Eigen::MatrixXd controls = Eigen::RowVector3d(0, 1, 1);
  Tube tube;
  ASSERT_EQ(
      certifier.Certify({controls.data(), 1, 3, 1}, Zonotope::FromBox(Vec({0, 0}), Vec({0, 0})), {}, tube).outcome,
      Outcome::kCertified);
  EXPECT_NEAR(tube.half_width(1)[1], 0, 1e-11);
  for (const int t : {2, 3}) {
    const Interval v = tube.hull(t, 1);
    EXPECT_GE(v.upper, (t - 1) * 0.125 + 2 * 0x1p-6) << t;
    EXPECT_LE(v.upper, (t - 1) * 0.125 + 2 * 0x1p-6 + 1e-11) << t;
    EXPECT_LE(v.lower, (t - 1) * 0.125 - 2 * 0x1p-6) << t;
  }
  EXPECT_NEAR(tube.half_width(2)[0], 0, 1e-11);
}

// Where a declaration is false, a motion leaves the slice, and the guard sees that: x is off by a residual of 1/16 at
// dt that grows with the square of the duration, and no faster; software sets v, and time does not move it on.
TEST(StepOffsets, WhatMovesFasterThanDeclaredLeavesTheSlice) {
  Problem problem = WorldOf(Cart(), Within(Vec({99, 9})), Within(Vec({1})));
  problem.projection = Eigen::MatrixXd::Identity(1, 2);
  problem.transitions = {Eigen::MatrixXd::Zero(1, 3), Vec({0.0625, 0}).transpose()};
  problem.timing = {.error = 0x1p-6, .set_at_steps = {1}};  // an eighth of a step
  const Certifier certifier(std::make_shared<Problem>(problem));
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Ones(1, 1);
  Tube tube;
  ASSERT_EQ(
      certifier.Certify({controls.data(), 1, 1, 1}, Zonotope::FromBox(Vec({0, 2}), Vec({0, 0})), {}, tube).outcome,
      Outcome::kCertified);
  const double square = 0.0625 * 1.125 * 1.125;
  EXPECT_TRUE(tube.hull(1, 0).Contains(2 * (0.125 + 0x1p-6) + square));
  EXPECT_FALSE(tube.hull(1, 0).Contains(2 * (0.125 + 0x1p-6) + square + 0x1p-40));
  EXPECT_TRUE(tube.hull(1, 1).Contains(3));
  EXPECT_FALSE(tube.hull(1, 1).Contains(3 + 0x1p-40));
  EXPECT_FALSE(tube.hull(1, 1).Contains(2 + 1.125)) << "u, for a longer step";
}

// 16 states, the highest order, and the column of the offset: the most columns that a step can have.
TEST(StepOffsets, TheLargestSetsHaveRoom) {
  std::vector<std::pair<std::string, std::string>> states;
  for (int k = 0; k < kMaxStates; ++k)
    states.push_back(
        {"x" + std::to_string(k), "x" + std::to_string(k) + " + dt*x" + std::to_string((k + 1) % 16) + "*x0"});
  Problem problem = WorldOf(MakeTextModel(TextModel(states, {"u"}, {{"dt", 0.125, 0.125}})),
                            Within(Eigen::VectorXd::Constant(16, 99)), Within(Vec({1})));
  problem.projection = Eigen::MatrixXd::Identity(2, 16);
  problem.transitions = {Eigen::MatrixXd::Zero(1, 17), Eigen::MatrixXd::Zero(1, 16)};
  problem.declaration.noise_bound.setConstant(1e-3);
  problem.timing.error = 0.01;
  const Certifier certifier(std::make_shared<Problem>(problem));
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(1, 4);
  Tube tube;
  const Zonotope start(Eigen::VectorXd::Ones(16), 0.001 * Eigen::MatrixXd::Random(16, 80));
  ASSERT_EQ(certifier.Certify({controls.data(), 1, 4, 1}, start, {}, tube).outcome, Outcome::kCertified);
  for (int t = 1; t <= 4; ++t) EXPECT_EQ(tube.slice(t).num_generators(), 81) << t;
}

}  // namespace forereach::step_offsets_test
