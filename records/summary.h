/** The numbers of a run, from a log or from the database: proposals, decisions, and the robot's drive. */
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include "records/database.h"
#include "records/event_log.h"
#include "records/interpreter.h"
#include "records/log_trust.h"
#include "records/timeline.h"
#include "task/config.h"

namespace forereach {

/** Nearest-rank quantiles of durations in microseconds; NaN if there are none. */
struct Quantiles {
  double p50 = kNoNumber, p99 = kNoNumber;

  /** False also if all durations are zero, as on the simulated clock of `forereach run`, which stops during
  computations. */
  [[nodiscard]] bool WasMeasured() const { return p99 > 0; }
};

struct Summary {
  static constexpr std::size_t kMaxChannels = 256;  ///< A sender that invents channels must not fill the memory.

  /** By channel; those beyond kMaxChannels as "*". Empty if made from a database. */
  std::map<std::string, std::int64_t> messages;
  double duration_s = 0;  ///< From the first message to the last, without the steps of the logger's clock.
  /** Messages that came a second before the last one by the logger's clock, or an hour behind it; the first of them,
  the time before it, and by how much. Latencies across one are left out. Of logs alone. */
  std::int64_t clock_steps = 0, first_step_event = -1, first_step_utime = 0, first_step_us = 0;
  std::int64_t proposed = 0;  ///< Candidates; from a database, decisions.
  std::int64_t decided = 0, certified = 0;
  std::string holds;  ///< When certificates of the task hold, as HoldsName; empty if the task is not known.
  std::map<std::string, std::int64_t> abstained, rejected;  ///< By cause.
  Quantiles latency_us;                      ///< Time between the receipts of candidate and decision at the logger.
  Quantiles certify_us;                      ///< Time of the certify step only.
  std::optional<double> distance_to_goal_m;  ///< At the last known state; no value without a goal or a state.
  double goal_radius_m = 0;                  ///< The goal is reached within this distance.
  bool goal_reached = false;                 ///< At any time of the run.
  std::int64_t contacts = 0;
  bool has_limits = false;           ///< Whether the task, if it is known, has limits.
  std::int64_t limits_exceeded = 0;  ///< Counted at each step boundary.
  /** Executed steps by where the state lay at their end: inside its slice, consistent with it, outside (left). */
  std::int64_t steps_inside = 0, steps_consistent = 0, steps_outside = 0;
  /** Before the goal: braking tails that began, and stops at a plan's end, after a step outside its slice or for a
  withdrawal. */
  std::int64_t tails = 0, stops = 0;
  std::int64_t refused = 0;                    ///< Certified plans that the guard refused.
  std::int64_t withdrawals = 0;                ///< Withdrawals that the robot has answered, without repetitions.
  std::map<std::string, std::int64_t> faults;  ///< That the certifier has latched, by cause, without repetitions.
  std::int64_t emergency_stops = 0;            ///< Stops for a withdrawal that no certificate covers.
  std::map<std::string, std::int64_t> lost;    ///< Messages missing, by reason.
  std::int64_t backlog = 0;   ///< Messages that the bus discarded before the logger took them (rows.h).
  std::int64_t restarts = 0;  ///< Restarts of senders.
  LogDamage damage;           ///< Damage of the logs.
  PassedOver passed_over;     ///< Messages of the logs that were skipped.
};

/** Text for people, in aligned lines that end with a newline. */
[[nodiscard]] std::string ToText(const Summary& summary);
[[nodiscard]] nlohmann::json ToJson(const Summary& summary);

/** Collects a summary from single messages and rows in bounded memory. Quantiles are those of the last kMaxSamples
durations. */
class SummaryBuilder final {
 public:
  static constexpr std::size_t kMaxSamples = 1 << 16;

  explicit SummaryBuilder(const Config& config);

  /** The goal and the limits are this task's. */
  void SetTask(const Config& config);

  /** Adds the next message of the log. Add the rows that the interpreter makes of it separately. */
  void Add(const LogEvent& event);
  void Add(const DecisionRow& row);
  void Add(const EventRow& row);
  void Add(const GapRow& row);
  void Add(const Rows& rows);

  [[nodiscard]] Summary Finish() const;

 private:
  void TakeTime(const LogEvent& event);

  struct Samples {
    std::vector<double> values;
    std::size_t next = 0;
    void Add(double value);
    [[nodiscard]] Quantiles Get() const;
  };

  BusOptions channels_;
  Eigen::MatrixXd projection_;
  std::vector<double> goal_;
  double goal_radius_m_ = 0;
  Summary summary_;
  Samples latency_, certify_;
  std::optional<std::int64_t> last_utime_;
  std::int64_t elapsed_us_ = 0;
  std::optional<std::pair<std::int64_t, std::int16_t>> fault_;  // the last one
  std::vector<double> state_;
  // Plans, and how many steps stand: the last ones, of which answers may be repeated at one time.
  std::deque<std::pair<std::int64_t, int>> withdrawn_;
};

/** Summarises a timeline. With bus.key only authentic messages count. Damage is skipped and counted. */
class Summarizer final : public TimelineUser {
 public:
  explicit Summarizer(const Config& first) : interpreter_(first.bus, ""), builder_(first) {}

  void OnEvent(const LogEvent& event) override;
  /** @param last whose goal and limits they are. */
  [[nodiscard]] Summary Finish(const Timeline& timeline, const Config& last);

 private:
  Interpreter interpreter_;  // the timeline has looked at the key
  SummaryBuilder builder_;
};
}  // namespace forereach
