// Certificates made by hand, true by a hair and false by a hair, and the certifier's own with one thing changed.

#include "forereach/certify/tube.h"
#include "tests/oracle/traced_random.h"
#include "tests/verifier/hand_made.h"
#include "tests/verifier/record.h"
#include "verifier/containment.h"
#include "verifier/equations.h"
#include "verifier/tube.h"

namespace forereach::verifier::verifier_test {

// One step with u = (1, 0) from the unit box: X_1 has center (1/8, 0, 1/2, 0) and half-widths (3/2, 3/2, 1, 1), and
// kTiny more.
Certificate OneStep() {
  Certificate certificate;
  certificate.initial_set.lower = Eigen::Vector4d::Constant(-1);
  certificate.initial_set.upper = Eigen::Vector4d::Constant(1);
  certificate.controls = Eigen::Vector2d(1, 0);
  RecordedSlice first, second;
  first.lower = certificate.initial_set.lower;
  first.upper = certificate.initial_set.upper;
  second.lower = Eigen::Vector4d(Down(-1.375), Down(-1.5), Down(-0.5), Down(-1));
  second.upper = Eigen::Vector4d(Up(1.625), Up(1.5), Up(1.5), Up(1));
  certificate.slices = {first, second};
  return certificate;
}

TEST(HandMade, TrueToTheLastBitIsConfirmed) { ExpectConfirmed(Judge(Halves(), OneStep())); }

// The slices are [-1, 1]^2, then [-1.375, 1.625] by [-1.5, 1.5]. No obstacle says anything.
TEST(StayIn, IsJudgedByTheSidesAlone) {
  constexpr double kHair = 1e-9;
  const auto judge = [](std::vector<std::vector<Eigen::Vector2d>> rings) {
    Certificate certificate = OneStep();
    certificate.stay_in = {{"yard", std::move(rings)}};
    return Judge(Halves(), certificate);
  };
  const auto notched = [](double x) {  // a yard with a notch, whose tip is at x
    return std::vector<Eigen::Vector2d>{{-2, -2}, {4, -2}, {4, 0}, {x, 0}, {4, 1}, {4, 2}, {-2, 2}};
  };
  ExpectConfirmed(judge({notched(1.625 + kHair)}));
  ExpectRefuted(judge({notched(1.625 - kHair)}), 1, "the body stays in yard");
  ExpectRefuted(judge({notched(-1)}), 0, "the body stays in yard");
  ExpectRefuted(judge({{{5, 0}, {6, 0}, {6, 1}}}), 0, "the body stays in yard");
  ExpectRefuted(judge({{{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}}}), 0, "the body stays in yard");
  const auto with_hole = [&](double x) { return judge({notched(3), {{x, 0}, {x + 0.5, 0}, {x + 0.25, 0.5}}}); };
  ExpectConfirmed(with_hole(1.625 + kHair));
  ExpectRefuted(with_hole(1.625 - kHair), 1, "the body stays in yard");
  ExpectRefuted(judge({notched(3), {{-3, -3}, {5, -3}, {5, 3}, {-3, 3}}}), 0, "stays in yard");
}

// f0(z) - f0(c) - J (z - c) lies inside the split remainder, wherever in the slice z is.
TEST(SplitRemainder, HoldsAllOverTheSlice) {
  const auto problem = std::make_shared<Problem>(
      WorldOf(MakeKinematicBicycle(0.1, 2.5), Within({1e3, 1e3, 20, 100, 10, 1.5}), Within({10, 1})));
  const auto equations = EquationsOf(*problem->model);
  constexpr int kTheta = 2, kV = 3, kDelta = 5;
  for (TracedRandom random(51); random.Again(300);) {
    Eigen::VectorXd center = Eigen::VectorXd::Zero(6), half = Eigen::VectorXd::Zero(6);
    center[kTheta] = random.Uniform(-3, 3), center[kV] = random.Uniform(-20, 20),
    center[kDelta] = random.Uniform(-0.6, 0.6);
    half[kTheta] = random.Uniform(0, random.Coin() ? 0.1 : 3);
    if (random.Coin()) half[kV] = random.Uniform(0, 5);
    if (random.Coin()) half[kDelta] = random.Uniform(0, random.Coin() ? 0.01 : 0.4);
    if (random.Coin(0.3))
      center[kDelta] = random.Sign() * random.Uniform(0.8, 1), half[kDelta] = 0.49;  // next to the pole
    InitialSet initial_set{.center = center, .generators = half.asDiagonal()};
    for (const Method method : {Method::kPaper, Method::kCentred}) {
      const Tube tube = TubeMaker(*problem, *equations, method)
                            .Make(initial_set, Eigen::MatrixXd::Zero(2, 1), {.split_remainder = true});
      ASSERT_FALSE(tube.failure);
      std::vector<Real> c(center.begin(), center.end());
      c.resize(8);
      const std::vector<Real> nominal = equations->Value(c);
      const auto jacobian = equations->First(c);
      for (int sample = 0; sample < 20; ++sample) {
        std::vector<Real> z = c, d(8);
        for (const int k : {kTheta, kV, kDelta}) {
          const auto i = static_cast<std::size_t>(k);
          d[i] = Real(random.Coin(0.7) ? random.Sign() : random.Uniform(-1, 1)) * Real(half[k]);
          z[i] += d[i];
        }
        std::vector<Real> rest = equations->Value(z);
        for (std::size_t k = 0; k < 6; ++k) rest[k] -= nominal[k];
        for (const auto& [output, variable, value] : jacobian)
          rest[static_cast<std::size_t>(output)] -= value * d[static_cast<std::size_t>(variable)];
        for (std::size_t k = 0; k < 6; ++k) {
          const auto& [lower, upper] = tube.steps[0].remainder[k];
          const Real rounding(0x1p-150);  // of 256 bits
          ASSERT_TRUE(CertainlyAtMost(lower - rounding, rest[k]) && CertainlyAtMost(rest[k], upper + rounding))
              << "trial " << random.trial() << ", coordinate " << k << ": " << rest[k].text() << " outside ["
              << lower.text() << ", " << upper.text() << "]";
        }
      }
    }
  }
}

TEST(Containment, AColumnThatNothingCoversIsSeen) {
  const auto is_inside = [](const std::vector<std::vector<Real>>& columns, const Eigen::MatrixXd& generators) {
    return IsInside({{Real(), Real()}, columns}, Eigen::Vector2d::Zero(), generators).answer == Answer::kYes;
  };
  const std::vector<Real> diagonal{1.0, 1.0}, across{1.0, -1.0}, axis{0.5, 0.0};
  const Eigen::MatrixXd both{{1, 1}, {1, -1}}, one{{1}, {1}}, with_axis{{1, 0.5}, {1, 0}};
  EXPECT_TRUE(is_inside({diagonal, across}, both));
  EXPECT_FALSE(is_inside({diagonal, across}, one));
  EXPECT_TRUE(is_inside({diagonal, axis}, with_axis));
  EXPECT_FALSE(is_inside({diagonal, axis}, one));
  EXPECT_FALSE(is_inside({diagonal, across, axis}, with_axis));
}

TEST(Containment, ACenterMovesNoFurtherThanTheAxesHaveRoom) {
  const auto answer = [](double x, double y, const std::vector<std::vector<Real>>& columns,
                         const Eigen::MatrixXd& generators) {
    return IsInside({{Real(x), Real(y)}, columns}, Eigen::Vector2d(1, 2), generators).answer;
  };
  const std::vector<Real> diagonal{1.0, 1.0}, axis{0.25, 0.0};
  const Eigen::MatrixXd one{{1}, {1}}, with_axis{{1, 0.5}, {1, 0}};
  for (const double sign : {-1, 1}) {
    EXPECT_EQ(answer(1 + sign * 0.5, 2, {diagonal}, with_axis), Answer::kYes);
    EXPECT_NE(answer(1 + sign * Up(0.5 + 0x1p-50), 2, {diagonal}, with_axis), Answer::kYes);
    EXPECT_EQ(answer(1 + sign * 0.25, 2, {diagonal, axis}, with_axis), Answer::kYes);
    EXPECT_NE(answer(1 + sign * 0.375, 2, {diagonal, axis}, with_axis), Answer::kYes);
    EXPECT_NE(answer(1, 2 + sign * 0x1p-50, {diagonal}, with_axis), Answer::kYes);
    EXPECT_EQ(answer(1 + sign * 0.5, 2 - sign * 0.5, {diagonal}, one), Answer::kNo) << "away from the segment";
    EXPECT_EQ(answer(1 + sign * 3, 2 + sign * 3, {diagonal}, one), Answer::kNo) << "along the segment";
  }
}

TEST(Containment, AGeneratorCoversOneColumnThatIsNoLonger) {
  const auto is_inside = [](const std::vector<std::vector<Real>>& columns) {
    return IsInside({{Real(), Real()}, columns}, Eigen::Vector2d::Zero(), Eigen::MatrixXd{{1}, {1}}).answer ==
           Answer::kYes;
  };
  const std::vector<Real> same{1.0, 1.0}, opposite{-1.0, -1.0}, shorter{0.5, 0.5}, longer{1 + 0x1p-52, 1 + 0x1p-52};
  EXPECT_TRUE(is_inside({same}) && is_inside({opposite}) && is_inside({shorter}));
  EXPECT_FALSE(is_inside({longer}));
  EXPECT_FALSE(is_inside({same, shorter}));
}

TEST(Containment, WhatIsFarInACoordinateWithRoomIsNear) {
  const auto is_inside = [](double room) {
    const Eigen::MatrixXd generators{{1, 2, 0.125, 0}, {1e9, 1e9, 0, room}};
    const std::vector<std::vector<Real>> columns{{1.0, 1e-3}, {2.0, -3e-3}, {0.125, 1e-3}};
    return IsInside({{Real(), Real()}, columns}, Eigen::Vector2d::Zero(), generators).answer == Answer::kYes;
  };
  EXPECT_TRUE(is_inside(1e15));
  EXPECT_FALSE(is_inside(1e9)) << "two columns differ by so much there";
}

TEST(HandMade, APlanThatDoesNotEndStandingIsRefuted) {
  const auto within = [](int coordinate, double tolerance) {
    const auto problem = Halves();
    problem->rest = {{coordinate, tolerance}};
    return problem;
  };
  ExpectConfirmed(Judge(within(2, Up(1.5)), OneStep()));
  ExpectRefuted(Judge(within(2, 1.5), OneStep()), 1, "the plan ends standing: vx");
  Certificate of_hulls_unknown = OneStep();
  of_hulls_unknown.slices.clear();
  ExpectConfirmed(Judge(within(2, Up(1.5)), of_hulls_unknown));
  ExpectRefuted(Judge(within(2, 1.5), of_hulls_unknown), 1, "the plan ends standing: vx of the last slice");
  Certificate wide = OneStep();
  wide.slices[1].lower[3] = -2;  // true, but it does not show that the robot stands
  ExpectConfirmed(Judge(Halves(), wide));
  ExpectRefuted(Judge(within(3, 1.5), wide), 1, "vy of the last recorded hull");
  wide = OneStep();
  wide.slices[0].lower[3] = -2;  // at the start it may drive
  ExpectConfirmed(Judge(within(3, 1.5), wide));
}

TEST(HandMade, ASliceWithoutItsLastBitIsRefuted) {
  for (int k = 0; k < 4; ++k) {
    Certificate certificate = OneStep();
    certificate.slices[1].upper[k] = Down(certificate.slices[1].upper[k]);  // now short by the smallest double
    ExpectRefuted(Judge(Halves(), certificate), 1, "hull");
    certificate = OneStep();
    certificate.slices[1].lower[k] = Up(certificate.slices[1].lower[k]);
    ExpectRefuted(Judge(Halves(), certificate), 1, "hull");
    certificate = OneStep();
    certificate.slices[0].upper[k] = Down(1);
    ExpectRefuted(Judge(Halves(), certificate), 0, "hull");
  }
}

// Of so many transitions not all are kept in 256 bits. The last one alone says that the residual is known to kTiny.
TEST(HandMade, TheLastOfManyTransitionsCountsToItsLastBit) {
  const auto problem = Halves();
  const Eigen::Index count = 17'000;
  Transitions& data = problem->transitions;
  const Eigen::RowVectorXd z = data.z.row(0), next = data.x_next.row(0);
  data.z = Eigen::RowVectorXd::Ones(6).replicate(count, 1);
  data.x_next = Eigen::RowVector4d(1.625, 1.625, 1.5, 1.5).replicate(count, 1);
  data.z.row(count - 1) = z, data.x_next.row(count - 1) = next;
  ExpectConfirmed(Judge(problem, OneStep()));
  Certificate certificate = OneStep();
  certificate.slices[1].upper[0] = Down(certificate.slices[1].upper[0]);
  ExpectRefuted(Judge(problem, certificate), 1, "hull");
  certificate = OneStep();
  certificate.known = {.base = static_cast<int>(count) - 1};
  ExpectRefuted(Judge(problem, certificate), 1, "hull");
}

TEST(HandMade, DomainIsClosed) {
  const auto problem = Halves();
  problem->domain.state = Box(Eigen::Vector4d::Constant(-1), Eigen::Vector4d::Constant(1));
  ExpectConfirmed(Judge(problem, OneStep()));
  problem->domain.state = Box(Eigen::Vector4d::Constant(-1), Eigen::Vector4d(1, 1, 1, Down(1)));
  ExpectRefuted(Judge(problem, OneStep()), 0, "domain: vy");
  problem->domain.input = Box(Eigen::Vector2d(-2, -2), Eigen::Vector2d(Down(1), 2));
  problem->domain.state = Box(Eigen::Vector4d::Constant(-1), Eigen::Vector4d::Constant(1));
  ExpectRefuted(Judge(problem, OneStep()), 0, "domain: ax");
}

TEST(HandMade, InequalitiesAndBallsAreClosed) {
  const auto problem = Halves();
  Eigen::VectorXd normal(6);
  normal << 1, 0, 0, -1, 2, 0;  // reaches 1 + 1 + 2
  problem->domain.inequalities = {{normal, 4}};
  problem->domain.balls = {{{0, 1}, Eigen::Vector2d(-2, -3), 5}};  // corner (1, 1) is 3-4-5 away
  ExpectConfirmed(Judge(problem, OneStep()));
  problem->domain.inequalities[0].bound = Down(4);
  ExpectRefuted(Judge(problem, OneStep()), 0, "inequality 0");
  problem->domain.inequalities.clear();
  problem->domain.balls[0].radius = Down(5);
  ExpectRefuted(Judge(problem, OneStep()), 0, "ball 0");
}

TEST(HandMade, TouchingIsNotClear) {
  Certificate certificate = OneStep();
  const Eigen::Vector2d right(1, 0);
  certificate.obstacles = {Obstacle::HalfSpace(right, Up(1.625))};
  ExpectConfirmed(Judge(Halves(), certificate));
  certificate.obstacles = {Obstacle::HalfSpace(right, 1.625)};  // X_1 reaches kTiny into it
  ExpectRefuted(Judge(Halves(), certificate), 1, "clear of obstacle 0");
  certificate.obstacles = {Obstacle::HalfSpace(right, 9), Obstacle::Circle(Eigen::Vector2d(0, 0), 0)};
  ExpectRefuted(Judge(Halves(), certificate), 0, "clear of obstacle 1");
}

TEST(HandMade, AClearanceAboveTheDistanceIsRefuted) {
  Certificate certificate = OneStep();
  certificate.obstacles = {Obstacle::Circle(Eigen::Vector2d(4, 5), 2)};
  certificate.slices[0].clearance = {3};
  certificate.slices[1].clearance = {2};
  ExpectConfirmed(Judge(Halves(), certificate));
  certificate.slices[0].clearance = {Up(3)};
  ExpectRefuted(Judge(Halves(), certificate), 0, "by what is recorded");
  certificate.slices[0].clearance = {0};
  ExpectRefuted(Judge(Halves(), certificate), 0, "claims to be clear");
  certificate.slices[0].clearance = {std::nan("")};
  ExpectRefuted(Judge(Halves(), certificate), 0, "claims to be clear");
}

TEST(HandMade, EnvelopeRemainderAndRadiusAreDecidedToTheLastBit) {
  Certificate certificate = OneStep();
  certificate.slices[0].envelope_lower = Eigen::Vector4d::Constant(-kTiny);
  certificate.slices[0].envelope_upper = Eigen::Vector4d::Constant(kTiny);
  certificate.slices[0].remainder = Eigen::Vector4d::Zero();
  certificate.slices[0].radius = std::sqrt(2);  // the double is above the root
  ExpectConfirmed(Judge(Halves(), certificate));
  certificate.slices[0].radius = Down(std::sqrt(2));
  ExpectRefuted(Judge(Halves(), certificate), 0, "radius");
  certificate.slices[0].envelope_upper[2] = 0;
  ExpectRefuted(Judge(Halves(), certificate), 0, "residual of vx");
}

// Once for the observed step, and once for this one.
TEST(HandMade, ADisturbanceCountsForBothSteps) {
  const auto problem = Halves();
  problem->declaration.disturbance = Eigen::Vector4d(0.125, 0, 0, 0);
  const auto certificate = [](double lower, double upper) {
    Certificate one_step = OneStep();
    one_step.slices[0].envelope_lower = Eigen::Vector4d(Down(-0.125), -kTiny, -kTiny, -kTiny);
    one_step.slices[0].envelope_upper = Eigen::Vector4d(Up(0.125), kTiny, kTiny, kTiny);
    one_step.slices[1].lower[0] = lower;
    one_step.slices[1].upper[0] = upper;
    return one_step;
  };
  const double lower = -1.375 - 0.25, upper = 1.625 + 0.25;
  ExpectConfirmed(Judge(problem, certificate(Down(lower), Up(upper))));
  ExpectRefuted(Judge(problem, certificate(lower, Up(upper))), 1, "hull contains px");
  ExpectRefuted(Judge(problem, certificate(Down(lower), upper)), 1, "hull contains px");
  Certificate sure_of_the_residual = certificate(Down(lower), Up(upper));
  sure_of_the_residual.slices[0].envelope_upper[0] = 0.125;
  ExpectRefuted(Judge(problem, sure_of_the_residual), 0, "residual of px");
}

// |ax| is 0 where the step was observed, give or take its error of 1/8, and 1 in this step, by the same error.
TEST(HandMade, ADisturbanceThatGrowsCountsWhereTheStepsAre) {
  const auto problem = Halves();
  problem->declaration.input_error = Eigen::Vector2d(0.125, 0);
  problem->declaration.growing = Growing(*problem->model, {"0", "0", "0", "-ax*abs(vy + 2)/3"});
  const auto certificate = [](double observed, double stepped) {
    Certificate one_step = OneStep();
    one_step.slices[0].envelope_lower = Eigen::Vector4d(-1, -1, -1, -observed);
    one_step.slices[0].envelope_upper = Eigen::Vector4d(1, 1, 1, observed);
    one_step.slices[1].lower -= Eigen::Vector4d(1, 0, 1, stepped);
    one_step.slices[1].upper += Eigen::Vector4d(1, 0, 1, stepped);
    return one_step;
  };
  constexpr double kHair = 1e-15, kObserved = 0.125 * 2 / 3, kStepped = kObserved + 1.125;
  ExpectConfirmed(Judge(problem, certificate(kObserved + kHair, kStepped + kHair)));
  ExpectRefuted(Judge(problem, certificate(kObserved - kHair, kStepped + kHair)), 0, "residual of vy");
  ExpectRefuted(Judge(problem, certificate(kObserved + kHair, kStepped - kHair)), 1, "hull contains vy");
}

TEST(HandMade, WithoutABoundOnTheDisturbanceNothingIsKnown) {
  const auto problem = Halves();
  Certificate wide = OneStep();
  wide.slices[1].lower.setConstant(-1e300);
  wide.slices[1].upper.setConstant(1e300);
  problem->declaration.growing = Growing(*problem->model, {"1/(vx - 2)", "0", "0", "0"});
  ExpectConfirmed(Judge(problem, wide));
  problem->declaration.growing = Growing(*problem->model, {"1/(vx - 0.5)", "0", "0", "0"});
  EXPECT_NE(Judge(problem, wide).status, Status::kConfirmed);
}

// px+ = px + vx / 2 + ax / 8. With e = 1/4 in vx and 1/8 in ax, L = 1/2 of px by vx and of vx by ax:
// px: 1/8 + 1/64 + 1/8, vx: 1/4 after the step, 1/4 before it, 1/16 by ax, and 1/16.
TEST(HandMade, ErrorsOfTheRecordCountForSuccessorModelAndResidual) {
  const auto problem = Halves();
  problem->declaration.lipschitz(0, 2) = problem->declaration.lipschitz(2, 4) = 0.5;
  problem->declaration.state_error = Eigen::Vector4d(0, 0, 0.25, 0);
  problem->declaration.input_error = Eigen::Vector2d(0.125, 0);
  const double px = 0.265625, vx = 0.625;
  const auto certificate = [&](double of_px, double of_vx) {
    Certificate here = OneStep();  // D: 1/2 of px over the box of speeds, 1/2 of vx at the input 1
    here.slices[0].envelope_lower = Eigen::Vector4d(-of_px - 0.5, -kTiny, -of_vx - 0.5, -kTiny);
    here.slices[0].envelope_upper = Eigen::Vector4d(of_px + 0.5, kTiny, of_vx + 0.5, kTiny);
    here.slices[1].lower -= Eigen::Vector4d(1, 0, 2, 0);
    here.slices[1].upper += Eigen::Vector4d(1, 0, 2, 0);
    return here;
  };
  constexpr double kHair = 1e-15;
  ExpectConfirmed(Judge(problem, certificate(px + kHair, vx + kHair)));
  ExpectRefuted(Judge(problem, certificate(px - kHair, vx + kHair)), 0, "residual of px");
  ExpectRefuted(Judge(problem, certificate(px + kHair, vx - kHair)), 0, "residual of vx");
}

// Within its error the only transition may lie outside the domain: then nothing is known of the residual.
TEST(HandMade, ATransitionThatMayLieOutsideTheDomainSaysNothing) {
  const auto problem = Halves();
  const auto with = [&](double error) {
    problem->declaration.state_error = Eigen::Vector4d(error, 0, 0, 0);
    Certificate wide = OneStep();
    wide.slices[1].lower[0] = -100;
    wide.slices[1].upper[0] = 100;
    return Judge(problem, wide);
  };
  ExpectConfirmed(with(8));
  EXPECT_NE(with(Up(8)).status, Status::kConfirmed);
}

TEST(HandMade, DistanceFromSetToSampleIsExact) {
  const auto problem = Halves();
  problem->declaration.lipschitz(0, 2) = 0.25;  // two columns: over the unit box D = 1/4 + 1/2 at the sample 0
  problem->declaration.lipschitz(0, 3) = 0.5;
  Certificate certificate = OneStep();
  certificate.slices[0].envelope_lower = Eigen::Vector4d(Down(-0.75), -kTiny, -kTiny, -kTiny);
  certificate.slices[0].envelope_upper = Eigen::Vector4d(Up(0.75), kTiny, kTiny, kTiny);
  certificate.slices[1].upper[0] = Up(1.625 + 0.75);
  certificate.slices[1].lower[0] = Down(-1.375 - 0.75);
  ExpectConfirmed(Judge(problem, certificate));
  certificate.slices[0].envelope_upper[0] = 0.75;
  ExpectRefuted(Judge(problem, certificate), 0, "residual of px");
  // On the diagonal v = (b, -b), seen from the sample at v = (1, 1): |b - 1| / 4 + |b + 1| / 2 <= 1, over the box 3/2.
  problem->transitions.z.row(0) << 0, 0, 1, 1, 0, 0;
  problem->transitions.x_next.row(0) << 0.5, 0.5, 1, 1;
  certificate = OneStep();
  certificate.initial_set = {{}, {}, Eigen::Vector4d::Zero(), Eigen::Vector4d(0, 0, 1, -1)};
  EXPECT_DOUBLE_EQ(Verifier(problem, Method::kPaper).Derive(certificate).steps[0].envelope[0].upper.ToDouble(), 1);
}

TEST(HandMade, ContradictingDataAreNoCertificate) {
  const auto problem = Halves();
  problem->transitions = {Eigen::MatrixXd::Zero(2, 6), Eigen::MatrixXd::Zero(2, 4)};
  problem->transitions.x_next(1, 3) = 0.5;  // a constant residual cannot be 0 and 1/2
  ExpectRefuted(Judge(problem, OneStep()), 0, "consistent");
}

// px + vx / 2 = 0 of terms 4 and -4, and a successor of 2^-51 beside one of 0: a certificate has to hold for both.
TEST(HandMade, AContradictionOfRoundingSizeWidensTheSlice) {
  const auto problem = Halves();
  problem->transitions = {Eigen::MatrixXd::Zero(2, 6), Eigen::MatrixXd::Zero(2, 4)};
  problem->transitions.z(1, 0) = 4;
  problem->transitions.z(1, 2) = problem->transitions.x_next(1, 2) = -8;
  problem->transitions.x_next(1, 0) = 0x1p-51;
  Certificate certificate = OneStep();
  certificate.slices[1].upper[0] = 1.625 + 0x1p-51;
  ExpectConfirmed(Judge(problem, certificate));
  certificate.slices[1].upper[0] = Up(1.625);
  ExpectRefuted(Judge(problem, certificate), 1, "hull contains px");
  certificate = OneStep();  // the observation of 0 still bounds from above, but for its last bit
  certificate.slices[1].upper[0] = 1.625 + 0x1p-51;
  certificate.slices[1].lower[0] = Up(Up(-1.375));
  ExpectRefuted(Judge(problem, certificate), 1, "hull contains px");
}

// A bicycle at v = 1 with theta within 1/4, for one step.
std::pair<std::shared_ptr<Problem>, Certificate> Turning() {
  auto problem = std::make_shared<Problem>(
      WorldOf(MakeKinematicBicycle(0.5, 1), Within({1.5, 1.5, 1.5, 1.5, 1.5, 1.5}), Within({2, 2})));
  Certificate certificate;
  certificate.initial_set = {{}, {}, Eigen::VectorXd::Zero(6), Eigen::VectorXd::Zero(6)};
  certificate.initial_set.center[3] = 1;
  certificate.initial_set.generators(2, 0) = 0.25;
  certificate.controls = Eigen::Vector2d(0, 0);
  return {problem, certificate};
}

TEST(HandMade, CentredRemainderKnowsTheSign) {
  const auto [problem, certificate] = Turning();  // x+ = x + cos(theta)/2 lies below x + 1/2
  const Tube paper = Verifier(problem, Method::kPaper).Derive(certificate);
  const Tube centred = Verifier(problem, Method::kCentred).Derive(certificate);
  // Here H = -cos(theta) / 2 in [-1/2, -cos(1/4)/2]: 1/2 r^2 H in [-1/64, 0].
  EXPECT_DOUBLE_EQ(paper.steps[0].remainder[0].upper.ToDouble(), 1.0 / 64);
  EXPECT_EQ(centred.steps[0].remainder[0].upper.ToDouble(), 0);
  EXPECT_DOUBLE_EQ(centred.steps[0].remainder[0].lower.ToDouble(), -1.0 / 64);
  EXPECT_DOUBLE_EQ(centred.slices[1].center[0].ToDouble(), 0.5 - 1.0 / 128);
  EXPECT_DOUBLE_EQ(paper.slices[1].center[0].ToDouble(), 0.5);
}

// The claim is true, but the certifier's rules do not show it, and no rounding explains the difference.
TEST(HandMade, AClaimThatOnlyATighterRemainderShowsIsRefuted) {
  auto [problem, certificate] = Turning();
  const auto equations = EquationsOf(*problem->model);
  for (const Method method : {Method::kPaper, Method::kCentred})
    for (const bool split : {false, true}) {
      const Tube tube = TubeMaker(*problem, *equations, method)
                            .Make(certificate.initial_set, certificate.controls, {.split_remainder = split});
      certificate.slices.assign(2, {});
      for (std::size_t t = 0; t < 2; ++t) {
        RecordedSlice& recorded = certificate.slices[t];
        recorded.lower = recorded.upper = Eigen::VectorXd::Zero(6);
        for (int k = 0; k < 6; ++k) {
          const Real& center = tube.slices[t].center[static_cast<std::size_t>(k)];
          const Real half_width = tube.slices[t].HalfWidth(k);
          recorded.lower[k] = Down((center - half_width).ToDouble());
          recorded.upper[k] = Up((center + half_width).ToDouble());
        }
      }
      const Verdict verdict = Judge(problem, certificate, method);
      split ? ExpectRefuted(verdict, 1, "hull contains y") : ExpectConfirmed(verdict);
    }
}

TEST(HandMade, CloseChoicesOfTheReductionAreTold) {
  const auto problem = Halves();
  problem->zonotope_order =
      2;  // of the 12 columns 4 are kept; the envelope's are as small as rounding and do not count
  Certificate certificate = OneStep();
  certificate.slices.clear();
  certificate.initial_set = {{}, {}, Eigen::Vector4d::Zero(), Eigen::MatrixXd(4, 12)};
  for (int j = 0; j < 12; ++j) certificate.initial_set.generators.col(j) << 0, 0, 0x1p-6 * (j + 1), 0x1p-8 * (j + 1);
  const Verifier verifier(problem, Method::kPaper);
  EXPECT_FIELDS(verifier.Derive(certificate), (ambiguity, 0), (slices[1].num_slack, 4u),
                (slices[1].columns.size(), 12u));
  certificate.initial_set.generators.col(7) = certificate.initial_set.generators.col(8) * (1 + 0x1p-50);
  EXPECT_GT(verifier.Derive(certificate).ambiguity, 0);
}

TEST(HandMade, SizesThatDoNotFitAreRefuted) {
  Certificate certificate = OneStep();
  certificate.slices.pop_back();
  ExpectRefuted(Judge(Halves(), certificate), 1, "a slice for every step");
  certificate = OneStep();
  certificate.slices[1].upper.conservativeResize(3);
  ExpectRefuted(Judge(Halves(), certificate), 1, "sizes");
  certificate = OneStep();
  certificate.controls(0, 0) = HUGE_VAL;
  ExpectRefuted(Judge(Halves(), certificate), -1, "controls");
}

TEST(HandMade, WithoutRecordedSlicesSafetyIsDerived) {
  Certificate certificate = OneStep();
  certificate.slices.clear();
  ExpectConfirmed(Judge(Halves(), certificate));
  certificate.obstacles = {Obstacle::Circle(Eigen::Vector2d(1.5, 1.5), 0.1)};
  ExpectRefuted(Judge(Halves(), certificate), 1, "clear of obstacle 0");
}

// ---- The certifier's own certificate, with one thing changed and no digest to tell.

struct Tampered : testing::Test {
  Tampered() {
    problem_ = std::make_shared<Problem>(PaperBicycle(3.1));
    problem_->declaration.lipschitz(2, 3) = 0.018;
    problem_->method = forereach::Method::kPaper;
    problem_->declaration.lipschitz(2, 5) = 0.61;
    problem_->transitions = {Eigen::MatrixXd(5, 8), Eigen::MatrixXd(5, 6)};
    for (int i = 0; i < 5; ++i) {
      Eigen::VectorXd z = Eigen::VectorXd::Zero(8), next(6);
      z[3] = 8 + i;
      z[5] = 0.02 * i;
      problem_->model->Evaluate({z.data(), 8}, {next.data(), 6});
      problem_->transitions.z.row(i) = z;
      problem_->transitions.x_next.row(i) = next;
    }
    const Certifier certifier(problem_);
    Eigen::VectorXd center = Eigen::VectorXd::Zero(6), half(6);
    center[3] = 10;
    half << 0.05, 0.05, 0.01, 0.1, 0.01, 0.005;
    const Zonotope initial_set = Zonotope::FromBox(center, half);
    const Eigen::MatrixXd controls = Eigen::Vector2d(0.5, 0.1).replicate(1, 10);
    const Plan plan{controls.data(), 2, 10, 2};
    const std::vector<Obstacle> obstacles{Obstacle::Circle(Eigen::Vector2d(9, 3), 1)};
    forereach::Tube tube;
    EXPECT_EQ(certifier.Certify(plan, initial_set, obstacles, tube).outcome, Outcome::kCertified);
    certificate_ = CertificateOf(certifier, plan, initial_set, obstacles, tube);
  }

  [[nodiscard]] Verdict Verdict_() const { return Judge(problem_, certificate_); }

  std::shared_ptr<Problem> problem_;
  Certificate certificate_;
};

TEST_F(Tampered, TheUnchangedCertificateIsConfirmed) { ExpectConfirmed(Verdict_()); }

TEST_F(Tampered, AMovedObstacleIsRefuted) {
  certificate_.obstacles = {Obstacle::Circle(Eigen::Vector2d(9, 3 - 0x1p-30), 1)};  // the clearances are now too large
  EXPECT_EQ(Verdict_().status, Status::kRefuted);
  for (RecordedSlice& slice : certificate_.slices) slice.clearance.clear();
  ExpectConfirmed(Verdict_());
  certificate_.obstacles = {Obstacle::Circle(Eigen::Vector2d(9, 0.8), 1)};
  EXPECT_THAT(Verdict_().failure.what, HasSubstr("clear of obstacle 0"));
}

TEST_F(Tampered, AShrunkenSliceIsRefuted) {
  certificate_.slices[4].half_width[0] *= 1 - 0x1p-40;
  ExpectRefuted(Verdict_(), 4, "hull");
}

TEST_F(Tampered, ADroppedGeneratorIsRefuted) {
  Eigen::MatrixXd& generators = certificate_.slices[6].generators;
  generators = generators.rightCols(generators.cols() - 1).eval();
  ExpectRefuted(Verdict_(), 6, "the hull of the recorded generators");
}

TEST_F(Tampered, AChangedSigmaIsRefuted) {
  problem_->declaration.noise_bound[2] = 1e-12;
  ExpectRefuted(Verdict_(), 0, "residual of theta");
}

TEST_F(Tampered, AChangedDisturbanceIsRefuted) {
  problem_->declaration.disturbance = Eigen::VectorXd::Zero(6);
  EXPECT_EQ(Verdict_().status, Status::kConfirmed) << "zeros change nothing";
  problem_->declaration.disturbance[2] = 1e-12;
  ExpectRefuted(Verdict_(), 0, "residual of theta");
}

TEST_F(Tampered, ADisturbanceThatGrowsElsewhereChangesNothing) {
  problem_->declaration.growing = Growing(*problem_->model, {"0", "0", "1e-12*max(0, 1 - v)", "0", "0", "0"});
  ExpectConfirmed(Verdict_());
  problem_->declaration.growing = Growing(*problem_->model, {"0", "0", "1e-12*v", "0", "0", "0"});
  ExpectRefuted(Verdict_(), 0, "residual of theta");
}

TEST_F(Tampered, AChangedDeclarationIsRefuted) {
  problem_->declaration.lipschitz(2, 5) += 1e-12;
  ExpectRefuted(Verdict_(), 0, "residual of theta");
}

TEST_F(Tampered, AChangedWheelbaseIsRefuted) {
  problem_->model = MakeKinematicBicycle(0.1, 2.49);
  EXPECT_EQ(Verdict_().status, Status::kRefuted);
}

TEST_F(Tampered, AChangedControlIsRefuted) {
  certificate_.controls(1, 3) += 1e-9;
  EXPECT_FIELDS(Verdict_(), (status, Status::kRefuted), (failure.step, 4));
}

TEST_F(Tampered, AShrunkenEnvelopeOrRemainderIsRefuted) {
  RecordedSlice& slice = certificate_.slices[3];
  const double before = slice.remainder[0];
  slice.remainder[0] *= 1 - 0x1p-30;
  ExpectRefuted(Verdict_(), 3, "remainder");
  slice.remainder[0] = before;
  slice.envelope_upper[2] -= 1e-10;
  ExpectRefuted(Verdict_(), 3, "residual of theta");
}

}  // namespace forereach::verifier::verifier_test
