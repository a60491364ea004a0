// Regions in the certifier: what they narrow, what contradicts them, and what is refused.
#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "tests/worlds.h"

namespace forereach::regions_test {

// A point mass in steps of an eighth of a second that slips above 4 m/s: r_vx = 0.05 (|vx| - 4)+. One step is known.
Problem SlippingPointMass() {
  Problem problem = WorldOf(MakePointMass(0.125), Within({100, 100, 8, 8}), Within({3, 3}));
  problem.declaration.lipschitz(2, 2) = 0.05;
  problem.declaration.regions = {{{{2, {-4, 4}}}, Eigen::MatrixXd::Zero(4, 6)}};
  return problem;
}

std::shared_ptr<const Problem> SharedOf(Problem problem) { return std::make_shared<const Problem>(std::move(problem)); }

// A transition of the world, from vx, whose residual of vx is `residual`.
std::pair<Eigen::VectorXd, Eigen::VectorXd> StepFrom(const Problem& problem, double vx, double residual) {
  Eigen::VectorXd z = Eigen::VectorXd::Zero(6), next(4);
  z[2] = vx;
  problem.model->Evaluate({z.data(), 6}, {next.data(), 4});
  next[2] += residual;
  return {z, next};
}

void Append(Problem& problem, double vx, double residual) {
  Transitions& data = problem.transitions;
  const auto [z, next] = StepFrom(problem, vx, residual);
  data.z.conservativeResize(data.z.rows() + 1, Eigen::NoChange);
  data.x_next.conservativeResize(data.x_next.rows() + 1, Eigen::NoChange);
  data.z.row(data.z.rows() - 1) = z;
  data.x_next.row(data.x_next.rows() - 1) = next;
}

struct Regions : testing::Test {
  // From vx at a constant speed.
  Decision Certify(const Certifier& certifier, double vx) {
    const Zonotope start = Zonotope::FromBox(Eigen::Vector4d(0, 0, vx, 0), Eigen::Vector4d::Constant(0.125));
    return certifier.Certify({controls_.data(), 2, 8, 2}, start, {}, tube_);
  }

  const Eigen::MatrixXd controls_ = Eigen::MatrixXd::Zero(2, 8);
  Tube tube_;
};

TEST_F(Regions, LeaveATubeAsTightAsTheNominalModelWhereTheResidualIsConstant) {
  const Certifier certifier(SharedOf(SlippingPointMass()));
  ASSERT_EQ(Certify(certifier, 3).outcome, Outcome::kCertified);
  EXPECT_NEAR(tube_.half_width(8)[2], 0.125, 1e-12) << "no residual is possible below 4 m/s";
  ASSERT_EQ(Certify(certifier, 5).outcome, Outcome::kCertified);
  EXPECT_LE(tube_.step(0).envelope.upper[2], 0.05 * 1.125 * (1 + 1e-12)) << "the way counts from 4 m/s on";
  EXPECT_GE(tube_.step(0).envelope.upper[2], 0.05 * 1.125);
  Problem plain = SlippingPointMass();
  plain.declaration.regions = {};
  ASSERT_EQ(Certify(Certifier(SharedOf(plain)), 3).outcome, Outcome::kCertified);
  EXPECT_GT(tube_.half_width(8)[2], 0.5);
}

TEST_F(Regions, AreContradictedByTwoStepsThatLAllows) {
  Problem problem = SlippingPointMass();
  Append(problem, 2, 0.05);
  Problem plain = problem;
  plain.declaration.regions = {};
  EXPECT_FALSE(Certifier(SharedOf(plain)).violation());
  const Certifier certifier(SharedOf(problem));
  ASSERT_TRUE(certifier.violation());
  EXPECT_FIELDS(*certifier.violation(), (first, 0), (second, 1), (coordinate, 2));
  EXPECT_NEAR(certifier.violation()->difference, 0.05, 1e-12);
  EXPECT_EQ(certifier.violation()->bound, 0);
  EXPECT_EQ(Certify(certifier, 1).outcome, Outcome::kFalsified);
  EXPECT_EQ(certifier.Contradiction().size(), 2);
}

// 0.0625 is the most from 4 to 5.25 m/s, exactly.
TEST_F(Regions, AllowExactlyTheCostOfTheWay) {
  for (const bool exceeds : {false, true}) {
    Problem problem = SlippingPointMass();
    problem.declaration.lipschitz(2, 2) = 0.0625;
    Append(problem, 5, 0);
    problem.declaration.noise_bound[2] = 0x1p-40;  // more than the last bits of the successors
    const double most = 0.0625 + 2 * 0x1p-40;
    problem.transitions.x_next(1, 2) = 5 + most + (exceeds ? 0x1p-48 : -0x1p-48);
    EXPECT_EQ(Certifier(SharedOf(problem)).violation().has_value(), exceeds);
  }
}

TEST_F(Regions, AreNarrowedAndContradictedByWhatIsLearned) {
  const Problem problem = SlippingPointMass();
  Certifier certifier(SharedOf(problem));
  static_cast<void>(Certify(certifier, 7));
  const double before = tube_.step(0).envelope.upper[2];
  const auto [z, next] = StepFrom(problem, 7, 0.125);
  ASSERT_EQ(certifier.Learn({z.data(), 6}, {next.data(), 4}), Learned::kAdded);
  EXPECT_FALSE(certifier.violation());
  static_cast<void>(Certify(certifier, 7));
  EXPECT_GT(before, 0.15);
  EXPECT_NEAR(tube_.step(0).envelope.upper[2], 0.125 + 0.05 * 0.125, 1e-9);
  const auto [slow, after] = StepFrom(problem, -1, 0.03125);
  ASSERT_EQ(certifier.Learn({slow.data(), 6}, {after.data(), 4}), Learned::kAdded);
  ASSERT_TRUE(certifier.violation());
  EXPECT_FIELDS(certifier, (violation()->second, 2), (Contradiction().num_learned, 1));
}

// Steps that say nothing new are not kept, and of many the last are.
TEST(RegionalObservations, AreKeptWhereTheyNarrowABound) {
  Problem problem = SlippingPointMass();
  for (int i = 0; i < 50; ++i) Append(problem, -4 + 0.125 * i / 2, 0);
  const auto [lower, upper] = problem.domain.Corners();
  class None final : public ResidualEnclosure {
    void Enclose(const QuerySet&, ResidualBounds&) const noexcept override {}
  } none;
  const auto observations = Observe(*problem.model, problem.declaration, problem.transitions);
  RegionalEnclosure few(problem.declaration, observations, lower, upper, none);
  int kept = 0;
  for (int id = 0; id <= 50; ++id) kept += few.Keeps(id);
  EXPECT_LE(kept, 3) << "within the region all say the same";
  EXPECT_TRUE(few.Keeps(0));
  problem.declaration.regions[0].lipschitz = 0.5 * problem.declaration.lipschitz;
  RegionalEnclosure many(problem.declaration, observations, lower, upper, none);
  std::vector<double> z(6), interval(4);
  for (int id = 51; id < 700; ++id) {
    z[2] = 7 - 1e-3 * id;
    interval[2] = 1e-9 * id;  // ever more
    many.Add(id, z, interval, interval);
  }
  EXPECT_FALSE(many.Keeps(0));
  EXPECT_TRUE(many.Keeps(699));
}

TEST(RegionsOfADeclaration, AreRefusedWhereTheyAreNotBuilt) {
  const auto refusal = [](const std::function<void(Problem&)>& change) {
    Problem problem = SlippingPointMass();
    change(problem);
    return Thrown<std::invalid_argument>([&] { const Certifier certifier(SharedOf(problem)); });
  };
  const auto region = [](Problem& problem) -> Region& { return problem.declaration.regions[0]; };
  EXPECT_EQ(refusal([](Problem&) {}), "");
  EXPECT_THAT(refusal([&](Problem& p) { region(p).box = {}; }), HasSubstr("region 0: its box is"));
  EXPECT_THAT(refusal([&](Problem& p) { region(p).box[0].variable = 6; }), HasSubstr("region 0: its box is"));
  EXPECT_THAT(refusal([&](Problem& p) { region(p).box[0].range = {4, 4}; }), HasSubstr("region 0: 4 to 4"));
  EXPECT_THAT(refusal([&](Problem& p) { region(p).lipschitz(1, 1) = -1; }), HasSubstr("region 0: an entry"));
  EXPECT_THAT(refusal([&](Problem& p) { region(p).lipschitz.resize(4, 4); }), HasSubstr("has not the size of L"));
  EXPECT_THAT(refusal([&](Problem& p) {
                p.domain.balls.push_back({{2, 3}, Eigen::Vector2d::Zero(), 5});
              }),
              HasSubstr("domain.balls[0] names vx, by which a region is bounded"));
  EXPECT_EQ(refusal([&](Problem& p) { p.domain.balls.push_back({{0, 1}, Eigen::Vector2d::Zero(), 5}); }), "");
  EXPECT_THAT(refusal([&](Problem& p) {
                p.domain.inequalities.push_back({Eigen::VectorXd::Ones(6), 1e3});
              }),
              HasSubstr("domain.inequalities[0] names vx"));
  EXPECT_THAT(refusal([&](Problem& p) {
                for (int l = 0; l < 4; ++l) p.declaration.regions.push_back({{{l, {0, 1}}}, region(p).lipschitz});
              }),
              HasSubstr("4 variables and 3 x 3 x 5 x 3 = 135 cells, must be at most 3 variables and 1024 cells"));
}

}  // namespace forereach::regions_test
