// Plans of the policy, where they are observed, and quick figures in bands that a broken method would miss.
#include "research/chunks/blocks.h"

#include "tests/test.h"

#include "research/cell.h"
#include "research/chunks/demonstrations.h"
#include "research/truth.h"

namespace forereach::research::blocks_test {

TEST(Blocks, AreThePolicysAndTheirOwnForEachPlan) {
  std::set<double> first_jerks;
  for (const Group group : kGroups)
    for (int i = 0; i < 5; ++i) {
      const Scenario scenario = MakeScenario(ChunkSystem(), group, 3, i), again = MakeChunkScenario(group, 3, i);
      EXPECT_EQ(scenario.controls, again.controls);
      ASSERT_EQ(scenario.controls.cols(), kBlockSteps);
      EXPECT_TRUE(ChunkSystem().domain.input.Contains(scenario.controls.col(0)));
      first_jerks.insert(scenario.controls(0, 0));
    }
  EXPECT_EQ(first_jerks.size(), 15u);
}

// All of A, the even ones of B and C: two thirds.
TEST(Blocks, TwoThirdsAreTargetSafe) {
  for (const Group group : kGroups)
    for (int i = 0; i < 20; ++i) {
      const Scenario scenario = MakeChunkScenario(group, 0, i);
      const bool safe = Rollouts(ChunkSystem(), scenario, 100).StayClearOf(scenario.obstacle);
      EXPECT_EQ(safe, group == Group::kA || i % 2 == 0) << NameOf(group) << i;
    }
}

TEST(Layouts, AGridHasItsEndsAndNoPointTwice) {
  const Box& region = ChunkSystem().data_region;
  for (const int count : {1, 25, 50, 100, 150, 200, 400}) {
    const Eigen::MatrixXd points = GridPoints(count);
    ASSERT_EQ(points.rows(), count);
    std::set<std::pair<double, double>> places;
    for (int i = 0; i < count; ++i) places.insert({points(i, 3), points(i, 5)});
    EXPECT_EQ(places.size(), static_cast<std::size_t>(count));
    if (count == 1) continue;
    for (const int l : {3, 5}) {
      EXPECT_FIELDS(points.col(l), (minCoeff(), region.lower()[l]), (maxCoeff(), region.upper()[l]));
    }
  }
}

TEST(Layouts, TheCorridorIsWhereThePolicyDrives) {
  const Eigen::MatrixXd few = PolicyPoints(0, 30), many = PolicyPoints(0, 60);
  EXPECT_EQ(many.topRows(30), few);
  EXPECT_NE(PolicyPoints(1, 30), few);
  for (int i = 0; i < 60; ++i) {  // straight, to the right, to the left
    const double steering = many(i, 5);
    EXPECT_TRUE(i % 3 == 0 ? std::abs(steering) < 0.1 : i % 3 == 1 ? steering < -0.05 : steering > 0.05) << steering;
  }
}

CellResult Quick(Layout layout, int observations) {
  Cell cell = PaperCell(ChunkSystem(), observations, 0, 0);
  cell.layout = layout;
  return RunCell(cell, {30, 24});
}

double RecallOf(const CellResult& result) {
  int safe = 0, certified = 0;
  for (const Tally& tally : result) safe += tally.safe, certified += tally.certified_safe;
  return static_cast<double>(certified) / safe;
}

TEST(Chunks, QuickFiguresAreInTheirBands) {
  const CellResult few_grid = Quick(Layout::kFixedGrid, 25), grid = Quick(Layout::kFixedGrid, 400);
  const CellResult few_corridor = Quick(Layout::kPolicyCorridor, 25), corridor = Quick(Layout::kPolicyCorridor, 400);
  EXPECT_GT(RecallOf(few_grid), 0.15);
  EXPECT_LT(RecallOf(few_grid), 0.55);
  EXPECT_GT(RecallOf(grid), 0.55);
  EXPECT_LT(RecallOf(grid), 0.76);  // B has no data: a quarter of the safe plans
  EXPECT_GT(RecallOf(few_corridor), 0.35);
  EXPECT_LT(RecallOf(few_corridor), 0.8);
  EXPECT_GT(RecallOf(corridor), 0.85);
  EXPECT_EQ(grid[1].certified, 0);
  EXPECT_GT(grid[1].domain, 20);
  for (const CellResult& result : {few_grid, grid, few_corridor, corridor})
    for (const Tally& tally : result) {
      EXPECT_EQ(tally.false_certificates(), 0) << tally.group;
      EXPECT_EQ(tally.covered, tally.complete()) << tally.group;
      EXPECT_EQ(std::ranges::count(tally.answers, 'C'), tally.certified) << tally.group;
      EXPECT_EQ(tally.distances.size(), 30u) << tally.group;
    }
}

}  // namespace forereach::research::blocks_test
