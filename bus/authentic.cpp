#include "bus/authentic.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string_view>

#include <sodium.h>

#include "lcmtypes/freshness.h"

namespace forereach {
namespace {

constexpr std::string_view kMark = "FRSIGN02";
constexpr std::string_view kSignatureContext = "ForeReach message 2", kTagContext = "ForeReach trailer 2";
constexpr std::size_t kNumberBytes = 8, kMaxChannel = 255;

// The signed or tagged bytes. They are joined on the stack, from parts of fixed length and a channel's name.
class Covered final {
 public:
  void Append(Bytes part) {
    std::memcpy(bytes_.data() + size_, part.data(), part.size());
    size_ += part.size();
  }
  void Append(std::string_view part) { Append({reinterpret_cast<const std::uint8_t*>(part.data()), part.size()}); }
  void AppendNumber(std::uint64_t number) { Append(BigEndian(number)); }
  [[nodiscard]] Bytes bytes() const { return Bytes(bytes_).first(size_); }

 private:
  std::array<std::uint8_t, 512> bytes_;
  std::size_t size_ = 0;
};

void AppendChannel(Covered& covered, const std::string& channel) {
  covered.AppendNumber(channel.size());
  covered.Append(channel);
}

Digest MessageDigest(const std::string& channel, Bytes message) {
  crypto_generichash_state state;
  crypto_generichash_init(&state, nullptr, 0, std::tuple_size_v<Digest>);
  const auto size = BigEndian<std::uint64_t>(channel.size());
  crypto_generichash_update(&state, size.data(), size.size());
  crypto_generichash_update(&state, reinterpret_cast<const std::uint8_t*>(channel.data()), channel.size());
  crypto_generichash_update(&state, message.data(), message.size());
  Digest digest;
  crypto_generichash_final(&state, digest.data(), digest.size());
  return digest;
}

bool HasTrailer(Bytes bytes) {
  return bytes.size() >= kTrailerBytes &&
         std::memcmp(bytes.data() + bytes.size() - kMark.size(), kMark.data(), kMark.size()) == 0;
}

// bus, sender and counter in the form of the trailer.
using Numbers = std::array<std::uint8_t, 3 * kNumberBytes>;

Numbers NumbersOf(const BusId& bus, std::uint64_t sender, std::int64_t counter) {
  Numbers numbers;
  auto end = std::ranges::copy(bus, numbers.begin()).out;
  end = std::ranges::copy(BigEndian(sender), end).out;
  std::ranges::copy(BigEndian(counter), end);
  return numbers;
}

Covered ToSign(const std::string& robot, Role role, const Numbers& numbers, const std::string& channel, Bytes message) {
  Covered covered;
  covered.Append(kSignatureContext);
  // Robot, role, bus, sender, counter and channel are all signed: none of them can be exchanged, nor the message sent
  // on another channel.
  covered.Append(DigestOf(robot));
  covered.Append(BigEndian(static_cast<std::uint8_t>(role)));
  covered.Append(numbers);
  covered.Append(MessageDigest(channel, message));
  return covered;
}

Covered ToTag(const std::string& channel, std::size_t message_bytes, const Numbers& numbers,
              const Signature& signature) {
  Covered covered;
  covered.Append(kTagContext);
  AppendChannel(covered, channel);
  covered.AppendNumber(message_bytes);
  covered.Append(numbers);
  covered.Append(signature);
  return covered;
}

void RequireChannel(const std::string& channel) {
  if (channel.size() > kMaxChannel)
    throw std::logic_error("a channel's name has " + std::to_string(channel.size()) + " bytes, at most " +
                           std::to_string(kMaxChannel) + " can be signed");
}

}  // namespace

// The parts of a signed message.
struct Authenticator::Trailer {
  Bytes message;
  Numbers numbers;
  Signature signature;
  GroupTag tag;

  explicit Trailer(Bytes bytes) : message(bytes.first(bytes.size() - kTrailerBytes)) {
    Bytes rest = bytes.subspan(message.size());
    const auto take = [&rest](auto& part) {
      std::memcpy(part.data(), rest.data(), part.size());
      rest = rest.subspan(part.size());
    };
    take(numbers);
    take(signature);
    take(tag);
  }
  [[nodiscard]] BusId bus() const {
    BusId bus;
    std::copy_n(numbers.begin(), bus.size(), bus.begin());
    return bus;
  }
  [[nodiscard]] std::uint64_t sender() const {
    return FromBigEndian<std::uint64_t>(Bytes(numbers).subspan(kNumberBytes));
  }
  [[nodiscard]] std::int64_t counter() const {
    return FromBigEndian<std::int64_t>(Bytes(numbers).subspan(2 * kNumberBytes));
  }
};

Bytes WithoutSignature(Bytes bytes) { return HasTrailer(bytes) ? bytes.first(bytes.size() - kTrailerBytes) : bytes; }

SenderId SenderOf(Bytes bytes) {
  if (!HasTrailer(bytes)) return std::nullopt;
  return FromBigEndian<std::uint64_t>(bytes.last(kTrailerBytes).subspan(kNumberBytes));
}

BusId BusIdOf(const std::string& bus_name) {
  const Digest digest = DigestOf(bus_name);
  BusId bus;
  std::copy_n(digest.begin(), bus.size(), bus.begin());
  return bus;
}

// ---- Signing.

Signer::Signer(KeyRing keys, const std::string& bus_name, std::uint64_t sender)
    : keys_(std::move(keys)), bus_(BusIdOf(bus_name)), sender_(sender) {}

std::uint64_t Signer::RandomSender() {
  if (sodium_init() < 0) throw KeyError("key: libsodium cannot begin: the machine gives no random numbers");
  std::uint64_t sender = 0;
  randombytes_buf(&sender, sizeof sender);
  return sender;
}

// The sender id after a clock was set back follows from the one before, so a run with given ids can be repeated.
std::pair<std::uint64_t, std::int64_t> Signer::Next(std::int64_t now_us) {
  const std::scoped_lock lock(mutex_);
  if (FreshnessOf(now_us, last_counter_, kSetBackUs, 0) == Freshness::kStale) {
    sender_ = FromBigEndian<std::uint64_t>(Bytes(DigestOf(NumbersOf(bus_, sender_, last_counter_))));
    last_counter_ = now_us - 1;
  }
  last_counter_ = std::max(now_us, last_counter_ + 1);  // rises even if two messages share a microsecond
  return {sender_, last_counter_};
}

std::vector<std::uint8_t> Signer::Sign(Role role, const std::string& channel, Bytes message, std::int64_t now_us) {
  RequireChannel(channel);
  const auto [sender, counter] = Next(now_us);
  const Numbers numbers = NumbersOf(bus_, sender, counter);
  const Signature signature = keys_.Sign(role, ToSign(keys_.robot(), role, numbers, channel, message).bytes());
  std::vector<std::uint8_t> bytes;
  bytes.reserve(message.size() + kTrailerBytes);
  const auto append = [&](const auto& part) { bytes.insert(bytes.end(), part.begin(), part.end()); };
  append(message);
  append(numbers);
  append(signature);
  append(keys_.Tag(ToTag(channel, message.size(), numbers, signature).bytes()));
  append(kMark);
  return bytes;
}

// ---- Checking.

Authenticator::Authenticator(KeyRing keys, const std::optional<std::string>& bus_name, Speakers speakers,
                             std::optional<std::int64_t> begun_us)
    : keys_(std::move(keys)), begun_us_(begun_us), latest_us_(std::numeric_limits<std::int64_t>::min()) {
  if (bus_name) bus_ = BusIdOf(*bus_name);
  for (const auto& [channel, speaker] : speakers) {
    RequireChannel(channel);
    channels_.emplace(channel, Channel{speaker, {}, {}});
  }
}

std::pair<Authenticity, Bytes> Authenticator::Check(const std::string& channel, Bytes bytes, std::int64_t now_us) {
  FollowClock(now_us);
  const Authenticity authenticity = Classify(channel, bytes, now_us);
  RefusalCounts refused;
  switch (authenticity) {
    case Authenticity::kAuthentic: return {authenticity, WithoutSignature(bytes)};
    case Authenticity::kUnsigned: ++refused.unsigned_ones; break;
    case Authenticity::kForged: ++refused.forged; break;
    case Authenticity::kReplayed: ++refused.replayed; break;
    case Authenticity::kForeign: ++refused.foreign; break;
    case Authenticity::kOld: ++refused.old; break;
    case Authenticity::kAhead: ++refused.ahead; break;
  }
  refusals_.RefusalCounts::operator+=(refused);
  if (const auto spoken = channels_.find(channel); spoken != channels_.end()) {
    Refusals::OfRole& of_role = refusals_.by_role[spoken->second.speaker];
    of_role.counts += refused;
    if (refused.old + refused.ahead > 0) of_role.apart_us = Apart(bytes, now_us);
  }
  return {authenticity, {}};
}

// @pre it has a trailer, which anybody may have written.
std::int64_t Authenticator::Apart(Bytes bytes, std::int64_t now_us) {
  // A counter is any number, and no difference of two may overflow.
  constexpr std::int64_t kMost = INT64_MAX / 4;
  return std::clamp(Trailer(bytes).counter(), -kMost, kMost) - std::clamp(now_us, -kMost, kMost);
}

// After the clock was set back, senders sign with times from before the start.
void Authenticator::FollowClock(std::int64_t now_us) {
  const std::int64_t earliest =
      std::max(now_us, std::numeric_limits<std::int64_t>::min() + kClockErrorUs) - kClockErrorUs;
  const bool is_set_back = FreshnessOf(now_us, latest_us_, kClockErrorUs, 0) == Freshness::kStale;
  if (!begun_us_ || is_set_back) begun_us_ = std::min(begun_us_.value_or(earliest), earliest);
  latest_us_ = is_set_back ? now_us : std::max(latest_us_, now_us);
}

// The checks run from cheap to expensive, so that an early refusal costs little.
Authenticity Authenticator::Classify(const std::string& name, Bytes bytes, std::int64_t now_us) {
  if (!HasTrailer(bytes)) return Authenticity::kUnsigned;
  const auto found = channels_.find(name);
  if (found == channels_.end()) return Authenticity::kForged;
  Channel& channel = found->second;
  const Trailer trailer(bytes);
  if (keys_.HoldsGroup()) {
    const GroupTag tag = keys_.Tag(ToTag(name, trailer.message.size(), trailer.numbers, trailer.signature).bytes());
    if (sodium_memcmp(tag.data(), trailer.tag.data(), tag.size()) != 0) return Authenticity::kForged;
  }
  if (bus_ && trailer.bus() != *bus_) return Authenticity::kForeign;
  if (const Authenticity timely = Timeliness(channel, trailer, now_us); timely != Authenticity::kAuthentic)
    return timely;
  // Who has the group key can make tags, and each false signature under one costs as much as a true one.
  if (keys_.HoldsGroup() && IsDoubted(trailer.tag)) return Authenticity::kForged;
  const Covered covered = ToSign(keys_.robot(), channel.speaker, trailer.numbers, name, trailer.message);
  if (!keys_.IsSigned(channel.speaker, covered.bytes(), trailer.signature)) {
    CountTry(trailer.tag);
    return Authenticity::kForged;
  }
  if (!Take(channel, trailer)) return Authenticity::kReplayed;
  // Readers of a log take the bus from its first authentic message.
  if (!bus_) bus_ = trailer.bus();
  return Authenticity::kAuthentic;
}

// When it was signed, by its counter. A known sender's counter is above one that was accepted since the start.
Authenticity Authenticator::Timeliness(const Channel& channel, const Trailer& trailer, std::int64_t now_us) const {
  const std::int64_t signed_us = trailer.counter();
  const auto known = channel.last_counter.find(trailer.sender());
  if (known != channel.last_counter.end()) {
    if (signed_us <= known->second) return Authenticity::kReplayed;
  } else {
    if (signed_us <= *begun_us_) return Authenticity::kOld;
    if (channel.forgotten && signed_us <= *channel.forgotten) return Authenticity::kReplayed;
  }
  const Freshness freshness = FreshnessOf(signed_us, now_us, INT64_MAX, channel.speaker.max_ahead_us);
  return freshness == Freshness::kFuture ? Authenticity::kAhead : Authenticity::kAuthentic;
}

bool Authenticator::Take(Channel& channel, const Trailer& trailer) {
  auto& last = channel.last_counter;
  if (const auto known = last.find(trailer.sender()); known != last.end()) {
    known->second = trailer.counter();
    return true;
  }
  if (last.size() >= kMaxSenders) {  // counters of a forgotten sender must not be accepted again
    const auto lowest = std::ranges::min_element(last, {}, [](const auto& sender) { return sender.second; });
    channel.forgotten = std::max(channel.forgotten.value_or(lowest->second), lowest->second);
    last.erase(lowest);
    if (trailer.counter() <= *channel.forgotten) return false;
  }
  last.emplace(trailer.sender(), trailer.counter());
  return true;
}

bool Authenticator::IsDoubted(const GroupTag& tag) const {
  const auto doubt = std::ranges::find(doubts_, tag, &Doubt::tag);
  return doubt != doubts_.end() && doubt->tries >= kMaxTries;
}

void Authenticator::CountTry(const GroupTag& tag) {
  auto doubt = std::ranges::find(doubts_, tag, &Doubt::tag);
  if (doubt == doubts_.end()) {
    // It takes the place of the oldest: in a flood of tags doubts are forgotten, and no memory grows.
    doubt = doubts_.begin() + static_cast<std::ptrdiff_t>(next_doubt_++ % doubts_.size());
    *doubt = {tag, 0};
  }
  ++doubt->tries;
}

std::string DescribeClocks(const Refusals& refusals, const Refusals& before) {
  std::string text;
  for (const auto& [role, now] : refusals.by_role) {
    const auto known = before.by_role.find(role);
    const auto of_time = [](const RefusalCounts& counts) { return counts.old + counts.ahead; };
    if (of_time(now.counts) == (known == before.by_role.end() ? 0 : of_time(known->second.counts))) continue;
    const bool is_ahead = now.apart_us > 0;
    text += std::string(text.empty() ? "" : "; ") + std::string(RoleName(role)) + "'s messages are signed " +
            std::to_string(std::abs(now.apart_us) / 1'000'000) + " s " +
            (is_ahead ? "ahead of the clock here" : "before the clock here, and before this start");
  }
  return text;
}

std::string DescribeRefusals(const RefusalCounts& refusals) {
  if (refusals.all() == 0) return "";
  std::string text = std::to_string(refusals.all()) + " (unsigned " + std::to_string(refusals.unsigned_ones) +
                     ", forged " + std::to_string(refusals.forged) + ", replayed " + std::to_string(refusals.replayed);
  const auto add = [&text](const char* what, std::int64_t count) {
    if (count > 0) text += std::string(", ") + what + " " + std::to_string(count);
  };
  add("signed before the start", refusals.old);
  add("signed ahead of the clock", refusals.ahead);
  add("of another bus", refusals.foreign);
  return text + ")";
}

}  // namespace forereach
