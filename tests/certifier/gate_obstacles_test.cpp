// Obstacles that arrive on the bus, and the decisions bound to them.
#include <initializer_list>

#include "tests/test.h"

#include "certifier/gate/gate.h"
#include "forereach/safety/obstacle_view.h"
#include "forereach/safety/occupancy_grid.h"
#include "tests/certifier/small_task.h"

namespace forereach::gate_obstacles_test {

using Shorts = std::initializer_list<std::int16_t>;

const std::vector<Obstacle> kFarAway = {Obstacle::Circle(Eigen::Vector2d(0, 15), 1)};
const std::vector<Obstacle> kOnTheWay = {Obstacle::Circle(Eigen::Vector2d(0, 15), 1),
                                         Obstacle::AxisBox(Eigen::Vector2d(1, -1), Eigen::Vector2d(2, 1))};

obstacles_t Message(const std::vector<Obstacle>& obstacles, std::int64_t sequence) {
  return Sighted(obstacles, kNow, sequence);
}

struct GateObstaclesTest : testing::Test {
  std::string Update(const obstacles_t& message) { return gate_.UpdateObstacles(Encode(message), kNow); }
  decision_t Decide(double acceleration = kAccelerationThatCertifies) {
    return gate_.Decide(Encode(Candidate(next_plan_id_++, acceleration)), kNow).decision;
  }

  // The update is refused with a text that contains `why`, and the obstacles in force stay.
  void ExpectRefused(const std::vector<std::uint8_t>& bytes, const std::string& why) {
    const Digest before = GetDigest(gate_.Status(kNow).obstacles_digest);
    const std::size_t count = gate_.obstacles().size();
    EXPECT_THAT(gate_.UpdateObstacles(bytes, kNow), HasSubstr(why));
    EXPECT_EQ(GetDigest(gate_.Status(kNow).obstacles_digest), before);
    EXPECT_EQ(GetDigest(Decide().obstacles_digest), before);
    EXPECT_EQ(gate_.obstacles().size(), count);
  }
  // The same, nothing is known after it, and a good one with the same sequence serves.
  void ExpectRefused(const std::string& why, const std::function<void(obstacles_t&)>& corrupt) {
    obstacles_t message = Message(kOnTheWay, next_sequence_);
    corrupt(message);
    ExpectRefused(Encode(message), why);
    EXPECT_THAT(Why(), HasSubstr("the last message was refused: ")) << why;
    EXPECT_THAT(Why(), HasSubstr(why));
    EXPECT_EQ(Update(Message(kFarAway, next_sequence_++)), "") << "good again";
    EXPECT_EQ(Why(), "");
  }
  std::string Why(std::int64_t now_us = kNow) const { return gate_.WhyObstaclesUnknown(now_us); }
  // Good, in whatever order.
  void Say(std::int64_t sequence, std::int64_t utime = kNow) {
    obstacles_t message = Message(kFarAway, sequence);
    message.utime = utime;
    EXPECT_EQ(Update(message), "") << sequence;
  }

  const std::vector<Obstacle> of_task_ = SmallTask().obstacles;

  Gate gate_{SmallTaskOnTheBus()};
  std::int64_t next_plan_id_ = 1, next_sequence_ = 0;
};

std::vector<Obstacle> Both(std::vector<Obstacle> some, const std::vector<Obstacle>& others) {
  some.insert(some.end(), others.begin(), others.end());
  return some;
}

TEST_F(GateObstaclesTest, ObstaclesOfTheBusCountBesideThoseOfTheTaskAndEnterTheDigest) {
  EXPECT_EQ(Decide(kAccelerationIntoTheCircle).outcome, decision_t::ABSTAIN_SAFETY);

  EXPECT_EQ(Update(Message(kOnTheWay, 0)), "");
  const decision_t blocked = Decide();
  EXPECT_EQ(blocked.outcome, decision_t::ABSTAIN_SAFETY);
  EXPECT_EQ(blocked.obstacle, 2) << "the task's come first";
  EXPECT_EQ(GetDigest(blocked.obstacles_digest), ObstaclesDigest(Both(of_task_, kOnTheWay)));

  EXPECT_EQ(Update(Message(kFarAway, 1)), "");
  EXPECT_EQ(Decide(kAccelerationIntoTheCircle).outcome, decision_t::ABSTAIN_SAFETY)
      << "the circle of the config stands";
  const GateAnswer clear = gate_.Decide(Encode(Candidate(next_plan_id_++)), kNow);
  EXPECT_EQ(clear.decision.outcome, decision_t::CERTIFIED);
  EXPECT_EQ(GetDigest(clear.decision.obstacles_digest), ObstaclesDigest(Both(of_task_, kFarAway)));
  ASSERT_TRUE(clear.certified);
  EXPECT_EQ(GetDigest(clear.certified->obstacles_digest), ObstaclesDigest(Both(of_task_, kFarAway)));

  EXPECT_EQ(Update(Message({}, 2)), "");
  EXPECT_EQ(Decide(kAccelerationIntoTheCircle).outcome, decision_t::ABSTAIN_SAFETY);
  EXPECT_EQ(GetDigest(Decide().obstacles_digest), ObstaclesDigest(of_task_));
}

// ---- The clock of who sees them.

Gate GateWithClock() {
  Config config = SmallTaskOnTheBus();
  config.gate.max_clock_error_ms = 40;
  config.bus.delay_ms = 10;
  return Gate(config);
}

TEST(GateObstaclesClockTest, TheyAreKnownIfTheyArriveAsTheClocksAllow) {
  for (const auto& [late_us, how] : std::initializer_list<std::pair<std::int64_t, std::string>>{
           {0, ""}, {50'000, ""}, {-40'000, ""}, {50'001, "behind, or its messages are late"}, {-40'001, "ahead"}}) {
    Gate gate = GateWithClock();
    EXPECT_EQ(gate.UpdateObstacles(Encode(Message(kOnTheWay, 0)), kNow + late_us), "");
    EXPECT_EQ(gate.obstacles().size(), SmallTask().obstacles.size() + kOnTheWay.size()) << "what is seen is taken";
    const std::string why = gate.WhyObstaclesUnknown(kNow + late_us);
    EXPECT_TRUE(how.empty() ? why.empty() : why.starts_with("their sender's clock is " + how)) << late_us << why;
    EXPECT_EQ(gate.Status(kNow + late_us).obstacles_known, how.empty());
    EXPECT_EQ(gate.UpdateObstacles(Encode(Message(kFarAway, 1)), kNow), "");
    EXPECT_EQ(gate.WhyObstaclesUnknown(kNow), "") << "the next one decides anew";
  }
}

// The bytes and the times of arrival are all that it rests on, and a log has both.
TEST(GateObstaclesClockTest, TheSameMessagesAtTheSameTimesAreJudgedTheSame) {
  Gate one = GateWithClock(), another = GateWithClock();
  const std::vector<std::int64_t> late_us{0, 50'001, 49'999, 90'000, -41'000, 10};
  for (std::size_t i = 0; i < late_us.size(); ++i) {
    obstacles_t message = Message(i % 2 == 0 ? kFarAway : kOnTheWay, static_cast<std::int64_t>(i));
    message.utime += static_cast<std::int64_t>(i) * 100'000;
    const std::int64_t arrived = message.utime + late_us[i];
    for (Gate* gate : {&one, &another}) EXPECT_EQ(gate->UpdateObstacles(Encode(message), arrived), "");
    EXPECT_EQ(one.WhyObstaclesUnknown(arrived), another.WhyObstaclesUnknown(arrived));
    EXPECT_EQ(one.WhyObstaclesUnknown(arrived).empty(), -40'000 <= late_us[i] && late_us[i] <= 50'000);
    EXPECT_EQ(one.grounds().obstacles, another.grounds().obstacles);
  }
}

TEST(GateObstaclesClockTest, AReloadKeepsTheDoubt) {
  Gate gate = GateWithClock(), reloaded = GateWithClock();
  ASSERT_EQ(gate.UpdateObstacles(Encode(Message(kFarAway, 0)), kNow + 50'001), "");
  reloaded.Inherit(gate);
  EXPECT_THAT(reloaded.WhyObstaclesUnknown(kNow + 50'001), HasSubstr("clock is behind"));
}

TEST(GateTaskObstaclesTest, RefusesObstaclesOfTheBusWhereTheTaskHasThemAll) {
  Gate gate(SmallTask());
  EXPECT_THAT(gate.UpdateObstacles(Encode(Message(kOnTheWay, 0)), kNow), HasSubstr("gate.obstacles is task"));
  EXPECT_THAT(gate.UpdateObstacles({}, kNow), HasSubstr("gate.obstacles is task"));
  EXPECT_EQ(gate.grounds().obstacles, SmallTask().grounds.obstacles);
  EXPECT_EQ(gate.WhyObstaclesUnknown(kNow + 3'600'000'000), "");
  EXPECT_FIELDS(gate.Status(kNow), (obstacles_source, certifier_status_t::OBSTACLES_TASK), (obstacles_known, 1),
                (obstacles_in_force, 1), (obstacles_age_us, -1));
}

TEST(GateTaskObstaclesTest, ATaskThatNamesNoSourceHasThemAllToo) {
  Config config = SmallTask();
  config.gate.obstacles = ObstaclesSource::kUnsaid;
  Gate gate(config);
  EXPECT_THAT(gate.UpdateObstacles(Encode(Message(kFarAway, 3)), kNow), HasSubstr("those of the task file"));
  EXPECT_EQ(gate.grounds().obstacles, config.grounds.obstacles);
}

// ---- When all obstacles are known.

TEST_F(GateObstaclesTest, ObstaclesAreUnknownBeforeTheFirstMessage) {
  EXPECT_EQ(Why(), "none has been heard yet");
  EXPECT_FIELDS(gate_.Status(kNow), (obstacles_known, 0), (obstacles_source, certifier_status_t::OBSTACLES_BUS));
  Say(41);
  EXPECT_EQ(Why(), "") << "a certifier may start while somebody sends";
  EXPECT_FIELDS(gate_.Status(kNow + 7), (obstacles_known, 1), (obstacles_age_us, 7), (obstacles_utime, kNow),
                (obstacles_in_force, 2));
}

TEST_F(GateObstaclesTest, ObstaclesAreKnownUntilTheTimeoutAndNotLonger) {
  Say(0);
  EXPECT_EQ(Why(kNow + 1'000'000), "");
  EXPECT_THAT(Why(kNow + 1'000'001), HasSubstr("1000 ms old, at most 1000 ms are allowed"));
  EXPECT_EQ(Why(kNow - 50'000), "");
  EXPECT_THAT(Why(kNow - 50'001), HasSubstr("the clock was set back"));
  EXPECT_EQ(Why(), "");
}

TEST_F(GateObstaclesTest, TheAgeCountsFromTheStampNotFromTheArrival) {
  Say(0, kNow - 400'000);
  EXPECT_EQ(Why(kNow + 600'000), "");
  EXPECT_NE(Why(kNow + 600'001), "");
}

TEST_F(GateObstaclesTest, AGapMakesObstaclesUnknownUntilTheNextMessageInOrder) {
  Say(0);
  Say(1);
  Say(3);
  EXPECT_THAT(Why(), HasSubstr("sequence 3 came out of order"));
  EXPECT_EQ(gate_.Status(kNow).obstacles_lost, 1);
  EXPECT_EQ(gate_.Status(kNow).obstacles_utime, kNow) << "it is taken all the same";
  Say(4);
  EXPECT_EQ(Why(), "");
  Say(9);
  EXPECT_NE(Why(), "");
  Say(12);
  EXPECT_NE(Why(), "") << "another gap";
  Say(13);
  EXPECT_EQ(Why(), "");
  EXPECT_EQ(gate_.Status(kNow).obstacles_lost, 1 + 4 + 2);
}

TEST_F(GateObstaclesTest, AMessageThatComesLateOrTwiceChangesNothing) {
  Say(0);
  Say(1);
  for (const std::int64_t sequence : {0, 1})
    ExpectRefused(Encode(Message(kOnTheWay, sequence)), "does not exceed the last");
  EXPECT_EQ(Why(), "");
  obstacles_t old = Message(kOnTheWay, 1);
  old.utime = kNow - 3'000'000;
  ExpectRefused(Encode(old), "does not exceed the last");
  EXPECT_EQ(Why(), "") << "replayed";
  Say(3);
  ExpectRefused(Encode(Message(kOnTheWay, 2)), "does not exceed the last");
  EXPECT_NE(Why(), "") << "overtaken, it fills no gap";
}

TEST_F(GateObstaclesTest, ASenderThatBeginsAnewAtZeroIsConfirmedByItsNextMessage) {
  Say(100);
  Say(0, kNow + 1);
  EXPECT_NE(Why(), "") << "it may be a second sender";
  Say(1, kNow + 2);
  EXPECT_EQ(Why(), "");
}

TEST_F(GateObstaclesTest, TwoSendersAreNeverKnownTogether) {
  struct {
    std::int64_t first, second;
    const char* what;
  } const starts[] = {{100, 0, "the second has just begun"},
                      {100, 7, "it was there before"},
                      {50, 50, "in step"},
                      {50, 49, "one behind"}};
  for (const auto& [first, second, what] : starts) {
    Gate gate(SmallTaskOnTheBus());
    for (int i = 0; i < 20; ++i) {
      for (const bool is_second : {false, true}) {
        obstacles_t message = Message(is_second ? kOnTheWay : kFarAway, (is_second ? second : first) + i);
        message.utime = kNow + 10 * i + (is_second ? 5 : 0);
        static_cast<void>(gate.UpdateObstacles(Encode(message), kNow + 10 * i + 5));
        if (i >= 1 || is_second) EXPECT_NE(gate.WhyObstaclesUnknown(kNow + 10 * i + 5), "") << what << " " << i;
      }
    }
  }
}

TEST_F(GateObstaclesTest, ARefusedMessageMakesObstaclesUnknownUntilAGoodMessage) {
  Say(0);
  ExpectRefused({1, 2, 3}, "not an obstacles_t");
  EXPECT_NE(Why(), "");
  ExpectRefused(Encode(Message(kFarAway, 0)), "does not exceed the last");
  EXPECT_NE(Why(), "") << "an old good one ends nothing";
  Say(1);
  EXPECT_EQ(Why(), "");
  obstacles_t bad = Message(kFarAway, 2);
  bad.num_obstacles = 65;
  ExpectRefused(Encode(bad), "must be 0 to 64");
  EXPECT_NE(Why(), "");
  Say(3);
  EXPECT_EQ(Why(), "") << "the refused one was heard, no gap";
  EXPECT_EQ(gate_.Status(kNow).obstacles_lost, 0);
}

TEST_F(GateObstaclesTest, TheLastSequenceOfAllIsTaken) {
  Say(0);
  Say(std::numeric_limits<std::int64_t>::max());
  EXPECT_NE(Why(), "");
  Say(0, kNow + 1);
  Say(1, kNow + 2);
  EXPECT_EQ(Why(), "");
  Say(std::numeric_limits<std::int64_t>::max(), kNow + 3);
  EXPECT_EQ(gate_.Status(kNow).obstacles_lost, std::numeric_limits<std::int64_t>::max())
      << "the count does not overflow";
}

TEST_F(GateObstaclesTest, OnlyANewerSequenceReplaces) {
  EXPECT_EQ(Update(Message(kFarAway, 7)), "");
  ExpectRefused(Encode(Message(kOnTheWay, 7)), "sequence 7");
  ExpectRefused(Encode(Message(kOnTheWay, 6)), "sequence 6");
  EXPECT_EQ(Why(), "");
  ExpectRefused(Encode(Message(kOnTheWay, -1)), "sequence -1 is negative");
  EXPECT_EQ(Update(Message(kOnTheWay, 8)), "");
  EXPECT_EQ(Why(), "");
}

TEST_F(GateObstaclesTest, ASenderThatBeganAnewIsTakenByItsStamp) {
  EXPECT_EQ(Update(Message(kFarAway, 7)), "");
  obstacles_t anew = Message(kOnTheWay, 0);
  ExpectRefused(Encode(anew), "nor does its stamp");
  anew.utime = kNow + 1;
  EXPECT_EQ(Update(anew), "");
  EXPECT_EQ(gate_.grounds().obstacles, ObstaclesDigest(Both(of_task_, kOnTheWay)));
  ExpectRefused(Encode(anew), "sequence 0 does not exceed the last, 0, nor does its stamp");
}

TEST_F(GateObstaclesTest, TakesObstaclesAfterTheClockWasSetBack) {
  const std::int64_t later = kNow + 3'600'000'000;
  obstacles_t before = Message(kFarAway, 7);
  before.utime = later;
  EXPECT_EQ(gate_.UpdateObstacles(Encode(before), later), "");
  EXPECT_NE(Why(), "");
  EXPECT_EQ(Update(Message(kOnTheWay, 0)), "");
  EXPECT_EQ(gate_.grounds().obstacles, ObstaclesDigest(Both(of_task_, kOnTheWay)));
  EXPECT_EQ(Why(), "");
}

// A person who changes the task file does not know what is being seen.
TEST_F(GateObstaclesTest, AReloadKeepsWhatWasHeardBesideTheTasks) {
  const auto reloaded = [](const Gate& before) {
    auto gate = std::make_unique<Gate>(SmallTaskOnTheBus());
    gate->Inherit(before);
    return gate;
  };
  EXPECT_EQ(reloaded(gate_)->grounds().obstacles, ObstaclesDigest(of_task_)) << "nothing was heard";
  EXPECT_EQ(reloaded(gate_)->WhyObstaclesUnknown(kNow), "none has been heard yet");

  EXPECT_EQ(Update(Message(kOnTheWay, 0)), "");
  const auto once = reloaded(gate_), twice = reloaded(*once);
  for (Gate* gate : {once.get(), twice.get()}) {
    EXPECT_EQ(gate->grounds().obstacles, ObstaclesDigest(Both(of_task_, kOnTheWay)));
    EXPECT_EQ(gate->WhyObstaclesUnknown(kNow), "");
    EXPECT_NE(gate->WhyObstaclesUnknown(kNow + 1'000'001), "");
    const decision_t decision = gate->Decide(Encode(Candidate(next_plan_id_++)), kNow).decision;
    EXPECT_FIELDS(decision, (outcome, decision_t::ABSTAIN_SAFETY), (obstacle, 2));
    EXPECT_NE(gate->UpdateObstacles(Encode(Message(kFarAway, 0)), kNow), "") << "as old as the one before";
  }
  EXPECT_EQ(once->UpdateObstacles(Encode(Message(kFarAway, 1)), kNow), "");
  EXPECT_EQ(once->grounds().obstacles, ObstaclesDigest(Both(of_task_, kFarAway)));

  ExpectRefused({}, "not an obstacles_t");
  EXPECT_NE(reloaded(gate_)->WhyObstaclesUnknown(kNow), "") << "a refused one is not forgotten either";
}

TEST_F(GateObstaclesTest, RefusesMessagesThatAreTooOldOrFromTheFuture) {
  for (const std::int64_t age : {0, 500'000, -50'000}) {
    obstacles_t message = Message(kFarAway, next_sequence_++);
    message.utime = kNow - age;
    EXPECT_EQ(Update(message), "") << age;
  }
  for (const std::int64_t age : {500'001, -50'001}) ExpectRefused("stamped", [age](auto& m) { m.utime = kNow - age; });
}

TEST_F(GateObstaclesTest, RefusesBytesThatAreNoObstaclesMessage) {
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
  for (const std::int16_t kind : Shorts{-1, 0, 7, 32767})
    ExpectRefused("obstacle 1: unknown kind", [kind](auto& m) { m.obstacle[1].shape.kind = kind; });
  for (const std::int16_t dimension : Shorts{-1, 0, 4, 32767})
    ExpectRefused("obstacle 1: ", [dimension](auto& m) { m.obstacle[1].shape.dimension = dimension; });
  ExpectRefused("obstacle 1: dimension 1, must be 2", [](auto& m) { m.obstacle[1].shape.dimension = 1; });
  for (const std::int16_t points : Shorts{-1, 0, 1, 3, 17, 32767})
    ExpectRefused("obstacle 1: ", [points](auto& m) { m.obstacle[1].shape.num_points = points; });
  ExpectRefused("obstacle 0: ", [](auto& m) { m.obstacle[0].shape.num_points = 0; });
  ExpectRefused("obstacle 0: ", [](auto& m) { m.obstacle[0].shape.num_points = 2; });
  ExpectRefused("obstacle 0: ", [](auto& m) { m.obstacle[0].shape.value = -1; });
  ExpectRefused("obstacle 0: ", [](auto& m) { m.obstacle[0].shape.value = kNaN; });
  ExpectRefused("obstacle 0: ", [](auto& m) { m.obstacle[0].shape.point[0][1] = kNaN; });
  ExpectRefused("obstacle 1: ", [](auto& m) { m.obstacle[1].shape.point[1][0] = 0; });  // upper below lower
  ExpectRefused("obstacle 1: ", [](auto& m) {
    m.obstacle[1].shape.kind = obstacle_shape_t::POLYGON;  // of two points
  });
  ExpectRefused("obstacle 0: ", [](auto& m) {
    m.obstacle[0].shape.kind = obstacle_shape_t::HALF_SPACE;
    m.obstacle[0].shape.point[0][1] = 0;  // a zero normal
  });
}

TEST_F(GateObstaclesTest, SixtyFourObstaclesFit) {
  std::vector<Obstacle> many(64, kFarAway[0]);
  many.back() = kOnTheWay[1];
  EXPECT_EQ(Update(Message(many, 0)), "");
  EXPECT_EQ(Decide().obstacle, 64) << "behind the task's";
}

// ---- Obstacles that move.

std::vector<Obstacle> Passing() {
  ObstacleMotion motion{.stamp_us = kNow, .velocity = {0, 1, 0}};
  return {Obstacle::Circle(Eigen::Vector2d(8, 0), 0.5).Moving(motion)};
}

Config SmallTaskWithAClock() {
  Config config = SmallTaskOnTheBus();
  config.gate.max_clock_error_ms = 20;
  return config;
}

std::vector<std::uint8_t> MovingMessage(std::int64_t sequence, std::int64_t utime = kNow,
                                        const std::vector<Obstacle>& obstacles = Passing()) {
  return Encode(Sighted(obstacles, utime, sequence));
}

TEST(GateMovingTest, WhatMovesAndWhatStandsIsOneStream) {
  Gate gate(SmallTaskWithAClock());
  const std::vector<Obstacle> of_task = SmallTask().obstacles;
  EXPECT_EQ(gate.UpdateObstacles(MovingMessage(0), kNow), "");
  EXPECT_EQ(gate.grounds().obstacles, ObstaclesDigest(Both(of_task, Passing())));
  EXPECT_EQ(gate.UpdateObstacles(Encode(Message(kFarAway, 1)), kNow), "");
  EXPECT_EQ(gate.grounds().obstacles, ObstaclesDigest(Both(of_task, kFarAway)));
  EXPECT_EQ(gate.WhyObstaclesUnknown(kNow), "");
  EXPECT_THAT(gate.UpdateObstacles(MovingMessage(1), kNow), HasSubstr("does not exceed the last"));
  EXPECT_EQ(gate.UpdateObstacles(MovingMessage(3), kNow), "");
  EXPECT_THAT(gate.WhyObstaclesUnknown(kNow), HasSubstr("sequence 3 came out of order"));
  EXPECT_EQ(gate.UpdateObstacles(Encode(Message(kFarAway, 4)), kNow), "");
  EXPECT_EQ(gate.WhyObstaclesUnknown(kNow), "");
  EXPECT_EQ(gate.UpdateObstacles(MovingMessage(0, kNow + 1), kNow), "") << "its sender restarted";
  EXPECT_NE(gate.WhyObstaclesUnknown(kNow), "") << "or it is a second sender";
  EXPECT_NE(gate.WhyObstaclesUnknown(kNow + 1'000'002), "") << "it is silent for too long";
}

TEST(GateMovingTest, RefusesMessagesThatAreStaleFromTheFutureOrMalformed) {
  for (const std::int64_t age : {500'001, -50'001}) {
    Gate gate(SmallTaskWithAClock());
    EXPECT_THAT(gate.UpdateObstacles(MovingMessage(0, kNow - age), kNow), HasSubstr("stamped"));
  }
  Gate gate(SmallTaskWithAClock());
  std::vector<std::uint8_t> bytes = MovingMessage(0);
  bytes.pop_back();
  EXPECT_THAT(gate.UpdateObstacles(bytes, kNow), HasSubstr("not an obstacles_t"));
  EXPECT_THAT(gate.WhyObstaclesUnknown(kNow), HasSubstr("the last message was refused"));
  EXPECT_EQ(gate.UpdateObstacles(MovingMessage(0), kNow), "");
  EXPECT_EQ(gate.WhyObstaclesUnknown(kNow), "");
  obstacles_t nowhere = Sighted(Passing(), kNow, 1);
  nowhere.obstacle[0].from_utime = kNow + 1;
  const Digest before = gate.grounds().obstacles;
  EXPECT_THAT(gate.UpdateObstacles(Encode(nowhere), kNow), HasSubstr("track 0 begins at"));
  EXPECT_EQ(gate.grounds().obstacles, before);
  EXPECT_NE(gate.WhyObstaclesUnknown(kNow), "");
}

TEST(GateMovingTest, RefusesMovingObstaclesWithoutABoundOnTheClockError) {
  Gate gate(SmallTaskOnTheBus());
  EXPECT_EQ(gate.UpdateObstacles(MovingMessage(0, kNow, kFarAway), kNow), "") << "what stands needs none";
  EXPECT_THAT(gate.UpdateObstacles(MovingMessage(1), kNow),
              HasSubstr("obstacle 0 moves, and the task has no gate.max_clock_error_ms"));
  EXPECT_NE(gate.WhyObstaclesUnknown(kNow), "");
}

std::vector<Obstacle> Grids(std::size_t count) {
  return std::vector(count, Obstacle::Grid(std::make_shared<const OccupancyGrid>(
                                GridMap{0.05, {-90, 90}, 0, 1, 1, std::vector<bool>(1, true), true})));
}

TEST(GateGridsTest, RefusesMoreThanACertifierTakesWithThoseOfItsTask) {
  Config config = SmallTaskOnTheBus();
  for (const Obstacle& grid : Grids(ConvexNumbers::kMostGrids - 1)) config.obstacles.push_back(grid);
  Gate gate(config);
  EXPECT_THAT(gate.UpdateObstacles(MovingMessage(0, kNow, Grids(2)), kNow),
              HasSubstr("2 grids and 7 of the task file, at most 8 in all"));
  EXPECT_NE(gate.WhyObstaclesUnknown(kNow), "");
  EXPECT_EQ(gate.UpdateObstacles(MovingMessage(1, kNow, Grids(1)), kNow), "");
  EXPECT_EQ(gate.WhyObstaclesUnknown(kNow), "");
}

TEST(GateGridsTest, OfTheBusAreUnknownAfterAReloadWithWhichTheyAreTooMany) {
  Gate gate(SmallTaskOnTheBus());
  ASSERT_EQ(gate.UpdateObstacles(MovingMessage(0, kNow, Grids(2)), kNow), "");
  Config config = SmallTaskOnTheBus();
  for (const Obstacle& grid : Grids(ConvexNumbers::kMostGrids - 2)) config.obstacles.push_back(grid);
  Gate fits(config);
  fits.Inherit(gate);
  EXPECT_EQ(fits.WhyObstaclesUnknown(kNow), "");
  config.obstacles.push_back(Grids(1)[0]);
  Gate too_many(config);
  too_many.Inherit(gate);
  EXPECT_THAT(too_many.WhyObstaclesUnknown(kNow), HasSubstr("2 grids and 7 of the task file"));
  EXPECT_THAT(too_many.UpdateObstacles(MovingMessage(1, kNow, Grids(2)), kNow), HasSubstr("2 grids")) << "the same set";
  EXPECT_EQ(too_many.UpdateObstacles(MovingMessage(2, kNow, Grids(1)), kNow), "");
  EXPECT_EQ(too_many.WhyObstaclesUnknown(kNow), "");
}

TEST(GateMovingTest, AreUnknownAfterAReloadWithoutABoundOnTheClockError) {
  Gate gate(SmallTaskWithAClock()), reloaded(SmallTaskOnTheBus());
  ASSERT_EQ(gate.UpdateObstacles(MovingMessage(0), kNow), "");
  reloaded.Inherit(gate);
  EXPECT_THAT(reloaded.WhyObstaclesUnknown(kNow), HasSubstr("obstacle 0 moves"));
}

// The candidate starts in half a second and reaches the wall with its sample 5, 0.75 s later; its sample 6 is past it.
constexpr std::int64_t kAtTheWall = kNow + 500'000 + 750'000, kError = 20'000;
const Obstacle kWall = Obstacle::AxisBox(Eigen::Vector2d(0.7, -5), Eigen::Vector2d(0.8, 5));

decision_t DecisionAmong(const std::vector<Obstacle>& obstacles) {
  Gate gate(SmallTaskWithAClock());
  EXPECT_EQ(gate.UpdateObstacles(MovingMessage(0, kNow, obstacles), kNow), "");
  return gate.Decide(Encode(Candidate(1)), kNow).decision;
}

std::int16_t OutcomeAmong(const std::vector<Obstacle>& obstacles) {
  const decision_t decision = DecisionAmong(obstacles);
  if (decision.outcome == decision_t::ABSTAIN_SAFETY) {
    EXPECT_THAT(decision.step, AnyOf(4, 5));
    EXPECT_EQ(decision.obstacle, static_cast<int>(obstacles.size())) << "the task's own comes first";
  }
  return decision.outcome;
}

TEST(GateMovingTest, AWindowIsMetUpToTheClockError) {
  EXPECT_EQ(OutcomeAmong({kWall}), decision_t::ABSTAIN_SAFETY);
  for (const std::int64_t off : {-1, 0}) {
    ObstacleMotion gone, beside, comes;
    gone.stamp_us = beside.stamp_us = comes.stamp_us = kNow;
    gone.until_us = kAtTheWall - kError + off;
    EXPECT_EQ(OutcomeAmong({kWall.Moving(gone)}), off < 0 ? decision_t::CERTIFIED : decision_t::ABSTAIN_SAFETY);
    beside.until_us = comes.from_us = kAtTheWall + kError - off;
    EXPECT_EQ(OutcomeAmong({kFarAway[0].Moving(beside), kWall.Moving(comes)}),
              off < 0 ? decision_t::CERTIFIED : decision_t::ABSTAIN_SAFETY);
  }
}

TEST(GateMovingTest, AWindowOfNoLengthIsMet) {
  for (const std::int64_t off : {-1, 0}) {
    ObstacleMotion before, there, after;
    before.stamp_us = there.stamp_us = after.stamp_us = kNow;
    before.until_us = there.from_us = there.until_us = after.from_us = kAtTheWall + kError - off;
    EXPECT_EQ(DecisionAmong({kFarAway[0].Moving(before), kWall.Moving(there), kFarAway[0].Moving(after)}).outcome,
              off < 0 ? decision_t::CERTIFIED : decision_t::ABSTAIN_SAFETY);
  }
}

// Finite numbers whose products overflow: the wall may be anywhere, or where the robot is when it is there.
TEST(GateMovingTest, NumbersThatOverflowAreNeverClear) {
  for (const double huge : {1e154, 1e155, 1e300, std::numeric_limits<double>::max()}) {
    for (int which = 0; which < 5; ++which) {
      ObstacleMotion motion;
      motion.stamp_us = kAtTheWall;
      if (which == 0) motion.velocity.x() = huge;
      if (which == 1) motion.velocity = {-huge, huge, 0};
      if (which == 2) motion.uncertainty = huge;
      if (which == 3) motion.growth = huge;
      if (which == 4) motion.growth_rate = huge;
      EXPECT_EQ(DecisionAmong({kWall.Moving(motion)}).outcome, decision_t::ABSTAIN_SAFETY) << huge << " " << which;
    }
  }
}

TEST(GateMovingTest, APedestrianIsMetWhereItIsThen) {
  const auto walks = [](double y, double uncertainty = 0) {
    ObstacleMotion motion;
    motion.stamp_us = kNow;
    motion.velocity.y() = -1;
    motion.uncertainty = uncertainty;
    return Obstacle::Circle(Eigen::Vector2d(0.75, y), 0.2).Moving(motion);
  };
  EXPECT_EQ(OutcomeAmong({walks(1.25)}), decision_t::ABSTAIN_SAFETY) << "both are there 1.25 s from now";
  EXPECT_EQ(OutcomeAmong({walks(0)}), decision_t::CERTIFIED) << "it stands on the way now, and has left it then";
  EXPECT_EQ(OutcomeAmong({walks(2.5)}), decision_t::CERTIFIED) << "it comes later";
  EXPECT_EQ(OutcomeAmong({walks(2.5, 1)}), decision_t::ABSTAIN_SAFETY) << "where it is, is not known well enough";
}

// The plan's times count only where an obstacle may move.
TEST(GateMovingTest, AScheduleOutOfItsBoundsIsRejected) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  Gate gate(SmallTaskWithAClock()), without(SmallTaskOnTheBus());
  ASSERT_EQ(gate.UpdateObstacles(MovingMessage(0), kNow), "");
  std::int64_t id = 0;
  for (const std::int64_t step : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{150'001}, kMost, -kMost - 1}) {
    candidate_plan_t candidate = Candidate(++id);
    candidate.step_us = step;
    const decision_t decision = gate.Decide(Encode(candidate), kNow).decision;
    EXPECT_FIELDS(decision, (outcome, decision_t::REJECTED), (cause, decision_t::CAUSE_WRONG_DIMENSION));
    EXPECT_THAT(GetText(decision.message), HasSubstr("step_us is " + std::to_string(step) + ", must be 1 to 150000"));
    EXPECT_EQ(without.Decide(Encode(candidate), kNow).decision.outcome, decision_t::CERTIFIED);
  }
  for (const std::int64_t step : {1, 150'000}) {
    candidate_plan_t candidate = Candidate(++id);
    candidate.step_us = step;
    EXPECT_EQ(gate.Decide(Encode(candidate), kNow).decision.outcome, decision_t::CERTIFIED) << step;
  }
  for (const std::int64_t start : {std::int64_t{0}, std::int64_t{-1}, kMost, -kMost - 1}) {
    candidate_plan_t candidate = Candidate(++id);
    candidate.start_utime = start;
    const decision_t decision = gate.Decide(Encode(candidate), kNow).decision;
    EXPECT_EQ(decision.outcome, decision_t::REJECTED);
    EXPECT_EQ(decision.cause, start > 0 ? decision_t::CAUSE_FUTURE : decision_t::CAUSE_TOO_LATE);
  }
}

// The model says what a step of model.dt does, and nothing of one that is planned to take another time.
TEST(GateMovingTest, AStepOfAnotherTimeThanTheModelsIsRejected) {
  Config config = SmallTaskWithAClock();
  config.gate.step_us = 150'000;
  Gate gate(config);
  ASSERT_EQ(gate.UpdateObstacles(MovingMessage(0), kNow), "");
  std::int64_t id = 0;
  for (const std::int64_t step_us : {150'000, 149'999, 1}) {
    candidate_plan_t candidate = Candidate(++id);
    candidate.step_us = step_us;
    const decision_t decision = gate.Decide(Encode(candidate), kNow).decision;
    if (step_us == 150'000) {
      EXPECT_EQ(decision.outcome, decision_t::CERTIFIED);
      continue;
    }
    EXPECT_FIELDS(decision, (outcome, decision_t::REJECTED), (cause, decision_t::CAUSE_WRONG_DIMENSION));
    EXPECT_THAT(GetText(decision.message), HasSubstr("must be 150000, model.dt")) << step_us;
  }
}

// A receiver whose clock is wrong by centuries accepts such stamps.
TEST(GateMovingTest, StartsBeyondTheLatestTimeOfAScheduleAreRejected) {
  for (const std::int64_t sign : {1, -1}) {
    for (const bool is_inside : {true, false}) {
      Gate gate(SmallTaskWithAClock());
      const std::int64_t start = sign * (Schedule::kLatest + (is_inside ? 0 : 1)), now = start - 500'000;
      const decision_t decision = gate.Decide(Encode(Candidate(1, 0, now)), now).decision;
      if (is_inside) {
        EXPECT_EQ(decision.outcome, decision_t::CERTIFIED);
      } else {
        EXPECT_THAT(GetText(decision.message), HasSubstr("must be within 2^60 of the epoch"));
      }
    }
  }
}

}  // namespace forereach::gate_obstacles_test
