// Obstacles and projections: refused arguments, and the distances shown to people.
#include "tests/test.h"

#include "forereach/safety/obstacle.h"
#include "forereach/safety/placement.h"
#include "forereach/safety/projection.h"
#include "forereach/safety/separation.h"

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
