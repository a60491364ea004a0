#include "certifier/gate/obstacle_sender.h"

#include <algorithm>
#include <set>
#include <stdexcept>

#include <fmt/format.h>

#include "certifier/gate/obstacle_message.h"
#include "certifier/gate/stamp.h"
#include "forereach/numerics/limits.h"
#include "task/canonical.h"
#include "task/most_obstacles.h"

namespace forereach {
namespace {

void RequireRoom(std::size_t count) {
  if (count > kMostObstacles)
    throw std::invalid_argument(fmt::format("{} obstacles, at most {} can be sent", count, kMostObstacles));
}

void RequireRoomForGrids(const std::vector<Obstacle>& obstacles) {
  GridRoom room;
  for (std::size_t i = 0; i < obstacles.size(); ++i)
    if (obstacles[i].grid() && !room.Take(obstacles[i]))
      throw std::invalid_argument(
          fmt::format("obstacle {}: up to {} grids with {} cells and {} rectangles in all can be sent", i,
                      GridRoom::kMostGrids, GridRoom::kMostCells, GridRoom::kMostBlocks));
}

}  // namespace

std::int64_t ObstacleSender::PeriodUs(const GateOptions& options) {
  // Three messages in a row may be lost before the obstacles are unknown.
  return std::max<std::int64_t>(Microseconds(options.obstacles_timeout_ms) / 4, 1);
}

ObstacleSender::ObstacleSender(std::int64_t period_us) : period_us_(period_us) {
  if (period_us <= 0) throw std::invalid_argument(fmt::format("period {} us, must be positive", period_us));
}

void ObstacleSender::Set(const std::vector<Obstacle>& obstacles, const std::vector<std::int64_t>& tracks) {
  if (!tracks.empty() && tracks.size() != obstacles.size())
    throw std::invalid_argument(fmt::format("{} tracks of {} obstacles", tracks.size(), obstacles.size()));
  const Digest digest = ObstaclesDigest(obstacles);
  if (content_ && digest == content_->digest && tracks == content_->tracks) return;
  RequireRoomForGrids(obstacles);
  const std::vector<obstacle_t> all = ToPieces(obstacles, 0, tracks);  // no stamp, so what stands stays the same
  RequireRoom(all.size());
  std::vector<ObstaclePart> before;
  if (content_ && content_->num_pieces == all.size()) before = std::move(content_->parts);
  content_ = {obstacles, tracks, digest, all.size(), {}};
  if (all.size() > kMaxObstacles) {
    std::vector<Digest> digests;
    for (std::size_t i = 0; i < all.size(); i += kMaxObstacles)
      digests.push_back(
          content_->parts.emplace_back(std::span(all).subspan(i, std::min<std::size_t>(kMaxObstacles, all.size() - i)))
              .digest);
    content_->set_digest = SetDigestOf(digests);
  }
  FindChanged(before);
  last_us_.reset();
}

// What still waits goes first: no part waits for ever behind one that changes again and again.
void ObstacleSender::FindChanged(const std::vector<ObstaclePart>& before) {
  const auto& parts = content_->parts;
  if (before.size() != parts.size()) changed_ = again_ = {};
  for (std::size_t i = 0; i < parts.size(); ++i)
    if ((before.size() != parts.size() || parts[i].digest != before[i].digest) &&
        std::ranges::find(changed_, i) == changed_.end())
      changed_.push_back(i);
}

std::size_t ObstacleSender::NextPart() {
  if (changed_.empty() && again_.empty()) return next_part_++ % content_->parts.size();
  std::deque<std::size_t>& from = changed_.empty() ? again_ : changed_;
  const std::size_t part = from.front();
  from.pop_front();
  // A part that has changed is sent twice, since one datagram may be lost.
  if (&from == &changed_) again_.push_back(part);
  return part;
}

std::int64_t ObstacleSender::Interval() const {
  if (content_->parts.empty()) return period_us_;
  const std::int64_t each = std::max<std::int64_t>(period_us_ / kPartsEachPeriod, 1);
  return changed_.empty() && again_.empty() ? each : std::min(kBurstUs, each);
}

std::optional<obstacles_t> ObstacleSender::Due(std::int64_t now_us) {
  // A clock that was set back must not silence the sender: then it is due at once.
  if (!content_ || (last_us_ && *last_us_ <= now_us && now_us < *last_us_ + Interval())) return std::nullopt;
  last_us_ = now_us;
  obstacles_t due{};
  if (content_->parts.empty()) {
    due = ToMessage(content_->obstacles, now_us, content_->tracks);
  } else {
    const std::size_t i = NextPart();
    const std::vector<obstacle_t>& part = content_->parts[i].obstacles;
    due.utime = now_us;
    due.set_size = static_cast<std::int16_t>(content_->num_pieces);
    due.first = static_cast<std::int16_t>(i * kMaxObstacles);
    due.num_obstacles = static_cast<std::int16_t>(part.size());
    SetDigest(due.set_digest, content_->set_digest);
    std::ranges::copy(part, due.obstacle);
  }
  due.sequence = sequence_++;
  return due;
}

void ObstaclesOfFile::Set(std::int64_t begin_us, const std::vector<Obstacle>& obstacles) {
  obstacles_ = BegunAt(begin_us, obstacles);
  same_until_us_ = same_from_us_;
}

std::optional<obstacles_t> ObstaclesOfFile::Due(std::int64_t now_us) {
  if (obstacles_ && !(same_from_us_ <= now_us && now_us < same_until_us_)) {
    sender_.Set(SeenBy(now_us, *obstacles_));
    same_from_us_ = now_us;
    same_until_us_ = ObstacleMotion::kAlways;
    for (const Obstacle& obstacle : *obstacles_)
      if (obstacle.motion() && obstacle.motion()->from_us > now_us)
        same_until_us_ = std::min(same_until_us_, obstacle.motion()->from_us);
  }
  return sender_.Due(now_us);
}

std::vector<Obstacle> BegunAt(std::int64_t begin_us, const std::vector<Obstacle>& obstacles) {
  std::vector<Obstacle> begun;
  GridRoom room;
  for (const Obstacle& obstacle : obstacles) {
    // A map for which there is no room is sent as its rectangles.
    if (obstacle.grid() && room.Take(obstacle)) {
      begun.push_back(obstacle);
      continue;
    }
    if (!obstacle.motion()) {
      for (const Obstacle& convex : obstacle.convex()) begun.push_back(convex.Named(obstacle.name()));
      continue;
    }
    ObstacleMotion motion = *obstacle.motion();
    motion.stamp_us += begin_us;
    if (motion.from_us != -ObstacleMotion::kAlways) motion.from_us += begin_us;
    if (motion.until_us != ObstacleMotion::kAlways) motion.until_us += begin_us;
    begun.push_back(obstacle.Moving(motion));
  }
  return begun;
}

std::vector<Obstacle> SeenBy(std::int64_t now_us, const std::vector<Obstacle>& obstacles) {
  std::vector<Obstacle> seen;
  bool is_seen = true;
  for (std::size_t i = 0; i < obstacles.size(); ++i) {
    const auto& motion = obstacles[i].motion();
    if (i == 0 || !Continues(obstacles[i], obstacles[i - 1])) is_seen = !motion || motion->from_us <= now_us;
    if (is_seen) seen.push_back(obstacles[i]);
  }
  return seen;
}

void RequireSendable(const Config& config) try {
  // What is sent changes at these times only, so a set that fits at each of them fits always.
  std::set<std::int64_t> changes{0};
  for (const Obstacle& obstacle : config.obstacles)
    if (obstacle.motion()) changes.insert(std::max<std::int64_t>(obstacle.motion()->from_us, 0));
  for (const std::int64_t time_us : changes) {
    const std::vector<Obstacle> seen = SeenBy(time_us, BegunAt(0, config.obstacles));
    const std::vector<obstacle_t> pieces = ToPieces(seen, time_us);
    RequireRoom(pieces.size());
    static_cast<void>(FromMessage(pieces, time_us, static_cast<int>(config.problem->projection.rows()), seen));
  }
} catch (const std::invalid_argument& error) {
  throw ConfigError("{}: task.obstacles: {}", config.path, error.what());
}

}  // namespace forereach
