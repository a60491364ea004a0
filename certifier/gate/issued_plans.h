/** Which plans may be executing: those that were certified, and not too long ago.

A guard executes certified plans only, and begins none after its certificate has expired. So a robot that reports
executing another plan, or a step that its plan does not have, or a plan that began too late, has no such guard, or one
that does not work. Plans of another certifier, for example of the process before this one, are not known here. For as
long as such a plan might still be executing, unknown plans are tolerated. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "certifier/task/config.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/robot_state_t.hpp"

namespace forereach {

class IssuedPlans final {
 public:
  static constexpr std::size_t kPlans = 32768;  ///< More at a time are not remembered; then unknown ones are tolerated.

  struct Stranger {
    std::int64_t plan_id;
    int step;
    std::string why;  ///< A sentence with the values.
  };

  /** All times `steady_us` are of a clock that nobody sets, in microseconds. */
  IssuedPlans(const GateOptions& gate, std::int64_t steady_us);

  /** From here on by these. */
  void Follow(const GateOptions& gate);
  /** Another certifier may have issued plans until now: tolerates unknown ones for as long as these may be executing.
   */
  void TolerateFrom(std::int64_t steady_us);

  /** A plan was certified and sent. Cost O(1) on average. */
  void Add(const certified_plan_t& certified, std::int64_t steady_us);

  /** What is wrong with what a robot says that it executes; nothing if it stands, or may execute that.
  @param state usable and fresh (Gate::CheckRobotState). Cost O(plans remembered): some 30 us at most. */
  [[nodiscard]] std::optional<Stranger> Judge(const robot_state_t& state, std::int64_t steady_us);

 private:
  struct Issued {
    std::int64_t plan_id, expires_utime, step_us;
    std::int64_t may_run_until_us;  // by the steady clock
    int num_steps;
    bool has_begun;  // and not too late
  };

  /** After a certificate is issued, its plan is over within this time. */
  [[nodiscard]] std::int64_t LongestLife(int num_steps) const;
  [[nodiscard]] std::string WhyNot(Issued& issued, const robot_state_t& state) const;

  std::int64_t lifetime_us_ = 0, delay_us_ = 0, step_us_ = 0;
  std::int64_t tolerates_until_us_ = 0;
  std::deque<Issued> issued_;  // the oldest first
};

}  // namespace forereach
