/** What a declaration that was learned from one part of a car's logs is worth on another part. */
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "forereach/certify/problem.h"
#include "identify/affine_proposal.h"
#include "identify/fit.h"
#include "research/real/recording.h"

namespace forereach::research {

/** car.yaml */
extern const char* const kModelFile;

/** The model of car.yaml with the domain in which a car drives: at 1 m/s or more, under power. Place and heading are
free. @throws ConfigError if the file cannot be read. */
[[nodiscard]] Problem DrivingProblem();

/** A part of a drive: transitions begin <= i < end. */
struct Stretch {
  const Drive* drive = nullptr;
  int begin = 0, end = 0;
};

[[nodiscard]] std::vector<Stretch> Whole(const Drive& drive);

/** The model with the parameters that fit the transitions of the stretches best. */
struct Fitted {
  Problem driving;  ///< What was fitted, with the fitted model
  Transitions transitions;
  Fit fit;
  Eigen::VectorXd state_error;  ///< Of a measured state: three standard errors, the largest of the drives.
  std::vector<int> felt;        ///< Columns of z on which the residual depends; the domain has ranges of these.
  std::vector<int> ends;        ///< Behind the last transition of each drive.
};

/** @param driving DrivingProblem, to whose domain the transitions are cut.
@throws std::invalid_argument if there are too few transitions. Cost: about a second for 700 transitions. */
[[nodiscard]] Fitted FitTo(const Problem& driving, const std::vector<Stretch>& stretches);

/** The same with the model as it is. */
[[nodiscard]] Fitted Unfitted(const Problem& driving, const std::vector<Stretch>& stretches, std::vector<int> felt);

/** What the model leaves of each transition, N-by-n. */
[[nodiscard]] Eigen::MatrixXd ErrorsOf(const NominalModel& model, const Transitions& transitions);

struct LearnOptions {
  double quantile = 0.99;  ///< Of |one-step error|, for each state: sigma + w, where that is more than sigma.
  /** Whether transitions with larger errors stay, and slopes explain them: L is then the smallest that no two
  transitions contradict. Otherwise they are left out, and L is zero. */
  bool slopes = false;
  /** Instead, w_k grows with what a command does whose time is not known: w_k = s_k (a_k + b_k g), g = v |steer -
  before|, for the columns of car.yaml. The line is the one of a, b >= 0 that fits |one-step error| best; s_k is the
  least factor with which the quantile of every single drive is within its state error and w. x and y have one w, since
  the car may head anywhere. State errors are declared as such, and the transitions stay that do not contradict a
  residual of zero. */
  bool growing = false;
  /** And less of the s_k a_k in up to so many regions, where the transitions that stay need less, by this factor. */
  int cells = 1;
  /** And the residuals of yaw, v and r affine in the felt columns, which are otherwise constant. As far as states have
  errors, slopes up to twice those of the plane that fits best are declared. */
  bool affine = false;
  double calm_factor = 1.5;
  /** The domain's ranges are those of these; empty: of those that the model was fitted to. */
  std::vector<Stretch> domain_of = {};
};

struct Learned {
  std::shared_ptr<const Problem> problem;  ///< Fitted model, domain, declaration and the transitions that were kept.
  int transitions = 0, left_out = 0;
  Eigen::VectorXd state_error;  ///< Fitted::state_error
  bool explained = true;        ///< Whether slopes were found, or none were asked for.
  Eigen::VectorXd growth = {};  ///< s_k b_k; the rest of its w is s_k a_k. Empty unless w grows.
};

/** Disturbance and slopes from what the fitted model leaves of its transitions. The domain's ranges of the states are
widened by a tenth, since a tube needs room. Cost: some seconds for slopes. */
[[nodiscard]] Learned Learn(const Fitted& fitted, const LearnOptions& options);
/** The same with `factor` times the slopes. */
[[nodiscard]] Learned WithSlopesTimes(const Learned& learned, double factor);

/** Whether all transitions, those that were left out among them, refute that the residual of state k is affine.
@param affine learned so. @param disturbed with its w, or with errors of the record alone. */
[[nodiscard]] std::optional<Refutation> RefuteAffine(const Fitted& fitted, const Learned& affine, int k,
                                                     bool disturbed);

/** What `forereach declare --from-data` proposes, which knows of no drives: slopes, and a disturbance from the scatter
of near places. State errors are declared as such. Cost: some seconds. */
[[nodiscard]] Learned Proposed(const Fitted& fitted);

/** The recorded commands of one window as a plan, and what became of it. */
struct WindowResult {
  Eigen::Matrix2Xd path;                ///< The recorded places, one more than steps.
  Eigen::Matrix2Xd center, half_width;  ///< Of the tube's slices that there are.
  int inside = 0;                       ///< Recorded states that lie in their slices, give or take state_error.
  bool complete = false;                ///< Otherwise the tube leaves the domain.
};

struct Judgement {
  int steps = 0;        ///< Of a window
  int transitions = 0;  ///< In the learned domain; the windows are made of these.
  int outside_domain = 0;
  int contradicting = 0;  ///< Transitions that contradict one that was learned from.
  std::vector<WindowResult> windows;

  /** Adds what another learner was judged by. */
  void Add(const Judgement& other);

  /** Slices of all tubes but the initial sets, and the recorded states that lie in them. */
  [[nodiscard]] int slices() const;
  [[nodiscard]] int inside() const;
  [[nodiscard]] int complete() const;
  /** The median over the windows of the position's half-width in the last slice, the larger of x and y; infinite where
  there is no last slice. None without windows. */
  [[nodiscard]] std::optional<double> HalfWidth() const;
  /** The largest of those that are finite. */
  [[nodiscard]] std::optional<double> LargestHalfWidth() const;
  /** The median of the distances that the car covered in a window. */
  [[nodiscard]] std::optional<double> Distance() const;
};

/** Judges by stretches that were not learned from. Windows do not overlap and start from the measured state, give or
take state_error. Cost: about a millisecond a window. */
[[nodiscard]] Judgement Judge(const Learned& learned, const std::vector<Stretch>& stretches, int steps);

/** What a state that the model of car.yaml lacks would explain of the errors of the best fit to a drive. */
struct HiddenState {
  std::string name;
  Eigen::VectorXd left;  ///< rms of each state's error but for the lines, over that without the hidden state.
};

/** Each alone, then all. The lines are the best ones in the states and inputs that the model has, in the hidden state
and in the products of all these with the speed. Only steps count of which the one before and the one after were
recorded, too. */
[[nodiscard]] std::vector<HiddenState> HiddenStates(const Fitted& fitted, const Drive& drive);

}  // namespace forereach::research
