/** Which obstacles count: the task's until some are heard on the bus, then those heard last. A reload does not forget what
was heard: the new task's and those heard last count together until the next are heard. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "certifier/safety/obstacle.h"
#include "certifier/task/config.h"
#include "lcmtypes/codec.h"

namespace forereach {

class ObstaclesInForce final {
 public:
  /** The task's. */
  explicit ObstaclesInForce(const Config& config);

  /** Takes the bytes of an obstacles_t that came at `now_us`: whole, or not at all. Its stamp has to be fresh (stamp.h), and
  it newer than the one before: of a larger sequence or, from a sender that began anew, of a later stamp. Returns what is
  wrong, or an empty text. */
  [[nodiscard]] std::string Update(Bytes message, std::int64_t now_us);

  /** Goes on where another's obstacles were in force. */
  void Inherit(const ObstaclesInForce& before);

  [[nodiscard]] const std::vector<Obstacle>& all() const { return all_; }
  /** Of all(), as ObstaclesDigest. */
  [[nodiscard]] const Digest& digest() const { return digest_; }

 private:
  struct Heard {
    std::int64_t sequence, utime;
    std::vector<Obstacle> obstacles;
  };

  void Put(std::vector<Obstacle> all);

  GateOptions options_;
  int dim_;  // of the safety coordinates
  std::optional<Heard> heard_;  // last
  std::vector<Obstacle> all_;
  Digest digest_;
};

}  // namespace forereach
