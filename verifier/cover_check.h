/** Confirms or refutes a declared slope by its cover, in intervals of 128 bits. A cover divides the domain into boxes
with a bound each.

The boxes cover the domain because of the tree: a cut inside a box leaves two parts whose union is the box. Each bound
is rederived by the verifier's own parser and rules of differentiation. */
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "forereach/declare/cover.h"
#include "forereach/dynamics/parametric_residual.h"
#include "forereach/reach/domain.h"
#include "verifier/answer.h"
#include "verifier/slopes.h"

namespace forereach::verifier {

/** The claim |d r_row / d z_column| <= bound over the domain and all parameters, with the cover that proves it. */
struct SlopeClaim {
  int row, column;
  double bound;
  Cover cover;
};

/** kYes: the claim is proved. kNo: it is false, or the cover is invalid. kUnknown: neither is shown. */
struct CoverVerdict {
  Answer answer = Answer::kYes;
  std::string what;  ///< Unless kYes: the claim that fails, with its numbers.
};

/** Checks the claims about one residual over one domain. Any number of threads may check at once. */
class CoverChecker final {
 public:
  /** @param domain valid for the residual. @throws ExpressionError (expressions.h) if it is not in the language. */
  CoverChecker(const Domain& domain, const ParametricResidual& residual);

  /** The derivatives (row, column) that are not identically zero. Each of them needs a claim. */
  [[nodiscard]] std::vector<std::pair<int, int>> Entries() const { return slopes_.Entries(); }

  /** Checks one claim. @param checked is called after each leaf. Cost: for the point mass about 1 ms for each box. */
  [[nodiscard]] CoverVerdict Check(const SlopeClaim& claim, const std::function<void()>& checked = {}) const;

 private:
  Domain domain_;
  ParametricResidual residual_;
  Slopes slopes_;
};

}  // namespace forereach::verifier
