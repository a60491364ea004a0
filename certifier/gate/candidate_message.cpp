#include "certifier/gate/candidate_message.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "certifier/gate/stamp.h"
#include "forereach/sets/zonotope.h"
#include "task/step_time.h"

namespace forereach {

bool HasSizes(const candidate_plan_t& candidate, const NominalModel& model) {
  return candidate.num_states == model.num_states() && candidate.num_inputs == model.num_inputs() &&
         1 <= candidate.num_steps && candidate.num_steps <= kMaxSteps;
}

Plan PlanOf(const candidate_plan_t& candidate, const Schedule& schedule) {
  return {candidate.control[0], candidate.num_inputs, candidate.num_steps, kMaxInputs, schedule};
}

Plan PlanOf(const candidate_batch_t& batch, int k, const Schedule& schedule) {
  return {batch.control + FirstNumberOf(batch, k), batch.num_inputs, batch.num_steps[k], batch.num_inputs, schedule};
}

void SetPlan(candidate_plan_t& candidate, const Eigen::VectorXd& center, const Eigen::VectorXd& half_width,
             const Eigen::MatrixXd& controls) {
  candidate.num_states = static_cast<std::int16_t>(center.size());
  candidate.num_inputs = static_cast<std::int16_t>(controls.rows());
  candidate.num_steps = candidate.progress_steps = static_cast<std::int16_t>(controls.cols());
  std::ranges::copy(center, candidate.initial_center);
  std::ranges::copy(half_width, candidate.initial_half_width);
  for (Eigen::Index t = 0; t < controls.cols(); ++t) std::ranges::copy(controls.col(t), candidate.control[t]);
}

Schedule ScheduleOf(const candidate_plan_t& candidate, const GateOptions& options) {
  if (!options.max_clock_error_ms) return {};
  return {candidate.start_utime, candidate.step_us, ScheduleErrorUs(options)};
}

std::string WhyNoSchedule(const candidate_plan_t& candidate, const GateOptions& options) {
  if (options.step_us != 0 && candidate.step_us != options.step_us)
    return fmt::format("step_us is {}, must be {}, model.dt: the model says what a step of this time does",
                       candidate.step_us, options.step_us);
  if (!options.max_clock_error_ms) return {};
  const std::int64_t longest = std::min(Microseconds(options.longest_step_ms), Schedule::kLongest);
  if (candidate.step_us < 1 || candidate.step_us > longest)
    return fmt::format("step_us is {}, must be 1 to {}", candidate.step_us, longest);
  if (candidate.start_utime < -Schedule::kLatest || candidate.start_utime > Schedule::kLatest)
    return fmt::format("start_utime is {}, must be within 2^60 of the epoch", candidate.start_utime);
  return {};
}

Zonotope InitialSetOf(const candidate_plan_t& candidate) {
  const int n = candidate.num_states;
  if (!(1 <= n && n <= kMaxStates))
    throw std::invalid_argument(fmt::format("candidate: {} states, must be 1 to {}", n, kMaxStates));
  return Zonotope::FromBox(Eigen::Map<const Eigen::VectorXd>(candidate.initial_center, n),
                           Eigen::Map<const Eigen::VectorXd>(candidate.initial_half_width, n));
}

std::int64_t StartOf(Bytes candidate) {
  // After the fingerprint, utime, sequence, plan_id and source, of a batch, too.
  constexpr std::size_t kStartsAt = 4 * sizeof(std::int64_t) + sizeof candidate_plan_t::source;
  const auto is = [&](std::size_t size, std::int64_t hash) {
    return candidate.size() == size && FromBigEndian<std::int64_t>(candidate) == hash;
  };
  if (!is(EncodedSize<candidate_plan_t>(), candidate_plan_t::getHash()) &&
      !is(EncodedSize<candidate_batch_t>(), candidate_batch_t::getHash()))
    // What is no candidate waits for its refusal, and is never due.
    return INT64_MAX;
  return FromBigEndian<std::int64_t>(candidate.subspan(kStartsAt));
}

}  // namespace forereach
