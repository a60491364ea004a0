// Sets of obstacles in parts: what a receiver knows of them, and what no message makes it believe.
#include "certifier/gate/obstacle_set.h"

#include <random>

#include "tests/test.h"

#include "certifier/gate/gate.h"
#include "certifier/gate/obstacle_sender.h"
#include "forereach/safety/occupancy_grid.h"
#include "task/canonical.h"
#include "task/most_obstacles.h"
#include "tests/certifier/small_task.h"

namespace forereach::obstacle_set_test {

constexpr std::int64_t kMs = 1000;

// Far from the small task's way; `mark` tells sets apart.
std::vector<Obstacle> Cells(int count, double mark = 0) {
  std::vector<Obstacle> cells;
  for (int i = 0; i < count; ++i)
    cells.push_back(Obstacle::Circle(Eigen::Vector2d(i, 50 + mark), 0.5).Named("cell_" + std::to_string(i)));
  return cells;
}
std::vector<Obstacle> WithChange(std::vector<Obstacle> cells, std::size_t i) {
  cells[i] = Obstacle::Circle(Eigen::Vector2d(1, 80), 0.5);
  return cells;
}

// A sender and a gate, and a bus between them that may lose or hold back what is sent.
class ObstacleSetTest : public testing::Test {
 protected:
  ObstacleSetTest() { Begin(); }

  void Begin() {
    gate_ = std::make_unique<Gate>(SmallTaskOnTheBus());
    sender_.emplace(ObstacleSender::PeriodUs(SmallTaskOnTheBus().gate));
  }

  std::string Hear(const obstacles_t& message) { return gate_->UpdateObstacles(Encode(message), now_); }
  // What the sender says in the next `us`, each after `change`; true: it is lost.
  void Run(
      std::int64_t us, const std::function<bool(obstacles_t&)>& change = [](obstacles_t&) { return false; }) {
    for (const std::int64_t end = now_ + us; now_ < end; now_ += kMs)
      if (auto message = sender_->Due(now_); message && !change(*message)) Hear(*message);
  }
  // All parts of a set, as the sender says them.
  std::vector<obstacles_t> PartsOf(const std::vector<Obstacle>& obstacles) {
    ObstacleSender sender(1'000'000);
    sender.Set(obstacles);
    std::vector<obstacles_t> parts;
    while (parts.empty() || parts.back().first + parts.back().num_obstacles < std::ssize(obstacles))
      parts.push_back(*sender.Due(now_ + std::ssize(parts) * kMs));
    return parts;
  }
  std::string HearAs(obstacles_t message, std::int64_t sequence) {
    message.sequence = sequence;
    message.utime = now_;
    return Hear(message);
  }
  [[nodiscard]] std::string Why() const { return gate_->WhyObstaclesUnknown(now_); }
  [[nodiscard]] std::size_t NumHeard() const { return gate_->obstacles().size() - of_task_; }
  void ExpectInForce(const std::vector<Obstacle>& expected) {
    const std::vector<Obstacle>& all = gate_->obstacles();
    EXPECT_EQ(ObstaclesDigest({all.begin() + static_cast<std::ptrdiff_t>(of_task_), all.end()}),
              ObstaclesDigest(expected));
  }

  std::unique_ptr<Gate> gate_;  // its obstacles_timeout_ms is 1000
  std::optional<ObstacleSender> sender_;
  std::int64_t now_ = kNow;
  std::size_t of_task_ = SmallTask().obstacles.size();
};

TEST_F(ObstacleSetTest, AsManyAsATaskTakesAreKnownAfterTheirPartsAndStayKnown) {
  sender_->Set(Cells(kMostObstacles));
  int sent = 0;
  Run(63 * kMs, [&](auto&) { return ++sent < 0; });
  EXPECT_EQ(sent, 63);
  EXPECT_EQ(Why(), "63 of the 64 parts of their set of 4096 have been heard");
  EXPECT_EQ(NumHeard(), 0u);
  Run(kMs);
  EXPECT_EQ(Why(), "");
  ExpectInForce(Cells(kMostObstacles));
  sent = 0;
  for (int i = 0; i < 100; ++i) {
    Run(50 * kMs, [&](auto&) { return ++sent < 0; });
    EXPECT_EQ(Why(), "") << i;
  }
  EXPECT_LE(sent, 64 + 16 * 6) << "once more, and then at the stream's rate";
}

TEST_F(ObstacleSetTest, AChangeCostsThePartThatChanged) {
  sender_->Set(Cells(1000));
  Run(100 * kMs);
  sender_->Set(WithChange(Cells(1000), 200));
  int sent = 0;
  Run(kMs, [&](const obstacles_t& message) {
    EXPECT_EQ(message.first, 192);
    return ++sent < 0;
  });
  EXPECT_EQ(sent, 1);
  EXPECT_EQ(Why(), "");
  ExpectInForce(WithChange(Cells(1000), 200));
  sender_->Set(Cells(10));
  Run(kMs);
  ExpectInForce(Cells(10));
  sender_->Set(Cells(65));
  Run(2 * kMs);
  ExpectInForce(Cells(65));
}

TEST_F(ObstacleSetTest, WhatChangesAtEachTickIsKnownAtEachTickIfItIsOnePart) {
  sender_->Set(Cells(1000));
  Run(100 * kMs);
  for (int i = 1; i < 50; ++i) {
    std::vector<Obstacle> cells = Cells(1000);
    cells.back() = Obstacle::Circle(Eigen::Vector2d(i, 70), 0.5);
    sender_->Set(cells);
    Run(2 * kMs);
    ExpectInForce(cells);
    EXPECT_EQ(Why(), "");
  }
}

TEST_F(ObstacleSetTest, EveryPartCanBeLostAndTheSetIsUnknownUntilItComesAgain) {
  for (int lost = 0; lost < 16; ++lost) {
    Begin();
    sender_->Set(Cells(1000));
    Run(40 * kMs, [&](const obstacles_t& message) { return message.first == 64 * lost; });
    EXPECT_NE(Why(), "") << lost;
    EXPECT_EQ(NumHeard(), 0u);
    Run(2000 * kMs);
    EXPECT_EQ(Why(), "");
    ExpectInForce(Cells(1000));
  }
}

// An incomplete set is silence: the set before it stays in force as long as it does without any message.
TEST_F(ObstacleSetTest, ASetThatIsNeverCompleteIsSilence) {
  sender_->Set(Cells(1000));
  Run(100 * kMs);
  ASSERT_EQ(Why(), "");
  sender_->Set(Cells(1000, 1));
  const auto lose = [](const obstacles_t& message) { return message.first == 64; };
  Run(900 * kMs, lose);
  ExpectInForce(Cells(1000));
  EXPECT_TRUE(Why().empty() || Why().find("out of order") != std::string::npos) << Why();
  Run(200 * kMs, lose);
  EXPECT_NE(Why(), "");
  Run(3000 * kMs, lose);
  EXPECT_THAT(Why(), testing::AnyOf(HasSubstr("not all parts of their set of 1000 have been heard since it changed"),
                                    HasSubstr("out of order")));
  ExpectInForce(Cells(1000));
  Run(2000 * kMs);
  EXPECT_EQ(Why(), "");
  ExpectInForce(Cells(1000, 1));
}

TEST_F(ObstacleSetTest, PartsOfTwoSetsNeverPassForOne) {
  std::mt19937_64 random(5);
  const std::vector<obstacles_t> one = PartsOf(Cells(300)), other = PartsOf(Cells(300, 1));
  std::int64_t sequence = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::size_t part = random() % one.size();
    obstacles_t message = random() % 2 ? one[part] : other[part];
    if (random() % 4 == 0) std::ranges::copy((random() % 2 ? one : other)[part].set_digest, message.set_digest);
    EXPECT_EQ(HearAs(message, sequence++), "");
    if (NumHeard() == 0) continue;
    const std::vector<Obstacle>& all = gate_->obstacles();
    const Digest heard = ObstaclesDigest({all.begin() + static_cast<std::ptrdiff_t>(of_task_), all.end()});
    EXPECT_TRUE(heard == ObstaclesDigest(Cells(300)) || heard == ObstaclesDigest(Cells(300, 1))) << i;
  }
  EXPECT_EQ(NumHeard(), 300u) << "some complete set came in between";
}

TEST_F(ObstacleSetTest, WhatComesTwiceOrLateOrAgainChangesNothing) {
  const std::vector<obstacles_t> old = PartsOf(Cells(200, 1));
  std::int64_t sequence = 0;
  for (const obstacles_t& part : old) EXPECT_EQ(HearAs(part, sequence++), "");
  for (const obstacles_t& part : PartsOf(Cells(200))) EXPECT_EQ(HearAs(part, sequence++), "");
  EXPECT_EQ(Why(), "");
  for (std::size_t i = 0; i < old.size(); ++i) {
    EXPECT_THAT(HearAs(old[i], static_cast<std::int64_t>(i)), HasSubstr("does not exceed the last"));
    ExpectInForce(Cells(200));
    EXPECT_EQ(Why(), "");
  }
}

TEST_F(ObstacleSetTest, PartsInAnyOrderMakeTheSameSet) {
  const std::vector<obstacles_t> parts = PartsOf(Cells(200));
  for (std::size_t i = parts.size(); i-- > 0;)
    EXPECT_EQ(HearAs(parts[i], static_cast<std::int64_t>(parts.size() - i)), "") << "by its place, not by its time";
  ExpectInForce(Cells(200));
}

TEST_F(ObstacleSetTest, NumbersOfNoSetAreRefusedAndNothingIsKnownAfterThem) {
  const std::vector<obstacles_t> parts = PartsOf(Cells(200));
  std::int64_t sequence = 0;
  for (const obstacles_t& part : parts) EXPECT_EQ(HearAs(part, sequence++), "");
  const auto refused = [&](const std::string& why, const std::function<void(obstacles_t&)>& change) {
    obstacles_t message = parts[1];
    change(message);
    EXPECT_THAT(HearAs(message, sequence++), HasSubstr(why));
    EXPECT_THAT(Why(), HasSubstr("the last message was refused: "));
    ExpectInForce(Cells(200));
    EXPECT_EQ(HearAs(parts[2], sequence++), "");
    EXPECT_EQ(Why(), "") << "confirmed again";
  };
  for (const std::int16_t size : std::initializer_list<std::int16_t>{-1, 1, 64, 4097, 32767})
    refused("set_size: " + std::to_string(size), [size](auto& message) { message.set_size = size; });
  for (const std::int16_t first : std::initializer_list<std::int16_t>{-64, 200, 256, 32704})
    refused("first: " + std::to_string(first), [first](auto& message) { message.first = first; });
  refused("multiple of 64", [](auto& message) { message.first = 65; });
  for (const std::int16_t count : std::initializer_list<std::int16_t>{-1, 0, 63, 65, 32767})
    refused("obstacles: " + std::to_string(count), [count](auto& message) { message.num_obstacles = count; });
  refused("obstacles: 64, must be 8", [](auto& message) { message.first = 192; });
  refused("first: 64, must be 0", [](auto& message) { message.set_size = 0; });
}

TEST_F(ObstacleSetTest, ACompleteSetThatIsInvalidIsRefusedEachTimeItIsConfirmed) {
  std::vector<Obstacle> cells = Cells(200);
  ObstacleMotion motion;
  motion.stamp_us = kNow;
  motion.velocity.x() = 1;
  cells[150] = cells[150].Moving(motion);  // the task has no gate.max_clock_error_ms
  std::int64_t sequence = 0;
  for (const obstacles_t& part : PartsOf(Cells(200))) EXPECT_EQ(HearAs(part, sequence++), "");
  const std::vector<obstacles_t> parts = PartsOf(cells);
  int refused = 0;
  for (int round = 0; round < 2; ++round)
    for (const obstacles_t& part : parts) refused += HearAs(part, sequence++).empty() ? 0 : 1;
  EXPECT_EQ(refused, 6) << "from the part that completes it on";
  EXPECT_THAT(Why(), HasSubstr("the last message was refused: obstacle 150"));
  ExpectInForce(Cells(200));
}

TEST_F(ObstacleSetTest, ARefusedMessageIsForgottenByACompleteSetAlone) {
  std::int64_t sequence = 0;
  for (const obstacles_t& part : PartsOf(Cells(200))) EXPECT_EQ(HearAs(part, sequence++), "");
  EXPECT_NE(gate_->UpdateObstacles({}, now_), "");
  const std::vector<obstacles_t> next = PartsOf(Cells(200, 1));
  for (std::size_t i = 0; i + 1 < next.size(); ++i) {
    EXPECT_EQ(HearAs(next[i], sequence++), "");
    EXPECT_THAT(Why(), HasSubstr("not an obstacles_t"));
  }
  EXPECT_EQ(HearAs(next.back(), sequence++), "");
  EXPECT_EQ(Why(), "");
}

TEST_F(ObstacleSetTest, AReloadKeepsThePartsThatWereHeard) {
  const std::vector<obstacles_t> parts = PartsOf(Cells(200));
  std::int64_t sequence = 0;
  for (std::size_t i = 0; i + 1 < parts.size(); ++i) EXPECT_EQ(HearAs(parts[i], sequence++), "");
  const std::unique_ptr<Gate> before = std::exchange(gate_, std::make_unique<Gate>(SmallTaskOnTheBus()));
  gate_->Inherit(*before);
  EXPECT_EQ(HearAs(parts.back(), sequence++), "");
  EXPECT_EQ(Why(), "");
  ExpectInForce(Cells(200));
}

TEST_F(ObstacleSetTest, AFloodOfSetsThatAreNeverCompleteKeepsAtMostOne) {
  std::mt19937_64 random(7);
  const std::vector<obstacles_t> parts = PartsOf(Cells(kMostObstacles));
  for (std::int64_t sequence = 0; sequence < 500; ++sequence) {
    obstacles_t message = parts[random() % 63];
    message.set_digest[0] = static_cast<std::uint8_t>(random());
    message.obstacle[0].shape.point[0][0] = static_cast<double>(random() % 1000);
    EXPECT_EQ(HearAs(message, sequence), "");
  }
  EXPECT_EQ(NumHeard(), 0u);
  EXPECT_THAT(Why(), HasSubstr("parts of their set of 4096"));
}

TEST(ObstacleSenderPartsTest, APartThatChangesAgainAndAgainKeepsNoOtherWaiting) {
  ObstacleSender sender(1'000'000);
  std::vector<Obstacle> cells = Cells(640);
  sender.Set(cells);
  std::set<int> said;
  for (int i = 0; i < 40; ++i) {
    cells[0] = Obstacle::Circle(Eigen::Vector2d(i, 90), 0.5);
    sender.Set(cells);
    const auto message = sender.Due(i * kMs).value();
    said.insert(message.first);
  }
  EXPECT_EQ(said.size(), 10u);
}

TEST(ObstacleSenderPartsTest, WhatStandsIsTheSamePartWheneverItIsSet) {
  ObstacleSender one(1'000'000), later(1'000'000);
  one.Set(Cells(100));
  later.Set(Cells(100));
  EXPECT_EQ(GetDigest(one.Due(0)->set_digest), GetDigest(later.Due(86'400'000'000 * 3)->set_digest));
}

// A grid of 10^5 cells and a circle, in one part and in two, of which some are lost: known whole or not at all.
TEST_F(ObstacleSetTest, AGridIsKnownWithAllItsCellsOrNotAtAll) {
  std::mt19937 random(1);
  for (const auto& [width, height] : {std::pair(400, 250), {512, 256}}) {
    Begin();
    GridMap map{0.05, {-10, 50}, 0, width, height, {}, true};
    map.occupied.resize(ToSize(width) * ToSize(height));
    for (std::size_t i = 0; i < map.occupied.size(); ++i) map.occupied[i] = random() % 50 == 0;
    std::vector<Obstacle> before;
    for (int change = 0; change < 4; ++change) {
      map.occupied[random() % map.occupied.size()].flip();
      const std::vector<Obstacle> all{Obstacle::Grid(std::make_shared<const OccupancyGrid>(map)), Cells(1)[0]};
      sender_->Set(all);
      Run(20 * kMs, [&](obstacles_t&) { return random() % 2 == 0; });
      ExpectInForce(Why().empty() && NumHeard() == 2 && MapOf(gate_->obstacles()[of_task_]) == map ? all : before);
      Run(1000 * kMs);
      EXPECT_EQ(Why(), "");
      ExpectInForce(before = all);
    }
  }
}

}  // namespace forereach::obstacle_set_test
