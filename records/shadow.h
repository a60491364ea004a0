/** What a certifier in shadow mode would have done, and what happened: to a robot that does not obey it. */
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "forereach/execution_event_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/angle.h"
#include "records/kept_obstacles.h"
#include "records/recorded_case.h"
#include "records/timeline.h"

namespace forereach {

struct ShadowSummary {
  /** Plans that the robot says it executed (robot_state_t's executing_plan_id). */
  struct Driven {
    std::int64_t plans = 0, contacts = 0;
    friend bool operator==(const Driven&, const Driven&) = default;
  };
  std::int64_t certified = 0;                   ///< Would be.
  std::map<std::string, std::int64_t> refused;  ///< Would be: abstentions, by cause.
  std::int64_t not_judged = 0;                  ///< Rejected for another reason than the mode.
  Driven driven_certified, driven_refused;
  std::int64_t other_contacts = 0;  ///< While the robot executed neither.
  /** Of the driven plans that would be certified: those of which the robot left a slice, and its states compared with
  slices, and outside them (left). */
  std::int64_t plans_left = 0, states = 0, states_left = 0;
  std::int64_t not_compared = 0;  ///< Plans that this program decides otherwise than the log, so it has no slices.

  [[nodiscard]] std::int64_t refusals() const;
  /** Whether anything was decided in shadow mode. */
  [[nodiscard]] bool any() const { return certified + refusals() + not_judged > 0; }
};

/** Aligned lines that end with a newline; empty if nothing was decided in shadow mode. */
[[nodiscard]] std::string ToText(const ShadowSummary& summary);
/** One sentence, likewise. */
[[nodiscard]] std::string ToSentence(const ShadowSummary& summary);
[[nodiscard]] nlohmann::json ToJson(const ShadowSummary& summary);

/** Counts the decisions of a timeline that were made in shadow mode. Cost: one certify call for each driven plan that
would be certified. Of the last kMostPlans plans it is known what was decided. */
class ShadowTally final : public TimelineUser, CaseJudge {
 public:
  static constexpr std::size_t kMostPlans = 4096;

  explicit ShadowTally(unsigned threads) : CaseJudge(threads) {}

  void OnStart(const Config& task) override { channels_ = task.bus; }
  void OnDecision(const RecordedDecision& recorded) override;
  void OnEvent(const LogEvent& event) override;

  /** After the timeline was read. */
  [[nodiscard]] ShadowSummary Finish();

 private:
  struct Plan {
    RecordedCase recorded;
    bool is_certified = false;
    std::vector<robot_state_t> states = {};  // in which the robot executed it
  };
  struct Drive {
    std::vector<robot_state_t> states;
    std::int64_t left = 0;
    bool is_compared = false;
  };

  void Follow(const robot_state_t& state);
  void EndPlan();
  [[nodiscard]] ShadowSummary::Driven* DrivenNow();
  void Refuse(const JudgedCandidate& judged, const std::string&) override {
    ++summary_.not_compared;
    drives_.erase(judged.place);
  }
  void Look(const JudgedCandidate& judged, const Certifier& certifier, const Decision& again,
            const Tube& tube) override;
  void Take(const JudgedCandidate& judged) override;

  BusOptions channels_;
  std::map<std::int64_t, Plan> plans_;  // by plan_id
  std::deque<std::int64_t> order_;
  KeptObstacles obstacles_;              // of these plans
  std::int64_t driven_ = -1;             // the plan that the robot executes; -1: none of plans_
  bool is_driven_certified_ = false;     // of it
  std::map<std::size_t, Drive> drives_;  // that wait to be compared, by place
  std::size_t next_place_ = 0;
  ShadowSummary summary_;
};

}  // namespace forereach
