/** Which obstacles count: the task's until some are heard on the bus, then those heard last. A reload does not forget what
was heard: the new task's and those heard last count together until the next are heard. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "certifier/safety/obstacle.h"
#include "forereach/obstacles_t.hpp"
#include "lcmtypes/codec.h"

namespace forereach {

class ObstaclesInForce final {
 public:
  /** @param dim number of safety coordinates. */
  ObstaclesInForce(std::vector<Obstacle> of_task, int dim);

  /** Takes a message that is fresh: whole, or not at all. Newer is what has a larger sequence or, from a sender that began
  anew, a later stamp. Returns what is wrong, or an empty text. */
  [[nodiscard]] std::string Update(const obstacles_t& message);

  /** Goes on where another's obstacles were in force. */
  void Inherit(const ObstaclesInForce& before);

  [[nodiscard]] const std::vector<Obstacle>& all() const { return all_; }
  /** Of all(), as ObstaclesDigest. */
  [[nodiscard]] const Digest& digest() const { return digest_; }

 private:
  void Put(std::vector<Obstacle> all);

  int dim_;
  std::vector<Obstacle> all_, heard_;
  Digest digest_;
  bool has_heard_ = false;
  std::int64_t sequence_ = -1, utime_ = 0;  // of the message heard last
};

}  // namespace forereach
