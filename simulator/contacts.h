/** What the simulated robot does between two samples, and what it touches.

Between samples it uses bounds on its motion (body.h), those that the task declares, to the full. With s from 0 to 1, T
the period and a sign +1 or -1 for each coordinate, y_k(s) = (1 - s) y_k(0) + s y_k(1) + sign_k a_k T^2 s (1 - s) / 2,
so |y_k''| = a_k, and the sampled states are kept. The heading does the same with turn_acceleration, or with as much of
it as turn_rate leaves. Each point at expressions does what y does, with the same signs. Of all signs it takes those
that bring the body nearest to an obstacle, or deepest into one. */
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forereach/certify/problem.h"
#include "forereach/safety/clearance.h"

namespace forereach {

struct Contact {
  int obstacle = -1, part = -1;  ///< The part that is nearest or deepest.
  double clearance = kInfinity;  ///< Metres, not positive.
  double at = 1;                 ///< Where on the way from the sample before, in (0, 1].
};

/** A state at a time in microseconds. */
struct Sample {
  std::span<const double> x;
  std::int64_t utime;
};

/** The number of times at which a motion between two samples is judged. */
inline constexpr int kSubsteps = 16;

/** The obstacles that the body meets in a state, one contact each. Moving obstacles are where they are at that time,
with their growth. Plain arithmetic. @param places those of the problem's body. */
[[nodiscard]] std::vector<Contact> FindContacts(const BodyPlaces& places, std::span<const Obstacle> obstacles,
                                                const Sample& sample);

/** The obstacles that the body meets after sample `from`, up to and with sample `to`.
@param between the bounds that it uses up; all zero: it moves in a straight line, or stands. */
[[nodiscard]] std::vector<Contact> FindContacts(const Problem& problem, const BodyPlaces& places,
                                                std::span<const Obstacle> obstacles, const Sample& from,
                                                const Sample& to, const Between& between);

}  // namespace forereach
