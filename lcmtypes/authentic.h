/** Who may speak: LCM lets anybody on the network publish. With a key that only the robot's own processes can read, what
makes the robot move is signed, and what is not signed, or not fresh, is refused.

    signed message = message | sender (8) | counter (8) | tag (32) | "FRSIGNED"        numbers big-endian

The tag is the BLAKE2b-256, keyed, of: bytes in the channel's name (8) | channel | message | sender | counter. So it holds
for these bytes on this channel only. The counter grows with every message of a sender: microseconds since the Unix
epoch, or one more than the last. A sender is a process that began at some time; it says when and which by a number.

A receiver takes of each sender and channel only counters above the last, and of nobody one from before it began itself:
so a message that was recorded earlier is refused, even by a process that has just been started. Sender and receiver need
clocks that agree: a sender whose clock is behind is not heard until it has passed the receiver's beginning.

The signature stands behind the message, so that programs which know nothing of it still decode the message. */
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/bad_input.h"
#include "lcmtypes/codec.h"

namespace forereach {

/** A key file cannot be used; the text names the file and what it has to be. */
class KeyError : public BadInput {
 public:
  using BadInput::BadInput;
};

using Key256 = std::array<std::uint8_t, 32>;

/** Makes a key from the machine's random numbers and writes it to a new file that only its owner can read.
@throws KeyError if the file exists or cannot be written. */
void MakeKeyFile(const std::string& path);

/** @throws KeyError if the file cannot be read, is not this program's owner's or root's, can be read or written by others,
or does not hold a key. */
[[nodiscard]] Key256 LoadKey(const std::string& path);

inline constexpr std::size_t kSignatureBytes = 56;

/** The message without its signature, if it has one. For records, which were checked when they were made. */
[[nodiscard]] Bytes WithoutSignature(Bytes bytes);

class Signer final {
 public:
  /** @param name says who speaks, @param begun_us when it began: together no other sender's. */
  Signer(const Key256& key, const std::string& name, std::int64_t begun_us);

  /** Any thread may call it. */
  [[nodiscard]] std::vector<std::uint8_t> Sign(const std::string& channel, Bytes message, std::int64_t now_us);

 private:
  const Key256 key_;
  std::uint64_t sender_;
  std::atomic<std::int64_t> last_counter_ = 0;
};

enum class Authenticity { kAuthentic, kUnsigned, kForged, kReplayed };

/** Messages refused, by reason. */
struct Refusals {
  std::int64_t unsigned_ones = 0, forged = 0, replayed = 0;

  Refusals& operator+=(const Refusals& more) {
    unsigned_ones += more.unsigned_ones;
    forged += more.forged;
    replayed += more.replayed;
    return *this;
  }
};

class Authenticator final {
 public:
  static constexpr std::size_t kMaxStreams = 64;  ///< Of a sender on a channel, remembered; the longest silent are dropped.

  /** @param begun_us microseconds since the Unix epoch: nothing from before is taken. */
  Authenticator(const Key256& key, std::int64_t begun_us) : key_(key), oldest_(begun_us) {}

  /** The message inside if it is authentic, which uses its counter up; else `refusals` grows. */
  [[nodiscard]] std::pair<Authenticity, Bytes> Check(const std::string& channel, Bytes bytes);

  [[nodiscard]] const Refusals& refusals() const { return refusals_; }

 private:
  [[nodiscard]] Authenticity Judge(const std::string& channel, Bytes bytes);
  [[nodiscard]] bool TakeCounter(const std::string& channel, std::uint64_t sender, std::int64_t counter);

  Key256 key_;
  std::int64_t oldest_;  // counters up to this are refused
  std::map<std::pair<std::string, std::uint64_t>, std::int64_t> last_counter_;
  Refusals refusals_;
};

}  // namespace forereach
