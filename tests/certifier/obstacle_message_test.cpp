// Obstacles as messages: shapes, and predictions in pieces.
#include "certifier/gate/obstacle_message.h"

#include "tests/test.h"

#include "forereach/safety/occupancy_grid.h"
#include "task/canonical.h"
#include "tests/certifier/small_task.h"
#include "tests/oracle/traced_random.h"

namespace forereach::obstacle_message_test {

constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max(), kLeast = -kMost - 1;
const Obstacle kCircle = Obstacle::Circle(Eigen::Vector2d(1, 2), 0.5);

TEST(ObstacleMessageTest, EveryKindGoesThroughTheBus) {
  const std::vector<Obstacle> obstacles = {
      Obstacle::Circle(Eigen::Vector2d(0.1, -2), 0.3),
      Obstacle::AxisBox(Eigen::Vector2d(1, 2), Eigen::Vector2d(3, 4.5)),
      Obstacle::Polygon({Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0), Eigen::Vector2d(0.5, 2), Eigen::Vector2d(0, 1)}),
      Obstacle::HalfSpace(Eigen::Vector2d(-1, 0.5), -7)};
  const auto message = Decoded<obstacles_t>(Encode(ToMessage(obstacles, kNow))).value();
  EXPECT_EQ(ObstaclesDigest(FromMessage(message, 2)), ObstaclesDigest(obstacles));
}

TEST(ObstacleMessageTest, NamesGoThroughTheBusAndOthersAreRefused) {
  const std::vector<Obstacle> named{kCircle.Named("oak_2"), kCircle, kCircle.Named(std::string(kMaxObstacleName, 'x'))};
  obstacles_t message = *Decoded<obstacles_t>(Encode(ToMessage(named, kNow)));
  for (std::size_t i = 0; i < named.size(); ++i) EXPECT_EQ(FromMessage(message, 2)[i].name(), named[i].name());
  for (const char* bad : {"6", "a b", "a\x1b[2J", "<b>", "a\n", "\xff"}) {
    SetText(message.obstacle[1].name, bad);
    EXPECT_THAT(Thrown<std::invalid_argument>([&] { (void)FromMessage(message, 2); }), HasSubstr("obstacle 1: name: "));
  }
  std::ranges::fill(message.obstacle[1].name, 'x');  // without an end
  EXPECT_THAT(Thrown<std::invalid_argument>([&] { (void)FromMessage(message, 2); }), HasSubstr("has 32 characters"));
}

TEST(ObstacleMessageTest, BoxesAndHalfSpacesExistInOneAndThreeDimensions) {
  for (const int dim : {1, 3}) {
    const std::vector<Obstacle> obstacles = {
        Obstacle::AxisBox(Eigen::VectorXd::Constant(dim, -1), Eigen::VectorXd::Constant(dim, 2)),
        Obstacle::HalfSpace(Eigen::VectorXd::LinSpaced(dim, 1, 2), 3)};
    EXPECT_EQ(ObstaclesDigest(FromMessage(ToMessage(obstacles, kNow), dim)), ObstaclesDigest(obstacles));
    EXPECT_THROW((void)FromMessage(ToMessage(obstacles, kNow), 2), std::invalid_argument);
  }
}

// ---- Grids: a piece, and then pieces of its cells.

Obstacle GridOf(GridMap map) { return Obstacle::Grid(std::make_shared<const OccupancyGrid>(std::move(map))); }
Obstacle GridOf(int width, int height, const std::function<bool(std::size_t)>& is_occupied) {
  GridMap map{0.05, {-3, 7.25}, 0, width, height, std::vector<bool>(ToSize(width) * ToSize(height)), true};
  for (std::size_t i = 0; i < map.occupied.size(); ++i) map.occupied[i] = is_occupied(i);
  return GridOf(std::move(map));
}
const Obstacle kOneByTwo = GridOf(1, 2, [](std::size_t i) { return i == 1; });

TEST(GridMessageTest, GridsGoThroughTheBusAmongOthers) {
  for (TracedRandom random(1); random.Again(60);) {
    std::vector<Obstacle> obstacles;
    for (int count = random.Integer(1, 4); count > 0; --count) {
      const double share = random.Coin(0.2) ? 1 : random.Uniform(0, 0.6);
      GridMap map =
          MapOf(GridOf(random.Integer(1, 90), random.Integer(1, 90), [&](std::size_t) { return random.Coin(share); }));
      map.origin = {random.Uniform(-50, 50), random.Uniform(-50, 50)};
      map.yaw = random.Coin() ? 0 : random.Uniform(-4, 4);
      map.resolution = random.Uniform(0.02, 2);
      map.outside_is_free = random.Coin();
      obstacles.push_back(GridOf(map));
      if (random.Coin()) obstacles.back() = obstacles.back().Named("map_1");
      if (random.Coin()) obstacles.push_back(kCircle);
    }
    if (ToPieces(obstacles, kNow).size() > kMaxObstacles) continue;
    const auto taken = FromMessage(Decoded<obstacles_t>(Encode(ToMessage(obstacles, kNow))).value(), 2);
    ASSERT_EQ(taken.size(), obstacles.size());
    for (std::size_t i = 0; i < taken.size(); ++i) {
      EXPECT_EQ(taken[i].name(), obstacles[i].name());
      if (obstacles[i].grid()) EXPECT_TRUE(MapOf(taken[i]) == MapOf(obstacles[i]));
    }
    EXPECT_EQ(ObstaclesDigest(taken), ObstaclesDigest(obstacles));
  }
}

TEST(GridMessageTest, ACellsPieceHas2304AndTheNextOneTheRest) {
  for (const auto& [width, pieces] : {std::pair(2303, 2u), {2304, 2u}, {2305, 3u}}) {
    const Obstacle grid = GridOf(width, 1, [width = width](std::size_t i) { return i + 1 == ToSize(width); });
    const std::vector<obstacle_t> all = ToPieces({grid}, kNow);
    EXPECT_EQ(all.size(), pieces);
    EXPECT_TRUE(MapOf(FromMessage(all, kNow, 2).at(0)) == MapOf(grid));
  }
}

TEST(GridMessageTest, AsManyCellsAsTheBusTakesAndNoMore) {
  const Obstacle most = GridOf(512, 512, [](std::size_t i) { return i % 512 == 0; });
  GridRoom room;
  EXPECT_TRUE(room.Take(most));
  EXPECT_FALSE(room.Take(kOneByTwo));
  std::vector<obstacle_t> pieces = ToPieces({most}, kNow);
  EXPECT_EQ(FromMessage(pieces, kNow, 2).at(0).convex().size(), 1u);
  std::ranges::copy(ToPieces({kOneByTwo}, kNow), std::back_inserter(pieces));
  EXPECT_THAT(Thrown<std::invalid_argument>([&] { (void)FromMessage(pieces, kNow, 2); }),
              HasSubstr("obstacle 115: a grid of 1 by 2 cells; a set has up to 4 grids of 1 to 262144 in all"));
}

TEST(GridMessageTest, AsManyGridsAndBlocksAsTheBusTakesAndNoMore) {
  const std::vector<Obstacle> grids(GridRoom::kMostGrids + 1, kOneByTwo);
  EXPECT_THAT(Thrown<std::invalid_argument>([&] { (void)FromMessage(ToPieces(grids, kNow), kNow, 2); }),
              HasSubstr("a set has up to 4 grids"));
  EXPECT_EQ(FromMessage(ToPieces({grids.begin() + 1, grids.end()}, kNow), kNow, 2).size(), 4u);
  // Every second cell of every second row is a block of its own.
  const auto scattered = [](int height) {
    return GridOf(256, height, [](std::size_t i) { return i % 2 == 0 && i / 256 % 2 == 0; });
  };
  EXPECT_EQ(FromMessage(ToPieces({scattered(128)}, kNow), kNow, 2).at(0).grid()->blocks().size(), 8192u);
  EXPECT_THAT(Thrown<std::invalid_argument>([&] { (void)FromMessage(ToPieces({scattered(129)}, kNow), kNow, 2); }),
              HasSubstr("the grids of a set make 8192 rectangles at most"));
}

TEST(GridMessageTest, AGridThatIsKnownIsNotMadeAgain) {
  const std::vector<obstacle_t> pieces = ToPieces({kCircle, kOneByTwo}, kNow);
  const std::vector<Obstacle> first = FromMessage(pieces, kNow, 2);
  EXPECT_EQ(FromMessage(pieces, kNow, 2, first)[1].grid(), first[1].grid());
  EXPECT_NE(FromMessage(pieces, kNow, 2)[1].grid(), first[1].grid());
}

TEST(GridMessageTest, WhatIsNoGridIsRefused) {
  using Pieces = std::vector<obstacle_t>;
  const auto why = [](const std::function<void(Pieces&)>& change) {
    Pieces pieces = ToPieces({kOneByTwo, kCircle}, kNow);
    change(pieces);
    return Thrown<std::invalid_argument>([&] { (void)FromMessage(pieces, kNow, 2); });
  };
  const auto grid = [&](const std::function<void(obstacle_shape_t&)>& change) {
    return why([&](Pieces& pieces) { change(pieces[0].shape); });
  };
  const auto cells = [&](const std::function<void(obstacle_shape_t&)>& change) {
    return why([&](Pieces& pieces) { change(pieces[1].shape); });
  };
  EXPECT_EQ(why([](Pieces&) {}), "");
  EXPECT_EQ(why([](Pieces& pieces) { pieces.erase(pieces.begin()); }), "obstacle 0: cells without a grid before them");
  EXPECT_EQ(why([](Pieces& pieces) { pieces.erase(pieces.begin() + 1); }),
            "obstacle 1: a grid of 1 by 2 cells has only 0 of them");
  EXPECT_EQ(why([](Pieces& pieces) { pieces.resize(1); }),
            "the last obstacle: a grid of 1 by 2 cells has only 0 of them");
  EXPECT_EQ(why([](Pieces& pieces) { std::swap(pieces[1], pieces[2]); }),
            "obstacle 1: a grid of 1 by 2 cells has only 0 of them");
  EXPECT_EQ(why([](Pieces& pieces) { pieces.insert(pieces.begin() + 1, pieces[1]); }),
            "obstacle 2: cells without a grid before them");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {nan, kInfinity, -1.0, 0.5, 0.0, 262'145.0}) {
    EXPECT_THAT(grid([&](auto& shape) { shape.point[1][0] = bad; }), HasSubstr("obstacle 0: a grid")) << bad;
    EXPECT_THAT(grid([&](auto& shape) { shape.point[1][1] = bad; }), HasSubstr("obstacle 0: a grid")) << bad;
  }
  EXPECT_THAT(grid([](auto& shape) { shape.point[1][0] = shape.point[1][1] = 262'144; }),
              HasSubstr("a grid of 262144 by 262144 cells; a set has up to 4 grids of 1 to 262144"));
  for (const double bad : {nan, 0.5, 2.0, -1.0})
    EXPECT_THAT(grid([&](auto& shape) { shape.point[2][1] = bad; }), HasSubstr("outside ")) << bad;
  for (const double bad : {nan, 0.0, -1.0, kInfinity}) {
    EXPECT_THAT(grid([&](auto& shape) { shape.value = bad; }), HasSubstr("obstacle 1: grid: resolution")) << bad;
    if (bad == 0 || bad == -1) continue;
    EXPECT_THAT(grid([&](auto& shape) { shape.point[0][1] = bad; }), HasSubstr("grid: origin")) << bad;
    EXPECT_THAT(grid([&](auto& shape) { shape.point[2][0] = bad; }), HasSubstr("grid: yaw")) << bad;
  }
  for (const int count : {0, 2, 4, 16})
    EXPECT_THAT(grid([&](auto& shape) { shape.num_points = static_cast<std::int16_t>(count); }),
                HasSubstr("must be 3"));
  EXPECT_THAT(grid([](auto& shape) { shape.dimension = 3; }), HasSubstr("a grid has 2"));
  EXPECT_THAT(cells([](auto& shape) { shape.num_points = 15; }), HasSubstr("must be 16 of 3"));
  EXPECT_THAT(cells([](auto& shape) { shape.dimension = 2; }), HasSubstr("must be 16 of 3"));
  for (const double bad : {nan, -1.0, 0.5, 0x1p48, kInfinity})
    EXPECT_THAT(cells([&](auto& shape) { shape.point[15][2] = bad; }), HasSubstr("obstacle 1: cells")) << bad;
  EXPECT_EQ(cells([](auto& shape) { shape.point[0][0] = 4; }), "obstacle 1: cell 2 of 2") << "behind the last one";
  EXPECT_EQ(cells([](auto& shape) { shape.point[0][0] = 3; }), "");
  for (const std::size_t i : {0u, 1u}) {
    EXPECT_THAT(why([&](Pieces& pieces) { pieces[i].velocity[0] = 1; }), HasSubstr("no velocity"));
    EXPECT_THAT(why([&](Pieces& pieces) { pieces[i].uncertainty = 1; }), HasSubstr("no growth"));
    EXPECT_THAT(why([&](Pieces& pieces) { pieces[i].track = 99, pieces[i].until_utime = kNow, pieces[i].gone = 1; }),
                HasSubstr("no window"));
  }
  EXPECT_THAT(Thrown<std::invalid_argument>([&] { (void)FromMessage(ToPieces({kOneByTwo}, kNow), kNow, 3); }),
              HasSubstr("dimension 2, must be 3"));
}

// ---- Predictions.

// One piece that stands in its window.
obstacle_t Piece(std::int64_t from, std::int64_t until, std::int64_t track = 7) {
  obstacle_t piece = ToMessage({kCircle}, kNow).obstacle[0];
  piece.track = track;
  piece.from_utime = from;
  piece.until_utime = until;
  return piece;
}

obstacle_t Gone(obstacle_t piece) {
  piece.gone = 1;
  return piece;
}

obstacles_t Of(const std::vector<obstacle_t>& pieces, std::int64_t utime = kNow) {
  obstacles_t message{.utime = utime, .num_obstacles = static_cast<std::int16_t>(pieces.size())};
  std::ranges::copy(pieces, message.obstacle);
  return message;
}

std::vector<Obstacle> Taken(const std::vector<obstacle_t>& pieces, std::int64_t utime = kNow) {
  return FromMessage(*Decoded<obstacles_t>(Encode(Of(pieces, utime))), 2);
}

std::string WhyRefused(const obstacles_t& message) {
  return Thrown<std::invalid_argument>([&] { (void)FromMessage(message, 2); });
}
std::string WhyRefused(const std::vector<obstacle_t>& pieces) { return WhyRefused(Of(pieces)); }

std::pair<std::int64_t, std::int64_t> WindowOf(const Obstacle& obstacle) {
  if (!obstacle.motion()) return {-ObstacleMotion::kAlways, ObstacleMotion::kAlways};
  return {obstacle.motion()->from_us, obstacle.motion()->until_us};
}
constexpr std::int64_t kBegin = -ObstacleMotion::kAlways, kEnd = ObstacleMotion::kAlways;

TEST(ObstaclesTest, APieceWithoutMotionStandsAtAllTimes) {
  for (const std::int64_t from : {kLeast, kBegin, std::int64_t{0}, kNow})
    for (const std::int64_t until : {kNow, kNow + 1, kMost}) {
      const std::vector<Obstacle> taken = Taken({Piece(from, until)});
      EXPECT_FALSE(taken[0].motion()) << from << " " << until;
      EXPECT_EQ(ObstaclesDigest(taken), ObstaclesDigest({kCircle}));
    }
  EXPECT_TRUE(Taken({Gone(Piece(0, kNow))})[0].motion());
  EXPECT_FALSE(Taken({Gone(Piece(0, kMost))})[0].motion()) << "it is gone after all times";
}

TEST(ObstaclesTest, APieceMovesIfAnyNumberOfItsMotionIsNotZero) {
  for (const auto& change : std::vector<std::function<void(obstacle_t&)>>{
           [](auto& piece) { piece.velocity[0] = 1e-300; }, [](auto& piece) { piece.velocity[1] = -1; },
           [](auto& piece) { piece.uncertainty = 0.1; }, [](auto& piece) { piece.growth = 0.2; },
           [](auto& piece) { piece.growth_rate = 0.3; }}) {
    obstacle_t piece = Piece(0, kMost);
    change(piece);
    const std::vector<Obstacle> taken = Taken({piece});
    ASSERT_TRUE(taken[0].motion());
    EXPECT_FIELDS(*taken[0].motion(), (velocity, Eigen::Vector3d(piece.velocity[0], piece.velocity[1], 0)),
                  (uncertainty, piece.uncertainty), (growth, piece.growth), (growth_rate, piece.growth_rate),
                  (stamp_us, kNow));
  }
  obstacle_t third = Piece(0, kMost);
  third.velocity[2] = 5;
  EXPECT_FALSE(Taken({third})[0].motion()) << "entries beyond the dimension are not read";
}

TEST(ObstaclesTest, ATrackExtendsBackToTheBeginningOfTime) {
  EXPECT_EQ(WindowOf(Taken({Gone(Piece(kNow, kNow + 5))})[0]), std::pair(kBegin, kNow + 5));
  EXPECT_THAT(WhyRefused({Piece(kNow + 1, kMost)}),
              HasSubstr("track 7 begins at 1700000000000001 us, after the message of 1700000000000000 us"));
  EXPECT_NE(WhyRefused({Piece(kMost, kMost)}), "");
}

TEST(ObstaclesTest, ThePiecesOfATrackHaveToJoin) {
  const obstacle_t first = Piece(kNow - 10, kNow + 10), second = Piece(kNow + 10, kNow + 20),
                   third = Piece(kNow + 15, kNow + 30);
  const std::vector<Obstacle> taken = Taken({third, first, second});
  ASSERT_EQ(taken.size(), 3u);
  EXPECT_EQ(WindowOf(taken[0]), std::pair(kNow + 15, kEnd)) << "in the order of the message";
  EXPECT_EQ(WindowOf(taken[1]), std::pair(kBegin, kNow + 10));
  EXPECT_EQ(WindowOf(taken[2]), std::pair(kNow + 10, kNow + 20));
  EXPECT_EQ(WindowOf(Taken({first, second, Gone(third)})[2]), std::pair(kNow + 15, kNow + 30));

  EXPECT_THAT(WhyRefused({first, Piece(kNow + 11, kMost)}),
              HasSubstr("track 7 is nowhere between 1700000000000010 us and 1700000000000011 us"));
  EXPECT_EQ(WhyRefused({first, Piece(kNow, kMost, 8)}), "") << "of another track";
  EXPECT_THAT(WhyRefused({first, Piece(kNow + 10, kMost, 8)}), HasSubstr("track 8 begins at"));
  EXPECT_EQ(WhyRefused({Piece(kNow, kNow + 30), Piece(kNow + 5, kNow + 6), Piece(kNow + 30, kNow + 31)}), "")
      << "the window in the middle lies in the first";
}

TEST(ObstaclesTest, OnlyTheLastPieceOfATrackMayBeGone) {
  const obstacle_t first = Piece(kNow, kNow + 10), last = Piece(kNow + 10, kNow + 20);
  EXPECT_THAT(WhyRefused({Gone(first), last}),
              HasSubstr("track 7 is gone at 1700000000000010 us and goes on until 1700000000000020 us"));
  EXPECT_THAT(WhyRefused({first, last, Gone(last)}), HasSubstr("only one of them is gone"));
  EXPECT_THAT(WhyRefused({Gone(last), first, last}), HasSubstr("only one of them is gone"));
  EXPECT_EQ(WhyRefused({first, Gone(last), Gone(last)}), "");
  for (const Obstacle& obstacle : Taken({Piece(kNow, kNow + 20), first, last}))
    if (WindowOf(obstacle).second != kNow + 10)
      EXPECT_EQ(WindowOf(obstacle).second, kEnd) << "both that end last go on";
}

TEST(ObstaclesTest, WindowsFlagsAndNumbersOutOfTheirBoundsAreRefused) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  const auto refused = [](const std::string& why, const std::function<void(obstacle_t&)>& change) {
    obstacles_t message = Of({Piece(0, kMost, 1), Piece(0, kMost, 2)});
    change(message.obstacle[1]);
    EXPECT_THAT(WhyRefused(message), HasSubstr("obstacle 1: " + why));
  };
  refused("track 2: the window from 5 us until 4 us is empty", [](auto& piece) {
    piece.from_utime = 5;
    piece.until_utime = 4;
  });
  refused("track 2: the window", [](auto& piece) {
    piece.from_utime = kMost;
    piece.until_utime = kLeast;
  });
  for (const std::int16_t gone : std::initializer_list<std::int16_t>{-1, 2, 32767})
    refused("gone " + std::to_string(gone), [gone](auto& piece) { piece.gone = gone; });
  for (const double bad : {kNaN, kInf, -kInf}) {
    refused("motion: velocity", [bad](auto& piece) { piece.velocity[0] = bad; });
    refused("motion: velocity", [bad](auto& piece) { piece.velocity[1] = bad; });
  }
  for (const double bad : {kNaN, kInf, -kInf, -1.0, -1e-300}) {
    refused("motion: uncertainty", [bad](auto& piece) { piece.uncertainty = bad; });
    refused("motion: growth ", [bad](auto& piece) { piece.growth = bad; });
    refused("motion: growth_rate", [bad](auto& piece) { piece.growth_rate = bad; });
  }
  const auto at = [](std::int64_t stamp) {
    return [stamp](auto& piece) {
      piece.utime = stamp;
      piece.growth = 1;
    };
  };
  for (const std::int64_t stamp :
       {kNow + kFarthestStampUs + 1, kNow - kFarthestStampUs - 1, kMost, kLeast, std::int64_t{0}})
    refused("stamped", at(stamp));
  obstacle_t stands = Piece(0, kMost);
  stands.utime = 0;
  EXPECT_FALSE(Taken({stands})[0].motion()) << "the stamp of what stands says nothing";
  for (const std::int64_t away : {kFarthestStampUs, -kFarthestStampUs}) {
    obstacle_t piece = Piece(0, kMost);
    piece.utime += away;
    piece.growth = 1;
    EXPECT_EQ(Taken({piece})[0].motion()->stamp_us, kNow + away);
  }
  refused("unknown kind", [](auto& piece) { piece.shape.kind = 9; });
  refused("dimension 1, must be 2", [](auto& piece) {
    piece.shape.kind = obstacle_shape_t::HALF_SPACE;
    piece.shape.dimension = 1;
  });
  for (const std::int16_t count : std::initializer_list<std::int16_t>{-1, 65, 32767}) {
    obstacles_t message = Of({Piece(0, kMost)});
    message.num_obstacles = count;
    EXPECT_THAT(WhyRefused(message), HasSubstr(std::to_string(count) + ", must be 0 to 64"));
  }
}

TEST(ObstaclesTest, StampsOfAMessageBeyondASchedulesAreRefusedOrTaken) {
  for (const std::int64_t sign : {1, -1})
    for (const std::int64_t beyond : {0, 1}) {
      obstacle_t piece = Piece(kLeast, kMost);
      piece.utime = sign * (Schedule::kLatest + beyond);
      piece.growth = 1;
      EXPECT_EQ(WhyRefused(Of({piece}, piece.utime)).empty(), beyond == 0);
    }
  for (const std::int64_t utime : {kMost, kLeast}) {
    obstacle_t piece = Piece(kLeast, kMost);
    piece.utime = utime;
    EXPECT_EQ(WhyRefused(Of({piece}, utime)), "") << "it stands";
    piece.growth = 1;
    EXPECT_NE(WhyRefused(Of({piece}, utime)), "");
  }
}

TEST(ObstaclesTest, PredictionsGoThroughTheBus) {
  ObstacleMotion first, second;
  first.stamp_us = kNow;
  first.velocity = {1, -2, 0};
  first.uncertainty = 0.1;
  first.growth = 0.2;
  first.growth_rate = 0.3;
  first.until_us = kNow + 1000;
  second = first;
  second.from_us = kNow + 1000;
  second.until_us = kNow + 2000;
  const std::vector<Obstacle> obstacles{kCircle, kCircle.Moving(first), kCircle.Moving(second), kCircle.Moving(first)};
  const obstacles_t message = ToMessage(obstacles, kNow);
  EXPECT_EQ(message.obstacle[1].track, message.obstacle[2].track);
  EXPECT_NE(message.obstacle[2].track, message.obstacle[3].track);
  EXPECT_NE(message.obstacle[0].track, message.obstacle[1].track);
  EXPECT_FIELDS(message, (obstacle[1].gone, 0), (obstacle[2].gone, 1), (obstacle[3].gone, 1));
  EXPECT_EQ(ObstaclesDigest(FromMessage(*Decoded<obstacles_t>(Encode(message)), 2)), ObstaclesDigest(obstacles));
  const std::vector<std::int64_t> tracks{4, 3, 3, 1};
  EXPECT_FIELDS(ToMessage(obstacles, kNow, tracks), (obstacle[2].track, 3), (obstacle[1].gone, 0));
}

// Whatever is taken, every track is somewhere at all times from the message on, until it is gone.
TEST(ObstaclesTest, RandomWindowsLeaveNoGap) {
  FreshRandom random;
  const auto below = [&](int n) { return static_cast<std::int64_t>(random() % static_cast<unsigned>(n)); };
  int taken = 0, refused = 0;
  for (int trial = 0; trial < 20'000; ++trial) {
    std::vector<obstacle_t> pieces;
    for (std::int64_t i = 1 + below(4); i > 0; --i) {
      const std::int64_t from = kNow - 2 + below(8);
      obstacle_t piece = Piece(from, from + below(5), below(2));
      piece.gone = static_cast<std::int16_t>(below(4) == 0);
      pieces.push_back(piece);
    }
    const obstacles_t message = Of(pieces);
    if (!WhyRefused(message).empty()) {
      ++refused;
      continue;
    }
    ++taken;
    const std::vector<Obstacle> obstacles = FromMessage(message, 2);
    for (std::int64_t track = 0; track < 2; ++track) {
      std::int64_t gone_at = kMost;
      bool is_there = false;
      for (const obstacle_t& piece : pieces) {
        if (piece.track != track) continue;
        is_there = true;
        if (piece.gone != 0) gone_at = piece.until_utime;
      }
      for (std::int64_t half = 2 * (kNow - 4); is_there && half <= 2 * std::min(kNow + 20, gone_at); ++half) {
        bool covered = false;  // half microseconds: between two times, too
        for (std::size_t i = 0; i < pieces.size(); ++i) {
          const auto [from, until] = WindowOf(obstacles[i]);
          covered |=
              pieces[i].track == track && (from == kBegin || 2 * from <= half) && (until == kEnd || half <= 2 * until);
        }
        ASSERT_TRUE(covered) << "track " << track << " at " << half << "/2 us";
      }
    }
  }
  EXPECT_GT(taken, 1000);
  EXPECT_GT(refused, 1000);
}

}  // namespace forereach::obstacle_message_test
