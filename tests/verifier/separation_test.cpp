// Distances known by hand: exactly this distance is confirmed, one last bit more is not.
#include "tests/test.h"

#include "forereach/safety/occupancy_grid.h"
#include "verifier/separation.h"

namespace forereach::verifier::separation_test {

Slice BoxSlice(std::vector<double> half_widths) {
  Slice slice;
  for (std::size_t k = 0; k < half_widths.size(); ++k) {
    slice.center.emplace_back();
    std::vector<Real> column(half_widths.size());
    column[k] = half_widths[k];
    slice.columns.push_back(column);
  }
  return slice;
}

void ExpectDistance(const Slice& slice, const Obstacle& obstacle, double distance) {
  const ProjectedSlice projected(slice, Eigen::MatrixXd::Identity(obstacle.dim(), slice.dim()));
  Real best;
  const Precision precision(2400);
  EXPECT_EQ(IsClear(projected, obstacle, distance, best), distance > 0 ? Answer::kYes : Answer::kNo);
  EXPECT_DOUBLE_EQ(best.ToDouble(), distance);
  EXPECT_EQ(IsClear(projected, obstacle, std::nextafter(distance, 100), best), Answer::kNo);
}

TEST(Separation, PlanarDistancesAreExact) {
  const Slice unit = BoxSlice({1, 1});
  ExpectDistance(unit, Obstacle::Circle(Eigen::Vector2d(4, 5), 2), 3);  // corner (1, 1), 3-4-5
  ExpectDistance(unit, Obstacle::Circle(Eigen::Vector2d(4, 0.5), 2), 1);
  ExpectDistance(unit, Obstacle::Circle(Eigen::Vector2d(3, 0), 2), 0);
  ExpectDistance(unit, Obstacle::AxisBox(Eigen::Vector2d(4, 5), Eigen::Vector2d(7, 8)), 5);
  ExpectDistance(unit, Obstacle::AxisBox(Eigen::Vector2d(1.5, -9), Eigen::Vector2d(2, 9)), 0.5);
  ExpectDistance(unit, Obstacle::HalfSpace(Eigen::Vector2d(3, 4), 17), 2);
  ExpectDistance(unit, Obstacle::HalfSpace(Eigen::Vector2d(3, 4), 7), 0);
  ExpectDistance(unit, Obstacle::Polygon({Eigen::Vector2d(0, 3), Eigen::Vector2d(-2, 9), Eigen::Vector2d(2, 9)}), 2);
}

TEST(Separation, DistancesToObliqueEdgesAreExact) {
  Slice rhombus;  // |x| + |y| <= 2
  rhombus.center = {Real(), Real()};
  rhombus.columns = {{Real(1.0), Real(1.0)}, {Real(1.0), Real(-1.0)}};
  const ProjectedSlice projected(rhombus, Eigen::Matrix2d::Identity());
  Real best;
  const Obstacle circle = Obstacle::Circle(Eigen::Vector2d(3, 3), 0);  // 2 sqrt(2) away
  EXPECT_EQ(IsClear(projected, circle, 2.8284271247461898, best), Answer::kYes);
  EXPECT_EQ(IsClear(projected, circle, 2.8284271247461903, best), Answer::kNo);  // the double above it
}

TEST(Separation, DistancesOnTheLineAndInSpaceAreExact) {
  ExpectDistance(BoxSlice({1}), Obstacle::AxisBox(Eigen::VectorXd::Constant(1, 1.25), Eigen::VectorXd::Constant(1, 2)),
                 0.25);
  const Slice cube = BoxSlice({1, 1, 1});
  ExpectDistance(cube, Obstacle::AxisBox(Eigen::Vector3d(2, 3, 3), Eigen::Vector3d(9, 9, 9)), 3);            // corners
  ExpectDistance(cube, Obstacle::AxisBox(Eigen::Vector3d(4, 5, -1), Eigen::Vector3d(9, 9, 9)), 5);           // edges
  ExpectDistance(cube, Obstacle::AxisBox(Eigen::Vector3d(-1, 1.125, -1), Eigen::Vector3d(9, 9, 9)), 0.125);  // faces
}

TEST(Separation, OverlappingSetsAreNotClear) {
  const ProjectedSlice unit(BoxSlice({1, 1}), Eigen::Matrix2d::Identity());
  Real best;
  EXPECT_EQ(IsClear(unit, Obstacle::Circle(Eigen::Vector2d(0.5, 0), 0.1), 0, best), Answer::kNo);
  const Precision precision(6656);  // without a radius only many bits tell zero from next to nothing
  EXPECT_EQ(IsClear(unit, Obstacle::AxisBox(Eigen::Vector2d(-3, -3), Eigen::Vector2d(3, 3)), 0, best), Answer::kNo);
}

TEST(Separation, RadiusIsThatOfTheFarthestCorner) {
  EXPECT_EQ(ProjectedSlice(BoxSlice({3, 4}), Eigen::Matrix2d::Identity()).Radius().ToDouble(), 5);
  EXPECT_EQ(ProjectedSlice(BoxSlice({3}), Eigen::MatrixXd::Identity(1, 1)).Radius().ToDouble(), 3);
  EXPECT_EQ(ProjectedSlice(BoxSlice({2, 3, 6}), Eigen::Matrix3d::Identity()).Radius().ToDouble(), 7);
}

// Cells are taken from the map alone; each is as far as its rectangle, and no cell is left out.
TEST(Separation, AGridIsAsFarAsItsNearestCell) {
  FreshRandom random;
  const Precision precision(256);
  for (int round = 0; round < 40; ++round) {
    OccupancyGrid::Map map{.resolution = 0.25, .origin = {-2.0, 1.5}, .width = 9, .height = 7, .outside_is_free = true};
    for (int i = 0; i < 63; ++i) map.occupied.push_back(random() % 6 == 0);
    if (round % 3 == 0) map.yaw = 0.5;
    const ProjectedSlice slice(BoxSlice({0.25, 0.5}), Eigen::MatrixXd::Identity(2, 2));
    const Obstacle grid = Obstacle::Grid(std::make_shared<const OccupancyGrid>(map));
    double least = kInfinity;
    for (const Obstacle& block : grid.convex()) {
      Real best;
      static_cast<void>(IsClear(slice, block, 1e9, best));  // so that all directions are tried
      least = std::min(least, best.ToDouble());
    }
    Real best;
    const Answer is_clear = IsClear(slice, grid, 0, best);
    ASSERT_EQ(is_clear, least > 0 ? Answer::kYes : Answer::kNo) << "round " << round;
    if (!(least > 0.01) || least == kInfinity) continue;
    EXPECT_EQ(IsClear(slice, grid, least - 1e-9, best), Answer::kYes);
    EXPECT_EQ(IsClear(slice, grid, least + 1e-9, best), Answer::kNo);
  }
}

// Each of two sweeps sticks out of the square on other sides; what lies in both does not.
TEST(Separation, EachSideOfAnAreaMayBeClearedByAnotherSweep) {
  const Precision precision(256);
  const auto box = [](double x, double y) -> Sweep {
    return ProjectedSlice(BoxSlice({x, y}), Eigen::Matrix2d::Identity());
  };
  const auto is_within = [](const std::vector<Sweep>& sweeps, double half, double at = 0) {
    Real margin;
    return IsWithin(sweeps, {{{at - half, -half}, {at + half, -half}, {at + half, half}, {at - half, half}}}, margin);
  };
  const std::vector<Sweep> crossed{box(3, 0.5), box(0.5, 3)};
  EXPECT_EQ(is_within(crossed, 1), Answer::kYes);
  EXPECT_EQ(is_within(crossed, std::nextafter(0.5, 1)), Answer::kYes);
  EXPECT_NE(is_within(crossed, 0.5), Answer::kYes);
  EXPECT_NE(is_within({crossed[0]}, 1), Answer::kYes);
  EXPECT_NE(is_within({crossed[0], crossed[0]}, 1), Answer::kYes) << "nothing clears the sides to the left and right";
  EXPECT_EQ(is_within(crossed, 1, 10), Answer::kNo) << "clear of all sides, and outside";
  EXPECT_EQ(is_within({}, 1), Answer::kUnknown);
}

TEST(Separation, AllBeyondAGridIsOccupied) {
  const Precision precision(256);
  const ProjectedSlice slice(BoxSlice({0.25, 0.5}), Eigen::MatrixXd::Identity(2, 2));
  OccupancyGrid::Map map{
      .resolution = 1, .origin = {-2, -3}, .width = 4, .height = 6, .occupied = std::vector<bool>(24)};
  const auto is_clear = [&](double clearance) {
    Real best;
    return IsClear(slice, Obstacle::Grid(std::make_shared<const OccupancyGrid>(map)), clearance, best);
  };
  EXPECT_EQ(is_clear(1.75), Answer::kYes);
  EXPECT_EQ(is_clear(std::nextafter(1.75, 2)), Answer::kNo);
  map.yaw = 0.25;
  map.origin = {-2 * std::cos(0.25) + 3 * std::sin(0.25), -2 * std::sin(0.25) - 3 * std::cos(0.25)};
  const double reach = 0.25 * std::cos(0.25) + 0.5 * std::sin(0.25);  // of the slice along the map's first axis
  EXPECT_EQ(is_clear(2 - reach - 1e-12), Answer::kYes);
  EXPECT_EQ(is_clear(2 - reach + 1e-12), Answer::kNo);
  map.origin = {100, 0};
  EXPECT_EQ(is_clear(0), Answer::kNo);
}

}  // namespace forereach::verifier::separation_test
