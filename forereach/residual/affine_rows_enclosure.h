/** The enclosure of a residual some of whose rows are affine (AffineRows): these by their parameters that agree with
the observations, the others by another enclosure.

Of an affine row with rest G, over a query set with center (c, u) and half-widths r,
    r_k(z) - slope_k . (x - c)  in  [bounds on r_k(c, u)] +- sum_l (max |M_kl - slope_kl| + G_kl) r_l.
M and b are taken anew in each step: that they are the same in all of them is not used between steps. */
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "forereach/residual/affine_set.h"
#include "forereach/residual/consistency.h"
#include "forereach/residual/declaration.h"
#include "forereach/residual/enclosure.h"
#include "forereach/residual/observations.h"

namespace forereach {

class AffineRowsEnclosure final : public ResidualEnclosure {
 public:
  /** @param others bounds all rows, and sets no slope of an affine one; it must outlive this object. @param
  domain_lower, domain_upper as of LipschitzEnvelope. @pre declaration.Validate passed. Cost: AffineSet::Derive for each
  affine row. */
  AffineRowsEnclosure(const Declaration& declaration, const Observations& observations,
                      std::span<const double> domain_lower, std::span<const double> domain_upper,
                      const ResidualEnclosure& others);

  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override;

  /** Adds an observation; the rest is not to be called meanwhile. Cost: AffineSet::Learn for each affine row. @param
   * lower, upper n entries: enclosures of the observed residual. */
  void Add(int id, std::span<const double> z, std::span<const double> lower, std::span<const double> upper);

  [[nodiscard]] const std::optional<AffineContradiction>& contradiction() const { return contradiction_; }
  /** Of row k, which is affine. */
  [[nodiscard]] const AffineSet& set(int k) const;
  [[nodiscard]] const Declaration& declaration() const { return declaration_; }

 private:
  [[nodiscard]] Interval Observed(std::size_t i, std::span<const double> lower, std::span<const double> upper) const;
  void TakeContradiction(std::size_t i);

  Declaration declaration_;
  const ResidualEnclosure& others_;
  std::vector<AffineSet> sets_;  // of declaration_.affine.rows
  std::optional<AffineContradiction> contradiction_;
};

/** Declaration and observations without their affine rows, which are zeros: for what knows of L alone. */
[[nodiscard]] Declaration WithoutAffineRows(Declaration declaration);
[[nodiscard]] Observations WithoutAffineRows(const Declaration& declaration, Observations observations);

/** Whether these observations contradict the affine rows of a declaration: a proof in real arithmetic, if any. @param
domain_lower, domain_upper as above. */
[[nodiscard]] std::optional<AffineContradiction> FindAffineContradiction(const Declaration& declaration,
                                                                         const Observations& observations,
                                                                         std::span<const double> domain_lower,
                                                                         std::span<const double> domain_upper);

/** As a violation, with its gap as the difference and `most` as the bound: `second` is the latest of the observations,
`first` the one that is predicted or, if that is the latest, the most decisive of the others. */
[[nodiscard]] Violation AsViolation(const AffineContradiction& contradiction);

}  // namespace forereach
