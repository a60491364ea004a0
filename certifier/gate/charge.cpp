#include "certifier/gate/charge.h"

#include <algorithm>

namespace forereach {

Charge::Charge(const Identity& self, std::int64_t listen_us)
    : self_(self), listen_us_(listen_us), state_(listen_us > 0 ? State::kListening : State::kInCharge) {}

void Charge::Hear(const Identity& other, State its_state) {
  if (other.instance == self_.instance) return;
  other_ = other;
  other_silent_us_ = 0;
  // A shadow gives no certificates, so it must not keep one from giving them.
  if (other.is_shadow && !self_.is_shadow) return;
  const bool is_earlier = other.IsEarlierThan(self_), decides = its_state == State::kInCharge,
             will_decide = its_state == State::kListening && is_earlier;
  const bool gives_way_at_once = self_.is_shadow && !other.is_shadow;
  // Of two in charge the later one alone gives way, else nobody would be left. One that is not in charge yet waits for
  // any that decides, and for an earlier one that is about to.
  const bool goes_before =
      state_ != State::kInCharge || gives_way_at_once ? decides || will_decide : decides && is_earlier;
  if (!goes_before) return;
  state_ = State::kStandingBy;
  leaderless_us_ = 0;
}

void Charge::Advance(std::int64_t steady_us) {
  // A pause is not silence of the other: while this process did not run, it could not have heard it.
  const std::int64_t passed = steady_us - last_us_.value_or(steady_us),
                     counted = std::clamp<std::int64_t>(passed, 0, kStepUs);
  last_us_ = steady_us;
  other_silent_us_ += counted;
  if (other_silent_us_ >= kSilenceUs) other_.reset();
  switch (state_) {
    case State::kListening:
      listened_us_ += counted;
      if (listened_us_ >= listen_us_) state_ = State::kInCharge;
      return;
    case State::kStandingBy:
      leaderless_us_ += counted;
      if (leaderless_us_ < kSilenceUs) return;
      break;
    case State::kInCharge:
      // After such a pause another may have taken over: it listens before it certifies again.
      if (listen_us_ == 0 || passed <= kLapseUs) return;
      break;
  }
  state_ = State::kListening;
  listened_us_ = 0;
}

}  // namespace forereach
