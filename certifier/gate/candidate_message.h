/** A candidate from the bus, as a certifier takes it. */
#pragma once

#include <cstdint>
#include <string>

#include "forereach/candidate_plan_t.hpp"
#include "forereach/certify/decision.h"
#include "forereach/dynamics/model.h"
#include "forereach/safety/body.h"
#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/codec.h"
#include "task/gate_options.h"

namespace forereach {

class Zonotope;

/** u_0 .. u_{T-1} and their schedule. Refers to the candidate's numbers; whether its counts fit is for
Certifier::Require to say. */
[[nodiscard]] Plan PlanOf(const candidate_plan_t& candidate, const Schedule& schedule = {});

/** The same of candidate k of a batch. @pre WhyNoBatch is empty. */
[[nodiscard]] Plan PlanOf(const candidate_batch_t& batch, int k, const Schedule& schedule);

/** Sets the numbers of a plan: X_0 by its center and half-widths, n entries each, and u_0 .. u_{T-1}, m-by-T. None of
them is of a braking tail: progress_steps is T. @pre HasSizes then holds. */
void SetPlan(candidate_plan_t& candidate, const Eigen::VectorXd& center, const Eigen::VectorXd& half_width,
             const Eigen::MatrixXd& controls);

/** Whether the candidate has the model's states and inputs, and 1 to kMaxSteps steps: whether its numbers may be read.
 */
[[nodiscard]] bool HasSizes(const candidate_plan_t& candidate, const NominalModel& model);

/** When a plan's samples are, by start_utime, step_us and gate.max_clock_error_ms. Without that key the plan has no
schedule. Whether the candidate's times are within the bounds of a schedule is for WhyNoSchedule to say. */
[[nodiscard]] Schedule ScheduleOf(const candidate_plan_t& candidate, const GateOptions& options);

/** Why the candidate's times are no schedule of the task. Where certificates rest on when steps are
(GateOptions::step_us): step_us is not model.dt. With gate.max_clock_error_ms also: step_us is not 1 to the task's
longest step, or start_utime is further than Schedule::kLatest from the epoch. Empty if they are one. */
[[nodiscard]] std::string WhyNoSchedule(const candidate_plan_t& candidate, const GateOptions& options);

/** X_0. @throws std::invalid_argument if num_states is not 1 to 16, or as Zonotope::FromBox does. */
[[nodiscard]] Zonotope InitialSetOf(const candidate_plan_t& candidate);

/** start_utime of the bytes of a candidate or a batch, read where it lies in them: nothing is decoded. INT64_MAX for
bytes that Decode refuses. */
[[nodiscard]] std::int64_t StartOf(Bytes candidate);

}  // namespace forereach
