// Affine rows of the residual in the certifier: a wrong gain, what bounds it, and what contradicts it.
#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "tests/worlds.h"

namespace forereach::affine_rows_test {

constexpr double kDt = 0.125, kDrag = 0.05, kGain = 0.8;

// A robot with a drag and a weaker motor than its model, a point mass; `steps` transitions of it, each successor off by
// up to `noise`. vx and vy are affine in vx, vy, ax and ay.
Problem DraggedPointMass(int steps, double noise) {
  Problem problem = WorldOf(MakePointMass(kDt), Within({20, 20, 6, 6}), Within({3, 3}));
  problem.declaration.noise_bound = Vec({0, 0, noise, noise});
  problem.declaration.affine = {{2, 3}, {2, 3, 4, 5}};
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> any(-1, 1);
  problem.transitions = {Eigen::MatrixXd(steps, 6), Eigen::MatrixXd(steps, 4)};
  for (int i = 0; i < steps; ++i) {
    Eigen::VectorXd z(6), next(4);
    for (int l = 0; l < 6; ++l) z[l] = any(engine) * (l < 4 ? 2 : 1);
    problem.model->Evaluate({z.data(), 6}, {next.data(), 4});
    for (int k = 2; k < 4; ++k) next[k] += kDt * ((kGain - 1) * z[k + 2] - kDrag * z[k]) + 0.99 * noise * any(engine);
    problem.transitions.z.row(i) = z;
    problem.transitions.x_next.row(i) = next;
  }
  return problem;
}

std::shared_ptr<const Problem> Shared(Problem problem) { return std::make_shared<const Problem>(std::move(problem)); }

struct AffineResidual : testing::Test {
  Decision Certify(const Certifier& certifier) {
    return certifier.Certify({controls_.data(), 2, 16, 2}, start_, {}, tube_);
  }

  const Eigen::MatrixXd controls_ = Eigen::Vector2d(1, -0.5).replicate(1, 16);
  const Zonotope start_ = Zonotope::FromBox(Eigen::Vector4d(0, 0, 1, 0), Eigen::Vector4d::Constant(0.01));
  Tube tube_;
};

// With eight steps. L is the least that is true: the slopes of the residual.
TEST_F(AffineResidual, GivesAHandfulOfStepsATubeThatNoLipschitzBoundCan) {
  const Problem affine = DraggedPointMass(8, 1e-4);
  Problem lipschitz = affine;
  lipschitz.declaration.affine = {};
  for (int k = 2; k < 4; ++k) {
    lipschitz.declaration.lipschitz(k, k) = kDt * kDrag;
    lipschitz.declaration.lipschitz(k, k + 2) = kDt * (1 - kGain);
  }
  ASSERT_EQ(Certify(Certifier(Shared(affine))).outcome, Outcome::kCertified);
  const double narrow = tube_.half_width(16)[0];
  ASSERT_EQ(Certify(Certifier(Shared(lipschitz))).outcome, Outcome::kCertified);
  const double wide = tube_.half_width(16)[0];
  RecordProperty("affine", std::to_string(narrow));
  RecordProperty("lipschitz", std::to_string(wide));
  std::cout << "half-width of x after 2 s: affine " << narrow << " m, Lipschitz " << wide << " m\n";
  EXPECT_LT(narrow, 0.25 * wide);
  EXPECT_GT(narrow, 0.01);
}

TEST_F(AffineResidual, WithoutNoiseIsKnownAfterOneStepMoreThanItHasColumns) {
  ASSERT_EQ(Certify(Certifier(Shared(DraggedPointMass(5, 0)))).outcome, Outcome::kCertified);
  double x = 0, v = 1, y = 0, w = 0;
  for (int t = 0; t < 16; ++t) {
    x += kDt * v + kDt * kDt / 2;
    y += kDt * w - kDt * kDt / 4;
    v += kDt * (kGain - kDrag * v);
    w += kDt * (-0.5 * kGain - kDrag * w);
    EXPECT_NEAR(tube_.slice(t + 1).center(2), v, 1e-4);
    EXPECT_NEAR(tube_.half_width(t + 1)[2], 0.01 * std::pow(1 - kDt * kDrag, t + 1), 1e-5);
    EXPECT_TRUE(tube_.hull(t + 1, 0).Contains(x));
  }
}

// Abstains, and says which direction the data do not excite.
TEST_F(AffineResidual, HasNoBoundWhereTheDataVaryTogether) {
  Problem problem = DraggedPointMass(12, 1e-4);
  const Certifier enough(Shared(problem));
  EXPECT_EQ(enough.Unexcited(), "");
  problem.transitions.x_next.col(2) -= kDt * problem.transitions.z.col(4);
  problem.transitions.z.col(4) = 0.5 * problem.transitions.z.col(2);
  problem.transitions.x_next.col(2) += kDt * problem.transitions.z.col(4);
  problem.declaration.noise_bound.setConstant(1);
  const Certifier certifier(Shared(problem));
  ASSERT_FALSE(certifier.violation());
  EXPECT_THAT(certifier.Unexcited(), AnyOf(HasSubstr("0.5 vx - ax is the same in all observations"),
                                           HasSubstr("-0.5 vx + ax is the same in all observations")));
  EXPECT_FIELDS(Certify(certifier), (outcome, Outcome::kDomain), (cause, Cause::kNoFiniteEnclosure), (step, 0));
}

TEST_F(AffineResidual, IsFalsifiedByAFewObservationsThatAreNamed) {
  Problem problem = DraggedPointMass(40, 1e-4);
  problem.transitions.x_next(17, 3) += 0.05;
  const Certifier certifier(Shared(problem));
  ASSERT_TRUE(certifier.violation());
  EXPECT_EQ(certifier.violation()->coordinate, 3);
  EXPECT_GT(certifier.violation()->difference, certifier.violation()->bound);
  EXPECT_EQ(Certify(certifier).outcome, Outcome::kFalsified);
  // They are six, for five unknowns, and contradict the declaration without the others.
  const Transitions rows = certifier.Contradiction();
  EXPECT_EQ(rows.size(), 6);
  Problem few = problem;
  few.transitions = rows;
  EXPECT_TRUE(Certifier(Shared(few)).violation());
}

TEST_F(AffineResidual, IsNarrowedAndContradictedByWhatIsLearned) {
  const Problem all = DraggedPointMass(60, 1e-3);
  Problem first = all;
  first.transitions = {all.transitions.z.topRows(6), all.transitions.x_next.topRows(6)};
  Certifier certifier(Shared(first));
  ASSERT_EQ(Certify(certifier).outcome, Outcome::kCertified);
  double width = tube_.half_width(16)[0];
  const double before = width;
  for (int i = 6; i < 60; ++i) {
    const Eigen::VectorXd z = all.transitions.z.row(i), next = all.transitions.x_next.row(i);
    ASSERT_EQ(certifier.Learn({z.data(), 6}, {next.data(), 4}), Learned::kAdded);
    ASSERT_EQ(Certify(certifier).outcome, Outcome::kCertified);
    EXPECT_LE(tube_.half_width(16)[0], width * 1.01) << "more observations bound no less";
    width = tube_.half_width(16)[0];
  }
  EXPECT_LT(width, 0.5 * before);
  ASSERT_EQ(Certify(Certifier(Shared(all))).outcome, Outcome::kCertified);
  EXPECT_NEAR(tube_.half_width(16)[0], width, 1e-3 * width);
  const Eigen::VectorXd z = all.transitions.z.row(3);
  Eigen::VectorXd next = all.transitions.x_next.row(3);
  next[2] += 0.1;
  ASSERT_EQ(certifier.Learn({z.data(), 6}, {next.data(), 4}), Learned::kAdded);
  ASSERT_TRUE(certifier.violation());
  const Transitions rows = certifier.Contradiction();
  EXPECT_FIELDS(rows, (size(), 6), (x_next(5, 2), next[2]));
  EXPECT_GT(rows.num_learned, 0);
}

// The true slopes of vx are -0.00625 by vx and -0.025 by ax: a declared bound on them is refuted where data are exact
// enough, and no sooner.
TEST_F(AffineResidual, IsFalsifiedByASlopeOfMoreThanIsDeclared) {
  const auto with = [](int column, double most, double noise) {
    Problem problem = DraggedPointMass(40, noise);
    problem.declaration.lipschitz(2, column) = most;
    return Certifier(Shared(problem));
  };
  EXPECT_FALSE(with(4, 0.025, 1e-4).violation());
  EXPECT_FALSE(with(4, 0.0245, 1e-2).violation());
  EXPECT_FALSE(with(2, 0.00625, 1e-4).violation());
  EXPECT_TRUE(with(2, 0.006, 1e-6).violation());
  const Certifier certifier = with(4, 0.0245, 1e-4);
  ASSERT_TRUE(certifier.violation());
  EXPECT_EQ(certifier.violation()->coordinate, 2);
  EXPECT_GT(certifier.violation()->difference, 0.0245);
  EXPECT_LE(certifier.violation()->difference, 0.025);
  const Decision decision = Certify(certifier);
  EXPECT_EQ(decision.outcome, Outcome::kFalsified);
  EXPECT_THAT(Explain(decision, certifier.problem()), HasSubstr("declaration.lipschitz says 0.0245 at most"));
  Problem few = certifier.problem();
  few.transitions = certifier.Contradiction();
  EXPECT_EQ(few.transitions.size(), 5);
  EXPECT_TRUE(Certifier(Shared(few)).violation());
}

// One step whose inputs are off by e: what that makes of vx is dt e by the model, and by the residual the declared
// slopes times e, once in each observation and once in the step, where the inputs that act are off, too.
TEST_F(AffineResidual, CountsErrorsOfRecordsAndInputsByTheDeclaredSlopes) {
  const auto width = [&](double error, double most) {
    Problem problem = DraggedPointMass(200, 1e-9);
    problem.declaration.input_error = Vec({error, error});
    for (int k = 2; k < 4; ++k) problem.declaration.lipschitz(k, 4) = problem.declaration.lipschitz(k, 5) = most;
    const Certifier certifier(Shared(problem));
    EXPECT_FALSE(certifier.violation());
    const double u[] = {0.5, 0.25};
    const auto start = Zonotope::FromBox(Eigen::Vector4d(0, 0, 0.5, 0), Eigen::Vector4d::Zero());
    EXPECT_EQ(certifier.Certify({u, 2, 1, 2}, start, {}, tube_).outcome, Outcome::kCertified);
    return tube_.half_width(1)[2];
  };
  EXPECT_LT(width(0, 0), 1e-7);
  constexpr double kError = 1e-3;
  for (const double most : {0.05, 0.5}) {
    const double once = (kDt + 2 * most) * kError;  // of one record, or of the step
    EXPECT_GE(width(kError, most), once);
    EXPECT_LE(width(kError, most), 2 * once + 1e-8);
  }
}

// The drag grows with the square of the speed as well: of up to 2 m/s its slope is kQuadratic.
constexpr double kQuadratic = 0.001;

Problem QuadraticallyDragged(int steps, double noise) {
  Problem problem = DraggedPointMass(steps, noise);
  for (int i = 0; i < steps; ++i)
    for (int k = 2; k < 4; ++k)
      problem.transitions.x_next(i, k) -=
          kQuadratic / 4 * problem.transitions.z(i, k) * std::abs(problem.transitions.z(i, k));
  return problem;
}

// 6 m/s in the domain, so three times the slope.
Problem WithRest(Problem problem) {
  problem.declaration.affine.rest.setZero(4, 6);
  problem.declaration.affine.rest(2, 2) = problem.declaration.affine.rest(3, 3) = 3 * kQuadratic;
  return problem;
}

TEST_F(AffineResidual, UpToARestIsNarrowerThanByLipschitzBoundsAlone) {
  const Problem dragged = QuadraticallyDragged(40, 2e-5);
  EXPECT_TRUE(Certifier(Shared(dragged)).violation()) << "it is not affine";
  Problem lipschitz = dragged;
  lipschitz.declaration.affine = {};
  for (int k = 2; k < 4; ++k) {
    lipschitz.declaration.lipschitz(k, k) = kDt * kDrag + 3 * kQuadratic;
    lipschitz.declaration.lipschitz(k, k + 2) = kDt * (1 - kGain);
  }
  ASSERT_EQ(Certify(Certifier(Shared(lipschitz))).outcome, Outcome::kCertified);
  const double wide = tube_.half_width(16)[0];
  ASSERT_EQ(Certify(Certifier(Shared(WithRest(dragged)))).outcome, Outcome::kCertified);
  const double narrow = tube_.half_width(16)[0];
  std::cout << "half-width of x after 2 s: affine up to a rest " << narrow << " m, Lipschitz " << wide << " m\n";
  EXPECT_LT(narrow, 0.5 * wide);
  double x = 0, v = 1;
  for (int t = 0; t < 16; ++t) {
    EXPECT_TRUE(tube_.hull(t, 0).Contains(x) && tube_.hull(t, 2).Contains(v));
    x += kDt * v + kDt * kDt / 2;
    v += kDt * (kGain - kDrag * v) - kQuadratic / 4 * v * std::abs(v);
  }
}

// A rest of nothing is none; a small one costs little, however the row is seen.
TEST_F(AffineResidual, OfASmallRestIsAlmostThatOfNone) {
  Problem problem = DraggedPointMass(40, 1e-4);
  ASSERT_EQ(Certify(Certifier(Shared(problem))).outcome, Outcome::kCertified);
  const double none = tube_.half_width(16)[0];
  const auto width = [&](double slope) {
    problem.declaration.affine.rest = Eigen::MatrixXd::Constant(4, 6, slope);
    problem.declaration.affine.rest.topRows(2).setZero();
    EXPECT_EQ(Certify(Certifier(Shared(problem))).outcome, Outcome::kCertified);
    return tube_.half_width(16)[0];
  };
  EXPECT_EQ(width(0), none);
  EXPECT_GE(width(1e-7), none);
  EXPECT_LE(width(1e-7), 1.1 * none);
  EXPECT_GT(width(1e-3), 1.1 * none);
}

// What is learned near the plan narrows it, although a rest hides it from afar; so does it contradict.
TEST_F(AffineResidual, UpToARestIsNarrowedAndContradictedByWhatIsLearned) {
  const Problem all = WithRest(QuadraticallyDragged(300, 1e-3));
  Problem first = all;
  first.transitions = {all.transitions.z.topRows(20), all.transitions.x_next.topRows(20)};
  Certifier certifier(Shared(first));
  ASSERT_EQ(Certify(certifier).outcome, Outcome::kCertified);
  const double before = tube_.half_width(16)[0];
  for (int i = 20; i < 300; ++i) {
    const Eigen::VectorXd z = all.transitions.z.row(i), next = all.transitions.x_next.row(i);
    ASSERT_EQ(certifier.Learn({z.data(), 6}, {next.data(), 4}), Learned::kAdded);
  }
  ASSERT_FALSE(certifier.violation());
  ASSERT_EQ(Certify(certifier).outcome, Outcome::kCertified);
  const double after = tube_.half_width(16)[0];
  EXPECT_LT(after, 0.8 * before);
  ASSERT_EQ(Certify(Certifier(Shared(all))).outcome, Outcome::kCertified);
  EXPECT_NEAR(tube_.half_width(16)[0], after, 0.02 * after);
  // The same step again, otherwise: less than a rest could hide elsewhere.
  const Eigen::VectorXd z = all.transitions.z.row(3);
  Eigen::VectorXd next = all.transitions.x_next.row(3);
  next[2] += 0.005;
  ASSERT_EQ(certifier.Learn({z.data(), 6}, {next.data(), 4}), Learned::kAdded);
  ASSERT_TRUE(certifier.violation());
  EXPECT_EQ(certifier.violation()->coordinate, 2);
  EXPECT_EQ(certifier.violation()->second, 300);
  Problem few = all;
  few.transitions = certifier.Contradiction();
  EXPECT_LE(few.transitions.size(), 7);
  EXPECT_TRUE(Certifier(Shared(few)).violation());
}

TEST(AffineDeclaration, IsRefusedWhereItIsNotBuilt) {
  const auto refusal = [](const std::function<void(Problem&)>& change) {
    Problem problem = DraggedPointMass(8, 1e-4);
    change(problem);
    return Thrown<std::invalid_argument>([&] { const Certifier certifier(Shared(problem)); });
  };
  EXPECT_EQ(refusal([](Problem&) {}), "");
  EXPECT_THAT(refusal([](Problem& p) { p.declaration.lipschitz(2, 0) = 0.1; }),
              HasSubstr("affine: row 2, variable 0: bounded by lipschitz, and no column"));
  EXPECT_EQ(refusal([](Problem& p) { p.declaration.state_error = Vec({1e-3, 0, 0, 0}); }), "") << "no column";
  EXPECT_THAT(refusal([](Problem& p) {
                p.declaration.state_error = Vec({0, 0, 1e-3, 0});
              }),
              HasSubstr("affine: row 2, variable 2: recorded with an error"));
  EXPECT_THAT(refusal([](Problem& p) {
                p.declaration.state_error = Vec({0, 0, 1e-3, 0});
                p.declaration.lipschitz(2, 2) = 0.1;
              }),
              HasSubstr("affine: row 3, variable 2: recorded with an error"));
  const auto with_rest = [&](int row, int column, double slope) {
    return [=](Problem& p) {
      p.declaration.affine.rest.setZero(4, 6);
      p.declaration.affine.rest(row, column) = slope;
    };
  };
  EXPECT_EQ(refusal(with_rest(2, 0, 0.1)), "");
  EXPECT_THAT(refusal(with_rest(1, 0, 0.1)), HasSubstr("affine: rest of row 1, which is not affine"));
  EXPECT_THAT(refusal(with_rest(2, 0, -0.1)), HasSubstr("affine: rest 2, 0: -0.1"));
  EXPECT_THAT(refusal([](Problem& p) { p.declaration.affine.rest.setZero(4, 5); }), HasSubstr("has not the size of L"));
  EXPECT_THAT(refusal([&](Problem& p) {
                with_rest(2, 0, 0.1)(p);
                p.declaration.state_error = Vec({1e-3, 0, 0, 0});
              }),
              HasSubstr("affine: row 2, variable 0: recorded with an error"));
  EXPECT_EQ(refusal([&](Problem& p) {
              with_rest(2, 0, 0.1)(p);
              p.declaration.state_error = Vec({1e-3, 0, 0, 0});
              p.declaration.lipschitz(2, 0) = 0.1;
            }),
            "");
  EXPECT_THAT(refusal([](Problem& p) { p.declaration.affine.rows = {3, 2}; }), HasSubstr("in their order"));
  EXPECT_THAT(refusal([](Problem& p) { p.declaration.affine.columns = {2, 6}; }), HasSubstr("columns are"));
  EXPECT_THAT(refusal([](Problem& p) { p.declaration.affine.columns = {}; }), HasSubstr("or neither"));
}

}  // namespace forereach::affine_rows_test
