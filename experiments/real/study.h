/** What a declaration that was learned from one part of a car's logs is worth on another part. */
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "certifier/certify/problem.h"
#include "experiments/real/recording.h"
#include "identify/fit.h"

namespace forereach::experiments {

/** The model of car.yaml with the domain in which a car drives: at 1 m/s or more, under power. Place and heading are
free.
@throws ConfigError if the file cannot be read. */
[[nodiscard]] Problem DrivingProblem();

/** A part of a drive: transitions begin <= i < end. */
struct Stretch {
  const Drive* drive = nullptr;
  int begin = 0, end = 0;
};

/** The transitions of a drive in blocks of 10 s, the first, third, ... or the others; those that go across the end of a
block are in none. */
[[nodiscard]] std::vector<Stretch> Blocks(const Drive& drive, bool odd);
[[nodiscard]] std::vector<Stretch> Whole(const Drive& drive);

struct LearnOptions {
  double quantile = 0.99;  ///< Of |one-step error|, for each state: sigma + w, where that is more than sigma.
  /** Whether transitions with larger errors stay, and slopes explain them: L is then `factor` times the smallest that
  no two transitions contradict. Otherwise they are left out, and L is zero. */
  bool slopes = false;
  double factor = 1;
  int most = 0;  ///< Learn from so many transitions only, evenly chosen; 0: from all.
};

struct Learned {
  std::shared_ptr<const Problem> problem;  ///< Fitted model, domain, declaration and the transitions that were kept.
  ModelText text;                          ///< With the fitted parameters
  Fit fit;
  int transitions = 0, left_out = 0;
  Eigen::VectorXd state_error;  ///< Of a measured state, three standard errors.
  bool explained = true;        ///< Whether slopes were found, or none were asked for.
};

/** Parameters, disturbance and slopes from the stretches alone. The domain's ranges are those of the stretches; those
of the states are widened by a tenth, since a tube needs room. @throws std::invalid_argument if there are too few
transitions. Cost: below a second for 700 transitions without slopes, some seconds with them. */
[[nodiscard]] Learned Learn(const Problem& driving, const std::vector<Stretch>& stretches, const LearnOptions& options);

/** Half-widths of corridors about a recorded path, m. */
inline constexpr double kCorridors[] = {0.1, 0.15, 0.2, 0.3};

/** The recorded commands of one window as a plan, and what became of it. */
struct WindowResult {
  Eigen::Matrix2Xd path;                ///< The recorded places, one more than steps.
  Eigen::Matrix2Xd center, half_width;  ///< Of the tube's slices that there are.
  int inside = 0;                       ///< Recorded states that lie in their slices, give or take state_error.
  bool complete = false;                ///< Otherwise the tube leaves the domain.
  std::vector<bool> certified;          ///< In each of kCorridors.
};

struct Judgement {
  int steps = 0;        ///< Of a window
  int transitions = 0;  ///< In the learned domain; the windows are made of these.
  int outside_domain = 0;
  int contradicting = 0;  ///< Transitions that contradict one that was learned from.
  int beyond = 0;         ///< Transitions with a one-step error above sigma + w in some state.
  std::vector<WindowResult> windows;

  [[nodiscard]] int states() const { return static_cast<int>(windows.size()) * steps; }
  [[nodiscard]] int inside() const;
  [[nodiscard]] int complete() const;
  [[nodiscard]] int certified(std::size_t corridor) const;
  /** Of the half-widths of the position in the last slices, the larger of x and y; infinite where there is no last
  slice.
  @param share 0.5 for the median, 1 for the largest. None without windows. */
  [[nodiscard]] std::optional<double> HalfWidth(double share) const;
  /** The median of the distances that the car covered in a window. */
  [[nodiscard]] std::optional<double> Distance() const;
};

/** Judges by stretches that were not learned from. Windows do not overlap and start from the measured state, give or
take state_error. Cost: about a millisecond a window. */
[[nodiscard]] Judgement Judge(const Learned& learned, const std::vector<Stretch>& stretches, int steps);

}  // namespace forereach::experiments
