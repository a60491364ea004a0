/** The plan ids that each source has used, so that no candidate is decided twice, and the number of lost candidates.

A source may use a plan_id once. Candidates may be decided in any order: for each source the kWindow plan_ids below the
highest are stored, and older ones count as used. When a source has been silent for so long that its earlier candidates
are stale, it is forgotten if another source needs the place. So neither invented sources nor a huge plan_id block other
sources for long. */
#pragma once

#include <algorithm>
#include <bitset>
#include <cstdint>
#include <map>
#include <string>

#include "forereach/candidate_plan_t.hpp"
#include "lcmtypes/stream_order.h"

namespace forereach {

class Sources final {
 public:
  static constexpr std::size_t kMaxSources = 16;
  static constexpr int kWindow = 1024;

  enum class Admission { kNew, kUsed, kTooManySources };

  /** @param forget_after_us a source may be forgotten when it has sent no new candidate for this long, microseconds; at
  least the time for which a candidate stays fresh. */
  explicit Sources(std::int64_t forget_after_us) : forget_after_us_(forget_after_us) {}

  /** Continues with the state of another object, after a reload. forget_after_us stays this object's own. */
  void Inherit(const Sources& before);

  /** Counts a candidate for the number of lost ones. Call it once for every candidate that decodes, before Admit.
  Candidates may arrive in any order. A source has restarted if stream_order.h gives kRestarted. */
  void Hear(const candidate_plan_t& candidate, std::int64_t now_us);

  /** Whether the candidate's plan_id is new. If it is, it counts as used from now on. Cost O(log sources). */
  [[nodiscard]] Admission Admit(const candidate_plan_t& candidate, std::int64_t now_us);

  /** Whether Admit would say kUsed. */
  [[nodiscard]] bool IsUsed(const candidate_plan_t& candidate, std::int64_t now_us) const;

  /** The number of lost candidates, from gaps in their `sequence`. */
  [[nodiscard]] std::int64_t lost() const;
  /** The highest plan_id that the candidate's source has used; 0 for an unknown source. */
  [[nodiscard]] std::int64_t HighestPlanId(const candidate_plan_t& candidate) const;

 private:
  struct Source {
    std::int64_t highest = 0, heard_us = 0;
    std::bitset<kWindow> used;  // bit i: highest - i
    StreamOrder order;          // the newest is of the largest sequence
    std::int64_t first_sequence = 0, came = 0;

    void ForgetAllBut(std::int64_t plan_id);
    [[nodiscard]] bool Uses(std::int64_t plan_id) const;
    [[nodiscard]] bool Use(std::int64_t plan_id);
    void StartCounting(const StreamPosition& position, std::int64_t horizon_us);
    [[nodiscard]] std::int64_t last_sequence() const { return order.newest()->sequence; }
    [[nodiscard]] std::int64_t lost() const {  // not below 0, since repetitions count as arrived
      return std::max<std::int64_t>(last_sequence() - first_sequence + 1 - came, 0);
    }
  };

  [[nodiscard]] static std::string NameOf(const candidate_plan_t& candidate);
  [[nodiscard]] std::int64_t Horizon(std::int64_t now_us) const;
  /** Whether the source has been silent for forget_after_us_. After the clock was set back, a source heard in the
  future counts as silent. */
  [[nodiscard]] bool IsSilent(const Source& source, std::int64_t now_us) const;
  bool MakeRoom(std::int64_t now_us);

  std::int64_t forget_after_us_;
  std::map<std::string, Source> sources_;
  std::int64_t lost_before_ = 0;  // losses of sources that were forgotten or restarted
};

}  // namespace forereach
