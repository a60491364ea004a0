/** A nominal model from one definition of its equations. To add a model, write a struct like KinematicBicycle
(models/kinematic_bicycle.h) and construct EquationsModel<YourModel>.

`Equations` has
- kStates, kInputs: n <= kMaxStates and m <= kMaxInputs;
- kName, kStateNames, kInputNames, kParameterNames: names for people, task files and digests;
- parameters(): the values of the parameters, in the units of the equations;
- Step<T>(parameters, z, next): the equations x+ = f0(x, u) over any scalar type T, with z = (x, u).

The program of operations and derivatives is a compile-time constant, so each function below is straight-line code. */
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "forereach/dynamics/angles.h"
#include "forereach/dynamics/expand.h"
#include "forereach/dynamics/image.h"
#include "forereach/dynamics/program_model.h"
#include "forereach/dynamics/remainder.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

template <class Equations>
class EquationsModel final : public ProgramModel {
 public:
  static constexpr Program kProgram = ProgramOf<Equations>::kProgram;
  static_assert(Equations::kStates <= kMaxStates && Equations::kInputs <= kMaxInputs);

  /** @param angles the states that are angles, by their indices, ascending. @throws std::invalid_argument unless they
  are angles of these equations (angles.h). */
  explicit EquationsModel(const Equations& equations, std::vector<int> angles = {})
      : ProgramModel(kProgram, List<Interval>(equations.parameters()),
                     {Equations::kName,
                      List<std::string>(Equations::kStateNames),
                      List<std::string>(Equations::kInputNames),
                      List<std::string>(Equations::kParameterNames),
                      {},
                      std::move(angles)}) {
    RequireAngles(kProgram, this->angles(), this->state_names(), false);
  }

  /** With other values or ranges of the parameters, under other names. */
  EquationsModel(std::vector<Interval> parameters, ModelNames names)
      : ProgramModel(kProgram, std::move(parameters), std::move(names)) {}

  void Expand(std::span<const double> z, std::span<const PlainInterval> box, Expansion& out,
              InstructionSet instructions = BestInstructionSet()) const noexcept override {
    Dispatch<&internal::Expand<kProgram>>(instructions, parameters().data(), z.data(), box.data(), out);
  }

  void EncloseRemainder(Method method, const Zonotope& slice, const double* half_width, const PlainInterval* hessian,
                        const double* error, Remainder& out,
                        InstructionSet instructions = BestInstructionSet()) const noexcept override {
    Dispatch<&internal::EncloseConstant<kProgram>>(instructions, method, slice, half_width, hessian, error, out);
  }

  void Map(const Expansion& expansion, const StepError& error, const Zonotope& slice, Zonotope& next, ImageSums& sums,
           InstructionSet instructions = BestInstructionSet()) const noexcept override {
    Dispatch<&internal::Map<kProgram>>(instructions, expansion, error, slice, next, sums);
  }

 private:
  template <class Entry, class Array>
  static std::vector<Entry> List(const Array& array) {
    return {array.begin(), array.end()};
  }
};

}  // namespace forereach

FOREREACH_ARITHMETIC_END
