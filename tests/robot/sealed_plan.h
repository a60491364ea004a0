/** Certified plans for tests, with the digests they need to pass, and the options of a guard that takes them. */
#pragma once

#include <cstdint>
#include <vector>

#include "forereach/certified_plan_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "lcmtypes/grounds.h"
#include "lcmtypes/seal.h"
#include "robot/guard.h"

namespace forereach {

/** Sets plan_digest and certificate_digest to what they have to be. */
template <class Certified>
void Seal(Certified& certified) {
  SetDigest(certified.plan_digest, PlanDigest(certified.plan));
  SetDigest(certified.certificate_digest, CertificateDigest(certified));
}

/** Each digest of what it rests on is that of its name. */
inline void NameGrounds(certified_plan_t& certified) {
  SetGrounds(certified, {DigestOf("config"), DigestOf("model"), DigestOf("declaration"), DigestOf("observations"),
                         DigestOf("obstacles")});
  SetDigest(certified.transitions_digest, DigestOf("transitions"));
}

inline constexpr std::int64_t kPlanStart = 1'000'000'000'000, kPlanStepUs = 40'000;

/** Two states, one input, three steps. X0 = (1 +- 0.5, -2 +- 0.25); slice t = [-10 - t, 10 + t] x [-5, 5]; states are
exact. Not sealed. */
inline certified_plan_t SmallPlan(std::int64_t plan_id = 7, std::int64_t step_error_us = -1) {
  certified_plan_t certified{};
  candidate_plan_t& plan = certified.plan;
  plan.plan_id = plan_id;
  plan.start_utime = kPlanStart;
  plan.step_us = kPlanStepUs;
  plan.num_states = 2;
  plan.num_inputs = 1;
  plan.num_steps = 3;
  plan.progress_steps = 1;
  plan.initial_center[0] = 1;
  plan.initial_center[1] = -2;
  plan.initial_half_width[0] = 0.5;
  plan.initial_half_width[1] = 0.25;
  certified.expires_utime = kPlanStart + kPlanStepUs;
  certified.step_error_us = step_error_us;
  for (int t = 0; t <= 3; ++t) {
    certified.slice_lower[t][0] = -10 - t;
    certified.slice_upper[t][0] = 10 + t;
    certified.slice_lower[t][1] = -5;
    certified.slice_upper[t][1] = 5;
  }
  NameGrounds(certified);
  return certified;
}

/** Of a guard that takes SmallPlan. */
inline GuardOptions TwoStates() {
  GuardOptions options{2, 1, kPlanStepUs, {}, {}};
  options.config_digest = DigestOf("config");
  options.model_digest = DigestOf("model");
  return options;
}

enum : std::int16_t {
  kAccepted = execution_event_t::ACCEPTED,
  kRefused = execution_event_t::REFUSED,
  kStarted = execution_event_t::STARTED,
  kInside = execution_event_t::STEP_INSIDE,
  kLeft = execution_event_t::STEP_OUTSIDE,
  kTailBegun = execution_event_t::TAIL_BEGUN,
  kStanding = execution_event_t::STANDING,
  kGoalReached = execution_event_t::GOAL_REACHED,
  kContact = execution_event_t::CONTACT,
  kHalted = execution_event_t::HALTED,
  kReset = execution_event_t::RESET,
  kOffSchedule = execution_event_t::OFF_SCHEDULE,
  kWithdrawn = execution_event_t::WITHDRAWN,
  kStop = execution_event_t::EMERGENCY_STOP
};

inline std::vector<std::uint8_t> Sealed(certified_plan_t certified) {
  Seal(certified);
  return Encode(certified);
}

}  // namespace forereach
