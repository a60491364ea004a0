/** Message authentication. LCM lets every program on the network publish. With keys (keys.h), every channel of
ForeReach belongs to one role, and a message counts only if that role signed it for this robot, this bus and this
channel, and only once.

    signed message = message | bus (8) | sender (8) | counter (8) | signature (64) | tag (16) | "FRSIGN02"

Numbers are big-endian. The trailer follows the message, so programs that do not know the trailer can decode the
message.

    bus        the first 8 bytes of BLAKE2b-256 of the bus's name
    sender     64 random bits of one process
    counter    of that process: microseconds since the Unix epoch, or one more than the last
    signature  Ed25519, by the role's secret, of:
                 "ForeReach message 2" | BLAKE2b-256 of the robot's name (32) | role (1) | bus | sender | counter
                 | BLAKE2b-256 of (length of the channel's name (8) | channel | message)
    tag        BLAKE2b-128, keyed with the group key, of:
                 "ForeReach trailer 2" | length of the channel's name (8) | channel | length of the message (8)
                 | bus | sender | counter | signature

A receiver makes the cheap checks first. The tag covers about 130 bytes for every message size, so a stranger's message
costs one short keyed hash. A genuine trailer that was received before is refused by its counter. Only a fresh and
genuine trailer reaches the hash of the message and Ed25519.

A receiver accepts a counter only if it is above the last one of that sender on that channel and not from before the
receiver's start. So an earlier recorded message is refused, even by a process that has just started. The clocks of
sender and receiver have to agree: messages of a sender whose clock is behind are refused until its clock has passed the
receiver's start. The stored counters of a channel depend only on messages of that channel's role, so no other role can
use up or displace them. */
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

/** The message without its trailer, if it has one. It checks nothing. */
[[nodiscard]] Bytes WithoutSignature(Bytes bytes);

using BusId = std::array<std::uint8_t, 8>;
[[nodiscard]] BusId BusIdOf(const std::string& bus_name);

/** The role that owns each channel. Channels that are not listed belong to no role. */
using Speakers = std::map<std::string, Role>;

class Signer final {
 public:
  /** @param sender identifies this process; 64 random bits by default. */
  Signer(KeyRing keys, const std::string& bus_name, std::uint64_t sender = RandomSender());

  /** The message with its trailer. Any thread may call it. @throws std::logic_error if the ring lacks the role's
  secret. */
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
  kForged,    ///< Wrong tag or signature: altered, another role's, another robot's, or for another channel.
  kReplayed,  ///< Its counter was used before, or is from before the receiver's start.
  kForeign,   ///< From this robot, but for another bus.
};

/** Numbers of refused messages by reason. */
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
  /** The number of senders that are remembered for each channel. If more appear, the one with the lowest counter is
  forgotten, and no counter up to its last is accepted on that channel again. */
  static constexpr std::size_t kMaxSenders = 16;
  /** The number of altered messages with one genuine trailer that are verified; then the trailer is refused. Otherwise
  a stranger could use the trailer of a message that this receiver lost to consume its time. */
  static constexpr int kMaxTries = 32;

  /** @param keys a ring with public keys only checks no tags. @param bus_name empty: the bus of the first authentic
  message.
  @param speakers the role of each channel. @param begun_us microseconds since the Unix epoch; earlier messages are
  refused. */
  Authenticator(KeyRing keys, const std::optional<std::string>& bus_name, Speakers speakers, std::int64_t begun_us);

  /** Whether a role owns the channel, so that its messages have to be checked. */
  [[nodiscard]] bool IsSpoken(const std::string& channel) const { return channels_.contains(channel); }

  /** Checks a message. If it is authentic, returns the message without trailer and uses up its counter. Otherwise it
  counts the refusal. On a channel without a role no message is authentic. */
  [[nodiscard]] std::pair<Authenticity, Bytes> Check(const std::string& channel, Bytes bytes);

  [[nodiscard]] const Refusals& refusals() const { return refusals_; }

 private:
  struct Trailer;
  struct Channel {
    Role role;
    std::int64_t oldest;                                 // counters up to this one are refused
    std::map<std::uint64_t, std::int64_t> last_counter;  // by sender
  };
  struct Doubt {
    GroupTag tag{};
    int tries = 0;  // signatures found wrong
  };

  [[nodiscard]] Authenticity Classify(const std::string& channel, Bytes bytes);
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
