/** Sets of obstacles from the messages of OBSTACLES: one that a message has whole, or one in parts.

A part replaces the one that was heard at its place. The set is complete when the parts that are there have the digest
that the last message names. So a change costs the parts that changed, each message confirms the whole set, and parts of
two sets never pass for one: that would take a collision of BLAKE2b-256. */
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "forereach/obstacles_t.hpp"
#include "lcmtypes/codec.h"

namespace forereach {

/** A part of a set, or a whole one: its obstacles and their digest. */
struct ObstaclePart {
  explicit ObstaclePart(std::span<const obstacle_t> obstacles);

  std::vector<obstacle_t> obstacles;
  Digest digest;  ///< of their encoded bytes, one after the other
};

/** The digest of a set, of the digests of its parts. */
[[nodiscard]] Digest SetDigestOf(std::span<const Digest> parts);

/** A set as its receiver puts it together. It holds at most the parts of kMostObstacles; copies share them. */
class ObstacleSet final {
 public:
  enum class Known {
    kPart,  ///< The set that the message names is not complete, so nothing is known of it.
    kSame,  ///< It is complete, and the one that was complete before.
    kNew    ///< It is complete: obstacles().
  };

  /** Takes a message. @throws std::invalid_argument with value and bound if its numbers are no set's; then nothing
  changes. Cost O(num_obstacles), and O(set) if it is complete anew. */
  Known Take(const obstacles_t& message);

  /** The complete set, in its order. @pre the last Take was kNew. */
  [[nodiscard]] std::vector<obstacle_t> obstacles() const;
  /** The complete set was of no use: the next message that completes it is kNew again. */
  void Refuse() { complete_.reset(); }

  /** Why the set of the last message is not complete; empty if it is, or if there was none. */
  [[nodiscard]] std::string WhyPartial() const;

 private:
  using Parts = std::vector<std::shared_ptr<const ObstaclePart>>;

  Known TakePart(const obstacles_t& message);

  int size_ = 0;  // of the set in parts; 0: it was whole
  Parts parts_;   // null: not heard
  bool is_partial_ = false;
  std::optional<Digest> complete_;  // the set in parts that was complete last
};

}  // namespace forereach
