/** The numbers of a run, from a log or from the database: proposals, decisions, and the robot's drive. */
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "certifier/task/config.h"
#include "records/database.h"
#include "records/event_log.h"
#include "records/interpreter.h"
#include "records/log_trust.h"

namespace forereach {

/** Nearest-rank quantiles of some microseconds, NaN without any. */
struct Quantiles {
  double p50 = kUnknown, p99 = kUnknown;

  /** False also if all of them are zero: the simulated clock of `forereach run` stands still while something is
  computed. */
  [[nodiscard]] bool WasMeasured() const { return p99 > 0; }
};

struct Summary {
  static constexpr std::size_t kMaxChannels = 256;  ///< A sender that invents channels must not fill the memory.

  /** By channel; those beyond kMaxChannels as "*". Empty if made from a database. */
  std::map<std::string, std::int64_t> messages;
  double duration_s = 0;      ///< From the first message to the last.
  std::int64_t proposed = 0;  ///< Candidates; from a database, decisions.
  std::int64_t decided = 0, certified = 0;
  std::map<std::string, std::int64_t> abstained, rejected;  ///< By cause.
  Quantiles latency_us;                      ///< From a candidate's receipt to its decision's, both at the logger.
  Quantiles certify_us;                      ///< The certify step alone.
  std::optional<double> distance_to_goal_m;  ///< Of the last known state; nothing without goal or state.
  double goal_radius_m = 0;                  ///< The goal counts as reached within this.
  bool goal_reached = false;                 ///< At some time; the robot may have driven on since.
  std::int64_t contacts = 0;
  std::int64_t steps_inside = 0, steps_outside = 0;  ///< Of the slice certified for that step.
  /** Before the goal: braking tails begun, and times the robot came to stand, by a plan's end or a step outside. */
  std::int64_t tails = 0, stops = 0;
  std::int64_t refused = 0;                  ///< Certified plans that the guard refused.
  std::map<std::string, std::int64_t> lost;  ///< Messages missing, by reason.
  std::int64_t backlog = 0;                  ///< Discarded by the bus before the logger took them, see rows.h.
  std::int64_t restarts = 0;                 ///< Restarts of senders.
  LogDamage damage;                          ///< Of the log.
  PassedOver passed_over;                    ///< Messages of the log that count for nothing above.
};

/** Aligned lines for a person, each ended by a newline. */
[[nodiscard]] std::string ToText(const Summary& summary);
[[nodiscard]] nlohmann::json ToJson(const Summary& summary);

/** Collects a summary piece by piece, in memory that does not grow: quantiles are those of the last kMaxSamples
durations. */
class SummaryBuilder final {
 public:
  static constexpr std::size_t kMaxSamples = 1 << 16;

  explicit SummaryBuilder(const Config& config);

  /** One message in the order of the log, with the rows the interpreter made of it added apart. */
  void Add(const LogEvent& event);
  void Add(const DecisionRow& row);
  void Add(const EventRow& row);
  void Add(const GapRow& row);
  void Add(const Rows& rows);

  [[nodiscard]] Summary Finish() const;

 private:
  struct Samples {
    std::vector<double> values;
    std::size_t next = 0;
    void Add(double value);
    [[nodiscard]] Quantiles Get() const;
  };

  BusOptions channels_;
  Eigen::MatrixXd projection_;
  std::vector<double> goal_;
  double goal_radius_m_;
  Summary summary_;
  Samples latency_, certify_;
  std::optional<std::int64_t> first_utime_;
  std::int64_t last_utime_ = 0;
  std::vector<double> state_;
};

/** Of logs that follow one another, as the files of one run do. With bus.key only authentic messages count. Damage is
passed over and counted. Cost: linear in the logs. @throws LogError if a log cannot be read, KeyError if the key cannot.
*/
[[nodiscard]] Summary SummarizeLogs(const std::vector<std::string>& logs, const Config& config);
}  // namespace forereach
