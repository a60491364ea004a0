#include "certifier/gate/upheld.h"

#include <algorithm>
#include <functional>

#include <fmt/core.h>

#include "forereach/numerics/text.h"
#include "task/step_time.h"

namespace forereach {

bool Upheld::Suffices(const Upheld& other) const {
  // The guard that has this plan holds steps to the seal's step error, and the start to X0 less the seal's state error.
  // So a smaller step error and larger state errors uphold what the other task rests on, too.
  const bool is_on_time = other.step_error_us < 0 || (0 <= step_error_us && step_error_us <= other.step_error_us);
  return is_on_time && std::ranges::equal(state_error, other.state_error, std::greater_equal());
}

Upheld UpheldUnder(const Problem& problem, const GateOptions& options) {
  Upheld upheld;
  std::ranges::copy(problem.declaration.state_error, upheld.state_error.begin());
  upheld.step_error_us = StepErrorUs(options).value_or(-1);
  return upheld;
}

Upheld UpheldBy(const certified_plan_t& certified) {
  Upheld upheld;
  std::ranges::copy(certified.state_error, upheld.state_error.begin());
  upheld.step_error_us = certified.step_error_us;
  return upheld;
}

void SetUpheld(certified_plan_t& certified, const Upheld& upheld) {
  std::ranges::copy(upheld.state_error, certified.state_error);
  certified.step_error_us = upheld.step_error_us;
}

std::vector<UpheldDifference> FindDifferences(const Upheld& expected, const Upheld& found) {
  std::vector<UpheldDifference> differences;
  for (std::size_t k = 0; k < expected.state_error.size(); ++k)
    if (const double of_task = expected.state_error[k], of_plan = found.state_error[k]; of_task != of_plan)
      differences.push_back({fmt::format("state_error[{}]", k), ToText(of_task), ToText(of_plan)});
  if (expected.step_error_us != found.step_error_us)
    differences.push_back(
        {"step_error_us", std::to_string(expected.step_error_us), std::to_string(found.step_error_us)});
  return differences;
}

}  // namespace forereach
