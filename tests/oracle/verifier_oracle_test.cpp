// The verifier's envelope against rational numbers, where recorded observations contradict each other by less than
// doubles show.
#include "tests/test.h"

#include "forereach/certify/tube.h"
#include "forereach/residual/consistency.h"
#include "forereach/residual/observations.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"
#include "tests/verifier/record.h"
#include "tests/worlds.h"

namespace forereach::verifier_oracle_test {

constexpr int kDelta = 5, kSteerRate = 7;
constexpr double kDt = 0.1;

// The steering delta+ = delta + dt steer_rate of the bicycle, whose residual is declared constant, without noise. Two
// transitions of a simulated robot's run. In the first, delta and dt steer_rate cancel all but 2^-60 of each other, and
// what the simulator's 64 bits rounded is many units of the successor. In the second the robot steers no more.
struct Cancelling : testing::Test {
  static constexpr double kBefore = -0.037031071903388016, kRate = 0.37031071903388013, kAfter = -0x1.a8p-61;

  Cancelling() {
    problem->transitions = {Eigen::MatrixXd::Zero(2, 8), Eigen::MatrixXd::Zero(2, 6)};
    problem->transitions.z(0, kDelta) = kBefore;
    problem->transitions.z(0, kSteerRate) = kRate;
    problem->transitions.x_next(0, kDelta) = kAfter;
    problem->transitions.z(1, kDelta) = problem->transitions.x_next(1, kDelta) = kAfter;
    problem->method = Method::kPaper;
  }

  // Of delta's residual, at transition i.
  [[nodiscard]] Rational Residual(int i) const {
    const Transitions& data = problem->transitions;
    return Rational(data.x_next(i, kDelta)) -
           (Rational(data.z(i, kDelta)) + Rational(kDt) * Rational(data.z(i, kSteerRate)));
  }
  [[nodiscard]] Rational Allowed(int i) const {
    const double size = std::abs(problem->transitions.x_next(i, kDelta));
    return Rational(std::nextafter(size, kInfinity)) - Rational(size);
  }

  void Certify(double scale = 1) {
    const Certifier certifier(problem);
    Eigen::VectorXd center = Eigen::VectorXd::Zero(6), half(6);
    center[3] = 10;
    half << 0.05, 0.05, 0.01, 0.1, 0.01, 0.005;
    half *= scale;
    const Zonotope initial_set = Zonotope::FromBox(center, half);
    const Eigen::MatrixXd controls = Eigen::Vector2d(0.5, 0.1).replicate(1, 10);
    const Plan plan{controls.data(), 2, 10, 2};
    const std::vector<Obstacle> obstacles{Obstacle::Circle(Eigen::Vector2d(9, 3), 1)};
    Tube tube;
    ASSERT_EQ(certifier.Certify(plan, initial_set, obstacles, tube).outcome, Outcome::kCertified);
    certificate = CertificateOf(certifier, plan, initial_set, obstacles, tube);
  }
  [[nodiscard]] verifier::Verdict Verify() const {
    return verifier::Verifier(problem, verifier::Method::kPaper).Verify(certificate);
  }

  std::shared_ptr<Problem> problem = std::make_shared<Problem>(
      WorldOf(MakeKinematicBicycle(kDt, 2.5), Within({40, 40, 3.1, 25, 3, 0.48}), Within({10, 1})));
  verifier::Certificate certificate;
};

// The rational envelope is empty. Each end of the certifier's is outward of the rational one.
TEST_F(Cancelling, DataContradictEachOtherAndDoublesDoNotShowIt) {
  const Rational lower = Residual(0) - Allowed(0), upper = Residual(1) + Allowed(1);
  ASSERT_GT(lower, upper);
  EXPECT_LT(lower - upper, Rational(0x1p-68));
  EXPECT_FALSE(FindViolation(problem->declaration, Observe(*problem->model, problem->transitions)));
  Certify();
  for (std::size_t t = 0; t + 1 < certificate.slices.size(); ++t) {
    EXPECT_TRUE(AtLeast(lower, certificate.slices[t].envelope_lower[kDelta]));
    EXPECT_TRUE(AtMost(upper, certificate.slices[t].envelope_upper[kDelta]));
  }
}

TEST_F(Cancelling, ACertificateOfSuchDataIsConfirmed) {
  Certify();
  const verifier::Verdict verdict = Verify();
  EXPECT_EQ(verdict.status, verifier::Status::kConfirmed) << verdict.failure.what << ": " << verdict.failure.found;
}

// Steps that cancel, off by up to 2^-62 of their terms; sets from points to wide ones.
TEST_F(Cancelling, RandomCertificatesOfSuchDataAreConfirmed) {
  int contradicting = 0;
  for (TracedRandom random(1); random.Again(300);) {
    const double before = random.Uniform(-0.09, 0.09), rate = -before / kDt;
    const Rational exact = Rational(before) + Rational(kDt) * Rational(rate);
    const double after = Rational(exact + Rational(random.Uniform(-1, 1) * 0x1p-62 * before)).get_d();
    problem->transitions.z(0, kDelta) = before;
    problem->transitions.z(0, kSteerRate) = rate;
    problem->transitions.x_next(0, kDelta) = after;
    problem->transitions.z(1, kDelta) = problem->transitions.x_next(1, kDelta) = after;
    const Rational difference = abs(Residual(0) - Residual(1));
    contradicting += difference > Allowed(0) + Allowed(1);
    ASSERT_NO_FATAL_FAILURE(Certify(random.trial() % 3 == 0 ? 0 : random.trial() % 3 == 1 ? 0x1p-60 : 1));
    const verifier::Verdict verdict = Verify();
    ASSERT_EQ(verdict.status, verifier::Status::kConfirmed) << random.trial() << ": " << verdict.failure.what << ": "
                                                            << verdict.failure.found << ", " << verdict.failure.bound;
  }
  EXPECT_GT(contradicting, 200);
}

// And not because a contradiction admits every claim.
TEST_F(Cancelling, AClaimThatIsTooStrongIsRefuted) {
  Certify();
  const verifier::Certificate whole = certificate;
  certificate.slices[4].half_width[kDelta] *= 1 - 0x1p-40;
  EXPECT_EQ(Verify().status, verifier::Status::kRefuted);
  certificate = whole;
  const Rational upper = Residual(1) + Allowed(1);
  certificate.slices[0].envelope_upper[kDelta] = std::nextafter(Floor(upper), -kInfinity);
  EXPECT_EQ(Verify().status, verifier::Status::kRefuted);
  certificate = whole;
  certificate.slices[0].envelope_lower[kDelta] = Floor(Residual(0) - Allowed(0));  // each end for itself is true
  certificate.slices[0].envelope_upper[kDelta] = Ceiling(upper);
  EXPECT_EQ(Verify().failure.what, "the recorded envelope of delta is not empty");
  certificate = whole;
  certificate.obstacles = {Obstacle::Circle(Eigen::Vector2d(9, 0.8), 1)};
  EXPECT_EQ(Verify().status, verifier::Status::kRefuted);
}

// The derived slice reaches from the one observation's bound to the other's.
TEST_F(Cancelling, TheDerivedSliceReachesOverTheContradiction) {
  certificate.initial_set.center = Eigen::VectorXd::Zero(6);
  certificate.initial_set.generators = Eigen::MatrixXd(6, 0);
  certificate.controls = Eigen::Vector2d(0, 0);
  const verifier::Tube tube = verifier::Verifier(problem, verifier::Method::kPaper).Derive(certificate);
  ASSERT_FALSE(tube.failure);
  const verifier::Real& center = tube.slices[1].center[kDelta];
  const verifier::Real half_width = tube.slices[1].HalfWidth(kDelta);
  const Rational lower = Residual(0) - Allowed(0), upper = Residual(1) + Allowed(1);
  EXPECT_EQ((center - half_width).ToDouble(), upper.get_d());
  EXPECT_NEAR((center + half_width).ToDouble() / lower.get_d(), 1, 0x1p-50);
}

TEST_F(Cancelling, AContradictionThatDoublesShowIsRefuted) {
  Certify();
  for (const double more : {0x1p-40, 0x1p-20, 0.1}) {
    problem->transitions.x_next(0, kDelta) = kAfter + more;
    EXPECT_TRUE(FindViolation(problem->declaration, Observe(*problem->model, problem->transitions)));
    const verifier::Verdict verdict = Verify();
    EXPECT_EQ(verdict.status, verifier::Status::kRefuted);
    EXPECT_EQ(verdict.failure.what, "some residual is consistent with data and declaration");
  }
}

}  // namespace forereach::verifier_oracle_test
