/** One step of the reachable tube, Eq. (propagation) and Eq. (order-reduction):

    X_{t+1} = red < f0(c) + rho + mu, [J G, diag(q), diag(h)] > + [-s', s'],

with J = D_z f0(c), rho and q the middle and half-width of the remainder over Box(Z_t), mu and h those of the residual
envelope. All rounding, that of f0(c), J and J G included, goes to the slack s', with |J| s of the slack before it. */
#pragma once

#include <array>
#include <span>

#include "certifier/dynamics/expansion.h"
#include "certifier/dynamics/model.h"
#include "certifier/dynamics/rounding.h"
#include "certifier/reach/domain.h"
#include "certifier/residual/enclosure.h"
#include "certifier/sets/zonotope.h"

namespace forereach {

/** What one step found on its way. */
struct StepRecord {
  std::array<double, kMaxStates> half_width;  ///< r, of the hull of X_t
  ResidualBounds envelope;
  Remainder remainder;
};

struct StepResult {
  enum class Status {
    kDone,
    kDomainExit,         ///< Box(Z_t) is not proven to lie in Z_cert; `exit` says where.
    kNoFiniteEnclosure,  ///< The nominal map or the residual has no finite bound; `coordinate` says which.
    kInconsistent        ///< No admissible residual exists over Z_t: lower > upper in `coordinate`.
  };
  Status status = Status::kDone;
  DomainExit exit{};
  int coordinate = -1;
};

/** Immutable, so any number of threads may step at once. Refers to its parts, which must outlive it. */
class Propagator final {
 public:
  Propagator(const NominalModel& model, const Domain& domain, const ResidualEnclosure& residual, int zonotope_order,
             Method method);

  /** Advances `slice` under `input` into `next`. Where it does not reach kDone, `next` is unspecified. Allocates
  nothing. @pre order * n + 2 n <= kMaxGenerators, and slice has at most order * n generators.
  @param record its half_width is given (HalfWidths), the rest is set. @param next_half_width n entries: the same of
  `next`, for the step after. */
  [[nodiscard]] StepResult Step(const Zonotope& slice, std::span<const double> input, StepRecord& record,
                                Zonotope& next, double* next_half_width) const noexcept;

  /** Upper bounds on the half-widths of the slice's hull, n of them. */
  static void HalfWidths(const Zonotope& slice, double* half_width) noexcept;

 private:
  void ExpandByIntervals(std::span<const double> center, std::span<const PlainInterval> hull, Expansion& expansion,
                         ExpansionError& error) const noexcept;
  [[nodiscard, gnu::noinline]] StepResult StepByIntervals(const Zonotope& slice, std::span<const double> input,
                                                          std::span<const double> center,
                                                          std::span<const PlainInterval> hull, StepRecord& record,
                                                          Zonotope& next, double* next_half_width) const noexcept;
  // Everything but what the model, the envelope and the reduction do, once for each instruction set.
  [[nodiscard]] FOREREACH_INLINE StepResult StepInline(const Zonotope& slice, std::span<const double> input,
                                                       StepRecord& record, Zonotope& next,
                                                       double* next_half_width) const noexcept;
  [[nodiscard]] StepResult StepAvx2(const Zonotope& slice, std::span<const double> input, StepRecord& record,
                                    Zonotope& next, double* next_half_width) const noexcept;
  [[nodiscard]] StepResult StepBaseline(const Zonotope& slice, std::span<const double> input, StepRecord& record,
                                        Zonotope& next, double* next_half_width) const noexcept;
  [[nodiscard]] FOREREACH_INLINE StepResult Advance(const Zonotope& slice, std::span<const double> input,
                                                    const Expansion& expansion, const StepError& error,
                                                    StepRecord& record, Zonotope& next,
                                                    double* next_half_width) const noexcept;
  const NominalModel& model_;
  DomainTest domain_;
  const ResidualEnclosure& residual_;
  int order_;
  Method method_;
  StepError error_;
  bool plain_;
};

}  // namespace forereach
