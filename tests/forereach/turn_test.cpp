// A declared turn rate that the plan's own slices contradict: there is no motion that it describes.
#include "tests/test.h"

#include "forereach/certify/explain.h"
#include "forereach/certify/standing.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/text_model.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::turn_test {

// A bar of 2.4 m that turns on the spot in steps of 1 s; a post stands 1 m beside its middle.
struct Turn : testing::Test {
  static Problem Bar(double turn_rate, bool is_angle) {
    ModelText text = TextModel({{"x", "x"}, {"y", "y"}, {"th", "th + dt*w"}}, {"w"}, {{"dt", 1, 1}});
    if (is_angle) text.angles = {"th"};
    Problem problem = WorldOf(MakeTextModel(text), Within({9, 9, 9}), Within({8}));
    problem.body.heading = 2;
    problem.body.parts = {BodyPart{{Eigen::Vector3d(-1.2, 0, 0), Eigen::Vector3d(1.2, 0, 0)}, 0}};
    problem.between = Between{Eigen::Vector2d::Zero(), turn_rate, 0, 1};
    return problem;
  }

  // One step of 0, then one that turns by w.
  Decision Turned(double w, double turn_rate, bool is_angle = false, double half_width = 0) {
    problem_ = Bar(turn_rate, is_angle);
    const Certifier certifier(std::make_shared<Problem>(problem_));
    return certifier.Certify(PlanOf(w), StartWithin(half_width), {}, tube_);
  }
  Plan PlanOf(double w) {
    controls_ = {0, w};
    return {controls_.data(), 1, 2, 1, {}};
  }
  static Zonotope StartWithin(double half_width) { return Zonotope::FromBox(Vec({0, 0, 0}), Vec({0, 0, half_width})); }

  std::array<double, 2> controls_{};
  Problem problem_;
  Tube tube_;
};

TEST_F(Turn, ThatNoMotionWithinTheDeclaredRateMakesIsAbstainedFrom) {
  const Decision d = Turned(3.1, 0.5);
  EXPECT_FIELDS(d, (outcome, Outcome::kDomain), (cause, Cause::kBetween), (step, 1), (coordinate, 2));
  EXPECT_NEAR(d.margin, 3.1, 1e-12);
  EXPECT_LE(d.margin, 3.1);
  EXPECT_EQ(d.threshold, 0.5);
  EXPECT_THAT(Explain(d, problem_), HasSubstr("abstain D: at step 1 th changes by 3.09"));
  EXPECT_THAT(Explain(d, problem_), HasSubstr("task.between.turn_rate allows 0.5"));
}

TEST_F(Turn, OfExactlyTheDeclaredRateIsAllowedInBothDirections) {
  for (const double sign : {1.0, -1.0}) {
    EXPECT_EQ(Turned(sign * 0.5, 0.5).outcome, Outcome::kCertified);
    EXPECT_EQ(Turned(sign * (0.5 + 1e-9), 0.5).cause, Cause::kBetween);
    EXPECT_EQ(Turned(sign * (0.5 - 1e-9), 0.5).outcome, Outcome::kCertified);
  }
}

TEST_F(Turn, IsTheLeastBetweenAnyStatesOfBothSlices) {
  EXPECT_EQ(Turned(0.75, 0.5, false, 0.125 + 1e-9).outcome, Outcome::kCertified);
  EXPECT_EQ(Turned(0.75, 0.5, false, 0.125 - 1e-9).cause, Cause::kBetween);
}

TEST_F(Turn, OfAnAngleIsTheLeastOfThoseByWholeTurns) {
  const double turn = 2 * std::numbers::pi;
  EXPECT_EQ(Turned(turn - 0.4, 0.5, true).outcome, Outcome::kCertified);
  EXPECT_EQ(Turned(-turn + 0.4, 0.5, true).outcome, Outcome::kCertified);
  EXPECT_EQ(Turned(turn - 0.6, 0.5, true).cause, Cause::kBetween);
  EXPECT_EQ(Turned(turn - 0.4, 0.5, false).cause, Cause::kBetween) << "no angle: it is told how often it has turned";
}

TEST_F(Turn, IsNotLookedAtWithoutBoundsBetweenTheSamples) {
  problem_ = Bar(0.5, false);
  problem_.between.reset();
  const Certifier certifier(std::make_shared<Problem>(problem_));
  EXPECT_EQ(certifier.Certify(PlanOf(3.1), StartWithin(0), {}, tube_).outcome, Outcome::kCertified);
}

TEST_F(Turn, LeavesTheControlsBeforeItStanding) {
  problem_ = Bar(0.5, false);
  const Certifier certifier(std::make_shared<Problem>(problem_));
  const Standing standing = JudgeAgain(certifier, PlanOf(3.1), StartWithin(0), {}, tube_, 0);
  EXPECT_FIELDS(standing, (steps, 1), (verdict.cause, Cause::kBetween));
}

}  // namespace forereach::turn_test
