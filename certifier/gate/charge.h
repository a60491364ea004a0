/** Selects the certifier in charge among several on one bus. The others answer no candidate, so each candidate gets one
decision. It is a state machine over the heartbeats of other certifiers. It uses no bus and no clock.

    listening    --listened for listen_us, and heard neither of the two below--> in charge
    listening    --hears one in charge, or an earlier one that listens--> standing by
    standing by  --hears none in charge for kSilenceUs--> listening
    in charge    --hears an earlier one in charge--> standing by
    in charge    --was itself paused for kLapseUs--> listening

A certifier is earlier if it has the smaller started_utime, or an equal one and the smaller instance. One in shadow mode
certifies nothing, so it holds up none that does: one that certifies is earlier than any shadow, passes over what
shadows say, and is in charge without them; a shadow in charge stands by as soon as it hears one that listens. kLapseUs
is shorter than kSilenceUs, so a paused certifier knows that it may have been replaced before it sends anything. */
#pragma once

#include <cstdint>
#include <optional>
#include <tuple>

namespace forereach {

class Charge final {
 public:
  static constexpr std::int64_t kListenUs = 300'000;
  static constexpr std::int64_t kLapseUs = 1'500'000;
  static constexpr std::int64_t kSilenceUs = 2'000'000;
  /** The time between two calls of Advance counts as listening or silence only up to this limit, because a paused
  certifier receives nothing. */
  static constexpr std::int64_t kStepUs = 20'000;

  enum class State { kListening, kInCharge, kStandingBy };

  struct Identity {
    std::int64_t started_utime, instance;
    bool is_shadow = false;
    friend bool operator==(const Identity&, const Identity&) = default;
    [[nodiscard]] bool IsEarlierThan(const Identity& other) const {
      return std::tuple(is_shadow, started_utime, instance) <
             std::tuple(other.is_shadow, other.started_utime, other.instance);
    }
  };

  /** @param self this certifier. @param listen_us how long it listens before it takes charge, microseconds. 0: it is in
  charge at once; use it only where no other certifier can exist. */
  Charge(const Identity& self, std::int64_t listen_us);

  /** Processes a certifier's heartbeat. Its own heartbeats are ignored. */
  void Hear(const Identity& other, State its_state);
  /** After a reload: whether this certifier is a shadow. */
  void Follow(bool is_shadow) { self_.is_shadow = is_shadow; }
  /** Processes the passing of time, by a monotonic clock in microseconds. */
  void Advance(std::int64_t steady_us);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] const Identity& self() const { return self_; }
  /** The other certifier that was heard last, unless it has been silent for kSilenceUs. */
  [[nodiscard]] const std::optional<Identity>& other() const { return other_; }

 private:
  Identity self_;
  std::int64_t listen_us_;
  State state_;
  std::optional<Identity> other_;
  std::optional<std::int64_t> last_us_;  // Advance's last time
  std::int64_t listened_us_ = 0, leaderless_us_ = 0, other_silent_us_ = 0;
};

}  // namespace forereach
