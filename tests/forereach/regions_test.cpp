// Regions in the certifier: what they narrow, what contradicts them, and what is refused.
#include "tests/test.h"

#include <cmath>

#include "forereach/certify/certifier.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/angles.h"
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

// A step from 3 m/s and one from 7 differ by as much as L allows, so the residual is affine between them.
TEST_F(Regions, ThatCoverTheDomainKeepTheSlopeThatDataShow) {
  Problem problem = SlippingPointMass();
  Append(problem, 3, 0);
  Append(problem, 7, -0.05 * 4 * (1 - 2e-9));
  const auto width = [&](std::vector<Region> regions) {
    problem.declaration.regions = std::move(regions);
    EXPECT_EQ(Certify(Certifier(SharedOf(problem)), 5).outcome, Outcome::kCertified);
    return tube_.half_width(8)[2];
  };
  const double plain = width({}),
               sloped = width({{{{2, {-9, 9}}}, (1 - 1e-9) * SlippingPointMass().declaration.lipschitz}});
  EXPECT_TRUE(tube_.step(0).envelope.has_slope);
  EXPECT_NEAR(sloped, 0.125 * std::pow(0.95, 8), 1e-6);
  EXPECT_NEAR(plain, 0.125 * std::pow(1.05, 8), 1e-6);
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

// The same world, of which a step is disturbed by up to 1/8 m/s, within 4 m/s by up to 1/64.
Problem GustyPointMass() {
  Problem problem = SlippingPointMass();
  Declaration& declaration = problem.declaration;
  declaration.lipschitz.setZero();
  declaration.disturbance = Eigen::Vector4d(0, 0, 0.125, 0);
  declaration.regions[0].lipschitz = declaration.lipschitz;
  declaration.regions[0].disturbance = Eigen::Vector4d(kInfinity, kInfinity, 0x1p-6, kInfinity);
  return problem;
}

// Half the width that a step adds to vx: what the observation and the step itself were disturbed by.
TEST_F(Regions, DisturbAStepByWhatTheCellsThatItsHullTouchesSay) {
  const Certifier certifier(SharedOf(GustyPointMass()));
  const auto added = [&](double vx) {
    static_cast<void>(Certify(certifier, vx));
    return tube_.half_width(1)[2] - tube_.half_width(0)[2];
  };
  const double calm = 2 * 0x1p-6, gusty = 0x1p-6 + 0.125;  // what is known was observed within 4 m/s
  EXPECT_NEAR(added(0), calm, 1e-12);
  EXPECT_NEAR(added(3.874), calm, 1e-12);
  EXPECT_NEAR(added(3.875), gusty, 1e-12) << "the hull ends at the side";
  EXPECT_NEAR(added(4.125), gusty, 1e-12) << "and begins there";
  EXPECT_NEAR(added(6), gusty, 1e-12);
  EXPECT_GE(added(3.875), gusty);
}

TEST_F(Regions, TakeAnObservationForAsDisturbedAsItsPlaceAllows) {
  const auto envelope = [&](double vx) {
    Problem problem = GustyPointMass();
    problem.transitions = {};
    problem.transitions = {Eigen::MatrixXd(0, 6), Eigen::MatrixXd(0, 4)};
    Append(problem, vx, 0);
    static_cast<void>(Certify(Certifier(SharedOf(problem)), 0));
    return tube_.step(0).envelope.upper[2];
  };
  EXPECT_NEAR(envelope(-3), 0x1p-6, 1e-12);
  EXPECT_NEAR(envelope(-4), 0.125, 1e-12) << "on the side";
  EXPECT_NEAR(envelope(4), 0.125, 1e-12);
  EXPECT_NEAR(envelope(NextUp(-4)), 0x1p-6, 1e-12);
  EXPECT_NEAR(envelope(-5), 0.125, 1e-12);
  Problem problem = GustyPointMass();
  problem.declaration.disturbance.setZero();
  problem.declaration.noise_bound[2] = 0.125;
  std::swap(problem.declaration.regions[0].noise_bound, problem.declaration.regions[0].disturbance);
  Append(problem, 5, 0.140625);
  EXPECT_FALSE(Certifier(SharedOf(problem)).violation()) << "1/64 and 1/8";
  problem.transitions.x_next(1, 2) += 0x1p-40;
  EXPECT_TRUE(Certifier(SharedOf(problem)).violation());
}

// Two pairs of steps within 4 m/s may differ by 1/32, and those beyond by 1/4; to the last bits of the successors.
TEST_F(Regions, AllowADifferenceByWhereBothStepsAre) {
  for (const auto& [first, second, most] :
       {std::tuple(1.0, 2.0, 0x1p-5), std::tuple(1.0, 5.0, 0.140625), std::tuple(-5.0, 5.0, 0.25)})
    for (const bool exceeds : {false, true}) {
      Problem problem = GustyPointMass();
      problem.transitions = {Eigen::MatrixXd(0, 6), Eigen::MatrixXd(0, 4)};
      Append(problem, first, 0);
      Append(problem, second, most + (exceeds ? 0x1p-40 : -0x1p-40));
      EXPECT_EQ(Certifier(SharedOf(problem)).violation().has_value(), exceeds) << first << " " << second;
    }
}

// r_vx is at most 1/64 in size within 4 m/s, and by slopes alone it is not.
Problem BoundedPointMass() {
  Problem problem = SlippingPointMass();
  problem.declaration.regions[0].lipschitz = problem.declaration.lipschitz;
  problem.declaration.regions[0].bound = Eigen::Vector4d(kInfinity, kInfinity, 0x1p-6, kInfinity);
  return problem;
}

TEST_F(Regions, BoundTheResidualWhereTheHullMeetsNoOtherCell) {
  const Certifier certifier(SharedOf(BoundedPointMass()));
  static_cast<void>(Certify(certifier, 3));
  EXPECT_EQ(tube_.step(0).envelope.upper[2], 0x1p-6);
  EXPECT_EQ(tube_.step(0).envelope.lower[2], -0x1p-6);
  static_cast<void>(Certify(certifier, 3.875));
  EXPECT_NEAR(tube_.step(0).envelope.upper[2], 0.2, 1e-12) << "it ends at the side: L alone counts";
  Problem both = BoundedPointMass();
  both.declaration.regions.push_back({{{2, {3, 7}}}, both.declaration.lipschitz, {}, {}, Eigen::Vector4d::Constant(1)});
  both.declaration.regions.back().bound[2] = 0x1p-5;
  static_cast<void>(Certify(Certifier(SharedOf(both)), 3.5));
  EXPECT_EQ(tube_.step(0).envelope.upper[2], 0x1p-6) << "of overlapping boxes the least";
  static_cast<void>(Certify(Certifier(SharedOf(both)), 4));
  EXPECT_EQ(tube_.step(0).envelope.upper[2], 0x1p-5) << "of two that a hull meets the largest";
  both.declaration.regions.back().box[0].range.lower = NextUp(4.0);
  static_cast<void>(Certify(Certifier(SharedOf(both)), 4));
  EXPECT_NEAR(tube_.step(0).envelope.upper[2], 0.20625, 1e-12) << "nothing is said of the gap";
}

TEST_F(Regions, AreContradictedByOneStepThatShowsMoreThanTheirBound) {
  for (const bool exceeds : {false, true}) {
    Problem problem = BoundedPointMass();
    Append(problem, 2, 0x1p-6 + (exceeds ? 0x1p-40 : -0x1p-40));
    Append(problem, 4, 0x1p-4);
    const Certifier certifier(SharedOf(problem));
    ASSERT_EQ(certifier.violation().has_value(), exceeds) << "on the side nothing is said";
    if (!exceeds) continue;
    EXPECT_FIELDS(*certifier.violation(), (first, 1), (second, -2), (coordinate, 2), (bound, 0x1p-6));
    EXPECT_EQ(certifier.Contradiction().size(), 1);
    const Decision decision = Certify(certifier, 6);
    EXPECT_FIELDS(decision, (outcome, Outcome::kFalsified), (cause, Cause::kBound), (first_observation, 1));
    EXPECT_THAT(Explain(decision, problem, {}), HasSubstr("transition 1 shows a residual of vx of at least 0.015625"));
    EXPECT_THAT(Explain(decision, problem, {}),
                HasSubstr("declaration.regions[0].bound, for vx in [-4, 4], declares 0.015625 at most"));
  }
  Certifier certifier(SharedOf(BoundedPointMass()));
  const auto [z, next] = StepFrom(certifier.problem(), -1, -0.03125);
  ASSERT_EQ(certifier.Learn({z.data(), 6}, {next.data(), 4}), Learned::kAdded);
  ASSERT_TRUE(certifier.violation());
  EXPECT_FIELDS(certifier, (violation()->first, 1), (violation()->second, -2), (Contradiction().num_learned, 1));
}

// A step from 4.5 m/s that slipped by 1/16 leaves 1/16 - 1/40 at 4 m/s, which is more than 1/64.
TEST_F(Regions, AreContradictedByAStepNearbyOnlyWhereTheEnvelopeIsAsked) {
  Problem problem = BoundedPointMass();
  problem.transitions = {Eigen::MatrixXd(0, 6), Eigen::MatrixXd(0, 4)};
  Append(problem, 4.5, 0x1p-4);
  const Certifier certifier(SharedOf(problem));
  EXPECT_FALSE(certifier.violation());
  EXPECT_EQ(Certify(certifier, 0).outcome, Outcome::kCertified);
  const Zonotope point = Zonotope::FromBox(Eigen::Vector4d(0, 0, 3.99, 0), Eigen::Vector4d::Zero());
  const Decision decision = certifier.Certify({controls_.data(), 2, 8, 2}, point, {}, tube_);
  EXPECT_FIELDS(decision, (outcome, Outcome::kFalsified), (cause, Cause::kPairwise), (step, 0), (coordinate, 2));
}

// A calm region of a heading says nothing of the same configuration a turn on.
TEST(RegionsOfAnAngle, BoundSlopesAloneUnlessTheDomainHasLessThanATurn) {
  const std::vector<Eigen::VectorXd Region::*> bounds{&Region::disturbance, &Region::noise_bound, &Region::bound};
  const std::vector<std::string> keys{"disturbance", "noise_bound", "bound"};
  const auto problem = [](double lower, double upper, Eigen::VectorXd Region::*bound, std::vector<int> angles) {
    Problem made =
        WorldOf(MakeKinematicBicycle(0.1, 2.5, std::move(angles)), Within({40, 40, 4, 25, 3, 0.48}), Within({20, 2}));
    Eigen::VectorXd least = made.domain.state.lower(), most = made.domain.state.upper();
    least[2] = lower;
    most[2] = upper;
    made.domain.state = Box(least, most);
    Region& region = made.declaration.regions.emplace_back();
    region = {{{2, {-1, 4}}}, made.declaration.lipschitz};
    if (bound) region.*bound = Eigen::VectorXd::Zero(6);
    return SharedOf(made);
  };
  const double turn = kTurn.lower, half = turn / 2;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    EXPECT_NO_THROW(Certifier(problem(-half, half, bounds[i], {2})));
    EXPECT_NO_THROW(Certifier(problem(0, turn, bounds[i], {2}))) << "the largest double below a turn";
    EXPECT_NO_THROW(Certifier(problem(-4, 4, bounds[i], {}))) << "no angle";
    for (const auto& range : {std::pair(-half, NextUp(half)), std::pair(0.0, kTurn.upper), std::pair(-4.0, 4.0)})
      EXPECT_THAT(Thrown<std::invalid_argument>([&] { Certifier(problem(range.first, range.second, bounds[i], {2})); }),
                  HasSubstr("regions[0]." + keys[i] + " is bounded by theta, an angle, of which the domain has ["));
  }
  EXPECT_NO_THROW(Certifier(problem(-4, 4, nullptr, {2}))) << "slopes";
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
  EXPECT_THAT(refusal([&](Problem& p) { region(p).disturbance = Eigen::Vector3d::Zero(); }),
              HasSubstr("region 0: its disturbance has not"));
  EXPECT_THAT(refusal([&](Problem& p) { region(p).noise_bound = Eigen::Vector4d(0, 0, -1e-300, 0); }),
              HasSubstr("region 0: its noise_bound has not"));
  EXPECT_THAT(refusal([&](Problem& p) { region(p).bound = Eigen::Vector4d(0, 0, std::nan(""), 0); }),
              HasSubstr("region 0: its bound has not"));
  EXPECT_THAT(refusal([&](Problem& p) {
                p.declaration.affine = {{3}, {3}};
                region(p).bound = Eigen::Vector4d::Constant(1);
              }),
              HasSubstr("region 0: bounds row 3, which is affine"));
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
