/** The certifier's heartbeat: when one is due, and what it reports.

A heartbeat is due kPeriodUs after the last one, at once after something changed that a person has to see, and every
kToOthersUs while another certifier has to hear of this one. Of time it knows what it is given; it sends nothing. */
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "bus/node.h"
#include "certifier/gate/charge.h"
#include "certifier/gate/gate.h"
#include "certifier/gate/watch.h"
#include "certifier/process/candidate_queue.h"
#include "certifier/process/contradictions.h"
#include "certifier/process/fault_latch.h"
#include "certifier/process/task_reload.h"
#include "forereach/certifier_status_t.hpp"

namespace forereach {

/** What a certifier in shadow mode says in each heartbeat and in its log. */
inline constexpr const char* kShadowWarning = "SHADOW: decides and records, certifies nothing";

class StatusReporter final {
 public:
  static constexpr std::int64_t kPeriodUs = 500'000;
  static constexpr std::int64_t kToOthersUs = 100'000;  ///< While it listens for others, and to one that does.

  /** What is reported on. All outlive this object. */
  struct Parts {
    const BusOptions& channels;
    const Bus& bus;
    const Sender& sender;
    const Watch& watch;
    const Charge& charge;
    const Contradictions& contradictions;
    const FaultLatch& latch;
    const TaskReload& reload;
    CandidateQueue& queue;
  };
  /** Counted by the node. */
  struct Counts {
    std::int64_t faults = 0;
    std::int64_t withdrawals = 0;    ///< Without repetitions.
    std::int64_t refused = 0;        ///< Messages.
    std::int64_t left_to_other = 0;  ///< Candidates that another certifier has to decide on.
    bool obstacles_refused = false;  ///< Since the last report.
  };

  explicit StatusReporter(const Parts& parts) : parts_(parts) {}

  /** The next report is due at once. */
  void Hurry() { next_us_ = 0; }
  /** Another certifier listens: it has to hear of this one before it takes charge. */
  void HurryToOthers();
  /** @param steady_us time of a monotonic clock, microseconds. */
  [[nodiscard]] bool IsDue(std::int64_t steady_us) const { return steady_us >= next_us_; }
  /** True until the first report in charge. */
  [[nodiscard]] bool IsFirst() const { return reports_ == 0; }
  /** Counts decisions and reports from 0 again: what the gate had learned is forgotten. */
  void Restart();

  /** A decision was made in this time, ... */
  void CountDecision(double elapsed_us) { elapsed_us_[decided_++ % elapsed_us_.size()] = elapsed_us; }
  /** ... with so many page faults. Those of the first decision do not count. To be called before CountDecision. */
  void CountPageFaults(std::int64_t count) { page_faults_ += decided_ > 0 ? count : 0; }

  /** The heartbeat to send now. */
  [[nodiscard]] certifier_status_t Report(const Gate& gate, std::int64_t now_us, std::int64_t steady_us);

  /** All counts, as one JSON object. */
  [[nodiscard]] std::string Summary(const Gate& gate) const;

  Counts counts;

 private:
  [[nodiscard]] bool IsInCharge() const { return parts_.charge.state() == Charge::State::kInCharge; }
  [[nodiscard]] bool IsContradicted(const Gate& gate) const;
  [[nodiscard]] std::int16_t State() const;
  [[nodiscard]] std::int16_t Level(const Gate& gate) const;
  [[nodiscard]] std::string WhyNotOk(const Gate& gate) const;
  void AddBusCounts(certifier_status_t& status) const;
  [[nodiscard]] double ElapsedPercentile(double fraction) const;

  const Parts parts_;
  std::int64_t last_us_ = 0, next_us_ = 0;        // by the steady clock
  std::int64_t reports_ = 0, reports_aside_ = 0;  // in charge, and not
  std::int64_t page_faults_ = 0;
  Refusals refused_before_;                // at the last report
  std::array<double, 1024> elapsed_us_{};  // of the last decisions, a ring
  std::size_t decided_ = 0;
};

}  // namespace forereach
