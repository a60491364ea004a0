#include "certifier/gate/obstacle_message.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include "forereach/numerics/size.h"
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
      Refuse("begins at " + At(begin) + ", after the message of " + At(stamp));
    std::int64_t covered = pieces_.front()->until_utime;
    for (const obstacle_t* piece : pieces_) {
      // Silence about a time must not mean that the obstacle is elsewhere (docs/decisions.md).
      if (piece->from_utime > covered) Refuse("is nowhere between " + At(covered) + " and " + At(piece->from_utime));
      covered = std::max(covered, piece->until_utime);
      if (ends_ && piece->until_utime == end_ && piece->gone == 0)
        Refuse("has two pieces that end at " + At(end_) + ", and only one of them is gone");
      if (piece->gone != 0 && piece->until_utime != end_)
        Refuse("is gone at " + At(piece->until_utime) + " and goes on until " + At(end_));
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

Obstacle FromMessage(const obstacle_t& piece, std::int64_t stamp, const std::map<std::int64_t, Track>& tracks) {
  const Obstacle shape = FromMessage(piece.shape).Named(GetText(piece.name));
  const ObstacleMotion motion = MotionOf(piece, tracks.at(piece.track));
  const bool stands = motion.velocity.isZero(0) && motion.growth == 0 && motion.growth_rate == 0;
  const std::string why = stands ? "" : WhyNotFresh(piece.utime, stamp, kFarthestStampUs, kFarthestStampUs);
  if (!why.empty()) throw std::invalid_argument(why + ", from its message");
  ObstacleMotion standing;
  standing.stamp_us = motion.stamp_us;
  return motion == standing ? shape : shape.Moving(motion);
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

std::vector<Obstacle> FromMessage(std::span<const obstacle_t> pieces, std::int64_t stamp, int dim) {
  ForEach(pieces, RequireWindow);
  const std::map<std::int64_t, Track> tracks = TracksOf(pieces, stamp);
  std::vector<Obstacle> obstacles;
  ForEach(pieces,
          [&](const obstacle_t& piece) { obstacles.push_back(OfDimension(dim, FromMessage(piece, stamp, tracks))); });
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

std::vector<obstacle_t> ToPieces(const std::vector<Obstacle>& obstacles, std::int64_t utime,
                                 std::span<const std::int64_t> tracks) {
  std::vector<obstacle_t> pieces(obstacles.size());
  std::map<std::int64_t, std::int64_t> ends;  // of the tracks
  std::int64_t track = -1;
  for (std::size_t i = 0; i < obstacles.size(); ++i) {
    ObstacleMotion motion;
    motion.stamp_us = utime;
    motion = obstacles[i].motion().value_or(motion);
    if (i == 0 || !Continues(obstacles[i], obstacles[i - 1])) track = static_cast<std::int64_t>(i);
    obstacle_t& to = pieces[i];
    to.shape = ShapeOf(obstacles[i]);
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
  }
  for (obstacle_t& piece : pieces)
    piece.gone = piece.until_utime == ends.at(piece.track) && piece.until_utime != ObstacleMotion::kAlways;
  return pieces;
}

obstacles_t ToMessage(const std::vector<Obstacle>& obstacles, std::int64_t utime,
                      std::span<const std::int64_t> tracks) {
  obstacles_t message{};
  message.utime = utime;
  message.num_obstacles = static_cast<std::int16_t>(obstacles.size());
  std::ranges::copy(ToPieces(obstacles, utime, tracks), message.obstacle);
  return message;
}

}  // namespace forereach
