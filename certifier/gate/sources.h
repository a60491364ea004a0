/** Who has sent which candidates: none is decided on twice, and what never arrived is counted.

A plan_id may be used once. Candidates need not be taken up in their order: of each source the last kWindow plan_ids
below the highest are told apart, older ones count as used. What a source has used is forgotten when it has been silent
for so long that whatever it sent before would be stale now, and it makes room for another, so neither invented sources
nor a huge plan_id lock anybody out for long. */
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

  /** @param forget_after_us a source is forgotten when none of its candidates was new for so long: at least as long as
  a candidate stays fresh. */
  explicit Sources(std::int64_t forget_after_us) : forget_after_us_(forget_after_us) {}

  /** Goes on where others' counting stops. How long a source is remembered stays as given to these. */
  void Inherit(const Sources& before);

  /** Every candidate that decodes, once, before any other question about it. They may come in any order; a source has
  restarted where stream_order.h says kRestarted. */
  void Hear(const candidate_plan_t& candidate, std::int64_t now_us);

  /** If it is new, its plan_id is used from now on. */
  [[nodiscard]] Admission Admit(const candidate_plan_t& candidate, std::int64_t now_us);

  /** Candidates missing between those that came, by their `sequence`. */
  [[nodiscard]] std::int64_t lost() const;
  /** The highest plan_id a source has used; 0 if it is not known. */
  [[nodiscard]] std::int64_t HighestPlanId(const candidate_plan_t& candidate) const;

 private:
  struct Source {
    std::int64_t highest = 0, heard_us = 0;
    std::bitset<kWindow> used;  // bit i: highest - i
    StreamOrder order;          // the newest is of the largest sequence
    std::int64_t first_sequence = 0, came = 0;

    void ForgetAllBut(std::int64_t plan_id);
    [[nodiscard]] bool Use(std::int64_t plan_id);
    void StartCounting(const StreamPosition& position, std::int64_t horizon_us);
    [[nodiscard]] std::int64_t last_sequence() const { return order.newest()->sequence; }
    [[nodiscard]] std::int64_t lost() const {  // repetitions came too, so not below 0
      return std::max<std::int64_t>(last_sequence() - first_sequence + 1 - came, 0);
    }
  };

  [[nodiscard]] static std::string NameOf(const candidate_plan_t& candidate);
  [[nodiscard]] std::int64_t Horizon(std::int64_t now_us) const;
  /** For so long that it may be forgotten. A clock that was set back leaves no source remembered from the future. */
  [[nodiscard]] bool IsSilent(const Source& source, std::int64_t now_us) const;
  bool MakeRoom(std::int64_t now_us);

  std::int64_t forget_after_us_;
  std::map<std::string, Source> sources_;
  std::int64_t lost_before_ = 0;  // of sources that made room or began anew
};

}  // namespace forereach
