/** Confirms or refutes a certificate. It rederives the certificate from its inputs, in intervals of 256 bits and more.

Confirmed: the verifier's own tube, which is sound for the given doubles in real arithmetic, stays in the domain, lies
inside every recorded set and within every limit, and what the body sweeps over it is disjoint from every obstacle.
Refuted: one of these is false. */
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "forereach/certify/piece_cut.h"
#include "forereach/certify/problem.h"
#include "verifier/answer.h"
#include "verifier/equations.h"
#include "verifier/functions.h"
#include "verifier/tube.h"

namespace forereach::verifier {

/** The verifier's method for the problem's method. */
[[nodiscard]] Method MethodOf(const Problem& problem);

/** The record of X_t. A member without entries was not recorded. */
struct RecordedSlice {
  Eigen::VectorXd lower, upper;        ///< The hull by its ends, or
  Eigen::VectorXd center, half_width;  ///< the hull by center and half-widths.
  Eigen::MatrixXd generators;          ///< X_t = <center, generators>, if has_generators.
  bool has_generators = false;
  /** For each obstacle, metres: at this sample or, with Problem::between, from this sample to the next; the last slice
  then has none. Infinite: the obstacle is nowhere at that time. */
  std::vector<double> clearance;
  std::optional<double> radius;
  Eigen::VectorXd envelope_lower, envelope_upper, remainder;
};

/** An area that the robot has to stay in: the points around which the rings go an odd number of times. */
struct StayIn {
  std::string name;
  std::vector<std::vector<Eigen::Vector2d>> rings;  ///< Closed chains of sides.
};

/** A recorded certificate. */
struct Certificate {
  InitialSet initial_set;
  Eigen::MatrixXd controls;  ///< inputs-by-T
  std::vector<Obstacle> obstacles;
  std::vector<StayIn> stay_in;        ///< Judged by their sides, not by the obstacles that were made of them.
  Schedule schedule;                  ///< Needed where obstacles move.
  KnownRows known;                    ///< The problem's transitions that the certifier knew.
  std::vector<RecordedSlice> slices;  ///< T + 1 slices, or none. Without them only safety is checked.
  /** Of what a withdrawal leaves of a plan, `controls` are those that stand: nothing is claimed before the sample or
  step `first_step`, nor that the plan ends at rest. */
  bool is_remainder = false;
  int first_step = 0;
  /** The pieces of initial_set, as the certifier cut them; none: it is whole. The claims then are those of the tubes
  from all pieces together. That these cover the set is the verifier's to see. */
  std::vector<PieceCut> cuts;
};

enum class Status { kConfirmed, kRefuted, kCannotVerify };

struct Verdict {
  Status status = Status::kCannotVerify;
  Failure failure;  ///< Unless confirmed: the first claim that fails.
};

/** Verifies the certificates of one problem, whose transitions may become more. Any number of threads may verify at
 * once. */
class Verifier final {
 public:
  /** @pre a Certifier accepts the problem. */
  Verifier(const std::shared_ptr<const Problem>& problem, Method method);

  /** What is known now. @pre the former transitions are its first, and no thread verifies meanwhile. Cost: that of the
  new ones. */
  void Learn(Transitions transitions);

  /** Verifies one certificate. If 256 bits do not decide, it repeats with more bits; with the last precision, sums of
  products of doubles are exact. Cost: about 0.1 s for 50 steps, 400 observations and 10 obstacles. */
  [[nodiscard]] Verdict Verify(const Certificate& certificate) const;

  /** Follows one motion that nobody can rule out: its residual agrees with the declaration and with all data, and in
  each coordinate takes its upper or its lower extension of them (McShane's, forereach/certify/extremal.h), and the
  disturbance its upper or lower bound. @return what the motion provably breaks of what a certificate claims of
  obstacles and limits at the samples, so that no sound method certifies this plan; nothing if it is not proven. Rows
  that are affine, regions, errors of records, bounds that grow and bounds between samples are not followed.
  @param claimed its initial set is a point of X_0; it has no slices. @param upper n entries. Cost O(N^2 n) in doubles,
  and O(T N n) in 256 bits. */
  [[nodiscard]] std::optional<Failure> FindContact(const Certificate& claimed, const std::vector<bool>& upper) const;

  /** The tube alone, for display and tests. @pre the verifier has the model's equations. */
  [[nodiscard]] Tube Derive(const Certificate& certificate) const;

 private:
  [[nodiscard]] Verdict VerifyWhole(const Certificate& certificate) const;
  [[nodiscard]] std::optional<Failure> Check(const TubeMaker& maker, const Certificate& certificate) const;
  [[nodiscard]] const TubeMaker& MakerOf(int bits) const;

  std::unique_ptr<Problem> problem_;
  Method method_;
  std::unique_ptr<Equations> equations_;      // null if there are none
  std::unique_ptr<TaskFunctions> functions_;  // null if an expression is none
  std::string reason_;                        // then: why a text gives none
  mutable std::mutex mutex_;
  mutable std::map<int, std::unique_ptr<TubeMaker>> makers_;  // by bits
};

}  // namespace forereach::verifier
