/** Obstacles that a tube from the whole of X_0 just may touch. */
#pragma once

#include <vector>

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"

namespace forereach {

/** A circle of 1 m to the right of where the nominal model ends from the middle of X_0, looking along its last step: as
far away as the plan is not certified, up to 1e-6 m. @pre the first two states are the position, and the plan is
certified with the circle 20 m away. */
inline Obstacle JustTouched(const Certifier& certifier, const Plan& plan, const Zonotope& initial_set) {
  const NominalModel& model = *certifier.problem().model;
  std::vector<double> z(initial_set.center().begin(), initial_set.center().end()), next(z);
  Eigen::Vector2d before, end;
  for (int t = 0; t < plan.num_steps; ++t) {
    before = {next[0], next[1]};
    z = next;
    z.insert(z.end(), plan.input(t).begin(), plan.input(t).end());
    model.Evaluate(z, next);
    end = {next[0], next[1]};
  }
  const Eigen::Vector2d along = (end - before).normalized(), right(along.y(), -along.x());
  const auto circle = [&](double away) { return Obstacle::Circle(end + away * right, 1); };
  const auto is_certified = [&](double away) {
    static Tube tube;
    const Obstacle obstacle = circle(away);
    return certifier.Certify(plan, initial_set, {&obstacle, 1}, tube).outcome == Outcome::kCertified;
  };
  double touched = 1, clear = 20;
  while (clear - touched > 1e-6) {
    const double middle = (touched + clear) / 2;
    (is_certified(middle) ? clear : touched) = middle;
  }
  return circle(touched);
}

}  // namespace forereach
