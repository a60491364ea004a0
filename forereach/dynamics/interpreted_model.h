/** Remainder and image of a model whose derivatives are lists that were made at run time. */
#pragma once

#include <array>
#include <vector>

#include "forereach/dynamics/image.h"
#include "forereach/dynamics/model.h"
#include "forereach/dynamics/remainder.h"

namespace forereach {

class InterpretedModel : public NominalModel {
 public:
  /** As NominalModel. */
  InterpretedModel(const Program& program, std::vector<Interval> parameters, ModelNames names);

  void EncloseRemainder(Method method, const Zonotope& slice, const double* half_width, const PlainInterval* hessian,
                        const double* error, Remainder& out,
                        InstructionSet instructions = BestInstructionSet()) const noexcept override;
  void Map(const Expansion& expansion, const StepError& error, const Zonotope& slice, Zonotope& next, ImageSums& sums,
           InstructionSet instructions = BestInstructionSet()) const noexcept override;

 private:
  internal::RemainderTerms terms_;
  std::array<internal::RowSpan, kMaxStates> rows_{};
};

}  // namespace forereach
