/** Obstacles that move, and the times at which a plan meets them. */
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "forereach/numerics/interval.h"
#include "forereach/numerics/limits.h"
#include "forereach/sets/eigen.h"

namespace forereach {

/** How an obstacle O moves. At the time stamp_us + tau it lies in
    O + velocity tau + {y : |y|_2 <= uncertainty + growth |tau| + growth_rate tau^2 / 2},    tau in seconds,
if that time lies in the window [from_us, until_us], and nowhere otherwise. */
struct ObstacleMotion {
  static constexpr std::int64_t kAlways = std::numeric_limits<std::int64_t>::max();

  std::int64_t stamp_us = 0;                            ///< Microseconds since the epoch of the plan's schedule.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();   ///< m/s; unused entries are 0.
  double uncertainty = 0;                               ///< m, not negative, like the two below.
  double growth = 0;                                    ///< m/s
  double growth_rate = 0;                               ///< m/s^2
  std::int64_t from_us = -kAlways, until_us = kAlways;  ///< from_us <= until_us; -kAlways, kAlways: without an end.

  friend bool operator==(const ObstacleMotion&, const ObstacleMotion&) = default;
};

/** The times of a plan's samples: sample t is at start_us + t step_us, and a time between two samples in proportion.
Each time is known up to clock_error_us. */
struct Schedule {
  static constexpr std::int64_t kLatest = std::int64_t{1} << 60, kLongest = std::int64_t{1} << 40;

  std::int64_t start_us = 0;        ///< At most kLatest in magnitude, as are the stamps of obstacles.
  std::int64_t step_us = 0;         ///< 1 to kLongest; 0: the plan has no schedule, so no obstacle may move.
  std::int64_t clock_error_us = 0;  ///< 0 to kLongest.
};

/** What has to be known of a moving obstacle to separate it from one step of a plan, in its own frame. */
struct Encounter {
  /** False: the obstacle is nowhere during the step. */
  bool is_there = true;
  /** False: the obstacle stands, and the shift is zero. */
  bool moves = false;
  /** velocity * tau at the first and at the last sample of the step, metres. The clock is taken to be exact. */
  std::array<std::array<Interval, kMaxSafetyDim>, 2> shift{};
  /** An upper bound on what is added to the obstacle's radius: its growth and |velocity| * clock error, metres. */
  double growth = 0;
};

/** The encounter with an obstacle between the samples `first` and `last`, first <= last.
@pre the bounds of Schedule hold. Cost O(1), no allocation. */
[[nodiscard]] Encounter Meet(const ObstacleMotion& motion, const Schedule& schedule, int first, int last) noexcept;

}  // namespace forereach
