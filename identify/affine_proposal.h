/** Rows of the residual as affine (AffineRows) and as rows with slopes: which of the two the observations refute, and
after how many. Nothing that is proposed is proven. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "forereach/residual/affine_set.h"
#include "identify/proposal.h"

namespace forereach {

/** What the observations leave of row k, with the columns, the rest and the errors of `declaration`. Cost: one Derive.
 */
[[nodiscard]] AffineSet AffineSetOf(const Declaration& declaration, const Observations& observations, int k,
                                    const Domain& domain);

/** So many observations, in their order, refute a declaration. */
struct Refutation {
  int after = 0;
  std::vector<int> by;  ///< Few of them that refute it alone, ascending.
};

/** That no M z + b agrees with row k, for the same; none if all observations agree with one. Cost: some tens of Derive.
 */
[[nodiscard]] std::optional<Refutation> RefuteAffine(const Declaration& declaration, const Observations& observations,
                                                     int k, const Domain& domain);

/** What the observations say of one row that needs slopes, with the proposed sigma and w^. */
struct JudgedRow {
  int row = 0;
  std::optional<Refutation> affine;     ///< No M z + b agrees with them.
  std::optional<Refutation> lipschitz;  ///< A pair contradicts the slopes that the first half proposes, in the second.
  /** If refuted as affine: the smallest slopes of what the best plane leaves. Otherwise zeros. */
  Eigen::RowVectorXd left;
  double rest_share = 0;  ///< Their sum over that of the row's own slopes, weighed as in SmallestRow.
};

struct AffineProposal {
  /** JudgedRow::rest_share up to which an affine row is proposed, with `left` times the factor as its rest. */
  static constexpr double kMostRest = 0.5;

  std::vector<int> columns;  ///< Those of all rows that vary.
  std::vector<JudgedRow> rows;
  /** The proposal with affine rows in place of slopes, and bounds on those slopes that errors of z need; the
  observations do not contradict it. No affine rows: none are proposed. */
  Declaration declaration;
  /** Why none are, though some rows would do: too many columns, no bound (Certifier::Unexcited), or a contradiction. */
  std::string why_none;
};

/** @param problem the task's. @param observations, options of Propose, which made `proposal`. Cost: for each row some
tens of AffineSet::Derive, and two linear programs like Propose's. */
[[nodiscard]] AffineProposal ProposeAffine(const Problem& problem, const Observations& observations,
                                           const ProposedDeclaration& proposal, const ProposalOptions& options);

}  // namespace forereach
