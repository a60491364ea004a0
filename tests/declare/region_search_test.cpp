// The search for regions: what it finds is true, saves slopes, and keeps to the number of cells.
#include "forereach/declare/region_search.h"

#include "tests/test.h"

#include "forereach/residual/region_grid.h"
#include "tests/declare/families.h"

namespace forereach::region_search_test {

// r_x = max(0, x y - 1) is constant up to a hyperbola; r_y has the same slope everywhere.
struct FindRegionsTest : testing::Test {
  std::vector<Region> Find(std::size_t cells) const {
    RegionSearchOptions options;
    options.most_cells = cells;
    return FindRegions(family_.slopes, family_.domain, family_.parameters, lipschitz_, {0, 1}, options);
  }
  double MeanSlope(const std::vector<Region>& regions) const {
    Declaration declaration{lipschitz_, Eigen::Vector2d::Zero()};
    declaration.regions = regions;
    double sum = 0;
    for (int i = 0; i < 40; ++i)
      for (int j = 0; j < 40; ++j) {
        const double x = -1.95 + 0.1 * i, y = -1.95 + 0.1 * j;
        double slope = lipschitz_(0, 0);
        for (const Region& region : regions)
          if (region.box[0].range.Contains(x) && region.box[1].range.Contains(y))
            slope = std::min(slope, region.lipschitz(0, 0));
        sum += slope / 1600;
      }
    return sum;
  }

  const Family family_ = Made(Square(2), "max(0, x*y - 1)", "y/4 + u");
  const Eigen::MatrixXd lipschitz_ = (Eigen::MatrixXd(2, 3) << 2, 2, 0, 0, 0.25, 1).finished();
};

TEST_F(FindRegionsTest, FindsWhereTheResidualIsConstantAndNoSlopeIsTooSmall) {
  const std::vector<Region> regions = Find(64);
  std::mt19937 engine(3);
  int constant = 0, smaller = 0;
  for (const Region& region : regions) {
    constant += region.lipschitz.row(0).isZero(0);
    EXPECT_TRUE((region.lipschitz.array() <= lipschitz_.array()).all());
    EXPECT_EQ(region.lipschitz.row(1), lipschitz_.row(1));
    const auto any = [&](int side) {
      const Interval& range = region.box[static_cast<std::size_t>(side)].range;
      return std::uniform_real_distribution<double>(range.lower, range.upper)(engine);
    };
    const auto r = [](double x, double y) { return std::max(0.0, x * y - 1); };
    for (int trial = 0; trial < 200; ++trial) {
      const double x = any(0), y = any(1), x2 = any(0), y2 = any(1);
      EXPECT_LE(std::abs(r(x, y) - r(x2, y2)),
                region.lipschitz(0, 0) * std::abs(x - x2) + region.lipschitz(0, 1) * std::abs(y - y2) + 1e-12);
    }
    smaller += region.lipschitz(0, 0) < 1.6 && region.lipschitz(0, 0) > 0;
  }
  EXPECT_GT(constant, 3);
  EXPECT_GT(smaller, 3);
}

TEST_F(FindRegionsTest, KeepsToTheNumberOfCellsAndSavesMoreWithMore) {
  double before = 2;
  for (const std::size_t cells : {4, 16, 64}) {
    const std::vector<Region> regions = Find(cells);
    Declaration declaration{lipschitz_, Eigen::Vector2d::Zero()};
    declaration.regions = regions;
    EXPECT_NO_THROW(declaration.Validate(2, 3));
    const std::vector<double> lower{-2, -2, -1}, upper{2, 2, 1};
    EXPECT_LE(RegionGrid(declaration, lower, upper).num_cells(), cells);
    const double mean = MeanSlope(regions);
    EXPECT_LT(mean, 0.9 * before) << cells << " cells";
    before = mean;
  }
  EXPECT_LT(before, 0.7);
  EXPECT_TRUE(Find(1).empty());
}

TEST(PartIn, IsTheDomainWithinTheRegion) {
  Region region{{{0, {-1, 5}}, {2, {0, 0.5}}}, {}};
  const auto part = PartIn(Square(2), region).value();
  EXPECT_FIELDS(part, (state.lower(), Eigen::Vector2d(-1, -2)), (state.upper(), Eigen::Vector2d(2, 2)),
                (input.upper()[0], 0.5));
  region.box[0].range = {3, 4};
  EXPECT_FALSE(PartIn(Square(2), region));
}

}  // namespace forereach::region_search_test
