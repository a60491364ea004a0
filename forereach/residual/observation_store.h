/** A set of observations that can grow while other threads query it.

One thread at a time inserts and compacts. Any number of threads take snapshots and query them, and no query waits for
the construction of an index. New observations are appended to a tail, which queries scan completely. A full tail
becomes an index, together with the last indexes that are not much larger: N observations lie in O(log N) indexes, and
each was indexed O(log N) times. Compact makes one index of all, for the fastest queries. A snapshot contains the
observations at its creation: it stays valid, and gives the same answers, as long as it exists. Answers depend on the
observations alone, not on their indexes, unless a search is capped or observations were dropped.

Every set of observations gives a sound envelope, so nothing here can make a bound wrong: not the tail's limit, not the
budget, not a removal. */
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "forereach/residual/consistency.h"
#include "forereach/residual/envelope_tail.h"
#include "forereach/residual/lipschitz_envelope.h"
#include "forereach/residual/observation_rows.h"

namespace forereach {

struct StoreOptions {
  /** Observations in the tail until an index has to be built, 1 to EnvelopeTail::kMaxCapacity. A query looks at all. */
  int tail_capacity = 256;
  /** Observations an index may hold, at least 1: memory is 8 (d_z + 2 n + 1) bytes for each, and what ObservationIndex
  states, twice while one is built. When Compact finds more, it keeps those that attain the envelope, MostUseful. */
  std::size_t max_observations = 10'000'000;
  EnvelopeOptions envelope;
};

class ObservationStore final {
 private:
  struct Entry;
  struct Piece;
  struct Generation;
  class PartnerSearch;

 public:
  class Snapshot final : public ResidualEnclosure {
   public:
    void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override;
    [[nodiscard]] std::size_t size() const;
    /** A provable contradiction among the observations, by their ids: then no residual is admissible. */
    [[nodiscard]] const std::optional<Violation>& violation() const { return violation_; }
    /** The ids of those that the budget has kept, in ascending order. */
    [[nodiscard]] std::vector<int> ids() const;
    /** As LipschitzEnvelope's. */
    [[nodiscard]] bool uses_hull_distance() const;

   private:
    friend class ObservationStore;
    std::shared_ptr<const Generation> generation_;
    int tail_size_ = 0;
    std::optional<Violation> violation_;
  };

  /** Observations get the ids 0, 1, ... in their order. @param domain as of LipschitzEnvelope.
  @throws std::invalid_argument if the declaration does not fit, there are none, or an option is out of its range. */
  ObservationStore(Declaration declaration, const Observations& observations, std::span<const double> domain_lower,
                   std::span<const double> domain_upper, const StoreOptions& options = {});
  ~ObservationStore();

  /** All that is known now. Cost: a lock for the time of copying a pointer. */
  [[nodiscard]] Snapshot snapshot() const;

  struct Insertion {
    int id = -1;  ///< -1 if it was refused: not finite, lower > upper, or z outside the domain.
    std::optional<Violation>
        violation;  ///< The first found with an earlier observation, if any; it is added all the same.
  };
  /** Adds one observed transition, d_z and n entries, and tests it against all others: about a microsecond. When the
  tail is full it builds an index first: of O(log N) observations for each one inserted, all told. */
  Insertion Insert(std::span<const double> z, std::span<const double> lower, std::span<const double> upper);

  /** Puts indexes and tail into one index and keeps to the budget. May run beside Insert, in a thread of its own. */
  void Compact();

  /** How full the tail is, so that a thread that has the time can compact before it must. */
  [[nodiscard]] int tail_size() const;

 private:
  std::shared_ptr<Generation> Build(ObservationRows rows, std::vector<Piece> pieces) const;
  void Merge(bool all);
  void RaiseLimits(const Entry& entry);
  void Replace(const Generation& old, std::shared_ptr<Generation> fresh, int merged);
  Insertion Enlist(const Entry& entry);
  bool Violated() const;

  const Declaration declaration_;
  const std::vector<double> domain_lower_, domain_upper_;
  StoreOptions options_;

  std::mutex compacting_;       // one at a time; taken before the others
  std::vector<double> limits_;  // of every index, LipschitzEnvelope::RaiseLimits
  std::mutex writing_;          // the tail's end, next_id_; taken before current_lock_
  int next_id_ = 0;
  mutable std::mutex current_lock_;  // the two below, to copy or set them
  std::shared_ptr<Generation> current_;
  std::optional<Violation> violation_;
};

}  // namespace forereach
