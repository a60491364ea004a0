/** The certifier repeats a withdrawal until the robot answers (docs/bus.md); a log has each repetition. */
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>

#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/codec.h"

namespace forereach {

class RepeatedWithdrawals final {
 public:
  /** Whether it is not among the last kMost, of which repetitions differ in utime and sequence alone. */
  [[nodiscard]] bool IsFirst(withdrawal_t withdrawal) {
    withdrawal.utime = withdrawal.sequence = 0;
    const Digest digest = DigestOf(Encode(withdrawal));
    if (std::ranges::find(last_, digest) != last_.end()) return false;
    if (last_.size() == kMost) last_.pop_front();
    last_.push_back(digest);
    return true;
  }

 private:
  static constexpr std::size_t kMost = 4096;  // which may be repeated at one time

  std::deque<Digest> last_;
};

}  // namespace forereach
