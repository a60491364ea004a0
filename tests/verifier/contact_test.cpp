// Motions that data and declaration allow, and obstacles that they provably touch.
#include "tests/test.h"

#include <random>

#include "forereach/certify/pieces.h"
#include "tests/worlds.h"
#include "verifier/verifier.h"

namespace forereach::contact_test {

using verifier::Certificate;
using verifier::Verifier;

// A point mass at (4, 0) with vx = 1, in steps of 0.5 s: the residual of px changes by at most 0.25 for each metre of
// px, and is `observed` at px = 0. So at px = 4 the upper extension is observed + 1.
struct ContactTest : testing::Test {
  ContactTest() { Observe(0.5); }

  void Observe(double observed) {
    problem_.declaration.lipschitz(0, 0) = 0.25;
    problem_.transitions.x_next(0, 0) = observed;
  }
  // A circle of 1 m whose edge on the way of px is at `edge`.
  [[nodiscard]] bool Touches(double edge, bool upper = true, int steps = 1) const {
    Certificate claimed;
    claimed.initial_set.center = Vec({4, 0, 1, 0});
    claimed.initial_set.generators = Eigen::MatrixXd(4, 0);
    claimed.controls = Eigen::MatrixXd::Zero(2, steps);
    claimed.obstacles = {Obstacle::Circle(Eigen::Vector2d(upper ? edge + 1 : edge - 1, 0), 1)};
    return Verifier(std::make_shared<Problem>(problem_), verifier::MethodOf(problem_))
        .FindContact(claimed, {upper, false, false, false})
        .has_value();
  }

  Problem problem_ = PointMassInHalves();
};

constexpr double kHair = 1e-12;  // above the unit of what was observed

TEST_F(ContactTest, IsThatOfTheExtensionOfTheData) {
  EXPECT_TRUE(Touches(6 - kHair)) << "4 + 0.5 + 0.5 + 1";
  EXPECT_FALSE(Touches(6 + kHair));
  EXPECT_TRUE(Touches(4 + kHair, false)) << "4 + 0.5 + 0.5 - 1";
  EXPECT_FALSE(Touches(4 - kHair, false));
}

TEST_F(ContactTest, NoiseAndDisturbanceCount) {
  problem_.declaration.noise_bound[0] = 0.125;
  EXPECT_TRUE(Touches(6.125 - kHair));
  EXPECT_FALSE(Touches(6.125 + kHair));
  problem_.declaration.disturbance = Vec({0.0625, 0, 0, 0});
  EXPECT_TRUE(Touches(6.25 - kHair)) << "of what was observed and of the step";
  EXPECT_FALSE(Touches(6.25 + kHair));
}

TEST_F(ContactTest, AnyObservationNarrowsIt) {
  problem_.transitions.z = Eigen::MatrixXd{{0, 0, 0, 0, 0, 0}, {5, 0, 0, 0, 0, 0}};
  problem_.transitions.x_next = Eigen::MatrixXd{{0.5, 0, 0, 0}, {5.25, 0, 0, 0}};
  EXPECT_TRUE(Touches(5 - kHair)) << "4 + 0.5 + 0.25 + 0.25";
  EXPECT_FALSE(Touches(5 + kHair));
}

TEST_F(ContactTest, DataThatContradictTheDeclarationAllowNone) {
  problem_.transitions.z = Eigen::MatrixXd{{0, 0, 0, 0, 0, 0}, {1, 0, 0, 0, 0, 0}};
  problem_.transitions.x_next = Eigen::MatrixXd{{0.5, 0, 0, 0}, {1.75, 0, 0, 0}};
  EXPECT_TRUE(Touches(4)) << "as far apart as the slope allows";
  problem_.transitions.x_next(1, 0) = 1.75 + 1e-9;
  EXPECT_FALSE(Touches(4));
}

TEST_F(ContactTest, WhatIsNotFollowedIsNotSaid) {
  EXPECT_TRUE(Touches(5));
  const auto unsaid = [&](auto change) {
    ContactTest::problem_ = PointMassInHalves();
    Observe(0.5);
    change(problem_);
    return !Touches(5);
  };
  EXPECT_TRUE(unsaid([](Problem& p) { p.declaration.state_error = Vec({0.1, 0, 0, 0}); }));
  EXPECT_TRUE(unsaid([](Problem& p) { p.declaration.input_error = Vec({0.1, 0}); }));
  EXPECT_TRUE(unsaid([](Problem& p) { p.declaration.growing = Growing(*p.model, {"vx", "0", "0", "0"}); }));
  EXPECT_TRUE(unsaid([](Problem& p) { p.timing.error = 0.01; }));
  EXPECT_TRUE(unsaid([](Problem& p) { p.declaration.regions = {{{{0, {0, 10}}}, p.declaration.lipschitz}}; }));
}

// Where one motion touches, the certifier certifies nothing, whole or in pieces.
TEST(ContactOfABicycle, IsNeverCertifiedClear) {
  int touched = 0, certified = 0;
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto in = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    Problem problem = PaperBicycle();
    problem.declaration.lipschitz(2, 3) = 0.018;
    problem.declaration.lipschitz(2, 5) = 0.61;
    problem.transitions.z = Eigen::MatrixXd::Zero(20, 8);
    problem.transitions.x_next = Eigen::MatrixXd::Zero(20, 6);
    for (int i = 0; i < 20; ++i) {
      const std::vector<double> z{0, 0, 0, in(8, 14), 0, in(0.2, 0.4), 0, 0};
      std::vector<double> next(6);
      problem.model->Evaluate(z, next);
      next[2] += 0.009 * (z[3] - 11) - 0.3 * z[5];
      problem.transitions.z.row(i) = Eigen::Map<const Eigen::RowVectorXd>(z.data(), 8);
      problem.transitions.x_next.row(i) = Eigen::Map<const Eigen::RowVectorXd>(next.data(), 6);
    }
    const auto shared = std::make_shared<Problem>(problem);
    const Eigen::VectorXd center = Vec({0, 0, 0, in(9, 13), 0, in(0.25, 0.35)}),
                          half_width = Vec({0.025, 0.025, 0.005, 0.025, 0.01, 0.002});
    Certificate claimed;
    claimed.controls = Vec({in(-0.5, 0.5), in(-0.05, 0.05)}).replicate(1, 12);
    claimed.initial_set.center = center;
    for (int k = 0; k < 6; ++k) claimed.initial_set.center[k] += (random() % 2 ? 1 : -1) * 0.999 * half_width[k];
    claimed.initial_set.generators = Eigen::MatrixXd(6, 0);
    claimed.obstacles = {Obstacle::Circle(Eigen::Vector2d(in(8, 13), in(0, 7)), 1)};
    Tube tube;
    const bool is_certified =
        CertifyInPieces(Certifier(shared), {claimed.controls.data(), 2, 12, 2}, Zonotope::FromBox(center, half_width),
                        claimed.obstacles, Pieces::kMost, tube)
            .outcome == Outcome::kCertified;
    const Verifier verifier(shared, verifier::MethodOf(problem));
    for (const bool upper : {false, true}) {
      const auto contact = verifier.FindContact(claimed, {false, false, upper, false, false, false});
      EXPECT_FALSE(is_certified && contact) << contact->what;
      touched += contact.has_value();
    }
    certified += is_certified;
  }
  EXPECT_GT(touched, 5);
  EXPECT_GT(certified, 5);
}

TEST_F(ContactTest, OfASampleCountsNotOfTheWayBetween) {
  EXPECT_FALSE(Touches(7)) << "it ends before";
  problem_.between = Between{.acceleration = Eigen::Vector2d(100, 100), .period = 0.5};
  EXPECT_FALSE(Touches(7)) << "the bounds allow a bulge that this motion need not have";
}

TEST_F(ContactTest, IsNotSaidWhereBoundsBetweenSamplesMayRuleItsMotionOut) {
  ASSERT_TRUE(Touches(6 - kHair));
  problem_.between = Between{.acceleration = Eigen::Vector2d(100, 100), .period = 0.5};
  EXPECT_FALSE(Touches(6 - kHair));
}

}  // namespace forereach::contact_test
