// Plans certified in pieces of X_0 whose tube as a whole is too wide.
#include "tests/test.h"

#include <random>

#include "forereach/certify/pieces.h"
#include "tests/gap.h"
#include "tests/worlds.h"

namespace forereach::pieces_test {

const std::function<bool()> kAlways = [] { return true; };

// A bicycle in a curve beside a circle. From all of X_0 it may touch it.
struct PiecesTest : testing::Test {
  explicit PiecesTest(std::uint32_t seed = 1) {
    std::mt19937 random(seed);
    const auto in = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    center_ = Vec({0, 0, 0, in(8, 14), 0, in(0.2, 0.35)});
    half_width_ = Vec({0.05, 0.05, 0.02, in(0.2, 0.5), 0.05, in(0.01, 0.03)});
    controls_ = Vec({in(-1, 1), in(-0.05, 0.05)}).replicate(1, 12);
    obstacle_ = JustTouched(certifier_, plan(), initial_set());
    whole_ = certifier_.Certify(plan(), initial_set(), obstacles(), tube_);
  }

  [[nodiscard]] Plan plan() const { return {controls_.data(), 2, 12, 2}; }
  [[nodiscard]] Zonotope initial_set() const { return Zonotope::FromBox(center_, half_width_); }
  [[nodiscard]] ObstacleView obstacles() const { return {&obstacle_, 1}; }
  Decision Certify(int most = Pieces::kMost, const std::function<bool()>& goes_on = kAlways, int first = 0) {
    return pieces_.Certify(certifier_, plan(), initial_set(), obstacles(), whole_, most, goes_on, tube_, first);
  }

  // The boxes that the cuts leave.
  [[nodiscard]] std::vector<Box> Leaves() const {
    std::vector<Box> open{Box::FromCenter(center_, half_width_)}, leaves;
    for (const PieceCut& cut : pieces_.cuts()) {
      const Box part = open.back();
      open.pop_back();
      if (cut.state < 0) {
        leaves.push_back(part);
        continue;
      }
      Eigen::VectorXd below = part.upper(), above = part.lower();
      below[cut.state] = above[cut.state] = cut.at;
      open.emplace_back(above, part.upper());
      open.emplace_back(part.lower(), below);
    }
    EXPECT_TRUE(open.empty());
    return leaves;
  }

  Certifier certifier_{std::make_shared<Problem>(PaperBicycle())};
  Eigen::VectorXd center_, half_width_;
  Eigen::MatrixXd controls_;
  Obstacle obstacle_ = Obstacle::Circle(Eigen::Vector2d::Zero(), 1);
  Tube tube_;
  Decision whole_;
  Pieces pieces_;
};

TEST_F(PiecesTest, CertifyWhatTheTubeOfTheWholeMayTouch) {
  ASSERT_EQ(whole_.cause, Cause::kObstacle);
  const Decision decision = Certify();
  EXPECT_EQ(decision.outcome, Outcome::kCertified);
  EXPECT_EQ(decision.obstacle, 0);
  EXPECT_GT(decision.margin, decision.threshold);
  EXPECT_GE(pieces_.count(), 2);
  EXPECT_LE(pieces_.count(), Pieces::kMost);
}

TEST(PiecesOfX0, EachIsCertifiedAndTogetherTheyHoldAllMotions) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    struct Scene final : PiecesTest {
      using PiecesTest::PiecesTest;
      void TestBody() override {}
    } scene(seed);
    const Decision decision = scene.Certify();
    ASSERT_EQ(decision.outcome, Outcome::kCertified);
    const std::vector<Box> leaves = scene.Leaves();
    EXPECT_EQ(std::ssize(leaves), scene.pieces_.count());
    Tube of_piece;
    double closest = kInfinity;
    for (const Box& leaf : leaves) {
      const Decision alone =
          scene.certifier_.Certify(scene.plan(), Zonotope::Enclose(leaf), scene.obstacles(), of_piece);
      EXPECT_EQ(alone.outcome, Outcome::kCertified);
      closest = std::min(closest, alone.margin - alone.threshold);
      for (int t = 1; t <= 12; ++t)
        for (int k = 0; k < 6; ++k) {
          EXPECT_LE(scene.tube_.hull(t, k).lower, of_piece.hull(t, k).lower) << t << ", " << k;
          EXPECT_GE(scene.tube_.hull(t, k).upper, of_piece.hull(t, k).upper) << t << ", " << k;
        }
    }
    EXPECT_EQ(decision.margin - decision.threshold, closest) << "of the piece that comes closest";
    std::mt19937 random(seed);
    for (int i = 0; i < 200; ++i) {
      std::vector<double> x(6);
      for (std::size_t k = 0; k < 6; ++k)
        x[k] = scene.center_[static_cast<int>(k)] +
               scene.half_width_[static_cast<int>(k)] * std::uniform_real_distribution(-1.0, 1.0)(random);
      EXPECT_TRUE(std::ranges::any_of(
          leaves, [&](const Box& leaf) { return leaf.Contains(Eigen::Map<const Eigen::VectorXd>(x.data(), 6)); }));
      for (int t = 0; t <= 12; ++t) {
        for (std::size_t k = 0; k < 6; ++k)
          EXPECT_TRUE(scene.tube_.hull(t, static_cast<int>(k)).Contains(x[k])) << t << ", " << k;
        if (t == 12) break;
        std::vector<double> z = x;
        z.insert(z.end(), scene.plan().input(t).begin(), scene.plan().input(t).end());
        scene.certifier_.problem().model->Evaluate(z, x);
      }
    }
  }
}

TEST_F(PiecesTest, AreNoMoreThanAllowed) {
  const int needed = Certify().outcome == Outcome::kCertified ? pieces_.count() : 0;
  ASSERT_GE(needed, 2);
  whole_ = certifier_.Certify(plan(), initial_set(), obstacles(), tube_);
  const Interval before = tube_.hull(12, 0);
  EXPECT_EQ(Certify(needed - 1).outcome, Outcome::kNone);
  EXPECT_EQ(tube_.hull(12, 0), before) << "it is unchanged";
  EXPECT_EQ(Certify(needed).outcome, Outcome::kCertified);
  EXPECT_NE(tube_.hull(12, 0), before);
}

TEST_F(PiecesTest, EveryTrialIsAskedFor) {
  ASSERT_EQ(Certify().outcome, Outcome::kCertified);
  const int needed = pieces_.trials();
  for (int allowed = 0; allowed <= needed; ++allowed) {
    whole_ = certifier_.Certify(plan(), initial_set(), obstacles(), tube_);
    int asked = 0;
    const Decision decision = Certify(Pieces::kMost, [&] { return asked++ < allowed; });
    EXPECT_EQ(pieces_.trials(), allowed);
    EXPECT_EQ(decision.outcome, allowed < needed ? Outcome::kNone : Outcome::kCertified) << allowed;
  }
}

TEST_F(PiecesTest, WhereNoneWouldHelpFewAreTried) {
  obstacle_ = Obstacle::Circle(Eigen::Vector2d(10, 3), 4);
  whole_ = certifier_.Certify(plan(), initial_set(), obstacles(), tube_);
  ASSERT_EQ(whole_.outcome, Outcome::kSafety);
  EXPECT_EQ(Certify().outcome, Outcome::kNone);
  EXPECT_LT(pieces_.trials(), 30);
}

TEST_F(PiecesTest, WhatIsPastDoesNotCount) {
  std::vector<Obstacle> both{obstacle_, Obstacle::Circle(Eigen::Vector2d::Zero(), 0.5)};
  const auto certify = [&](int first) {
    static_cast<void>(certifier_.Certify(plan(), initial_set(), both, tube_));
    whole_ = certifier_.JudgeSafety(plan(), both, tube_, first);
    return pieces_.Certify(certifier_, plan(), initial_set(), both, whole_, Pieces::kMost, kAlways, tube_, first);
  };
  EXPECT_EQ(certify(0).outcome, Outcome::kNone) << "it begins inside the second";
  EXPECT_EQ(certify(6).outcome, Outcome::kCertified);
}

TEST_F(PiecesTest, OfAPointThereAreNone) {
  half_width_.setZero();
  obstacle_ = Obstacle::Circle(Eigen::Vector2d(10, 3), 8);
  whole_ = certifier_.Certify(plan(), initial_set(), obstacles(), tube_);
  ASSERT_EQ(whole_.outcome, Outcome::kSafety);
  EXPECT_EQ(Certify().outcome, Outcome::kNone);
  EXPECT_EQ(pieces_.trials(), 0);
}

TEST_F(PiecesTest, OfAnotherAnswerThanSThereAreNone) {
  for (const Outcome outcome : {Outcome::kNone, Outcome::kCertified, Outcome::kFalsified, Outcome::kDomain}) {
    whole_.outcome = outcome;
    EXPECT_EQ(Certify().outcome, Outcome::kNone);
    EXPECT_EQ(pieces_.trials(), 0);
  }
}

TEST_F(PiecesTest, ALimitIsKeptInPieces) {
  Problem problem = PaperBicycle();
  problem.limits = {{.name = "left", .that = {"y", 1, 1}, .at_most = tube_.hull(12, 1).upper - 1e-6}};
  const Certifier limited(std::make_shared<Problem>(problem));
  whole_ = limited.Certify(plan(), initial_set(), {}, tube_);
  ASSERT_EQ(whole_.cause, Cause::kLimit);
  EXPECT_EQ(pieces_.Certify(limited, plan(), initial_set(), {}, whole_, Pieces::kMost, kAlways, tube_).outcome,
            Outcome::kCertified);
}

}  // namespace forereach::pieces_test
