/** Which obstacles count, and whether they are all there are. By gate.obstacles of the task:

    bus    those of the task file and, besides, those of the last OBSTACLES message. What the file says stands whatever
is heard: walls do not go away because nobody sees them. All obstacles are known from the first usable message on, until
one of these happens:
             - the last message's stamp is older than gate.obstacles_timeout_ms;
             - a message is refused, and not because it came late or twice: nobody knows what it would have said. The
next good one ends this;
             - a message comes out of order. Messages were lost, or two senders speak in turn and each knows a part. It
is taken; one in order after it confirms it after a gap, two where a sequence came again. A sender that begins anew at 0
with a later stamp is in order, but for one message more where the last one heard is still fresh: it may be a second
sender. task   those of the task file. OBSTACLES is refused. not said, in logs from before gate.obstacles: those of the
file until some are heard, then those heard last.

A reload does not forget what was heard. No bus, no clock in it. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "certifier/gate/freshness.h"
#include "certifier/safety/obstacle.h"
#include "certifier/task/config.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/stream_order.h"

namespace forereach {

class ObstaclesInForce final {
 public:
  /** The task's. */
  explicit ObstaclesInForce(const Config& config);

  /** Takes the bytes of an obstacles_t that came at `now_us`: whole, or not at all. Its stamp has to be fresh
  (stamp.h), and it newer than the one before, or of a sender that restarted (stream_order.h). Returns what is wrong, or
  an empty text. */
  [[nodiscard]] std::string Update(Bytes message, std::int64_t now_us);

  /** Why all() may not be all obstacles there are at this time; empty if they are, as far as is known. Cost O(1). */
  [[nodiscard]] std::string WhyUnknown(std::int64_t now_us) const;

  /** Goes on where another's obstacles were in force. */
  void Inherit(const ObstaclesInForce& before);

  [[nodiscard]] const std::vector<Obstacle>& all() const { return all_; }
  /** Of all(), as ObstaclesDigest. */
  [[nodiscard]] const Digest& digest() const { return digest_; }
  /** Stamp of the message in force; nothing if none has been heard. */
  [[nodiscard]] std::optional<std::int64_t> stamp() const;
  /** Messages missing between those that came, by their sequence. */
  [[nodiscard]] std::int64_t lost() const { return state_.lost; }

 private:
  struct State {
    StreamOrder order;                 // of the messages taken
    std::vector<Obstacle> heard;       // by the last of them
    std::optional<std::int64_t> next;  // the sequence after the last one seen, refused ones too
    std::string doubt;                 // the last message was refused: why
    int unconfirmed = 0;               // messages in order that are still needed
    std::int64_t lost = 0;
  };

  [[nodiscard]] std::string Doubt(const std::string& why);
  void NoteOrder(std::int64_t sequence, std::int64_t now_us);
  [[nodiscard]] Freshness FreshnessOfLast(std::int64_t now_us) const;
  // The task's, if so asked, and those heard last.
  void Put(bool of_task);

  GateOptions options_;
  int dim_;  // of the safety coordinates
  std::vector<Obstacle> of_task_, all_;
  State state_;
  Digest digest_;
};

}  // namespace forereach
