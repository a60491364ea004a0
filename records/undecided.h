/** Messages with candidates of a log without a decision so far. */
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "lcmtypes/codec.h"

namespace forereach {

/** Pairs messages with decisions by the digest of a candidate's bytes: a message may stand for several candidates, of
which one is decided on (lcmtypes/candidate_batch.h). Of equal candidates, the one that was sent first is paired first.
`Entry` is a reader's data for a message. Cost: O(log n) for n candidates. */
template <class Entry>
class Undecided final {
 public:
  /** @param most the largest number of messages; beyond it the oldest is dropped. */
  explicit Undecided(std::size_t most = std::numeric_limits<std::size_t>::max()) : most_(most) {}

  /** @param plans the digests of its candidates, at least one. */
  void Add(std::vector<Digest> plans, Entry entry) {
    for (const Digest& plan : plans) of_plan_.emplace(plan, next_);  // equal keys keep their order
    entries_.emplace(next_++, std::pair(std::move(plans), std::move(entry)));
    if (entries_.size() > most_) static_cast<void>(Take(entries_.begin()));
  }
  void Add(const Digest& plan, Entry entry) { Add(std::vector{plan}, std::move(entry)); }

  /** The message for the next decision on this plan, or null. */
  [[nodiscard]] const Entry* Find(const Digest& plan) const {
    const auto found = of_plan_.lower_bound(plan);
    return found == of_plan_.end() || found->first != plan ? nullptr : &entries_.at(found->second).second;
  }

  /** Removes and returns this message. */
  [[nodiscard]] std::optional<Entry> Take(const Digest& plan) {
    const auto found = of_plan_.lower_bound(plan);
    if (found == of_plan_.end() || found->first != plan) return std::nullopt;
    return Take(entries_.find(found->second));
  }

  /** Calls `visit` with each message in the order in which they were sent. */
  template <class Visit>
  void ForEach(Visit visit) const {
    for (const auto& [number, entry] : entries_) visit(entry.second);
  }

 private:
  using Entries = std::map<std::int64_t, std::pair<std::vector<Digest>, Entry>>;

  Entry Take(typename Entries::iterator entry) {
    for (const Digest& plan : entry->second.first) {
      const auto [begin, end] = of_plan_.equal_range(plan);
      for (auto at = begin; at != end; ++at)
        if (at->second == entry->first) {
          of_plan_.erase(at);
          break;
        }
    }
    Entry taken = std::move(entry->second.second);
    entries_.erase(entry);
    return taken;
  }

  std::size_t most_;
  std::int64_t next_ = 0;
  std::multimap<Digest, std::int64_t> of_plan_;
  Entries entries_;
};

}  // namespace forereach
