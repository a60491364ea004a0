/** The cases of one run (its decisions, plans and withdrawals), divided among shards: each reads the run to its end, so
that it knows what every case rests on, and judges its own cases. */
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace forereach {

/** Judges the cases whose number in the run is `index` modulo `count`. By default all of them. */
struct Shard {
  int index = 0, count = 1;
};

inline constexpr int kMostShards = 100'000;

/** The shard I/N that a command line names, I from 1; all cases for an empty text. @throws ConfigError. */
[[nodiscard]] Shard ShardOf(const std::string& text);

/** What one shard, or all of them together, found in a run. A Result is added up with +=. */
template <class Result>
struct CaseResults {
  Result of_run;                        ///< Beside the cases. The same in every shard.
  std::int64_t cases = 0;               ///< The cases so far, judged here or not. The same in every shard.
  Result counts;                        ///< Of the cases that are only counted.
  std::map<std::int64_t, Result> told;  ///< Of the others, by their number: their order shows in the result.

  /** The next case has come. @return whether this shard judges it. */
  [[nodiscard]] bool Next(const Shard& shard) { return cases++ % shard.count == shard.index; }
  /** What is told of the case that came last. */
  [[nodiscard]] Result& Tell() { return told[cases - 1]; }

  /** Adds what another shard found in the same run. @pre it has other cases. */
  void Join(CaseResults other) {
    counts += std::move(other.counts);
    told.merge(other.told);
  }
  /** The result of the run. */
  [[nodiscard]] Result Sum() && {
    Result sum = std::move(of_run);
    sum += std::move(counts);
    for (auto& [number, one] : told) sum += std::move(one);
    return sum;
  }
};

}  // namespace forereach
