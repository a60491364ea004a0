// The bump, the two systems it makes, and Theorem 1 in numbers.
#include "research/limits/two_systems.h"

#include "tests/test.h"

#include "tests/research/methods/small_task.h"

namespace forereach::research::two_systems_test {

const Bump kUnit{Eigen::VectorXd::Zero(1), 1};

double Psi(double s) { return static_cast<double>(kUnit(std::array{static_cast<long double>(s)})); }

TEST(Bump, IsOneAtItsCenterAndZeroOutside) {
  EXPECT_EQ(Psi(0), 1);
  EXPECT_EQ(Psi(1), 0);
  EXPECT_EQ(Psi(-1.5), 0);
  EXPECT_NEAR(Psi(0.5), std::exp(1 - 4.0 / 3), 1e-15);
  const Bump moved{Eigen::Vector2d(3, 4), 2};
  EXPECT_NEAR(static_cast<double>(moved(std::array{4.0L, 4.0L})), Psi(0.5), 1e-15);
}

// By central differences on a grid: the constants hold, and are no more than a thousandth too large.
TEST(Bump, DerivativesAreBoundedByTheConstants) {
  double value = 0, slope = 0, curvature = 0;
  constexpr double h = 1e-4;
  for (int i = 1; i < 9990; ++i) {
    const double s = i * h, first = (Psi(s + h / 2) - Psi(s - h / 2)) / h;
    value = std::max(value, Psi(s));
    slope = std::max(slope, std::abs(first));
    curvature = std::max({curvature, std::abs(first / s), std::abs(Psi(s + h) - 2 * Psi(s) + Psi(s - h)) / (h * h)});
  }
  EXPECT_LE(value, Bump::kDerivatives[0]);
  EXPECT_LE(slope, Bump::kDerivatives[1]);
  EXPECT_LE(curvature, Bump::kDerivatives[2]);
  EXPECT_GE(slope, 0.999 * Bump::kDerivatives[1]);
  EXPECT_GE(curvature, 0.999 * Bump::kDerivatives[2]);
}

TEST(TwoSystems, SeparateByAsMuchAsOneLikesAndLookTheSame) {
  const Task task = BicycleTask(400, 1);
  const SmoothResidual zero = ZeroResidual(6, 8);
  const Eigen::MatrixXd controls = Eigen::Vector2d(0.2, 0.02).replicate(1, 12);
  const Rollout rollout{
      *task.model, zero, {controls.data(), 2, 12, 2}, (Eigen::VectorXd(6) << 0, 0, 0, 12, 0, 0.3).finished()};
  const Eigen::MatrixXd projection = Eigen::MatrixXd::Identity(2, 6);
  const Bump bump{rollout.Queries().col(5), 0.5};
  for (int i = 0; i < task.data.size(); ++i) {
    const Eigen::VectorXd z = task.data.z.row(i);
    const std::vector<long double> wide(z.begin(), z.end());
    ASSERT_EQ(bump(wide), 0) << "observation " << i << " would tell the two apart";
  }
  for (const double amplitude : {1.0, 1e3, 1e6}) {
    const Pair pair = RollOutPair(rollout, bump, 1, amplitude);
    EXPECT_EQ(pair.HalfSeparation(projection, 5), 0);
    EXPECT_NEAR(pair.HalfSeparation(projection, 6), UnrestrictedHalfWidth(projection, 1, amplitude), 1e-9 * amplitude);
    EXPECT_EQ(UnrestrictedHalfWidth(projection, 1, amplitude), amplitude);
  }
  EXPECT_EQ(UnrestrictedHalfWidth(projection, 3, 1e6), 0);  // P does not see v
}

// The affine case: delta_T = 2 a G e_k exactly.
TEST(TwoSystems, OfAnAffineModelSeparateByTheGain) {
  const Task task = PointMassTask(1, 1);
  const SmoothResidual zero = ZeroResidual(4, 6);
  const Eigen::MatrixXd controls = Eigen::Vector2d(0.1, -0.1).replicate(1, 12);
  const Rollout rollout{*task.model, zero, {controls.data(), 2, 12, 2}, Eigen::Vector4d(0, 0, 2, 0.1)};
  const Pair pair = RollOutPair(rollout, {rollout.Queries().col(3), 0.1}, 2, 0.05);
  // vx at step 4 differs by 0.1, which eight steps of 0.15 s turn into 0.12 m.
  EXPECT_NEAR(pair.HalfSeparation(Eigen::MatrixXd::Identity(2, 4), 12), 0.05 * 8 * 0.15, 1e-14);
}

}  // namespace forereach::research::two_systems_test
