#include "research/chunks/support.h"

#include "tests/test.h"

#include "planner_bridge/reference.h"
#include "research/chunks/blocks.h"

namespace forereach::research::support_test {

TEST(Support, CorrelationOfRanksWithTies) {
  // Ranks off their mean by -1.5, 0, 0, 1.5; abstentions by -0.5, -0.5, 0.5, 0.5.
  const SupportStatistic support = SupportOf({{0.1, false}, {0.2, false}, {0.2, true}, {7, true}});
  ASSERT_TRUE(support.spearman);
  EXPECT_NEAR(*support.spearman, 1.5 / std::sqrt(4.5), 1e-12);
  EXPECT_FIELDS(support, (nearest, 0), (farthest, 1), (gap(), 1));
}

TEST(Support, SeesOrderAndNothingElse) {
  std::vector<SupportRecord> with, against, same;
  for (int i = 0; i < 100; ++i) {
    with.push_back({std::exp(i / 3.0), i >= 50});
    against.push_back({-i * 1.0, i >= 50});
    same.push_back({i * 1.0, true});
  }
  EXPECT_NEAR(*SupportOf(with).spearman, std::sqrt(3) / 2, 1e-3);
  EXPECT_NEAR(*SupportOf(against).spearman, -std::sqrt(3) / 2, 1e-3);
  EXPECT_FALSE(SupportOf(same).spearman);
}

TEST(Support, DistanceIsThatOfTheFarthestStateToItsNearestObservation) {
  const System& system = ChunkSystem();
  Scenario scenario{Eigen::VectorXd::Zero(6), Eigen::MatrixXd::Zero(2, 20), {{0, 0}, 1}};
  scenario.center[3] = 10;  // straight on: x = 0, 1, .., 20
  Transitions data{Eigen::MatrixXd::Zero(2, 8), {}};
  data.z(0, 3) = data.z(1, 3) = 10;
  data.z(1, 0) = 20;
  EXPECT_NEAR(DistanceToData(system, scenario, data), 10.0 / 40, 1e-12);
  data.z.col(5).setConstant(0.25);
  EXPECT_NEAR(DistanceToData(system, scenario, data), std::hypot(10.0 / 40, 0.25 / 0.5), 1e-12);
}

}  // namespace forereach::research::support_test
