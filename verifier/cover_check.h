/** Confirms or refutes a declared slope: a cover of the domain with a bound for each of its boxes, in intervals of 128
bits.

That the boxes cover the domain follows from the tree: a cut inside a box leaves two parts that together are the box.
Each bound is then derived anew, from the verifier's own formulas of the derivative. */
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "certifier/declare/cover.h"
#include "certifier/dynamics/parametric_residual.h"
#include "certifier/reach/domain.h"
#include "verifier/answer.h"
#include "verifier/slopes.h"

namespace forereach::verifier {

/** That |d r_row / d z_column| <= bound over the domain and all parameters, and what it rests on. */
struct SlopeClaim {
  int row, column;
  double bound;
  Cover cover;
};

/** kYes: holds. kNo: does not, or the cover is none. kUnknown: neither was shown. */
struct CoverVerdict {
  Answer answer = Answer::kYes;
  std::string what;  ///< Unless kYes: the claim that fails, with its numbers.
};

/** For all claims of one residual over one domain. Any number of threads may check at once. */
class CoverChecker final {
 public:
  /** @param domain valid. @throws std::invalid_argument for a residual that the verifier does not know. */
  CoverChecker(const Domain& domain, const ParametricResidual& residual);

  /** The derivatives that are not zero everywhere: each needs a claim. */
  [[nodiscard]] std::vector<std::pair<int, int>> Entries() const { return slopes_->Entries(); }

  /** About 1 ms a box of the point mass. @param checked is called after each leaf. */
  [[nodiscard]] CoverVerdict Check(const SlopeClaim& claim, const std::function<void()>& checked = {}) const;

 private:
  Domain domain_;
  ParametricResidual residual_;
  std::unique_ptr<Slopes> slopes_;
};

}  // namespace forereach::verifier
