/** What the live page shows, from the messages of the bus. It uses no bus, socket or clock: a test hands it messages.

**Trust.** With keys, messages that their role did not sign are counted and have no other effect
(records/log_trust.h). Without keys every message counts, and the page says so.

**Bounds.** Of each kind of record the last ones are kept, so no sender can make it grow. A few tubes are drawn in each
tick, those of certificates first; the other decisions are shown without theirs.

**Tubes** are of candidates that this program decides again, with the obstacles and observations that the timeline
(records/timeline.h) finds on the bus as it does in a log. Where it decides otherwise, as a page that began later than
the certifier may, a certified plan is shown by the boxes of its certificate. */
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "forereach/certified_plan_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "forereach/certify/tube.h"
#include "forereach/logger_status_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "page/page_data.h"
#include "records/interpreter.h"
#include "records/recorded_case.h"
#include "records/timeline.h"
#include "records/undecided.h"
#include "task/config.h"

namespace forereach {

/** Messages that were lost before the watcher. */
struct LiveLosses {
  std::int64_t dropped = 0;            ///< Bus::dropped
  std::int64_t datagrams_refused = 0;  ///< Bus::datagrams
};

/** Records as texts, of which the last are kept. They are numbered from 0. */
class LiveFeed final {
 public:
  explicit LiveFeed(std::size_t most) : most_(most) {}

  void Add(std::string text);
  /** Appends the texts from number `from` to before `to`, at most end(), with commas between them. */
  void Append(std::int64_t from, std::int64_t to, std::string& out) const;
  [[nodiscard]] std::int64_t end() const { return first_ + std::ssize(texts_); }

 private:
  std::size_t most_;
  std::int64_t first_ = 0;
  std::deque<std::string> texts_;
};

class Watcher final : TimelineUser {
 public:
  static constexpr std::int64_t kTickUs = 100'000;  ///< Between two updates of the page.
  static constexpr int kTubesInATick = 3;
  static constexpr std::size_t kDecisions = 120, kOthers = 60, kPlaces = 600;
  static constexpr std::size_t kMostTasks = 64;  ///< Of the task file, as it changes.

  using ReadAgain = std::function<Config()>;

  /** @param task of the certifier. @param keys public keys suffice.
  @param read_again reads the task file again, for a certifier that names another one; may throw BadInput. */
  Watcher(Config task, std::optional<KeyRing> keys, ReadAgain read_again);

  /** The next message of the bus, as it arrived. One thread at a time calls Take and Tick. */
  void Take(const LogEvent& event) { timeline_.Take(event, ""); }

  /** Draws what was decided since the last call, and updates the page. */
  void Tick(std::int64_t now_us, const LiveLosses& losses = {});

  /** What never changes: data of the page's document. */
  [[nodiscard]] nlohmann::json Beginning() const;

  /** How far a reader has read. */
  struct Cursor {
    std::array<std::int64_t, 6> of_feed{};
    std::int64_t obstacles = 0, tick = 0;
  };
  /** One line of JSON with everything that is new for a reader, and the state of now; empty if nothing is. Any thread
  may call it. */
  [[nodiscard]] std::string Since(Cursor& cursor) const;

 private:
  struct Decided {
    DecisionRow row;
    RecordedDecision recorded{};
    std::shared_ptr<const certified_plan_t> certificate{};
  };
  enum Feed { kDecisionFeed, kFaultFeed, kWithdrawalFeed, kEventFeed, kGapFeed, kPlaceFeed };

  [[nodiscard]] std::size_t MostLearned() const override { return 200'000; }
  void OnEvent(const LogEvent& event) override;
  void OnDecision(const RecordedDecision& recorded) override;
  void OnCertified(const RecordedPlan& recorded) override;
  void OnWithdrawn(const RecordedWithdrawal& recorded) override;

  [[nodiscard]] const Config& task() const { return *tasks_.back(); }
  [[nodiscard]] const Config* Find(const Digest& config);
  void TakeRows(const LogEvent& event);
  void SkipFirst();
  [[nodiscard]] bool TakeMessage(const LogEvent& event);
  [[nodiscard]] bool TakeState(const LogEvent& event);
  [[nodiscard]] bool TakeStatus(const LogEvent& event);
  [[nodiscard]] bool TakeFault(const LogEvent& event);

  [[nodiscard]] std::string ObstaclesSvg(std::int64_t now_us) const;
  [[nodiscard]] std::vector<bool> ChooseDrawn() const;
  [[nodiscard]] nlohmann::json DecisionJson(const Decided& decided, bool is_drawn);
  void Draw(const Decided& decided, PageDetail& detail);
  void DrawBoxes(const Decided& decided, PageDetail& detail) const;
  [[nodiscard]] nlohmann::json NowJson(std::int64_t now_us, const LiveLosses& losses) const;
  [[nodiscard]] nlohmann::json RobotJson() const;
  void Add(Feed feed, const nlohmann::json& record);

  std::vector<std::shared_ptr<const Config>> tasks_;  // the file as it was read, the last one as it is
  const std::optional<KeyRing> keys_;
  const ReadAgain read_again_;
  Interpreter interpreter_;
  Timeline timeline_;
  CaseCertifier certifier_;
  std::int64_t now_us_ = 0;  // of the last message
  Digest tried_{};           // the config digest for which the file was read again last
  std::int64_t tried_us_ = 0;
  std::string other_task_;  // why tubes may be missing

  Undecided<std::shared_ptr<const certified_plan_t>> certificates_{16};
  std::vector<Decided> decided_;                              // since the last tick
  KeptObstacles obstacles_;                                   // of these
  std::int64_t skipped_ = 0;                                  // decisions of one tick that were too many to be shown
  std::deque<std::pair<std::int64_t, std::int64_t>> faults_;  // which are repeated
  std::optional<std::pair<std::int64_t, certifier_status_t>> status_;  // and when it arrived
  std::optional<std::pair<std::int64_t, logger_status_t>> logger_;
  std::optional<std::pair<std::int64_t, robot_state_t>> state_;
  std::unique_ptr<Tube> tube_;
  Eigen::AlignedBox2d frame_;  // of the decision that was drawn last

  struct Counts {
    std::int64_t messages = 0, undecodable = 0, decisions = 0, lost = 0, gaps = 0;
    std::map<std::string, std::int64_t> by_outcome, by_cause;
  } counts_;

  mutable std::mutex mutex_;  // guards what Since reads
  std::array<LiveFeed, 6> feeds_{LiveFeed{kDecisions}, LiveFeed{kOthers}, LiveFeed{kOthers},
                                 LiveFeed{kOthers},    LiveFeed{kOthers}, LiveFeed{kPlaces}};
  std::array<std::int64_t, 6> ends_{};  // of the feeds at the last tick, so that all of a reader's news is of one time
  std::string now_, set_;
  std::int64_t obstacles_number_ = 0, tick_ = 0;
};

}  // namespace forereach
