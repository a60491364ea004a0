#include "research/real/recording.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>

#include <Eigen/LU>
#include <Eigen/QR>

#include "forereach/numerics/size.h"
#include "identify/import.h"
#include "task/config_error.h"

namespace forereach::research {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Of DART's body in the motion capture (System_identification in its repository).
constexpr double kBodyAhead = 0.115, kBodyAside = -0.01, kBodyYaw = 0.007686;  // of the rear axle's middle; m, m, rad

constexpr double kSpacing = 0.01, kStep = 0.1;  // s, of the table's rows and of a transition
constexpr double kReach = 0.035;                // s, of a fit to either side
constexpr int kFewest = 5;                      // samples of a fit

enum Column { kTime, kX, kY, kYaw, kSteer, kThrottle, kSafety, kColumns };
const std::vector<std::string> kNames{"vicon time", "vicon x",  "vicon y",     "vicon yaw",
                                      "steering",   "throttle", "safety_value"};

// The motion capture, its yaw without jumps.
struct Samples {
  Eigen::VectorXd time;      // s since the first
  Eigen::MatrixX3d pose;     // x, y, yaw
  Eigen::MatrixX2d command;  // steering, throttle: held until the next row
};

Samples SamplesOf(const LogTable& log) {
  const Eigen::Index count = log.values.rows();
  if (count < kFewest) throw ConfigError(log.path + ": has " + std::to_string(count) + " rows");
  Samples samples{Eigen::VectorXd(count), Eigen::MatrixX3d(count, 3), Eigen::MatrixX2d(count, 2)};
  double turns = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto row = log.values.row(i);
    const std::string where = log.path + ":" + std::to_string(log.lines[ToSize(i)]) + ": ";
    for (int j = 0; j < kColumns; ++j)
      if (!std::isfinite(row[j])) throw ConfigError(where + kNames[ToSize(j)] + " is no number");
    samples.time[i] = row[kTime] - log.values(0, kTime);
    if (i > 0 && !(samples.time[i] > samples.time[i - 1]))
      throw ConfigError(where + kNames[kTime] + " does not increase");
    if (i > 0) turns -= std::round((row[kYaw] - log.values(i - 1, kYaw)) / (2 * std::numbers::pi));
    samples.pose.row(i) << row[kX], row[kY], row[kYaw] + turns * 2 * std::numbers::pi;
    samples.command.row(i) << row[kSteer], row[kSafety] > 0.5 ? row[kThrottle] : 0;
  }
  return samples;
}

// The quadratics that fit x, y and yaw best about a time: their values, rates and standard errors.
struct LocalFit {
  Eigen::RowVector3d value, rate, value_error, rate_error;
};

LocalFit FitAbout(const Samples& samples, double time) {
  const double* const begin = samples.time.data();
  const double* const end = begin + samples.time.size();
  const Eigen::Index first = std::lower_bound(begin, end, time - kReach) - begin,
                     count = std::upper_bound(begin, end, time + kReach) - begin - first;
  if (count < kFewest) {
    const Eigen::RowVector3d none = Eigen::RowVector3d::Constant(kNaN);
    return {none, none, none, none};
  }
  Eigen::MatrixX3d powers(count, 3);
  powers.col(0).setOnes();
  powers.col(1) = (samples.time.segment(first, count).array() - time) / kReach;
  powers.col(2) = powers.col(1).cwiseAbs2();
  const Eigen::MatrixX3d pose = samples.pose.middleRows(first, count);
  const Eigen::Matrix3d coefficients = powers.colPivHouseholderQr().solve(pose);
  const Eigen::RowVector3d variance =
      (pose - powers * coefficients).colwise().squaredNorm() / static_cast<double>(count - 3);
  const Eigen::Matrix3d inverse = (powers.transpose() * powers).inverse();
  return {coefficients.row(0), coefficients.row(1) / kReach, (variance * inverse(0, 0)).cwiseSqrt(),
          (variance * inverse(1, 1)).cwiseSqrt() / kReach};
}

// x, y, yaw of the rear axle's middle, its speed ahead and the yaw rate.
Eigen::Matrix<double, 5, 1> StateOf(const LocalFit& fit) {
  const double yaw = fit.value[2] + kBodyYaw, r = fit.rate[2], c = std::cos(yaw), s = std::sin(yaw);
  return {fit.value[0] - c * kBodyAhead + s * kBodyAside, fit.value[1] - s * kBodyAhead - c * kBodyAside, yaw,
          c * fit.rate[0] + s * fit.rate[1] + kBodyAside * r, r};
}

}  // namespace

Recording ReadRecording(const std::string& path, double age) {
  const LogTable log = ReadLog(path, kNames, {});
  const Samples samples = SamplesOf(log);
  Recording recording{std::filesystem::path(path).stem().string(), {}, Eigen::VectorXd::Zero(6), age};
  const Eigen::Index rows = static_cast<Eigen::Index>(samples.time[samples.time.size() - 1] / kSpacing) + 1;
  const Eigen::Index rows_of_step = std::lround(kStep / kSpacing);
  LogTable& table = recording.table;
  table.path = path;
  table.values.resize(rows, 9);
  table.lines.resize(ToSize(rows));
  table.after_loss.assign(ToSize(rows), false);
  table.not_a_number.resize(9);
  Eigen::Index held = 0;
  double moving = 0;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double time = static_cast<double>(i) * kSpacing;
    while (held + 1 < samples.time.size() && samples.time[held + 1] <= time + age) ++held;
    const LocalFit fit = FitAbout(samples, time);
    const Eigen::Matrix<double, 5, 1> state = StateOf(fit);
    auto row = table.values.row(i);
    row[0] = time;
    row.segment(1, 5) = state.transpose();
    row[7] = samples.command(held, 0);
    row[8] = samples.command(held, 1);
    row[6] = i < rows_of_step ? kNaN : table.values.col(7).segment(i - rows_of_step, rows_of_step).mean();
    table.lines[ToSize(i)] = static_cast<int>(i) + 1;
    if (!(state[3] > 0.5)) continue;
    ++moving;
    const double place = std::hypot(fit.value_error[0], fit.value_error[1]) / std::numbers::sqrt2,
                 speed = std::hypot(fit.rate_error[0], fit.rate_error[1]) / std::numbers::sqrt2;
    recording.deviation.head(5) +=
        Eigen::Matrix<double, 5, 1>(place, place, fit.value_error[2], speed, fit.rate_error[2]).cwiseAbs2();
  }
  if (moving > 0) recording.deviation = (recording.deviation / moving).cwiseSqrt();
  return recording;
}

std::vector<std::string> FindRecordings(const std::filesystem::path& folder) {
  const std::string get = std::string(". The drives can be had at ") + kSourceOfDrives + ".";
  if (folder.empty()) throw ConfigError("--data: names no folder" + get);
  if (!std::filesystem::is_directory(folder)) throw ConfigError(folder.string() + ": there is no such folder" + get);
  std::vector<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".csv") continue;
    std::string header;
    std::getline(std::ifstream(entry.path()), header);
    if (header.find(kNames[kTime]) != std::string::npos) found.push_back(entry.path().string());
  }
  if (found.empty())
    throw ConfigError(folder.string() + ": has no CSV file with a column '" + kNames[kTime] + "'" + get);
  std::ranges::sort(found);
  return found;
}

std::vector<double> SteeringDelays(const Recording& recording) {
  constexpr Eigen::Index kQuiet = 25, kEarliest = 15, kSettled = 5;            // rows
  constexpr double kChange = 0.25, kSteady = 0.1, kSlowest = 1, kLeast = 0.3;  // the last two: m/s, 1/m
  const auto& values = recording.table.values;
  const auto steer = values.col(7);
  const Eigen::ArrayXd curvature = values.col(5).array() / values.col(4).array();
  const auto spread = [&](Eigen::Index first) {
    const auto part = steer.segment(first, kQuiet);
    return part.maxCoeff() - part.minCoeff();
  };
  std::vector<double> delays;
  for (Eigen::Index i = kQuiet; i + kQuiet + kSettled < values.rows(); ++i) {
    if (!(std::abs(steer[i] - steer[i - 1]) > kChange &&
          values.col(4).segment(i - kQuiet, 2 * kQuiet).minCoeff() > kSlowest))
      continue;
    if (spread(i - kQuiet) > kSteady || spread(i) > kSteady) continue;
    const double before = curvature.segment(i - kQuiet, kQuiet - kEarliest).mean(),
                 after = curvature.segment(i + kQuiet - kSettled, 2 * kSettled).mean();
    if (!(std::abs(after - before) > kLeast)) continue;
    Eigen::Index at = i - kEarliest;
    while (at < i + kQuiet && (curvature[at] - before) / (after - before) < 0.5) ++at;
    delays.push_back(static_cast<double>(at - i) * kSpacing - recording.age);
  }
  std::ranges::sort(delays);
  return delays;
}

Drive TransitionsOf(const Recording& recording, const Problem& problem) {
  ImportOptions options;
  options.period = kStep;
  options.tolerance = kSpacing / 10;
  options.factors.assign(ToSize(problem.model->num_variables()), 1);
  options.input_tolerance = Eigen::VectorXd::Zero(problem.model->num_inputs());
  options.input_mean = true;
  ImportedLog log = Import(recording.table, problem, options);
  Drive drive{recording.name, std::move(log.transitions), {}, 0, recording.deviation, SteeringDelays(recording)};
  for (const int line : log.lines) drive.times.push_back(kSpacing * (line - 1));
  drive.samples_outside = static_cast<int>(log.At(Dropped::kOutsideDomain).count);
  return drive;
}

}  // namespace forereach::research
