/** The gate: a candidate's bytes and a clock in, exactly one decision out. No bus, no wall clock, no thread in it.

Whatever is not a proof is an abstention or a rejection: bytes that are no candidate, one that is stale, stamped ahead
of the clock, too late for its own start or to be decided on before it, a repetition, of wrong size or not finite, and
any error inside. `Watch` decides whether certifying is allowed at all (watch.h); if not, the caller calls Refuse. */
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "certifier/certify/certifier.h"
#include "certifier/gate/obstacles_in_force.h"
#include "certifier/gate/sources.h"
#include "certifier/task/config.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "forereach/certifier_status_v3_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/codec.h"
#include "lcmtypes/grounds.h"

namespace forereach {

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

  [[nodiscard]] const Certifier& certifier() const { return certifier_; }
  [[nodiscard]] const GateOptions& options() const { return options_; }
  [[nodiscard]] const std::vector<Obstacle>& obstacles() const { return obstacles_.all(); }
  /** Why these may not be all there are at this time (obstacles_in_force.h); empty if they are. */
  [[nodiscard]] std::string WhyObstaclesUnknown(std::int64_t now_us) const { return obstacles_.WhyUnknown(now_us); }
  /** The tube of the last candidate that reached the certifier. */
  [[nodiscard]] const Tube& tube() const { return tube_; }

  /** Decides on one candidate. Never throws: an exception becomes a rejection. Both messages are complete but for
  elapsed_us, which the caller measures. The clock is read twice: before, which is the decision's utime, and after: a
  certificate that took longer than its budget is withdrawn. */
  [[nodiscard]] GateAnswer Decide(Bytes candidate, const TimeSource& clock) noexcept;
  /** The same at a moment, microseconds since the Unix epoch, as if it took no time. */
  [[nodiscard]] GateAnswer Decide(Bytes candidate, std::int64_t now_us) noexcept;

  /** Rejects a candidate, or abstains from it, without certifying it, for a cause that lies outside it. What is wrong
  with itself goes before. */
  [[nodiscard]] GateAnswer Refuse(Bytes candidate, std::int64_t now_us, std::int16_t cause, const std::string& why,
                                  std::int16_t outcome = decision_t::REJECTED) noexcept;

  /** The earliest start of a plan for which there is time to decide on it at `now_us`: gate.decision_budget_ms later.
  Both in microseconds since the Unix epoch. */
  [[nodiscard]] std::int64_t EarliestStart(std::int64_t now_us) const;

  /** Takes the obstacles of an obstacles_t, as gate.obstacles says (obstacles_in_force.h). Whole or not at all: returns
  what is wrong with the message, or an empty text. */
  [[nodiscard]] std::string UpdateObstacles(Bytes message, std::int64_t now_us);

  /** Adds an executed transition to the observations, if the task has gate.learn, and chains grounds().observations:
  BLAKE2b-256 of the digest before and the message's bytes. Returns which check refused it (certify/learned.h), and
  nothing has changed, or an empty text. certifier().violation() tells whether it falsifies the declaration. */
  [[nodiscard]] std::string Learn(Bytes transition);

  /** What keeps a robot's state from being believed: sizes, numbers, a stamp that is stale or ahead; empty if nothing.
   */
  [[nodiscard]] std::string CheckRobotState(const robot_state_t& state, std::int64_t now_us) const;
  /** What is wrong with a stamp at this time (stamp.h), or empty. */
  [[nodiscard]] std::string CheckFresh(std::int64_t utime, std::int64_t now_us) const;

  /** As Certifier's. */
  void Compact() { certifier_.Compact(); }

  /** Goes on where another gate stops: its counts, sources and the obstacles it has heard. */
  void Inherit(const Gate& before);

  /** Counts so far and the grounds in force; the rest is the caller's. */
  [[nodiscard]] certifier_status_v3_t Status(std::int64_t now_us) const;
  /** With everything heard and learned so far. */
  [[nodiscard]] Grounds grounds() const;

 private:
  struct Rejection {
    std::int16_t cause;
    std::string why;
    std::int16_t outcome = decision_t::REJECTED;
  };

  [[nodiscard]] GateAnswer Answer(Bytes candidate, const TimeSource& clock,
                                  std::optional<Rejection> from_outside) noexcept;
  [[nodiscard]] std::optional<Rejection> Admit(Bytes bytes, candidate_plan_t& candidate, Zonotope& initial_set,
                                               std::int64_t now_us);
  [[nodiscard]] std::optional<Rejection> CheckContent(const candidate_plan_t& candidate, Zonotope& initial_set) const;
  [[nodiscard]] std::optional<Rejection> CheckTimes(const candidate_plan_t& candidate, std::int64_t now_us) const;
  [[nodiscard]] std::optional<Rejection> CheckSource(const candidate_plan_t& candidate, std::int64_t now_us);
  [[nodiscard]] std::optional<Rejection> CheckDeadline(const candidate_plan_t& candidate, std::int64_t now_us) const;
  void Certify(const candidate_plan_t& candidate, const Zonotope& initial_set, GateAnswer& answer);
  void WithdrawIfLate(GateAnswer& answer, std::int64_t now_us) const;
  /** Fills and seals a message of zeros. */
  void Attest(const candidate_plan_t& candidate, const decision_t& decision, certified_plan_t& certified);
  void Count(const decision_t& decision);

  Certifier certifier_;
  GateOptions options_;
  Grounds grounds_;  ///< But for the obstacles, which obstacles_ has.
  ObstaclesInForce obstacles_;
  Sources sources_;
  std::int64_t decisions_ = 0, certificates_ = 0;
  certifier_status_v3_t counts_{};
  Tube tube_;
};

}  // namespace forereach
