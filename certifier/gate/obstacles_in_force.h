/** The obstacles in force, and whether they are known to be complete. They depend on gate.obstacles of the task:

`bus`: the obstacles of the task file and those of the last complete set on OBSTACLES, which one obstacles_t has or
several have in parts (obstacle_set.h). The messages are one stream, of one sender (lcmtypes/sole_sender.h). An obstacle
may move only if the task has gate.max_clock_error_ms; otherwise its set is refused. No message removes an obstacle of
the file. A message that leaves its set incomplete counts as silence: it changes nothing that is known, and the last
message is the last one whose set was complete. The obstacles are known from then on, until one of these events:
- The last message's stamp is older than gate.obstacles_timeout_ms.
- Signed: two senders are heard, or the sender has not been heard for gate.obstacles_timeout_ms alone. The messages of a
second sender are refused until the first one has been silent for that time.
- A message is refused, except for a late or repeated one, because its content is unknown. The next valid message ends
this.
- The last message taken was stamped further from its arrival than the task allows (stream_clock.h): the clock of its
sender is off. It is taken, because what it shows may withdraw a plan. The next one decides anew.
- A message is out of order: messages were lost, or, on a bus without signatures, two senders alternate and each knows a
part. The message is taken.
After a gap, one message in order confirms it; after a repeated sequence number, two do. A sender that restarts at 0
with a later stamp is in order. If the last message of the old stream is still fresh, one more message in order is
needed, because there may be a second sender.

`task`, or not said: the obstacles of the task file. OBSTACLES is refused.

A reload keeps the received obstacles. The class uses no bus and no clock. docs/bus.md has the rules as a table. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "certifier/gate/obstacle_set.h"
#include "certifier/gate/stream_clock.h"
#include "forereach/obstacles_t.hpp"
#include "forereach/safety/obstacle_index.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/freshness.h"
#include "lcmtypes/sole_sender.h"
#include "lcmtypes/stream_order.h"
#include "task/config.h"

namespace forereach {

class ObstaclesInForce final {
 public:
  /** Starts with the obstacles of the task. */
  explicit ObstaclesInForce(const Config& config);

  /** Takes the bytes of an obstacles_t that arrived at `now_us`, completely or not at all. Its
  stamp has to be fresh (stamp.h), and it has to be newer than the last message or from a restarted sender
  (stream_order.h). Returns the error, or an empty text. @param sender of its signature. */
  [[nodiscard]] std::string Update(Bytes message, std::int64_t now_us, SenderId sender = {});

  /** The reason why all() may be incomplete at this time; empty if the obstacles are known. Cost O(1). */
  [[nodiscard]] std::string WhyUnknown(std::int64_t now_us) const;

  /** Continues with the received obstacles of another object, after a reload. They are unknown if this task cannot have
  them in force. */
  void Inherit(const ObstaclesInForce& before);

  [[nodiscard]] const std::vector<Obstacle>& all() const { return all_; }
  /** The same with their index, which is made anew when they change. */
  [[nodiscard]] ObstacleView indexed() const { return {all_, index_}; }
  /** The digest of all(), as ObstaclesDigest computes it. */
  [[nodiscard]] const Digest& digest() const { return digest_; }
  /** The stamp of the message in force; nothing if none was received. */
  [[nodiscard]] std::optional<std::int64_t> stamp() const { return state_.known_utime; }
  /** Whether the last message taken has left its set incomplete. */
  [[nodiscard]] bool is_partial() const { return !state_.set.WhyPartial().empty(); }
  /** Stamp and arrival of the message in force; nothing if none was received. */
  [[nodiscard]] const std::optional<Arrival>& arrival() const { return state_.arrival; }
  /** The number of lost messages, from gaps in the sequence. */
  [[nodiscard]] std::int64_t lost() const { return state_.lost; }

 private:
  struct State {
    SoleSender sender;
    StreamOrder order{};                        // of the messages taken
    ObstacleSet set{};                          // that they have whole or in parts
    std::vector<Obstacle> heard{};              // of the last complete set
    Digest heard_digest{};                      // of these
    std::optional<std::int64_t> known_utime{};  // of the last message whose set was complete
    std::optional<Arrival> arrival{};           // of that message
    std::optional<std::int64_t> next{};         // the sequence after the last one seen, including refused messages
    std::string doubt{};                        // why the last message was refused
    int unconfirmed = 0;                        // number of messages in order that are still needed
    std::int64_t lost = 0;
  };

  [[nodiscard]] std::string Doubt(const std::string& why);
  [[nodiscard]] std::string Take(const obstacles_t& message, std::int64_t now_us);
  // @throws std::invalid_argument if these cannot be in force under this task: when they are heard, and after a reload.
  void RequireUsable(const std::vector<Obstacle>& heard) const;
  void RequireClock(const std::vector<Obstacle>& obstacles) const;
  void RequireGrids(const std::vector<Obstacle>& heard) const;
  void NoteOrder(std::int64_t sequence, std::int64_t now_us);
  void TakeSet(const obstacles_t& message);
  [[nodiscard]] Freshness FreshnessAt(std::int64_t utime, std::int64_t now_us) const;
  // Sets all_ to the task's obstacles, which are its first, and the received ones.
  void Put();

  GateOptions options_;
  std::optional<ClockBounds> clocks_;
  int dim_;  // of the safety coordinates
  std::size_t num_of_task_;
  std::vector<Obstacle> all_;
  ObstacleIndex index_;  // of all_
  State state_;
  Digest digest_{};
};

}  // namespace forereach
