/** Confirms or refutes a certificate by deriving it anew from its inputs, in intervals of 256 bits and more.

Confirmed: a tube of the verifier's own, sound for the given doubles in real arithmetic, stays in the domain, lies
inside everything that was recorded, and keeps clear of every obstacle. Refuted: one of these does not hold. */
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "certifier/certify/problem.h"
#include "verifier/answer.h"
#include "verifier/equations.h"
#include "verifier/tube.h"

namespace forereach::verifier {

/** The method that the problem asks for. */
[[nodiscard]] Method MethodOf(const Problem& problem);

/** What was recorded of X_t; what has no entries was not recorded. */
struct RecordedSlice {
  Eigen::VectorXd lower, upper;        ///< The hull by its ends ...
  Eigen::VectorXd center, half_width;  ///< ... or by its middle.
  Eigen::MatrixXd generators;          ///< X_t = <center, generators>, if has_generators.
  bool has_generators = false;
  std::vector<double> clearance;  ///< Per obstacle.
  std::optional<double> radius;
  Eigen::VectorXd envelope_lower, envelope_upper, remainder;
};

/** A plan said to be certified. */
struct Certificate {
  InitialSet initial_set;
  Eigen::MatrixXd controls;  ///< inputs-by-T
  std::vector<Obstacle> obstacles;
  KnownRows known;                    ///< Of the problem's transitions.
  std::vector<RecordedSlice> slices;  ///< T + 1 of them, or none: then only safety is derived.
};

enum class Status { kConfirmed, kRefuted, kCannotVerify };

struct Verdict {
  Status status = Status::kCannotVerify;
  Failure failure;  ///< Unless confirmed: the first step that fails, and why.
};

/** For all certificates of one problem. Any number of threads may verify at once. */
class Verifier final {
 public:
  /** @pre the problem is one that a Certifier accepts. */
  Verifier(std::shared_ptr<const Problem> problem, Method method);

  /** Cost some 0.1 s for 50 steps, 400 observations and 10 obstacles. Repeats with more bits, at last
  so many that sums of products of doubles are exact, where 256 cannot tell. */
  [[nodiscard]] Verdict Verify(const Certificate& certificate) const;

  /** The tube alone, for display and tests. @pre knows_model. */
  [[nodiscard]] Tube Derive(const Certificate& certificate) const;
  [[nodiscard]] bool knows_model() const { return equations_ != nullptr; }

 private:
  [[nodiscard]] std::optional<Failure> Check(const TubeMaker& maker, const Certificate& certificate) const;
  [[nodiscard]] const TubeMaker& MakerOf(int bits) const;

  std::shared_ptr<const Problem> problem_;
  Method method_;
  std::unique_ptr<Equations> equations_;
  mutable std::mutex mutex_;
  mutable std::map<int, std::unique_ptr<TubeMaker>> makers_;  // by bits
};

}  // namespace forereach::verifier
