/** Runtime conformance: is the robot where its certificate says?

A state measured outside its certified slice refutes what the certificate rests on: the model, the declaration, its
noise bound, or the measurement. The robot's guard looks for it too; the certifier does so that nothing more is
certified on grounds that are known to be false. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "forereach/certified_plan_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "lcmtypes/stream_order.h"

namespace forereach {

class Conformance final {
 public:
  static constexpr std::size_t kPlans = 64;  ///< The last certified ones are remembered, and the one that is executed.

  struct Departure {
    std::int64_t plan_id;
    int step, coordinate;
    double value, lower, upper;
  };

  Conformance() { plans_.reserve(kPlans); }

  /** In the place of one of the same plan_id, unless that is executed: a guard does not take the plan_id it executes.
   */
  void Remember(const certified_plan_t& certified);

  /** Holds a usable state of the robot against the slice of the step that it says it is at, and, if it has gone on by
  one boundary while executing, against that of the plan it was executing before. Nothing if it lies in them, or no
  certificate for its plan is remembered. Cost O(n). */
  [[nodiscard]] std::optional<Departure> Check(const robot_state_t& state);

  /** Holds the end of a step that began with one of the last two states heard against the slice after it. A robot that
  ends its plan there, or whose guard stops it, stands from then on, and its states say nothing of slices; that it
  stands may be heard first. */
  [[nodiscard]] std::optional<Departure> Check(const transition_t& transition) const;

 private:
  struct Place {
    std::int64_t utime = -1, plan_id = -1;  // plan -1: not executing
    int step = -1;
  };

  [[nodiscard]] std::vector<certified_plan_t>::const_iterator Find(std::int64_t plan_id) const;
  [[nodiscard]] std::optional<Departure> Compare(std::int64_t plan_id, int step, std::span<const double> state) const;

  std::vector<certified_plan_t> plans_;  // a ring
  std::size_t next_ = 0;
  StreamOrder order_;
  Place last_, before_;  // where the robot was by the newest state heard, and by the one before
};

}  // namespace forereach
