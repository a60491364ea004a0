// Continuous motions under certificates never meet an obstacle and are never held against the declaration, and the
// trials would notice if they did or were: without any one part of the declaration, they find contacts or latches.
#include "tests/test.h"

#include "tests/oracle/motions.h"
#include "tests/oracle/traced_random.h"

namespace forereach::motion_oracle_test {

TEST(ContinuousMotion, NeverMeetsAnObstacleUnderACertificate) {
  Tally total;
  for (std::uint64_t number = 0; number < 60; ++number) total.Add(MotionTrial(9000 + number).Run(5));
  RecordProperty("tally", total.Text());
  EXPECT_GT(total.certified, 100) << total.Text();
  EXPECT_GT(total.withdrawn, 20) << total.Text();
  EXPECT_GT(total.motions, 4000) << total.Text();
  EXPECT_GT(total.learned, 1000) << total.Text();
  EXPECT_GT(total.decided_exactly, 10) << total.Text();
  EXPECT_GT(total.shifted, 30) << total.Text();
  EXPECT_GT(total.recorded, 30) << total.Text();
  EXPECT_GT(total.all_at_once, 5) << total.Text();
}

class WithoutOnePart : public testing::TestWithParam<Untold> {};

TEST_P(WithoutOnePart, MeetsObstaclesOrRefusesTrueMotions) {
  int contacts = 0;
  std::uint64_t number = 0;
  for (; contacts < 3 && number < 400; ++number) try {
      static_cast<void>(MotionTrial(9500 + number, GetParam()).Run(5));
    } catch (const Contradiction&) {
      ++contacts;
    }
  EXPECT_EQ(contacts, 3) << "in " << number << " problems";
}

std::string NameOf(const testing::TestParamInfo<Untold>& tested) {
  static constexpr std::array kNames{"Nothing",  "Acceleration", "Turn",        "Body",
                                     "Velocity", "Growth",       "ClockError",  "Lateness",
                                     "Offsets",  "StateErrors",  "InputErrors", "Durations"};
  return kNames[static_cast<std::size_t>(tested.param)];
}

INSTANTIATE_TEST_SUITE_P(OfTheDeclaration, WithoutOnePart,
                         testing::Values(Untold::kAcceleration, Untold::kTurnRate, Untold::kBody, Untold::kVelocity,
                                         Untold::kGrowth, Untold::kClockError, Untold::kLateness, Untold::kOffsets,
                                         Untold::kStateErrors, Untold::kInputErrors, Untold::kDurations),
                         NameOf);

TEST(Bulge, IsZeroAtBothEndsAndReachesItsBound) {
  const Bulge constant({-1.0});
  for (const double s : {0.0, 0.25, 0.5, 1.0}) EXPECT_EQ(constant.At<Real>(s), Real(s * (1 - s) / 2));
  EXPECT_EQ(constant.Steepest(), Real(0.5));
  const Bulge back_and_forth({1.0, -1.0});
  EXPECT_EQ(back_and_forth.At<Real>(0.5), Real(0.0));
  EXPECT_EQ(back_and_forth.At<Real>(0.25), Real(-1.0 / 32));
  EXPECT_EQ(back_and_forth.At<Real>(1), Real(0.0));
}

// The judge of one moment, just inside and just outside.
TEST(Meeting, ContactIsDecidedExactly) {
  const auto point = [](double x, double y, double z) { return Point3<Real>{Real(x), Real(y), Real(z)}; };
  const Point3<Real> still = point(0, 0, 0);
  const std::vector<Point3<Real>> square{point(-1, -1, 0), point(1, -1, 0), point(1, 1, 0), point(-1, 1, 0)};
  const double little = 0x1p-52;
  const auto meets = [&](const Obstacle& obstacle, const std::vector<Point3<Real>>& points, double radius) {
    return Meets(obstacle, still, points, Real(radius), 1e-60);
  };
  using Eigen::Vector2d, Eigen::Vector3d;
  EXPECT_TRUE(meets(Obstacle::Circle(Vector2d(4, 5), 0), square, 5));
  EXPECT_FALSE(meets(Obstacle::Circle(Vector2d(4, 5), 0), square, 5 * (1 - little)));
  EXPECT_TRUE(meets(Obstacle::Circle(Vector2d(0.1, 0.2), 0), square, 0)) << "inside";
  EXPECT_TRUE(meets(Obstacle::AxisBox(Vector2d(1 - little, -3), Vector2d(2, 3)), square, 0));
  EXPECT_FALSE(meets(Obstacle::AxisBox(Vector2d(1 + little, -3), Vector2d(2, 3)), square, 0));
  EXPECT_TRUE(meets(Obstacle::Polygon({Vector2d(2, -8), Vector2d(2, 8), Vector2d(9, 0)}), square, 1));
  EXPECT_FALSE(meets(Obstacle::Polygon({Vector2d(2, -8), Vector2d(2, 8), Vector2d(9, 0)}), square, 1 - little));
  EXPECT_TRUE(meets(Obstacle::HalfSpace(Vector2d(2, 0), 4), square, 1));
  EXPECT_FALSE(meets(Obstacle::HalfSpace(Vector2d(2, 0), 4), square, 1 - little));
  const std::vector<Point3<Real>> edge{point(0, 0, -1), point(0, 0, 1)};
  EXPECT_TRUE(meets(Obstacle::AxisBox(Vector3d(3, 4, 0), Vector3d(5, 6, 9)), edge, 5));
  EXPECT_FALSE(meets(Obstacle::AxisBox(Vector3d(3, 4, 0), Vector3d(5, 6, 9)), edge, 5 * (1 - little)));
  EXPECT_TRUE(meets(Obstacle::AxisBox(Vector3d(-1, -1, 0), Vector3d(1, 1, 9)), edge, 0));
  EXPECT_FALSE(meets(Obstacle::AxisBox(Vector3d(-1, -1, 1 + little), Vector3d(1, 1, 9)), edge, 0));
}

TEST(Meeting, OfRandomHullsLiesBetweenTheGapsAndTheDistancesOfPoints) {
  TracedRandom random(811);
  for (int trial = 0; trial < 300; ++trial) {
    const int dim = random.Integer(2, 3);
    const auto hull = [&](double offset) {
      std::vector<Point3<double>> points(static_cast<std::size_t>(random.Integer(1, 6)));
      for (Point3<double>& y : points) {
        y = {offset + random.Uniform(-1, 1), random.Uniform(-1, 1), dim == 3 ? random.Uniform(-1, 1) : 0};
      }
      return points;
    };
    const auto a = hull(0), b = hull(random.Uniform(0, 3));
    const double distance = std::sqrt(SquareDistance(a, b, dim, 1e-13));
    double lower = 0, upper = kInfinity;
    const auto mixed = [&](const std::vector<Point3<double>>& points) {
      Point3<double> sum{};
      double total = 0;
      for (const Point3<double>& y : points) {
        const double weight = random.Coin() ? 1e-9 : random.Uniform(0, 1);
        sum = Plus(sum, weight, y);
        total += weight;
      }
      return Plus({}, 1 / total, sum);
    };
    for (int i = 0; i < 1500; ++i) {
      const Point3<double> between = Minus(mixed(a), mixed(b));
      upper = std::min(upper, std::sqrt(Dot(between, between)));
      Point3<double> d{random.Uniform(-1, 1), random.Uniform(-1, 1), dim == 3 ? random.Uniform(-1, 1) : 0};
      double gap = kInfinity;
      for (const auto& y : a)
        for (const auto& w : b) gap = std::min(gap, Dot(d, Minus(y, w)));
      lower = std::max(lower, gap / std::sqrt(Dot(d, d)));
    }
    ASSERT_LE(lower, distance + 1e-6) << "trial " << trial;
    ASSERT_LE(distance, upper + 1e-6) << "trial " << trial;
  }
}

}  // namespace forereach::motion_oracle_test
