// Obstacles that arrive on the bus, and the decisions bound to them.
#include <functional>
#include <initializer_list>
#include <limits>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "certifier/gate/gate.h"
#include "certifier/gate/obstacle_message.h"
#include "forereach/transition_t.hpp"
#include "tests/gate/small_task.h"

namespace forereach {
namespace {

using testing::HasSubstr;
using Shorts = std::initializer_list<std::int16_t>;

const std::vector<Obstacle> kFarAway = {Obstacle::Circle(Eigen::Vector2d(0, 15), 1)};
const std::vector<Obstacle> kOnTheWay = {Obstacle::Circle(Eigen::Vector2d(0, 15), 1),
                                         Obstacle::AxisBox(Eigen::Vector2d(1, -1), Eigen::Vector2d(2, 1))};

obstacles_t Message(const std::vector<Obstacle>& obstacles, std::int64_t sequence) {
  obstacles_t message = ToMessage(obstacles);
  message.utime = kNow;
  message.sequence = sequence;
  return message;
}

class GateObstaclesTest : public testing::Test {
 protected:
  std::string Update(const obstacles_t& message) { return gate_.UpdateObstacles(Encode(message), kNow); }
  decision_t Decide(double acceleration = kAccelerationThatCertifies) {
    return gate_.Decide(Encode(Candidate(next_plan_id_++, acceleration)), kNow).decision;
  }

  // The update is refused with a text that contains `why`, what was in force stays, and the same sequence serves for a
  // good update afterwards.
  void ExpectRefused(const std::vector<std::uint8_t>& bytes, const std::string& why) {
    const Digest before = GetDigest(gate_.Status(kNow).obstacles_digest);
    const std::size_t count = gate_.obstacles().size();
    EXPECT_THAT(gate_.UpdateObstacles(bytes, kNow), HasSubstr(why));
    EXPECT_EQ(GetDigest(gate_.Status(kNow).obstacles_digest), before);
    EXPECT_EQ(GetDigest(Decide().obstacles_digest), before);
    EXPECT_EQ(gate_.obstacles().size(), count);
  }
  void ExpectRefused(const std::string& why, const std::function<void(obstacles_t&)>& corrupt) {
    obstacles_t message = Message(kOnTheWay, next_sequence_);
    corrupt(message);
    ExpectRefused(Encode(message), why);
    EXPECT_EQ(Update(Message(kFarAway, next_sequence_++)), "") << "good again";
  }

  Gate gate_{SmallTask()};
  std::int64_t next_plan_id_ = 1, next_sequence_ = 0;
};

TEST_F(GateObstaclesTest, AnUpdateReplacesAllAndDecisionsAreBoundToIt) {
  EXPECT_EQ(Decide().outcome, decision_t::CERTIFIED);
  EXPECT_EQ(Decide(kAccelerationIntoTheCircle).outcome, decision_t::ABSTAIN_SAFETY);

  EXPECT_EQ(Update(Message(kOnTheWay, 0)), "");
  const decision_t blocked = Decide();
  EXPECT_EQ(blocked.outcome, decision_t::ABSTAIN_SAFETY);
  EXPECT_EQ(blocked.obstacle, 1);
  EXPECT_EQ(GetDigest(blocked.obstacles_digest), ObstaclesDigest(kOnTheWay));

  EXPECT_EQ(Update(Message(kFarAway, 1)), "");
  const GateAnswer clear = gate_.Decide(Encode(Candidate(next_plan_id_++, kAccelerationIntoTheCircle)), kNow);
  EXPECT_EQ(clear.decision.outcome, decision_t::CERTIFIED) << "the circle of the config is gone";
  EXPECT_EQ(GetDigest(clear.decision.obstacles_digest), ObstaclesDigest(kFarAway));
  ASSERT_TRUE(clear.certified);
  EXPECT_EQ(GetDigest(clear.certified->obstacles_digest), ObstaclesDigest(kFarAway));

  EXPECT_EQ(Update(Message({}, 2)), "");
  const decision_t empty = Decide();
  EXPECT_EQ(empty.outcome, decision_t::CERTIFIED);
  EXPECT_EQ(empty.obstacle, -1);
  EXPECT_EQ(GetDigest(empty.obstacles_digest), ObstaclesDigest({}));
}

TEST_F(GateObstaclesTest, OnlyANewerSequenceReplaces) {
  EXPECT_EQ(Update(Message(kFarAway, 7)), "");
  ExpectRefused(Encode(Message(kOnTheWay, 7)), "sequence 7");
  ExpectRefused(Encode(Message(kOnTheWay, 6)), "sequence 6");
  ExpectRefused(Encode(Message(kOnTheWay, -1)), "sequence -1");
  EXPECT_EQ(Update(Message(kOnTheWay, 8)), "");
}

TEST_F(GateObstaclesTest, ASenderThatBeganAnewIsTakenByItsStamp) {
  EXPECT_EQ(Update(Message(kFarAway, 7)), "");
  obstacles_t anew = Message(kOnTheWay, 0);
  ExpectRefused(Encode(anew), "nor does its stamp");
  anew.utime = kNow + 1;
  EXPECT_EQ(Update(anew), "");
  EXPECT_EQ(gate_.obstacles_digest(), ObstaclesDigest(kOnTheWay));
  ExpectRefused(Encode(anew), "sequence 0 does not exceed the last, 0, nor does its stamp");
}

TEST_F(GateObstaclesTest, AClockThatWasSetBackKeepsNobodyOut) {
  const std::int64_t later = kNow + 3'600'000'000;
  obstacles_t before = Message(kFarAway, 7);
  before.utime = later;
  EXPECT_EQ(gate_.UpdateObstacles(Encode(before), later), "");
  EXPECT_EQ(Update(Message(kOnTheWay, 0)), "");
  EXPECT_EQ(gate_.obstacles_digest(), ObstaclesDigest(kOnTheWay));
}

// A person who changes the task file does not know what is being seen.
TEST_F(GateObstaclesTest, AReloadKeepsWhatWasHeardBesideTheTasks) {
  const std::vector<Obstacle> of_task = SmallTask().obstacles;
  const auto reloaded = [](const Gate& before) {
    auto gate = std::make_unique<Gate>(SmallTask());
    gate->Inherit(before);
    return gate;
  };
  EXPECT_EQ(reloaded(gate_)->obstacles_digest(), ObstaclesDigest(of_task)) << "nothing was heard";

  EXPECT_EQ(Update(Message(kOnTheWay, 0)), "");
  std::vector<Obstacle> both = of_task;
  both.insert(both.end(), kOnTheWay.begin(), kOnTheWay.end());
  const auto once = reloaded(gate_), twice = reloaded(*once);
  for (Gate* gate : {once.get(), twice.get()}) {
    EXPECT_EQ(gate->obstacles_digest(), ObstaclesDigest(both));
    const decision_t decision = gate->Decide(Encode(Candidate(next_plan_id_++)), kNow).decision;
    EXPECT_EQ(decision.outcome, decision_t::ABSTAIN_SAFETY);
    EXPECT_EQ(decision.obstacle, 2);
    EXPECT_NE(gate->UpdateObstacles(Encode(Message(kFarAway, 0)), kNow), "") << "as old as the one before";
  }
  EXPECT_EQ(once->UpdateObstacles(Encode(Message(kFarAway, 1)), kNow), "");
  EXPECT_EQ(once->obstacles_digest(), ObstaclesDigest(kFarAway));
}

TEST_F(GateObstaclesTest, OldOrFutureOnesAreRefused) {
  for (const std::int64_t age : {0, 500'000, -50'000}) {
    obstacles_t message = Message(kFarAway, next_sequence_++);
    message.utime = kNow - age;
    EXPECT_EQ(Update(message), "") << age;
  }
  for (const std::int64_t age : {500'001, -50'001}) ExpectRefused("stamped", [age](auto& m) { m.utime = kNow - age; });
}

TEST_F(GateObstaclesTest, BytesThatAreNone) {
  std::vector<std::uint8_t> bytes = Encode(Message(kOnTheWay, 0));
  ExpectRefused({}, "not an obstacles_t");
  ExpectRefused(Encode(transition_t{}), "not an obstacles_t");
  ExpectRefused({bytes.begin(), bytes.end() - 1}, "not an obstacles_t");
  bytes.push_back(0);
  ExpectRefused(bytes, "not an obstacles_t");
  bytes.pop_back();
  EXPECT_EQ(gate_.UpdateObstacles(bytes, kNow), "");
}

TEST_F(GateObstaclesTest, WrongContentNamesTheObstacle) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const std::int16_t count : Shorts{-1, 65, 32767})
    ExpectRefused(std::to_string(count) + ", must be 0 to 64", [count](auto& m) { m.num_obstacles = count; });
  for (const std::int16_t kind : Shorts{-1, 0, 5, 32767})
    ExpectRefused("obstacle 1: unknown kind", [kind](auto& m) { m.obstacle[1].kind = kind; });
  for (const std::int16_t dimension : Shorts{-1, 0, 4, 32767})
    ExpectRefused("obstacle 1: ", [dimension](auto& m) { m.obstacle[1].dimension = dimension; });
  ExpectRefused("obstacle 1: dimension 1, must be 2", [](auto& m) { m.obstacle[1].dimension = 1; });
  for (const std::int16_t points : Shorts{-1, 0, 1, 3, 17, 32767})
    ExpectRefused("obstacle 1: ", [points](auto& m) { m.obstacle[1].num_points = points; });
  ExpectRefused("obstacle 0: ", [](auto& m) { m.obstacle[0].num_points = 0; });
  ExpectRefused("obstacle 0: ", [](auto& m) { m.obstacle[0].num_points = 2; });
  ExpectRefused("obstacle 0: ", [](auto& m) { m.obstacle[0].value = -1; });
  ExpectRefused("obstacle 0: ", [](auto& m) { m.obstacle[0].value = kNaN; });
  ExpectRefused("obstacle 0: ", [](auto& m) { m.obstacle[0].point[0][1] = kNaN; });
  ExpectRefused("obstacle 1: ", [](auto& m) { m.obstacle[1].point[1][0] = 0; });  // upper below lower
  ExpectRefused("obstacle 1: ", [](auto& m) {
    m.obstacle[1].kind = obstacle_t::POLYGON;  // of two points
  });
  ExpectRefused("obstacle 0: ", [](auto& m) {
    m.obstacle[0].kind = obstacle_t::HALF_SPACE;
    m.obstacle[0].point[0][1] = 0;  // a zero normal
  });
}

TEST_F(GateObstaclesTest, SixtyFourObstaclesFit) {
  std::vector<Obstacle> many(64, kFarAway[0]);
  many.back() = kOnTheWay[1];
  EXPECT_EQ(Update(Message(many, 0)), "");
  EXPECT_EQ(Decide().obstacle, 63);
}

TEST(ObstacleMessageTest, EveryKindGoesThroughTheBus) {
  const std::vector<Obstacle> obstacles = {
      Obstacle::Circle(Eigen::Vector2d(0.1, -2), 0.3),
      Obstacle::AxisBox(Eigen::Vector2d(1, 2), Eigen::Vector2d(3, 4.5)),
      Obstacle::Polygon({Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0), Eigen::Vector2d(0.5, 2), Eigen::Vector2d(0, 1)}),
      Obstacle::HalfSpace(Eigen::Vector2d(-1, 0.5), -7)};
  const auto message = Decoded<obstacles_t>(Encode(ToMessage(obstacles)));
  ASSERT_TRUE(message);
  const std::vector<Obstacle> back = FromMessage(*message, 2);
  EXPECT_EQ(ObstaclesDigest(back), ObstaclesDigest(obstacles));
}

TEST(ObstacleMessageTest, BoxesAndHalfSpacesExistInOneAndThreeDimensions) {
  for (const int dim : {1, 3}) {
    const std::vector<Obstacle> obstacles = {
        Obstacle::AxisBox(Eigen::VectorXd::Constant(dim, -1), Eigen::VectorXd::Constant(dim, 2)),
        Obstacle::HalfSpace(Eigen::VectorXd::LinSpaced(dim, 1, 2), 3)};
    EXPECT_EQ(ObstaclesDigest(FromMessage(ToMessage(obstacles), dim)), ObstaclesDigest(obstacles));
    EXPECT_THROW((void)FromMessage(ToMessage(obstacles), 2), std::invalid_argument);
  }
}

}  // namespace
}  // namespace forereach
