#include "forereach/dynamics/interpreted_model.h"

#include <utility>

#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

InterpretedModel::InterpretedModel(const Program& program, std::vector<Interval> parameters, ModelNames names)
    : NominalModel(program, std::move(parameters), std::move(names)), terms_(program) {
  for (int k = 0; k < program.states; ++k) rows_[ToSize(k)] = internal::RowOf(program, k);
}

void InterpretedModel::EncloseRemainder(Method method, const Zonotope& slice, const double* half_width,
                                        const PlainInterval* hessian, const double* error, Remainder& out,
                                        InstructionSet instructions) const noexcept {
  Dispatch<&internal::EncloseBy<internal::RemainderTerms>>(instructions, terms_, method, slice, half_width, hessian,
                                                           error, out);
}

void InterpretedModel::Map(const Expansion& expansion, const StepError& error, const Zonotope& slice, Zonotope& next,
                           ImageSums& sums, InstructionSet instructions) const noexcept {
  Dispatch<&internal::MapByRows>(instructions, program(), rows_.data(), expansion, error, slice, next, sums);
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
