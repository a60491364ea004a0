/** The ledger of certified plans. It remembers each one once, and answers three questions about them:

    FindDeparture    Has the robot left a certified slice?
    FindStranger     Does the robot execute a plan that was not certified, or that it may not execute any more?
    Judge, TakeDue   Which plans may be executed, and how many of their controls still stand? What is withdrawn?

Memory: at most kPlans records, each of 0.3 kB while its plan is in force, and of 3 kB while a withdrawal is unanswered.
A whole plan, 42 kB, is kept once, and only while something needs it: the slices of the last kSlices plans, the controls
of the last kJudged plans that have not begun and of those that have. That is 4 MB.

**Departures.** A state that has left its certified slice, none of measured +- error lies in it, refutes an assumption
of the certificate: the model, the declaration, its noise bound, or the measurement. The robot's guard makes the same
test. The certifier repeats it so that it certifies nothing more under a false assumption.

**Strangers.** A guard executes only certified plans and begins none after its certificate has expired. So a robot that
reports another plan, a step that its plan does not have, or a plan that began too late, has no guard or a defective
one. The ledger does not know the plans of other certifiers, for example of the process before a restart. It tolerates
unknown plans for as long as such a plan may be executing.

**Plans in force.** A certificate is about the obstacles, the observations and the task of its moment. When one of these
changes, the plans that may be executed are judged again, and what no longer holds is withdrawn. An observation that is
added, and does not contradict the declaration, changes nothing: it leaves fewer admissible residuals, and the
certificate is about all that there were (docs/soundness.md, 3.13). If it contradicts the declaration, nothing stands.

    SeeObstacles     whether the obstacles are known, and since when they are not
    Add, SeeRobot    which plans are in force: those that were certified and may still be pending, and the one that
                     the robot executes, from the step that it was last seen at
    Judge            after a change: how many controls of each plan stand (Gate::JudgeAgain); fewer: a withdrawal
    TakeDue          the withdrawals to send now: at once, then every kRepeatUs
    TakeAnswer       the robot has taken a withdrawal; it is not sent any more
    SeeOneOfTwo      a state of one of two robots that are heard: what it executes may be executed for longer
    RobotHasChanged  another robot is heard in the place of the one before, which may still execute its plan

What was withdrawn never stands again. A plan is not in force any more when it cannot be executed any more: it was
executing and the robot reports another plan or none; the robot executes a plan with a larger plan_id whose certificate
expires no earlier, so the guard accepts this one no more; it has expired, or should have ended.

A robot that is not heard any more, or one of two, may execute a plan that the robot that is heard knows nothing of.
Such a plan is shared: it leaves when its time is over, whatever is reported. It is judged from the first step that it
was seen at, and no answer to its withdrawal counts, because the robot that executes it may not be the one that answers.

Only the last kJudged plans that have not begun are judged, which bounds the work. Of an earlier one, all controls are
withdrawn when something changes (NOT_JUDGED).

A plan that the robot executes and that is not known was certified by another process, for example by this certifier
before a restart. It cannot be judged. It is withdrawn as UNKNOWN_PLAN, at once and after each change, as soon as the
obstacles are known. A guard heeds this unless the plan was certified under what is in force: the task, its file of
transitions, the obstacles. The transitions that the other process had learned before do not count: the certificate
proves what it proves under them, and they stay true if this process does not know them (docs/soundness.md, 3.13).

Obstacles that have been unknown for gate.obstacles_lost_ms are lost, which is a change like any other: nothing is known
to stand, so every plan is withdrawn whole (OBSTACLES_LOST), also one that is not known. The stop that follows is not
certified. Nothing stands again when they return.

No bus, no clock. Times of a monotonic clock (steady_us) and of the wall clock (now_us), in microseconds. */
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "certifier/gate/gate.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/angle.h"
#include "lcmtypes/sole_sender.h"
#include "lcmtypes/stream_order.h"
#include "task/gate_options.h"

namespace forereach {

class PlanLedger final {
 public:
  /** Number of plans. Where there is no room, the oldest one that is not in force is forgotten, and unknown plans are
  tolerated for as long as it may be executing. */
  static constexpr std::size_t kPlans = 32768;
  static constexpr std::size_t kSlices = 64;  ///< Plans with slices: the last certified ones and the executing one.
  static constexpr std::size_t kJudged = 16;
  /** Number of remembered states. A second robot under the same name, at any usual rate, does not displace the begin of
  a step before its end is reported. */
  static constexpr std::size_t kPlaces = 32;
  static constexpr std::int64_t kRepeatUs = 50'000;
  static constexpr std::size_t kMostSent = 256;  ///< Repetitions of which an answer counts: those of 12.8 s.

  struct Departure {
    std::int64_t plan_id;
    int step, coordinate;
    double value, error, lower, upper;
  };
  struct Stranger {
    std::int64_t plan_id;
    int step;
    std::string why;  ///< A sentence with the values.
  };
  struct Due {
    withdrawal_t message;
    bool is_repetition;
  };

  /** @param gate the task's options. */
  PlanLedger(const GateOptions& gate, std::int64_t steady_us);

  /** Uses new options from now on. */
  void Follow(const GateOptions& gate);
  /** Adds a plan that was certified and sent. Its slices replace those of a plan of the same plan_id, unless that plan
  is executing: a guard does not accept the plan_id that it executes. @param angles the states that are angles in the
  task that it was certified with. @pre not IsFull(). Cost: a copy of the plan. */
  void Add(const certified_plan_t& certified, std::int64_t steady_us, const Angles& angles = {});
  /** Another certifier is in charge: no plan is in force, and slices and states are forgotten. It is still known which
  plans were certified. */
  void StandBy();

  // ---- Departures.

  /** Tests a usable state against the slice of the step that it names. If the robot has advanced by one boundary while
  executing, it also tests the state against the slice of the plan that was executing before. Its error is the message's
  or, if that has none, the plan's. Nothing if the slices were not left, or if the plan's are not remembered.
  @param sender of the message: only the same robot's states and transitions are about one step. Cost O(n + kSlices). */
  [[nodiscard]] std::optional<Departure> FindDeparture(const robot_state_t& state, SenderId sender = {});
  /** Takes the robot's word that it has stopped the plan that it executed when it was last heard, in that step or at
  its end: FindDeparture does not compare the next state with that plan's next slice, because the robot has left its
  controls. What a false word hides is what a robot that says it stands hides, too. It hides no state of a plan that the
  robot says it executes, and no transition. */
  void SeeStop(const execution_event_t& event, SenderId sender);
  /** Tests the end of a step that began at one of the last kPlaces received states against the slice after it. If the
  robot ends its plan or its guard stops it, its later states name no slice, so only the transition shows the departure.
  The transition may arrive after the state that reports the stop. Cost O(n + kPlaces + kSlices). */
  [[nodiscard]] std::optional<Departure> FindDeparture(const transition_t& transition, SenderId sender = {}) const;

  // ---- Strangers.

  /** Unknown plans are tolerated for as long as one that was issued until then may be executing: another certifier may
  have issued some, or the clock by which they begin was set. The constructor does the same. */
  void TolerateIssuedUntil(std::int64_t steady_us);
  /** The violation in the robot's report of the plan that it executes. Nothing if it executes none or an allowed one.
  @param state usable and fresh (Gate::CheckRobotState). Cost O(plans), at most about 50 us. */
  [[nodiscard]] std::optional<Stranger> FindStranger(const robot_state_t& state, std::int64_t steady_us);

  // ---- Plans in force.

  /** True if no further plan may be certified, because it could not be withdrawn. */
  [[nodiscard]] bool IsFull() const { return records_.size() >= kPlans && num_in_force() >= kPlans; }
  [[nodiscard]] std::size_t num_in_force() const;
  /** Notes whether the obstacles are known now. To be called before each Judge. @param why_unknown by
  Gate::WhyObstaclesUnknown; empty: they are known. */
  void SeeObstacles(const std::string& why_unknown, std::int64_t steady_us);
  /** Takes a usable state of the robot. Cost O(plans). */
  void SeeRobot(const robot_state_t& state, std::int64_t steady_us);
  /** Takes a usable state of one of two robots that are heard. Nothing leaves. Cost O(plans). */
  void SeeOneOfTwo(const robot_state_t& state, std::int64_t steady_us);
  /** The next states are another robot's, and its messages have an order of their own. The plans that have begun become
  shared. */
  void RobotHasChanged();
  /** Takes the robot's answer to a withdrawal. @pre event.kind == execution_event_t::WITHDRAWN. */
  void TakeAnswer(const execution_event_t& event);

  /** Judges the plans in force again if obstacles, whether they are lost, task, its file of transitions or the truth of
  the declaration have changed since the last call. @param is_contradicted the declaration is known to be false, by this
  gate's observations or by what was learned before a restart. Then no plan that is not known stands. Cost: at most
  kJudged + 1 times that of Certify; without a change O(1). */
  void Judge(Gate& gate, std::int64_t now_us, bool is_contradicted);
  void Judge(Gate& gate, std::int64_t now_us) { Judge(gate, now_us, gate.certifier().violation().has_value()); }

  /** True if a withdrawal is unanswered. */
  [[nodiscard]] bool withdraws() const { return is_any_unanswered_; }
  /** The next withdrawal to send now, complete. Nothing if none is due. */
  [[nodiscard]] std::optional<Due> TakeDue(std::int64_t now_us, std::int64_t steady_us);

  /** The number of withdrawals, without repetitions. */
  [[nodiscard]] std::int64_t withdrawals() const { return withdrawals_; }

 private:
  using Whole = std::shared_ptr<const certified_plan_t>;

  struct InForce {
    std::int64_t may_run_until_us = 0;      // by the monotonic clock
    std::array<std::uint8_t, 32> source{};  // this and the digests: zero if it is not known
    Digest plan_digest{}, certificate_digest{};
    Whole judged;  // null: it is not judged any more
    bool has_begun = false;
    bool is_shared = false;  // a robot that is not heard, or one of two, may execute it
    int first_step = 0;
    bool is_withdrawn = false;  // a part of it
    int standing_steps = 0;
    bool is_changed = false;                   // what it rests on, since it was judged
    std::unique_ptr<withdrawal_t> withdrawal;  // the last one, until it is answered
    std::vector<std::int64_t> sent;            // the sequences of that one and of its last kMostSent repetitions
    std::int64_t next_us = 0;                  // when to send it, by the monotonic clock
  };
  struct Record {
    std::int64_t plan_id;
    int num_steps;
    std::unique_ptr<InForce> force = std::make_unique<InForce>();  // null: it is not in force
    bool is_known = false;  // certified by this process; otherwise the members below are not set
    bool began_in_time = false;
    std::int64_t expires_utime = 0, step_us = 0;
    std::int64_t ends_us = INT64_MIN;  // when it should have ended, by the monotonic clock
  };
  struct Slices {
    Whole certified;
    Angles angles;
  };
  struct Place {
    std::int64_t utime = -1, plan_id = -1;  // plan -1: not executing
    int step = -1;
    SenderId sender = {};
  };
  struct Measured {
    std::deque<Slices> slices;            // the next one to be displaced first
    StreamOrder order;                    // of all states
    Place last;                           // from the newest received state
    std::array<Place, kPlaces> places{};  // that one and those before it: a ring
    std::size_t next_place = 0;
  };
  struct Premises {
    Digest config{}, transitions{}, obstacles{};  // transitions: those of the task's file
    bool is_falsified = false, has_lost_obstacles = false;
    friend bool operator==(const Premises&, const Premises&) = default;
  };

  [[nodiscard]] std::int64_t LongestRun(int num_steps) const;
  [[nodiscard]] std::int64_t LongestLife(int num_steps) const;
  Record& Append(std::int64_t plan_id, int num_steps);
  void ForgetEnded(std::int64_t steady_us);
  void ForgetOldest();
  [[nodiscard]] static bool HasEnded(const Record& record, std::int64_t steady_us);

  void KeepSlices(Slices added);
  [[nodiscard]] std::deque<Slices>::const_iterator FindSlices(std::int64_t plan_id) const;
  [[nodiscard]] std::optional<Departure> Compare(std::int64_t plan_id, int step, std::span<const double> state,
                                                 std::span<const double> state_error = {}) const;

  [[nodiscard]] std::string WhyNot(Record& record, const robot_state_t& state) const;

  void Begin(Record& record, const robot_state_t& state, std::int64_t steady_us) const;
  static void Share(InForce& force);
  Record& AppendUnknown(const robot_state_t& state, std::int64_t steady_us);
  void DropOldestJudged();
  void Judge(Record& record, Gate& gate);
  void Withdraw(Record& record, const Grounds& grounds, const withdrawal_t& withdrawal);

  std::int64_t lifetime_us_ = 0, delay_us_ = 0, step_us_ = 0;
  std::optional<std::int64_t> silence_us_;  // after which a robot's state is lost; nothing: it is not needed
  std::optional<std::int64_t> lost_us_;     // after which unknown obstacles are lost; nothing: never
  std::deque<Record> records_;              // the oldest first
  Measured measured_;
  std::int64_t tolerates_until_us_ = 0;
  StreamOrder states_;                            // of the robot that alone is heard
  std::optional<std::int64_t> unknown_since_us_;  // by the monotonic clock; nothing: the obstacles are known
  std::int64_t unknown_us_ = 0;                   // since then
  std::string why_unknown_;
  std::optional<Premises> premises_;  // at the last Judge
  bool is_any_changed_ = false, is_any_unanswered_ = false;
  std::int64_t sequence_ = 0, withdrawals_ = 0;
};

}  // namespace forereach
