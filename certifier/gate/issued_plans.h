/** The certified plans that the robot may be executing now.

A guard executes only certified plans and begins none after its certificate has expired. So a robot that reports another
plan, a step that its plan does not have, or a plan that began too late, has no guard or a defective one. This class
does not know the plans of other certifiers, for example of the process before a restart. It tolerates unknown plans for
as long as such a plan may be executing. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "forereach/certified_plan_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "task/gate_options.h"

namespace forereach {

class IssuedPlans final {
 public:
  static constexpr std::size_t kPlans = 32768;  ///< Capacity. If it is exceeded, unknown plans are tolerated.

  struct Stranger {
    std::int64_t plan_id;
    int step;
    std::string why;  ///< A sentence with the values.
  };

  /** @param gate the task's options. @param steady_us here and below: time of a monotonic clock, microseconds. */
  IssuedPlans(const GateOptions& gate, std::int64_t steady_us);

  /** Uses new options from now on. */
  void Follow(const GateOptions& gate);
  /** Notes that another certifier may have issued plans until now. Unknown plans are tolerated while these may be
  executing. */
  void TolerateFrom(std::int64_t steady_us);

  /** Adds a plan that was certified and sent. Cost O(1) on average. */
  void Add(const certified_plan_t& certified, std::int64_t steady_us);

  /** The violation in the robot's report of the plan that it executes. Nothing if it executes none or an allowed one.
  @param state usable and fresh (Gate::CheckRobotState). Cost O(remembered plans), at most about 30 us. */
  [[nodiscard]] std::optional<Stranger> FindStranger(const robot_state_t& state, std::int64_t steady_us);

 private:
  struct Issued {
    std::int64_t plan_id, expires_utime, step_us;
    std::int64_t may_run_until_us;  // by the monotonic clock
    int num_steps;
    bool has_begun;  // in time
  };

  /** The longest time from the issue of a certificate to the end of its plan. */
  [[nodiscard]] std::int64_t LongestLife(int num_steps) const;
  [[nodiscard]] std::string WhyNot(Issued& issued, const robot_state_t& state) const;

  std::int64_t lifetime_us_ = 0, delay_us_ = 0, step_us_ = 0;
  std::int64_t tolerates_until_us_ = 0;
  std::deque<Issued> issued_;  // the oldest first
};

}  // namespace forereach
