/** An integrator's formula as the evaluations of the rates that it makes: x+ = x + sum of weight_s k_s, with
k_s = f(x + before_s k_{s-1}, u). */
#pragma once

#include <vector>

#include "forereach/dynamics/model_text.h"
#include "forereach/numerics/compilation.h"

namespace forereach {

/** A part of the step: dt / `divisor`, or nothing if that is 0. */
struct StepPart {
  int divisor;

  [[nodiscard]] bool is_nothing() const { return divisor == 0; }
  template <class T>
  [[nodiscard]] T Of(double dt) const {
    return is_nothing() ? T(0) : T(dt) / T(divisor);
  }
};

/** One evaluation of the rates: at x + before k, k that of the evaluation before. Its own k counts with `weight`. */
struct StageEvaluation {
  StepPart before, weight;
};

/** Whether the step is bounded stage by stage (staged_model.h); otherwise it is one program. */
[[nodiscard]] inline bool HasStages(ModelText::Integrator integrator) {
  return integrator == ModelText::Integrator::kMidpoint || integrator == ModelText::Integrator::kRk4;
}

/** Equations of the next state count as one evaluation, at x. */
[[nodiscard]] inline std::vector<StageEvaluation> EvaluationsOf(ModelText::Integrator integrator) {
  switch (integrator) {
    case ModelText::Integrator::kMidpoint: return {{{0}, {0}}, {{2}, {1}}};
    case ModelText::Integrator::kRk4: return {{{0}, {6}}, {{2}, {3}}, {{2}, {3}}, {{1}, {6}}};
    case ModelText::Integrator::kNone:
    case ModelText::Integrator::kEuler: break;
  }
  return {{{0}, {1}}};
}

}  // namespace forereach
