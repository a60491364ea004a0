/** The gate: takes a candidate's bytes and a clock, and gives exactly one decision. It uses no bus, wall clock or
thread.

Without a proof the decision is an abstention or a rejection. Reasons are: bytes that are not a candidate; a stamp that
is stale or ahead of the clock; a start that has passed, or leaves too little time to decide; a repetition; a wrong
size; a number that is not finite; an internal error. `Watch` decides whether certifying is allowed at all (watch.h); if
not, the caller calls Refuse. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "certifier/gate/obstacles_in_force.h"
#include "certifier/gate/sources.h"
#include "certifier/gate/upheld.h"
#include "forereach/advice_t.hpp"
#include "forereach/candidate_batch_t.hpp"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "forereach/certify/certifier.h"
#include "forereach/certify/standing.h"
#include "forereach/certify/way_clear.h"
#include "forereach/decision_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/codec.h"
#include "lcmtypes/grounds.h"
#include "task/config.h"
#include "task/motion.h"

namespace forereach {

class Pieces;

/** A decision and, only with a certificate, the certified plan. */
struct GateAnswer {
  decision_t decision{};
  std::optional<certified_plan_t> certified;
};

class Gate final {
 public:
  /** Microseconds since the Unix epoch. */
  using TimeSource = std::function<std::int64_t()>;

  /** @throws std::invalid_argument as Certifier does. */
  explicit Gate(const Config& config);
  ~Gate();

  [[nodiscard]] const Certifier& certifier() const { return certifier_; }
  /** The digest of the task's transitions: grounds().observations before anything was learned. */
  [[nodiscard]] const Digest& transitions() const { return transitions_; }
  [[nodiscard]] const GateOptions& options() const { return options_; }
  [[nodiscard]] const std::vector<Obstacle>& obstacles() const { return obstacles_.all(); }
  /** The reason why obstacles() may be incomplete at this time (obstacles_in_force.h); empty if it is complete. */
  [[nodiscard]] std::string WhyObstaclesUnknown(std::int64_t now_us) const { return obstacles_.WhyUnknown(now_us); }
  /** Stamp and arrival of the obstacles in force; nothing if none were received. */
  [[nodiscard]] const std::optional<Arrival>& obstacles_arrival() const { return obstacles_.arrival(); }
  /** The tube of the last plan that reached the certifier; boxes around its slices, if it was certified in pieces. */
  [[nodiscard]] const Tube& tube() const { return *tube_; }

  /** Decides on one candidate, or on one of a batch (lcmtypes/candidate_batch.h): the first that is certified by half
  of gate.decision_budget_ms, otherwise candidate 0. It is then decided on as if it was sent alone; the message says
  which one of how many it is and, if none is certified, counts the causes. A batch with a candidate that is refused for
  its sizes or numbers, or whose plan_id was used, is answered by the refusal of the first such candidate. Never throws:
  an exception becomes a rejection. The caller sets elapsed_us; all other fields of both messages are complete. With
  gate.max_pieces, what gets S is tried again in pieces of X_0 (certify/pieces.h); no call of Certify begins that, if
  it takes as long as the longest so far, ends after half of gate.decision_budget_ms. The message says what it took.
  Reads the clock twice, of a batch and for pieces more often. The first reading is the decision's utime. By the last, a
  certificate that took longer than gate.decision_budget_ms is dropped. */
  [[nodiscard]] GateAnswer Decide(Bytes candidate, const TimeSource& clock) noexcept;
  /** The same at a given time in microseconds since the Unix epoch, as if the decision took no time: all pieces are
  tried. */
  [[nodiscard]] GateAnswer Decide(Bytes candidate, std::int64_t now_us) noexcept;

  /** JudgeAgain (standing.h) under what is in force now; what gets S is tried again in pieces, until
  gate.decision_budget_ms is over by this machine's clock, and stands whole if these are certified. Outcome kNone: the
  plan cannot be judged under this task.
  @param plan a candidate that this gate or one before a reload has certified. @param upheld what its certified plan
  says that the guard upholds; if less than this task's certificates rest on, the plan cannot be judged.
  @param first_step 0..num_steps. */
  [[nodiscard]] Standing JudgeAgain(const candidate_plan_t& plan, const Upheld& upheld, int first_step) noexcept;

  /** What would have helped a candidate that this gate has abstained on (advice_message.h). Nothing if there is nothing
  to say, if other inputs than the decision's are in force, or if `effort` ended the search. The caller sets utime and
  sequence. Cost: that of a decision, and then some dozen tests of one obstacle along the tube for each obstacle that it
  may touch. */
  [[nodiscard]] std::optional<advice_t> Advise(const candidate_plan_t& candidate, const decision_t& decision,
                                               const SearchEffort& effort) noexcept;

  /** For a candidate that asks for it and that this gate has abstained on, D or S: advice with the nearest plan that
  was certified (repair.h), or with none if none was found. Nothing if other inputs than the decision's are in force.
  The caller sets utime and sequence. @param goes_on as FindRepair's. Cost: that of a decision, and FindRepair's. */
  [[nodiscard]] std::optional<advice_t> Repair(const candidate_plan_t& candidate, const decision_t& decision,
                                               const std::function<bool()>& goes_on) noexcept;

  /** Answers a candidate without certifying it, for a cause outside the candidate. The candidate's own defects take
  precedence over `cause`. */
  [[nodiscard]] GateAnswer Refuse(Bytes candidate, std::int64_t now_us, std::int16_t cause, const std::string& why,
                                  std::int16_t outcome = decision_t::REJECTED) noexcept;

  /** The earliest start of a plan for which there is time to decide on it at `now_us`: gate.decision_budget_ms later.
  Both in microseconds since the Unix epoch. */
  [[nodiscard]] std::int64_t EarliestStart(std::int64_t now_us) const;

  /** Replaces the obstacles by those of an obstacles_t, by the rules of obstacles_in_force.h. On an
  error it changes nothing and returns the error's text; otherwise an empty text. */
  [[nodiscard]] std::string UpdateObstacles(Bytes message, std::int64_t now_us, SenderId sender = {});

  /** Adds an executed transition to the observations, if the task has gate.learn. grounds().observations becomes the
  BLAKE2b-256 of the digest before and the message's bytes. If a check refuses the transition, nothing changes and the
  result names the check (certify/learned.h); otherwise it is empty. certifier().violation() is set if the transition
  falsifies the declaration. Where no clock is looked at, a step that did not last model.dt changes nothing. */
  [[nodiscard]] std::string Learn(Bytes transition);

  /** Checks sizes, numbers and stamp of a robot's state. @return the first error, or an empty text. */
  [[nodiscard]] std::string CheckRobotState(const robot_state_t& state, std::int64_t now_us) const;
  /** Checks a stamp at this time (stamp.h). @return the error, or an empty text. */
  [[nodiscard]] std::string CheckFresh(std::int64_t utime, std::int64_t now_us) const;

  /** With realtime.keep_warm: decides once more, from the bytes to the encoded messages, on the last candidate that was
  certified, and drops the answer, so that the next decision finds its code and data in the processor's caches. No later
  answer depends on it; tube() is that of this candidate. Cost: that of a decision; nothing before the first
  certificate. */
  void KeepWarm() noexcept;

  /** As Certifier's. */
  void Compact() { certifier_.Compact(); }

  /** Takes over the counts, the sources and the received obstacles of another gate, after a reload. */
  void Inherit(const Gate& before);

  /** A heartbeat with the counts so far and the grounds in force. The caller sets the other fields. */
  [[nodiscard]] certifier_status_t Status(std::int64_t now_us) const;
  /** The grounds in force, with everything received and learned so far. */
  [[nodiscard]] Grounds grounds() const;

 private:
  struct Rejection {
    std::int16_t cause;
    std::string why;
    std::int16_t outcome = decision_t::REJECTED;
  };

  /** The candidate of a batch that is decided on, and what the decision's message begins with. */
  struct Choice {
    int candidate = 0;
    std::string how;
  };

  struct Again;
  struct Rehearsal;
  [[nodiscard]] std::optional<Again> CertifyAgain(const candidate_plan_t& candidate, const decision_t& decision);
  [[nodiscard]] advice_t AdviceOn(const candidate_plan_t& candidate, const decision_t& decision) const;

  [[nodiscard]] GateAnswer Answer(Bytes message, const TimeSource& clock,
                                  std::optional<Rejection> from_outside) noexcept;
  [[nodiscard]] GateAnswer AnswerOne(Bytes candidate, std::int64_t now_us, const TimeSource& clock,
                                     std::optional<Rejection> from_outside) noexcept;
  /** The bytes of the candidate that is decided on, and what the decision's message begins with; nothing if the batch
  stands for no candidates. */
  [[nodiscard]] std::pair<std::vector<std::uint8_t>, std::string> ChooseIn(Bytes message, std::int64_t now_us,
                                                                           const TimeSource& clock, bool is_refused);
  [[nodiscard]] Choice Choose(const candidate_batch_t& batch, std::int64_t now_us, const TimeSource& clock);
  template <class Message>
  [[nodiscard]] static std::optional<Rejection> CheckBytes(Bytes bytes, Message& message);
  [[nodiscard]] static Rejection RefuseBatch(Bytes bytes);
  [[nodiscard]] std::optional<Rejection> Admit(Bytes bytes, candidate_plan_t& candidate, Zonotope& initial_set,
                                               std::int64_t now_us);
  [[nodiscard]] std::optional<Rejection> CheckContent(const candidate_plan_t& candidate, Zonotope& initial_set) const;
  [[nodiscard]] std::optional<Rejection> CheckTimes(const candidate_plan_t& candidate, std::int64_t now_us) const;
  [[nodiscard]] std::optional<Rejection> CheckSource(const candidate_plan_t& candidate, std::int64_t now_us);
  [[nodiscard]] std::optional<Rejection> CheckDeadline(const candidate_plan_t& candidate, std::int64_t now_us) const;
  void Certify(const candidate_plan_t& candidate, const Zonotope& initial_set, const TimeSource& clock,
               GateAnswer& answer);
  void DropIfLate(GateAnswer& answer, std::int64_t now_us) const;
  /** Sets all fields of a message of zeros, and its seal. */
  void Attest(const candidate_plan_t& candidate, const decision_t& decision, certified_plan_t& certified);
  void Count(const decision_t& decision);

  Certifier certifier_;
  std::optional<RobotMotion> motion_;  ///< Unless the task does not say how the robot brakes.
  int tail_steps_;
  GateOptions options_;
  Grounds grounds_;  ///< Without the digest of the obstacles, which obstacles_ has.
  Digest transitions_;
  ObstaclesInForce obstacles_;
  Sources sources_;
  std::int64_t decisions_ = 0, certificates_ = 0;
  certifier_status_t counts_{};
  std::unique_ptr<Tube> tube_;
  std::unique_ptr<Pieces> pieces_;        ///< With gate.max_pieces above 1.
  std::unique_ptr<Rehearsal> rehearsal_;  ///< With realtime.keep_warm.
};

}  // namespace forereach
