/** Compiled equations in the place of interpreted ones. A program that calls UseCompiled<Equations>() before it reads a
task computes with straight-line code wherever the task's model is a text with the same program, operation by operation:
all decisions have the same bits and the same digests, so that every other process and command goes by the text. */
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "forereach/dynamics/equations_model.h"

namespace forereach {

/** Whether two programs compute their values by the same operations. The order of independent operations, and
operations that no value needs, make no difference. */
[[nodiscard]] bool HaveSameValues(const Program& one, const Program& other);

namespace internal {

using MakeCompiled = std::shared_ptr<const NominalModel> (*)(std::vector<Interval> parameters, ModelNames names);

/** @param name for messages. @param program a constant. */
void AddCompiled(const char* name, const Program& program, MakeCompiled make);

}  // namespace internal

/** Uses the compiled equations, a struct that `forereach export-model` wrote, for texts with the same program. Call it
before other threads run. */
template <class Equations>
void UseCompiled() {
  internal::AddCompiled(Equations::kName, EquationsModel<Equations>::kProgram,
                        [](std::vector<Interval> parameters, ModelNames names) -> std::shared_ptr<const NominalModel> {
                          return std::make_shared<EquationsModel<Equations>>(std::move(parameters), std::move(names));
                        });
}

}  // namespace forereach
