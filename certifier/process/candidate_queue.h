/** The candidates that wait for a decision, in their order of arrival.

The newest is decided first, because its planner still wants it. The others leave the queue when they are due, or when
newer ones displace them. Every candidate that was added is taken once, or counted by Clear. No clock, no bus. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "lcmtypes/codec.h"

namespace forereach {

class CandidateQueue final {
 public:
  using Candidate = std::vector<std::uint8_t>;  ///< A message's bytes, which need not be a candidate_plan_t.

  void Add(Bytes candidate);

  /** The candidate that was added last, or first. The queue must not be empty. */
  [[nodiscard]] Candidate TakeNewest();
  [[nodiscard]] Candidate TakeOldest();

  /** All candidates with start_utime < `utime`, microseconds since the Unix epoch, the oldest first. Bytes that are no
  candidate have no start and stay. Decodes nothing. */
  [[nodiscard]] std::vector<Candidate> TakeStartingBefore(std::int64_t utime);

  /** Forgets all candidates. @return how many. */
  std::size_t Clear();

  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  [[nodiscard]] std::size_t size() const { return waiting_.size(); }
  /** The greatest size since the last call. */
  [[nodiscard]] std::size_t TakeHighWater();

 private:
  std::deque<Candidate> waiting_;  // the newest at the back
  std::size_t high_water_ = 0;
};

}  // namespace forereach
