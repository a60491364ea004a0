/** The experiment on a car that nobody here chose: what the declaration of the library's single-track model has to be
for CommonRoad's single-track drift model, and what it is worth on fresh drives. */
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "research/drift/single_track_drift.h"
#include "research/real/study.h"

namespace forereach::research {

/** Of the Runge-Kutta method in the experiment, s. */
inline constexpr double kDriftStep = 5e-4;

/** Fresh drives. Every 1 to 3 s they ask for another speed and another lateral acceleration; steering goes to the angle
at which tyres without slip have it, as fast as it can, and the speed follows. */
struct DrivesOptions {
  double dt = 0.05;                  ///< s; the commands are held so long
  double most_lateral = 3;           ///< asked, m/s^2
  double slowest = 8, fastest = 20;  ///< asked, m/s
  int drives = 20;
  double seconds = 20;  ///< of a drive; one that spins ends there
  std::uint64_t seed = 1;
};

/** The states of config/models/single_track.yaml in them, measured without error; the wheels' speeds are not in them.
 */
[[nodiscard]] std::vector<Drive> RandomDrives(const DrivesOptions& options);

/** config/models/single_track.yaml at this dt, with the domain of all that the experiment drives. */
[[nodiscard]] Problem SingleTrackProblem(double dt);

/** Of the drives that are learned from, s. */
inline constexpr double kOrdinaryStep = 0.05;

/** What is learned from ten drives of 20 s with at most 3 m/s^2 sideways: L is zero, and w is `factor` times the
largest one-step error. */
[[nodiscard]] Learned OrdinaryDeclaration(double factor);

struct DriftOptions {
  std::filesystem::path directory;  ///< Of results
  bool quick = false;               ///< Fewer drives, fewer rows in the tables
  std::string command;              ///< That the report names as its origin
};

/** Writes DIR/drift.md, also printed to `out`. Cost: about a minute. */
void RunDrift(const DriftOptions& options, std::ostream& out);

}  // namespace forereach::research
