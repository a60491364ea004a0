/** A candidate from the bus, as a certifier takes it. */
#pragma once

#include <cstdint>

#include "certifier/certify/decision.h"
#include "forereach/candidate_plan_t.hpp"
#include "lcmtypes/codec.h"

namespace forereach {

/** u_0 .. u_{T-1}. Refers to the candidate's numbers; whether its counts fit is for Certifier::Require to say. */
[[nodiscard]] Plan PlanOf(const candidate_plan_t& candidate);

/** X_0. @throws std::invalid_argument if num_states is not 1 to 16, or as Zonotope::FromBox does. */
[[nodiscard]] Zonotope InitialSetOf(const candidate_plan_t& candidate);

/** start_utime of the bytes of a candidate, read where it lies in them: nothing is decoded. INT64_MAX for bytes that
Decode refuses. */
[[nodiscard]] std::int64_t StartOf(Bytes candidate);

}  // namespace forereach
