/** For a program that sees obstacles: what to send on OBSTACLES, and when. It repeats the whole set, so that receivers
know that somebody looks. No bus, no clock in it:

    ObstacleSender sender(ObstacleSender::PeriodUs(config.gate));
    sender.Set(obstacles);                                                  // whenever they have changed
    if (const auto message = sender.Due(now_us)) bus.Publish("OBSTACLES", *message);  // at least every period

One sender for a bus. A sender that restarts begins at sequence 0, which receivers accept with a later stamp. */
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "certifier/safety/obstacle.h"
#include "certifier/task/config.h"
#include "forereach/obstacles_t.hpp"

namespace forereach {

class ObstacleSender final {
 public:
  /** At which receivers of this task lose nothing when two messages in a row are lost: a quarter of
  gate.obstacles_timeout_ms. */
  [[nodiscard]] static std::int64_t PeriodUs(const GateOptions& options);

  /** @param period_us from one message to the next, positive: at most a third of what receivers bear. */
  explicit ObstacleSender(std::int64_t period_us);

  /** All obstacles that are seen from now on. They are due at once if they differ from those before.
  @throws std::invalid_argument for more than kMaxObstacles. */
  void Set(const std::vector<Obstacle>& obstacles);

  /** The next message if it is time for it, stamped `now_us`: microseconds since the Unix epoch. Nothing before the
  first Set. A clock that was set back delays none. */
  [[nodiscard]] std::optional<obstacles_t> Due(std::int64_t now_us);

 private:
  const std::int64_t period_us_;
  std::optional<obstacles_t> message_;   // the next
  std::optional<std::int64_t> last_us_;  // nothing: due at once
};

}  // namespace forereach
