// The extremal residuals are admissible, and every tube of the certifier contains their rollouts.
#include "forereach/certify/extremal.h"

#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "tests/research/methods/small_task.h"

namespace forereach::research::extremal_test {

TEST(ExtremalResiduals, ByHand) {
  Task task = HandTask(0.5, 1);
  ObserveAt(task, 0, 0, 0.25);
  ObserveAt(task, 2, 1, 0.5);
  task.declaration.noise_bound[2] = 0.125;
  const ExtremalResiduals residuals(task.declaration, Observe(*task.model, task.data));
  ASSERT_EQ(residuals.count(), 2);
  Eigen::VectorXd z = Eigen::VectorXd::Zero(6);
  z[0] = 1;  // 0.5 from the first, 1.5 from the second
  std::vector<long double> lower, upper;
  residuals.Evaluate(0, z, lower);
  residuals.Evaluate(1, z, upper);
  EXPECT_NEAR(static_cast<double>(lower[2]), 0.25 - 0.125 - 0.5, 1e-14);
  EXPECT_NEAR(static_cast<double>(upper[2]), 0.25 + 0.125 + 0.5, 1e-14);
  EXPECT_NEAR(static_cast<double>(lower[0]), 0, 1e-14);
}

TEST(ExtremalResiduals, AgreeWithDataAndDeclaration) {
  TracedRandom random(21);
  const Task task = PointMassTask(40, 3);
  const Observations observations = Observe(*task.model, task.data);
  const ExtremalResiduals residuals(task.declaration, observations);
  ASSERT_EQ(residuals.count(), 16);
  std::vector<long double> one, other;
  for (int choice = 0; choice < residuals.count(); ++choice) {
    for (int i = 0; i < observations.size(); ++i) {
      residuals.Evaluate(choice, observations.z.row(i), one);
      for (int k = 0; k < 4; ++k) {
        ASSERT_GE(one[static_cast<std::size_t>(k)], observations.lower(i, k));
        ASSERT_LE(one[static_cast<std::size_t>(k)], observations.upper(i, k));
      }
    }
    for (int trial = 0; trial < 50; ++trial) {
      const Eigen::VectorXd a = random.Vector(6, 5), b = random.Vector(6, 5);
      residuals.Evaluate(choice, a, one);
      residuals.Evaluate(choice, b, other);
      for (int k = 0; k < 4; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const double distance = task.declaration.lipschitz.row(k).dot((a - b).cwiseAbs());
        ASSERT_LE(static_cast<double>(std::abs(one[i] - other[i])), distance * (1 + 1e-14) + 1e-16);
      }
    }
  }
}

TEST(HalfSpread, IsHalfTheLargestDistance) {
  Eigen::MatrixXd states(3, 3);
  states << 0, 3, 0,  //
      0, 4, 1,        //
      0, 100, 50;
  EXPECT_DOUBLE_EQ(HalfSpread(Eigen::MatrixXd::Identity(2, 3), states), 2.5);
}

TEST(CornersOf, AreTheCenterAndTheCorners) {
  const Eigen::MatrixXd states = CornersOf(Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(0.5, 0, 0.25));
  ASSERT_EQ(states.cols(), 5);
  EXPECT_FIELDS(states, (col(0), Eigen::Vector3d(1, 2, 3)), (col(1), Eigen::Vector3d(0.5, 2, 2.75)),
                (col(4), Eigen::Vector3d(1.5, 2, 3.25)));
}

// X0 of the rollouts is smaller by 1e-9, so that the rounding of a simulated state does not count.
void ExpectTubeContainsRollouts(const Task& task, const Eigen::VectorXd& center, const Eigen::VectorXd& half_width,
                                const Eigen::Vector2d& input) {
  auto problem = std::make_shared<Problem>();
  problem->model = task.model;
  problem->domain = task.domain;
  problem->declaration = task.declaration;
  problem->transitions = task.data;
  problem->projection = Eigen::MatrixXd::Identity(2, center.size());
  const Certifier certifier(problem);
  const Eigen::MatrixXd controls = input.replicate(1, 12);
  const Plan plan{controls.data(), 2, 12, 2};
  Tube tube;
  (void)certifier.Certify(plan, Zonotope::FromBox(center, half_width), {}, tube);
  ASSERT_EQ(tube.length(), 12);

  const ExtremalResiduals residuals(task.declaration, Observe(*task.model, task.data));
  const std::vector<Eigen::MatrixXd> states =
      ExtremalRollouts(*task.model, residuals, plan, CornersOf(center, (1 - 1e-9) * half_width));
  for (int t = 0; t <= 12; ++t) {
    const Eigen::MatrixXd& reached = states[static_cast<std::size_t>(t)];
    for (int k = 0; k < center.size(); ++k) {
      ASSERT_GE(reached.row(k).minCoeff(), tube.hull(t, k).lower) << "step " << t << " coordinate " << k;
      ASSERT_LE(reached.row(k).maxCoeff(), tube.hull(t, k).upper) << "step " << t << " coordinate " << k;
    }
    // In 32 directions of the plane too, where a hull says little.
    for (int d = 0; d < 32; ++d) {
      std::vector<double> direction(static_cast<std::size_t>(center.size()), 0.0);
      direction[0] = std::cos(d * 0.1963);
      direction[1] = std::sin(d * 0.1963);
      const Eigen::Map<const Eigen::VectorXd> along(direction.data(), center.size());
      ASSERT_LE((along.transpose() * reached).maxCoeff(), tube.slice(t).SupportUpper(direction)) << t;
    }
  }
  // A tube that kept the nominal system alone would not do: the spread is far more than that of X0.
  EXPECT_GT(HalfSpread(problem->projection, states.back()), 1.5 * HalfSpread(problem->projection, states.front()));
}

TEST(ExtremalRollouts, LieInTheBicyclesTube) {
  Eigen::VectorXd center(6), half_width(6);
  center << 0, 0, 0, 12, 0, 0.32;
  half_width << 0.025, 0.025, 0.005, 0.025, 0.01, 0.002;
  for (const int count : {25, 400}) ExpectTubeContainsRollouts(BicycleTask(count, 1), center, half_width, {0.2, 0.02});
}

TEST(ExtremalRollouts, LieInThePointMassTube) {
  ExpectTubeContainsRollouts(PointMassTask(100, 1), Eigen::Vector4d(0, 0, 2, 0.1),
                             Eigen::Vector4d(0.05, 0.05, 0.03, 0.03), {0.1, -0.1});
}

}  // namespace forereach::research::extremal_test
