/** Bounds on how far a motion x' = f(x, u) curves from one sample to the next, where u is constant: what `Between`
(forereach/safety/body.h) declares. They are proven by interval branch and bound over the states that such a motion can
reach between two samples. */
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "forereach/declare/flow.h"
#include "forereach/declare/slope_bound.h"
#include "forereach/dynamics/model.h"
#include "forereach/reach/domain.h"
#include "forereach/residual/transitions.h"
#include "forereach/safety/body.h"
#include "forereach/sets/eigen.h"

namespace forereach {

/** lower <= sup |g| <= upper, where g is one derivative of the motion. */
struct MotionBound {
  double upper = 0;
  double lower = 0;       ///< Of |g| at one state of the box over which it is bounded.
  std::size_t boxes = 0;  ///< Number of boxes evaluated.
  bool reached = true;    ///< Whether the search reached the gap.
};

struct MotionBounds {
  std::vector<MotionBound> acceleration;     ///< Of each (P x)_k'' and of coordinate k of each place.
  MotionBound turn_rate, turn_acceleration;  ///< Of the heading's first and second derivative; 0 without a heading.
  std::vector<MotionBound> rates;            ///< Of |x_k'| for each of SampledMotion::rates_of, over `reachable`.
  Box reachable;                             ///< B of z, which no motion leaves within rates_period.
};

/** Is asked again and again whether the search at hand ends now, with the bound that it has by then.
@param done, next the share of all searches that is behind, without and with the one at hand. */
using MotionWatch = std::function<bool(double done, double next)>;

/** The motion between two samples, a period apart, of a plan that is certified. */
struct SampledMotion {
  const Flow& flow;                   ///< Its places: those of points of a body, p coordinates each.
  const Domain& domain;               ///< Only its box is used.
  double period;                      ///< The longest time between the samples, s.
  const Eigen::MatrixXd& projection;  ///< P, p-by-n
  int heading;                        ///< The state that is the heading; -1: none.
  /** A plan ends with |x_k| <= rest_k; infinite where nothing is known. n entries. */
  Eigen::VectorXd rest;
  MotionWatch watch = {};          ///< None: every search runs to its end.
  std::vector<int> rates_of = {};  ///< States.
  double rates_period = 0;         ///< From a sample on, s: their rates are bounded for so long.
};

/** Bounds for every motion that is in the domain at its samples. A plan's last sample is not tested against the domain;
there the bounds hold for every motion that begins in the domain and ends at rest.

Let Z be the domain's box, and E the box of the second sample: Z, or in the last step what is reached and at rest. No
motion leaves a box B with Z + [0, period] f(B) in B within a period; without such a B for the whole period it is that
of its halves, one after the other. B is cut down to what lies within period^2 / 8 sup |x_k''| of the chords from Z to
E, in Z + [0, period] f(B), and in E - [0, period] f(B), as long as that helps. Where f or x'' has no finite enclosure
over a box, it is enclosed over pieces.
@throws std::runtime_error if there is no such B or no finite bound, for example over a pole of the tangent, or none
before the watch ended the search.
@throws std::invalid_argument if a size is wrong. Cost: at most options.max_boxes evaluations for each bound. */
[[nodiscard]] MotionBounds BoundMotion(const SampledMotion& motion, const SlopeBoundOptions& options = {});

/** What recorded transitions show: the largest second difference of positions, of the frame and of places at
expressions, over a period squared, in plain arithmetic. It is at most the largest acceleration between the samples. */
struct MeasuredMotion {
  Eigen::VectorXd acceleration;
  double turn_rate = 0, turn_acceleration = 0;
  int triples = 0;  ///< Of samples that follow one another: a transition begins with the state in which the last ended.
};

/** An angle of the model (angles.h) may be recorded with any number of turns: in each step it moves to where it is
nearest to the model's next value, and samples follow one another if they are equal up to turns.
@param model of the transitions. @param body its heading is measured, and the places of its points at expressions. */
[[nodiscard]] MeasuredMotion MeasureMotion(const NominalModel& model, const Transitions& transitions,
                                           const Eigen::MatrixXd& projection, const Body& body, double period);

}  // namespace forereach
