// The distances of a body's parts that planner and simulator use: against closed forms and against bounds from points
// and directions of both sets.
#include "forereach/safety/clearance.h"

#include "tests/test.h"

#include "forereach/dynamics/text_model.h"
#include "tests/oracle/traced_random.h"

namespace forereach::clearance_test {

using Eigen::Vector2d;
using Eigen::Vector3d;

BodyPart Hull(std::vector<Vector3d> points, double radius = 0) { return {std::move(points), radius}; }
BodyPart Square(double x, double y, double half) {
  return Hull({{x - half, y - half, 0}, {x + half, y - half, 0}, {x + half, y + half, 0}, {x - half, y + half, 0}});
}

// x, y, theta; its hitch is at 2.5 to 3.5 m.
std::shared_ptr<const NominalModel> Unicycle() {
  ModelText text{.name = "unicycle"};
  for (const char* state : {"x", "y", "theta"}) text.states.push_back({state, ""});
  for (const char* input : {"v", "omega"}) text.inputs.push_back({input, ""});
  text.parameters = {{"dt", 0.1, 0.1}, {"hitch", 2.5, 3.5}};
  text.equations = {{"x + dt*v*cos(theta)"}, {"y + dt*v*sin(theta)"}, {"theta + dt*omega"}};
  return MakeTextModel(text);
}

TEST(BodyPlaces, TurnPartsInTheirFirstTwoCoordinatesAndMoveThem) {
  const auto model = Unicycle();
  const Body body{.heading = 2, .parts = {Hull({{2, 0, 0}, {0, 1, 0}}, 0.5), Hull({{-1, 0, 0}})}};
  const Eigen::MatrixXd projection = Eigen::MatrixXd::Identity(2, 3);
  const std::array x{10.0, 20.0, std::numbers::pi / 2};
  const std::vector<BodyPart> placed = BodyPlaces(*model, projection, body).At(x);
  ASSERT_EQ(placed.size(), 2u);
  EXPECT_TRUE(placed[0].points[0].isApprox(Vector3d(10, 22, 0)));
  EXPECT_TRUE(placed[0].points[1].isApprox(Vector3d(9, 20, 0)));
  EXPECT_EQ(placed[0].radius, 0.5);
  EXPECT_TRUE(placed[1].points[0].isApprox(Vector3d(10, 19, 0)));

  const Body fixed{.heading = -1, .parts = {Hull({{2, 0, 3}})}};
  const BodyPlaces places(*model, Eigen::MatrixXd::Identity(3, 3), fixed);
  EXPECT_EQ(places.At(x)[0].points[0], Vector3d(12, 20, 3 + x[2]));
}

TEST(BodyPlaces, AtExpressionsUseTheMiddlesOfTheParameters) {
  const auto model = Unicycle();
  const auto expression = [](const char* text) { return ExpressionText{text, 1, 1}; };
  Body body{.heading = 2, .parts = {Hull({{2, 0, 0}}, 0.5), BodyPart{{}, 0.25, {}}}};
  body.parts[1].places = {{expression("x"), expression("y")},
                          {expression("x - hitch*cos(theta)"), expression("y - hitch*sin(theta)")}};
  const BodyPlaces places(*model, Eigen::MatrixXd::Identity(2, 3), body);
  EXPECT_FALSE(places.IsAtExpressions(0));
  EXPECT_TRUE(places.IsAtExpressions(1));
  std::vector<BodyPart> placed = places.At(std::array{10.0, 20.0, std::numbers::pi / 2});
  ASSERT_EQ(placed.size(), 2u);
  EXPECT_TRUE(placed[0].points[0].isApprox(Vector3d(10, 22, 0)));
  ASSERT_EQ(placed[1].points.size(), 2u);
  EXPECT_EQ(placed[1].points[0], Vector3d(10, 20, 0));
  EXPECT_TRUE(placed[1].points[1].isApprox(Vector3d(10, 17, 0)));
  EXPECT_EQ(placed[1].radius, 0.25);
  places.MoveFrame(Vector2d(0, 0), 0, placed);
  EXPECT_EQ(placed[0].points[0], Vector3d(2, 0, 0));
  EXPECT_EQ(placed[1].points[0], Vector3d(10, 20, 0));
}

TEST(PartDistance, OfOnePointIsThatOfThePointLessTheRadius) {
  const std::vector obstacles{Obstacle::Circle(Vector2d(1, 0), 2), Obstacle::AxisBox(Vector2d(0, 0), Vector2d(4, 2)),
                              Obstacle::HalfSpace(Vector2d(0, 2), 4),
                              Obstacle::Polygon({Vector2d(0, 0), Vector2d(4, 2), Vector2d(4, 0), Vector2d(0, 2)})};
  for (TracedRandom random(31); random.Again(200);)
    for (const Obstacle& obstacle : obstacles) {
      const Vector2d y = random.Vector(2, 6);
      EXPECT_EQ(ApproximateDistance(obstacle, Hull({{y.x(), y.y(), 0}}, 0)), ApproximateDistance(obstacle, y));
      EXPECT_EQ(ApproximateDistance(obstacle, Hull({{y.x(), y.y(), 0}}, 0.25)),
                ApproximateDistance(obstacle, y) - 0.25);
    }
}

TEST(PartDistance, IsTheKnownOneForASquare) {
  EXPECT_DOUBLE_EQ(ApproximateDistance(Obstacle::Circle(Vector2d(5, 0), 1), Square(0, 0, 1)), 3);
  EXPECT_DOUBLE_EQ(ApproximateDistance(Obstacle::Circle(Vector2d(4, 5), 1), Square(0, 0, 1)), 4);
  EXPECT_DOUBLE_EQ(ApproximateDistance(Obstacle::Circle(Vector2d(0.2, 0.1), 1), Square(0, 0, 1)), -1);
  EXPECT_DOUBLE_EQ(ApproximateDistance(Obstacle::AxisBox(Vector2d(2, 3), Vector2d(9, 9)), Square(0, 0, 1)),
                   std::sqrt(5));
  EXPECT_DOUBLE_EQ(ApproximateDistance(Obstacle::AxisBox(Vector2d(-9, 3), Vector2d(9, 9)), Square(0, 0, 1)), 2);
  EXPECT_EQ(ApproximateDistance(Obstacle::AxisBox(Vector2d(0, 0), Vector2d(9, 9)), Square(0, 0, 1)), 0);
  EXPECT_DOUBLE_EQ(ApproximateDistance(Obstacle::HalfSpace(Vector2d(0, 2), 4), Square(0, 0, 1)), 1);
  EXPECT_DOUBLE_EQ(ApproximateDistance(Obstacle::HalfSpace(Vector2d(0, 2), 1), Square(0, 0, 1)), -0.5);
  // A corner between two samples of a polygon's long side.
  const Obstacle wedge = Obstacle::Polygon({Vector2d(3, -8), Vector2d(3, 8), Vector2d(8, 0)});
  EXPECT_DOUBLE_EQ(ApproximateDistance(wedge, Square(0, 0.3, 1)), 2);
}

// For each pair of sets, the gap along any direction is a lower bound and the distance of any two points an upper
// bound.
TEST(PartDistance, LiesBetweenTheGapsAndTheDistancesOfPoints) {
  TracedRandom random(32);
  int apart = 0, close = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const int p = random.Integer(2, 3);
    const auto point = [&](const Eigen::VectorXd& center) {
      Vector3d y = Vector3d::Zero();
      y.head(p) = center + random.Vector(p);
      return y;
    };
    const Eigen::VectorXd place = random.Vector(p, 3);
    const Eigen::VectorXd corner = place + random.Vector(p);
    std::vector<Eigen::VectorXd> vertices;
    for (int i = 0; i < 5; ++i) vertices.push_back(place + random.Vector(p));
    const Obstacle obstacle = p == 2 && random.Coin()
                                  ? Obstacle::Polygon(vertices)
                                  : Obstacle::AxisBox(place.cwiseMin(corner), place.cwiseMax(corner));
    BodyPart part;
    part.points.clear();
    for (int i = random.Integer(2, 8); i > 0; --i) part.points.push_back(point(Eigen::VectorXd::Zero(p)));
    const double distance = ApproximateDistance(obstacle, part);
    const auto mixed = [&](const std::vector<Vector3d>& points) {
      Vector3d sum = Vector3d::Zero();
      double total = 0;
      for (const Vector3d& y : points) {
        const double weight = random.Coin() ? 0 : random.Uniform(0, 1);
        sum += weight * y;
        total += weight;
      }
      return total > 0 ? Vector3d(sum / total) : points.front();
    };
    double lower = 0, upper = kInfinity;
    for (int i = 0; i < 4000; ++i) {
      upper = std::min(upper, (mixed(part.points) - mixed(obstacle.hull())).norm());
      const Vector3d direction = point(Eigen::VectorXd::Zero(p)).normalized();
      double body = -kInfinity, core = kInfinity;
      for (const Vector3d& y : part.points) body = std::max(body, direction.dot(y));
      for (const Vector3d& y : obstacle.hull()) core = std::min(core, direction.dot(y));
      lower = std::max(lower, core - body);
    }
    ASSERT_LE(lower, distance + 1e-9) << "trial " << trial;
    ASSERT_LE(distance, upper + 1e-9) << "trial " << trial;
    apart += distance > 0;
    close += upper - lower < 0.2;
  }
  EXPECT_GT(apart, 200);
  EXPECT_GT(close, 300) << "the bounds say something";
}

TEST(PartDistance, AtATimeIsThatOfTheObstacleThereWithItsGrowth) {
  ObstacleMotion motion{.stamp_us = 1'000'000,
                        .velocity = {2, 0, 0},
                        .uncertainty = 0.1,
                        .growth = 0.2,
                        .growth_rate = 0.4,
                        .from_us = 0,
                        .until_us = 4'000'000};
  const Obstacle obstacle = Obstacle::Circle(Vector2d(-9, 0), 1).Moving(motion);
  // 2 s later it is at x = -5, with 0.1 + 0.4 + 0.8 m more.
  EXPECT_DOUBLE_EQ(ApproximateDistance(obstacle, Square(0, 0, 1), 3'000'000), 4 - 1 - 1.3);
  EXPECT_DOUBLE_EQ(ApproximateDistance(obstacle, Square(0, 0, 1), 0), 10 - 1 - 0.5);  // a second before
  EXPECT_EQ(ApproximateDistance(obstacle, Square(0, 0, 1), 4'000'001), kInfinity);
  EXPECT_EQ(ApproximateDistance(obstacle, Square(0, 0, 1), -1), kInfinity);
}

TEST(PartDistance, OfASweepIsTheLeastOnTheWay) {
  const Schedule schedule{0, 100'000, 10'000};
  const BodyPart from = Square(0, 0, 0.5), to = Square(4, 0, 0.5);
  const Obstacle post = Obstacle::Circle(Vector2d(2, 2), 0.5);
  EXPECT_DOUBLE_EQ(ApproximateDistance(post, from, to, schedule, 0, 1), 1);
  EXPECT_GT(ApproximateDistance(post, from, from, schedule, 0, 0), 1.5) << "a sample alone";
  // An obstacle that drives along beside the robot stays where it is, seen from the robot.
  ObstacleMotion motion{.velocity = {40, 0, 0}, .until_us = 500'000};
  const Obstacle beside = Obstacle::Circle(Vector2d(0, 2), 0.5).Moving(motion);
  EXPECT_NEAR(ApproximateDistance(beside, from, to, schedule, 0, 1), 1 - 40 * 0.01, 1e-12) << "less the clock's error";
  EXPECT_EQ(ApproximateDistance(beside, from, to, schedule, 6, 7), kInfinity);
}

TEST(Deviation, IsTheLengthOfTheBulgeAndTheTurnOfTheFarthestPoint) {
  const Between between{Vector2d(3, 4), 0.5, 0.75, 0.2};
  EXPECT_DOUBLE_EQ(Deviation(between, Hull({{0, 0, 0}}, 9)), 5 * 0.04 / 8);
  EXPECT_DOUBLE_EQ(Deviation(between, Hull({{3, 4, 0}, {1, 1, 0}})), (5 + 5 * 1) * 0.04 / 8);
}

}  // namespace forereach::clearance_test
