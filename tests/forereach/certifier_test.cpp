// Algorithm 1: each outcome with every field of its witness, the order of the tests, closed boundaries, and what a
// certifier refuses to be made of.
#include "forereach/certify/certifier.h"

#include "tests/test.h"

#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/certify/way_clear.h"
#include "forereach/dynamics/text_model.h"
#include "tests/oracle/random.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::certifier_test {

const double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kPx = 0, kVx = 2, kVy = 3, kAx = 4;
constexpr int kTheta = 2, kV = 3, kDelta = 5, kJerk = 6;

static_assert(noexcept(std::declval<const Certifier&>().Certify({}, std::declval<const Zonotope&>(), {},
                                                                std::declval<Tube&>())));
static_assert(noexcept(std::declval<const Propagator&>().Step(std::declval<const Zonotope&>(), {},
                                                              std::declval<StepRecord&>(), std::declval<Zonotope&>(),
                                                              nullptr)));

// A successor as the nominal model gives it: the residual is zero.
void AddNominalTransition(Problem& problem, const Eigen::VectorXd& z) {
  Transitions& data = problem.transitions;
  const int n = problem.model->num_states();
  data.z.conservativeResize(data.z.rows() + 1, z.size());
  data.x_next.conservativeResize(data.x_next.rows() + 1, n);
  data.z.bottomRows(1) = z.transpose();
  Eigen::VectorXd next(n);
  problem.model->Evaluate(View(z), {next.data(), static_cast<std::size_t>(n)});
  data.x_next.bottomRows(1) = next.transpose();
}

Problem BicycleProblem() { return PaperBicycle(3.2, 2); }

Zonotope PointSet(const Eigen::VectorXd& x) { return Zonotope(x, Eigen::MatrixXd(x.size(), 0)); }

class Judge {
 public:
  explicit Judge(const Problem& problem) : certifier_(std::make_shared<Problem>(problem)) {}

  Decision operator()(const Zonotope& initial_set, const Eigen::MatrixXd& controls,
                      const std::vector<Obstacle>& obstacles) {
    const Plan plan{controls.data(), static_cast<int>(controls.rows()), static_cast<int>(controls.cols()),
                    static_cast<int>(controls.rows())};
    certifier_.Require(plan, initial_set, obstacles);
    return certifier_.Certify(plan, initial_set, obstacles, tube_);
  }

  const Certifier& certifier() const { return certifier_; }
  const Tube& tube() const { return tube_; }

 private:
  Certifier certifier_;
  Tube tube_;
};

Eigen::MatrixXd Coast(int steps) { return Eigen::MatrixXd::Zero(2, steps); }

void ExpectNoWitness(const Decision& d, bool coordinate, bool pair, bool obstacle) {
  EXPECT_TRUE(coordinate || d.coordinate == -1);
  EXPECT_TRUE(pair || (d.first_observation == -1 && d.second_observation == -1));
  EXPECT_TRUE(obstacle || d.obstacle == -1);
}

TEST(Certificate, NamesTheClosestObstacleAndStep) {
  Judge judge(PointMassInHalves());
  const std::vector<Obstacle> obstacles{Obstacle::Circle(Vec({0, 9}), 1), Obstacle::Circle(Vec({2, 3}), 1),
                                        Obstacle::HalfSpace(Vec({1, 0}), 50)};
  const Decision d = judge(PointSet(Vec({0, 0, 2, 0})), Coast(4), obstacles);  // 1 m a step along x
  EXPECT_FIELDS(d, (outcome, Outcome::kCertified), (cause, Cause::kNone), (step, -1), (obstacle, 1), (closest_step, 2));
  EXPECT_NEAR(d.margin, 3, 1e-12);
  EXPECT_EQ(d.threshold, 1);
  ExpectNoWitness(d, false, false, true);
  EXPECT_FIELDS(judge, (tube().length(), 4), (certifier().problem().zonotope_order, 5));
  // The sentence claims no more than is proven: enclosures round outwards, and so does the text.
  EXPECT_LT(d.margin - d.threshold, 2);
  EXPECT_THAT(Explain(d, judge.certifier().problem()), HasSubstr("closest at step 2, 1.99999 m from obstacle 1"));
}

TEST(Certificate, CallsAnObstacleByItsName) {
  Judge judge(PointMassInHalves());
  for (const bool is_hit : {false, true}) {
    const Obstacle oak = Obstacle::Circle(Vec({2, is_hit ? 1.0 : 3.0}), 1);
    const std::vector<Obstacle> plain{oak}, named{oak.Named("oak_2")}, outside{oak.Named("outside:lawn")};
    const Decision d = judge(PointSet(Vec({0, 0, 2, 0})), Coast(4), named);
    const Problem& problem = judge.certifier().problem();
    EXPECT_THAT(Explain(d, problem, named), HasSubstr(is_hit ? "may touch oak_2 (by" : " m from oak_2"));
    EXPECT_THAT(Explain(d, problem, plain), HasSubstr(is_hit ? "may touch obstacle 0 (by" : " m from obstacle 0"));
    EXPECT_THAT(Explain(d, problem, outside), HasSubstr(is_hit ? "may leave lawn (by" : " m from outside:lawn"));
    EXPECT_EQ(ObstacleNamedIn(Explain(d, problem, named)), "oak_2");
    EXPECT_EQ(ObstacleNamedIn(Explain(d, problem, plain)), "");
    EXPECT_EQ(ObstacleNamedIn(Explain(d, problem, outside)), "outside:lawn");
    EXPECT_EQ(Explain(d, problem), Explain(d, problem, plain)) << "without obstacles there are only numbers";
  }
}

TEST(ObstacleNames, AreFoundInTheSentence) {
  for (const std::string touched :
       {"map", "cell (6, 0) of map", "cells (6, 0) to (6, 5) of map", "what is beyond of map"})
    EXPECT_EQ(ObstacleNamedIn("abstain S: at step 3 the robot may touch " + touched + " (by 0.1 m)"), "map") << touched;
  EXPECT_EQ(ObstacleNamedIn("abstain S: at step 3 part 1 may touch cell (by 0.1 m); of 3 trials"), "cell");
  EXPECT_EQ(ObstacleNamedIn("abstain S: at step 3 the robot may touch cell (6, 0) of obstacle 2 (by 0.1 m)"), "");
}

TEST(ObstacleNames, CannotBreakALogLineAPageOrATerminal) {
  const Obstacle any = Obstacle::Circle(Vec({0, 0}), 1);
  const std::string longest(kMaxObstacleName, 'x');
  for (const std::string& good : {std::string("a"), std::string("Oak-2"), std::string("row_3/tree:7.b"), longest}) {
    EXPECT_EQ(WhyNoName(good), "");
    EXPECT_EQ(any.Named(good).name(), good);
  }
  EXPECT_NE(WhyNoName(""), "");
  EXPECT_EQ(any.Named("oak").Named("").name(), "") << "no name";
  for (const std::string& bad :
       {std::string("6"), std::string("_a"), std::string("a b"), std::string("a\nb"), std::string("a\x1b[2J"),
        std::string("a\0b", 3), std::string("a<b>"), std::string("a&amp"), std::string("a\"b"), std::string("a'b"),
        std::string("a\xc3\xb6"), std::string("a\x7f"), longest + "x"}) {
    EXPECT_NE(WhyNoName(bad), "") << bad;
    EXPECT_THROW((void)any.Named(bad), std::invalid_argument);
  }
}

TEST(ObstacleNames, StayWithAnObstacleThatMovesOrIsShifted) {
  const Obstacle oak = Obstacle::Circle(Vec({0, 0}), 1).Named("oak");
  EXPECT_EQ(oak.Moving({}).name(), "oak");
  EXPECT_EQ(Shifted(oak.Moving({}), Vec({1, 0})).name(), "oak");
  const std::vector<Obstacle> all{oak, Obstacle::HalfSpace(Vec({1, 0}), 1)};
  EXPECT_EQ(NameOf(all, 0), "oak");
  EXPECT_EQ(NameOf(all, 1), "obstacle 1");
  for (const int none : {-1, 2, 32767}) EXPECT_EQ(NameOf(all, none), "obstacle " + std::to_string(none));
}

TEST(Certificate, WithoutObstaclesHasNoMargin) {
  Judge judge(PointMassInHalves());
  const Decision d = judge(PointSet(Vec({0, 0, 2, 0})), Coast(1), {});
  EXPECT_FIELDS(d, (outcome, Outcome::kCertified), (obstacle, -1), (margin, kInfinity));
}

TEST(AbstainSafety, NamesTheStepAtTheStartTheMiddleAndTheEnd) {
  for (const int step : {0, 3, 6}) {
    Judge judge(PointMassInHalves());
    const Decision d = judge(PointSet(Vec({0, 0, 2, 0})), Coast(6),
                             {Obstacle::Circle(Vec({0, 50}), 1), Obstacle::Circle(Vec({1.0 * step, 1}), 1.25)});
    EXPECT_FIELDS(d, (outcome, Outcome::kSafety), (cause, Cause::kObstacle));
    // Within 0.75 m along x the circle is met; one step is 1 m.
    EXPECT_FIELDS(d, (step, step), (obstacle, 1), (threshold, 1.25));
    EXPECT_NEAR(d.margin, 1, 1e-12);
    ExpectNoWitness(d, false, false, true);
    EXPECT_EQ(judge.tube().length(), 6) << "safety is judged after the horizon";
    EXPECT_THAT(Explain(d, judge.certifier().problem()), HasSubstr("abstain S: at step " + std::to_string(step)));
  }
}

TEST(AbstainSafety, AbstainsWhereTheStartTouchesAnObstacle) {
  Judge judge(PointMassInHalves());
  const Zonotope start = Zonotope::FromBox(Vec({0, 0, 2, 0}), Vec({1, 1, 0, 0}));
  const auto at = [&](double left) {
    return judge(start, Coast(1), {Obstacle::AxisBox(Vec({-9, left}), Vec({9, 9}))});
  };
  EXPECT_FIELDS(at(1), (outcome, Outcome::kSafety), (step, 0));
  EXPECT_EQ(at(1 + 1e-12).outcome, Outcome::kCertified);
  EXPECT_EQ(judge(PointSet(Vec({0, 0, 2, 0})), Coast(1), {Obstacle::Circle(Vec({0, 1}), 1)}).outcome, Outcome::kSafety);
}

TEST(AbstainDomain, NamesTheBoundOfEveryKind) {
  using Kind = DomainExit::Kind;
  Problem problem = PointMassInHalves();
  problem.domain.inequalities.push_back({Vec({1, 1, 0, 0, 0, 0}), 50});
  problem.domain.balls.push_back({{kVx, kVy}, Vec({0, 0}), 5});
  Judge judge(problem);
  const auto expect = [&](const Decision& d, int step, Kind kind, int index, double value, double bound) {
    EXPECT_FIELDS(d, (outcome, Outcome::kDomain), (cause, Cause::kDomainExit), (step, step), (exit.kind, kind),
                  (exit.index, index), (coordinate, index));
    EXPECT_NEAR(d.exit.value, value, 1e-12);
    EXPECT_FIELDS(d, (exit.bound, bound), (margin, d.exit.value), (threshold, bound));
    ExpectNoWitness(d, true, false, false);
    EXPECT_EQ(judge.tube().length(), step);
    EXPECT_THAT(Explain(d, judge.certifier().problem()), HasSubstr("abstain D: at step " + std::to_string(step)));
  };
  const Eigen::MatrixXd push = Eigen::Vector2d(2, 0).replicate(1, 4), pull = Eigen::Vector2d(-2, 0).replicate(1, 4);
  expect(judge(PointSet(Vec({0, 0, 2.5, 0})), push, {}), 2, Kind::kUpper, kVx, 4.5, 4);
  expect(judge(PointSet(Vec({0, 0, -2.5, 0})), pull, {}), 2, Kind::kLower, kVx, -4.5, -4);
  expect(judge(PointSet(Vec({-100.5, 0, 0, 0})), push, {}), 0, Kind::kLower, kPx, -100.5, -100);
  expect(judge(PointSet(Vec({30, 19, 3, 0})), Coast(3), {}), 1, Kind::kInequality, 0, 50.5, 50);
  expect(judge(PointSet(Vec({0, 0, 4, 3.5})), Coast(3), {}), 0, Kind::kBall, 0, std::sqrt(28.25), 5);
  Eigen::MatrixXd late = Coast(3);
  late(0, 2) = 2.5;
  expect(judge(PointSet(Vec({0, 0, 0, 0})), late, {}), 2, Kind::kUpper, kAx, 2.5, 2);
  late(0, 2) = -2.5;
  expect(judge(PointSet(Vec({0, 0, 0, 0})), late, {}), 2, Kind::kLower, kAx, -2.5, -2);
}

TEST(AbstainDomain, BoundsAreClosed) {
  Problem problem = PointMassInHalves();
  problem.domain.inequalities.push_back({Vec({1, 0, 1, 0, 0, 0}), 8});
  problem.domain.balls.push_back({{kVx, kVy}, Vec({0, 0}), 5});
  Judge judge(problem);
  const auto outcome = [&](double px, double vx, double vy, double ax) {
    Eigen::MatrixXd controls = Coast(1);
    controls(0, 0) = ax;
    return judge(PointSet(Vec({px, 0, vx, vy})), controls, {}).outcome;
  };
  EXPECT_EQ(outcome(0, 0, 0, 2), Outcome::kCertified) << "an input on its bound";
  EXPECT_EQ(outcome(0, 0, 0, NextUp(2)), Outcome::kDomain);
  EXPECT_EQ(outcome(0, 0, 0, NextDown(-2)), Outcome::kDomain);
  EXPECT_EQ(outcome(-100, 0, 4, 0), Outcome::kCertified) << "a state on its bounds";
  EXPECT_EQ(outcome(NextDown(-100), 0, 0, 0), Outcome::kDomain);
  EXPECT_EQ(outcome(0, 0, NextUp(4), 0), Outcome::kDomain);
  EXPECT_EQ(outcome(5, 3, 4, 0), Outcome::kCertified) << "on the inequality and on the ball";
  EXPECT_EQ(outcome(NextUp(5), 3, 4, 0), Outcome::kDomain);
  EXPECT_EQ(outcome(0, NextUp(3), 4, 0), Outcome::kDomain);
}

TEST(AbstainDomain, TheLastSliceMayLieOutside) {
  Judge judge(PointMassInHalves());
  EXPECT_EQ(judge(PointSet(Vec({99.5, 0, 2, 0})), Coast(1), {}).outcome, Outcome::kCertified);
  EXPECT_FIELDS(judge(PointSet(Vec({99.5, 0, 2, 0})), Coast(2), {}), (outcome, Outcome::kDomain), (step, 1));
}

TEST(AbstainDomain, ComesBeforeSafety) {
  Judge judge(PointMassInHalves());
  const Decision d = judge(PointSet(Vec({98, 0, 3.5, 0})), Coast(3), {Obstacle::Circle(Vec({98, 0}), 1)});
  EXPECT_EQ(d.outcome, Outcome::kDomain) << "although the obstacle is touched at step 0";
  EXPECT_FIELDS(d, (step, 2), (obstacle, -1));
}

TEST(AbstainDomain, NamesThePoleOfTheSteeringAsItsCause) {
  Judge judge(BicycleProblem());
  const Decision d = judge(Zonotope::FromBox(Vec({0, 0, 0, 5, 0, 1.5}), Vec({0, 0, 0, 0, 0, 0.1})), Coast(2), {});
  EXPECT_FIELDS(d, (outcome, Outcome::kDomain), (cause, Cause::kNoFiniteEnclosure), (step, 0), (coordinate, kTheta),
                (exit.kind, DomainExit::Kind::kNone));
  ExpectNoWitness(d, true, false, false);
  EXPECT_THAT(Explain(d, judge.certifier().problem()), HasSubstr("theta has no finite enclosure"));

  Eigen::MatrixXd turn = Coast(3);
  turn.row(1).setConstant(2);  // 0.2 rad a step, from 1.2 over the pole at 1.57
  const Decision later = judge(Zonotope::FromBox(Vec({0, 0, 0, 0.5, 0, 1.2}), Vec({0, 0, 0, 0, 0, 0.1})), turn, {});
  EXPECT_FIELDS(later, (cause, Cause::kNoFiniteEnclosure), (step, 2));
}

TEST(AbstainDomain, AKinkOfATextIsNamedWithItsPlaceAndItsArgument) {
  const Lines equations{{"x", "x + dt*v"}, {"y", "y"}, {"v", "v - dt*v*abs(v) + dt*u"}};
  Problem problem =
      WorldOf(MakeTextModel(TextModel(equations, {"u"}, {{"dt", 0.5, 0.5}})), Within({9, 9, 9}), Within({1}));
  AddNominalTransition(problem, Eigen::VectorXd::Zero(4));
  const auto shared = std::make_shared<Problem>(problem);
  const Certifier certifier(shared);
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Constant(1, 4, -0.5);
  const Plan plan{controls.data(), 1, 4, 1, {}};
  Tube tube;
  const Decision d = certifier.Certify(plan, Zonotope::FromBox(Vec({0, 0, 0.5}), Vec({0, 0, 0.25})), {}, tube);
  EXPECT_EQ(d.cause, Cause::kNoFiniteEnclosure);
  EXPECT_EQ(d.step, 1) << "v is positive at first";
  EXPECT_THAT(
      Explain(d, certifier, {}, plan, tube),
      testing::MatchesRegex("abstain D: at step 1 the next v has no finite enclosure: abs at line 1, column 10 of "
                            "the model has a kink or a pole there; its argument, a function of v, may be "
                            "anywhere in .-0[.][0-9]*, 0[.][0-9]*."));
  EXPECT_EQ(Explain(d, *shared), "abstain D: at step 1 the next v has no finite enclosure");

  const Decision good =
      certifier.Certify({controls.data(), 1, 1, 1, {}}, Zonotope::FromBox(Vec({0, 0, 5}), Vec({0, 0, 1})), {}, tube);
  EXPECT_EQ(Explain(good, certifier, {}, plan, tube), Explain(good, *shared));
}

// A brake that ends at +-0.25 m/s, with the widths and the last bit of the residual around it.
struct NoStop : testing::TestWithParam<double> {
  Decision Brake(double tolerance, const std::vector<Obstacle>& obstacles = {}) {
    Problem problem = PointMassInHalves();
    problem.rest = {{kVy, 1}, {kVx, tolerance}};
    judge_.emplace(problem);
    const double sign = GetParam();
    const Zonotope start = Zonotope::FromBox(Vec({0, 0, 1.25 * sign, 0}), Vec({0, 0, 0.125, 0}));
    return (*judge_)(start, Eigen::MatrixXd(Eigen::Vector2d(-2 * sign, 0)), obstacles);
  }
  // What the last slice reaches, away from zero.
  double Reached() {
    EXPECT_EQ(Brake(3).outcome, Outcome::kCertified);
    const Interval hull = judge_->tube().hull(1, kVx);
    EXPECT_NEAR(std::max(-hull.lower, hull.upper), 0.375, 1e-12);
    return std::max(-hull.lower, hull.upper);
  }

  std::optional<Judge> judge_;
};

TEST_P(NoStop, TheBoundIsClosedToTheLastBit) {
  const double reached = Reached();
  EXPECT_EQ(Brake(reached).outcome, Outcome::kCertified);
  const Decision d = Brake(NextDown(reached));
  EXPECT_FIELDS(d, (outcome, Outcome::kDomain), (cause, Cause::kNoStop));
  EXPECT_EQ(d.step, 1) << "T";
  EXPECT_FIELDS(d, (coordinate, kVx), (margin, GetParam() * reached), (threshold, GetParam() * NextDown(reached)));
  ExpectNoWitness(d, true, false, false);
  EXPECT_EQ(judge_->tube().length(), 1);
  EXPECT_THAT(Explain(d, judge_->certifier().problem()),
              HasSubstr("abstain D: at step 1 the plan ends, and vx reaches "));
  EXPECT_EQ(Brake(0).cause, Cause::kNoStop);
}

TEST_P(NoStop, ComesBeforeSafety) {
  const std::vector<Obstacle> touched{Obstacle::Circle(Vec({0, 0}), 1)};
  EXPECT_EQ(Brake(3, touched).outcome, Outcome::kSafety);
  EXPECT_FIELDS(Brake(0.1, touched), (cause, Cause::kNoStop), (obstacle, -1));
}

INSTANTIATE_TEST_SUITE_P(BothDirections, NoStop, testing::Values(1.0, -1.0));

TEST(AbstainFalsified, NamesThePairBeforeAnythingElse) {
  Problem problem = PointMassInHalves();
  for (const double px : {1.0, 2.0}) AddNominalTransition(problem, Vec({px, 0, 0, 0, 0, 0}));
  problem.declaration.lipschitz(kVy, kPx) = 0.25;
  problem.transitions.x_next(1, kVy) += 0.125;
  problem.transitions.x_next(2, kVy) += 0.5;
  Judge judge(problem);
  const Decision d = judge(PointSet(Vec({1e6, 0, 0, 0})), Coast(2), {Obstacle::Circle(Vec({1e6, 0}), 1)});
  EXPECT_FIELDS(d, (outcome, Outcome::kFalsified), (cause, Cause::kPairwise), (step, -1), (coordinate, kVy),
                (first_observation, 1), (second_observation, 2));
  EXPECT_NEAR(d.margin, 0.375, 1e-12);
  EXPECT_FIELDS(d, (threshold, 0.25), (obstacle, -1));
  EXPECT_EQ(judge.tube().length(), 0);
  ASSERT_TRUE(judge.certifier().violation());
  EXPECT_EQ(judge.certifier().violation()->first, 1);
  EXPECT_LT(d.margin, 0.375);
  EXPECT_THAT(Explain(d, judge.certifier().problem()),
              HasSubstr("abstain F: observations 1 and 2 differ in vy by 0.374999, the declaration allows 0.25"));
}

TEST(Certifier, ConstantResidualMovesTheTube) {
  Problem problem = PointMassInHalves();
  problem.transitions.x_next(0, kVx) += 0.25;
  problem.declaration.noise_bound[kVx] = 0.125;
  Judge judge(problem);
  EXPECT_EQ(judge(PointSet(Vec({0, 0, 1, 0})), Coast(1), {}).outcome, Outcome::kCertified);
  EXPECT_NEAR(judge.tube().slice(1).Hull(kVx).lower, 1.125, 1e-14);
  EXPECT_NEAR(judge.tube().slice(1).Hull(kVx).upper, 1.375, 1e-14);
  EXPECT_LE(judge.tube().slice(1).Hull(kVx).lower, 1.125);
  EXPECT_GE(judge.tube().slice(1).Hull(kVx).upper, 1.375);
  EXPECT_EQ(judge.tube().step(0).remainder.half_width[0], 0) << "an affine model has no remainder";
}

// It widens what an observation says of the residual, and each step anew: each of t steps by twice the bound.
TEST(Certifier, ADisturbanceCountsForTheObservationAndForEachStep) {
  Problem problem = PointMassInHalves();
  problem.transitions.x_next(0, kVx) += 0.25;
  problem.declaration.noise_bound[kVx] = 0.125;
  problem.declaration.disturbance = Vec({0, 0, 0.0625, 0});
  Judge judge(problem);
  EXPECT_EQ(judge(PointSet(Vec({0, 0, 1, 0})), Coast(2), {}).outcome, Outcome::kCertified);
  for (const int t : {1, 2}) {
    const Interval hull = judge.tube().slice(t).Hull(kVx);
    const double middle = 1 + t * 0.25, width = t * (0.125 + 0.0625 + 0.0625);
    EXPECT_NEAR(hull.lower, middle - width, 1e-14);
    EXPECT_NEAR(hull.upper, middle + width, 1e-14);
    EXPECT_LE(hull.lower, middle - width);
    EXPECT_GE(hull.upper, middle + width);
    EXPECT_NEAR(judge.tube().half_width(t)[kVx], width, 1e-14);
  }
  EXPECT_NEAR(judge.tube().step(0).envelope.lower[kVx], 0.25 - 0.1875, 1e-14) << "the residual's, without the step's";
}

// The observation is from vx = 2 +- 0.5, where the bound is at most 0.3125 of the true state, and the steps are from vx
// up to 1 and up to 1.75.
TEST(Certifier, ADisturbanceThatGrowsCountsForTheObservationAndForEachStepWhereTheyAre) {
  Problem problem = PointMassInHalves();
  problem.transitions.z(0, kVx) = problem.transitions.x_next(0, kVx) = 2;
  problem.transitions.x_next(0, 0) = 1;
  problem.declaration.state_error = Vec({0, 0, 0.5, 0});
  problem.declaration.growing = Growing(*problem.model, {"0", "0", "0", "-0.125*vx"});
  Judge judge(problem);
  EXPECT_EQ(judge(Zonotope::FromBox(Vec({0, 0, 0.5, 0}), Vec({0, 0, 0.5, 0})), Coast(2), {}).outcome,
            Outcome::kCertified);
  const double observed = 0.125 * 2.5;
  double width = 0;
  for (const int t : {0, 1}) {
    EXPECT_NEAR(judge.tube().step(t).envelope.upper[3], observed, 1e-14) << "the residual's, without the step's";
    width += observed + 0.125 * judge.tube().slice(t).Hull(kVx).upper;
    const Interval hull = judge.tube().slice(t + 1).Hull(3);
    EXPECT_NEAR(hull.upper, width, 1e-14);
    EXPECT_GE(hull.upper, width);
    EXPECT_LE(hull.lower, -width);
  }
}

TEST(Certifier, WhereAGrowingDisturbanceHasNoBoundThereIsNoSuccessor) {
  Problem problem = PointMassInHalves();
  problem.declaration.growing = Growing(*problem.model, {"0", "0", "1e-3/(vx - 2)", "0"});
  Judge judge(problem);
  EXPECT_EQ(judge(PointSet(Vec({0, 0, 1, 0})), Coast(1), {}).outcome, Outcome::kCertified);
  const Decision decision = judge(PointSet(Vec({0, 0, 2, 0})), Coast(1), {});
  EXPECT_FIELDS(decision, (cause, Cause::kNoFiniteEnclosure), (coordinate, kVx));
  problem.transitions.z(0, kVx) = 2;
  EXPECT_THROW(Judge{problem}, std::invalid_argument) << "such a transition says nothing";
}

TEST(Certifier, RefusesAGrowingDisturbanceOfOtherNamesOrSizes) {
  const Problem problem = PointMassInHalves();
  EXPECT_THROW(Growing(*problem.model, {"0", "0", "wind", "0"}), std::invalid_argument);
  EXPECT_THROW(Growing(*problem.model, {"0", "0", "0"}), std::invalid_argument);
  const auto bicycle = MakeKinematicBicycle(0.1, 2.5, {2});
  EXPECT_NO_THROW(Growing(*bicycle, {"0", "0", "v*sin(theta)", "0", "0", "0"}));
  EXPECT_THROW(Growing(*bicycle, {"0", "0", "v*theta", "0", "0", "0"}), std::invalid_argument) << "an angle";
}

TEST(Certifier, ZerosAreTheSameAsNoDisturbance) {
  Problem problem = PointMassInHalves();
  problem.transitions.x_next(0, kVx) += 0.25;
  problem.declaration.noise_bound[kVx] = 0.1;
  Judge without(problem);
  problem.declaration.disturbance = Vec({0, 0, 0, 0});
  Judge zeros(problem);
  const auto set = PointSet(Vec({0, 0.1, 1, 0.3}));
  static_cast<void>(without(set, Coast(5), {}));
  static_cast<void>(zeros(set, Coast(5), {}));
  for (int t = 0; t <= 5; ++t) {
    EXPECT_EQ(without.tube().slice(t).CenterVector(), zeros.tube().slice(t).CenterVector());
    EXPECT_EQ(without.tube().slice(t).GeneratorMatrix(), zeros.tube().slice(t).GeneratorMatrix());
  }
}

TEST(Certifier, ADisturbanceExplainsDataThatContradictEachOtherWithoutIt) {
  Problem problem = PointMassInHalves();
  problem.transitions = {Eigen::MatrixXd::Zero(2, 6), Eigen::MatrixXd::Zero(2, 4)};
  problem.transitions.x_next(1, kVx) = 0.5;
  EXPECT_TRUE(Judge(problem).certifier().violation());
  problem.declaration.disturbance = Vec({0, 0, 0.25, 0});
  EXPECT_FALSE(Judge(problem).certifier().violation());
  problem.declaration.disturbance[kVx] = 0.25 * (1 - 0x1p-50);
  EXPECT_TRUE(Judge(problem).certifier().violation());
}

// Each observation has the bound of its own place: 0.125 |ax|.
TEST(Certifier, AGrowingDisturbanceExplainsDataAsFarAsItsPlacesAllow) {
  Problem problem = PointMassInHalves();
  problem.transitions = {Eigen::MatrixXd::Zero(2, 6), Eigen::MatrixXd::Zero(2, 4)};
  problem.transitions.z(1, 4) = -1;
  problem.transitions.x_next(1, 0) = -0.125;
  problem.declaration.growing = Growing(*problem.model, {"0", "0", "0.125*abs(ax)", "0"});
  for (const double beyond : {-0x1p-40, 0x1p-40}) {
    problem.transitions.x_next(1, kVx) = -0.5 - 0.125 - beyond;
    EXPECT_EQ(Judge(problem).certifier().violation().has_value(), beyond > 0);
  }
}

// s+ = s + r(v), r changes by at most 0.5 for a change of 1 in v, and v was recorded as 1.1 +- 0.1 when s went from 0
// to 0.5, which is exact. So r(1.1) is at most 0.5 + 0.5 * 0.1, and a robot that starts with exactly v = 1.1 gets to
// 0.55.
Problem RecordedOnce(double error) {
  const ModelText text = TextModel({{"s", "s"}, {"y", "y"}, {"v", "v"}}, {"a"}, {{"dt", 0.1, 0.1}});
  Problem problem = WorldOf(MakeTextModel(text), Box(Vec({-10, -10, -3}), Vec({50, 10, 3})), Within({5}));
  problem.method = Method::kPaper;
  problem.declaration.lipschitz(0, 2) = 0.5;
  problem.declaration.noise_bound[2] = 0.2;
  problem.declaration.state_error = Vec({0, 0, error});
  problem.transitions = {Vec({0, 0, 1.1, 0}).transpose(), Vec({0.5, 0, 1.1}).transpose()};
  return problem;
}

TEST(Certifier, AnErrorOfTheRecordedPlaceCountsByTheSlopeOfTheResidual) {
  Judge exact(RecordedOnce(0)), inexact(RecordedOnce(0.1));
  const auto at_wall = [](Judge& judge, double s) {
    return judge(PointSet(Vec({0, 0, 1.1})), Eigen::MatrixXd::Zero(1, 1), {Obstacle::HalfSpace(Vec({1, 0}), s)})
        .outcome;
  };
  constexpr double kHair = 1e-13;
  EXPECT_EQ(at_wall(exact, 0.52), Outcome::kCertified);
  EXPECT_EQ(at_wall(exact, 0.5 + kHair), Outcome::kCertified);
  EXPECT_EQ(at_wall(inexact, 0.52), Outcome::kSafety);
  EXPECT_EQ(at_wall(inexact, 0.55 - kHair), Outcome::kSafety);
  EXPECT_EQ(at_wall(inexact, 0.55 + kHair), Outcome::kCertified);
}

TEST(Certifier, AnErrorOfTheRecordExplainsDataThatContradictEachOtherWithoutIt) {
  Problem problem = PointMassInHalves();
  problem.transitions = {Eigen::MatrixXd::Zero(2, 6), Eigen::MatrixXd::Zero(2, 4)};
  problem.transitions.x_next(1, kVx) = 0.5;
  EXPECT_TRUE(Judge(problem).certifier().violation());
  problem.declaration.state_error = Vec({0, 0, 0, 0});
  EXPECT_TRUE(Judge(problem).certifier().violation());
  problem.declaration.state_error[kVx] = 0.125;  // of each of two records, before and after the step
  EXPECT_FALSE(Judge(problem).certifier().violation());
  problem.declaration.given_are_exact = true;
  EXPECT_TRUE(Judge(problem).certifier().violation());
  problem.declaration.given_are_exact = false;
  problem.declaration.state_error[kVx] = 0.125 * (1 - 0x1p-50);
  EXPECT_TRUE(Judge(problem).certifier().violation());
  problem.declaration.state_error[kVx] = 0;
  problem.declaration.input_error = Vec({0.5, 0});  // vx+ = vx + ax / 2
  EXPECT_FALSE(Judge(problem).certifier().violation());
  problem.declaration.input_error[0] = 0.5 * (1 - 0x1p-50);
  EXPECT_TRUE(Judge(problem).certifier().violation());
}

TEST(Certifier, RefusesATransitionThatMayLieOutsideTheDomainWithinItsErrors) {
  Problem problem = PointMassInHalves(4);
  problem.declaration.state_error = Vec({0, 0, 0.25, 0});
  const auto at_speed = [&](double v) {
    problem.transitions.z(0, kVx) = v;
    problem.transitions.x_next(0, kVx) = v;
    problem.transitions.x_next(0, kPx) = v / 2;
    return Thrown<std::invalid_argument>([&] { Judge judge(problem); });
  };
  for (const double sign : {1.0, -1.0}) {
    EXPECT_EQ(at_speed(sign * 3.75), "") << "exactly at the edge";
    EXPECT_EQ(at_speed(sign * (3.75 - 0x1p-50)), "");
    EXPECT_EQ(at_speed(sign * (3.75 + 0x1p-50)),
              "transition 0: lies outside the certification domain, or may within the declared errors");
  }
}

TEST(Certifier, UsesTheHullDistanceOnlyAboveTwelveColumns) {
  EXPECT_FALSE(Judge(BicycleProblem()).certifier().uses_hull_distance());
}

// The nominal tube of the design: 12 steps of the bicycle with a residual declared zero, against its known widths.
// The nominal tube of the project's comparison of tools: full widths of x, y and theta after 12 steps.
Eigen::Vector3d ReferenceWidths(Method method) {
  Problem problem = BicycleProblem();
  problem.method = method;
  problem.domain.state = Box(Vec({-40, -40, -3.15, 0, -3, -0.48}), Vec({40, 40, 3.15, 25, 3, 0.48}));
  Judge judge(problem);
  const Zonotope start = Zonotope::FromBox(Vec({0, 0, 0, 10, 0, 0.05}), Vec({0.1, 0.1, 0.02, 0.2, 0.02, 0.005}));
  EXPECT_EQ(judge(start, Eigen::Vector2d(0.5, 0.1).replicate(1, 12), {}).outcome, Outcome::kCertified);
  const auto width = [&](int k) { return judge.tube().slice(12).Hull(k).upper - judge.tube().slice(12).Hull(k).lower; };
  return {width(0), width(1), width(2)};
}

TEST(ReferenceTube, HasTheWidthsOfThePaper) {
  EXPECT_TRUE(ReferenceWidths(Method::kPaper).isApprox(Eigen::Vector3d(0.8492, 1.1410, 0.1117), 1e-4));
}

TEST(ReferenceTube, CentredIsWithinTwoPercentOfTheSampledInnerHull) {
  const Eigen::Vector3d inner(0.8265, 1.1129, 0.11065), width = ReferenceWidths(Method::kCentred);
  for (int k = 0; k < 3; ++k) {
    EXPECT_GE(width[k], inner[k]) << "no sound tube is narrower";
    EXPECT_LE(width[k], 1.02 * inner[k]);
  }
}

// A task with a residual, whose slices reach the largest order.
struct Reproducible : testing::TestWithParam<Method> {
  Reproducible() {
    Problem problem = BicycleProblem();
    problem.method = GetParam();
    problem.declaration.lipschitz(kTheta, kV) = 0.01;
    problem.declaration.lipschitz(kTheta, kDelta) = 0.5;
    for (const double delta : {-0.3, -0.1, 0.1, 0.3}) AddNominalTransition(problem, Vec({0, 0, 0, 8, 0, delta, 0, 0}));
    certifier_.emplace(std::make_shared<Problem>(problem));
  }

  Decision Certify(Tube& tube) const {
    return certifier_->Certify({controls_.data(), 2, 12, 2}, start_, obstacles_, tube);
  }

  static void ExpectSame(const Decision& a, const Tube& tube_a, const Decision& b, const Tube& tube_b) {
    EXPECT_FIELDS(a, (outcome, b.outcome), (margin, b.margin), (closest_step, b.closest_step));
    ASSERT_EQ(tube_a.length(), 12);
    ASSERT_EQ(tube_b.length(), 12);
    for (int t = 0; t <= 12; ++t) {
      EXPECT_EQ(tube_a.slice(t).CenterVector(), tube_b.slice(t).CenterVector());
      EXPECT_EQ(tube_a.slice(t).GeneratorMatrix(), tube_b.slice(t).GeneratorMatrix());
    }
  }

  std::optional<Certifier> certifier_;
  Zonotope start_ = Zonotope::FromBox(Vec({0, 0, 0, 8, 0, 0.05}), Vec({0.1, 0.1, 0.02, 0.2, 0.02, 0.005}));
  Eigen::MatrixXd controls_ = Eigen::Vector2d(0.5, 0.1).replicate(1, 12);
  std::vector<Obstacle> obstacles_{Obstacle::Circle(Vec({6, 6}), 1)};
};

TEST_P(Reproducible, BitForBitOnEveryThread) {
  std::vector<Tube> tubes(4);
  std::vector<Decision> decisions(4);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      for (int repeat = 0; repeat < 50; ++repeat) decisions[i] = Certify(tubes[i]);
    });
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 1; i < 4; ++i) ExpectSame(decisions[i], tubes[i], decisions[0], tubes[0]);
}

TEST_P(Reproducible, BitForBitOnEveryInstructionSet) {
  Tube tube;
  const Decision decision = Certify(tube);
  for (const InstructionSet instructions :
       {InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
    if (!IsSupported(instructions)) continue;
    Problem problem = certifier_->problem();
    problem.instructions = instructions;
    certifier_.emplace(std::make_shared<Problem>(problem));
    Tube other;
    const Decision again = Certify(other);
    ExpectSame(decision, tube, again, other);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, Reproducible, testing::Values(Method::kPaper, Method::kCentred),
                         [](const auto& test) { return test.param == Method::kPaper ? "paper" : "centred"; });

void ExpectRefused(const Problem& problem, const std::string& part) {
  EXPECT_THAT([&] { Certifier certifier(std::make_shared<Problem>(problem)); },
              ThrowsMessage<std::invalid_argument>(HasSubstr(part)));
}

template <class Spoil>
void ExpectRefused(Spoil spoil, const std::string& part) {
  Problem problem = PointMassInHalves();
  spoil(problem);
  ExpectRefused(problem, part);
}

TEST(Certifier, RefusesAProblemAndNamesThePartThatDoesNotFit) {
  EXPECT_THROW(Certifier(nullptr), std::invalid_argument);
  ExpectRefused([](Problem& p) { p.model = nullptr; }, "model");
  ExpectRefused([](Problem& p) { p.domain.state = Box(); }, "domain: state box");
  ExpectRefused([](Problem& p) { p.domain.input = Box(); }, "domain: input box");
  ExpectRefused([](Problem& p) { p.domain.inequalities.push_back({Vec({1}), 0}); }, "domain: inequality 0");
  ExpectRefused(
      [](Problem& p) {
        p.domain.inequalities.push_back({Eigen::VectorXd::Ones(6), kNan});
      },
      "domain: inequality 0");
  ExpectRefused([](Problem& p) { p.domain.balls.push_back({{}, Vec({}), 1}); }, "domain: ball 0");
  ExpectRefused([](Problem& p) { p.domain.balls.push_back({{6}, Vec({0}), 1}); }, "coordinate 6");
  ExpectRefused([](Problem& p) { p.domain.balls.push_back({{0}, Vec({0}), -1}); }, "radius -1");
  ExpectRefused([](Problem& p) { p.declaration.lipschitz.resize(4, 5); }, "declaration: lipschitz");
  ExpectRefused([](Problem& p) { p.declaration.lipschitz(1, 2) = -1; }, "lipschitz 1, 2");
  ExpectRefused([](Problem& p) { p.declaration.noise_bound[3] = kNan; }, "noise_bound 3");
  ExpectRefused(
      [](Problem& p) {
        p.declaration.disturbance = Vec({0, 0, 0});
      },
      "disturbance has 3 entries, must have 4");
  for (const double bad : {-0.5, kNan, kInfinity})
    ExpectRefused([bad](Problem& p) { p.declaration.disturbance = Vec({0, 0, bad, 0}); }, "disturbance 2");
  ExpectRefused([](Problem& p) { p.declaration.state_error = Vec({0, 0, 0, -1}); }, "state_error 3");
  ExpectRefused([](Problem& p) { p.declaration.state_error = Vec({0}); }, "state_error has 1 entries, must have 4");
  ExpectRefused([](Problem& p) { p.declaration.input_error = Vec({0, kNan}); }, "input_error 1");
  ExpectRefused([](Problem& p) { p.transitions = {}; }, "transitions: none given");
  ExpectRefused([](Problem& p) { p.transitions.z.conservativeResize(1, 5); }, "transitions: 5 columns");
  ExpectRefused([](Problem& p) { p.transitions.x_next.conservativeResize(1, 3); }, "transitions");
  ExpectRefused([](Problem& p) { p.transitions.z(0, 0) = 101; }, "transition 0: lies outside");
  ExpectRefused([](Problem& p) { p.transitions.z(0, 0) = kNan; }, "transition 0");
  ExpectRefused([](Problem& p) { p.transitions.x_next(0, 0) = kInfinity; }, "transition 0: not finite");
  ExpectRefused([](Problem& p) { p.projection = Eigen::MatrixXd::Identity(2, 3); }, "projection");
  ExpectRefused([](Problem& p) { p.projection.setZero(); }, "projection");
  ExpectRefused([](Problem& p) { p.rest = {{4, 1}}; }, "rest: coordinate 4");
  ExpectRefused([](Problem& p) { p.rest = {{-1, 1}}; }, "rest: coordinate -1");
  for (const double bad : {-1.0, kNan, kInfinity})
    ExpectRefused([bad](Problem& p) { p.rest = {{0, bad}}; }, "rest: coordinate 0");
  ExpectRefused([](Problem& p) { p.zonotope_order = 0; }, "zonotope_order: 0");
  ExpectRefused([](Problem& p) { p.zonotope_order = 28; }, "zonotope_order: 28");
  Problem largest = PointMassInHalves();
  largest.zonotope_order = 26;
  EXPECT_NO_THROW(Certifier(std::make_shared<Problem>(largest)));
}

TEST(Certifier, RefusesAProjectionThatDependsOnAnAngle) {
  Problem problem = WorldOf(MakeKinematicBicycle(0.1, 2.5, {kTheta}), Within({9, 9, 9, 9, 1, 1}), Within({1, 1}));
  AddNominalTransition(problem, Eigen::VectorXd::Zero(8));
  EXPECT_NO_THROW(Certifier(std::make_shared<Problem>(problem)));
  problem.projection(1, kTheta) = 1e-300;
  EXPECT_THAT([&] { Certifier(std::make_shared<Problem>(problem)); },
              ThrowsMessage<std::invalid_argument>(
                  Eq("projection: depends on theta, which is an angle: how often it has turned is not known")));
}

TEST(Certifier, RefusesPlacesOfABodyThatChangeWithATurn) {
  Problem problem = WorldOf(MakeKinematicBicycle(0.1, 2.5, {kTheta}), Within({9, 9, 9, 9, 1, 1}), Within({1, 1}));
  AddNominalTransition(problem, Eigen::VectorXd::Zero(8));
  problem.body.parts = {BodyPart{.radius = 0.1, .places = {{{"x + cos(theta)"}, {"y + sin(theta)"}}}}};
  EXPECT_NO_THROW(Certifier(std::make_shared<Problem>(problem)));
  problem.body.parts[0].places[0][1].text = "y + theta";
  EXPECT_THAT(
      [&] { Certifier(std::make_shared<Problem>(problem)); },
      ThrowsMessage<std::invalid_argument>(
          Eq("body: the place y + theta is not seen to be the same after a turn of the angle theta by 2 pi: write it "
             "with sin, cos or tan of it")));
}

TEST(Certifier, RequireNamesWhatItCannotJudge) {
  const Certifier certifier(std::make_shared<Problem>(PointMassInHalves()));
  const std::vector<double> controls(2 * (kMaxSteps + 1), 0.0);
  const Zonotope start = PointSet(Eigen::VectorXd::Zero(4));
  const auto refuses = [&](const Plan& plan, const Zonotope& set, const std::vector<Obstacle>& obstacles,
                           const char* message) {
    EXPECT_THAT([&] { certifier.Require(plan, set, obstacles); }, ThrowsMessage<std::invalid_argument>(Eq(message)));
  };
  const Plan good{controls.data(), 2, kMaxSteps, 2};
  EXPECT_NO_THROW(certifier.Require(good, start, {}));
  EXPECT_NO_THROW(certifier.Require({controls.data(), 2, 3, 5}, start, {}));
  refuses({controls.data(), 2, kMaxSteps + 1, 2}, start, {}, "plan: 129 steps, must be 1 to 128");
  refuses({controls.data(), 2, 0, 2}, start, {}, "plan: 0 steps, must be 1 to 128");
  refuses({controls.data(), 2, -1, 2}, start, {}, "plan: -1 steps, must be 1 to 128");
  refuses({controls.data(), 1, 1, 1}, start, {}, "plan: 1 inputs, the model has 2");
  refuses({controls.data(), 3, 1, 3}, start, {}, "plan: 3 inputs, the model has 2");
  refuses({controls.data(), 2, 1, 1}, start, {}, "plan: stride 1, must be at least its 2 inputs");
  refuses({controls.data(), 2, 1, 0}, start, {}, "plan: stride 0, must be at least its 2 inputs");
  refuses({controls.data(), 2, 1, -2}, start, {}, "plan: stride -2, must be at least its 2 inputs");
  refuses({nullptr, 2, 1, 2}, start, {}, "plan: no controls, its pointer is null");
  const std::vector<double> nan{0, 0, 0, kNan}, infinite{-kInfinity, 0};
  refuses({nan.data(), 2, 2, 2}, start, {}, "plan: step 1: ay is nan, must be finite");
  refuses({infinite.data(), 2, 1, 2}, start, {}, "plan: step 0: ax is -inf, must be finite");
  refuses(good, PointSet(Vec({0, 0})), {}, "initial set: dimension 2, the model has 4 states");
  refuses(good, Zonotope(Eigen::VectorXd::Zero(4), Eigen::MatrixXd::Ones(4, 21)), {},
          "initial set: 21 generators, must be at most 20, the zonotope order times the states");
  refuses(good, start, {Obstacle::Circle(Vec({0, 0}), 1), Obstacle::HalfSpace(Eigen::VectorXd::Ones(3), 1)},
          "obstacle 1: dimension 3, the projection has 2");
}

TEST(Certifier, WorksAtTheLargestOrderAndHorizon) {
  Problem problem = PointMassInHalves();
  problem.zonotope_order = 26;
  problem.declaration.noise_bound.setConstant(1e-9);
  Judge judge(problem);
  const Decision d = judge(Zonotope::FromBox(Eigen::VectorXd::Zero(4), Eigen::VectorXd::Constant(4, 1e-6)),
                           Coast(kMaxSteps), {Obstacle::Circle(Vec({50, 0}), 1)});
  EXPECT_EQ(d.outcome, Outcome::kCertified);
  EXPECT_EQ(judge.tube().length(), kMaxSteps);
  EXPECT_LE(judge.tube().slice(kMaxSteps).num_generators(), kMaxGenerators);
}

TEST(Certifier, SpatialAndLinearProjectionsAreJudged) {
  Problem problem = PointMassInHalves();
  problem.projection = Eigen::MatrixXd::Identity(3, 4);  // px, py, vx
  Judge spatial(problem);
  const auto box = [](double vx) { return Obstacle::AxisBox(Vec({-9, -9, vx}), Vec({9, 9, vx + 1})); };
  EXPECT_EQ(spatial(PointSet(Vec({0, 0, 1, 0})), Coast(3), {box(1.5)}).outcome, Outcome::kCertified);
  EXPECT_EQ(spatial(PointSet(Vec({0, 0, 1, 0})), Coast(3), {box(0.5)}).outcome, Outcome::kSafety);
  problem.projection = Eigen::MatrixXd::Identity(1, 4);
  Judge line(problem);
  const auto wall = [](double x) { return Obstacle::HalfSpace(Eigen::VectorXd::Ones(1), x); };
  EXPECT_EQ(line(PointSet(Vec({0, 0, 2, 0})), Coast(3), {wall(3.5)}).outcome, Outcome::kCertified);
  EXPECT_FIELDS(line(PointSet(Vec({0, 0, 2, 0})), Coast(3), {wall(3)}), (outcome, Outcome::kSafety), (step, 3));
}

TEST(Decision, ADefaultDecisionIsNoCertificate) {
  EXPECT_EQ(Decision{}.outcome, Outcome::kNone);
  EXPECT_NE(Outcome{}, Outcome::kCertified);
  EXPECT_EQ(Explain(Decision{}, PointMassInHalves()), "no decision");
}

TEST(Explain, SaysWhenADecisionHoldsAndOfSeveralPartsWhich) {
  Problem point = PointMassInHalves(), body = point;
  point.between.reset();
  body.between = Between{.acceleration = Eigen::Vector2d(1, 1), .period = 0.1};
  body.body.parts = {BodyPart{}, {{{1, 0, 0}}, 0.5}};
  Problem swept = body;
  swept.body = Body{};

  Decision certified;
  certified.outcome = Outcome::kCertified;
  certified.closest_step = 3, certified.obstacle = 2, certified.part = 1;
  certified.margin = 1.5, certified.threshold = 1;
  EXPECT_EQ(Explain(certified, point),
            "certified at its sample instants only: the robot stays clear, closest at step 3, 0.5 m from obstacle 2; "
            "steps on time");
  EXPECT_EQ(Explain(certified, swept),
            "certified: the robot stays clear at all times, closest between steps 3 and 4, 0.5 m from obstacle 2; "
            "steps on time");
  EXPECT_EQ(Explain(certified, body),
            "certified: the robot stays clear at all times, closest between steps 3 and 4, part 1 0.5 m from obstacle "
            "2; steps on time");
  certified.part = -1;
  EXPECT_EQ(Explain(certified, body), Explain(certified, swept));
  certified.obstacle = -1;
  EXPECT_EQ(Explain(certified, body), "certified: no obstacle is there; steps on time");

  certified.obstacle = 2;
  Problem windy = swept;
  windy.declaration.disturbance = Vec({0, 0, 0.1, 0});
  EXPECT_EQ(Explain(certified, windy),
            "certified: the robot stays clear at all times under the declared disturbance, closest between steps 3 and "
            "4, 0.5 m from obstacle 2; steps on time");
  windy.declaration.disturbance.setZero();
  EXPECT_EQ(Explain(certified, windy), Explain(certified, swept));

  Decision abstention;
  abstention.outcome = Outcome::kSafety;
  abstention.step = 3, abstention.obstacle = 0, abstention.part = 1;
  abstention.margin = 1, abstention.threshold = 1.5;
  EXPECT_EQ(Explain(abstention, point), "abstain S: at step 3 the robot may touch obstacle 0 (by 0.5 m)");
  EXPECT_EQ(Explain(abstention, swept), "abstain S: between steps 3 and 4 the robot may touch obstacle 0 (by 0.5 m)");
  EXPECT_EQ(Explain(abstention, body), "abstain S: between steps 3 and 4 part 1 may touch obstacle 0 (by 0.5 m)");
}

}  // namespace forereach::certifier_test
