/** A nominal model whose equations are one program (program.h). Everything is computed by interpretation of the
program, with the operations of the compiled code in the same order, so equal equations give equal bits. Enclosures by
intervals use ranges of the parameters; where a parameter is not a point there is no plain expansion. */
#pragma once

#include <memory>
#include <vector>

#include "forereach/dynamics/interpreted_model.h"

namespace forereach {

class ProgramModel : public InterpretedModel {
 public:
  /** @param program must outlive the model. */
  ProgramModel(const Program& program, std::vector<Interval> parameters, ModelNames names);
  /** The same for a draft that has its derivatives. */
  ProgramModel(std::shared_ptr<const ProgramDraft> draft, std::vector<Interval> parameters, ModelNames names);

  void EvaluateWide(std::span<const double> z, std::span<long double> next) const noexcept override;
  void LinearizeOver(std::span<const Interval> box, Linearization& out) const noexcept override;
  void EncloseHessian(std::span<const Interval> box, HessianEnclosure& out) const noexcept override;
  [[nodiscard]] ExpansionError BoundError(std::span<const Interval> domain) const override;

  void Expand(std::span<const double> z, std::span<const PlainInterval> box, Expansion& out,
              InstructionSet instructions = BestInstructionSet()) const noexcept override;

 private:
  std::shared_ptr<const ProgramDraft> draft_;  // null if the program is a constant
  std::vector<int> at_point_, over_box_;       // the nodes that an expansion needs, in order
};

}  // namespace forereach
