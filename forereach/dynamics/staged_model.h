/** A nominal model whose step is an integrator's, with stages x_s between the state x and its successor:

    midpoint:  k_1 = f(x, u),  x+ = x + dt f(x + dt/2 k_1, u);
    rk4:       k_2 = f(x + dt/2 k_1, u),  k_3 = f(x + dt/2 k_2, u),  k_4 = f(x + dt k_3, u),
               x+ = x + dt/6 (k_1 + 2 k_2 + 2 k_3 + k_4).

The successor as one program would have the derivatives of each stage written out in those of the stages before. Here
they are numbers, by intervals (nested_program.h, chain_rule.h). docs/soundness.md, 3.3. */
#pragma once

#include <memory>
#include <vector>

#include "forereach/dynamics/interpreted_model.h"

namespace forereach {

class StagedModel final : public InterpretedModel {
 public:
  /** @param rates the program of f, with its derivatives. @param dt the step, s. The integrator is that of
  `names.text`, which has to be midpoint or rk4; otherwise std::invalid_argument. */
  StagedModel(std::shared_ptr<const ProgramDraft> rates, double dt, std::vector<Interval> parameters, ModelNames names);

  void EvaluateWide(std::span<const double> z, std::span<long double> next) const noexcept override;
  void LinearizeOver(std::span<const Interval> box, Linearization& out) const noexcept override;
  void EncloseHessian(std::span<const Interval> box, HessianEnclosure& out) const noexcept override;
  void EncloseExpansion(std::span<const Interval> point, std::span<const Interval> box, Expansion& out,
                        ExpansionError& error) const noexcept override;
  /** Infinite: a step uses the enclosures above. */
  [[nodiscard]] ExpansionError BoundError(std::span<const Interval> domain) const override;
  /** No number. */
  void Expand(std::span<const double> z, std::span<const PlainInterval> box, Expansion& out,
              InstructionSet instructions = BestInstructionSet()) const noexcept override;

  class Stages;

 private:
  StagedModel(std::shared_ptr<const Stages> stages, std::vector<Interval> parameters, ModelNames names);

  std::shared_ptr<const Stages> stages_;
};

}  // namespace forereach
