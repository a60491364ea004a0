// Certificates of models that are texts: what the certifier claims, the verifier derives by its own parser.
#include "tests/test.h"

#include "forereach/certify/tube.h"
#include "forereach/dynamics/text_model.h"
#include "tests/oracle/traced_random.h"
#include "tests/text_models.h"
#include "tests/verifier/is_confirmed.h"
#include "tests/verifier/record.h"
#include "tests/worlds.h"

namespace forereach::verifier::text_certificates_test {

using Integrator = ModelText::Integrator;

std::shared_ptr<Problem> ProblemOf(const ModelText& text, double reach) {
  const auto model = MakeTextModel(text);
  auto problem = std::make_shared<Problem>(WorldOf(model, Within(Eigen::VectorXd::Constant(model->num_states(), reach)),
                                                   Within(Eigen::VectorXd::Constant(model->num_inputs(), 10))));
  problem->declaration.lipschitz.diagonal().setConstant(0.002);
  problem->zonotope_order = 3;
  problem->declaration.noise_bound.setConstant(1e-6);
  return problem;
}

// Certifies random plans. All of what is certified has to be confirmed, and refuted with a last hull that is
// `narrower`.
void ExpectConfirmed(const ModelText& text, Random& random, const Eigen::VectorXd& input, int steps,
                     double step_error = 0, double narrower = 1e-6) {
  for (const auto method : {forereach::Method::kPaper, forereach::Method::kCentred}) {
    const auto problem = ProblemOf(text, 1.3);
    problem->method = method;
    problem->timing.error = step_error;
    const Certifier certifier(problem);
    const Verifier judge(problem, MethodOf(*problem));
    forereach::Tube tube;
    int certified = 0;
    for (int trial = 0; trial < 6; ++trial) {
      const int n = problem->model->num_states();
      const Zonotope initial = Zonotope::FromBox(random.Vector(n, 0.1), random.Vector(n, 0.01).cwiseAbs());
      Eigen::MatrixXd controls = input.replicate(1, steps);
      const Plan plan{controls.data(), static_cast<int>(controls.rows()), steps, static_cast<int>(controls.rows()), {}};
      if (certifier.Certify(plan, initial, {}, tube).outcome != Outcome::kCertified) continue;
      ++certified;
      const Certificate certificate = CertificateOf(certifier, plan, initial, {}, tube);
      EXPECT_TRUE(IsConfirmed(judge.Verify(certificate)));
      Certificate smaller = certificate;  // the last hull, too narrow
      smaller.slices.back().upper[0] -= narrower;
      EXPECT_EQ(judge.Verify(smaller).status, Status::kRefuted);
    }
    EXPECT_GT(certified, 0);
  }
}

class TextCertificates : public testing::TestWithParam<Integrator> {};

TEST_P(TextCertificates, OfAQuadrotorAreConfirmed) {
  TracedRandom random(91);
  ExpectConfirmed(QuadrotorText(GetParam()), random, Eigen::Vector4d(4.9, 0, 0, 0), 8);
}

// Anywhere in the domain the angle is astronomical, but not where the plans are.
TEST_P(TextCertificates, OfAnAngleThatIsAstronomicalElsewhereAreConfirmed) {
  TracedRandom random(93);
  ExpectConfirmed(
      TextModel({{"x", "x + 0.01*cos(2^(75*(x - 0.3))^3) + dt*u"}}, {"u"}, {{"dt", 0.1, 0.1}}, {}, Integrator::kNone),
      random, Eigen::VectorXd::Zero(1), 3);
}

TEST_P(TextCertificates, OfManyFunctionsAreConfirmed) {
  TracedRandom random(92);
  const Lines equations{{"x", "0.5*tanh(y) + 0.1*atan(x*y) - 0.2*x*exp(-y^2)"},
                        {"y", "0.3*sin(x)*sqrt(2 + x^2 + y^2) - 0.1*log(3 + x) + 0.2*asin(x/2)"},
                        {"w", "0.2*atan2(y, 2 + x) + 0.1*max(x, y - 9)*hypot(x, 1 + y^2) - w/(2 + cos(x)) + u"}};
  ExpectConfirmed(TextModel(equations, {"u"}, {{"dt", 0.1, 0.1}}, {}, GetParam()), random,
                  Eigen::VectorXd::Constant(1, 0.1), 8);
}

TEST_P(TextCertificates, WithAParameterThatIsAnIntervalAreConfirmed) {
  TracedRandom random(93);
  ExpectConfirmed(TextModel({{"x", "v*cos(q)"}, {"y", "v*sin(q)"}, {"q", "k*u"}, {"v", "-k*v*abs(v + 2)"}}, {"u"},
                            {{"dt", 0.1, 0.1}, {"k", 0.19, 0.21}}, {}, GetParam()),
                  random, Eigen::VectorXd::Constant(1, 0.1), 8);
}

// For Euler's step the verifier bounds what a step's time adds more tightly than the certifier, which has less time.
TEST_P(TextCertificates, OfStepsOffTheirTimesAreConfirmed) {
  TracedRandom random(95);
  const double narrower = GetParam() == Integrator::kEuler ? 2e-4 : 1e-6;
  ExpectConfirmed(TextModel({{"x", "v*cos(q)"}, {"y", "v*sin(q)"}, {"q", "u"}, {"v", "u - 0.3*v*x"}}, {"u"},
                            {{"dt", 0.1, 0.1}}, {}, GetParam()),
                  random, Eigen::VectorXd::Constant(1, 0.1), 8, 0.02, narrower);
}

// A cart at 9 m/s drives five steps of 0.1 s at a wall, and each boundary may be 30 ms early or late.
struct LateStep : testing::Test {
  static constexpr double kFastest = 9.03, kError = 0.03;
  // Of the cart that is fastest and ahead, and late in the end. No bound may be below it.
  static constexpr double kReached = 0.05 + (0.5 + kError) * kFastest;
  // By hand: the speeds differ by 0.03 m/s from the middle, so E times them counts once in the first step and twice in
  // each of the others; and within the longest step, 0.13 s, it may be off the chord by 5 m/s^2.
  static constexpr double kNeeded = 0.05 + 0.5 * kFastest + kError * 9 + 9 * kError * 0.03 + 5 * 0.13 * 0.13 / 8;

  LateStep() {
    problem_ =
        std::make_shared<Problem>(WorldOf(MakeTextModel(TextModel({{"x", "v"}, {"y", "0*v"}, {"v", "a"}}, {"a"},
                                                                  {{"dt", 0.1, 0.1}}, {}, Integrator::kMidpoint)),
                                          Within({50, 10, 20}), Within({5})));
    DeclareError(kError);
  }
  void DeclareError(double error) {
    problem_->timing.error = error;
    problem_->between = Between{Vec({5, 0.1}), 0, 0, AddUp(0.1, error)};
  }
  Decision Before(double wall) {
    obstacles_ = {Obstacle::HalfSpace(Eigen::Vector2d(1, 0), wall)};
    return Certifier(problem_).Certify(plan_, start_, obstacles_, tube_);
  }
  Verdict Judge(double wall) {
    Certificate certificate = CertificateOf(Certifier(problem_), plan_, start_, obstacles_, tube_);
    certificate.obstacles = {Obstacle::HalfSpace(Eigen::Vector2d(1, 0), wall)};
    for (RecordedSlice& slice : certificate.slices) std::ranges::fill(slice.clearance, 1e-12);
    return Verifier(problem_, MethodOf(*problem_)).Verify(certificate);
  }

  std::shared_ptr<Problem> problem_;
  const std::array<double, 5> controls_{};
  const Plan plan_{controls_.data(), 1, 5, 1, {}};
  const Zonotope start_ = Zonotope::FromBox(Vec({0, 0, 9}), Vec({0.05, 0.05, 0.03}));
  std::vector<Obstacle> obstacles_;
  forereach::Tube tube_;
};

TEST_F(LateStep, IsCertifiedIfTheWallIsFartherAwayThanItReaches) {
  for (const double wall : {4.58, 4.65, kReached, kNeeded - 1e-9})
    EXPECT_FIELDS(Before(wall), (outcome, Outcome::kSafety), (cause, Cause::kObstacle));
  for (const double wall : {kNeeded + 1e-9, 4.87}) EXPECT_EQ(Before(wall).outcome, Outcome::kCertified);
  DeclareError(0);
  EXPECT_EQ(Before(4.58).outcome, Outcome::kCertified) << "steps on time";
}

TEST_F(LateStep, IsConfirmedIfTheWallIsFartherAwayThanItReaches) {
  ASSERT_EQ(Before(kNeeded + 1e-9).outcome, Outcome::kCertified);
  EXPECT_TRUE(IsConfirmed(Judge(kNeeded + 1e-9)));
  for (const double wall : {4.58, 4.65, kReached - 1e-9}) EXPECT_EQ(Judge(wall).status, Status::kRefuted) << wall;
  DeclareError(0.029);
  ASSERT_EQ(Before(kNeeded + 1e-9).outcome, Outcome::kCertified);
  DeclareError(kError);
  EXPECT_EQ(Judge(kNeeded + 1e-9).status, Status::kRefuted) << "a tube of smaller errors";
}

// A BlueROV2 (von Benzon et al., J. Mar. Sci. Eng. 10(12), 2022) without roll and pitch; `drag` of a speed is its
// quadratic part.
ModelText Rov(const std::function<std::string(const std::string&)>& drag, Integrator integrator) {
  return TextModel({{"x", "u*cos(psi) - v*sin(psi)"},
                    {"y", "u*sin(psi) + v*cos(psi)"},
                    {"z", "w"},
                    {"psi", "r"},
                    {"u", "(fx + 24.2*v*r - 4.03*u - 18.18*" + drag("u") + ")/17"},
                    {"v", "(fy - 17*u*r - 6.22*v - 21.66*" + drag("v") + ")/24.2"},
                    {"w", "(fz - 5.18*w - 36.99*" + drag("w") + ")/26.07"},
                    {"r", "(n - 7.2*u*v - 0.07*r - 1.55*" + drag("r") + ")/0.28"}},
                   {"fx", "fy", "fz", "n"}, {{"dt", 0.05, 0.05}}, {}, integrator);
}
const auto kSmoothedDrag = [](const std::string& speed) { return speed + "*hypot(" + speed + ", 0.01)"; };
const auto kSquareDrag = [](const std::string& speed) { return "signed_square(" + speed + ")"; };

struct OneSecond {
  Eigen::MatrixXd controls = Eigen::Vector4d(4, 1, -2, 0.1).replicate(1, 20);
  Plan plan{controls.data(), 4, 20, 4, {}};
  Zonotope start = Zonotope::FromBox(Vec({0, 0, 0, 0.5, 0, 0, 0, 0}), Eigen::VectorXd::Constant(8, 0.03));
};

// From rest, where every speed has either sign.
TEST_P(TextCertificates, OfQuadraticDragAreConfirmedFromRest) {
  const OneSecond second;
  forereach::Tube tube;
  const auto smoothed = ProblemOf(Rov(kSmoothedDrag, GetParam()), 3),
             squared = ProblemOf(Rov(kSquareDrag, GetParam()), 3);
  EXPECT_EQ(Certifier(smoothed).Certify(second.plan, second.start, {}, tube).outcome, Outcome::kDomain);
  for (const auto method : {forereach::Method::kPaper, forereach::Method::kCentred}) {
    squared->method = method;
    const Certifier certifier(squared);
    ASSERT_EQ(certifier.Certify(second.plan, second.start, {}, tube).outcome, Outcome::kCertified);
    Certificate certificate = CertificateOf(certifier, second.plan, second.start, {}, tube);
    const Verifier judge(squared, MethodOf(*squared));
    EXPECT_EQ(judge.Verify(certificate).status, Status::kConfirmed);
    RecordedSlice& last = certificate.slices.back();  // a good part too narrow: the verifier's remainder may be tighter
    last.upper[4] -= 0.3 * (last.upper[4] - last.lower[4]);
    EXPECT_EQ(judge.Verify(certificate).status, Status::kRefuted);
  }
  // Rollouts of 256 bits from corners and from inside.
  const auto equations = EquationsOf(*squared->model);
  for (TracedRandom random(94); random.Again(20);) {
    std::vector<Real> z;
    for (int k = 0; k < 8; ++k)
      z.push_back(Real(second.start.center(k)) +
                  Real(0.03) * Real(random.trial() < 8 ? random.Sign() : random.Uniform(-1, 1)));
    for (const double u : second.controls.col(0)) z.emplace_back(u);
    for (int t = 1; t <= 20; ++t) {
      std::ranges::copy(equations->Value(z), z.begin());
      for (int k = 0; k < 8; ++k) {
        ASSERT_TRUE(CertainlyAtMost(tube.hull(t, k).lower, z[static_cast<std::size_t>(k)])) << t;
        ASSERT_TRUE(CertainlyAtMost(z[static_cast<std::size_t>(k)], tube.hull(t, k).upper)) << t;
      }
    }
  }
}

// Of boxes that reach to zero, over it, and to next to it.
TEST(SignedSquare, OneStepContainsTheRangeOnBothSidesOfZero) {
  const auto problem = ProblemOf(TextModel({{"x", "signed_square(x)"}}, {"u"}, {{"dt", 0.1, 0.1}}), 3);
  problem->declaration.lipschitz.setZero();
  problem->declaration.noise_bound.setZero();
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(1, 1);
  const Plan plan{controls.data(), 1, 1, 1, {}};
  for (const double r : {0x1p-60, 0x1p-32, 0x1p-10, 0.5})
    for (const double c : {0.0, r, -r, r * (1 + 0x1p-40), -r * (1 - 0x1p-40), 2 * r, 0x1p-31, -0x1p-29, 0.25, -2.0})
      for (const auto method : {forereach::Method::kPaper, forereach::Method::kCentred}) {
        problem->method = method;
        const Certifier certifier(problem);
        forereach::Tube tube;
        const Zonotope start = Zonotope::FromBox(Vec({c}), Vec({r}));
        ASSERT_EQ(certifier.Certify(plan, start, {}, tube).outcome, Outcome::kCertified) << c << " +- " << r;
        const Certificate certificate = CertificateOf(certifier, plan, start, {}, tube);
        EXPECT_EQ(Verifier(problem, MethodOf(*problem)).Verify(certificate).status, Status::kConfirmed)
            << c << ", " << r;
        for (const double part : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
          const Real x = Real(c) + Real(part) * Real(r), next = x * abs(x);
          ASSERT_TRUE(CertainlyAtMost(tube.hull(1, 0).lower, next)) << c << " +- " << r;
          ASSERT_TRUE(CertainlyAtMost(next, tube.hull(1, 0).upper)) << c << " +- " << r;
        }
        EXPECT_LE(tube.half_width(1)[0], 2 * std::abs(c) * r + r * r + 1e-13) << c << " +- " << r;
      }
}

// Records of the heading of a robot that turns through pi: as it was, or wrapped.
std::shared_ptr<Problem> TurningProblem(const ModelText& text, bool wrapped) {
  const auto problem = ProblemOf(text, 8);
  problem->declaration.lipschitz.setConstant(1e-3);
  problem->declaration.noise_bound.setConstant(1e-9);
  constexpr int kCount = 60;
  const int n = problem->model->num_states(), d = problem->model->num_variables();
  problem->transitions = {Eigen::MatrixXd(kCount, d), Eigen::MatrixXd(kCount, n)};
  Eigen::VectorXd z = Eigen::VectorXd::Zero(d), next(n);
  z << 0, 0, 2.9, 1, 0.1, 0.5;
  for (int i = 0; i < kCount; ++i) {
    problem->model->Evaluate({z.data(), static_cast<std::size_t>(d)}, {next.data(), static_cast<std::size_t>(n)});
    next[2] += 1e-3 * std::sin(z[2]);  // the residual
    if (wrapped) next[2] = std::remainder(next[2], 2 * std::numbers::pi);
    problem->transitions.z.row(i) = z;
    problem->transitions.x_next.row(i) = next;
    z[2] = next[2];
    z[4] = 0.1 + 0.01 * (i % 3);
  }
  return problem;
}

TEST_P(TextCertificates, OfWrappedHeadingsAreConfirmed) {
  ModelText text = TextModel({{"x", "v*cos(q)"}, {"y", "v*sin(q)"}, {"q", "w"}, {"v", "0"}, {"w", "u"}}, {"u"},
                             {{"dt", 0.2, 0.2}}, {}, GetParam());
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Constant(1, 10, 0.2);
  const Plan plan{controls.data(), 1, 10, 1, {}};
  const Zonotope initial =
      Zonotope::FromBox((Eigen::VectorXd(5) << 0, 0, 3.05, 1, 0.2).finished(), Eigen::VectorXd::Constant(5, 1e-3));
  forereach::Tube tube;
  EXPECT_TRUE(Certifier(TurningProblem(text, true)).violation()) << "without angles it falsifies the declaration";
  text.angles = {"q"};
  std::vector<double> last;
  for (const bool wrapped : {true, false}) {
    const auto problem = TurningProblem(text, wrapped);
    const Certifier certifier(problem);
    ASSERT_FALSE(certifier.violation());
    ASSERT_EQ(certifier.Certify(plan, initial, {}, tube).outcome, Outcome::kCertified);
    EXPECT_GT(tube.hull(10, 2).lower, std::numbers::pi) << "the tube goes on beyond pi";
    last.push_back(tube.hull(10, 2).upper);
    const Verifier judge(problem, MethodOf(*problem));
    const Certificate certificate = CertificateOf(certifier, plan, initial, {}, tube);
    const Verdict verdict = judge.Verify(certificate);
    EXPECT_EQ(verdict.status, Status::kConfirmed) << "step " << verdict.failure.step << ": " << verdict.failure.what;
    for (const int k : {0, 2}) {
      Certificate smaller = certificate;
      smaller.slices.back().upper[k] -= 0.2 * (smaller.slices.back().upper[k] - smaller.slices.back().lower[k]);
      EXPECT_EQ(judge.Verify(smaller).status, Status::kRefuted);
    }
  }
  // Wrapped and unwrapped records are at different places, so their bounds differ a little.
  EXPECT_NEAR(last[0], last[1], 0.05);
}

// An envelope that is narrower than wrapped data allow by less than the unit of an angle.
TEST(AngleCertificates, AnEnvelopeNarrowerThanTheUnitOfAnAngleIsRefuted) {
  ModelText text =
      TextModel({{"x", "x + dt*cos(q)"}, {"y", "y + dt*sin(q)"}, {"q", "q + dt*u"}}, {"u"}, {{"dt", 0.5, 0.5}});
  text.angles = {"q"};
  const auto problem = ProblemOf(text, 8);
  problem->declaration.lipschitz.setZero();
  problem->declaration.noise_bound.setZero();
  problem->transitions = {Eigen::MatrixXd::Zero(1, 4), Eigen::MatrixXd::Zero(1, 3)};
  problem->transitions.x_next(0, 0) = 0.5;  // f0(0) = (0.5, 0, 0)
  const Certifier certifier(problem);
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(1, 1);
  const Plan plan{controls.data(), 1, 1, 1, {}};
  const Zonotope initial = Zonotope::FromBox(Eigen::VectorXd::Zero(3), Eigen::VectorXd::Zero(3));
  forereach::Tube tube;
  ASSERT_EQ(certifier.Certify(plan, initial, {}, tube).outcome, Outcome::kCertified);
  EXPECT_EQ(tube.hull(0, 2).upper, 0);
  EXPECT_GE(tube.hull(1, 2).upper, 0x1p-49);
  const Verifier judge(problem, MethodOf(*problem));
  const Certificate certificate = CertificateOf(certifier, plan, initial, {}, tube);
  EXPECT_EQ(judge.Verify(certificate).status, Status::kConfirmed);
  Certificate narrow = certificate;
  narrow.slices[1].upper[2] = 0x1.ffp-50;
  EXPECT_EQ(judge.Verify(narrow).status, Status::kRefuted);
}

// A state that is a point has no part in the remainder, so neither has a kink or an infinite slope along it. The second
// one leaves the kink in the first step.
struct PointAtAKink : testing::TestWithParam<std::tuple<std::string, forereach::Method>> {
  // x is a box, and y = place +- half_width.
  static Zonotope Initial(double place, double half_width) {
    return Zonotope::FromBox(Eigen::Vector2d(0.1, place), Eigen::Vector2d(0.01, half_width));
  }
  static std::shared_ptr<Problem> ProblemOfTerm() {
    const std::string term = std::get<0>(GetParam());
    auto problem =
        ProblemOf(TextModel({{"x", "x + 0.1*(" + term + ")"}, {"y", "y + 0.5"}}, {"u"}, {{"dt", 0.1, 0.1}}), 2);
    problem->method = std::get<1>(GetParam());
    return problem;
  }

  const std::shared_ptr<Problem> problem_ = ProblemOfTerm();
  const Certifier certifier_{problem_};
  const Verifier judge_{problem_, MethodOf(*problem_)};
  const Eigen::MatrixXd controls_ = Eigen::MatrixXd::Zero(1, 2);
  const Plan plan_{controls_.data(), 1, 2, 1, {}};
  forereach::Tube tube_;
};

TEST_P(PointAtAKink, ACertificateOfAPointAtAKinkIsConfirmed) {
  ASSERT_EQ(certifier_.Certify(plan_, Initial(0, 0), {}, tube_).outcome, Outcome::kCertified);
  const Certificate certificate = CertificateOf(certifier_, plan_, Initial(0, 0), {}, tube_);
  const Verdict verdict = judge_.Verify(certificate);
  EXPECT_EQ(verdict.status, Status::kConfirmed) << verdict.failure.what << ": " << verdict.failure.found;
  Certificate smaller = certificate;
  smaller.slices.back().upper[0] -= 1e-6;
  EXPECT_EQ(judge_.Verify(smaller).status, Status::kRefuted);
}

TEST_P(PointAtAKink, ASetAroundAKinkIsNotConfirmed) {
  ASSERT_EQ(certifier_.Certify(plan_, Initial(0, 0), {}, tube_).outcome, Outcome::kCertified);
  Certificate certificate = CertificateOf(certifier_, plan_, Initial(0, 0), {}, tube_);
  for (const double half_width : {0x1p-1074, 0x1p-60, 1e-3}) {
    EXPECT_EQ(certifier_.Certify(plan_, Initial(0, half_width), {}, tube_).cause, Cause::kNoFiniteEnclosure);
    certificate.initial_set.generators = Initial(0, half_width).GeneratorMatrix();
    for (const bool has_slices : {true, false}) {
      Certificate wider = certificate;
      if (!has_slices) wider.slices.clear();
      EXPECT_EQ(judge_.Verify(wider).status, Status::kRefuted) << half_width;
    }
  }
}

// The kink comes in the second step, where the residual has made a box of the point.
TEST_P(PointAtAKink, AKinkInTheSecondStepIsNotConfirmed) {
  const Zonotope initial = Initial(-0.5, 0);
  EXPECT_EQ(certifier_.Certify(plan_, initial, {}, tube_).outcome, Outcome::kDomain);
  verifier::Certificate certificate;
  certificate.initial_set = {{}, {}, initial.CenterVector(), initial.GeneratorMatrix()};
  certificate.controls = controls_;
  EXPECT_EQ(judge_.Verify(certificate).status, Status::kRefuted);
}

INSTANTIATE_TEST_SUITE_P(Terms, PointAtAKink,
                         testing::Combine(testing::Values("abs(y)", "abs(y + sqrt(2)^2 - 2)",
                                                          "x*abs(y + sqrt(2)^2 - 2) + sin(x)^2",
                                                          "cos(x)*max(y, 2 - sqrt(2)^2)", "x - min(y, sqrt(3)^2 - 3)"),
                                          testing::Values(forereach::Method::kPaper, forereach::Method::kCentred)));

INSTANTIATE_TEST_SUITE_P(Integrators, TextCertificates,
                         testing::Values(Integrator::kEuler, Integrator::kMidpoint, Integrator::kRk4));

}  // namespace forereach::verifier::text_certificates_test
