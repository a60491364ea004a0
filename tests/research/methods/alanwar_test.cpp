// Covering radii by hand and against a grid; Algorithm 6 contains every residual that satisfies the declaration.
#include "research/methods/alanwar.h"

#include "tests/test.h"

#include "research/methods/covering.h"
#include "tests/research/methods/small_task.h"

namespace forereach::research::alanwar_test {

TEST(CoveringRadius, ByHand) {
  const std::array<Interval, 1> box{Interval(0, 2)};
  const Eigen::Vector2d points(0, 1);
  EXPECT_DOUBLE_EQ(CoveringRadiusUpper(box, points, Eigen::VectorXd::Constant(1, 3.0), 0), 3);  // 2 is 1 away from 1
  const Eigen::Vector3d ends(0, 1, 2);
  EXPECT_NEAR(CoveringRadiusUpper(box, ends, Eigen::VectorXd::Ones(1)), 0.5, 0.005);
}

TEST(CoveringRadius, OfACoordinateWithoutWeightIsNothing) {
  const std::array<Interval, 2> box{Interval(0, 2), Interval(-100, 100)};
  const Eigen::RowVector2d point(1, 0);
  EXPECT_DOUBLE_EQ(CoveringRadiusUpper(box, point, Eigen::Vector2d(1, 0)), 1);
}

TEST(CoveringRadius, IsAboveAGridAndClose) {
  for (TracedRandom random(5); random.Again(5);) {
    const Eigen::MatrixXd points = random.Matrix(random.Integer(1, 40), 2);
    const Eigen::Vector2d weights(random.Uniform(0.1, 1), random.Uniform(0.1, 1));
    const std::array<Interval, 2> box{Interval(-1, 1), Interval(-1, 1)};
    double brute = 0;
    for (int i = 0; i <= 100; ++i)
      for (int j = 0; j <= 100; ++j) {
        const Eigen::RowVector2d z(-1 + i * 0.02, -1 + j * 0.02);
        brute = std::max(brute, ((points.rowwise() - z).cwiseAbs() * weights).minCoeff());
      }
    const double bound = CoveringRadiusUpper(box, points, weights);
    EXPECT_GE(bound, brute);
    EXPECT_LE(bound, 1.01 * (brute + 0.01 * weights.sum()));
    EXPECT_GE(CoveringRadiusUpper(box, points, weights, 0.01, 1), bound);  // stopped at once: still a bound
  }
}

TEST(Alanwar, OfAnAffineResidualIsTheFitAndTheCovering) {
  Task task = HandTask(0, 0.25);
  for (int i = -4; i <= 4; ++i) ObserveAt(task, 0, i, 0.25 * i + 1);
  const AlanwarEnclosure enclosure(task.setting());
  EXPECT_NEAR(enclosure.slopes(2)[2], 0.25, 1e-14);
  EXPECT_EQ(enclosure.slopes(2)[0], 0);
  // Observations at -4 .. 4: no speed is farther than 1/2 from one; L + |M'| = 1/2.
  EXPECT_NEAR(enclosure.covering(2), 0.25, 0.0025);
  const ResidualBounds bounds = HandQuery(0, 2, 0, 1).Of(enclosure);
  EXPECT_NEAR(bounds.lower[2], 1.25 - 0.25, 0.0026);
  EXPECT_NEAR(bounds.upper[2], 1.75 + 0.25, 0.0026);
  EXPECT_EQ(enclosure.covering(0), 0);
}

TEST(Alanwar, ContainsTheTrueResidual) {
  TracedRandom random(7);
  for (const int count : {1, 25, 400}) {
    const Task task = BicycleTask(count, 3);
    const AlanwarEnclosure enclosure(task.setting());
    for (int trial = 0; trial < 100; ++trial) {
      const Query query = AnyQueryIn(random, task, 0.3);
      const ResidualBounds bounds = query.Of(enclosure);
      const Eigen::VectorXd z = query.Point(random);
      std::array<double, 6> r;
      kBicycleResidual(std::span<const double>(z.data(), 8), std::span<double>(r));
      for (std::size_t k = 0; k < 6; ++k) {
        ASSERT_LE(bounds.lower[k], r[k]) << count << ' ' << k;
        ASSERT_GE(bounds.upper[k], r[k]) << count << ' ' << k;
      }
    }
  }
}

TEST(Alanwar, NoiseWidensBothSides) {
  Task task = HandTask(0, 0.25);
  for (int i = -4; i <= 4; ++i) ObserveAt(task, 0, i, 0.25 * i);
  const ResidualBounds quiet = HandQuery(0, 1).Of(AlanwarEnclosure(task.setting()));
  task.declaration.noise_bound[2] = 0.125;
  const ResidualBounds noisy = HandQuery(0, 1).Of(AlanwarEnclosure(task.setting()));
  EXPECT_NEAR(noisy.lower[2], quiet.lower[2] - 0.125, 1e-12);
  EXPECT_NEAR(noisy.upper[2], quiet.upper[2] + 0.125, 1e-12);
}

TEST(Alanwar, IsNoNarrowerOnALargerQuery) {
  const Task task = PointMassTask(50, 2);
  const AlanwarEnclosure enclosure(task.setting());
  for (TracedRandom random(8); random.Again(100);) {
    const Query small = AnyQueryIn(random, task, 0.2);
    const Query large(Zonotope(small.set().slice.CenterVector(), 1.5 * small.set().slice.GeneratorMatrix()),
                      {small.set().input.begin(), small.set().input.end()});
    const ResidualBounds inner = small.Of(enclosure), outer = large.Of(enclosure);
    for (std::size_t k = 0; k < 4; ++k) {
      ASSERT_LT(outer.lower[k], inner.lower[k]);
      ASSERT_GT(outer.upper[k], inner.upper[k]);
    }
  }
}

}  // namespace forereach::research::alanwar_test
