/** The reachable tube derived anew in high precision from a problem's doubles: Eq. (propagation), (order-reduction) and
the residual envelope, plainly. Shares the problem's data types with the certifier, none of its arithmetic.

For t = 0 .. T-1:   X_{t+1} = red < f0(c) + mu + rho_mid, [J G, diag(q), diag(h)] >. */
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "certifier/certify/problem.h"
#include "verifier/answer.h"
#include "verifier/equations.h"
#include "verifier/real.h"

namespace forereach::verifier {

/** How the second-order part of f0 is enclosed, with r the half-widths of Box(Z_t) and H_k the Hessian over it.
kPaper: q_k = 1/2 sum_ij r_i max|H_ij| r_j, both signs.
kCentred: in [lo, hi] = sum_i 1/2 r_i^2 [min(0, H_ii), max(0, H_ii)] + sum_{i<j} r_i r_j max|H_ij| [-1, 1]; its middle
moves the center. */
enum class Method { kPaper, kCentred };

/** <center, columns>. */
struct Slice {
  std::vector<Real> center;
  std::vector<std::vector<Real>> columns;

  [[nodiscard]] int dim() const { return static_cast<int>(center.size()); }
  /** sum_j |G_kj|. */
  [[nodiscard]] Real HalfWidth(int k) const;
};

/** X_0: a box, or a zonotope of doubles. */
struct InitialSet {
  Eigen::VectorXd lower, upper;  ///< A box if these have entries, ...
  Eigen::VectorXd center;        ///< ... else <center, generators>.
  Eigen::MatrixXd generators;
};

struct Bounds {
  Real lower, upper;
};

/** What one step found on its way, per state. */
struct Step {
  std::vector<Bounds> envelope;   ///< Of the residual over Z_t.
  std::vector<Bounds> remainder;  ///< Of the second-order part over Z_t.
};

struct Tube {
  std::vector<Slice> slices;  ///< X_0 .. as far as it went.
  std::vector<Step> steps;
  /** Why it went no further: Box(Z_t) leaves the domain, or something has no finite enclosure. */
  std::optional<Failure> failure;
  /** Not zero if some reduction chose between columns whose scores differ by no more than a double's rounding, or that
  a double cannot hold: the certifier may have chosen otherwise, and this is what it may have lost, relative to the
  slice. */
  double ambiguity = 0;
};

/** Which of the problem's transitions were known: the first `base`, and from then on [begin, end). */
struct KnownRows {
  int base = std::numeric_limits<int>::max();
  int begin = 0, end = 0;

  [[nodiscard]] bool Contains(int i) const { return i < base || (begin <= i && i < end); }
};

/** Ways to a tube that is sound all the same, and tighter. */
struct TubeOptions {
  bool reduce = true;            ///< Reduce the order as the certifier does, or never.
  bool split_remainder = false;  ///< Bound the Hessian over half the box too: the integral remainder in two parts.
  KnownRows known = {};
  /** If not null, the generators recorded of each slice: the columns nearest to those that were kept are kept. */
  const std::vector<Eigen::MatrixXd>* follow = nullptr;
};

/** A problem prepared for any number of plans, with as many bits as Precision said when it was made. Immutable. */
class TubeMaker final {
 public:
  /** @pre the problem is one that a Certifier accepts. Refers to it. */
  TubeMaker(const Problem& problem, const Equations& equations, Method method);

  /** @param controls inputs-by-T. */
  [[nodiscard]] Tube Make(const InitialSet& initial_set, const Eigen::MatrixXd& controls,
                          const TubeOptions& options) const;

 private:
  struct Query;
  struct Row;

  [[nodiscard]] double RemainderRounding() const;
  [[nodiscard]] std::optional<Failure> LeavesDomain(const Query& query) const;
  [[nodiscard]] std::vector<Bounds> Remainder(const Query& query, bool split) const;
  struct Known;
  [[nodiscard]] Known Envelope(const Query& query, int k, const KnownRows& known) const;
  [[nodiscard]] std::optional<Failure> Advance(Tube& tube, const Query& query, const TubeOptions& options) const;

  const Problem& problem_;
  const Equations& equations_;
  Method method_;
  /** r~_ik - sigma_k and r~_ik + sigma_k, one unit in the last place of the successor included; [observation][state].
   */
  std::vector<std::vector<Bounds>> residuals_;
  /** |x_next_k| + sum_l |d f0_k / d z_l| |z_l|, the size of the numbers a residual is made of; [observation][state]. */
  std::vector<std::vector<Real>> sizes_;
  /** What rounding may have added to the certifier's columns by way of the remainder. */
  double remainder_rounding_;
};

}  // namespace forereach::verifier
