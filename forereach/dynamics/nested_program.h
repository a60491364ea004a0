/** Evaluates a program over two boxes at once, the inner one inside the outer: in a step the center of a slice, or what
a stage makes of it, and the slice's hull.

Nodes of the same operation that do not need each other follow each other in memory and are evaluated in one loop. What
only second derivatives need is evaluated over the outer box alone, two nodes at a time. Sines and cosines take one call
of the C library for both boxes. docs/soundness.md, 3.3. */
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "forereach/dynamics/program.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/interval.h"
#include "forereach/numerics/lanes.h"

namespace forereach {

class NestedProgram final {
 public:
  /** Whether all numbers over each box are below kModerate (interval_pair.h). Otherwise none of them is a bound. */
  struct Moderate {
    bool inner, outer;
  };

  /** @param program with its derivatives. @param parameters the ranges of its parameters. */
  NestedProgram(const Program& program, std::span<const Interval> parameters);

  /** The doubles that an evaluation needs. */
  [[nodiscard]] std::size_t size() const { return size_; }

  /** Sets parameters and constants, once for any number of evaluations. */
  void Begin(double* values) const noexcept;
  /** The variables' pairs (interval_pair.h), four doubles each, are at the front of `values`, which the caller sets.
  @param second whether also what only second derivatives need is evaluated. */
  [[nodiscard]] Moderate Evaluate(bool second, double* values,
                                  InstructionSet instructions = BestInstructionSet()) const noexcept;

  /** Where the pair of a value or a first derivative is in `values`. */
  [[nodiscard]] int PairPlace(int node) const { return place_[ToSize(node)]; }
  /** Where the interval of any derivative over the outer box is. */
  [[nodiscard]] int OuterPlace(int node) const {
    return place_[ToSize(node)] + (is_nested_[ToSize(node)] != 0 ? 2 : 0);
  }

 private:
  // Places of the operands. Those of a sine are its own and the tangent's, or -1 without one.
  struct Operands {
    int a, b;
  };
  // Nodes of one operation, one behind the other from `place` on; a sine with its cosine.
  struct Run {
    Op op;
    int exponent;     // of kPower
    int first, last;  // of operands_
    int place;
  };

  std::vector<unsigned char> Choose(const Program& program);
  void Arrange(const Program& program, std::span<const unsigned char> needed, bool nested, std::vector<Run>& runs);
  int Take(std::size_t count);
  [[nodiscard]] inline Moderate EvaluateInline(bool second, double* values) const noexcept;
  template <bool kNested>
  [[nodiscard]] FOREREACH_INLINE LaneMask EvaluateRuns(const std::vector<Run>& runs, double* values) const noexcept;

  std::vector<unsigned char> is_nested_;
  std::vector<int> place_;
  std::vector<double> given_;  // the pairs of parameters and constants
  bool given_is_moderate_ = true;
  std::size_t given_at_ = 0, size_ = 0;
  std::vector<Operands> operands_;
  std::vector<Run> nested_, outer_;
};

}  // namespace forereach
