#include "certifier/process/candidate_queue.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "forereach/candidate_plan_t.hpp"

namespace forereach {
namespace {

std::int64_t StartOf(Bytes bytes) {
  const auto candidate = Decoded<candidate_plan_t>(bytes);
  return candidate ? candidate->start_utime : std::numeric_limits<std::int64_t>::max();
}

}  // namespace

void CandidateQueue::Add(Bytes candidate) {
  waiting_.push_back({{candidate.begin(), candidate.end()}});
  high_water_ = std::max(high_water_, waiting_.size());
}

CandidateQueue::Candidate CandidateQueue::TakeNewest() {
  Candidate newest = std::move(waiting_.back().candidate);
  waiting_.pop_back();
  return newest;
}

CandidateQueue::Candidate CandidateQueue::TakeOldest() {
  Candidate oldest = std::move(waiting_.front().candidate);
  waiting_.pop_front();
  return oldest;
}

std::vector<CandidateQueue::Candidate> CandidateQueue::TakeStartingBefore(const std::function<std::int64_t()>& utime) {
  for (Waiting& one : waiting_)
    if (!one.start_utime) one.start_utime = StartOf(one.candidate);
  const std::int64_t end = utime();
  std::vector<Candidate> due;
  for (Waiting& one : waiting_)
    if (*one.start_utime < end) due.push_back(std::move(one.candidate));
  std::erase_if(waiting_, [&](const Waiting& one) { return *one.start_utime < end; });
  return due;
}

std::size_t CandidateQueue::Clear() {
  const std::size_t count = waiting_.size();
  waiting_.clear();
  return count;
}

std::size_t CandidateQueue::TakeHighWater() { return std::exchange(high_water_, waiting_.size()); }

}  // namespace forereach
