/** The sending side of OBSTACLES, for a perception program. It repeats the set as obstacles_t, so that receivers know
that perception is running. A set of more than kMaxObstacles is sent in parts (obstacle_set.h): after a change those
that changed, twice, then one after the other, each of which confirms the whole set. Parts are cut by the order of the
obstacles, so keep it, and put at the end what comes and goes: a set that changes faster than its changed parts are
sent, kBurstUs each, is never complete. It uses no bus and no clock:

    ObstacleSender sender(ObstacleSender::PeriodUs(config.gate));
    sender.Set(obstacles);                                                  // after each change
    if (const auto message = sender.Due(now_us)) bus.Publish("OBSTACLES", *message);  // at least every period

A bus has one sender. A restarted sender begins at sequence 0, which receivers accept with a later stamp. */
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "certifier/gate/obstacle_set.h"
#include "forereach/obstacles_t.hpp"
#include "forereach/safety/obstacle.h"
#include "lcmtypes/codec.h"
#include "task/config.h"
#include "task/gate_options.h"

namespace forereach {

class ObstacleSender final {
 public:
  /** The period at which receivers of this task tolerate two consecutive lost messages: a quarter of
  gate.obstacles_timeout_ms, in microseconds. */
  [[nodiscard]] static std::int64_t PeriodUs(const GateOptions& options);

  /** The time from one message to the next while changed parts are sent, and how many messages a period has of a set in
  parts. */
  static constexpr std::int64_t kBurstUs = 1000, kPartsEachPeriod = 4;

  /** @param period_us time from one message to the next, positive; at most a third of the receivers' timeout. */
  explicit ObstacleSender(std::int64_t period_us);

  /** Sets all obstacles. If they differ from the last ones, the next message is due at once. Motions have the times of
  the clock that Due is called with.
  @param tracks as of ToMessage, which also has the rules for tracks that receivers check.
  @throws std::invalid_argument for more than kMostObstacles pieces, grids without GridRoom, or tracks of another
  number. */
  void Set(const std::vector<Obstacle>& obstacles, const std::vector<std::int64_t>& tracks = {});

  /** The next message, if it is due, with the stamp `now_us` in microseconds since the Unix epoch. Nothing before the
  first Set. A clock that is set back does not delay a message. */
  [[nodiscard]] std::optional<obstacles_t> Due(std::int64_t now_us);

 private:
  struct Content {
    std::vector<Obstacle> obstacles;
    std::vector<std::int64_t> tracks;
    Digest digest;                    // of the obstacles
    std::size_t num_pieces;           // of ToPieces
    std::vector<ObstaclePart> parts;  // none: they are sent whole
    Digest set_digest{};
  };

  void FindChanged(const std::vector<ObstaclePart>& before);
  [[nodiscard]] std::size_t NextPart();
  [[nodiscard]] std::int64_t Interval() const;

  const std::int64_t period_us_;
  std::optional<Content> content_;
  std::deque<std::size_t> changed_, again_;  // parts to be sent next, and then
  std::size_t next_part_ = 0;                // after them
  std::int64_t sequence_ = 0;                // of the next message
  std::optional<std::int64_t> last_us_;      // nothing: due at once
};

/** Obstacles of a task file, whose motions begin at time 0, as they move from `begin_us` on; of a grid that has
no room on the bus its blocks.
@pre |begin_us| and the obstacles' finite times are at most Schedule::kLatest. */
[[nodiscard]] std::vector<Obstacle> BegunAt(std::int64_t begin_us, const std::vector<Obstacle>& obstacles);

/** Sends the obstacles of a task file in place of perception. */
class ObstaclesOfFile final {
 public:
  explicit ObstaclesOfFile(std::int64_t period_us) : sender_(period_us) {}

  /** Sends these from now on, as BegunAt and SeenBy have them. @pre RequireSendable passes. */
  void Set(std::int64_t begin_us, const std::vector<Obstacle>& obstacles);
  /** As ObstacleSender::Due. */
  [[nodiscard]] std::optional<obstacles_t> Due(std::int64_t now_us);

 private:
  ObstacleSender sender_;
  std::optional<std::vector<Obstacle>> obstacles_;
  std::int64_t same_from_us_ = 0, same_until_us_ = 0;  // those seen are the same from then, until then
};

/** Those of `obstacles` that perception has seen by `now_us`: not a track whose first window begins later. Its other
windows are seen with the first, as predictions. Obstacles of one track follow each other, as for ToMessage. */
[[nodiscard]] std::vector<Obstacle> SeenBy(std::int64_t now_us, const std::vector<Obstacle>& obstacles);

/** Checks that receivers take what SeenBy gives of the task's obstacles, at every time from 0 on.
@throws ConfigError with the obstacle and the rule that it breaks. */
void RequireSendable(const Config& config);

}  // namespace forereach
