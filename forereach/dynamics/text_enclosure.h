/** Functions of z = (x, u) from the expressions of a task file, enclosed over boxes of states: what a limit is judged
by, and where a part of the body stands.

A value is enclosed as a step of a model is, to the second order around the center c of the box,
    h(x, u) = h(c, u) + Dh(c, u) (x - c) + 1/2 (x - c)^T H (x - c),    H in D^2 h(Box, u),
so it stays correlated with the states; and also by its range over the box, which is finite where a kink leaves no
finite H. All of it is interval arithmetic. Parameters may be ranges. */
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "forereach/dynamics/text_program.h"
#include "forereach/numerics/interval.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"

namespace forereach {

class Zonotope;

/** One value h over a box around c: for every x in the box, h(x, u) lies in slope . (x - c) + offset and in range. */
struct AffineEnclosure {
  std::array<double, kMaxStates> slope;  ///< n entries in use, all finite.
  Interval offset, range;                ///< Infinite where there is no bound.
};

class TextEnclosure final {
 public:
  /** @throws as MakeProgram and RequireDerivatives; std::invalid_argument also if there are too many derivatives. */
  TextEnclosure(const ExpressionNames& names, std::span<const ExpressionText> expressions);

  /** The values, in the order of the expressions, and their derivatives. */
  [[nodiscard]] Program program() const { return program_->View(); }
  [[nodiscard]] int num_values() const { return static_cast<int>(uses_input_.size()); }
  /** Whether expression k names an input, itself or through a definition. */
  [[nodiscard]] bool UsesInput(int k) const { return uses_input_[ToSize(k)]; }

  /** Encloses every expression over the box {x : |x - center| <= half_width} for one input, or for all that are within
  its error, and for all values of the parameters. @param center, half_width n entries, finite and not negative.
  @param input m entries. @param input_error m entries, finite and not negative, or none: zeros. @param values
  num_values() entries. Cost O(operations); it allocates nothing. */
  void Enclose(std::span<const double> center, std::span<const double> half_width, std::span<const double> input,
               std::span<AffineEnclosure> values, std::span<const double> input_error = {}) const noexcept;

 private:
  std::shared_ptr<const ProgramDraft> program_;
  std::vector<unsigned char> over_box_;  // the nodes that values and second derivatives depend on
  std::vector<bool> uses_input_;
  std::vector<Interval> parameters_;
};

/** An interval that contains h(x, u) for every x in the slice. @param value that of a box around the slice, with its
center. Cost O(n m) for m generators. */
[[nodiscard]] Interval RangeOver(const Zonotope& slice, const AffineEnclosure& value) noexcept;

}  // namespace forereach
