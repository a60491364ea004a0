/** The sending side of OBSTACLES, for a perception program. It repeats the whole set, so that receivers know that
perception is running. It uses no bus and no clock:

    ObstacleSender sender(ObstacleSender::PeriodUs(config.gate));
    sender.Set(obstacles);                                                  // after each change
    if (const auto message = sender.Due(now_us)) bus.Publish("OBSTACLES", *message);  // at least every period

A bus has one sender. A restarted sender begins at sequence 0, which receivers accept with a later stamp. */
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "certifier/safety/obstacle.h"
#include "certifier/task/gate_options.h"
#include "forereach/obstacles_t.hpp"

namespace forereach {

class ObstacleSender final {
 public:
  /** The period at which receivers of this task tolerate two consecutive lost messages: a quarter of
  gate.obstacles_timeout_ms, in microseconds. */
  [[nodiscard]] static std::int64_t PeriodUs(const GateOptions& options);

  /** @param period_us time from one message to the next, positive; at most a third of the receivers' timeout. */
  explicit ObstacleSender(std::int64_t period_us);

  /** Sets all obstacles. If they differ from the last ones, the next message is due at once.
  @throws std::invalid_argument for more than kMaxObstacles. */
  void Set(const std::vector<Obstacle>& obstacles);

  /** The next message, if it is due, with the stamp `now_us` in microseconds since the Unix epoch. Nothing before the
  first Set. A clock that is set back does not delay a message. */
  [[nodiscard]] std::optional<obstacles_t> Due(std::int64_t now_us);

 private:
  const std::int64_t period_us_;
  std::optional<obstacles_t> message_;   // the next
  std::optional<std::int64_t> last_us_;  // nothing: due at once
};

}  // namespace forereach
