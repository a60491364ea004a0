/** What became of drives in the lockstep, for tests and experiments. */
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "simulator/lockstep.h"

namespace forereach {

/** Sums over `drives` drives. */
struct DriveCounts {
  std::int64_t drives = 0, goals = 0;           ///< How many, and how many reached the goal
  double seconds_to_goal = 0;                   ///< Of those that reached it
  std::int64_t contacts = 0, limits = 0;        ///< At boundaries: touched, beyond a limit of the task
  std::int64_t steps = 0, outside = 0;          ///< Executed; those at whose end the certified slice was left
  std::int64_t consistent = 0;                  ///< Those that end outside it by no more than the state error
  std::int64_t stops = 0, emergency_stops = 0;  ///< Before the goal; those for a withdrawal
  std::int64_t proposed = 0, certified = 0;     ///< Candidates
  std::int64_t searches = 0;                    ///< With those that gave no candidate
  std::int64_t rounds = 0, lost_rounds = 0;     ///< Of the planner; without a certificate
  std::map<std::string, std::int64_t> abstained, rejected;  ///< Candidates, by cause

  /** All reached their goals; nothing was touched, no limit exceeded, and no slice left. */
  [[nodiscard]] bool good() const { return goals == drives && contacts == 0 && limits == 0 && outside == 0; }

  DriveCounts& operator+=(const DriveCounts& other);
};

/** Of the drive that has been run. */
[[nodiscard]] DriveCounts CountsOf(const Lockstep& lockstep);

/** From now on this process logs nothing: many drives would fill it. */
void SilenceLog();

}  // namespace forereach
