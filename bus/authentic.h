/** Who may speak. LCM lets anybody on the network publish. With keys (keys.h) every channel of ours belongs to one
role, and a message counts only if that role signed it, for this robot, on this bus, on this channel, and once.

    signed message = message | bus (8) | sender (8) | counter (8) | signature (64) | tag (16) | "FRSIGN02"

Numbers are big-endian. The trailer stands behind the message, so programs that do not know it still decode the message.

    bus        the first 8 bytes of BLAKE2b-256 of the bus's name
    sender     64 random bits of one process
    counter    of that process: microseconds since the Unix epoch, or one more than the last
    signature  Ed25519 by the role's secret of: "ForeReach message 2" | BLAKE2b-256 of the robot's name (32) | role (1)
| bus | sender | counter | BLAKE2b-256 of (length of the channel's name (8) | channel | message) tag        BLAKE2b-128,
keyed with the group key, of: "ForeReach trailer 2" | length of the channel's name (8) | channel | length of the message
(8) | bus | sender | counter | signature

A receiver checks the cheap things first. The tag covers about 130 bytes, whatever the message's size: a stranger's
message costs one short keyed hash. A genuine trailer that was heard before is refused by its counter. Only a fresh and
genuine trailer reaches the hash of the message and Ed25519.

A receiver takes of each sender and channel only counters above the last, and of nobody one from before it began itself.
So a message that was recorded earlier is refused, even by a process that has just started. Sender and receiver need
clocks that agree: a sender whose clock is behind is not heard until it has passed the receiver's beginning. What a
receiver remembers of a channel depends on that channel's role alone: no other role can use up its counters or push it
out. */
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus/keys.h"
#include "lcmtypes/codec.h"

namespace forereach {

inline constexpr std::size_t kTrailerBytes = 3 * 8 + sizeof(Signature) + sizeof(GroupTag) + 8;

/** The message without its trailer, if it has one. Checks nothing. */
[[nodiscard]] Bytes WithoutSignature(Bytes bytes);

using BusId = std::array<std::uint8_t, 8>;
[[nodiscard]] BusId BusIdOf(const std::string& bus_name);

/** The role that speaks on each channel. Channels that are not in it are nobody's. */
using Speakers = std::map<std::string, Role>;

class Signer final {
 public:
  /** @param sender tells this process from all others: by default 64 random bits. */
  Signer(KeyRing keys, const std::string& bus_name, std::uint64_t sender = RandomSender());

  /** The message with its trailer. Any thread may call it. @throws std::logic_error if the ring does not hold the role.
   */
  [[nodiscard]] std::vector<std::uint8_t> Sign(Role role, const std::string& channel, Bytes message,
                                               std::int64_t now_us);

 private:
  [[nodiscard]] static std::uint64_t RandomSender();

  const KeyRing keys_;
  const BusId bus_;
  const std::uint64_t sender_;
  std::atomic<std::int64_t> last_counter_ = 0;
};

enum class Authenticity {
  kAuthentic,
  kUnsigned,  ///< No trailer.
  kForged,    ///< Tag or signature are wrong: altered, another role's, another robot's, or on another channel.
  kReplayed,  ///< Its counter was used, or is from before the receiver began.
  kForeign,   ///< Of this robot, but for another bus.
};

/** Messages refused, by reason. */
struct Refusals {
  std::int64_t unsigned_ones = 0, forged = 0, replayed = 0, foreign = 0;

  Refusals& operator+=(const Refusals& more) {
    unsigned_ones += more.unsigned_ones;
    forged += more.forged;
    replayed += more.replayed;
    foreign += more.foreign;
    return *this;
  }
  [[nodiscard]] std::int64_t all() const { return unsigned_ones + forged + replayed + foreign; }
};

class Authenticator final {
 public:
  /** Senders on a channel that are remembered; the one with the lowest counter is dropped, and no counter up to its
  last is taken on that channel again. */
  static constexpr std::size_t kMaxSenders = 16;
  /** So many altered messages behind one genuine trailer are looked at; then the trailer is refused. A stranger could
  else spend this receiver's time with the trailer of a message that was lost on its way here. */
  static constexpr int kMaxTries = 32;

  /** @param keys a ring of public keys checks no tags. @param bus_name nothing: the bus of the first authentic message.
  @param begun_us microseconds since the Unix epoch: nothing from before is taken. */
  Authenticator(KeyRing keys, const std::optional<std::string>& bus_name, Speakers speakers, std::int64_t begun_us);

  /** Whether the channel is somebody's, so that what comes on it has to be checked. */
  [[nodiscard]] bool IsSpoken(const std::string& channel) const { return channels_.contains(channel); }

  /** The message inside if it is authentic, which uses its counter up; else `refusals` grows. On a channel that is
  nobody's nothing is authentic. */
  [[nodiscard]] std::pair<Authenticity, Bytes> Check(const std::string& channel, Bytes bytes);

  [[nodiscard]] const Refusals& refusals() const { return refusals_; }

 private:
  struct Trailer;
  struct Channel {
    Role role;
    std::int64_t oldest;                                 // counters up to this are refused
    std::map<std::uint64_t, std::int64_t> last_counter;  // by sender
  };
  struct Doubt {
    GroupTag tag{};
    int tries = 0;  // signatures found wrong
  };

  [[nodiscard]] Authenticity Judge(const std::string& channel, Bytes bytes);
  [[nodiscard]] static bool IsFresh(const Channel& channel, const Trailer& trailer);
  [[nodiscard]] static bool Take(Channel& channel, const Trailer& trailer);
  [[nodiscard]] bool IsDoubted(const GroupTag& tag) const;
  void CountTry(const GroupTag& tag);

  KeyRing keys_;
  std::optional<BusId> bus_;
  std::map<std::string, Channel> channels_;
  std::array<Doubt, 16> doubts_;
  std::size_t next_doubt_ = 0;
  Refusals refusals_;
};

}  // namespace forereach
