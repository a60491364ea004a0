/** Messages of a log that belong together: candidates without a decision so far, and repetitions of a withdrawal. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "forereach/certified_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/seal.h"

namespace forereach {

/** By what a decision, or a certified plan, finds the message with its candidate: the candidate's digest if it was sent
alone, otherwise the key of its batch. */
struct PlanKeys {
  Digest plan, batch;

  explicit PlanKeys(const decision_t& decision)
      : plan(GetDigest(decision.plan_digest)), batch(BatchKey(decision.source, decision.candidate_utime)) {}
  explicit PlanKeys(const candidate_plan_t& candidate)
      : plan(PlanDigest(candidate)), batch(BatchKey(candidate.source, candidate.utime)) {}
};

/** Pairs messages with decisions. Of equal messages, the one that was sent first is paired first. `Entry` is a reader's
data for a message. Cost: O(log n) for n candidates. */
template <class Entry>
class Undecided final {
 public:
  /** @param most the largest number of messages. */
  explicit Undecided(std::size_t most) : most_(most) {}

  /** @return the oldest message, if there is no room for all. */
  std::optional<Entry> Add(const Digest& key, Entry entry) {
    of_key_.emplace(key, next_);  // equal keys keep their order
    entries_.emplace(next_++, std::pair(key, std::move(entry)));
    return entries_.size() > most_ ? std::optional(Take(entries_.begin())) : std::nullopt;
  }

  /** The next message with this key, or null. */
  [[nodiscard]] const Entry* Find(const Digest& key) const {
    const auto found = of_key_.lower_bound(key);
    return found == of_key_.end() || found->first != key ? nullptr : &entries_.at(found->second).second;
  }
  [[nodiscard]] const Entry* Find(const PlanKeys& keys) const {
    const Entry* const alone = Find(keys.plan);
    return alone ? alone : Find(keys.batch);
  }

  /** Removes and returns this message. */
  [[nodiscard]] std::optional<Entry> Take(const Digest& key) {
    const auto found = of_key_.lower_bound(key);
    if (found == of_key_.end() || found->first != key) return std::nullopt;
    return Take(entries_.find(found->second));
  }
  [[nodiscard]] std::optional<Entry> Take(const PlanKeys& keys) {
    std::optional<Entry> alone = Take(keys.plan);
    return alone ? std::move(alone) : Take(keys.batch);
  }
  /** The one that was sent first. */
  [[nodiscard]] std::optional<Entry> TakeFirst() {
    return entries_.empty() ? std::nullopt : std::optional(Take(entries_.begin()));
  }

 private:
  using Entries = std::map<std::int64_t, std::pair<Digest, Entry>>;

  Entry Take(typename Entries::iterator entry) {
    auto [at, end] = of_key_.equal_range(entry->second.first);
    while (at != end && at->second != entry->first) ++at;
    of_key_.erase(at);
    Entry taken = std::move(entry->second.second);
    entries_.erase(entry);
    return taken;
  }

  std::size_t most_;
  std::int64_t next_ = 0;
  std::multimap<Digest, std::int64_t> of_key_;
  Entries entries_;
};

/** The certifier repeats a withdrawal until the robot answers (docs/bus.md); a log has each repetition. */
class RepeatedWithdrawals final {
 public:
  /** Whether it is not among the last kMost, of which repetitions differ in utime and sequence alone. */
  [[nodiscard]] bool IsFirst(withdrawal_t withdrawal) {
    withdrawal.utime = withdrawal.sequence = 0;
    const Digest digest = DigestOf(Encode(withdrawal));
    if (!known_.insert(digest).second) return false;
    last_.push_back(digest);
    if (last_.size() <= kMost) return true;
    known_.erase(last_.front());
    last_.pop_front();
    return true;
  }

 private:
  static constexpr std::size_t kMost = 4096;  // which may be repeated at one time

  std::set<Digest> known_;
  std::deque<Digest> last_;  // of these
};

}  // namespace forereach
