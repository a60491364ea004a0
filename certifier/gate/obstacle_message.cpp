#include "certifier/gate/obstacle_message.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include "forereach/numerics/size.h"
#include "forereach/safety/occupancy_grid.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/freshness.h"

namespace forereach {
namespace {

Eigen::VectorXd Point(const obstacle_shape_t& message, int index) {
  return Eigen::Map<const Eigen::VectorXd>(message.point[index], message.dimension);
}

void RequirePoints(const obstacle_shape_t& message, int count) {
  if (message.num_points != count)
    throw std::invalid_argument(fmt::format("{} points, must be {}", message.num_points, count));
}

Obstacle FromMessage(const obstacle_shape_t& message) {
  if (message.dimension < 1 || message.dimension > kMaxSafetyDim || message.num_points < 1 ||
      message.num_points > kMaxObstaclePoints)
    throw std::invalid_argument(fmt::format("{} points of dimension {}", message.num_points, message.dimension));
  switch (message.kind) {
    case obstacle_shape_t::CIRCLE: RequirePoints(message, 1); return Obstacle::Circle(Point(message, 0), message.value);
    case obstacle_shape_t::BOX:
      RequirePoints(message, 2);
      return Obstacle::AxisBox(Point(message, 0), Point(message, 1));
    case obstacle_shape_t::POLYGON: {
      std::vector<Eigen::VectorXd> vertices;
      vertices.reserve(ToSize(message.num_points));
      for (int i = 0; i < message.num_points; ++i) vertices.push_back(Point(message, i));
      return Obstacle::Polygon(vertices);
    }
    case obstacle_shape_t::HALF_SPACE:
      RequirePoints(message, 1);
      return Obstacle::HalfSpace(Point(message, 0), message.value);
    default: throw std::invalid_argument(fmt::format("unknown kind {}", message.kind));
  }
}

std::string At(std::int64_t us) { return fmt::format("{} us", us); }

// The pieces of one track, in the order of their windows.
class Track final {
 public:
  Track(std::int64_t number, std::vector<const obstacle_t*> pieces) : number_(number), pieces_(std::move(pieces)) {
    std::ranges::stable_sort(pieces_, {}, &obstacle_t::from_utime);
    for (const obstacle_t* piece : pieces_) end_ = std::max(end_, piece->until_utime);
    ends_ = std::ranges::any_of(pieces_, [&](const obstacle_t* piece) { return piece->gone != 0; });
  }

  // @throws std::invalid_argument if the windows do not cover all times from the stamp of the message on.
  void RequireCover(std::int64_t stamp) const {
    if (const std::int64_t begin = pieces_.front()->from_utime; begin > stamp)
      Refuse(fmt::format("begins at {}, after the message of {}", At(begin), At(stamp)));
    std::int64_t covered = pieces_.front()->until_utime;
    for (const obstacle_t* piece : pieces_) {
      // Silence about a time must not mean that the obstacle is elsewhere (docs/decisions.md).
      if (piece->from_utime > covered)
        Refuse(fmt::format("is nowhere between {} and {}", At(covered), At(piece->from_utime)));
      covered = std::max(covered, piece->until_utime);
      if (ends_ && piece->until_utime == end_ && piece->gone == 0)
        Refuse(fmt::format("has two pieces that end at {}, and only one of them is gone", At(end_)));
      if (piece->gone != 0 && piece->until_utime != end_)
        Refuse(fmt::format("is gone at {} and goes on until {}", At(piece->until_utime), At(end_)));
    }
  }

  [[nodiscard]] bool BeginsWith(const obstacle_t& piece) const {
    return piece.from_utime == pieces_.front()->from_utime;
  }
  [[nodiscard]] bool GoesOnAfter(const obstacle_t& piece) const { return !ends_ && piece.until_utime == end_; }

 private:
  [[noreturn]] void Refuse(const std::string& why) const {
    throw std::invalid_argument(fmt::format("track {} {}", number_, why));
  }

  std::int64_t number_;
  std::vector<const obstacle_t*> pieces_;
  std::int64_t end_ = INT64_MIN;
  bool ends_;
};

std::map<std::int64_t, Track> TracksOf(std::span<const obstacle_t> all, std::int64_t stamp) {
  std::map<std::int64_t, std::vector<const obstacle_t*>> pieces;
  for (const obstacle_t& piece : all) pieces[piece.track].push_back(&piece);
  std::map<std::int64_t, Track> tracks;
  for (auto& [number, of_track] : pieces) {
    const Track& track = tracks.emplace(number, Track(number, std::move(of_track))).first->second;
    track.RequireCover(stamp);
  }
  return tracks;
}

ObstacleMotion MotionOf(const obstacle_t& piece, const Track& track) {
  ObstacleMotion motion;
  motion.stamp_us = piece.utime;
  for (int k = 0; k < piece.shape.dimension; ++k) motion.velocity[k] = piece.velocity[k];
  motion.uncertainty = piece.uncertainty;
  motion.growth = piece.growth;
  motion.growth_rate = piece.growth_rate;
  // A track has no beginning and, unless it is gone, no end: what is not said of a time is not free.
  motion.from_us =
      track.BeginsWith(piece) ? -ObstacleMotion::kAlways : std::max(piece.from_utime, -ObstacleMotion::kAlways);
  motion.until_us = track.GoesOnAfter(piece) ? ObstacleMotion::kAlways : piece.until_utime;
  return motion;
}

ObstacleMotion StandsSince(std::int64_t stamp_us) {
  ObstacleMotion standing;
  standing.stamp_us = stamp_us;
  return standing;
}

// ---- Grids

// Of a CELLS piece: its numbers are whole and below 2^48, so each has 48 cells as bits, and none of them is NaN.
constexpr int kBitsOfNumber = 48, kNumbersOfPiece = kMaxObstaclePoints * kMaxSafetyDim,
              kCellsOfPiece = kBitsOfNumber * kNumbersOfPiece;

std::int64_t Whole(const char* what, double value, std::int64_t most) {
  if (!(0 <= value && value <= static_cast<double>(most)) || value != std::floor(value))
    throw std::invalid_argument(fmt::format("{} {}, must be a whole number up to {}", what, value, most));
  return static_cast<std::int64_t>(value);
}

void SetPoint(obstacle_shape_t& shape, int index, double x, double y) {
  shape.point[index][0] = x;
  shape.point[index][1] = y;
}

// All that a grid has but its cells.
obstacle_shape_t ShapeOf(const GridMap& map) {
  obstacle_shape_t shape{};
  shape.kind = obstacle_shape_t::GRID;
  shape.dimension = 2;
  shape.num_points = 3;
  shape.value = map.resolution;
  SetPoint(shape, 0, map.origin[0], map.origin[1]);
  SetPoint(shape, 1, map.width, map.height);
  SetPoint(shape, 2, map.yaw, map.outside_is_free ? 1 : 0);
  return shape;
}

GridMap GridOf(const obstacle_shape_t& shape) {
  RequirePoints(shape, 3);
  if (shape.dimension != 2) throw std::invalid_argument(fmt::format("dimension {}, a grid has 2", shape.dimension));
  const auto size = [&](int k) {
    return static_cast<int>(Whole("a grid's size", shape.point[1][k], GridRoom::kMostCells));
  };
  return {.resolution = shape.value,
          .origin = {shape.point[0][0], shape.point[0][1]},
          .yaw = shape.point[2][0],
          .width = size(0),
          .height = size(1),
          .outside_is_free = Whole("outside", shape.point[2][1], 1) == 1};
}

obstacle_shape_t CellsOf(const GridMap& map, std::size_t first) {
  obstacle_shape_t shape{};
  shape.kind = obstacle_shape_t::CELLS;
  shape.dimension = kMaxSafetyDim;
  shape.num_points = kMaxObstaclePoints;
  for (std::size_t i = first; i < std::min(first + kCellsOfPiece, map.occupied.size()); ++i)
    if (map.occupied[i]) {
      const auto place = static_cast<int>(i - first), number = place / kBitsOfNumber;
      shape.point[number / kMaxSafetyDim][number % kMaxSafetyDim] += std::ldexp(1, place % kBitsOfNumber);
    }
  return shape;
}

// Puts grids together, piece by piece.
class GridReader final {
 public:
  explicit GridReader(std::span<const Obstacle> known) : known_(known) {}

  // Whether the piece is of a grid. @throws std::invalid_argument if it is not of the grid that is under way.
  [[nodiscard]] bool Takes(const obstacle_shape_t& shape) {
    if (is_open() != (shape.kind == obstacle_shape_t::CELLS))
      throw std::invalid_argument(is_open() ? WhyOpen() : "cells without a grid before them");
    if (is_open())
      TakeCells(shape);
    else if (shape.kind == obstacle_shape_t::GRID)
      Begin(GridOf(shape));
    else
      return false;
    return true;
  }

  [[nodiscard]] bool is_open() const { return next_ < size_; }
  [[nodiscard]] std::string WhyOpen() const {
    return fmt::format("a grid of {} by {} cells has only {} of them", map_.width, map_.height, next_);
  }
  [[nodiscard]] Obstacle TakeGrid() {
    const auto same = std::ranges::find_if(
        known_, [&](const Obstacle& obstacle) { return obstacle.grid() && obstacle.grid()->map() == map_; });
    Obstacle grid =
        Obstacle::Grid(same != known_.end() ? same->grid() : std::make_shared<const OccupancyGrid>(std::move(map_)));
    if (!room_.Take(grid))
      throw std::invalid_argument(fmt::format("the grids of a set make {} rectangles at most", GridRoom::kMostBlocks));
    return grid;
  }

 private:
  void Begin(GridMap map) {
    map_ = std::move(map);
    const std::int64_t cells = std::int64_t{map_.width} * map_.height;
    if (cells < 1 || !room_.HasCells(cells))
      throw std::invalid_argument(fmt::format("a grid of {} by {} cells; a set has up to {} grids of 1 to {} in all",
                                              map_.width, map_.height, GridRoom::kMostGrids, GridRoom::kMostCells));
    next_ = 0;
    size_ = static_cast<std::size_t>(cells);
    map_.occupied.assign(size_, false);
  }

  void TakeCells(const obstacle_shape_t& shape) {
    if (shape.dimension != kMaxSafetyDim || shape.num_points != kMaxObstaclePoints)
      throw std::invalid_argument(fmt::format("cells in {} points of dimension {}, must be {} of {}", shape.num_points,
                                              shape.dimension, kMaxObstaclePoints, kMaxSafetyDim));
    for (int number = 0; number < kNumbersOfPiece; ++number) {
      const double value = shape.point[number / kMaxSafetyDim][number % kMaxSafetyDim];
      for (auto bits = Whole("cells", value, (std::int64_t{1} << kBitsOfNumber) - 1); bits != 0; bits &= bits - 1) {
        const std::size_t cell = next_ + ToSize(number * kBitsOfNumber + std::countr_zero(ToSize(bits)));
        if (cell >= size_) throw std::invalid_argument(fmt::format("cell {} of {}", cell, size_));
        map_.occupied[cell] = true;
      }
    }
    next_ = std::min(next_ + kCellsOfPiece, size_);
  }

  std::span<const Obstacle> known_;
  GridMap map_;
  std::size_t next_ = 0, size_ = 0;  // cells
  GridRoom room_;
};

Obstacle FromMessage(const obstacle_t& piece, std::int64_t stamp, const std::map<std::int64_t, Track>& tracks) {
  const Obstacle shape = FromMessage(piece.shape).Named(GetText(piece.name));
  const ObstacleMotion motion = MotionOf(piece, tracks.at(piece.track));
  const bool stands = motion.velocity.isZero(0) && motion.growth == 0 && motion.growth_rate == 0;
  const std::string why = stands ? "" : WhyNotFresh(piece.utime, stamp, kFarthestStampUs, kFarthestStampUs);
  if (!why.empty()) throw std::invalid_argument(fmt::format("{}, from its message", why));
  return motion == StandsSince(motion.stamp_us) ? shape : shape.Moving(motion);
}

void RequireStanding(const obstacle_t& piece, const Track& track) {
  if (MotionOf(piece, track) != StandsSince(piece.utime))
    throw std::invalid_argument("a grid has no window, no velocity and no growth");
}

// A piece without a window of time. The rules of a track compare windows, so this is checked before them.
void RequireWindow(const obstacle_t& piece) {
  if (piece.gone != 0 && piece.gone != 1)
    throw std::invalid_argument(fmt::format("gone {}, must be 0 or 1", piece.gone));
  if (piece.from_utime > piece.until_utime)
    throw std::invalid_argument(fmt::format("track {}: the window from {} until {} is empty", piece.track,
                                            At(piece.from_utime), At(piece.until_utime)));
}

// Calls of(piece) for each. @throws std::invalid_argument with the number that was refused.
template <class Of>
void ForEach(std::span<const obstacle_t> pieces, Of of) {
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    try {
      of(pieces[i]);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("obstacle {}: {}", i, error.what()));
    }
  }
}

void RequireCount(int count) {
  if (count < 0 || count > kMaxObstacles)
    throw std::invalid_argument(fmt::format("obstacles: {}, must be 0 to {}", count, kMaxObstacles));
}

Obstacle OfDimension(int dim, Obstacle obstacle) {
  if (obstacle.dim() != dim) throw std::invalid_argument(fmt::format("dimension {}, must be {}", obstacle.dim(), dim));
  return obstacle;
}

obstacle_shape_t ShapeOf(const Obstacle& from) {
  obstacle_shape_t to{};
  to.kind = static_cast<std::int16_t>(from.kind());
  to.dimension = static_cast<std::int16_t>(from.dim());
  to.num_points = static_cast<std::int16_t>(from.points().size());
  to.value = from.kind() == Obstacle::Kind::kHalfSpace ? from.offset() : from.radius();
  for (std::size_t p = 0; p < from.points().size(); ++p)
    for (Eigen::Index k = 0; k < from.points()[p].size(); ++k) to.point[p][k] = from.points()[p][k];
  return to;
}

}  // namespace

std::vector<Obstacle> FromMessage(std::span<const obstacle_t> pieces, std::int64_t stamp, int dim,
                                  std::span<const Obstacle> known) {
  ForEach(pieces, RequireWindow);
  const std::map<std::int64_t, Track> tracks = TracksOf(pieces, stamp);
  std::vector<Obstacle> obstacles;
  GridReader grids(known);
  std::string name;
  ForEach(pieces, [&](const obstacle_t& piece) {
    if (!grids.Takes(piece.shape)) return obstacles.push_back(OfDimension(dim, FromMessage(piece, stamp, tracks)));
    RequireStanding(piece, tracks.at(piece.track));
    if (piece.shape.kind == obstacle_shape_t::GRID) name = GetText(piece.name);
    if (!grids.is_open()) obstacles.push_back(OfDimension(dim, grids.TakeGrid().Named(name)));
  });
  if (grids.is_open()) throw std::invalid_argument(fmt::format("the last obstacle: {}", grids.WhyOpen()));
  return obstacles;
}

std::vector<Obstacle> FromMessage(const obstacles_t& message, int dim) {
  RequireCount(message.num_obstacles);
  return FromMessage(std::span(message.obstacle, ToSize(message.num_obstacles)), message.utime, dim);
}

bool Continues(const Obstacle& obstacle, const Obstacle& before) {
  return obstacle.motion() && before.motion() && obstacle.motion()->from_us != -ObstacleMotion::kAlways &&
         obstacle.motion()->from_us == before.motion()->until_us;
}

bool GridRoom::Take(const Obstacle& grid) {
  const std::int64_t cells = std::ssize(MapOf(grid).occupied), blocks = std::ssize(grid.grid()->blocks());
  if (!HasCells(cells) || blocks > kMostBlocks - blocks_) return false;
  ++grids_;
  cells_ += cells;
  blocks_ += blocks;
  return true;
}

std::vector<obstacle_t> ToPieces(const std::vector<Obstacle>& obstacles, std::int64_t utime,
                                 std::span<const std::int64_t> tracks) {
  std::vector<obstacle_t> pieces;
  std::map<std::int64_t, std::int64_t> ends;  // of the tracks
  std::int64_t track = -1;
  for (std::size_t i = 0; i < obstacles.size(); ++i) {
    const ObstacleMotion motion = obstacles[i].motion().value_or(StandsSince(utime));
    if (i == 0 || !Continues(obstacles[i], obstacles[i - 1])) track = static_cast<std::int64_t>(i);
    obstacle_t to{};
    to.shape = obstacles[i].grid() ? ShapeOf(MapOf(obstacles[i])) : ShapeOf(obstacles[i]);
    to.track = tracks.empty() ? track : tracks[i];
    to.utime = motion.stamp_us;
    to.from_utime = motion.from_us;
    to.until_utime = motion.until_us;
    std::ranges::copy(motion.velocity, to.velocity);
    to.uncertainty = motion.uncertainty;
    to.growth = motion.growth;
    to.growth_rate = motion.growth_rate;
    SetText(to.name, obstacles[i].name());
    std::int64_t& end = ends.try_emplace(to.track, to.until_utime).first->second;
    end = std::max(end, to.until_utime);
    pieces.push_back(to);
    if (!obstacles[i].grid()) continue;
    const GridMap& map = MapOf(obstacles[i]);
    for (std::size_t first = 0; first < map.occupied.size(); first += kCellsOfPiece) {
      to.shape = CellsOf(map, first);
      pieces.push_back(to);
    }
  }
  for (obstacle_t& piece : pieces)
    piece.gone = piece.until_utime == ends.at(piece.track) && piece.until_utime != ObstacleMotion::kAlways;
  return pieces;
}

obstacles_t ToMessage(const std::vector<Obstacle>& obstacles, std::int64_t utime,
                      std::span<const std::int64_t> tracks) {
  obstacles_t message{};
  message.utime = utime;
  const std::vector<obstacle_t> pieces = ToPieces(obstacles, utime, tracks);
  message.num_obstacles = static_cast<std::int16_t>(pieces.size());
  std::ranges::copy(pieces, message.obstacle);
  return message;
}

}  // namespace forereach
