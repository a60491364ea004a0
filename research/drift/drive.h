/** The closed loop on the drift model: planner, certifier, guard and simulated robot drive it to a goal. */
#pragma once

#include <filesystem>
#include <iosfwd>
#include <span>
#include <string>

#include "forereach/safety/body.h"
#include "research/drift/single_track_drift.h"
#include "simulator/drive_counts.h"

namespace forereach::research {

/** The drift model as the plant of a simulated robot (simulator/target.h). Its first seven states are measured without
error; the speeds of its wheels, with which it begins rolling, are known to nobody. */
class DriftCar final {
 public:
  /** @param dt of a step, s. */
  explicit DriftCar(double dt) : dt_(dt) {}

  void Step(std::span<const double> x, std::span<const double> u, std::span<double> next);

  /** The largest that its motion has had, also between the samples: what task.between has to bound. */
  [[nodiscard]] const Between& most() const { return most_; }

 private:
  void Note(const DriftInput& input);

  const double dt_;
  DriftState state_;
  bool has_begun_ = false;
  Between most_{Eigen::Vector2d::Zero(), 0, 0, 0};
};

/** What became of drives. */
struct DriftDrives {
  DriveCounts counts;
  std::int64_t beyond_between = 0;  ///< Drives that moved beyond task.between between two samples
  std::int64_t faulted = 0;         ///< Drives with a candidate that was refused for a contradiction or a latched fault
  Between most{Eigen::Vector2d::Zero(), 0, 0, 0};
  double most_lateral = 0;  ///< |v omega|, m/s^2
};

/** Drives the task of a file, with a start and five obstacles that depend on the seed, to the goal, or until the car is
without a certified plan: it cannot stand. */
[[nodiscard]] DriftDrives DriveOnDrift(const std::string& task, int seed);

struct DriftDriveOptions {
  std::filesystem::path directory;  ///< Of results
  int seeds = 20;
  bool quick = false;   ///< One declaration only
  std::string command;  ///< That the report names as its origin
};

/** Writes the task file of an OrdinaryDeclaration, with the files that it names, into the directory; returns its path.
 */
[[nodiscard]] std::string WriteDriveTask(const std::filesystem::path& directory, double factor);

/** Writes DIR/drift-drive.md, also printed to `out`. */
void RunDriftDrives(const DriftDriveOptions& options, std::ostream& out);

}  // namespace forereach::research
