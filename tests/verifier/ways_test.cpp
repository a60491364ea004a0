// The verifier's ways between places of residuals with regions say what the certifier's grid does.
#include "tests/test.h"

#include "forereach/residual/region_table.h"
#include "tests/oracle/region_problems.h"
#include "tests/oracle/traced_random.h"
#include "verifier/ways.h"

namespace forereach::verifier::ways_test {

TEST(Ways, BoundWhatTheGridSays) {
  for (TracedRandom random(2123); random.Again(300);) {
    const auto problem = AnyRegionalProblem(random, random.Coin(), 1, true);
    const Declaration& declaration = problem->declaration;
    const auto [lower, upper] = problem->domain.Corners();
    const RegionGrid grid(declaration, lower, upper);
    const Ways ways(*problem);
    RegionGrid::Box box;
    Ways::Box same;
    for (std::size_t l = 0; l < lower.size(); ++l) {
      box.lower[l] = random.Coin(0.3) ? random.Integer(-2, 2) * upper[l] / 2 : random.Uniform(lower[l], upper[l]);
      box.upper[l] = random.Coin(0.3) ? box.lower[l] : random.Uniform(box.lower[l], upper[l]);
      same.emplace_back(box.lower[l], box.upper[l]);
    }
    for (int k = 0; k < problem->model->num_states(); ++k) {
      const auto at = static_cast<std::size_t>(k);
      EXPECT_EQ(ways.Largest(&Region::disturbance, k, declaration.DisturbanceBound(k), same),
                grid.LargestBound(RegionBound::kDisturbance, at, box));
      EXPECT_EQ(ways.Largest(&Region::noise_bound, k, declaration.noise_bound[k], same),
                grid.LargestBound(RegionBound::kNoise, at, box));
      EXPECT_EQ(ways.Largest(&Region::bound, k, kInfinity, same), grid.LargestBound(RegionBound::kResidual, at, box));
    }
  }
}

// The grid's costs are never below those of the ways, and both find the same where no point lies on a side.
TEST(Ways, CostWhatTheGridSays) {
  int equal = 0;
  for (TracedRandom random(2122); random.Again(300);) {
    const auto problem = AnyRegionalProblem(random, random.Coin(), 1, false);
    const auto [lower, upper] = problem->domain.Corners();
    const RegionGrid grid(problem->declaration, lower, upper);
    const Ways ways(*problem);
    RegionGrid::Box from, to;
    Ways::Box box;
    Eigen::VectorXd at(std::ssize(lower));
    for (std::size_t l = 0; l < lower.size(); ++l) {
      from.lower[l] = from.upper[l] = at[static_cast<Eigen::Index>(l)] = random.Uniform(lower[l], upper[l]);
      to.lower[l] = random.Uniform(lower[l], upper[l]);
      to.upper[l] = random.Uniform(to.lower[l], upper[l]);
      box.emplace_back(to.lower[l], to.upper[l]);
    }
    grid.Find(from);
    grid.Find(to);
    for (std::size_t i = 0; i < grid.rows().size(); ++i) {
      EXPECT_TRUE(ways.Narrow(grid.rows()[i]));
      const double cost = grid.CostUpper(i, from, to);
      const Real least = ways.Cheapest<Real>(grid.rows()[i], at, box);
      EXPECT_TRUE(CertainlyAtMost(least, Real(cost)));
      EXPECT_NEAR(cost, least.ToDouble(), 1e-13 * cost);
      EXPECT_NEAR(ways.Cheapest<double>(grid.rows()[i], at, box), cost, 1e-13 * cost);
      ++equal;
    }
  }
  EXPECT_GT(equal, 500);
}

// The table's bounds are never tighter than those at the nodes, and no looser than rounding makes them.
TEST(Nodes, BoundWhatTheTableSays) {
  int compared = 0, sloped = 0;
  for (TracedRandom random(2124); random.Again(20);) {
    SCOPED_TRACE("trial " + std::to_string(random.trial()));
    const auto problem = AnyRegionalProblem(random, random.Coin(), 3, false);
    const auto corners = problem->domain.Corners();  // clang 14 captures no structured binding
    const std::vector<double>&lower = corners.first, &upper = corners.second;
    const RegionGrid grid(problem->declaration, lower, upper);
    const Ways ways(*problem);
    for (std::size_t i = 0; i < grid.rows().size(); ++i) {
      ASSERT_EQ(RegionTable::Fits(grid, i), !ways.Axes(grid.rows()[i]).empty());
      if (!RegionTable::Fits(grid, i)) continue;
      RegionTable table(grid, i, lower, upper);
      Nodes nodes(ways, grid.rows()[i]);
      for (int one = 0; one < 3; ++one) {
        const Eigen::VectorXd z = problem->transitions.z.row(one);
        const double value = random.Uniform(-0.1, 0.1);
        table.Add(one, {z.data(), lower.size()}, value, value);
        nodes.Add(z, value, value);
      }
      table.Spread();
      nodes.Spread();
      for (int query = 0; query < 5; ++query) {
        RegionGrid::Box box;
        std::vector<Real> ranges, center, half_width;
        std::vector<double> middle;
        for (std::size_t l = 0; l < lower.size(); ++l) {
          box.lower[l] = random.Coin(0.3) ? random.Integer(-2, 2) * upper[l] / 2 : random.Uniform(lower[l], upper[l]);
          box.upper[l] = random.Coin(0.3) ? box.lower[l] : random.Uniform(box.lower[l], upper[l]);
          ranges.push_back(Real::FromTo(box.lower[l], box.upper[l]));
          middle.push_back(box.lower[l] / 2 + box.upper[l] / 2);
          center.emplace_back(middle[l]);
          half_width.push_back(Real(0.5) * (Real(box.upper[l]) - Real(box.lower[l])));
        }
        const auto [bounds, band, tilt] = table.EncloseTilted(box, middle);
        const auto [least, most] = nodes.Over(ranges, {}, ranges);
        EXPECT_TRUE(CertainlyAtMost(Real(bounds.lower), least));
        EXPECT_TRUE(CertainlyAtMost(most, Real(bounds.upper)));
        const auto [least_above, most_above] = nodes.Over(ranges, tilt.slope, center);
        EXPECT_TRUE(CertainlyAtMost(Real(band.lower), least_above));
        EXPECT_TRUE(CertainlyAtMost(most_above, Real(band.upper)));
        EXPECT_NEAR(band.lower, least_above.ToDouble(), 1e-13);
        EXPECT_NEAR(band.upper, most_above.ToDouble(), 1e-13);
        const auto slopes = nodes.SlopesOver(center, half_width);
        EXPECT_TRUE(!slopes || *slopes == tilt.slope);
        sloped += slopes && *slopes != Nodes::Slopes{};
        EXPECT_NEAR(bounds.lower, least.ToDouble(), 1e-13);
        EXPECT_NEAR(bounds.upper, most.ToDouble(), 1e-13);
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 30);
  EXPECT_GT(sloped, 10);
}

}  // namespace forereach::verifier::ways_test
