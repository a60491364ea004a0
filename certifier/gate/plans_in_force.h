/** The certified plans that may be executed, and how many of their controls still stand.

A certificate is about the obstacles, the observations and the task of its moment. When one of these changes, the plans
that may be executed are judged again, and what no longer holds is withdrawn. An observation that is added, and does not
contradict the declaration, changes nothing: it leaves fewer admissible residuals, and the certificate is about all that
there were (docs/soundness.md, 3.13). If it contradicts the declaration, nothing stands.

    SeeObstacles     whether the obstacles are known, and since when they are not
    Add, SeeRobot    which plans may be executed: those that were certified and may still be pending, and the one that
                     the robot executes, from the step that it was last seen at
    Judge            after a change: how many controls of each plan stand (Gate::JudgeAgain); fewer: a withdrawal
    TakeDue          the withdrawals to send now: at once, then every kRepeatUs
    TakeAnswer       the robot has taken a withdrawal; it is not sent any more
    SeeOneOfTwo      a state of one of two robots that are heard: what it executes may be executed for longer
    RobotHasChanged  another robot is heard in the place of the one before, which may still execute its plan

What was withdrawn never stands again. A plan leaves when it cannot be executed any more: it was executing and the robot
reports another plan or none; the robot executes a plan with a larger plan_id whose certificate expires no earlier, so
the guard accepts this one no more; it has expired, or should have ended.

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

No bus, no clock. Times of a monotonic clock and of the wall clock in microseconds. */
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "certifier/gate/gate.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/stream_order.h"
#include "task/gate_options.h"

namespace forereach {

class PlansInForce final {
 public:
  static constexpr std::size_t kPlans = 32768;  ///< Capacity.
  static constexpr std::size_t kJudged = 16;
  static constexpr std::int64_t kRepeatUs = 50'000;
  static constexpr std::size_t kMostSent = 256;  ///< Repetitions of which an answer counts: those of 12.8 s.

  struct Due {
    withdrawal_t message;
    bool is_repetition;
  };

  explicit PlansInForce(const GateOptions& gate) { Follow(gate); }

  /** Uses new options from now on. */
  void Follow(const GateOptions& gate);
  /** Forgets all plans: another certifier is in charge. */
  void Clear() {
    plans_.clear();
    unknown_since_us_.reset();
  }

  /** True if no further plan may be certified, because it could not be withdrawn. */
  [[nodiscard]] bool IsFull() const { return plans_.size() >= kPlans; }
  /** Notes whether the obstacles are known now. To be called before each Judge. @param why_unknown by
  Gate::WhyObstaclesUnknown; empty: they are known. */
  void SeeObstacles(const std::string& why_unknown, std::int64_t steady_us);
  /** Adds a plan that was certified and sent. @pre not IsFull(). Cost: a copy of the candidate. */
  void Add(const certified_plan_t& certified, std::int64_t steady_us);
  /** Takes a usable state of the robot. Cost O(plans). */
  void SeeRobot(const robot_state_t& state, std::int64_t steady_us);
  /** Takes a usable state of one of two robots that are heard. Nothing leaves. Cost O(plans). */
  void SeeOneOfTwo(const robot_state_t& state, std::int64_t steady_us);
  /** The next states are another robot's, and its messages have an order of their own. The plans that have begun become
  shared. */
  void RobotHasChanged();
  /** Takes the robot's answer to a withdrawal. @pre event.kind == execution_event_t::WITHDRAWN. */
  void TakeAnswer(const execution_event_t& event);

  /** Judges the plans again if obstacles, whether they are lost, task, its file of transitions or the truth of the
  declaration have changed since the last call. @param is_contradicted the declaration is known to be false, by this
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
  [[nodiscard]] std::size_t size() const { return plans_.size(); }

 private:
  struct Entry {
    std::int64_t plan_id = 0, expires_utime = 0;
    std::int64_t may_run_until_us = 0;  // by the monotonic clock
    bool is_known = false;              // certified by this process; otherwise the members below are not set
    std::array<std::uint8_t, 32> source{};
    Digest plan_digest{}, certificate_digest{};
    std::unique_ptr<const candidate_plan_t> plan;  // null: it is not judged any more
    int num_steps = 0;
    bool has_begun = false;
    bool is_shared = false;  // a robot that is not heard, or one of two, may execute it
    int first_step = 0;
    bool is_withdrawn = false;  // a part of it
    int standing_steps = 0;
    bool is_changed = false;                   // what it rests on, since it was judged
    std::unique_ptr<withdrawal_t> withdrawal;  // the last one, until it is answered
    std::deque<std::int64_t> sent;             // the sequences of that one and of its last kMostSent repetitions
    std::int64_t next_us = 0;                  // when to send it, by the monotonic clock
  };
  struct Premises {
    Digest config{}, transitions{}, obstacles{};  // transitions: those of the task's file
    bool is_falsified = false, has_lost_obstacles = false;
    friend bool operator==(const Premises&, const Premises&) = default;
  };

  [[nodiscard]] std::int64_t LongestRun(int num_steps) const;
  void Begin(Entry& entry, const robot_state_t& state, std::int64_t steady_us) const;
  static void Share(Entry& entry);
  void RememberStranger(const robot_state_t& state, std::int64_t steady_us);
  void DropOldest();
  void Judge(Entry& entry, Gate& gate);
  void WithdrawForObstacles(Entry& entry, const Gate& gate);
  void Withdraw(Entry& entry, const withdrawal_t& withdrawal);

  std::int64_t lifetime_us_ = 0, delay_us_ = 0, step_us_ = 0;
  std::optional<std::int64_t> silence_us_;        // after which a robot's state is lost; nothing: it is not needed
  std::optional<std::int64_t> lost_us_;           // after which unknown obstacles are lost; nothing: never
  std::optional<std::int64_t> unknown_since_us_;  // by the monotonic clock; nothing: they are known
  std::int64_t unknown_us_ = 0;                   // since then
  std::string why_unknown_;
  std::deque<Entry> plans_;  // the oldest first
  StreamOrder states_;
  std::optional<Premises> premises_;  // at the last Judge
  bool is_any_changed_ = false, is_any_unanswered_ = false;
  std::int64_t sequence_ = 0, withdrawals_ = 0;
};

}  // namespace forereach
