/** Which of several certifiers on one bus decides. One of them is in charge; the others decide nothing and answer
nobody, so that each candidate gets one decision. A state machine over the heartbeats of others. No bus, no clock in it.

    listening    --has listened for listen_us, and heard none that goes before--> in charge
    listening    --hears one in charge, or an earlier one that listens--> standing by
    standing by  --none in charge is heard for kSilenceUs--> listening
    in charge    --hears an earlier one in charge--> standing by
    in charge    --was itself kept from running for kLapseUs--> listening

The earlier one was started first; of two started in the same microsecond it has the smaller instance.
kLapseUs is shorter than kSilenceUs: one that was paused sends nothing before it knows that it may have been replaced.
*/
#pragma once

#include <compare>
#include <cstdint>
#include <optional>

namespace forereach {

class Charge final {
 public:
  static constexpr std::int64_t kListenUs = 300'000;
  static constexpr std::int64_t kLapseUs = 1'500'000;
  static constexpr std::int64_t kSilenceUs = 2'000'000;
  /** Time between two calls of Advance counts as listened or silent up to this: who was paused has heard nothing. */
  static constexpr std::int64_t kStepUs = 20'000;

  enum class State { kListening, kInCharge, kStandingBy };

  struct Identity {
    std::int64_t started_utime, instance;
    friend auto operator<=>(const Identity&, const Identity&) = default;
  };

  /** @param listen_us before it takes charge; 0 for one that nobody else can be beside: it is in charge at once. */
  Charge(const Identity& self, std::int64_t listen_us);

  /** A heartbeat of a certifier. One's own are ignored. */
  void Hear(const Identity& other, State its_state);
  /** Time has passed, by a clock that nobody sets. */
  void Advance(std::int64_t steady_us);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] const Identity& self() const { return self_; }
  /** The one heard last, for as long as it has not been silent for kSilenceUs. */
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
