/** The verifier's own bounds of affine rows of the residual, r_k(z) = M_k z + b_k, over all parameters that agree with
the known observations:  max and min of d . (M_k, b_k) subject to  lower_i <= (z_i, 1) . (M_k, b_k) <= upper_i.

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

/** The parameters of one row. Its columns are those of z that the row depends on. */
class AffineRow {
 public:
  /** @param z N-by-(q - 1): the locations, in the columns. @param lower, upper of each observation, infinite where it
  says nothing. @param sizes of the numbers of which each was computed in doubles. */
  AffineRow(const Eigen::MatrixXd& z, std::vector<Real> lower, std::vector<Real> upper, std::vector<Real> sizes);

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
  std::vector<Real> lower_, upper_, sizes_;
  std::vector<double> rough_lower_, rough_upper_;
  mutable Basis basis_;  // where the last query ended
  mutable Emptiness emptiness_ = Emptiness::kNone;
  std::vector<double> slopes_;
  std::vector<Real> reach_;
  bool is_ambiguous_ = false;
};

}  // namespace forereach::verifier
