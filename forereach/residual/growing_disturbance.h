/** The part of a disturbance's bound that depends on state and input: |w_k| <= w^_k + |d_k(x, u)|, with d_k expressions
of a task file. Their sign does not count, so no expression is wrong because it is negative somewhere.
docs/soundness.md, 3.11. */
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "forereach/dynamics/model.h"
#include "forereach/dynamics/model_text.h"
#include "forereach/numerics/interval.h"

namespace forereach {

class ProgramDraft;

/** Immutable; the expressions are compiled once. */
class GrowingDisturbance final {
 public:
  /** The text of a d_k that is zero. */
  static constexpr const char* kNone = "0";

  /** @param bounds d_k in the unit of state k, one for each, in the names of the model's states, inputs, parameters and
  definitions. @throws as MakeProgram (text_program.h), and ExpressionError if one depends on how often an angle has
  turned; std::invalid_argument if there is not one for each state. */
  GrowingDisturbance(const NominalModel& model, std::vector<ExpressionText> bounds);

  [[nodiscard]] const std::vector<ExpressionText>& bounds() const { return bounds_; }

  /** Sets sizes[k] to an interval that contains |d_k(z)| for every z in the box and all values of the parameters; its
  upper end is infinite where d_k may be undefined or has no bound there. By interval arithmetic with outward rounding
  (docs/soundness.md, 2.1). Allocates nothing. @param box d_z entries. @param sizes n entries. */
  void Enclose(std::span<const Interval> box, std::span<Interval> sizes) const noexcept;

  /** The first state whose d_k has no finite bound over the box by Enclose, and a part of the box where it has none
  either: small in the variables by which that differs from place to place, and whole in the others. */
  [[nodiscard]] std::optional<std::pair<int, std::vector<Interval>>> FindUnbounded(std::vector<Interval> box) const;

 private:
  std::vector<ExpressionText> bounds_;
  std::shared_ptr<const ProgramDraft> program_;
  std::vector<unsigned char> needed_;
  std::vector<Interval> parameters_;
};

}  // namespace forereach
