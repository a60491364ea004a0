// Obstacles and projections: refused arguments, and the distances shown to people.
#include "tests/test.h"

#include "forereach/safety/obstacle.h"
#include "forereach/safety/placement.h"
#include "forereach/safety/projection.h"
#include "forereach/safety/separation.h"
#include "forereach/safety/standing_cores.h"
#include "tests/oracle/traced_random.h"

namespace forereach::safety_test {

using Eigen::Vector2d;
using Eigen::Vector3d;

const double kNan = std::numeric_limits<double>::quiet_NaN();

Eigen::VectorXd Point(double x, double y) { return Vector2d(x, y); }

TEST(Obstacle, RefusesWrongDimensionsAndNumbers) {
  EXPECT_THROW(Obstacle::Circle(Vector3d::Zero(), 1), std::invalid_argument);
  EXPECT_THROW(Obstacle::Circle(Point(0, kNan), 1), std::invalid_argument);
  for (const double radius : {-1.0, kNan, std::numeric_limits<double>::infinity()})
    EXPECT_THROW(Obstacle::Circle(Point(0, 0), radius), std::invalid_argument);
  EXPECT_NO_THROW(Obstacle::Circle(Point(0, 0), 0));

  EXPECT_THROW(Obstacle::AxisBox(Point(0, 0), Vector3d::Zero()), std::invalid_argument);
  EXPECT_THROW(Obstacle::AxisBox(Point(0, 1), Point(1, 0)), std::invalid_argument);
  EXPECT_THROW(Obstacle::AxisBox(Point(0, 0), Point(1, kNan)), std::invalid_argument);
  EXPECT_THROW(Obstacle::AxisBox(Eigen::VectorXd(0), Eigen::VectorXd(0)), std::invalid_argument);
  EXPECT_THROW(Obstacle::AxisBox(Eigen::VectorXd::Zero(4), Eigen::VectorXd::Zero(4)), std::invalid_argument);
  EXPECT_NO_THROW(Obstacle::AxisBox(Point(1, 1), Point(1, 1)));

  EXPECT_THROW(Obstacle::Polygon({Point(0, 0), Point(1, 0)}), std::invalid_argument);
  EXPECT_THROW(Obstacle::Polygon(std::vector<Eigen::VectorXd>(17, Point(0, 0))), std::invalid_argument);
  EXPECT_THROW(Obstacle::Polygon({Point(0, 0), Point(1, 0), Vector3d::Zero()}), std::invalid_argument);
  EXPECT_THROW(Obstacle::Polygon({Point(0, 0), Point(1, 0), Point(0, kNan)}), std::invalid_argument);

  EXPECT_THROW(Obstacle::HalfSpace(Point(0, 0), 1), std::invalid_argument);
  EXPECT_THROW(Obstacle::HalfSpace(Point(1, 0), kNan), std::invalid_argument);
  EXPECT_THROW(Obstacle::HalfSpace(Eigen::VectorXd::Ones(4), 0), std::invalid_argument);
}

TEST(Obstacle, HasTheHullAndRadiusOfItsKind) {
  const Obstacle box = Obstacle::AxisBox(Vector3d(0, 1, 2), Vector3d(3, 4, 5));
  EXPECT_FIELDS(box, (hull().size(), 8u), (dim(), 3), (radius(), 0));
  EXPECT_EQ(Obstacle::AxisBox(Eigen::VectorXd::Zero(1), Eigen::VectorXd::Ones(1)).hull().size(), 2u);
  EXPECT_TRUE(Obstacle::HalfSpace(Vector3d(0, 0, 1), 2).hull().empty());
  EXPECT_EQ(Obstacle::Circle(Point(1, 2), 3).hull(), std::vector{Vector3d(1, 2, 0)});
}

TEST(StandingCores, BoundWhatSeparateHullsBoundsOneByOne) {
  TracedRandom random(316);
  int proven = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const int dim = random.Integer(1, 3), count = random.Integer(1, 70), most = random.Integer(1, 80);
    const double added = random.Coin() ? 0 : random.Uniform(0, 1);
    std::vector<Obstacle> obstacles;
    for (int o = 0; o < count; ++o) {
      const Eigen::VectorXd corner = 4 * random.Matrix(dim, 1), side = random.Matrix(dim, 1).cwiseAbs();
      obstacles.push_back(dim == 2 && random.Coin() ? Obstacle::Circle(corner, random.Uniform(0, 1))
                                                    : Obstacle::AxisBox(corner, corner + side));
    }
    const int end = random.Integer(0, 2 * count);
    if (end < count) obstacles[ToSize(end)] = Obstacle::HalfSpace(Eigen::VectorXd::Ones(dim), 9);
    StandingCores cores;
    cores.Take(obstacles, dim, added, ToSize(most));
    ASSERT_EQ(cores.size(), ToSize(std::min({count, end, most, 64})));
    std::array<Hull, 3> hulls{};
    for (Hull& hull : hulls)
      for (std::size_t k = 0; k < ToSize(dim); ++k)
        hull.center[k] = random.Uniform(-4, 4), hull.half_width[k] = random.Uniform(0, 0.5);
    if (random.Coin(0.1)) hulls[1].half_width[0] = kNan;
    std::vector<double> bounds(hulls.size() * cores.stride(), 0);
    for (const InstructionSet instructions :
         {InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
      if (!IsSupported(instructions)) continue;
      cores.Bound(hulls, bounds.data(), instructions);
      for (std::size_t h = 0; h < hulls.size(); ++h)
        for (std::size_t o = 0; o < cores.stride(); ++o) {
          const double bound = bounds[h * cores.stride() + o];
          if (o >= cores.size()) {
            ASSERT_EQ(bound, kInfinity);
            continue;
          }
          const Separation one = SeparateHulls(hulls[h], obstacles[o], added);
          ASSERT_EQ(bound > -kInfinity, one.IsProven());
          if (!one.IsProven()) continue;
          ASSERT_LE(bound, one.clearance());
          ASSERT_GE(bound, one.clearance() - 8 * kUnitRoundoff * one.distance);
          ++proven;
        }
    }
  }
  EXPECT_GT(proven, 10000);
}

TEST(Obstacle, ApproximateDistanceIsNegativeInside) {
  const Obstacle circle = Obstacle::Circle(Point(1, 0), 2);
  EXPECT_DOUBLE_EQ(ApproximateDistance(circle, Point(1, 5)), 3);
  EXPECT_DOUBLE_EQ(ApproximateDistance(circle, Point(1, 0)), -2);
  const Obstacle box = Obstacle::AxisBox(Point(0, 0), Point(4, 2));
  EXPECT_DOUBLE_EQ(ApproximateDistance(box, Point(7, 6)), 5);
  EXPECT_DOUBLE_EQ(ApproximateDistance(box, Point(1, 1)), -1);
  const Obstacle half_plane = Obstacle::HalfSpace(Point(0, 2), 4);
  EXPECT_DOUBLE_EQ(ApproximateDistance(half_plane, Point(9, 0)), 2);
  EXPECT_DOUBLE_EQ(ApproximateDistance(half_plane, Point(9, 3)), -1);
  const Obstacle square = Obstacle::Polygon({Point(0, 0), Point(4, 2), Point(4, 0), Point(0, 2)});  // in any order
  EXPECT_DOUBLE_EQ(ApproximateDistance(square, Point(7, 6)), 5);
  EXPECT_DOUBLE_EQ(ApproximateDistance(square, Point(1, 1)), -1);
  EXPECT_DOUBLE_EQ(ApproximateDistance(square, Point(2, 5)), 3);
}

TEST(Separation, IsUnprovenByDefaultAndForNan) {
  EXPECT_FALSE(Separation{}.IsProven());
  EXPECT_FALSE((Separation{kNan, 0}.IsProven()));
  EXPECT_FALSE((Separation{1, kNan}.IsProven()));
  EXPECT_FALSE((Separation{1, 1}.IsProven()));
}

TEST(Projection, RefusesWhatProjectsToNothing) {
  EXPECT_THROW(Placement(Eigen::MatrixXd::Zero(2, 4), Body{}, std::nullopt, 4), std::invalid_argument);
  EXPECT_THROW(Projection(Eigen::MatrixXd::Ones(4, 4), 4), std::invalid_argument);
  EXPECT_THROW(Projection(Eigen::MatrixXd(0, 4), 4), std::invalid_argument);
  EXPECT_THROW(Projection(Eigen::MatrixXd::Ones(2, 3), 4), std::invalid_argument);
  EXPECT_THROW(Projection(Eigen::MatrixXd::Constant(2, 4, kNan), 4), std::invalid_argument);
}

}  // namespace forereach::safety_test
