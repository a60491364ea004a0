#include "certifier/gate/candidate_message.h"

#include <stdexcept>
#include <string>

namespace forereach {

Plan PlanOf(const candidate_plan_t& candidate) {
  return {candidate.control[0], candidate.num_inputs, candidate.num_steps, kMaxInputs};
}

Zonotope InitialSetOf(const candidate_plan_t& candidate) {
  const int n = candidate.num_states;
  if (!(1 <= n && n <= kMaxStates))
    throw std::invalid_argument("candidate: " + std::to_string(n) + " states, must be 1 to " +
                                std::to_string(kMaxStates));
  return Zonotope::FromBox(Eigen::Map<const Eigen::VectorXd>(candidate.initial_center, n),
                           Eigen::Map<const Eigen::VectorXd>(candidate.initial_half_width, n));
}

std::int64_t StartOf(Bytes candidate) {
  // After the fingerprint, utime, sequence, plan_id and source.
  constexpr std::size_t kStartsAt = 4 * sizeof(std::int64_t) + sizeof candidate_plan_t::source;
  if (candidate.size() != EncodedSize<candidate_plan_t>() ||
      FromBigEndian<std::int64_t>(candidate) != candidate_plan_t::getHash())
    return INT64_MAX;
  return FromBigEndian<std::int64_t>(candidate.subspan(kStartsAt));
}

}  // namespace forereach
