/** The verifier's own bounds of affine rows of the residual, r_k(z) = M_k z + b_k, over all parameters that agree with
the known observations:  max and min of d . (M_k, b_k) subject to  lower_i <= (z_i, 1) . (M_k, b_k) <= upper_i.
With a rest g of slopes G, r_k(z) = M_k z + b_k + g(z), the same of (M_k, b_k + g(c)), seen from a place c: lower_i and
upper_i are farther apart by sum_l G_l |z_il - c_l|.

Doubles propose which q observations decide; the weights by which these add up to d are enclosed in Reals, so each bound
holds whatever is proposed, and the last steps, which make it the best one, are decided in Reals, too. */
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "verifier/answer.h"
#include "verifier/real.h"

namespace forereach::verifier {

/** The rest of a row, in the variables where G is not zero. */
struct AffineRest {
  std::vector<Real> slopes;
  Eigen::MatrixXd z;         ///< N rows
  std::vector<Real> middle;  ///< from where the hull of M_k is seen
};

/** The parameters of one row. Its columns are those of z that the row depends on. */
class AffineRow {
 public:
  /** @param z N-by-(q - 1): the locations, in the columns. @param lower, upper of each observation, infinite where it
  says nothing. @param sizes of the numbers of which each was computed in doubles. */
  AffineRow(const Eigen::MatrixXd& z, const std::vector<Real>& lower, const std::vector<Real>& upper,
            const std::vector<Real>& sizes, AffineRest rest = {});

  /** Takes this place for c, by the variables of the rest, until the next call. */
  void LookFrom(const std::vector<Real>& place);

  /** An upper bound on d . (M_k, b_k), d of q entries; none if there is no finite one, or no parameters. */
  [[nodiscard]] std::optional<Real> Upper(const std::vector<Real>& direction) const;
  [[nodiscard]] std::optional<Real> Lower(std::vector<Real> direction) const;

  /** No parameters agree with all observations: found by a query, or while the slopes were derived. */
  [[nodiscard]] bool IsEmpty() const { return emptiness_ != Emptiness::kNone; }
  /** And doubles show it. */
  [[nodiscard]] bool IsVisiblyEmpty() const { return emptiness_ == Emptiness::kVisible; }
  [[nodiscard]] bool IsBounded() const { return !slopes_.empty(); }
  /** M_k at the middle of its hull, rounded to 2^-16 of the hull's magnitude: what the certifier multiplies with. One
  entry for each column. @pre IsBounded(). */
  [[nodiscard]] const std::vector<double>& slopes() const { return slopes_; }
  /** Bounds on |M_k - slopes()|. */
  [[nodiscard]] const std::vector<Real>& reach() const { return reach_; }
  /** A rounding of slopes() is too close to tell: the certifier may have gone the other way. */
  [[nodiscard]] bool IsAmbiguous() const { return is_ambiguous_; }

 private:
  enum class Emptiness { kNone, kHidden, kVisible };
  using Basis = std::vector<Eigen::Index>;

  [[nodiscard]] bool FindBasis();
  void DeriveSlopes();
  void SetSlope(const Real& lower, const Real& upper);
  [[nodiscard]] Real ValueAt(Eigen::Index i, const std::vector<Real>& theta) const;
  struct Violated {
    Eigen::Index row = -1;
    bool above = false;
  };
  [[nodiscard]] Violated MostViolated(const Basis& basis, const std::vector<Real>& theta) const;
  [[nodiscard]] std::vector<Real> Weights(const Basis& basis, const std::vector<Real>& direction) const;
  [[nodiscard]] std::vector<Real> Perturbed(std::vector<Real> direction) const;
  [[nodiscard]] std::vector<Real> Vertex(const Basis& basis, const std::vector<Real>& weights) const;
  void Judge(const Basis& basis, const std::vector<Real>& alpha, const Violated& violated) const;

  Eigen::MatrixXd rows_;  // (z_i, 1)
  std::vector<Real> given_lower_, given_upper_, sizes_;
  AffineRest rest_;
  std::vector<Real> lower_, upper_;  // seen from c
  std::vector<double> rough_lower_, rough_upper_;
  mutable Basis basis_;  // where the last query ended
  mutable Emptiness emptiness_ = Emptiness::kNone;
  std::vector<double> slopes_;
  std::vector<Real> reach_;
  bool is_ambiguous_ = false;
};

}  // namespace forereach::verifier
