#include "certifier/gate/obstacle_sender.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include "certifier/gate/obstacle_message.h"
#include "certifier/gate/stamp.h"
#include "forereach/numerics/limits.h"
#include "task/canonical.h"

namespace forereach {
namespace {

void RequireRoom(std::size_t count) {
  if (count > kMaxObstacles)
    throw std::invalid_argument(fmt::format("{} obstacles, at most {} fit into a message", count, kMaxObstacles));
}

}  // namespace

std::int64_t ObstacleSender::PeriodUs(const GateOptions& options) {
  return std::max<std::int64_t>(Microseconds(options.obstacles_timeout_ms) / 4, 1);
}

ObstacleSender::ObstacleSender(std::int64_t period_us) : period_us_(period_us) {
  if (period_us <= 0) throw std::invalid_argument(fmt::format("period {} us, must be positive", period_us));
}

void ObstacleSender::Set(const std::vector<Obstacle>& obstacles, const std::vector<std::int64_t>& tracks) {
  RequireRoom(obstacles.size());
  if (!tracks.empty() && tracks.size() != obstacles.size())
    throw std::invalid_argument(fmt::format("{} tracks of {} obstacles", tracks.size(), obstacles.size()));
  const Digest digest = ObstaclesDigest(obstacles);
  if (content_ && digest == content_->digest && tracks == content_->tracks) return;
  content_ = {obstacles, tracks, digest};
  last_us_.reset();
}

std::optional<obstacles_t> ObstacleSender::Due(std::int64_t now_us) {
  if (!content_ || (last_us_ && *last_us_ <= now_us && now_us < *last_us_ + period_us_)) return std::nullopt;
  last_us_ = now_us;
  obstacles_t due = ToMessage(content_->obstacles, now_us, content_->tracks);
  due.sequence = sequence_++;
  return due;
}

std::vector<Obstacle> BegunAt(std::int64_t begin_us, const std::vector<Obstacle>& obstacles) {
  std::vector<Obstacle> begun;
  for (const Obstacle& obstacle : obstacles) {
    if (!obstacle.motion()) {
      begun.push_back(obstacle);
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
  std::set<std::int64_t> changes{0};
  for (const Obstacle& obstacle : config.obstacles)
    if (obstacle.motion()) changes.insert(std::max<std::int64_t>(obstacle.motion()->from_us, 0));
  for (const std::int64_t time_us : changes) {
    const std::vector<Obstacle> seen = SeenBy(time_us, config.obstacles);
    RequireRoom(seen.size());
    static_cast<void>(FromMessage(ToMessage(seen, time_us), static_cast<int>(config.problem->projection.rows())));
  }
} catch (const std::invalid_argument& error) {
  throw ConfigError(config.path + ": task.obstacles: " + error.what());
}

}  // namespace forereach
