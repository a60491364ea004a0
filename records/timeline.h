/** Reads a recorded run in the order in which the certifier acted. Replay, verify, report and summary read logs only
through this class, and the live page reads the bus through it.

The timeline follows the certifier through event logs: starts of its process, reloads, and the obstacles and learned
transitions of each decision. It pairs each candidate with its decision and its certified plan.

**Authentic messages.** With a key, messages that are not authentic (LogAuthenticator) are passed over and counted.

**Starts and reloads.** Heartbeats, decisions and certified plans each have a count of their own (StreamOrder). A
process has started when one of these counts begins again before another count has shown this start, and with a first
heartbeat of sequence 0. A log may begin while the process already runs, which is not a start. A reload shows in the
version of a heartbeat, or in a decision under the config digest of another task. A start forgets everything that was
received and learned. A reload forgets what was learned. Heartbeats of a certifier that is not in charge are ignored.

**Grounds.** The log may contain a message that the certifier received only after its decision. A decision names the
digests of its obstacles and observations. So for each of the two the timeline advances from the state of the previous
decision to the first logged state with that digest. If there is none, it advances to the last state that was logged
before the candidate; then the digests of the basis differ from those that the decision names. What too many later
messages followed counts as received (TimelineBounds). */
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "certifier/gate/obstacles_in_force.h"
#include "certifier/gate/robot_messages.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/residual/learned_transitions.h"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/grounds.h"
#include "lcmtypes/stream_order.h"
#include "records/event_log.h"
#include "records/kept_obstacles.h"
#include "records/log_tasks.h"
#include "records/log_trust.h"
#include "records/undecided.h"
#include "task/config.h"

namespace forereach {

/** The inputs of one decision, by the log. */
struct Basis {
  const Config* task = nullptr;
  Grounds grounds;  ///< The digests of these inputs. The decision's message has the digests that it names.
  std::shared_ptr<const std::vector<Obstacle>> obstacles;
  /** What is learned between the last start or reload and the next, in the order of the log, of which the first
  num_learned were at that time. No more than a user asks for. */
  std::shared_ptr<const LearnedTransitions> learned;
  std::size_t num_learned = 0;

  /** What was known at that time: the task's problem with these transitions behind its own. */
  [[nodiscard]] std::shared_ptr<const Problem> problem() const;
};

struct RecordedCandidate {
  /** The message without its signature; of a batch that was decided on, the candidate of the decision. It may not be a
  candidate_plan_t. */
  std::vector<std::uint8_t> bytes;
  std::string event;       ///< "events-....lcmlog event 17"; without the file if only one was read.
  std::int64_t place = 0;  ///< Position in the order of the log.
};

struct RecordedDecision {
  decision_t decision;
  std::string event;
  std::optional<RecordedCandidate> candidate;  ///< No value if the log lacks it.
  /** True if the decision's config digest is that of a known task. Otherwise `basis` is the state under the task in
  force. */
  bool is_of_known_task = true;
  Basis basis;
};

struct RecordedPlan {
  certified_plan_t certified;
  std::string event;
  bool has_candidate = false;  ///< Whether its candidate is in the log.
  bool is_of_known_task = true;
  Basis basis;
};

/** The first message of a withdrawal. Its repetitions are passed over. */
struct RecordedWithdrawal {
  withdrawal_t withdrawal;
  std::string event;
  bool is_of_known_task = true;
  Basis basis;  ///< What the plan was judged under.
};

/** Receives the events of a timeline in the order in which the certifier acted. */
class TimelineUser {
 public:
  TimelineUser() = default;
  virtual ~TimelineUser() = default;
  TimelineUser(const TimelineUser&) = delete;
  TimelineUser& operator=(const TimelineUser&) = delete;

  /** How many of Basis::learned it looks at, which a long run has much of. */
  [[nodiscard]] virtual std::size_t MostLearned() const { return std::numeric_limits<std::size_t>::max(); }

  virtual void OnEvent(const LogEvent&) {}  ///< Every authentic message, before the calls that it causes.
  virtual void OnStart(const Config&) {}    ///< The process starts under this task.
  virtual void OnReload(const Config&) {}   ///< The process continues under this task.
  /** A message after which a different set is in force, or a part of a set that is not complete. */
  virtual void OnObstacles(Bytes /*message*/, std::int64_t /*utime*/, SenderId) {}
  virtual void OnTransition(const ExecutedTransition&, Bytes /*message*/) {}  ///< A transition is learned.
  /** A transition of this event is not, and why. */
  virtual void OnRefusedTransition(const std::string& /*event*/, const std::string& /*why*/) {}
  virtual void OnDecision(const RecordedDecision&) {}
  virtual void OnCertified(const RecordedPlan&) {}
  virtual void OnWithdrawn(const RecordedWithdrawal&) {}
  virtual void OnUndecided(const RecordedCandidate&) {}  ///< No decision follows, or one after too many others.
};

/** These transitions and behind them the first `count` that were learned. */
[[nodiscard]] Transitions WithLearned(const Transitions& given, const LearnedTransitions& learned, std::size_t count);
/** The problem with the first `count` of these behind its own transitions; the problem itself if there are none. */
[[nodiscard]] std::shared_ptr<const Problem> WithLearned(const std::shared_ptr<const Problem>& problem,
                                                         const LearnedTransitions& learned, std::size_t count);

/** What is kept of a run of any length. */
struct TimelineBounds {
  std::size_t undecided = 4096;  ///< Candidates that may wait for their decisions; more, and the oldest is undecided.
  std::size_t ahead = 4096;      ///< Messages with obstacles that no decision has named so far, and transitions.
  /** In sets that no decision has named so far, and in those of the last decisions. */
  std::size_t obstacles = KeptObstacles::kMost;
};

class Timeline final {
 public:
  /** The task of a config digest; null if it is not known. */
  using TaskFinder = std::function<const Config*(const Digest& config)>;

  /** @param first the task in force at the beginning. Channels are its. @param keys as LogAuthenticator's.
  @param users each is told of every event. They must outlive the timeline, as the tasks must. */
  Timeline(const Config& first, TaskFinder find, std::optional<KeyRing> keys, std::vector<TimelineUser*> users,
           const TimelineBounds& bounds = {});
  /** With the key of the first task. @throws KeyError if it cannot be read. */
  Timeline(LogTasks& tasks, std::vector<TimelineUser*> users)
      : Timeline(
            tasks.first(), [&tasks](const Digest& config) { return tasks.Find(config); },
            PublicKeysOf(tasks.first().bus), std::move(users)) {}
  /** Decisions of any config digest count as this task's. */
  Timeline(const Config& only, std::vector<TimelineUser*> users)
      : Timeline(
            only, [&only](const Digest&) { return &only; }, PublicKeysOf(only.bus), std::move(users)) {}

  /** Reads consecutive event logs of one run, which follow those that were read before.
  @param names_files whether names of events include the log's name. @throws LogError if a log cannot be read. */
  void Read(const std::vector<std::string>& logs, bool names_files);
  /** The next event. @param name what users are told it is called. */
  void Take(const LogEvent& event, const std::string& name);
  /** Tells of the candidates that wait for a decision. */
  void End();

  [[nodiscard]] const LogDamage& damage() const { return damage_; }
  [[nodiscard]] PassedOver passed_over() const { return {authenticator_.refusals(), undecodable_}; }
  [[nodiscard]] std::int64_t candidates() const { return candidates_; }
  /** The obstacles in force after everything that was logged. */
  [[nodiscard]] const std::vector<Obstacle>& logged_obstacles() const { return logged_obstacles_.all(); }

 private:
  /** One of the certifier's sequence counts, and the number of starts that it has shown or that came before it. */
  struct Count {
    StreamOrder order;
    std::int64_t starts = 0;
  };
  /** The meaning of a message's place in its count. kStarts: a start that no other count has shown. kFollows: a start
  that another count has shown. kOld: the message is late or repeated. */
  enum class Told { kGoesOn, kStarts, kFollows, kOld };
  struct Decided {
    Basis basis;
    bool has_candidate;
  };
  struct ObstaclesChange {
    std::int64_t place, utime;
    SenderId sender;
    std::vector<std::uint8_t> bytes;
    Digest after;  // of what is in force
    std::shared_ptr<const std::vector<Obstacle>> obstacles;
  };
  struct Transition {
    std::int64_t place;
    ExecutedTransition transition;
    std::vector<std::uint8_t> bytes;
    Digest after;  // of the observations
  };

  void TakeObstacles(const LogEvent& event);
  void TakeTransition(const LogEvent& event, const std::string& name);
  void TakeStatus(const LogEvent& event);
  void TakeDecision(const LogEvent& event, const std::string& name);
  void TakeCertified(const LogEvent& event, const std::string& name);
  void TakeWithdrawal(const LogEvent& event, const std::string& name);

  [[nodiscard]] Told Heed(Count& count, const StreamPosition& message, const LogEvent& event);
  void Start();
  void Reload();
  void Follow(ObstaclesInForce obstacles);
  void FollowReload(const Config& task);

  /** @param candidate_place -1 if the log has no candidate: without a state of these digests nothing advances. */
  [[nodiscard]] Basis Advance(const Grounds& named, std::int64_t candidate_place);
  [[nodiscard]] Basis Current() const;
  void TakeNextObstacles();
  void LearnNext();

  template <class... Parameters, class... Arguments>
  void Tell(void (TimelineUser::*told)(Parameters...), const Arguments&... what) {
    for (TimelineUser* user : users_) (user->*told)(what...);
  }

  const TaskFinder find_;
  const std::vector<TimelineUser*> users_;
  const std::size_t most_learned_;
  const TimelineBounds bounds_;
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
  // Of the last kMostDecided plans that were decided on; of several decisions on one the last CERTIFIED, if there is
  // one.
  static constexpr std::size_t kMostDecided = 4096;
  std::map<Digest, Decided> decided_;
  std::deque<Digest> decided_order_;
  KeptObstacles decided_obstacles_;  // of these

  RepeatedWithdrawals withdrawals_;

  // State at the last decision, and by everything that was logged; what lies between the two.
  std::shared_ptr<const std::vector<Obstacle>> obstacles_;
  Digest obstacles_digest_{}, observations_digest_{};
  std::shared_ptr<LearnedTransitions> learned_;
  ObstaclesInForce logged_obstacles_;
  std::shared_ptr<const std::vector<Obstacle>> all_logged_;  // of these
  SoleSender transition_sender_;
  Digest logged_observations_{};
  std::deque<ObstaclesChange> obstacles_ahead_;
  KeptObstacles kept_ahead_;  // by these
  std::deque<Transition> transitions_ahead_;
};

}  // namespace forereach
