#include "certifier/process/candidate_queue.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "certifier/gate/candidate_message.h"

namespace forereach {

void CandidateQueue::Add(Bytes candidate) {
  waiting_.emplace_back(candidate.begin(), candidate.end());
  high_water_ = std::max(high_water_, waiting_.size());
}

CandidateQueue::Candidate CandidateQueue::TakeNewest() {
  Candidate newest = std::move(waiting_.back());
  waiting_.pop_back();
  return newest;
}

CandidateQueue::Candidate CandidateQueue::TakeOldest() {
  Candidate oldest = std::move(waiting_.front());
  waiting_.pop_front();
  return oldest;
}

std::vector<CandidateQueue::Candidate> CandidateQueue::TakeStartingBefore(std::int64_t utime) {
  const auto first = std::stable_partition(waiting_.begin(), waiting_.end(),
                                           [&](const Candidate& one) { return StartOf(one) >= utime; });
  std::vector<Candidate> due(std::make_move_iterator(first), std::make_move_iterator(waiting_.end()));
  waiting_.erase(first, waiting_.end());
  return due;
}

std::size_t CandidateQueue::Clear() {
  const std::size_t count = waiting_.size();
  waiting_.clear();
  return count;
}

std::size_t CandidateQueue::TakeHighWater() { return std::exchange(high_water_, waiting_.size()); }

}  // namespace forereach
