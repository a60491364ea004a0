/** Candidates of the small task (tests/certifier/small_task.h) as planners of all kinds would send them. */
#pragma once

#include "fuzz/fuzz.h"
#include "tests/certifier/small_task.h"

namespace forereach {

/** Makes something of it odd that a gate looks at. */
inline void Distort(FuzzedDataProvider& input, candidate_plan_t& plan) {
  switch (input.ConsumeIntegralInRange(0, 12)) {
    case 0:
      plan.control[input.ConsumeIntegralInRange(0, 10)][input.ConsumeIntegralInRange(0, 2)] = AnyNumber(input);
      return;
    case 1: plan.initial_center[input.ConsumeIntegralInRange(0, 4)] = AnyNumber(input); return;
    case 2: plan.initial_half_width[input.ConsumeIntegralInRange(0, 4)] = AnyNumber(input); return;
    case 3: plan.start_utime = AnyInteger(input, plan.start_utime, 3'000'000); return;
    case 4: plan.utime = AnyInteger(input, plan.utime, 3'000'000); return;
    case 5: plan.step_us = AnyInteger(input, plan.step_us, 2); return;
    case 6: plan.num_states = AnySmall(input, 16); return;
    case 7: plan.num_inputs = AnySmall(input, 8); return;
    case 8: plan.num_steps = AnySmall(input, 129); return;
    case 9: plan.progress_steps = AnySmall(input, 11); return;
    case 10: plan.sequence = AnyInteger(input, 0, 8); return;
    case 11: plan.plan_id = AnyInteger(input, plan.plan_id, 2000); return;
    case 12: plan.source[0] = input.ConsumeIntegral<std::uint8_t>(); return;
  }
}

/** One that certifies, unless the input wants another. Every second one asks for a repair. */
inline candidate_plan_t AnyCandidate(FuzzedDataProvider& input, std::int64_t now_us) {
  const int plan_id = input.ConsumeIntegralInRange(1, 8);
  const double acceleration = input.PickValueInArray(
      {kAccelerationThatCertifies, kAccelerationIntoTheCircle, kAccelerationOutsideDomain, -1.0});
  candidate_plan_t plan = Candidate(plan_id, acceleration, now_us);
  plan.repair = static_cast<std::int16_t>(plan_id % 2);
  for (int left = NumOdd(input); left > 0; --left) Distort(input, plan);
  return plan;
}

}  // namespace forereach
