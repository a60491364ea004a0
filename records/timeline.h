/** A recorded run in the order of the certifier: the one reading of logs that replay, verify, report and summary share.

The timeline follows the certifier through event logs: when its process started, when it was reloaded, which obstacles
and learned transitions each decision rests on. It pairs each candidate with its decision and its certified plan.

**Authentic messages.** With a key, messages that are not authentic (log_authenticator.h) are passed over and counted.

**Starts and reloads.** Heartbeats, decisions and certified plans each have a count of their own (StreamOrder). A
process has started when one of these counts begins anew and no other one has told of this start yet, and with a first
heartbeat of sequence 0. A log may begin in the middle of a process's life, which is no start. A reload is told by the
version in a heartbeat, or by a decision under the config digest of another task. A start forgets what was heard and
learned. A reload forgets what was learned. Heartbeats of a certifier that is not in charge tell nothing.

**Grounds.** A certifier may have decided before it received a message that the log already holds. A decision names the
digests of its obstacles and observations, so for each of the two the timeline advances from the state of the decision
before to the first logged state with that digest. If there is none, it advances to the last state that was logged
before the candidate; the digests of the basis then differ from those that the decision names. */
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "certifier/gate/obstacles_in_force.h"
#include "certifier/gate/robot_messages.h"
#include "certifier/task/config.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "lcmtypes/grounds.h"
#include "lcmtypes/stream_order.h"
#include "records/event_log.h"
#include "records/log_authenticator.h"
#include "records/log_trust.h"
#include "records/undecided.h"

namespace forereach {

/** The inputs of one decision, as the log tells them. */
struct Basis {
  const Config* task = nullptr;
  Grounds grounds;  ///< By the log; those that the decision names are in its message.
  std::shared_ptr<const std::vector<Obstacle>> obstacles;
  /** The learned transitions that count, of Timeline::learned(task): [learned_begin, learned_end). */
  std::size_t learned_begin = 0, learned_end = 0;
};

struct RecordedCandidate {
  std::vector<std::uint8_t> bytes;  ///< Of a candidate_plan_t, without signature; any bytes.
  std::string event;                ///< "events-....lcmlog event 17"; without the file if there is one only.
  std::int64_t place = 0;           ///< In the order of the log.
};

struct RecordedDecision {
  decision_t decision;
  std::string event;
  std::optional<RecordedCandidate> candidate;  ///< Nothing: it is not in the log.
  /** The decision's config digest is that of a known task, or one task alone is known. Otherwise `basis` is the state
  under the task in force. */
  bool is_of_known_task = true;
  Basis basis;
};

struct RecordedPlan {
  certified_plan_t certified;
  std::string event;
  bool has_candidate = false;  ///< Its candidate is in the log.
  bool is_of_known_task = true;
  Basis basis;
};

/** What a reader of a timeline is told, in the order of the certifier. */
class TimelineUser {
 public:
  TimelineUser() = default;
  virtual ~TimelineUser() = default;
  TimelineUser(const TimelineUser&) = delete;
  TimelineUser& operator=(const TimelineUser&) = delete;

  virtual void OnEvent(const LogEvent&) {}  ///< Each authentic message, before it is acted on.
  virtual void OnStart(const Config&) {}    ///< The process starts under this task.
  virtual void OnReload(const Config&) {}   ///< It goes on under this task.
  virtual void OnObstacles(Bytes /*message*/, std::int64_t /*utime*/) {}      ///< Another set is in force.
  virtual void OnTransition(const ExecutedTransition&, Bytes /*message*/) {}  ///< A transition is learned.
  virtual void OnDecision(const RecordedDecision&) {}
  virtual void OnCertified(const RecordedPlan&) {}
};

/** For Timeline, which does not own its tasks. */
[[nodiscard]] std::vector<const Config*> PointersTo(const std::vector<Config>& tasks);

class Timeline final {
 public:
  /** @param tasks at least one, which have to outlive the timeline. Channels and key are those of the first. Where
  there is one task alone, decisions of any config digest count as its own.
  @param user has to outlive the timeline. @throws KeyError if the key cannot be read. */
  Timeline(std::vector<const Config*> tasks, TimelineUser& user);

  /** Reads event logs that follow one another, as the files of one run do, behind those that were read before.
  @param names_files names of events have the name of the log. @throws LogError if one cannot be read. */
  void Read(const std::vector<std::string>& logs, bool names_files);

  /** The next logs are of these tasks, at least one. If the task in force is not among them, the process has started
  under the first. */
  void SetTasks(std::vector<const Config*> tasks);

  [[nodiscard]] const LogDamage& damage() const { return damage_; }
  [[nodiscard]] PassedOver passed_over() const { return {authenticator_.refusals(), undecodable_}; }
  [[nodiscard]] std::int64_t candidates() const { return candidates_; }
  [[nodiscard]] const Undecided<RecordedCandidate>& undecided() const { return undecided_; }
  /** All transitions that were learned under a task, in the order of the log. */
  [[nodiscard]] const std::vector<ExecutedTransition>& learned(const Config& task) const { return learned_.at(&task); }
  /** The obstacles by everything that was logged. */
  [[nodiscard]] const std::vector<Obstacle>& logged_obstacles() const { return logged_obstacles_.all(); }

 private:
  /** One of the certifier's counts, and the number of starts that it has told of or that were told before it began. */
  struct Count {
    StreamOrder order;
    std::int64_t starts = 0;
  };
  /** What a message tells by its count. kStarts: a start that no other count has told of; kFollows: one that another
  has; kOld: the message is late or repeated. */
  enum class Told { kGoesOn, kStarts, kFollows, kOld };
  struct Decided {
    Basis basis;
    bool has_candidate;
  };
  struct ObstaclesChange {
    std::int64_t place, utime;
    std::vector<std::uint8_t> bytes;
    ObstaclesInForce after;
  };
  struct Transition {
    std::int64_t place;
    ExecutedTransition transition;
    std::vector<std::uint8_t> bytes;
    Digest after;  // of the observations
  };

  void Take(const LogEvent& event, const std::string& name);
  void TakeObstacles(const LogEvent& event);
  void TakeTransition(const LogEvent& event);
  void TakeStatus(const LogEvent& event);
  void TakeDecision(const LogEvent& event, const std::string& name);
  void TakeCertified(const LogEvent& event, const std::string& name);

  [[nodiscard]] Told Heed(Count& count, const StreamPosition& message, const LogEvent& event);
  void Start();
  void Reload();
  void Follow(ObstaclesInForce obstacles);
  void FollowReload(const Config& task);
  [[nodiscard]] const Config* TaskOf(const Digest& config) const;

  /** @param candidate_place -1 if the log has no candidate: without a state of these digests nothing advances. */
  [[nodiscard]] Basis Advance(const Grounds& named, std::int64_t candidate_place);
  [[nodiscard]] Basis Current() const;
  void TakeNextObstacles();
  void LearnNext();

  std::vector<const Config*> tasks_;
  TimelineUser& user_;
  const BusOptions channels_;
  LogAuthenticator authenticator_;

  const Config* now_;            // in force
  bool reloaded_ahead_ = false;  // of the heartbeat that will tell of it
  bool has_begun_ = false;       // the user was told of a start
  std::int64_t starts_ = 0, version_ = 0;
  Count heartbeats_, decisions_, certified_;

  std::int64_t place_ = 0, undecodable_ = 0, candidates_ = 0;
  LogDamage damage_;
  Undecided<RecordedCandidate> undecided_;
  std::map<Digest, Decided> decided_;  // by plan; of several decisions on one plan the last CERTIFIED, if there is one

  // State at the last decision, and by everything that was logged; what lies between the two.
  std::shared_ptr<const std::vector<Obstacle>> obstacles_;
  Digest obstacles_digest_{}, observations_digest_{};
  std::size_t learned_begin_ = 0;
  ObstaclesInForce logged_obstacles_;
  Digest logged_observations_{};
  std::deque<ObstaclesChange> obstacles_ahead_;
  std::deque<Transition> transitions_ahead_;
  std::map<const Config*, std::vector<ExecutedTransition>> learned_;
};

}  // namespace forereach
