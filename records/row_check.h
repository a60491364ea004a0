/** Compares the decisions, execution events and transitions that a database has of a log with those that the
interpreter makes of its events again. Gaps are not compared: how many messages are missing depends on what else reached
the logger. */
#pragma once

#include <bitset>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "records/rows.h"

namespace forereach {

/** Numbers of events: a bit each, in blocks, since a log has most of them. */
struct EventNumbers {
  static constexpr std::int64_t kBlock = 4096;

  void Insert(std::int64_t number) { of_block[number / kBlock].set(Place(number)); }
  [[nodiscard]] bool Contains(std::int64_t number) const {
    const auto block = of_block.find(number / kBlock);
    return block != of_block.end() && block->second.test(Place(number));
  }

  std::map<std::int64_t, std::bitset<kBlock>> of_block;

 private:
  static std::size_t Place(std::int64_t number) { return static_cast<std::size_t>(std::abs(number % kBlock)); }
};

/** What is known of how the recorded rows came about. */
struct RowGrounds {
  std::int64_t end = std::numeric_limits<std::int64_t>::max();  ///< All rows of events with lower numbers are recorded.
  bool knows_order = true;           ///< The log and what was before it is whole: latencies follow from it.
  bool misses_candidates = false;    ///< The logger lost candidates after their receipt: it knew more latencies.
  std::set<std::string> lossy{};     ///< Channels of which the logger lost messages itself.
  std::set<std::int64_t> damaged{};  ///< Events that the log does not have as they were: their rows are not compared.
};

/** Compares rows as the log's events come. Memory: two bits for each event, and a sentence for each difference. */
class RowComparison final {
 public:
  /** @param grounds may change until Finish, but for `misses_candidates`. */
  explicit RowComparison(const RowGrounds& grounds) : grounds_(grounds) {}

  /** Rows that follow from an event of the log. @param recorded with all rows of this event. */
  void Take(const Rows& derived, const Rows& recorded);
  /** Recorded rows, after all events of the log. */
  void TakeRecorded(const Rows& recorded);

  /** A sentence for each row of an event that differs, is recorded without such an event, or is not recorded:
  "decisions, event 7: outcome certified, by its event abstain_safety". Recorded ones first, in the order of their
  events. */
  [[nodiscard]] std::vector<std::string> Finish() const;

 private:
  struct Difference {
    std::string known_order, unknown_order;  // how it differs if the order of messages is known, and if not
  };
  struct Table {
    std::map<std::int64_t, Difference> differences;  // by event
    std::set<std::int64_t> unrecorded;               // events
    EventNumbers derived;
  };

  template <class Row>
  void Compare(Table& table, const std::vector<Row>& derived, const std::vector<Row>& recorded);

  const RowGrounds& grounds_;
  Table decisions_, events_, transitions_;
};

}  // namespace forereach
