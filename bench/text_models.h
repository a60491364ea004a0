/** Tasks whose models are text, as a task file would give them. */
#pragma once

#include "bench/tasks.h"
#include "forereach/dynamics/model_text.h"

namespace forereach::bench {

/** The bicycle's equations in the order of kinematic_bicycle.h, and the same as rates. */
[[nodiscard]] ModelText BicycleText(ModelText::Integrator integrator);

/** The midpoint step of the bicycle's rates as its next state, with the stages as definitions. */
[[nodiscard]] ModelText BicycleMidpointText();

/** The task of Scenario::kBicycle with that model. */
[[nodiscard]] Task MakeBicycleTextTask(const ModelText& text, int observations);

/** A quadrotor with 12 states and 4 inputs, Euler angles, a Runge-Kutta step of 0.05 s, 20 steps of hovering with small
turns, 100 observations and a box beside it. */
[[nodiscard]] Task MakeQuadrotorTask();

}  // namespace forereach::bench
