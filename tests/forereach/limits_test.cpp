// Limits on functions of state and input: just inside and just outside, which samples count, what comes first.
#include "forereach/certify/limits.h"

#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/text_model.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::limits_test {

Limit AtMost(const std::string& that, double bound, const std::string& name = "it") {
  return {.name = name, .that = {that, 1, 1}, .at_most = bound};
}
Limit AtLeast(const std::string& that, double bound) { return {.name = "it", .that = {that, 1, 1}, .at_least = bound}; }

// A point mass in steps of 0.5 s without a residual: whole numbers stay exact. vx is 0.5 to 1.5 at all samples.
struct Limits : testing::Test {
  Decision Judge(const std::vector<Limit>& limits, const std::vector<Obstacle>& obstacles = {}) {
    problem_.limits = limits;
    certifier_.emplace(std::make_shared<Problem>(problem_));
    certifier_->Require(plan(), start_, obstacles);
    return certifier_->Certify(plan(), start_, obstacles, tube_);
  }
  bool IsKept(const Limit& limit) { return Judge({limit}).outcome == Outcome::kCertified; }
  Plan plan() const { return {controls_.data(), 2, static_cast<int>(controls_.cols()), 2}; }

  Problem problem_ = PointMassInHalves();
  Zonotope start_ = Zonotope::FromBox(Eigen::Vector4d(0, 0, 1, 0), Eigen::Vector4d(0, 0, 0.5, 0));
  Eigen::MatrixXd controls_ = Eigen::MatrixXd::Zero(2, 4);
  std::optional<Certifier> certifier_;
  Tube tube_;
};

// What is reached is rounded away from it.
TEST_F(Limits, AreShownAsTheyWereGiven) {
  EXPECT_THAT(Explain(Judge({AtMost("vx", 0.1)}), problem_), EndsWith(", above its limit 0.1"));
  EXPECT_THAT(Explain(Judge({AtLeast("vx", 1.1)}), problem_), EndsWith(", below its limit 1.1"));
  EXPECT_THAT(Explain(Judge({AtMost("vx", 1.23456789)}), problem_), EndsWith("above its limit 1.23456789"));
  EXPECT_THAT(Explain(Judge({AtMost("1/vx - vx", 1e-300)}), problem_), EndsWith("above its limit 1e-300"));
  problem_.limits = {};
  const auto exit = [&](DomainExit::Kind kind, double bound) {
    Decision decision{.outcome = Outcome::kDomain, .cause = Cause::kDomainExit, .step = 2};
    decision.exit = {kind, 0, std::nextafter(bound, kind == DomainExit::Kind::kLower ? -9 : 9), bound};
    return Explain(decision, problem_);
  };
  EXPECT_THAT(exit(DomainExit::Kind::kLower, 0.1), EndsWith("px reaches 0.0999999, below its bound 0.1"));
  EXPECT_THAT(exit(DomainExit::Kind::kUpper, 0.7), EndsWith("px reaches 0.700001, above its bound 0.7"));
  EXPECT_THAT(exit(DomainExit::Kind::kInequality, 0.7), EndsWith("reaches 0.700001, above its bound 0.7"));
  EXPECT_THAT(exit(DomainExit::Kind::kBall, 0.7), EndsWith("reaches 0.700001, above its radius 0.7"));
  Decision no_stop{.outcome = Outcome::kDomain, .cause = Cause::kNoStop, .step = 2};
  no_stop.coordinate = 2, no_stop.margin = 0.2, no_stop.threshold = 0.1;
  EXPECT_THAT(Explain(no_stop, problem_), EndsWith("vx reaches 0.200001; standing is up to 0.1"));
}

TEST_F(Limits, AreClosedToTheLastBit) {
  const Decision above = Judge({AtMost("py", 90), AtMost("vx", 1, "speed")});
  EXPECT_FIELDS(above, (outcome, Outcome::kSafety), (cause, Cause::kLimit), (step, 0), (coordinate, 1), (obstacle, -1),
                (part, -1), (closest_step, -1));
  EXPECT_NEAR(above.margin, 1.5, 1e-14);
  EXPECT_GE(above.margin, 1.5);
  EXPECT_EQ(above.threshold, 1);
  EXPECT_THAT(Explain(above, problem_), HasSubstr("abstain S: at step 0 speed may reach 1.5"));
  EXPECT_THAT(Explain(above, problem_), EndsWith(", above its limit 1"));
  const Decision below = Judge({AtLeast("vx", 1)});
  EXPECT_NEAR(below.margin, 0.5, 1e-14);
  EXPECT_LE(below.margin, 0.5);
  EXPECT_EQ(below.threshold, 1);
  EXPECT_THAT(Explain(below, problem_), EndsWith(", below its limit 1"));

  controls_ = Eigen::MatrixXd::Zero(2, 1);
  controls_(0, 0) = -2;  // the last sample is well inside
  EXPECT_TRUE(IsKept(AtMost("vx", above.margin)));
  EXPECT_FALSE(IsKept(AtMost("vx", NextDown(above.margin))));
  controls_(0, 0) = 2;
  EXPECT_TRUE(IsKept(AtLeast("vx", below.margin)));
  EXPECT_FALSE(IsKept(AtLeast("vx", NextUp(below.margin))));
}

// 1 + 2 d + d^2 for |d| <= 0.5: the second order gives the upper end, the range the lower one.
TEST_F(Limits, OfACurvedFunctionHoldUpToItsRange) {
  EXPECT_TRUE(IsKept(AtMost("vx^2", 2.25 + 1e-12)));
  EXPECT_FALSE(IsKept(AtMost("vx^2", 2.25 - 1e-12)));
  EXPECT_TRUE(IsKept(AtLeast("vx^2", 0.25 - 1e-12)));
  EXPECT_FALSE(IsKept(AtLeast("vx^2", 0.25 + 1e-12)));
  EXPECT_TRUE(IsKept(AtMost("sin(vx)", 1)));
  EXPECT_FALSE(IsKept(AtMost("sin(vx)", 0.997)));
}

// px = t vx / 2 in every slice: the box knows nothing of it.
TEST_F(Limits, UseTheCorrelationOfStates) {
  EXPECT_TRUE(IsKept(AtMost("px - 2*vx", 1e-12)));
  EXPECT_FALSE(IsKept(AtMost("px - 2*vx", -1e-12)));
  EXPECT_TRUE(IsKept(AtLeast("px - 2*vx", -3 - 1e-12))) << "at the start";
}

TEST_F(Limits, OfAFunctionWithAKinkHoldUpToItsRange) {
  EXPECT_TRUE(IsKept(AtMost("abs(vx - 1)", 0.5 + 1e-12)));
  EXPECT_FALSE(IsKept(AtMost("abs(vx - 1)", 0.5 - 1e-12)));
  EXPECT_TRUE(IsKept(AtLeast("abs(vx - 1)", 0)));
}

TEST_F(Limits, WithoutAFiniteBoundAreExceeded) {
  for (const char* that : {"1/(vx - 1)", "log(vx - 1)", "sqrt(vx - 1)", "tan(vx + 0.5)", "acos(vx)", "0*log(vx - 1)"}) {
    const Decision d = Judge({AtMost(that, 1e300)});
    EXPECT_EQ(d.cause, Cause::kLimit) << that;
    EXPECT_EQ(d.margin, kInfinity) << that;
    EXPECT_THAT(Explain(d, problem_), HasSubstr("abstain S: at step 0 it has no finite bound, its limit is 1e+300"));
    EXPECT_EQ(Judge({AtLeast(that, -1e300)}).margin, -kInfinity) << that;
  }
}

// An input is applied at every sample but the last.
TEST_F(Limits, OfStatesHoldAtTheLastSampleAndOfInputsWhereTheyAreApplied) {
  controls_(0, 3) = 2;
  EXPECT_EQ(Judge({AtMost("ax", 1)}).step, 3);
  EXPECT_EQ(Judge({AtMost("ax", 2)}).outcome, Outcome::kCertified);
  EXPECT_EQ(Judge({AtMost("vx", 2)}).step, 4) << "1.5 + 1";
  EXPECT_EQ(Judge({AtMost("vx + 0*ax", 2)}).outcome, Outcome::kCertified) << "X_T is not among them";
  controls_.row(0).setConstant(1);
  EXPECT_EQ(Judge({AtMost("vx*ax", 2)}).step, 1);
  const LimitTest& test = certifier_->limits();
  EXPECT_NEAR(test.Reach(0, plan(), tube_)->upper, 3, 1e-9);
  EXPECT_NEAR(test.Reach(0, plan(), tube_)->lower, 0.5, 1e-9);
}

TEST_F(Limits, UseTheNamesOfTheModel) {
  problem_.model = MakeTextModel(TextModel({{"x", "x + dt*speed"}, {"v", "v + dt*a"}, {"y", "y"}, {"w", "w"}},
                                           {"a", "b"}, {{"dt", 0.5, 0.5}, {"mass", 2, 3}}, {{"speed", "2*v"}}));
  start_ = Zonotope::FromBox(Eigen::Vector4d(0, 1, 0, 0), Eigen::Vector4d(0, 0, 0, 0));
  EXPECT_TRUE(IsKept(AtMost("mass*speed", 6 + 1e-9))) << "for every mass";
  EXPECT_FALSE(IsKept(AtMost("mass*speed", 6 - 1e-9)));
  EXPECT_TRUE(IsKept(AtLeast("mass*speed", 4 - 1e-9)));
  EXPECT_FALSE(IsKept(AtLeast("mass*speed", 4 + 1e-9)));
}

// The robot drives at 1 m/s or so towards a wall; the limit is exceeded when it has come half as far.
TEST_F(Limits, TheFirstFailureIsNamed) {
  const std::vector<Obstacle> wall{Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 2)};
  EXPECT_EQ(Judge({}, wall).step, 3);
  EXPECT_FIELDS(Judge({AtMost("px", 1)}, wall), (cause, Cause::kLimit), (step, 2));
  EXPECT_EQ(Judge({AtMost("px", 2)}, wall).cause, Cause::kLimit) << "the same step";
  EXPECT_EQ(Judge({AtMost("px", 2.5)}, wall).cause, Cause::kObstacle);
  EXPECT_EQ(Judge({AtMost("px", 2.5)}, {}).step, 4);
  EXPECT_EQ(Judge({AtMost("px", 2.5), AtMost("px", 1)}, {}).coordinate, 1);
}

TEST_F(Limits, OnTheRestOfAPlanCountFromItsFirstStep) {
  controls_.row(0).setConstant(-2);  // 1 m/s, 0, -1, -2
  const std::vector<Limit> limits{AtMost("vx", 0.6)};
  EXPECT_EQ(Judge(limits).step, 0);
  EXPECT_EQ(certifier_->JudgeSafety(plan(), {}, tube_, 0).cause, Cause::kLimit);
  EXPECT_EQ(certifier_->JudgeSafety(plan(), {}, tube_, 1).outcome, Outcome::kCertified);
  EXPECT_EQ(certifier_->JudgeSafety(plan(), {}, tube_, 4).outcome, Outcome::kCertified);
}

TEST_F(Limits, ComeAfterTheDomainAndRest) {
  problem_.rest = {{2, 1}};
  EXPECT_EQ(Judge({AtMost("vx", 0)}).cause, Cause::kNoStop);
  problem_.rest.clear();
  problem_.domain.state = Box(Eigen::Vector4d(-100, -100, -1, -4), Eigen::Vector4d(100, 100, 1, 4));
  EXPECT_EQ(Judge({AtMost("vx", 0)}).cause, Cause::kDomainExit);
}

TEST_F(Limits, ACertificateSaysWhenTheyHold) {
  EXPECT_EQ(Explain(Judge({AtMost("vx", 2)}), problem_),
            "certified: no obstacle is there; within its limits at the sample instants; steps on time");
  const std::vector<Obstacle> far{Obstacle::Circle(Eigen::Vector2d(50, 0), 1)};
  problem_.between = Between{Eigen::Vector2d::Zero(), 0, 0, 0.5};
  EXPECT_THAT(Explain(Judge({AtMost("vx", 2)}, far), problem_),
              AllOf(HasSubstr("certified: the robot stays clear at all times"),
                    EndsWith("from obstacle 0; within its limits at the sample instants; steps on time")));
}

TEST_F(Limits, AreRefusedIfTheyAreMalformed) {
  const auto refused = [&](const Limit& limit, const std::string& why) {
    EXPECT_THAT([&] { Judge({AtMost("vx", 9), limit}); }, ThrowsMessage<std::invalid_argument>(HasSubstr(why)));
  };
  refused(AtMost("v_x", 1), "v_x");
  refused(AtMost("vx +", 1), "");
  refused(AtMost("vx", -kInfinity), "limit 1: from -inf to -inf is no range");
  refused(AtMost("vx", kInfinity), "limit 1: from -inf to inf is no range");
  refused(AtMost("vx", std::nan("")), "limit 1: from -inf to nan is no range");
  refused({.name = "it", .that = {"vx", 1, 1}, .at_least = 2, .at_most = 1}, "limit 1: from 2 to 1 is no range");
  refused(AtMost("vx", 1, ""), "limit 1: its name has 0 bytes, must be 1 to 48");
  refused(AtMost("vx", 1, std::string(49, 'a')), "its name has 49 bytes");
  refused(AtMost("vx", 1, "a\nb"), "printable");
  refused(AtMost("softplus(vx, 1)", 1), "need");
  EXPECT_THAT([&] { Judge(std::vector<Limit>(33, AtMost("vx", 1))); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("33 limits, must be at most 32")));
}

}  // namespace forereach::limits_test
