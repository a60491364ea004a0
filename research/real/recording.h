/** Drives of a real car as DART's recorder writes them, and the states of research/real/car.yaml in them. */
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "forereach/certify/problem.h"
#include "identify/log_table.h"

namespace forereach::research {

/** Where the logs are that the experiment was written for. */
inline constexpr const char* kSourceOfDrives =
    "github.com/Lorenzo-Lyons/DART, commit 4b52523294ad324efcfcb7d47f50ea8cbd1f6982, folder "
    "System_identification/Data/91_free_driving_16_sept_2024: the files car_1_Datarecording_09_16_2024_10_01_01.csv, "
    "..._10_02_28.csv and ..._10_12_05.csv";

/** How old a command is when the log first has it, s: the recorder asks for it every 0.1 s, whenever it was given. */
inline constexpr double kMeanAge = 0.05;

/** A drive in the form that Import takes. A row every 10 ms; columns: stamp (s), the states and the inputs of car.yaml.
Pose and velocities are those of the quadratics that fit the motion capture best in the 35 ms to either side; NaN with
fewer than 5 samples there. Commands stand `age` before the log has them. `before` is the mean command of the 0.1 s
before the row. The throttle is 0 where the car's safety switch cut it. */
struct Recording {
  std::string name;  ///< The file's, without the ending.
  LogTable table;
  /** The standard errors of x, y, yaw, v, r, before: pooled from the fits of all rows faster than 0.5 m/s. */
  Eigen::VectorXd deviation;
  double age = 0;  ///< s
};

/** @throws ConfigError with file and line, also if the columns are not the recorder's or the stamps do not increase. */
[[nodiscard]] Recording ReadRecording(const std::string& path, double age = kMeanAge);

/** The CSV files of the folder whose header has the recorder's columns, by name.
@throws ConfigError if there is no such folder or no such file; the message says where to get them. */
[[nodiscard]] std::vector<std::string> FindRecordings(const std::filesystem::path& folder);

/** Transitions of a drive, with the time at which each starts. */
struct Drive {
  std::string name;
  Transitions transitions;
  std::vector<double> times;   ///< s since the drive's first row, ascending
  int samples_outside = 0;     ///< Rows that begin no transition: the car stands, starts, brakes or is slow.
  Eigen::VectorXd deviation;   ///< Recording::deviation
  std::vector<double> delays;  ///< SteeringDelays, ascending
};

/** For each step of the steering command by more than 0.25 that comes after and before a quarter of a second without
another: the time from where the log has it until the curvature is half way to where it then settles, s. The log has
commands ten times a second, whenever they were given. */
[[nodiscard]] std::vector<double> SteeringDelays(const Recording& recording);

/** The transitions of dt = 0.1 s, with the mean of the inputs over each step, that lie in the problem's domain. */
[[nodiscard]] Drive TransitionsOf(const Recording& recording, const Problem& problem);

}  // namespace forereach::research
