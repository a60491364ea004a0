#include "certifier/gate/obstacle_sender.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "certifier/gate/obstacle_message.h"
#include "certifier/gate/stamp.h"
#include "certifier/numerics/limits.h"
#include "certifier/task/canonical.h"

namespace forereach {

std::int64_t ObstacleSender::PeriodUs(const GateOptions& options) {
  return std::max<std::int64_t>(Microseconds(options.obstacles_timeout_ms) / 4, 1);
}

ObstacleSender::ObstacleSender(std::int64_t period_us) : period_us_(period_us) {
  if (period_us <= 0) throw std::invalid_argument("period " + std::to_string(period_us) + " us, must be positive");
}

void ObstacleSender::Set(const std::vector<Obstacle>& obstacles) {
  if (obstacles.size() > kMaxObstacles)
    throw std::invalid_argument("obstacles: " + std::to_string(obstacles.size()) + ", at most " +
                                std::to_string(kMaxObstacles) + " fit into a message");
  obstacles_t message = ToMessage(obstacles);
  if (message_) {
    message.utime = message_->utime;
    message.sequence = message_->sequence;
    if (Encode(message) == Encode(*message_)) return;
  }
  message_ = message;
  last_us_.reset();
}

std::optional<obstacles_t> ObstacleSender::Due(std::int64_t now_us) {
  if (!message_ || (last_us_ && *last_us_ <= now_us && now_us < *last_us_ + period_us_)) return std::nullopt;
  last_us_ = now_us;
  message_->utime = now_us;
  obstacles_t due = *message_;
  ++message_->sequence;
  return due;
}

}  // namespace forereach
