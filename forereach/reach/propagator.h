/** One step of the reachable tube, Eq. (propagation) and Eq. (order-reduction):

    X_{t+1} = red < f0(c) + rho + mu, [(J + A) G, diag(q), diag(h + w^)] > + [-s', s'],

with J = D_z f0(c), rho and q the middle and half-width of the Taylor remainder over Box(Z_t), and mu, h and A the
middle, half-width and slope of the residual's bounds. The slope is zero for the residual envelope, Eq. (set-envelope).
w^ bounds the disturbance of the step (Declaration::disturbance). The paper has rho = 0 and w^ = 0; docs/mathematics.md
defines them. The slack s' contains (|J| + |A|) s of the previous slack and all rounding errors, including those of
f0(c), J and (J + A) G. Where boundaries of steps may be off their times, step_offsets.h says what is added; where the
inputs that act may be off the plan's, acted_inputs.h does. Where the bound on the disturbance depends on state and
input, w^ is its sup over the hull of Z_t, with the inputs that act. */
#pragma once

#include <array>
#include <memory>
#include <span>

#include "forereach/dynamics/expansion.h"
#include "forereach/dynamics/model.h"
#include "forereach/dynamics/rounding.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/reach/acted_inputs.h"
#include "forereach/reach/domain.h"
#include "forereach/reach/step_offsets.h"
#include "forereach/residual/enclosure.h"
#include "forereach/residual/growing_disturbance.h"
#include "forereach/residual/region_grid.h"

namespace forereach {

class Zonotope;

/** Intermediate results of one step. */
struct StepRecord {
  std::array<double, kMaxStates> half_width;  ///< r: upper bounds on the half-widths of Box(X_t), n entries in use.
  ResidualBounds envelope;                    ///< The residual's lower and upper bounds over Z_t.
  Remainder remainder;                        ///< rho and q.
};

struct StepResult {
  enum class Status {
    kDone,
    kDomainExit,         ///< Box(Z_t) is not proven to lie in Z_cert; `exit` names the constraint.
    kNoFiniteEnclosure,  ///< Coordinate `coordinate` of the nominal map or of the residual has no finite bound.
    kInconsistent        ///< No admissible residual exists over Z_t: lower > upper in coordinate `coordinate`.
  };
  Status status = Status::kDone;
  DomainExit exit{};
  int coordinate = -1;
};

/** Computes single steps. It is immutable, so any number of threads may use it at once. */
class Propagator final {
 public:
  /** @param model, domain, residual must outlive this object. @param zonotope_order rho of Eq. (order-reduction): a
  slice has at most zonotope_order * n generators after a step. @param method bounds the remainder.
  @param disturbance w^, n entries or none. @param instructions changes the computing time only. @param inputs how far
  those that act may be off. @param growing what w^ has beyond that (Declaration::growing), or null.
  @param regions bound the disturbance instead of w^ (region_grid.h), or null.
  @param separable a bit for each state that may be apart from others: where every step maps e_k to itself, generators
  along it become slack (AppendAndReduce).
  @throws std::invalid_argument as StepOffsets. */
  Propagator(const NominalModel& model, const Domain& domain, const ResidualEnclosure& residual,
             const Eigen::VectorXd& disturbance, int zonotope_order, Method method,
             InstructionSet instructions = BestInstructionSet(), const StepTiming& timing = {}, ActedInputs inputs = {},
             std::shared_ptr<const GrowingDisturbance> growing = {}, unsigned separable = ~0u,
             std::shared_ptr<const RegionGrid> regions = {});

  /** Computes `next` = X_{t+1} from `slice` = X_t under `input` = u_t (m entries). If the status is not kDone, `next`
  is unspecified. It allocates nothing.
  @param record the caller sets half_width (see HalfWidths); the step sets the other members.
  @param next_half_width n entries: set to the half-widths of `next`, for the following step.
  @param is_first `slice` is X_0. With offsets, the last generator of every other slice is that of its boundary's.
  @pre order * n + 2 n + 1 <= kMaxGenerators, and `slice` has at most order * n generators, not counting this one.
  Cost O(n m) for m generators, plus the residual enclosure and the reduction. */
  [[nodiscard]] StepResult Step(const Zonotope& slice, std::span<const double> input, StepRecord& record,
                                Zonotope& next, double* next_half_width, bool is_first = true) const noexcept;

  /** Writes n upper bounds on the half-widths of Box(slice). */
  static void HalfWidths(const Zonotope& slice, double* half_width) noexcept;

 private:
  [[nodiscard, gnu::noinline]] StepResult StepByIntervals(const Zonotope& slice, std::span<const double> input,
                                                          std::span<const double> center,
                                                          std::span<const PlainInterval> hull, StepRecord& record,
                                                          Zonotope& next, double* next_half_width,
                                                          bool is_first) const noexcept;
  // What disturbs one step whose inputs have errors, or whose disturbance depends on it: unexpected_ with that, what
  // the inputs add to f0, and both.
  struct Disturbed {
    std::array<double, kMaxStates> unexpected, of_model, by_all;
    std::array<PlainInterval, kMaxVariables> hull;  // with the inputs that may act
  };
  [[gnu::noinline]] void Disturb(std::span<const PlainInterval> hull, Disturbed& all) const noexcept;
  // The step without model, envelope and reduction. It is quicker with constant numbers of states and inputs; zeros:
  // those of the slice and the input.
  template <std::size_t kStates, std::size_t kInputs>
  [[nodiscard]] FOREREACH_INLINE StepResult StepInline(const Zonotope& slice, std::span<const double> input,
                                                       StepRecord& record, Zonotope& next, double* next_half_width,
                                                       bool is_first) const noexcept;
  template <std::size_t kStates>
  [[nodiscard]] FOREREACH_INLINE StepResult Advance(const Zonotope& slice, std::span<const double> input,
                                                    std::span<const PlainInterval> hull, const Expansion& expansion,
                                                    const StepError& error, StepRecord& record, Zonotope& next,
                                                    double* next_half_width, bool is_first) const noexcept;
  const NominalModel& model_;
  DomainTest domain_;
  const ResidualEnclosure& residual_;
  std::array<double, kMaxStates> unexpected_{};  // w^, and what the errors of the inputs add to the residual
  ActedInputs inputs_;
  std::shared_ptr<const GrowingDisturbance> growing_;
  std::shared_ptr<const RegionGrid> regions_;  // then w^ is not in unexpected_
  StepOffsets offsets_;
  int order_;
  Method method_;
  InstructionSet instructions_;
  StepError error_;
  bool plain_;
  unsigned lasting_;  // axes that the slack holds (AppendAndReduce)
  std::array<double, kMaxStates> negligible_{};
};

}  // namespace forereach
