#include "certifier/gate/pauses.h"

#include <algorithm>

#include <fmt/core.h>

#include "lcmtypes/freshness.h"

namespace forereach {

void Pauses::Call(std::int64_t now_us, std::int64_t steady_us) {
  const std::int64_t passed = steady_us - last_steady_us_.value_or(steady_us);
  last_steady_us_ = steady_us;
  now_us_ = now_us;
  if (passed <= kPauseUs) return;
  if (pauses_.size() == kRemembered) pauses_.pop_front();
  pauses_.push_back({now_us - passed, now_us});
}

std::int64_t Pauses::Since(std::int64_t since_us) const {
  std::int64_t sum = 0;
  for (const Pause& pause : pauses_)
    sum += std::max<std::int64_t>(pause.end_us - std::max(pause.begin_us, since_us), 0);
  return sum;
}

std::string Pauses::Explain(std::int64_t since_us, std::int64_t most_us) const {
  const std::int64_t age = now_us_ - since_us, paused = Since(since_us);
  // Only where the sender is not to blame: without the pauses it would have been heard in time.
  if (age <= most_us || age - paused > most_us) return {};
  return fmt::format(": this certifier itself did not run for {}", Milliseconds(paused, 0));
}

}  // namespace forereach
