// Parts of a body that stand at expressions of the state: an arm whose links just clear an obstacle, and just do not.
#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/text_model.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::places_test {

constexpr double kHair = 1e-9;

BodyPart At(const std::vector<std::vector<std::string>>& places, double radius) {
  BodyPart part{{}, radius, {}};
  for (const auto& place : places) {
    std::vector<ExpressionText>& texts = part.places.emplace_back();
    for (const std::string& coordinate : place) texts.push_back({coordinate, 1, 1});
  }
  return part;
}

// Two links of 2 m and 1 m; the inputs are the rates of the joints. Half a second a step, no residual.
struct Places : testing::Test {
  Places() {
    problem_ = WorldOf(MakeTextModel(TextModel({{"q1", "q1 + dt*u1"}, {"q2", "q2 + dt*u2"}}, {"u1", "u2"},
                                               {{"dt", 0.5, 0.5}, {"length", 2, 2}},
                                               {{"x", "length*cos(q1)"}, {"y", "length*sin(q1)"}})),
                       Within({7, 7}), Within({7, 7}));
    problem_.projection.setZero();
    problem_.body.parts = {At({{"0", "0"}, {"x", "y"}}, 0.25),
                           At({{"x", "y"}, {"x + cos(q1 + q2)", "y + sin(q1 + q2)"}}, 0.125)};
  }

  Decision Judge(const Obstacle& obstacle) {
    certifier_.emplace(std::make_shared<Problem>(problem_));
    const Plan plan{controls_.data(), 2, static_cast<int>(controls_.cols()), 2, {}};
    const std::vector<Obstacle> obstacles{obstacle};
    certifier_->Require(plan, start_, obstacles);
    return certifier_->Certify(plan, start_, obstacles, tube_);
  }
  bool IsClear(const Obstacle& obstacle) { return Judge(obstacle).outcome == Outcome::kCertified; }
  void Stand(double q1, double q2, double half_width = 0) {
    start_ = Zonotope::FromBox(Eigen::Vector2d(q1, q2), Eigen::Vector2d::Constant(half_width));
  }

  Problem problem_;
  Zonotope start_ = Zonotope::FromBox(Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero());
  Eigen::MatrixXd controls_ = Eigen::MatrixXd::Zero(2, 1);
  std::optional<Certifier> certifier_;
  Tube tube_;
};

Obstacle Circle(double x, double y, double radius) { return Obstacle::Circle(Eigen::Vector2d(x, y), radius); }

// Along x, and then its forearm along y.
TEST_F(Places, OfAStandingArmAreDecidedWithinAHair) {
  Stand(0, M_PI / 2);
  EXPECT_TRUE(IsClear(Circle(1, 1, 0.75 - kHair))) << "beside the first link";
  EXPECT_FALSE(IsClear(Circle(1, 1, 0.75 + kHair)));
  EXPECT_TRUE(IsClear(Circle(2, 2, 0.875 - kHair))) << "above the hand";
  const Decision hand = Judge(Circle(2, 2, 0.875 + kHair));
  EXPECT_FIELDS(hand, (outcome, Outcome::kSafety), (part, 1));
  EXPECT_THAT(Explain(hand, problem_), HasSubstr("at step 0 part 1 may touch obstacle 0"));
  EXPECT_TRUE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 2.25 + kHair)));
  EXPECT_FALSE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 2.25 - kHair)));
  EXPECT_TRUE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(0, 1), 1.125 + kHair)));
  EXPECT_FALSE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(0, 1), 1.125 - kHair)));
}

TEST_F(Places, OfAnArmThatMovesAreWhereItIsAtItsSamples) {
  Stand(0, M_PI / 2);
  controls_ = Eigen::Vector2d(M_PI, 0);  // to a quarter turn
  EXPECT_FALSE(IsClear(Circle(-1, 2.5, 0.4))) << "beside the forearm, which then lies along -x";
  EXPECT_EQ(Judge(Circle(-1, 2.25, 0.2)).step, 1);
  EXPECT_TRUE(IsClear(Circle(-1, 2.5, 0.375 - kHair)));
  EXPECT_FALSE(IsClear(Circle(-1, 2.5, 0.375 + kHair)));
  EXPECT_TRUE(IsClear(Circle(2, 2, 0.5))) << "between the samples nothing is claimed";
}

// The hand at (3, 0) is uncertain by dq1 + ... along y and in second order along x.
TEST_F(Places, AreCorrelatedWithTheSlice) {
  problem_.body.parts.erase(problem_.body.parts.begin());
  Stand(0, 0, 0.01);
  const double up = 0.125 + 2 * std::sin(0.01) + std::sin(0.02);
  EXPECT_TRUE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(0, 1), up + 1e-5)));
  EXPECT_FALSE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(0, 1), up - 1e-5)));
  EXPECT_TRUE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 3.125 + 5e-4))) << "not 0.03 further";
  // The two links turn against each other: the hand stays, and the elbow moves by 0.02.
  start_ = Zonotope(Eigen::Vector2d::Zero(), Eigen::MatrixXd(Eigen::Vector2d(0.01, -0.03)));
  EXPECT_TRUE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(0, 1), 0.125 + 0.0201)));
  EXPECT_FALSE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(0, 1), 0.125 + 0.0199)));
}

TEST_F(Places, WithAKinkAreEnclosedByTheirRange) {
  problem_.body.parts = {At({{"abs(q1)", "q2"}}, 0)};
  Stand(0, 0, 0.25);
  EXPECT_TRUE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(-1, 0), kHair)));
  EXPECT_FALSE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(-1, 0), -kHair)));
  EXPECT_TRUE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 0.25 + kHair)));
  EXPECT_FALSE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 0.25 - kHair)));
}

// There may be no place at all, so its other coordinate proves nothing.
TEST_F(Places, ThatAreUnboundedTouchEveryObstacle) {
  for (const char* x : {"1/q1", "log(q1)", "tan(q1 + pi/2)", "log(q1 - 10)", "sqrt(q1)", "asin(q1 + 1)", "q1^0.5"}) {
    problem_.body.parts = {At({{x, "q2"}}, 0)};
    Stand(0, 0, 0.25);
    const Decision d = Judge(Circle(1e6, 0.5, 1));
    EXPECT_EQ(d.outcome, Outcome::kSafety) << x;
    EXPECT_EQ(d.cause, Cause::kObstacle) << x;
    EXPECT_FALSE(IsClear(Circle(0, 1.5, 1))) << x;
    EXPECT_FALSE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(0, 1), 1e6))) << x;
    problem_.body.parts = {At({{"q1", "q2"}, {x, "q2"}}, 0)};
    EXPECT_FALSE(IsClear(Obstacle::HalfSpace(Eigen::Vector2d(0, 1), 1e6))) << x << ", a hull with it";
  }
}

// The hand goes from (3, 0) to (0, 3), a chord 3 / sqrt(2) from the center; with e = 0.5 along each axis.
TEST_F(Places, BetweenTheSamplesAreOnTheirChordAndItsBulge) {
  problem_.body.parts = {At({{"3*cos(q1)", "3*sin(q1)"}}, 0)};
  controls_ = Eigen::Vector2d(M_PI, 0);
  const Eigen::Vector2d out(1, 1);
  const auto wall = [&](double along) { return Obstacle::HalfSpace(out, along); };
  EXPECT_TRUE(IsClear(wall(3 + kHair))) << "both samples";
  problem_.between = Between{Eigen::Vector2d(0, 0), 0, 0, 0.5};
  EXPECT_TRUE(IsClear(wall(3 + kHair)));
  EXPECT_FALSE(IsClear(Circle(1.5, 1.5, kHair))) << "on the chord";
  problem_.between->acceleration = Eigen::Vector2d(16, 16);
  EXPECT_TRUE(IsClear(wall(4 + kHair)));
  EXPECT_FALSE(IsClear(wall(4 - kHair)));
  EXPECT_THAT(Explain(Judge(wall(4 - kHair)), problem_), HasSubstr("between steps 0 and 1"));
}

// A cart at (q1, 0) with a mast that is 2 m long.
TEST_F(Places, CountBesidePartsOfTheFrame) {
  problem_.projection << 1, 0, 0, 0;
  problem_.body.parts = {{{Eigen::Vector3d(0, 0, 0)}, 0.5}, At({{"q1 + 2*sin(q2)", "2*cos(q2)"}}, 0.25)};
  Stand(1, 0);
  EXPECT_TRUE(IsClear(Circle(1, 3, 0.75 - kHair)));
  EXPECT_EQ(Judge(Circle(1, 3, 0.75 + kHair)).part, 1);
  EXPECT_TRUE(IsClear(Circle(1, -3, 2.5 - kHair)));
  EXPECT_EQ(Judge(Circle(1, -3, 2.5 + kHair)).part, 0);
}

TEST_F(Places, AreRefusedIfTheyAreMalformed) {
  const auto refused = [&](const BodyPart& part, const std::string& why) {
    problem_.body.parts = {part};
    EXPECT_THAT([&] { Judge(Circle(0, 0, 1)); }, ThrowsMessage<std::invalid_argument>(HasSubstr(why)));
  };
  refused(At({{"q1", "q2", "0"}}, 0), "part 0: a place has 3 expressions, there are 2 safety coordinates");
  refused(At({{"q1", "u1"}}, 0), "the place u1 uses an input");
  refused(At({{"q1", "q3"}}, 0), "q3");
  refused(At({{"q1", "q2"}}, -1), "radius -1");
  refused({}, "projection: is zero");
  refused(At(std::vector<std::vector<std::string>>(17, {"q1", "q2"}), 0), "17 points, must be at most 16");
}

}  // namespace forereach::places_test
