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

A receiver accepts a counter only if all of these hold, on every channel. No other code looks at when a message was
signed:

    once          it is above the last one of that sender on that channel
    since         it is not from before the receiver's start: an earlier recorded message is refused, also by a process
                  that has just started
    not ahead     it is not further ahead of the receiver's clock than the channel allows: what was signed while a clock
                  was ahead is refused, also after the receiver's restart

So the clocks of sender and receiver have to agree. Messages of a sender whose clock is behind are refused until its
clock has passed the receiver's start; of one whose clock is ahead, until it is set right. A sender whose clock is set
back goes on under another sender id, with counters of the new time. A receiver whose own clock is set back takes that
time for its start if it is the earlier one, as if it had been started then.

The stored counters of a channel depend only on messages of that channel's role, so no other role can use up or displace
them. */
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus/keys.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/sole_sender.h"

namespace forereach {

inline constexpr std::size_t kTrailerBytes = 3 * 8 + sizeof(Signature) + sizeof(GroupTag) + 8;

/** The message without its trailer, if it has one. It checks nothing. */
[[nodiscard]] Bytes WithoutSignature(Bytes bytes);
/** The sender in the trailer, if it has one. It checks nothing. */
[[nodiscard]] SenderId SenderOf(Bytes bytes);

using BusId = std::array<std::uint8_t, 8>;
[[nodiscard]] BusId BusIdOf(const std::string& bus_name);

/** By how much the clocks of sender and receiver may differ, microseconds. Stamps in messages have limits of their own,
which are tighter. */
inline constexpr std::int64_t kClockErrorUs = 1'000'000;

/** The same on the channels of withdrawals and faults, which only ever stop a robot: a certifier whose clock is ahead
must still be able to. */
inline constexpr std::int64_t kStopsAheadUs = 60'000'000;

/** The role that owns a channel. */
struct Speaker {
  Role role;
  std::int64_t max_ahead_us;  ///< How far ahead of the receiver's clock a message may be signed.

  // Both conversions are implicit: most channels are described by their role.
  constexpr Speaker(Role of, std::int64_t max_ahead = kClockErrorUs) : role(of), max_ahead_us(max_ahead) {}
  constexpr operator Role() const { return role; }
};

/** The speaker of each channel. Channels that are not listed belong to no role. */
using Speakers = std::map<std::string, Speaker>;

class Signer final {
 public:
  /** A clock that is set back by more than this makes it another sender. Less is made up for by the counter, which then
  runs ahead of the clock by at most this. Microseconds. */
  static constexpr std::int64_t kSetBackUs = kClockErrorUs / 2;

  /** @param sender identifies this process; 64 random bits by default. */
  Signer(KeyRing keys, const std::string& bus_name, std::uint64_t sender = RandomSender());

  /** The message with its trailer. Any thread may call it. @throws std::logic_error if the ring lacks the role's
  secret. */
  [[nodiscard]] std::vector<std::uint8_t> Sign(Role role, const std::string& channel, Bytes message,
                                               std::int64_t now_us);

 private:
  [[nodiscard]] static std::uint64_t RandomSender();
  /** Sender and counter of the next message. */
  [[nodiscard]] std::pair<std::uint64_t, std::int64_t> Next(std::int64_t now_us);

  const KeyRing keys_;
  const BusId bus_;
  std::mutex mutex_;  // of the next two
  std::uint64_t sender_;
  std::int64_t last_counter_ = 0;
};

enum class Authenticity {
  kAuthentic,
  kUnsigned,  ///< No trailer.
  kForged,    ///< Wrong tag or signature: altered, another role's, another robot's, or for another channel.
  kReplayed,  ///< Its counter was used before.
  kForeign,   ///< From this robot, but for another bus.
  kOld,       ///< Signed before the receiver's start.
  kAhead,     ///< Signed further ahead of the receiver's clock than the channel allows.
};

/** Numbers of refused messages by reason. */
struct RefusalCounts {
  std::int64_t unsigned_ones = 0, forged = 0, replayed = 0, foreign = 0, old = 0, ahead = 0;

  RefusalCounts& operator+=(const RefusalCounts& more) {
    unsigned_ones += more.unsigned_ones;
    forged += more.forged;
    replayed += more.replayed;
    foreign += more.foreign;
    old += more.old;
    ahead += more.ahead;
    return *this;
  }
  [[nodiscard]] std::int64_t all() const { return unsigned_ones + forged + replayed + foreign + old + ahead; }
};

/** The same in all, and by the role that speaks on their channel. */
struct Refusals : RefusalCounts {
  struct OfRole {
    RefusalCounts counts;
    std::int64_t apart_us = 0;  ///< Of the last old one or one ahead: when it was signed, less the receiver's clock.
  };
  std::map<Role, OfRole> by_role;

  Refusals& operator+=(const Refusals& more) {
    RefusalCounts::operator+=(more);
    for (const auto& [role, of_role] : more.by_role) {
      OfRole& sum = by_role[role];
      sum.counts += of_role.counts;
      if (of_role.apart_us != 0) sum.apart_us = of_role.apart_us;
    }
    return *this;
  }
};

/** "3 (unsigned 1, forged 1, replayed 1)", with the other causes where there are any; empty if there are none. */
[[nodiscard]] std::string DescribeRefusals(const RefusalCounts& refusals);

/** "perception's messages are signed 600 s ahead of the clock here", for each role of which messages were refused for
their time since `before`; empty if there is none. */
[[nodiscard]] std::string DescribeClocks(const Refusals& refusals, const Refusals& before);

class Authenticator final {
 public:
  /** The number of senders that are remembered for each channel. If more appear, the one with the lowest counter is
  forgotten, and no counter up to its last is accepted on that channel again. So many starts of processes, and then a
  clock that is set back, refuse every new sender until the clock has passed that counter. */
  static constexpr std::size_t kMaxSenders = 256;
  /** The number of altered messages with one genuine trailer that are verified; then the trailer is refused. Otherwise
  a stranger could use the trailer of a message that this receiver lost to consume its time. */
  static constexpr int kMaxTries = 32;

  /** @param keys a ring with public keys only checks no tags. @param bus_name empty: the bus of the first authentic
  message.
  @param begun_us the receiver's start, microseconds since the Unix epoch: messages that were signed at this time or
  before are refused. Nothing: kClockErrorUs before the time of the first Check. */
  Authenticator(KeyRing keys, const std::optional<std::string>& bus_name, Speakers speakers,
                std::optional<std::int64_t> begun_us);

  /** Whether a role owns the channel, so that its messages have to be checked. */
  [[nodiscard]] bool IsSpoken(const std::string& channel) const { return channels_.contains(channel); }

  /** Checks a message that arrived at `now_us` by the receiver's wall clock. If it is authentic, returns the message
  without trailer and uses up its counter. Otherwise it counts the refusal. On a channel without a role no message is
  authentic. */
  [[nodiscard]] std::pair<Authenticity, Bytes> Check(const std::string& channel, Bytes bytes, std::int64_t now_us);

  [[nodiscard]] const Refusals& refusals() const { return refusals_; }

 private:
  struct Trailer;
  struct Channel {
    Speaker speaker;
    std::optional<std::int64_t> forgotten;               // no counter up to this one is new
    std::map<std::uint64_t, std::int64_t> last_counter;  // by sender
  };
  struct Doubt {
    GroupTag tag{};
    int tries = 0;  // signatures found wrong
  };

  [[nodiscard]] Authenticity Classify(const std::string& channel, Bytes bytes, std::int64_t now_us);
  void FollowClock(std::int64_t now_us);
  [[nodiscard]] Authenticity Timeliness(const Channel& channel, const Trailer& trailer, std::int64_t now_us) const;
  [[nodiscard]] static std::int64_t Apart(Bytes bytes, std::int64_t now_us);
  [[nodiscard]] static bool Take(Channel& channel, const Trailer& trailer);
  [[nodiscard]] bool IsDoubted(const GroupTag& tag) const;
  void CountTry(const GroupTag& tag);

  KeyRing keys_;
  std::optional<BusId> bus_;
  std::optional<std::int64_t> begun_us_;
  std::int64_t latest_us_;  // the receiver's clock, by the last Check
  std::map<std::string, Channel> channels_;
  std::array<Doubt, 16> doubts_;
  std::size_t next_doubt_ = 0;
  Refusals refusals_;
};

}  // namespace forereach
