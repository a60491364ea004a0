/** Candidates of a log without a decision so far. */
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "lcmtypes/codec.h"

namespace forereach {

/** Pairs candidates with decisions by the digest of the candidate's bytes. Of equal candidates, the one that was sent
first is paired first. `Entry` is a reader's data for a candidate. Cost: O(log n) for n candidates. */
template <class Entry>
class Undecided final {
 public:
  /** @param most the largest number of candidates; beyond it the oldest is dropped. */
  explicit Undecided(std::size_t most = std::numeric_limits<std::size_t>::max()) : most_(most) {}

  void Add(const Digest& plan, Entry entry) {
    of_plan_.emplace(plan, next_);  // equal keys keep their order
    entries_.emplace(next_++, std::pair(plan, std::move(entry)));
    if (entries_.size() > most_) static_cast<void>(Take(entries_.begin()->second.first));
  }

  /** The candidate for the next decision on this plan, or null. */
  [[nodiscard]] const Entry* Find(const Digest& plan) const {
    const auto found = of_plan_.lower_bound(plan);
    return found == of_plan_.end() || found->first != plan ? nullptr : &entries_.at(found->second).second;
  }

  /** Removes and returns this candidate. */
  [[nodiscard]] std::optional<Entry> Take(const Digest& plan) {
    const auto found = of_plan_.lower_bound(plan);
    if (found == of_plan_.end() || found->first != plan) return std::nullopt;
    const auto entry = entries_.find(found->second);
    Entry taken = std::move(entry->second.second);
    entries_.erase(entry);
    of_plan_.erase(found);
    return taken;
  }

  /** Calls `visit` with each candidate in the order in which they were sent. */
  template <class Visit>
  void ForEach(Visit visit) const {
    for (const auto& [number, entry] : entries_) visit(entry.second);
  }

 private:
  std::size_t most_;
  std::int64_t next_ = 0;
  std::multimap<Digest, std::int64_t> of_plan_;
  std::map<std::int64_t, std::pair<Digest, Entry>> entries_;
};

}  // namespace forereach
