// Declared bounds on rates that a transition contradicts: then nothing is certified.
#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/text_model.h"
#include "tests/oracle/exact.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::rates_test {

using exact::Rational;

// A bar that turns on the spot in steps of half a second. Its data turn it by `turns`, one transition each, from 0.
struct Rates : testing::Test {
  static Problem Bar(double turn_rate, std::initializer_list<double> turns, bool is_angle = false) {
    ModelText text = TextModel({{"x", "x"}, {"y", "y"}, {"th", "th + dt*w"}}, {"w"}, {{"dt", 0.5, 0.5}});
    if (is_angle) text.angles = {"th"};
    Problem problem = WorldOf(MakeTextModel(text), Within({9, 9, 9}), Within({40}));
    problem.body.heading = 2;
    problem.body.parts = {BodyPart{{Eigen::Vector3d(-1.2, 0, 0), Eigen::Vector3d(1.2, 0, 0)}, 0}};
    problem.between = Between{Eigen::Vector2d::Zero(), turn_rate, 0, 0.5};
    problem.transitions.z = Eigen::MatrixXd::Zero(std::ssize(turns), 4);
    problem.transitions.x_next = Eigen::MatrixXd::Zero(std::ssize(turns), 3);
    Eigen::Index row = 0;
    for (const double turn : turns) {
      problem.transitions.z(row, 3) = 2 * turn;  // the model says the same: its residual is zero
      problem.transitions.x_next(row++, 2) = turn;
    }
    return problem;
  }
  static Decision Decide(const Problem& problem) {
    static const double standing = 0;
    Tube tube;
    return Certifier(std::make_shared<Problem>(problem))
        .Certify({&standing, 1, 1, 1, {}}, Zonotope::FromBox(Vec({0, 0, 0}), Vec({0, 0, 0})), {}, tube);
  }
};

TEST_F(Rates, ATransitionThatTurnsFasterThanDeclaredFalsifies) {
  const Problem problem = Bar(0.5, {0.125, -3, 1});
  const Decision d = Decide(problem);
  EXPECT_FIELDS(d, (outcome, Outcome::kFalsified), (cause, Cause::kBound), (step, -1), (coordinate, 2));
  EXPECT_EQ(d.first_observation, 1) << "the worst";
  EXPECT_EQ(d.second_observation, -1);
  EXPECT_LE(d.margin, 6);
  EXPECT_NEAR(d.margin, 6, 1e-14);
  EXPECT_EQ(d.threshold, 0.5);
  EXPECT_EQ(
      Explain(d, problem),
      "abstain F: in transition 1 th changes by at least 5.99999 a second, task.between.turn_rate declares 0.5 at "
      "most");
}

// The declared rate, and the nearest numbers beyond what the successor's last unit leaves open.
TEST_F(Rates, OfExactlyTheDeclaredSizeAreNotRefuted) {
  for (const double sign : {1.0, -1.0}) {
    EXPECT_EQ(Decide(Bar(0.5, {sign * 0.25})).outcome, Outcome::kCertified);
    EXPECT_EQ(Decide(Bar(0.5, {sign * (0.25 + 0x1p-54)})).outcome, Outcome::kCertified) << "rounds to the same";
    EXPECT_EQ(Decide(Bar(0.5, {sign * (0.25 + 0x1p-50)})).cause, Cause::kBound);
  }
  EXPECT_EQ(Decide(Bar(0, {0})).outcome, Outcome::kCertified);
  EXPECT_EQ(Decide(Bar(0, {0x1p-50})).cause, Cause::kBound);
}

TEST_F(Rates, WithinTheErrorsOfTheRecordAreNotRefuted) {
  Problem problem = Bar(0.5, {0.5});
  problem.declaration.state_error = Vec({0, 0, 0.0625});
  problem.declaration.noise_bound = Vec({0, 0, 0.125});
  EXPECT_NE(Decide(problem).cause, Cause::kBound)
      << "0.25 more: twice the state's error, and the noise of the successor";
  problem.transitions.z(0, 2) = -0x1p-40;
  EXPECT_EQ(Decide(problem).cause, Cause::kBound);
  problem.declaration.given_are_exact = true;
  problem.transitions.z(0, 2) = 0x1p-3 + 0x1p-40;
  EXPECT_NE(Decide(problem).cause, Cause::kBound) << "the noise counts also where states are exact";
  problem.transitions.z(0, 2) = 0x1p-3 - 0x1p-40;
  EXPECT_EQ(Decide(problem).cause, Cause::kBound);
}

TEST_F(Rates, OfAnAngleAreThoseOfTheLeastTurn) {
  const double turn = 2 * std::numbers::pi;
  EXPECT_EQ(Decide(Bar(1, {turn - 0.49}, true)).outcome, Outcome::kCertified);
  EXPECT_EQ(Decide(Bar(1, {turn - 0.51}, true)).cause, Cause::kBound);
  EXPECT_EQ(Decide(Bar(1, {turn - 0.49}, false)).cause, Cause::kBound) << "it is told how often it has turned";
  EXPECT_EQ(Decide(Bar(6.29, {3.14}, true)).outcome, Outcome::kCertified) << "so fast every turn is possible";
}

TEST_F(Rates, AreNotLookedAtWithoutBoundsBetweenTheSamples) {
  Problem problem = Bar(0.5, {3});
  problem.between.reset();
  EXPECT_EQ(Decide(problem).outcome, Outcome::kCertified);
}

TEST_F(Rates, DeclaredOfAStateAreRefutedByDataAndByThePlan) {
  Problem problem = Bar(100, {3});
  problem.timing.rate_bound = Vec({kInfinity, 0, 5.5});
  const Decision d = Decide(problem);
  EXPECT_EQ(d.cause, Cause::kBound);
  EXPECT_THAT(Explain(d, problem), HasSubstr("model.rate_bound.th declares 5.5"));
  problem.transitions.x_next(0, 2) = problem.transitions.z(0, 3) = 0;
  EXPECT_EQ(Decide(problem).outcome, Outcome::kCertified);
  const double turning = 6;  // 3 rad in a step
  Tube tube;
  const Zonotope start = Zonotope::FromBox(Vec({0, 0, 0}), Vec({0, 0, 0}));
  const auto decide = [&] {
    return Certifier(std::make_shared<Problem>(problem)).Certify({&turning, 1, 1, 1, {}}, start, {}, tube);
  };
  EXPECT_FIELDS(decide(), (cause, Cause::kBetween), (threshold, 2.75));
  problem.timing.rate_bound[2] = 6;
  EXPECT_EQ(decide().outcome, Outcome::kCertified);
}

// A step that may have lasted longer may have turned more.
TEST_F(Rates, OfALearnedTransitionCountItsDuration) {
  const auto problem = std::make_shared<Problem>(Bar(0.5, {0}));
  problem->between->period = 0.625;
  const std::vector<double> z{0, 0, 0, 0.625}, next{0, 0, 0.3125};
  Certifier certifier(problem);
  EXPECT_EQ(certifier.Learn(z, next, 0.125), Learned::kAdded);
  EXPECT_FALSE(certifier.violation());
  EXPECT_EQ(certifier.Learn(z, next, 0.1), Learned::kAdded);
  ASSERT_TRUE(certifier.violation());
  EXPECT_FIELDS(*certifier.violation(), (first, 2), (second, -1));
  const Transitions shown = certifier.Contradiction();
  ASSERT_EQ(shown.size(), 1);
  EXPECT_FIELDS(shown, (num_learned, 1), (x_next(0, 2), 0.3125), (longer[0], 0.1));
  certifier.Learn(z, next, 0.125);
  EXPECT_TRUE(certifier.violation()) << "it does not become true again";
}

// A turn rate is declared, and proven, of the steps of plans: a step of another duration may have gone further from the
// domain, where it holds no more.
TEST_F(Rates, OfATurnHoldInStepsNoLongerThanAPlans) {
  Problem problem = Bar(0.5, {3});
  problem.between->period = 0.625;
  problem.timing.rate_bound = Vec({0, 0, 8});
  for (const auto& [longer, outcome] :
       {std::pair(0.125, Outcome::kFalsified), {0x1.0000000000001p-3, Outcome::kCertified}}) {
    problem.transitions.longer = Vec({longer});
    const Decision d = Decide(problem);
    EXPECT_EQ(d.outcome, outcome) << longer << ": " << Explain(d, problem);
  }
  problem.timing.rate_bound[2] = 0.5;
  EXPECT_EQ(Decide(problem).outcome, Outcome::kFalsified) << "a rate of the model holds in each motion";
}

// Motions at the corners of what is declared: rate, duration, both errors and whole turns at their bounds, computed in
// rationals and rounded once, as a record is. They are never refuted; a little faster they are.
TEST_F(Rates, ThatAMotionWithinAllBoundsCanShowAreNeverRefuted) {
  std::mt19937 random(20261);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  const auto sign = [&] { return random() % 2 == 0 ? 1.0 : -1.0; };
  int refuted = 0;
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const bool is_angle = random() % 2 == 0;
    Problem problem = Bar(uniform(0, 4), {0}, is_angle);
    problem.between->period = 0.625;
    problem.declaration.state_error = Vec({0, 0, random() % 3 == 0 ? 0 : uniform(0, 0.1)});
    problem.declaration.noise_bound = Vec({0, 0, random() % 3 == 0 ? 0 : uniform(0, 0.1)});
    const double e = problem.declaration.state_error[2], sigma = problem.declaration.noise_bound[2];
    const double longer = random() % 2 == 0 ? 0 : uniform(0, 0.1), way = sign(), begin = uniform(-3, 3);
    const auto record = [&](const Rational& factor) {
      const Rational change = Rational(problem.between->turn_rate) * (Rational(0.5) + Rational(longer)) * factor;
      const Rational true_begin = Rational(begin) + Rational(way) * Rational(e);
      Rational end = true_begin + Rational(way) * (change + Rational(e) + Rational(sigma));
      if (is_angle) end += Rational(std::round(uniform(-2, 2))) * Rational(2 * std::numbers::pi);
      Eigen::VectorXd z = Vec({0, 0, begin, 0}), next = Vec({0, 0, end.get_d()});
      return RateBounds(problem).FindViolation(RateBounds(problem).Shown({z.data(), 4}, {next.data(), 3}, longer, true),
                                               0);
    };
    ASSERT_FALSE(record(1)) << "trial " << trial;
    // Beyond half a turn a faster motion may be a slower one the other way round.
    refuted += record(Rational(1) + Rational(0x1p-30)).has_value();
  }
  EXPECT_GT(refuted, kTrials / 2);
}

}  // namespace forereach::rates_test
