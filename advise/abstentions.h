/** Recorded abstentions with everything that they were judged by, for `forereach advise` and the page. */
#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "advise/case.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "records/kept_obstacles.h"
#include "records/log_tasks.h"
#include "records/log_trust.h"
#include "records/run_logs.h"
#include "records/timeline.h"
#include "task/config.h"

namespace forereach {

struct RecordedAbstention {
  std::string name;                     ///< Identifies it to people.
  std::string event;                    ///< Its decision's, RecordedDecision::event; empty for a document.
  std::string message;                  ///< The recorded sentence.
  std::int16_t outcome = 0, cause = 0;  ///< As in decision_t.
  const Config* task = nullptr;
  /** What it was judged by; without controls it was answered without a judgement. Of one of a log, Judged() has
  problem and obstacles, which are made of `basis` when they are needed. */
  Case judged;
  Basis basis;
  std::string missing;  ///< Why it cannot be judged again; empty if it can, or was never judged.
  /** How many candidates of the log waited when it was answered, with itself. */
  std::size_t waiting = 0;
  /** The last message on the channel of obstacles before the answer, and when it arrived; null if there was none. */
  std::shared_ptr<const std::pair<std::vector<std::uint8_t>, std::int64_t>> last_obstacles;
  decision_t decision{};         ///< Zeros if it was read from a decision's document.
  candidate_plan_t candidate{};  ///< Zeros likewise.

  [[nodiscard]] bool was_judged() const { return judged.controls.size() > 0; }
  /** @pre was_judged(). Cost: a copy of the problem, if something was learned. */
  [[nodiscard]] Case Judged() const;
};

/** Those of one run. */
struct Abstentions {
  std::vector<std::shared_ptr<const Config>> tasks;
  std::deque<RecordedAbstention> all;  ///< Abstentions and rejections, in the order of the log.
  std::int64_t left_out = 0;           ///< So many before them.
  std::int64_t certified = 0;
  PassedOver passed_over{};
};

/** The one, or the certificate, of a decision's document.
@param config the task file; empty: the one that the document names.
@throws ConfigError with file and field for what is no decision. */
[[nodiscard]] Abstentions AbstentionOf(const std::string& document, const std::string& config);

/** Collects the last `most` of a timeline. */
class AbstentionReader final : public TimelineUser {
 public:
  explicit AbstentionReader(std::size_t most) : most_(most) {}

  void OnEvent(const LogEvent& event) override;
  void OnStart(const Config& task) override;
  void OnDecision(const RecordedDecision& recorded) override;

  /** @param tasks those of the timeline. The result has nothing of what was passed over. */
  [[nodiscard]] Abstentions Finish(std::vector<std::shared_ptr<const Config>> tasks);

  /** Those so far. */
  [[nodiscard]] std::list<RecordedAbstention>& all() { return all_; }

 private:
  const std::size_t most_;
  BusOptions channels_;
  std::size_t waiting_ = 0;
  std::shared_ptr<const std::pair<std::vector<std::uint8_t>, std::int64_t>> last_obstacles_;
  Abstentions read_;
  std::list<RecordedAbstention> all_;
  KeptObstacles obstacles_;  // of these
};

/** The last `most` of a run's logs.
@param names_files whether events are named with their log.
@throws BadInput for logs that cannot be read, or without their task. */
[[nodiscard]] Abstentions ReadAbstentions(const RunLogs& run, const RunTasks& tasks, bool names_files,
                                          std::size_t most);

}  // namespace forereach
