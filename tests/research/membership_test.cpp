// Membership in zonotopes: at the boundary, inside the hull but outside the set, in flat sets, and against its support.
#include "research/membership.h"

#include "tests/test.h"

#include "research/random.h"

namespace forereach::research::membership_test {

Membership At(const Zonotope& set, std::initializer_list<double> x) { return Locate(set, {x.begin(), x.size()}); }

TEST(Locate, ABoxHasItsCornersAndNothingBeyond) {
  const Zonotope box = Zonotope::FromBox(Eigen::Vector2d(1, 2), Eigen::Vector2d(0.5, 1e-3));
  EXPECT_EQ(At(box, {1, 2}), Membership::kInside);
  EXPECT_EQ(At(box, {1.5, 2.001}), Membership::kInside);
  EXPECT_EQ(At(box, {1.5 + 1e-7, 2}), Membership::kOutside);
  EXPECT_EQ(At(box, {1, 2.001 + 1e-7}), Membership::kOutside);
}

TEST(Locate, InsideTheHullIsNotInside) {
  const Eigen::Matrix2d diagonal{{1, 0.1}, {1, -0.1}};
  const Zonotope thin(Eigen::Vector2d(0, 0), diagonal);
  EXPECT_EQ(At(thin, {1, 1}), Membership::kInside);
  EXPECT_EQ(At(thin, {1, -1}), Membership::kOutside);
  EXPECT_EQ(At(thin, {0.1, -0.1}), Membership::kInside);
  EXPECT_EQ(At(thin, {0.11, -0.11}), Membership::kOutside);
}

TEST(Locate, APointAndASegment) {
  const Zonotope point(Eigen::Vector2d(3, 4), Eigen::MatrixXd(2, 0));
  EXPECT_EQ(At(point, {3, 4}), Membership::kInside);
  EXPECT_EQ(At(point, {3, 4.001}), Membership::kOutside);
  const Zonotope segment(Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0));
  EXPECT_EQ(At(segment, {0.5, 0}), Membership::kInside);
  EXPECT_EQ(At(segment, {0.5, 1e-9}), Membership::kOutside);
}

TEST(Locate, SlackCounts) {
  Zonotope set(Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 1));
  EXPECT_EQ(At(set, {1, 0.95}), Membership::kOutside);
  ArraysOf(set).mutable_slack(1) = 0.05;
  EXPECT_EQ(At(set, {1, 0.95}), Membership::kInside);
}

TEST(Locate, AgreesWithSupportFunctions) {
  Random random{7};
  for (int trial = 0; trial < 200; ++trial) {
    const int n = random.Integer(2, 6), m = random.Integer(n, 5 * n);
    const auto entry = [&] { return random.Uniform(-1, 1); };
    const Eigen::VectorXd center = Eigen::VectorXd::NullaryExpr(n, entry);
    const Eigen::MatrixXd generators = Eigen::MatrixXd::NullaryExpr(n, m, entry);
    const Zonotope set(center, generators);
    const Eigen::VectorXd inside = center + generators * Eigen::VectorXd::NullaryExpr(m, entry);
    EXPECT_EQ(Locate(set, {inside.data(), static_cast<std::size_t>(n)}), Membership::kInside) << trial;
    // The vertex farthest along d, a little nearer to the center, and a little farther.
    const Eigen::VectorXd d = Eigen::VectorXd::NullaryExpr(n, entry).normalized();
    const Eigen::VectorXd vertex =
        center + generators * (generators.transpose() * d).unaryExpr([](double x) { return x > 0 ? 1.0 : -1.0; });
    const Eigen::VectorXd nearer = center + 0.99 * (vertex - center), beyond = vertex + 1e-3 * d;
    EXPECT_EQ(Locate(set, {vertex.data(), static_cast<std::size_t>(n)}), Membership::kInside) << trial;
    EXPECT_EQ(Locate(set, {nearer.data(), static_cast<std::size_t>(n)}), Membership::kInside) << trial;
    EXPECT_EQ(Locate(set, {beyond.data(), static_cast<std::size_t>(n)}), Membership::kOutside) << trial;
  }
}

}  // namespace forereach::research::membership_test
