// A certifier over an enclosure of the residual that the caller supplies.
#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "tests/worlds.h"

namespace forereach::given_enclosure_test {

// r(x) in slope * (x - c) +- width in the velocities, zero in the positions.
class Velocities final : public ResidualEnclosure {
 public:
  Velocities(double slope, double width) : slope_(slope), width_(width) {}
  void Enclose(const QuerySet&, ResidualBounds& bounds) const noexcept override {
    for (std::size_t k = 0; k < 4; ++k) {
      bounds.upper[k] = k < 2 ? 0 : width_;
      bounds.lower[k] = -bounds.upper[k];
    }
    bounds.capped = false;
    bounds.has_slope = slope_ != 0;
    if (!bounds.has_slope) return;
    for (std::size_t k = 0; k < 4; ++k) bounds.slope[k].fill(0);
    for (std::size_t k = 2; k < 4; ++k) bounds.slope[k][k] = slope_;
  }

 private:
  double slope_, width_;
};

std::shared_ptr<const Problem> PointMassProblem(double step_error) {
  auto problem = std::make_shared<Problem>(WorldOf(MakePointMass(0.125), Within({10, 10, 10, 10}), Within({1, 1})));
  problem->declaration = {};
  problem->transitions = {};
  problem->timing.error = step_error;
  return problem;
}

struct GivenEnclosure : testing::Test {
  Decision Certify(const ResidualEnclosure& residual, double step_error = 0) {
    const Certifier certifier(PointMassProblem(step_error), residual);
    EXPECT_EQ(certifier.num_observations(), 0u);
    EXPECT_FALSE(certifier.uses_hull_distance());
    EXPECT_FALSE(certifier.violation());
    return certifier.Certify({controls_.data(), 2, 8, 2}, start_, {&obstacle_, 1}, tube_);
  }

  const Eigen::MatrixXd controls_ = Eigen::MatrixXd::Zero(2, 8);
  const Zonotope start_ = Zonotope::FromBox(Eigen::Vector4d(0, 0, 1, 0), Eigen::Vector4d::Constant(0.0625));
  const Obstacle obstacle_ = Obstacle::Circle(Eigen::Vector2d(0, 3), 1);
  Tube tube_;
};

TEST_F(GivenEnclosure, BoundsTheTube) {
  EXPECT_EQ(Certify(Velocities(0, 0)).outcome, Outcome::kCertified);
  const double without = tube_.hull(8, 2).upper;
  EXPECT_EQ(Certify(Velocities(0, 0.125)).outcome, Outcome::kCertified);
  EXPECT_NEAR(tube_.hull(8, 2).upper, without + 8 * 0.125, 1e-12);
  EXPECT_EQ(Certify(Velocities(0, 1)).outcome, Outcome::kSafety);
}

TEST_F(GivenEnclosure, ASlopeContractsWhatAnIntervalCannot) {
  EXPECT_EQ(Certify(Velocities(-0.5, 0)).outcome, Outcome::kCertified);
  for (int t = 0; t <= 8; ++t) EXPECT_NEAR(tube_.half_width(t)[2], 0.0625 * std::pow(0.5, t), 1e-12);
  EXPECT_EQ(Certify(Velocities(2, 0)).outcome, Outcome::kDomain);  // threefold in each step
}

TEST_F(GivenEnclosure, AResidualOverASliceHasWhatItsSlopeAddsThere) {
  for (const double slope : {0.0, -0.5, 0.25}) {
    static_cast<void>(Certify(Velocities(slope, 0.125)));
    for (const int t : {0, 1}) {
      const double most = 0.125 + std::abs(slope) * tube_.half_width(t)[2];
      const Interval residual = ResidualOver(tube_, t, 2);
      EXPECT_FIELDS(residual, (lower, -residual.upper));
      EXPECT_GE(residual.upper, most);
      EXPECT_LE(residual.upper, most + 1e-15);
    }
    EXPECT_EQ(ResidualOver(tube_, 1, 0), Interval(0.0)) << "no slope in this row";
  }
}

// In a step that lasts a quarter longer the residual, which is up to half of the width, grows by 1.25^2 - 1 of itself.
TEST_F(GivenEnclosure, AStepOffItsTimeHasMoreOfWhatASlopeBounds) {
  EXPECT_EQ(Certify(Velocities(-0.5, 0), 0.03125).outcome, Outcome::kCertified);
  EXPECT_NEAR(tube_.half_width(1)[2], 0.0625 * 0.5 * 1.5625, 1e-12);
  EXPECT_GE(tube_.half_width(1)[2], 0.0625 * 0.5 * 1.5625);
}

TEST_F(GivenEnclosure, InvertedBoundsProveThatNoResidualIsAdmissible) {
  EXPECT_FIELDS(Certify(Velocities(0, -1)), (outcome, Outcome::kFalsified), (step, 0), (coordinate, 2));
}

TEST_F(GivenEnclosure, ASlopeThatIsNotFiniteIsNoBound) {
  const Decision decision = Certify(Velocities(std::numeric_limits<double>::quiet_NaN(), 0));
  EXPECT_FIELDS(decision, (outcome, Outcome::kDomain), (cause, Cause::kNoFiniteEnclosure));
}

}  // namespace forereach::given_enclosure_test
