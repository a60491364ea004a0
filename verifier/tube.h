/** The verifier's own reachable tube in high precision, from a problem's doubles: Eqs. (propagation), (order-reduction)
and (set-envelope), implemented directly. It shares data types with the certifier, but no arithmetic.

For t = 0 .. T-1:   X_{t+1} = red < f0(c) + mu + rho_mid, [(J + A) G, diag(q), diag(h + w)] >,
with A the slopes of affine rows of the residual (verifier/affine.h), and of rows with regions where these are known
(verifier/ways.h), zero in the others, and w the declared bound on
the disturbance. It counts twice, for different steps: an observation's r~_i differs from r(z_i) by what disturbed that
step, and the step from X_t is disturbed anew. So is it by inputs that are off. Where the bound grows with state and
input, it is the largest over the box of what is known of them. */
#pragma once

#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "forereach/certify/problem.h"
#include "verifier/answer.h"
#include "verifier/equations.h"
#include "verifier/real.h"
#include "verifier/ways.h"

namespace forereach::verifier {

class Functions;

/** The enclosure of the second-order part of f0, with r the half-widths of Box(Z_t) and H_k the Hessian over it.
kPaper: q_k = 1/2 sum_ij r_i max|H_ij| r_j, both signs.
kCentred: in [lo, hi] = sum_i 1/2 r_i^2 [min(0, H_ii), max(0, H_ii)] + sum_{i<j} r_i r_j max|H_ij| [-1, 1]; its middle
moves the center. */
enum class Method { kPaper, kCentred };

/** The zonotope <center, columns>. */
struct Slice {
  std::vector<Real> center;
  std::vector<std::vector<Real>> columns;
  /** The last columns, each along an axis, are what the others are off because a parameter is an interval. A reduction
  never counts them. */
  std::size_t num_slack = 0;
  /** The column of this boundary's offset; -1: none, the offset is independent of the state. */
  int offset = -1;

  [[nodiscard]] int dim() const { return static_cast<int>(center.size()); }
  /** sum_j |G_kj|. */
  [[nodiscard]] Real HalfWidth(int k) const;
  /** The columns in doubles, to the nearest. */
  [[nodiscard]] std::vector<Eigen::VectorXd> RoundedColumns() const;
};

/** X_0: a box, or a zonotope of doubles. */
struct InitialSet {
  Eigen::VectorXd lower, upper;  ///< If these have entries: the box [lower, upper].
  Eigen::VectorXd center;        ///< Otherwise: the zonotope <center, generators>.
  Eigen::MatrixXd generators;
  Eigen::VectorXd from, to;  ///< If these have entries: a box around the part of its hull that is within.
};

struct Bounds {
  Real lower, upper;
};

/** Intermediate results of one step, one entry for each state. */
struct Step {
  std::vector<Bounds> envelope;             ///< Bounds of the residual over Z_t, less its slopes times x - c.
  std::vector<std::vector<double>> slopes;  ///< By row and state; a row without entries has none.
  std::vector<Bounds> remainder;            ///< Bounds of the second-order part over Z_t.
};

struct Tube {
  std::vector<Slice> slices;  ///< X_0, X_1, ... up to the last computed slice.
  std::vector<Step> steps;
  /** Where a record is followed: the generator of each slice's record that was taken for its offset's, or -1. */
  std::vector<int> recorded_offsets = {-1};
  /** Why the tube ends early: Box(Z_t) leaves the domain, or a quantity has no finite enclosure. */
  std::optional<Failure> failure;
  /** Not zero if a reduction chose between columns whose scores differ by no more than a double's rounding, or exceed
  the range of doubles. The certifier may have chosen other columns; this bounds the effect, relative to the slice. */
  double ambiguity = 0;
};

/** The transitions of the problem that the certifier knew: the first `base`, and those in [begin, end). */
struct KnownRows {
  int base = std::numeric_limits<int>::max();
  int begin = 0, end = 0;

  [[nodiscard]] bool Contains(int i) const { return i < base || (begin <= i && i < end); }
};

/** A recorded slice, the zonotope <center, generators>. */
struct RecordedSet {
  Eigen::VectorXd center;
  Eigen::MatrixXd generators;
};

/** Variants of the tube. All are sound; the options can make it tighter. */
struct TubeOptions {
  bool reduce = true;            ///< Reduce the order and box offsets by the certifier's rule, or never.
  bool split_remainder = false;  ///< Also bound the Hessian over half the box: the integral remainder in two parts.
  KnownRows known = {};
  /** If not null: the record of each slice. Each step then starts from the recorded slice, and reduces as the record
  shows. slices[t] encloses what one step makes of recorded slice t - 1: if every one of them lies in recorded slice t,
  the record encloses all that it claims, by induction over t. */
  const std::vector<RecordedSet>* follow = nullptr;
};

/** Computes tubes for any number of plans of one problem, with the precision at its construction. */
class TubeMaker final {
 public:
  /** @param problem, equations must outlive this object. @pre a Certifier accepts the problem.
  @throws ExpressionError (expressions.h) if a bound on the disturbance is none. */
  TubeMaker(const Problem& problem, const Equations& equations, Method method);

  /** Follows the problem, which has got more transitions behind those that it had. */
  void Learn();

  /** The tube of a plan. @param controls m-by-T, one column for each step. */
  [[nodiscard]] Tube Make(const InitialSet& initial_set, const Eigen::MatrixXd& controls,
                          const TubeOptions& options) const;

  /** The motion of Verifier::FindContact, as slices that are points up to 2^-200 or so. Nothing if it is not followed,
  or the residual does not provably agree with the data. */
  [[nodiscard]] std::optional<Tube> Follow(const InitialSet& start, const Eigen::MatrixXd& controls,
                                           const std::vector<bool>& upper, const KnownRows& known) const;

  /** A known transition in which a state changes faster than is declared, or whose residual is larger than a region
  says, by more than the certifier's rounding. */
  [[nodiscard]] std::optional<Failure> FindTooMuch(const KnownRows& known) const;

 private:
  struct Query;
  struct Row;
  struct Affine;

  /** What an observation shows, an entry for each state. */
  struct Seen {
    /** r~_ik - sigma_k - w_k - e_ik and r~_ik + sigma_k + w_k + e_ik, one unit in the last place of the successor
    included; e_ik is what the declared errors of the record may add. */
    std::vector<Bounds> residual;
    /** |x_next_k| + e_ik + sum_l |d f0_k / d z_l| |z_l|, the size of the operands of a residual. */
    std::vector<Real> size;
  };
  /** Observations are kept up to so many bits of precision in all, 3 kB each. Others are derived again where doubles
  do not exclude them. */
  static constexpr int kMostKeptBits = 1 << 22;
  [[nodiscard]] Seen Look(int i) const;
  [[nodiscard]] std::shared_ptr<const Seen> See(int i) const {
    return ToSize(i) < seen_.size() ? seen_[ToSize(i)] : std::make_shared<const Seen>(Look(i));
  }

  [[nodiscard]] bool CanExtend(const std::vector<int>& rows) const;
  [[nodiscard]] Real Extension(const std::vector<int>& rows, int k, bool upper, const std::vector<Real>& z) const;
  [[nodiscard]] std::optional<Failure> WhyTooFast(int i) const;
  [[nodiscard]] std::optional<Failure> WhyTooLarge(int i, const Seen& seen) const;
  [[nodiscard]] double RemainderRounding() const;
  [[nodiscard]] std::optional<Failure> LeavesDomain(int t, const std::vector<Real>& centers,
                                                    const std::vector<Real>& half_width) const;
  [[nodiscard]] std::vector<Real> RecordErrors(const std::vector<Real>& z) const;
  [[nodiscard]] Real Growth(const Real& share) const;
  [[nodiscard]] std::vector<Real> DisturbanceOver(std::span<const Real> box) const;
  [[nodiscard]] std::vector<Real> NoiseOver(std::span<const Real> box) const;
  [[nodiscard]] std::vector<Real> InputSpread(const Query& query) const;
  [[nodiscard]] std::vector<Bounds> Remainder(const Query& query, bool split) const;
  struct Known;
  [[nodiscard]] Known Envelope(const Query& query, int k, const KnownRows& known) const;
  void AddRegions(const Query& query, int k, const KnownRows& known, bool in_doubt, Bounds& bounds) const;
  void Tilt(const Query& query, int k, const KnownRows& rows, Known& known) const;
  [[nodiscard]] Real ScaleAt(int k, const Seen& seen) const;
  struct Lattice;
  [[nodiscard]] std::shared_ptr<const Lattice> LatticeOf(int k, const KnownRows& known) const;
  [[nodiscard]] Failure NoAffineResidual(int step, int k, bool is_visible) const;
  [[nodiscard]] std::optional<Failure> MakeAffine(const KnownRows& known, Affine& affine) const;
  void AddDuration(int i, const std::vector<Real>& z, const std::vector<Real>& nominal,
                   const std::vector<Real>& disturbance, const std::vector<Real>& noise,
                   std::vector<Real>& errors) const;
  struct Offset;
  [[nodiscard]] std::vector<Real> Rates(const Query& query, const std::vector<Bounds>& remainder,
                                        const std::vector<Real>& input_spread) const;
  [[nodiscard]] Offset OffsetOf(const Query& query, const Step& step, const std::vector<Real>& input_spread,
                                const std::vector<Real>& unexpected, const RecordedSet* recorded) const;
  [[nodiscard]] Slice Image(const Query& query, const Step& step, bool boxed, Offset& offset,
                            std::vector<Real>& slack) const;
  [[nodiscard]] std::optional<Failure> Advance(Tube& tube, const Query& query, const TubeOptions& options) const;

  const Problem& problem_;
  const Equations& equations_;
  Ways ways_;
  Method method_;
  /** The declared disturbance, one entry for each state, and what it has beyond that, or null; the errors of the
  inputs, and what these add to the residual. */
  std::vector<Real> disturbance_;
  std::shared_ptr<const Functions> growing_;
  std::vector<Real> input_error_, of_inputs_;
  /** By this power of a step's duration grows what the model does not know. */
  int power_;
  std::vector<std::shared_ptr<const Seen>> seen_;  // of the first observations
  /** Seen::residual in doubles, to the nearest, and sum_l L_kl |z_l|; an entry for each observation. */
  struct RoughResiduals {
    std::vector<double> lower, upper, scale;
  };
  std::vector<RoughResiduals> rough_residuals_;  // of each state
  /** The latest lattices of each row, of different known transitions. */
  mutable std::mutex mutex_;
  mutable std::map<int, std::vector<std::shared_ptr<const Lattice>>> lattices_;
  std::vector<std::pair<int, Failure>> too_much_;  ///< The transitions of FindTooMuch, in their order.
  /** The rounding error that the remainder may have added to the certifier's columns. */
  double remainder_rounding_;
};

}  // namespace forereach::verifier
