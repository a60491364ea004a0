/** Random tasks with everything that decides a step, and the fields of a decision to compare. */
#pragma once

#include <memory>
#include <tuple>

#include "forereach/certify/decision.h"
#include "tests/oracle/affine_problems.h"
#include "tests/oracle/any_surroundings.h"

namespace forereach {

/** All of them. */
inline auto Fields(const Decision& d) {
  return std::tuple(d.outcome, d.cause, d.step, d.exit.kind, d.exit.index, d.exit.value, d.exit.bound, d.coordinate,
                    d.first_observation, d.second_observation, d.obstacle, d.part, d.closest_step, d.margin,
                    d.threshold, d.capped);
}

/** Body, bounds between the samples, disturbances, affine rows, offsets, limits, rest. */
inline std::shared_ptr<Problem> AnyTask(Random& random, bool bicycle) {
  auto problem = AnyWorld(random, bicycle);
  if (random.Coin(0.4)) Disturb(random, *problem);
  if (random.Coin(0.3)) static_cast<void>(MakeAffine(random, *problem));
  if (random.Coin(0.4)) Shift(random, *problem);
  const auto& names = problem->model->state_names();
  if (random.Coin(0.5))
    problem->limits = {{.name = "a limit", .that = {names[0] + "*" + names.back()}, .at_most = random.Uniform(0, 30)}};
  if (random.Coin(0.2)) problem->rest = {{problem->model->num_states() - 1, 0.5}};
  return problem;
}

}  // namespace forereach
