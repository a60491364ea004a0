// Limits of a task in certificates: kept by a hair, exceeded by a hair, and what the verifier cannot decide.
#include "tests/verifier/hand_made.h"

namespace forereach::verifier::limits_test {

constexpr double kHair = 1e-9;

// px in 1 +- 0.25, vx in 1 +- 0.5 and one after the other: px = 1 + vx_0 / 2 + ax / 8 after a step of half a second.
Certificate OneStep(double ax = 0) {
  Certificate certificate;
  certificate.initial_set.lower = Eigen::Vector4d(0.75, 0, 0.5, 0);
  certificate.initial_set.upper = Eigen::Vector4d(1.25, 0, 1.5, 0);
  certificate.controls = Eigen::Vector2d(ax, 0);
  return certificate;
}

Limit AtMost(const char* that, double bound) { return {.name = "it", .that = {that, 1, 1}, .at_most = bound}; }
Limit AtLeast(const char* that, double bound) { return {.name = "it", .that = {that, 1, 1}, .at_least = bound}; }

Verdict Judge(const Limit& limit, const Certificate& certificate = OneStep()) {
  const auto problem = Halves();
  problem->limits = {AtMost("px", 7), limit};
  return Judge(problem, certificate);
}

void ExpectDecided(const char* that, double least, double most, int first, int last) {
  SCOPED_TRACE(that);
  ExpectConfirmed(Judge(AtMost(that, most + kHair)));
  ExpectRefuted(Judge(AtMost(that, most - kHair)), last, "the slice keeps the limit it");
  ExpectConfirmed(Judge(AtLeast(that, least - kHair)));
  ExpectRefuted(Judge(AtLeast(that, least + kHair)), first, "the slice keeps the limit it");
}

TEST(LimitOf, ALimitOfAFunctionIsDecidedWithinAHair) {
  ExpectDecided("px", 0.75, 2, 0, 1);
  ExpectDecided("vx^2", 0.25, 2.25, 0, 0);
  ExpectDecided("exp(px)", std::exp(0.75), std::exp(2), 0, 1);
  ExpectDecided("abs(vx - 0.5)", 0, 1, 0, 0);
  ExpectDecided("px - vx/2", 0, 1.25, 0, 1);  // in the box of the second slice it is 0.25 to 1.75
  ExpectDecided("dt*vx", 0.25, 0.75, 0, 0);
}

TEST(LimitOf, AnInputHoldsWhereItIsApplied) {
  ExpectConfirmed(Judge(AtMost("vx + ax", 1.5 + kHair)));
  ExpectConfirmed(Judge(AtMost("vx + ax", 3.5 + kHair), OneStep(2)));
  ExpectRefuted(Judge(AtMost("vx + ax", 3.5 - kHair), OneStep(2)), 0, "the slice keeps");
  ExpectRefuted(Judge(AtMost("vx", 2.5 - kHair), OneStep(2)), 1, "the slice keeps");
}

TEST(LimitOf, AFunctionWithoutABoundIsNotConfirmed) {
  for (const char* that : {"1/(vx - 1)", "log(vx - 1)", "tan(px + vx)", "sqrt(vx - 1)"})
    EXPECT_NE(Judge(AtMost(that, 1e300)).status, Status::kConfirmed) << that;
}

TEST(LimitOf, AnAstronomicalAngleCannotBeVerified) {
  for (const char* that : {"sin(2^(30*px)^3)", "cos(exp(exp(30*px)))", "tan((1e200*px)^64^64)"}) {
    const Verdict verdict = Judge(AtMost(that, 7));
    EXPECT_EQ(verdict.status, Status::kCannotVerify) << that;
    EXPECT_THAT(verdict.failure.found, testing::HasSubstr("an angle of 2^16384 or more")) << that;
  }
}

// x y over [-1, 1]^2 from a slice that is no box: enclosed by more than it reaches, so that neither is shown.
TEST(LimitOf, ALimitThatIsNotShownExceededIsNotRefuted) {
  Certificate certificate = OneStep();
  certificate.initial_set = {};
  certificate.initial_set.center = Eigen::Vector4d(0, 0, 0, 0);
  certificate.initial_set.generators = Eigen::Vector4d(1, 1, 0, 0);
  const Verdict verdict = Judge(AtLeast("px*py", -0.5), certificate);
  EXPECT_EQ(verdict.status, Status::kCannotVerify);
  EXPECT_FALSE(verdict.failure.certain);
}

TEST(LimitOf, WhatIsLeftOfAPlanCountsFromItsFirstStep) {
  Certificate certificate = OneStep(-2);
  const Limit limit = AtMost("vx", 1);
  ExpectRefuted(Judge(limit, certificate), 0, "the slice keeps");
  certificate.is_remainder = true;
  certificate.first_step = 1;
  ExpectConfirmed(Judge(limit, certificate));
}

TEST(LimitOf, AMalformedExpressionCannotBeVerified) {
  const Verdict verdict = Judge(AtMost("vx +", 9));
  EXPECT_EQ(verdict.status, Status::kCannotVerify);
  EXPECT_THAT(verdict.failure.what, testing::HasSubstr("a limit, place or disturbance is no expression"));
}

}  // namespace forereach::verifier::limits_test
