/** One step of the reachable tube, Eq. (propagation) and Eq. (order-reduction):

    X_{t+1} = red < f0(c) + mu, [J G, diag(q), diag(h)] >,

with J = D_z f0(c), q the remainder half-width over Box(Z_t), mu and h the middle and half-width of the residual
envelope. All rounding, that of f0(c), J and J G included, is added to h. */
#pragma once

#include <array>
#include <span>

#include "certifier/dynamics/model.h"
#include "certifier/reach/domain.h"
#include "certifier/residual/enclosure.h"
#include "certifier/sets/zonotope.h"

namespace forereach {

/** What one step found on its way. */
struct StepRecord {
  ResidualBounds envelope;
  std::array<double, kMaxStates> remainder;  ///< q
};

struct StepResult {
  enum class Status {
    kDone,
    kDomainExit,          ///< Box(Z_t) is not proven to lie in Z_cert; `exit` says where.
    kNoFiniteEnclosure,   ///< The nominal map or the residual has no finite bound; `coordinate` says which.
    kInconsistent         ///< No admissible residual exists over Z_t: lower > upper in `coordinate`.
  };
  Status status = Status::kDone;
  DomainExit exit{};
  int coordinate = -1;
};

/** Immutable, so any number of threads may step at once. Refers to its parts, which must outlive it. */
class Propagator final {
 public:
  Propagator(const NominalModel& model, const Domain& domain, const ResidualEnclosure& residual, int zonotope_order)
      : model_(model), domain_(domain), residual_(residual), order_(zonotope_order) {}

  /** Advances `slice` under `input` into `next`. Where it does not reach kDone, `next` is unspecified. Allocates
  nothing. @pre order * n + 2 n <= kMaxGenerators, and slice has at most order * n generators. */
  [[nodiscard]] StepResult Step(const Zonotope& slice, std::span<const double> input, Zonotope& next,
                                StepRecord& record) const noexcept;

 private:
  const NominalModel& model_;
  const Domain& domain_;
  const ResidualEnclosure& residual_;
  int order_;
};

}  // namespace forereach
