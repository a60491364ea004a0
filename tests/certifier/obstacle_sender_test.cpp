#include "certifier/gate/obstacle_sender.h"

#include "tests/test.h"

#include "certifier/gate/gate.h"
#include "forereach/safety/occupancy_grid.h"
#include "task/most_obstacles.h"
#include "tests/certifier/small_task.h"

namespace forereach::obstacle_sender_test {

const std::vector<Obstacle> kOne{Obstacle::Circle(Eigen::Vector2d(0, 15), 1)};

TEST(ObstacleSenderTest, SaysNothingBeforeItKnowsAndThenTheWholeSetEachPeriod) {
  ObstacleSender sender(1000);
  EXPECT_FALSE(sender.Due(0));
  sender.Set(kOne);
  int said = 0;
  for (std::int64_t now = 10; now <= 10'010; now += 10) {
    const auto message = sender.Due(now);
    EXPECT_EQ(message.has_value(), (now - 10) % 1000 == 0) << now;
    if (!message) continue;
    EXPECT_FIELDS(*message, (sequence, said++), (utime, now));
    EXPECT_EQ(ObstaclesDigest(FromMessage(*message, 2)), ObstaclesDigest(kOne));
  }
  EXPECT_EQ(said, 11);
}

TEST(ObstacleSenderTest, AChangeIsDueAtOnceAndTheSameSetIsNot) {
  ObstacleSender sender(1000);
  sender.Set(kOne);
  ASSERT_TRUE(sender.Due(0));
  sender.Set(kOne);
  EXPECT_FALSE(sender.Due(1));
  sender.Set({});
  const auto none = sender.Due(2).value();
  EXPECT_EQ(none.num_obstacles, 0) << "nothing of those before is left";
  EXPECT_FIELDS(none, (obstacle[0].shape.num_points, 0), (sequence, 1));
}

TEST(ObstacleSenderTest, AClockThatWasSetBackDelaysNothing) {
  ObstacleSender sender(1000);
  sender.Set(kOne);
  ASSERT_TRUE(sender.Due(3'600'000'000));
  EXPECT_TRUE(sender.Due(5));
}

TEST(ObstacleSenderTest, RefusesMoreObstaclesThanFitAndAPeriodThatIsNotPositive) {
  ObstacleSender sender(1000);
  sender.Set(std::vector<Obstacle>(64, kOne[0]));
  EXPECT_THROW(sender.Set(std::vector<Obstacle>(kMostObstacles + 1, kOne[0])), std::invalid_argument);
  EXPECT_EQ(sender.Due(0)->num_obstacles, 64) << "those before stay";
  for (const std::int64_t period : {0, -1}) EXPECT_THROW(ObstacleSender{period}, std::invalid_argument);
}

TEST(ObstacleSenderTest, WhatMovesKeepsItsStampAndWhatStandsGetsThatOfTheMessage) {
  ObstacleMotion motion;
  motion.stamp_us = 500;
  motion.velocity.x() = 1;
  ObstacleSender sender(1000);
  sender.Set({kOne[0], kOne[0].Moving(motion)}, {7, 9});
  for (const std::int64_t now : {1000, 2000}) {
    const auto message = sender.Due(now).value();
    EXPECT_FIELDS(message, (obstacle[0].utime, now), (obstacle[1].utime, 500), (obstacle[0].track, 7),
                  (obstacle[1].track, 9));
    EXPECT_EQ(ObstaclesDigest(FromMessage(message, 2)), ObstaclesDigest({kOne[0], kOne[0].Moving(motion)}));
  }
  motion.stamp_us = 501;
  sender.Set({kOne[0], kOne[0].Moving(motion)}, {7, 9});
  EXPECT_TRUE(sender.Due(2001)) << "another stamp is a change";
  sender.Set({kOne[0], kOne[0].Moving(motion)}, {7, 10});
  EXPECT_TRUE(sender.Due(2002)) << "another track, too";
  sender.Set({kOne[0], kOne[0].Moving(motion)}, {7, 10});
  EXPECT_FALSE(sender.Due(2003));
  EXPECT_THROW(sender.Set(kOne, {7, 10}), std::invalid_argument);
}

TEST(ObstacleSenderTest, MotionsOfAFileBeginWithTheSender) {
  ObstacleMotion motion{.from_us = -20, .until_us = 30};
  const std::vector<Obstacle> begun = BegunAt(kNow, {kOne[0], kOne[0].Moving(motion), kOne[0].Moving({})});
  EXPECT_FALSE(begun[0].motion());
  EXPECT_FIELDS(*begun[1].motion(), (stamp_us, kNow), (from_us, kNow - 20), (until_us, kNow + 30));
  EXPECT_FIELDS(*begun[2].motion(), (stamp_us, kNow), (from_us, -ObstacleMotion::kAlways),
                (until_us, ObstacleMotion::kAlways));
}

TEST(ObstacleSenderTest, AGridOfAFileIsSentAsOneOrIfItHasNoRoomAsItsBlocks) {
  const auto grid = [](int width, int height) {
    GridMap map{0.05, {3, 4}, 0, width, height, std::vector<bool>(ToSize(width) * ToSize(height)), true};
    map.occupied.front() = map.occupied.back() = true;
    return Obstacle::Grid(std::make_shared<const OccupancyGrid>(map)).Named("map");
  };
  const std::vector<Obstacle> begun = BegunAt(kNow, {grid(512, 400), grid(1000, 300), grid(512, 112), grid(2, 1)});
  std::vector<std::string> kinds;
  for (const Obstacle& obstacle : begun) {
    kinds.emplace_back(obstacle.grid() ? "grid" : "block");
    EXPECT_EQ(obstacle.name(), "map");
  }
  EXPECT_THAT(kinds, testing::ElementsAre("grid", "block", "block", "grid", "block"));
  ObstacleSender sender(1000);
  sender.Set(begun);
  const obstacles_t first = sender.Due(0).value();
  EXPECT_FIELDS(first, (set_size, 1 + 89 + 2 + 1 + 25 + 1), (num_obstacles, 64));
}

// Two pieces of one track that begins at 100, one that began before, and one that stands.
std::vector<Obstacle> SeenFrom100() {
  ObstacleMotion first, second, before;
  first.from_us = 100;
  first.until_us = second.from_us = 200;
  before.until_us = 50;
  return {kOne[0].Moving(first), kOne[0].Moving(second), kOne[0].Moving(before), kOne[0]};
}

TEST(ObstacleSenderTest, ATrackThatBeginsLaterIsSeenFromThenOnWithItsPredictions) {
  const std::vector<Obstacle> all = SeenFrom100();
  EXPECT_EQ(ObstaclesDigest(SeenBy(99, all)), ObstaclesDigest({all[2], all[3]}));
  EXPECT_EQ(ObstaclesDigest(SeenBy(100, all)), ObstaclesDigest(all));
  EXPECT_EQ(ObstaclesDigest(SeenBy(1000, all)), ObstaclesDigest(all));
}

TEST(ObstacleSenderTest, SendableIsWhatReceiversTakeAtAllTimes) {
  Config config = SmallTaskOnTheBus();
  config.obstacles = SeenFrom100();
  EXPECT_NO_THROW(RequireSendable(config));
  config.obstacles.erase(config.obstacles.begin());  // the second piece is now a track of its own, which begins at 200
  EXPECT_NO_THROW(RequireSendable(config));
  config.obstacles = {Obstacle::AxisBox(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones())};
  EXPECT_THROW(RequireSendable(config), ConfigError);
  config.obstacles.assign(kMostObstacles + 1, kOne[0]);
  EXPECT_THROW(RequireSendable(config), ConfigError);
  config.obstacles.pop_back();
  EXPECT_NO_THROW(RequireSendable(config));
  ObstacleMotion far;
  far.growth = 1;
  far.from_us = 2 * kFarthestStampUs;  // sent with a stamp that is a day older than its message
  config.obstacles = {kOne[0].Moving(far)};
  EXPECT_THROW(RequireSendable(config), ConfigError);
}

TEST(ObstacleSenderTest, AtItsPeriodAGateKnowsWhereTwoMessagesInARowAreLost) {
  const Config config = SmallTaskOnTheBus();
  Gate gate(config);
  ObstacleSender sender(ObstacleSender::PeriodUs(config.gate));
  sender.Set(kOne);
  EXPECT_LE(3 * ObstacleSender::PeriodUs(config.gate), 1'000'000);
  int said = 0;
  for (std::int64_t now = kNow; now <= kNow + 10'000'000; now += 2000) {
    const auto message = sender.Due(now);
    if (message && ++said % 5 < 3) EXPECT_EQ(gate.UpdateObstacles(Encode(*message), now), "");
    EXPECT_EQ(gate.WhyObstaclesUnknown(now).find(" old, "), std::string::npos) << now - kNow;
  }
}

}  // namespace forereach::obstacle_sender_test
