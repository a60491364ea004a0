/** Runtime conformance: tests whether the robot's measured states lie in their certified slices.

A state outside its certified slice refutes an assumption of the certificate: the model, the declaration, its noise
bound, or the measurement. The robot's guard makes the same test. The certifier repeats it so that it certifies nothing
more under a false assumption. */
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "forereach/certified_plan_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "lcmtypes/angle.h"
#include "lcmtypes/sole_sender.h"
#include "lcmtypes/stream_order.h"

namespace forereach {

class Conformance final {
 public:
  static constexpr std::size_t kPlans =
      64;  ///< Number of remembered plans: the last certified ones and the executing one.
  /** Number of remembered states. A second robot under the same name, at any usual rate, does not displace the begin of
  a step before its end is reported. */
  static constexpr std::size_t kPlaces = 32;

  struct Departure {
    std::int64_t plan_id;
    int step, coordinate;
    double value, lower, upper;
  };

  Conformance() { plans_.reserve(kPlans); }

  /** Remembers a certified plan. It replaces a plan of the same plan_id, unless that plan is executing: a guard does
  not accept the plan_id that it executes. @param angles the states that may differ by whole turns: those of the model
  that it was certified with. */
  void Remember(const certified_plan_t& certified, const Angles& angles = {});

  /** Tests a usable state against the slice of the step that it names. If the robot has advanced by one boundary while
  executing, it also tests the state against the slice of the plan that was executing before. Nothing if the state lies
  in the slices, or if the plan is not remembered. @param sender of the message: only the same robot's states and
  transitions are about one step. Cost O(n). */
  [[nodiscard]] std::optional<Departure> Check(const robot_state_t& state, SenderId sender = {});

  /** Tests the end of a step that began at one of the last kPlaces received states against the slice after it. If the
  robot ends its plan or its guard stops it, its later states name no slice, so only the transition shows the departure.
  The transition may arrive after the state that reports the stop. Cost O(n + kPlaces). */
  [[nodiscard]] std::optional<Departure> Check(const transition_t& transition, SenderId sender = {}) const;

 private:
  struct Place {
    std::int64_t utime = -1, plan_id = -1;  // plan -1: not executing
    int step = -1;
    SenderId sender = {};
  };

  struct Known {
    certified_plan_t certified;
    Angles angles;
  };

  [[nodiscard]] std::vector<Known>::const_iterator Find(std::int64_t plan_id) const;
  [[nodiscard]] std::optional<Departure> Compare(std::int64_t plan_id, int step, std::span<const double> state) const;

  std::vector<Known> plans_;  // a ring
  std::size_t next_ = 0;
  StreamOrder order_;
  Place last_;                           // from the newest received state
  std::array<Place, kPlaces> places_{};  // that one and those before it: a ring
  std::size_t next_place_ = 0;
};

}  // namespace forereach
