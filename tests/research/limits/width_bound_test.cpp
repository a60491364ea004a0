// Theorem 2: the scan has the paper's 64 pairs, and every bound is met by two systems that are simulated.
#include "research/limits/width_bound.h"

#include "tests/test.h"

#include "tests/research/methods/small_task.h"

namespace forereach::research::width_bound_test {

const Eigen::MatrixXd kPosition6 = Eigen::MatrixXd::Identity(2, 6), kPosition4 = Eigen::MatrixXd::Identity(2, 4);

// The paper's residual over the domain; it depends on v and delta alone.
const SmoothResidual& Residual() {
  static const SmoothResidual residual = [] {
    std::vector<Interval> box(8, Interval(0.0));
    box[3] = {0, 25};
    box[5] = {-0.48, 0.48};
    return Describe(kBicycleResidual, box);
  }();
  return residual;
}

// A plan in the corridor, among 400 observations.
struct Scene {
  Task task = BicycleTask(400, 1);
  Eigen::MatrixXd controls = Eigen::Vector2d(0.2, 0.02).replicate(1, 12);
  Rollout rollout{
      *task.model, Residual(), {controls.data(), 2, 12, 2}, (Eigen::VectorXd(6) << 0, 0, 0, 12, 0, 0.3).finished()};
  WidthQuestion question{rollout, TwiceTheBounds(Residual().bounds), task.data.z, kPosition6};
};

TEST(SmoothBounds, OfTheBicyclesResidualAreAboveSamplesAndNearTheKnownSlopes) {
  const SmoothBounds& bounds = Residual().bounds;
  // Its slopes are at most 0.0119658 and 0.4076886 (grid of the paper).
  EXPECT_GE(bounds.slope, 0.40767);
  EXPECT_LE(bounds.slope, 1.05 * std::hypot(0.0119658, 0.4076886));
  double value = 0, curvature = 0;
  constexpr double h = 1e-4;
  const auto at = [](double v, double delta) {
    const std::array<double, 8> z{0, 0, 0, v, 0, delta, 0, 0};
    std::array<double, 6> r;
    kBicycleResidual(std::span<const double>(z), std::span<double>(r));
    return r[2];
  };
  for (int i = 1; i < 250; ++i)
    for (int j = 1; j < 240; ++j) {
      const double v = 0.1 * i, delta = 0.002 * j, here = at(v, delta);
      const double by_speed = at(v + h, delta) - 2 * here + at(v - h, delta);
      const double by_steering = at(v, delta + h) - 2 * here + at(v, delta - h);
      const double mixed =
          (at(v + h, delta + h) - at(v + h, delta - h) - at(v - h, delta + h) + at(v - h, delta - h)) / 4;
      value = std::max(value, std::abs(here));
      curvature = std::max(curvature, std::hypot(by_speed, by_steering, std::sqrt(2) * mixed) / (h * h));
    }
  EXPECT_GE(bounds.value, value);
  EXPECT_LE(bounds.value, 1.2 * value);
  EXPECT_GE(bounds.curvature, curvature * (1 - 1e-4));
  EXPECT_LE(bounds.curvature, 1.3 * curvature);
}

TEST(SmoothResidual, JacobianIsThatOfItsValues) {
  const std::array<double, 8> z{0, 0, 0, 14, 0, 0.35, 0, 0};
  const Eigen::MatrixXd jacobian = Residual().jacobian(z);
  for (const int l : {3, 5}) {
    std::array<long double, 8> plus, minus;
    std::ranges::copy(z, plus.begin());
    std::ranges::copy(z, minus.begin());
    plus[static_cast<std::size_t>(l)] += 1e-5L;
    minus[static_cast<std::size_t>(l)] -= 1e-5L;
    std::array<long double, 6> above, below;
    Residual().evaluate(plus, above);
    Residual().evaluate(minus, below);
    EXPECT_NEAR(jacobian(2, l), static_cast<double>((above[2] - below[2]) / 2e-5L), 1e-7);
  }
  EXPECT_EQ(jacobian.cwiseAbs().sum(), std::abs(jacobian(2, 3)) + std::abs(jacobian(2, 5)));
}

TEST(WidthBound, ScanHasThePapersSixtyFourPairs) {
  const Scene scene;
  const std::vector<WidthBound> bounds = ScanWidthBounds(scene.question);
  EXPECT_EQ(bounds.size(), 64u);
  for (const WidthBound& bound : bounds) {
    EXPECT_GT(bound.half_width, 0) << bound.tau << ' ' << bound.k;
    // At the last time a and delta have no way to the position any more: those two pairs are missing.
    EXPECT_FALSE(bound.tau == 10 && (bound.k == 4 || bound.k == 5));
  }
  const WidthBound& largest = *std::ranges::max_element(bounds, {}, &WidthBound::half_width);
  EXPECT_FIELDS(largest, (tau, 10), (k, 2));
  EXPECT_NEAR(largest.half_width, 0.013549, 1e-6);  // of our class; the paper's is 0.039228
  EXPECT_EQ(largest.a_star, largest.a_lin);
  EXPECT_NEAR(2 * largest.remainder, 54.1, 0.05);
}

TEST(WidthBound, IsMetByTwoSystemsThatTheDataDoNotTellApart) {
  const Scene scene;
  for (const WidthBound& bound : ScanWidthBounds(scene.question)) {
    const Bump bump{scene.rollout.Queries().col(bound.tau), bound.bump_radius};
    for (int i = 0; i < scene.task.data.size(); ++i) {
      const Eigen::VectorXd z = scene.task.data.z.row(i);
      ASSERT_EQ(bump(std::vector<long double>(z.begin(), z.end())), 0);
    }
    const Pair pair = RollOutPair(scene.rollout, bump, bound.k, bound.a_star);
    const double separation = pair.HalfSeparation(kPosition6, 12);
    // Up to the rounding of twelve steps of some metres.
    EXPECT_GE(separation, bound.half_width - 1e-13) << bound.tau << ' ' << bound.k;
    EXPECT_LE(separation, bound.a_star * bound.gain + bound.remainder * bound.a_star * bound.a_star + 1e-13);
  }
}

TEST(WidthBound, OfThePointMassHasItsGainByHand) {
  const Task task = PointMassTask(100, 1);
  const SmoothResidual zero = ZeroResidual(4, 6);
  const Eigen::MatrixXd controls = Eigen::Vector2d(0.1, -0.1).replicate(1, 12);
  const Rollout rollout{*task.model, zero, {controls.data(), 2, 12, 2}, Eigen::Vector4d(0, 0, 2, 0.1)};
  const WidthQuestion question{rollout, {1, 1, 1}, task.data.z, kPosition4};
  const WidthBound position = BoundWidth(question, 4, 0), speed = BoundWidth(question, 4, 2);
  EXPECT_DOUBLE_EQ(position.gain, 1);
  EXPECT_NEAR(speed.gain, 7 * 0.15, 1e-14);
  // At the last time there is nothing to propagate: C = 0, and the class alone limits a.
  const WidthBound last = BoundWidth(question, 11, 1);
  EXPECT_FIELDS(last, (remainder, 0), (a_star, last.a_class));
  EXPECT_DOUBLE_EQ(last.half_width, last.a_class);
  const double eps = last.bump_radius;
  EXPECT_DOUBLE_EQ(last.a_class, std::min({1.0, eps / 2.17036, eps * eps / 21.0659}));
  // One step before: M = 1, d = |z_11 - z_10| - eps, C = |P| H2 / 2 = 1/2.
  const WidthBound before = BoundWidth(question, 10, 1);
  EXPECT_DOUBLE_EQ(before.remainder, 0.5);
  EXPECT_DOUBLE_EQ(before.a_lin, 1);
  const double clearance = (rollout.Queries().col(11) - rollout.Queries().col(10)).norm() - before.bump_radius;
  EXPECT_LE(before.a_pass, clearance / 2);
  EXPECT_DOUBLE_EQ(before.a_pass, std::min(clearance, before.region) / 2);
  EXPECT_DOUBLE_EQ(before.half_width, before.a_star - before.a_star * before.a_star / 2);
}

TEST(WidthBound, ShrinksAsDataComeCloser) {
  const Scene scene;
  const WidthBound far = BoundWidth(scene.question, 10, 2);
  WidthQuestion near = scene.question;
  near.data.row(0) = scene.rollout.Queries().col(10).transpose();
  near.data(0, 0) += 0.01;
  const WidthBound close = BoundWidth(near, 10, 2);
  EXPECT_NEAR(close.data_gap, 0.01, 1e-12);
  EXPECT_LT(close.half_width, far.half_width / 10);
  EXPECT_GT(close.half_width, 0);
  near.data(0, 0) = scene.rollout.Queries()(0, 10);  // an observation at the query itself
  EXPECT_FALSE(BoundWidth(near, 10, 2).IsAdmissible());
}

TEST(WidthBound, RefusesAClassWithoutSlack) {
  const Scene scene;
  WidthQuestion question = scene.question;
  question.limits = Residual().bounds;
  EXPECT_THROW((void)BoundWidth(question, 10, 2), std::invalid_argument);
  EXPECT_THROW((void)BoundWidth(scene.question, 12, 0), std::invalid_argument);
  EXPECT_THROW((void)BoundWidth(scene.question, 0, 6), std::invalid_argument);
}

}  // namespace forereach::research::width_bound_test
