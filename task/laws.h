/** How the planner brakes and steers, as expressions of a task file: the keys planner.stop, emergency_stop,
back_off, hints, at_rest and let. */
#pragma once

#include <optional>
#include <vector>

#include "forereach/certify/problem.h"
#include "forereach/dynamics/text_program.h"

namespace forereach {

/** One expression for each input, in the order of the inputs. A control is its value, clipped to the box of inputs. */
using Law = std::vector<ExpressionText>;

struct Laws {
  std::vector<ModelText::Definition> definitions;  ///< For the laws, after those of the model.
  std::vector<Law> stop;                           ///< Ways to brake to rest, tried in turn.
  std::vector<Law> emergency_stop;                 ///< Those of a stop after a withdrawal. Empty: as `stop`.
  Law back_off;                                    ///< The way out of a dead end. Empty: none is known.
  Law hints;                                       ///< A control towards the goal. Empty: none is known.
  std::optional<ExpressionText> speed;             ///< m/s, negative in reverse. Not set: that of the place, unsigned.
  /** Where a braking tail ends: |x_k| is at most its bound for each of these. Empty: a tail has no end, and is as long
  as a tail may be. Not set: the task does not say it. */
  std::optional<std::vector<RestBound>> at_rest;
};

/** @name Names that hints may use, in the places of inputs, for what the search wants at a state.
The direction of travel in the plane of the first two safety coordinates, rad (0 or pi if there is one coordinate); the
speed in this plane, m/s; and the speed along the third coordinate, m/s. */
///@{
inline constexpr const char *kDesiredHeading = "desired_heading", *kDesiredSpeed = "desired_speed",
                            *kDesiredClimb = "desired_climb";
inline constexpr int kDesired = 3;
///@}

/** The function of the state x whose values are the controls of a law that stops the robot or backs off. It may use
states, parameters, and definitions that depend on these only.
@throws ExpressionError, std::invalid_argument as MakeProgram, if a definition or the law is wrong. */
[[nodiscard]] TextFunction MakeStopLaw(const NominalModel& model, const Laws& laws, const Law& law);

/** The function of the state x whose value is laws.speed. It may use what a stopping law may. @pre the task has it.
@throws as MakeStopLaw. */
[[nodiscard]] TextFunction MakeSpeed(const NominalModel& model, const Laws& laws);

/** The function of (x, desired heading, speed and climb) whose values are the controls of laws.hints.
@throws as MakeStopLaw. */
[[nodiscard]] TextFunction MakeHints(const NominalModel& model, const Laws& laws);

}  // namespace forereach
