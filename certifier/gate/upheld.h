/** The numbers under a certified plan's seal that the robot's guard upholds (robot/guard.h): hypotheses of its
certificate. */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "forereach/certified_plan_t.hpp"
#include "task/config.h"

namespace forereach {

struct Upheld {
  std::array<double, 16> state_error = {};  ///< declaration.state_error, as certified_plan_t's.
  std::int64_t step_error_us = -1;          ///< robot.step_error_ms, likewise; -1: no clock is looked at.
  friend bool operator==(const Upheld&, const Upheld&) = default;

  /** Whether a robot that upholds this also upholds the other: measured states are taken to be off by as much at least,
  and steps held to their times as closely at least. */
  [[nodiscard]] bool Suffices(const Upheld& other) const;
};

/** What plans that are certified under this task say. */
[[nodiscard]] Upheld UpheldUnder(const Problem& problem, const GateOptions& options);
[[nodiscard]] Upheld UpheldBy(const certified_plan_t& certified);
void SetUpheld(certified_plan_t& certified, const Upheld& upheld);

/** A field that differs, and its values as text. */
struct UpheldDifference {
  std::string field, expected, found;
};
/** How what a plan says differs from what the task says; empty if it does not. */
[[nodiscard]] std::vector<UpheldDifference> FindDifferences(const Upheld& expected, const Upheld& found);

}  // namespace forereach
