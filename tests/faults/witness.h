/** Hears everything on the bus and holds it to what may never happen, whatever fails. */
#pragma once

#include <chrono>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bus/bus.h"
#include "bus/bus_options.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/logger_status_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"

namespace forereach {

class Witness final {
 public:
  /** States of the robot with this sequence or a later one are the campaign's lies, and show nothing that a robot does.
   */
  static constexpr std::int64_t kFirstLie = 1 << 30;

  /** @param bus hands out authentic messages only.
  @param spoiled if somebody between the certifier and this drops, repeats, delays or alters messages: the numbers of
  decisions are then not judged. */
  Witness(Bus& bus, const BusOptions& channels, bool spoiled);

  /** One line for each thing that may not happen and did since the last call:
      - a robot executes a plan for which no certified plan, signed and sealed, was on the bus (a flood can make this
        listener lose messages; after a loss such a plan is unjudged());
      - a control is applied that is not the one of that plan and step, or from a state outside that step's slice;
      - a candidate is answered twice by one certifier, or two of its decisions have one number;
      - a decision is not among the candidates that the certifier's heartbeat counts. */
  [[nodiscard]] std::vector<std::string> TakeViolations() { return std::exchange(violations_, {}); }

  [[nodiscard]] std::int64_t decisions() const { return decisions_; }
  /** What a candidate with this digest was answered. */
  [[nodiscard]] std::optional<std::int16_t> CauseOf(const Digest& candidate) const {
    const auto answer = answers_.find(candidate);
    return answer == answers_.end() ? std::nullopt : std::optional(answer->second.cause);
  }
  /** From now on it may not happen either that a plan is certified under any other obstacles than one of these sets. */
  void SetWorld(std::set<Digest> obstacles) { world_ = std::move(obstacles); }

  /** Candidates that the certifiers had counted one heartbeat ago and whose decisions were not heard: never sent, or
  lost on the way. */
  [[nodiscard]] std::int64_t unheard() const { return earlier_unheard_ + unheard_; }
  /** Plans that a robot executed and whose certificate was not heard, on a bus that lost messages to this listener. */
  [[nodiscard]] std::int64_t unjudged() const { return std::ssize(unjudged_); }
  /** Certified plans, signed and sealed. */
  [[nodiscard]] std::int64_t certificates() const { return certificates_; }
  [[nodiscard]] const certified_plan_t* last_certified() const { return last_certified_; }
  /** The newest of them that a robot has executed, counted from 1 in the order in which they came; 0 for none. */
  [[nodiscard]] std::int64_t executed() const { return executed_; }
  /** The last one that the certifier has latched, and the certificates heard since. */
  [[nodiscard]] const std::optional<fault_t>& fault() const { return fault_; }
  [[nodiscard]] std::int64_t certificates_since_fault() const { return certificates_ - certificates_at_fault_; }
  /** The last time a state was heard. */
  [[nodiscard]] std::chrono::steady_clock::time_point robot_heard() const { return robot_heard_; }
  [[nodiscard]] const std::optional<certifier_status_t>& status() const { return status_; }
  [[nodiscard]] const std::optional<logger_status_t>& logger_status() const { return logger_status_; }
  void Forget() { status_.reset(), logger_status_.reset(), fault_.reset(); }
  void ForgetFault() { fault_.reset(); }

 private:
  /** The message, if its sender has the key and it came once; else nothing, which no type decodes. */
  void OnDecision(const Received& received);
  void OnStatus(const Received& received);
  void OnFault(const Received& received);
  void OnCertified(const Received& received);
  void OnState(const Received& received);
  void OnEvent(const Received& received);
  void OnTransition(const Received& received);
  void Violate(const std::string& what) { violations_.push_back(what); }

  Bus& bus_;
  const BusOptions channels_;
  const bool spoiled_;
  struct Certified {
    certified_plan_t plan;
    std::int64_t number;  // counts certificates from 1
  };
  std::map<std::int64_t, Certified> plans_;
  const certified_plan_t* last_certified_ = nullptr;  // in plans_
  struct Answer {
    Digest decision;  // of the message
    std::int16_t cause;
  };
  std::map<Digest, Answer> answers_;                // by the candidate
  std::map<std::int64_t, Digest> by_number_;        // decisions of the present certifier
  std::int64_t counted_ = 0, highest_ = -1;         // at its last heartbeat: candidates counted, highest number heard
  std::int64_t unheard_ = 0, earlier_unheard_ = 0;  // of it, and of those before it
  struct Applied {
    std::int64_t plan_id;
    int step;
  };
  struct Withdrawn {
    std::int64_t utime;
    int standing_steps;
  };
  std::map<std::int64_t, Withdrawn> withdrawn_;  // by plan_id, as the robot has answered
  std::map<std::int64_t, Applied> applied_;      // by the boundary from which it is applied
  std::set<std::int64_t> unjudged_;              // plan ids
  std::set<Digest> world_;                       // empty: any
  std::optional<certifier_status_t> status_;
  std::optional<logger_status_t> logger_status_;
  std::chrono::steady_clock::time_point robot_heard_{};
  std::optional<fault_t> fault_;
  std::int64_t decisions_ = 0, certificates_ = 0, certificates_at_fault_ = 0, executed_ = 0;
  std::vector<std::string> violations_;
};

}  // namespace forereach
