// Estimates of declarations: what is called a lower bound is one, what is called consistent is consistent, and counts
// give Clopper & Pearson's bound.
#include "tests/test.h"

#include "forereach/residual/consistency.h"
#include "identify/calm_regions.h"
#include "identify/hold_out.h"
#include "identify/noise_floor.h"
#include "identify/smallest_row.h"
#include "tests/identify/seed.h"
#include "tests/oracle/exact.h"
#include "tests/worlds.h"

namespace forereach::estimates_test {

// Observations of a residual with known slopes: r(z) = sum_l L_l g_l(z_l) with |g_l'| <= 1, and errors within eps.
struct World {
  World(unsigned seed, int count, int columns, double eps) : random(seed) {
    true_slopes = Eigen::RowVectorXd::Zero(columns);
    for (int l = 0; l < columns; ++l) true_slopes[l] = random() % 3 == 0 ? 0 : Uniform(0.1, 2);
    observations.z = Eigen::MatrixXd(count, columns);
    observations.lower = observations.upper = Eigen::MatrixXd(count, 1);
    std::vector<int> kinds;
    for (int l = 0; l < columns; ++l) kinds.push_back(static_cast<int>(random() % 3));
    for (int i = 0; i < count; ++i) {
      double r = 0;
      for (int l = 0; l < columns; ++l) {
        double& x = observations.z(i, l);
        x = random() % 4 == 0 ? std::round(Uniform(-2, 2)) : Uniform(-2, 2);
        const double g[] = {x, std::sin(x), std::abs(x - 0.5)};
        r += true_slopes[l] * g[kinds[static_cast<std::size_t>(l)]];
      }
      r += Uniform(-eps, eps);
      observations.lower(i, 0) = r - 1e-15 * (1 + std::abs(r));
      observations.upper(i, 0) = r + 1e-15 * (1 + std::abs(r));
    }
    declaration = {Eigen::MatrixXd::Zero(1, columns), Eigen::VectorXd::Constant(1, eps * (1 + 1e-12) + 1e-13)};
  }
  double Uniform(double lower, double upper) { return std::uniform_real_distribution<double>(lower, upper)(random); }

  std::mt19937 random;
  Eigen::RowVectorXd true_slopes;
  Observations observations;
  Declaration declaration;
};

// r = 2 z0 in four corners of a rectangle and a point close to one of them, with eps = 0.25.
TEST(LoneSlopes, AreOfPairsThatDifferInOneColumnAlone) {
  Observations observations;
  observations.z = Eigen::MatrixXd(5, 3);
  observations.z << 0, 0, 7, 4, 0, 7, 0, 4, 7, 4, 4, 7, 0.2, 4, 7;
  observations.lower = observations.upper = 2 * observations.z.col(0);
  const Declaration declaration{Eigen::MatrixXd::Zero(1, 3), Eigen::VectorXd::Constant(1, 0.25)};
  const auto found = FindLoneSlopes(declaration, observations, 0, {0, 1, 2});
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].pairs, 4) << "0 1, 2 3, 2 4, 3 4";
  EXPECT_DOUBLE_EQ(found[0].slope, 7.5 / 4);
  EXPECT_FIELDS(found[0], (first, 0), (second, 1));
  EXPECT_EQ(found[1].pairs, 3) << "0 2, 1 3, and 0 4 which differ a little in column 0";
  EXPECT_EQ(found[1].slope, 0) << "2 * 0.2 is within twice eps";
  EXPECT_EQ(found[2].pairs, 0) << "it never varies";
  EXPECT_EQ(FindLoneSlopes(declaration, observations, 0, {1})[0].pairs, 0);
}

TEST(SmallestRow, IsConsistentAndNeverWeighsMoreThanTheTruth) {
  const unsigned first = SeedOf(1);
  for (unsigned trial = 0; trial < 60; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(first + trial));
    World world(first + trial, 5 + static_cast<int>(trial) * 4, 1 + static_cast<int>(trial % 6), trial % 2 ? 0 : 0.05);
    Eigen::RowVectorXd scales = world.true_slopes;
    for (double& s : scales) s = world.Uniform(0.2, 3);
    const SmallestRow found = FindSmallestRow(world.declaration, world.observations, 0, scales);
    ASSERT_FALSE(found.unexplained);
    EXPECT_LE(scales.dot(found.slopes), scales.dot(world.true_slopes) * (1 + 1e-6) + 1e-9);
    Declaration declaration = world.declaration;
    declaration.lipschitz.row(0) = found.slopes;
    EXPECT_FALSE(FindViolation(declaration, world.observations));
    declaration.lipschitz.row(0) = 0.999 * found.slopes;
    if (found.slopes.maxCoeff() > 1e-6)
      EXPECT_TRUE(FindViolation(declaration, world.observations)) << "a lighter row would do as well";
    for (Eigen::Index l = 0; l < found.slopes.size(); ++l) {
      const auto& reason = found.reasons[static_cast<std::size_t>(l)];
      EXPECT_EQ(reason.has_value(), found.slopes[l] > 0);
      if (!reason) continue;
      const Eigen::RowVectorXd apart =
          (world.observations.z.row(reason->first) - world.observations.z.row(reason->second)).cwiseAbs();
      EXPECT_NEAR(found.slopes.dot(apart), reason->difference, 1e-5) << "the reason is a tight pair";
      EXPECT_GT(apart[l], 0);
    }
  }
}

TEST(SmallestRow, ASingleEntryIsNeverAboveTheTruthIfTheOthersAreTrue) {
  const unsigned first = SeedOf(1);
  for (unsigned trial = 0; trial < 40; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(first + trial));
    World world(first + trial, 60, 3, trial % 2 ? 0 : 0.02);
    world.declaration.lipschitz.row(0) = world.true_slopes;
    for (int l = 0; l < 3; ++l) {
      const SmallestRow found = FindSmallestEntry(world.declaration, world.observations, 0, l);
      EXPECT_LE(found.slopes[l], world.true_slopes[l] * (1 + 1e-6) + 1e-9);
      for (int m = 0; m < 3; ++m)
        if (m != l) EXPECT_EQ(found.slopes[m], world.true_slopes[m]);
    }
  }
}

TEST(SmallestRow, IsTheOneWorkedOutByHand) {
  Observations observations{(Eigen::MatrixXd(3, 2) << 0, 0, 2, 0, 0, 5).finished(),
                            (Eigen::MatrixXd(3, 1) << 0, 1, -2).finished(),
                            (Eigen::MatrixXd(3, 1) << 0, 1, -2).finished()};
  Declaration declaration{Eigen::MatrixXd::Zero(1, 2), Eigen::VectorXd::Zero(1)};
  const auto row = [&](double s, double t) {
    return FindSmallestRow(declaration, observations, 0, Eigen::RowVector2d(s, t));
  };
  EXPECT_NEAR(row(1, 1).slopes[0], 0.5, 1e-8);
  EXPECT_NEAR(row(1, 1).slopes[1], 0.4, 1e-8);
  declaration.noise_bound[0] = 0.25;  // takes 0.5 off every difference
  EXPECT_NEAR(row(1, 1).slopes[0], 0.25, 1e-8);
  EXPECT_NEAR(row(1, 1).slopes[1], 0.4, 1e-8) << "of observations 1 and 2: 2.5 <= 0.25 * 2 + 0.4 * 5";
  declaration.noise_bound[0] = 1.5;
  EXPECT_EQ(row(1, 1).slopes, Eigen::RowVector2d::Zero());
  declaration.noise_bound[0] = 0;
  const SmallestRow one = row(1, -1);
  ASSERT_TRUE(one.unexplained) << "observations 0 and 2 agree in the first column";
  EXPECT_EQ(one.unexplained->first + one.unexplained->second, 2);
  EXPECT_EQ(one.unexplained->difference, 2);
}

// Two residuals, 0 and 1, at places that are so far apart, and a third one far away.
double ScatterAt(double distance, double noise) {
  const Observations observations{(Eigen::MatrixXd(3, 1) << 0, distance, 4).finished(),
                                  (Eigen::MatrixXd(3, 1) << 0, 1, 0.5).finished(),
                                  (Eigen::MatrixXd(3, 1) << 0, 1, 0.5).finished()};
  const Declaration declaration{Eigen::MatrixXd::Zero(1, 1), Eigen::VectorXd::Constant(1, noise)};
  const double scatter = FindScatter(declaration, observations, 0, Eigen::RowVectorXd::Ones(1));
  Declaration with = declaration;
  with.disturbance = Eigen::VectorXd::Constant(1, scatter);
  EXPECT_FALSE(FindSmallestRow(with, observations, 0, Eigen::RowVectorXd::Ones(1)).unexplained);
  return scatter;
}

TEST(Scatter, IsTheErrorThatNearPlacesShow) {
  EXPECT_NEAR(ScatterAt(0, 0), 0.5, 1e-6);
  EXPECT_NEAR(ScatterAt(kNearby - 0.001, 0), 0.5, 0.01) << "a slope of 1 / 8 remains";
  EXPECT_EQ(ScatterAt(kNearby + 0.001, 0), 0) << "a slope explains it";
  EXPECT_NEAR(ScatterAt(0, 0.3), 0.2, 1e-6) << "beyond the noise";
  EXPECT_EQ(ScatterAt(0, 0.5), 0);
}

TEST(Scatter, IsNoneOfSlopesAndOfDeclaredNoise) {
  const unsigned first = SeedOf(1);
  for (unsigned trial = 0; trial < 10; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(first + trial));
    World world(first + trial, 200, 2, 0.05);
    const Eigen::RowVectorXd scales = ScalesOf(world.observations);
    EXPECT_EQ(FindScatter(world.declaration, world.observations, 0, scales), 0);
    world.declaration.noise_bound[0] = 0.01;
    const double scatter = FindScatter(world.declaration, world.observations, 0, scales);
    EXPECT_GT(scatter, 0.02);
    EXPECT_LE(scatter, 0.04 + 1e-6) << "what is not declared of the error";
  }
}

TEST(NoiseFloor, OfRepetitionsIsNeverAboveTheError) {
  const unsigned first = SeedOf(1);
  for (unsigned trial = 0; trial < 40; ++trial) {
    SCOPED_TRACE("seed " + std::to_string(first + trial));
    World world(first + trial, 200, 1, 0.05);
    const NoiseFloor floor = FindNoiseFloor(world.observations, 0, {0});
    EXPECT_LE(floor.repeated, 0.05);
    EXPECT_GT(floor.repeated, 0.02) << "a quarter of the places are five numbers";
    EXPECT_EQ(floor.pair->difference, 2 * floor.repeated);
    EXPECT_EQ(world.observations.z(floor.pair->first, 0), world.observations.z(floor.pair->second, 0));
    EXPECT_NEAR(floor.deviation, 0.05 / std::sqrt(3), 0.015) << "the deviation of an even distribution";
  }
}

// P(X <= count), exactly.
Rational Below(int count, int trials, const Rational& p) {
  Rational sum = 0, choose = 1;
  for (int i = 0; i <= count; ++i) {
    Rational term = choose;
    for (int j = 0; j < i; ++j) term *= p;
    for (int j = i; j < trials; ++j) term *= 1 - p;
    sum += term;
    choose = choose * (trials - i) / (i + 1);
  }
  return sum;
}

TEST(ProbabilityUpper, IsClopperAndPearsonsInRationals) {
  for (const int trials : {1, 2, 5, 10, 17, 40})
    for (const double confidence : {0.5, 0.9, 0.95, 0.999})
      for (int count = 0; count < trials; count += 1 + trials / 6) {
        const double p = ProbabilityUpper(count, trials, confidence);
        ASSERT_GT(p, 0);
        ASSERT_LT(p, 1);
        const Rational rest = 1 - Rational(confidence);
        EXPECT_LE(Below(count, trials, Rational(p)), rest) << count << " of " << trials;
        EXPECT_GT(Below(count, trials, Rational(p * (1 - 1e-7))), rest) << count << " of " << trials;
      }
  EXPECT_EQ(ProbabilityUpper(7, 7, 0.95), 1);
  EXPECT_NEAR(ProbabilityUpper(0, 10, 0.95), 1 - std::pow(0.05, 0.1), 1e-8);
}

// ---- hold-out

TEST(Split, AlternatesBlocksAndCoversEveryTransition) {
  const Split split = SplitByTime(10, 4);
  std::vector<int> ends;
  for (const auto& block : split.learn) ends.insert(ends.end(), {block.begin, block.end});
  for (const auto& block : split.judge) ends.insert(ends.end(), {block.begin, block.end});
  EXPECT_THAT(ends, ElementsAre(0, 2, 5, 7, 2, 5, 7, 10));
  EXPECT_THROW((void)SplitByTime(10, 1), std::invalid_argument);
  EXPECT_THROW((void)SplitByTime(10, 11), std::invalid_argument);
  EXPECT_NO_THROW((void)SplitByTime(10, 10));
}

struct HoldOutTest : testing::Test {
  // The point mass from rest, with a residual of vx that falls with vx and noise.
  HoldOutTest() : random_(seed_) {
    SCOPED_TRACE("seed " + std::to_string(seed_));
    Transitions& data = problem_.transitions;
    data.z = Eigen::MatrixXd::Zero(120, 6);
    data.x_next = Eigen::MatrixXd::Zero(120, 4);
    std::uniform_real_distribution<double> uniform(-1, 1);
    Eigen::Vector4d x = Eigen::Vector4d::Zero();
    for (Eigen::Index i = 0; i < 120; ++i) {
      data.z.row(i) << x.transpose(), uniform(random_), 0;
      const Eigen::VectorXd z = data.z.row(i);
      problem_.model->Evaluate({z.data(), 6}, {x.data(), 4});
      x[2] += -0.02 * std::abs(z[2]) + 0.003 * uniform(random_);
      data.x_next.row(i) = x;
    }
    declaration_ = {Eigen::MatrixXd::Zero(4, 6), Eigen::VectorXd::Constant(4, 0.001)};
  }
  // The same by all pairs.
  int Expected(const Split& split) const {
    const Observations all = Observe(*problem_.model, problem_.transitions);
    int count = 0;
    for (const auto& judge : split.judge)
      for (int j = judge.begin; j < judge.end; ++j) {
        bool any = false;
        for (const auto& learn : split.learn)
          for (int i = learn.begin; i < learn.end; ++i)
            for (int k = 0; k < 4; ++k) any |= TestPair(declaration_, all, i, j, k).has_value();
        count += any;
      }
    return count;
  }

  const unsigned seed_ = SeedOf(1);
  std::mt19937 random_;
  Problem problem_ = WorldOf(MakePointMass(0.1), Within({99, 99, 9, 9}), Within({1, 1}));
  Declaration declaration_;
};

TEST_F(HoldOutTest, CountsEachFreshTransitionThatContradictsALearnedOne) {
  SCOPED_TRACE("seed " + std::to_string(seed_));
  int last = 121;
  for (const double slope : {0.0, 0.005, 0.02, 0.1}) {
    declaration_.lipschitz(2, 2) = slope;
    const Split split = SplitByTime(120, 8);
    const ContradictionCounts found = CountContradictions(problem_, declaration_, split);
    EXPECT_FIELDS(found, (contradicting, Expected(split)), (transitions, 60), (blocks, 4));
    EXPECT_LE(found.contradicting, last);
    EXPECT_EQ(found.blocks_contradicting == 0, found.contradicting == 0);
    last = found.contradicting;
  }
  EXPECT_EQ(Expected(SplitByTime(120, 8)), last);
  declaration_.lipschitz(2, 2) = 0;
  EXPECT_GT(CountContradictions(problem_, declaration_, SplitByTime(120, 8)).contradicting, 0);
}

TEST_F(HoldOutTest, AnAffineRowIsJudgedByWhatTheLearnedOnesLeaveOfIt) {
  // 0.1 v + 0.2, within 0.001 at v = 0 and at 1: at 2 within 0.003, and what is seen there is within another 0.001.
  const auto contradicting = [&](double second_v, double off) {
    Transitions& data = problem_.transitions;
    data.z = Eigen::MatrixXd::Zero(4, 6);
    data.z.col(2) << 0, second_v, 2, 2;
    data.x_next = Eigen::MatrixXd(4, 4);
    Eigen::Vector4d x;
    for (Eigen::Index i = 0; i < 4; ++i) {
      const Eigen::VectorXd z = data.z.row(i);
      problem_.model->Evaluate({z.data(), 6}, {x.data(), 4});
      x[2] += 0.1 * z[2] + 0.2 + (i < 2 ? 0 : i == 2 ? off : -off);
      data.x_next.row(i) = x;
    }
    return CountContradictions(problem_, declaration_, {{{0, 2}}, {{2, 4}}}).contradicting;
  };
  declaration_.affine = {{2}, {2}};
  EXPECT_EQ(contradicting(1, 0.003999), 0);
  EXPECT_EQ(contradicting(1, 0.004001), 2);
  EXPECT_EQ(contradicting(0, 9), 0) << "one speed leaves every slope";
}

TEST_F(HoldOutTest, WhatTheErrorsOfTheRecordExplainDoesNotContradict) {
  const Split split = SplitByTime(120, 8);
  EXPECT_GT(CountContradictions(problem_, declaration_, split).contradicting, 0);
  declaration_.state_error = Vec({0, 0, 0.5, 0});  // the residual is at most 0.02 * 9 in size
  EXPECT_EQ(CountContradictions(problem_, declaration_, split).contradicting, 0);
}

TEST_F(HoldOutTest, WindowsAreUnbrokenChainsInsideJudgingBlocks) {
  const Split split = SplitByTime(120, 4);  // judges by 30..60 and 90..120
  EXPECT_EQ(WindowsOf(problem_.transitions, split, 10).size(), 6u);
  EXPECT_EQ(WindowsOf(problem_.transitions, split, 30).size(), 2u);
  EXPECT_EQ(WindowsOf(problem_.transitions, split, 31).size(), 0u);
  problem_.transitions.z(45, 0) += 1e-12;
  const std::vector<HoldOutWindow> windows = WindowsOf(problem_.transitions, split, 10);
  std::vector<int> begins;
  for (const HoldOutWindow& window : windows) begins.push_back(window.begin);
  EXPECT_THAT(begins, ElementsAre(30, 45, 90, 100, 110));
}

// The number of a row whose disturbance has an expression, too, cannot stand in a task file.
TEST(CalmRegions, AreOfRowsWhoseDisturbanceIsANumber) {
  Problem problem = PaperPointMass();
  problem.declaration.disturbance = Eigen::Vector4d(0, 0, 0.125, 0.125);
  Observations seen{Eigen::MatrixXd::Zero(400, 6), Eigen::MatrixXd::Zero(400, 4), {}};
  for (int i = 0; i < 400; ++i) {
    seen.z(i, 2) = 0.01 * (i - 200);
    for (const int k : {2, 3}) seen.lower(i, k) = (i % 2 == 0 ? 1 : -1) * (i < 200 ? 0x1p-7 : 0x1p-4);
  }
  seen.upper = seen.lower;
  const auto calm = FindCalmRegions(problem.declaration, seen, {2});
  ASSERT_FALSE(calm.empty());
  EXPECT_LT(calm[0].region.disturbance[2], 0.125);
  EXPECT_LT(calm[0].region.disturbance[3], 0.125);
  problem.declaration.growing = Growing(*problem.model, {"0", "0", "vx", "0"});
  const auto without = FindCalmRegions(problem.declaration, seen, {2});
  ASSERT_FALSE(without.empty());
  for (const CalmRegion& found : without) EXPECT_EQ(found.region.disturbance[2], kInfinity);
  EXPECT_LT(without[0].region.disturbance[3], 0.125);
}

}  // namespace forereach::estimates_test
