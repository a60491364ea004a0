#include "forereach/safety/motion.h"

#include <algorithm>

#include "forereach/numerics/size.h"

namespace forereach {
namespace {

// Encloses so many microseconds in seconds. A whole number beyond 2^53 may be rounded to a double.
Interval Seconds(std::int64_t us) noexcept {
  const auto rounded = static_cast<double>(us);
  constexpr std::int64_t kExact = std::int64_t{1} << 53;
  const bool is_exact = -kExact <= us && us <= kExact;
  return (is_exact ? Interval(rounded) : Interval(NextDown(rounded), NextUp(rounded))) / Interval(1e6);
}

}  // namespace

Encounter Meet(const ObstacleMotion& motion, const Schedule& schedule, int first, int last) noexcept {
  Encounter encounter;
  encounter.moves = true;
  const std::int64_t error = schedule.clock_error_us;
  const std::array at{schedule.start_us + first * schedule.step_us, schedule.start_us + last * schedule.step_us};
  // Windows are widened by the clock's error: an obstacle that may be there counts.
  encounter.is_there = at[0] - error <= motion.until_us && motion.from_us <= at[1] + error;
  if (!encounter.is_there) return encounter;
  Interval speed_square(0);
  for (std::size_t k = 0; k < kMaxSafetyDim; ++k) {
    const Interval velocity(motion.velocity[static_cast<Eigen::Index>(k)]);
    for (std::size_t end = 0; end < 2; ++end) encounter.shift[end][k] = velocity * Seconds(at[end] - motion.stamp_us);
    speed_square += sqr(velocity);
  }
  const std::int64_t before = motion.stamp_us - (at[0] - error), after = at[1] + error - motion.stamp_us;
  const double tau = Seconds(std::max(before, after)).upper;  // the largest |tau|: not negative
  const double grown =
      AddUp(motion.uncertainty, AddUp(MulUp(motion.growth, tau), HalfUp(MulUp(motion.growth_rate, MulUp(tau, tau)))));
  // A clock that is off by `error` moves the obstacle by at most its speed times that: docs/soundness.md, 3.9.
  encounter.growth = AddUp(grown, MulUp(SqrtUp(speed_square.upper), Seconds(error).upper));
  return encounter;
}

}  // namespace forereach
